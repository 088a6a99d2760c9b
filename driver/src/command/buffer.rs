//! Command pools and command buffers, and recording: the states of a command buffer, and the state that recording
//! needs.

use super::Command;
use super::render_scope::RenderScope;
use crate::abi::error::Error;
use crate::abi::guard::guard;
use crate::abi::handle::{self, Reporter, objects};
use crate::abi::valid;
use crate::device::Device;
use crate::enabled::Enabled;
use crate::physical_device::formats;
use ash::vk;
use simdevice::{Format, Packet, host};
use std::collections::HashSet;
use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A command pool. It owns the handles of its command buffers.
pub(crate) struct CommandPool {
    device: Arc<Device>,
    /// True if command buffers may be reset individually.
    allows_reset: bool,
    buffers: Mutex<HashSet<vk::CommandBuffer>>,
}

/// A command buffer.
pub(crate) struct CommandBuffer {
    device: Arc<Device>,
    level: vk::CommandBufferLevel,
    allows_reset: bool,
    recorder: Mutex<Recorder>,
}

objects! {
    vk::CommandPool => CommandPool;
    vk::CommandBuffer => CommandBuffer {
        fn reporter(&self) -> Option<Arc<dyn Reporter>> {
            self.device.reporter()
        }
    };
}

impl CommandPool {
    /// An empty pool.
    pub(crate) fn new(device: Arc<Device>, flags: vk::CommandPoolCreateFlags) -> Self {
        Self {
            device,
            allows_reset: flags.contains(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER),
            buffers: Mutex::default(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, HashSet<vk::CommandBuffer>> {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Allocates a command buffer.
    pub(crate) fn allocate(&self, level: vk::CommandBufferLevel) -> vk::CommandBuffer {
        let buffer = handle::create(Arc::new(CommandBuffer {
            device: Arc::clone(&self.device),
            level,
            allows_reset: self.allows_reset,
            recorder: Mutex::new(Recorder::new()),
        }));
        self.lock().insert(buffer);
        buffer
    }

    /// Frees command buffers of this pool; others are not freed.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if one is not of this pool.
    ///
    /// # Safety
    /// Nothing uses the handles any more.
    pub(crate) unsafe fn free(&self, buffers: &[vk::CommandBuffer]) -> Result<(), Error> {
        let null = vk::CommandBuffer::null();
        for &buffer in buffers.iter().filter(|&&buffer| buffer != null) {
            if !self.lock().remove(&buffer) {
                return Err(Error::usage(
                    "VUID-vkFreeCommandBuffers-pCommandBuffers-parent",
                    "a command buffer is not of the pool",
                ));
            }
            // SAFETY: the pool made the handle and has not destroyed it, and the caller no longer uses it.
            unsafe { handle::destroy(buffer) }?;
        }
        Ok(())
    }

    /// Frees every command buffer.
    ///
    /// # Safety
    /// As [`CommandPool::free`].
    pub(crate) unsafe fn free_all(&self) -> Result<(), Error> {
        let all: Vec<_> = self.lock().iter().copied().collect();
        // SAFETY: the caller's promise.
        unsafe { self.free(&all) }
    }

    /// Resets every command buffer.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if one is pending.
    pub(crate) fn reset(&self) -> Result<(), Error> {
        self.lock().iter().try_for_each(|&buffer| {
            // SAFETY: the pool made the handle and has not destroyed it.
            unsafe { handle::get(buffer) }?.recorder().reset()
        })
    }
}

impl CommandBuffer {
    /// Its recorder. Vulkan requires that only one thread at a time uses a command buffer, so the lock is never
    /// contended.
    pub(crate) fn recorder(&self) -> MutexGuard<'_, Recorder> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The device to which it belongs.
    pub(super) fn device(&self) -> &Device {
        &self.device
    }

    /// Reports whether it is a secondary command buffer.
    pub(crate) fn is_secondary(&self) -> bool {
        self.level == vk::CommandBufferLevel::SECONDARY
    }

    /// Reports whether it may be reset individually, explicitly or by beginning it again.
    pub(crate) fn allows_reset(&self) -> bool {
        self.allows_reset
    }

    /// Ends recording.
    ///
    /// # Errors
    /// Returns the error of [`Recorder::end`], or [`Error::Panic`] if a command panicked while it was recorded and so
    /// is missing.
    pub(crate) fn end(&self) -> Result<(), Error> {
        let panicked = self.recorder.is_poisoned();
        self.recorder.clear_poison();
        let mut recorder = self.recorder();
        if panicked {
            recorder.fail(Error::Panic("a command panicked while it was recorded".into()));
        }
        recorder.end()
    }

    /// Records a command. An error of `record` is reported now, and `vkEndCommandBuffer` fails with the first.
    ///
    /// # Errors
    /// Returns the error of `record`, or [`Error::InvalidUsage`] if the command buffer is not recording.
    pub(crate) fn record(
        &self,
        command: &'static str,
        record: impl FnOnce(&mut Recorder) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut recorder = self.recorder();
        recorder.command = command;
        recorder.require_recording()?;
        let recorded = host::catch(|| record(&mut recorder))
            .unwrap_or_else(|memory| Err(Error::OutOfHostMemory(memory.to_string())));
        recorded.inspect_err(|error| recorder.fail(error.clone()))
    }
}

/// The state of a command buffer. It is pending while a [`PendingUse`] of it exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Status {
    Initial,
    Recording,
    Executable,
    Invalid,
}

/// The uses for which a recording is begun.
#[derive(Clone, Debug, Default)]
pub(crate) struct BeginFlags {
    /// True if it is submitted only once.
    pub(crate) one_time: bool,
    /// True if it may be submitted while it is pending.
    pub(crate) simultaneous: bool,
    /// The colour formats of the pass in which it runs, if it is a secondary that continues one.
    pub(crate) inherited_pass: Option<Vec<Option<Format>>>,
}

/// The recorder of a command buffer.
pub(crate) struct Recorder {
    /// The name of the command that is being recorded.
    command: &'static str,
    status: Status,
    flags: BeginFlags,
    commands: Vec<Command>,
    finished: Option<Arc<Vec<Command>>>,
    /// The render pass, or dynamic rendering, within which commands are recorded.
    pub(super) pass: Option<RenderScope>,
    /// True within a set of Gaussian draws.
    pub(super) has_gaussian_set: bool,
    /// True while transform feedback is active.
    pub(super) captures: bool,
    error: Option<Error>,
    pending: Arc<AtomicUsize>,
}

/// The use of a command buffer by a submission or by another recording. The command buffer is pending as long as one
/// exists.
#[derive(Debug)]
pub(crate) struct PendingUse(Arc<AtomicUsize>);

impl PendingUse {
    fn new(count: &Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::AcqRel);
        Self(Arc::clone(count))
    }
}

impl Drop for PendingUse {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl Recorder {
    /// A command buffer in its initial state.
    pub(crate) fn new() -> Self {
        Self {
            command: "",
            status: Status::Initial,
            flags: BeginFlags::default(),
            commands: Vec::new(),
            finished: None,
            pass: None,
            has_gaussian_set: false,
            captures: false,
            error: None,
            pending: Arc::default(),
        }
    }

    /// Fails a command that isn't supported.
    ///
    /// # Errors
    /// [`Error::Unsupported`].
    pub(crate) fn refuse(&self) -> Result<(), Error> {
        Err(Error::Unsupported { command: self.command.to_owned() })
    }

    /// Fails within a set of Gaussian draws.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`].
    pub(super) fn require_no_gaussian_set(&self) -> Result<(), Error> {
        match self.has_gaussian_set {
            false => Ok(()),
            true => Err(Error::usage(
                "VUID-vkCmdBeginGaussianSetGAURAST-None-90003",
                "a set of draws that vkCmdBeginGaussianSetGAURAST has begun must end by vkCmdEndGaussianSetGAURAST \
                 before its subpass, its dynamic rendering or the command buffer ends, or secondaries are executed",
            )),
        }
    }

    /// Reports whether it may be begun again without an explicit reset.
    pub(crate) fn is_initial(&self) -> bool {
        self.status == Status::Initial
    }

    /// Returns to the initial state.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is pending.
    pub(crate) fn reset(&mut self) -> Result<(), Error> {
        if self.pending.load(Ordering::Acquire) > 0 {
            return Err(Error::usage("VUID-vkResetCommandBuffer-commandBuffer-00045", "the command buffer is pending"));
        }
        *self = Self::new();
        Ok(())
    }

    /// Starts a new recording.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is pending; a use of what is not allowed if it is recording.
    pub(crate) fn begin(&mut self, enabled: &Enabled, flags: BeginFlags) -> Result<(), Error> {
        enabled.require(self.status != Status::Recording, || {
            Error::usage("VUID-vkBeginCommandBuffer-commandBuffer-00049", "the command buffer is already recording")
        })?;
        self.reset()?;
        self.status = Status::Recording;
        self.pass = flags.inherited_pass.clone().map(|formats| RenderScope::Inherited { formats });
        self.flags = flags;
        Ok(())
    }

    /// Fails unless it is recording.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`].
    pub(crate) fn require_recording(&self) -> Result<(), Error> {
        if self.status == Status::Recording {
            return Ok(());
        }
        Err(Error::usage(
            self.rule("commandBuffer-recording"),
            format!("the command buffer is {:?}, not recording", self.status),
        ))
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// The first error met while recording, or [`Error::InvalidUsage`] if it was not recording or a pass has not ended.
    /// The command buffer is invalid then.
    pub(crate) fn end(&mut self) -> Result<(), Error> {
        self.command = "vkEndCommandBuffer";
        self.require_recording()?;
        self.status = Status::Invalid;
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        self.require_no_gaussian_set()?;
        if !matches!(self.pass, None | Some(RenderScope::Inherited { .. })) {
            return Err(Error::usage("VUID-vkEndCommandBuffer-commandBuffer-00060", "a render pass has not ended"));
        }
        self.finished = Some(Arc::new(std::mem::take(&mut self.commands)));
        self.status = Status::Executable;
        Ok(())
    }

    /// Makes [`Recorder::end`] fail with the first error.
    pub(crate) fn fail(&mut self, error: Error) {
        if self.status == Status::Recording {
            self.error.get_or_insert(error);
        }
    }

    /// Returns the recorded commands, for execution.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is not executable; a use of what is not allowed if it is pending and not for
    /// simultaneous use.
    pub(crate) fn submit(&mut self, enabled: &Enabled) -> Result<(Arc<Vec<Command>>, PendingUse), Error> {
        let Some(commands) = self.finished.as_ref().filter(|_| self.status == Status::Executable) else {
            return Err(Error::usage(
                "VUID-vkQueueSubmit-pCommandBuffers-00070",
                format!("a command buffer is {:?}, not executable", self.status),
            ));
        };
        enabled.require(self.flags.simultaneous || self.pending.load(Ordering::Acquire) == 0, || {
            Error::usage(
                "VUID-vkQueueSubmit-pCommandBuffers-00071",
                "a command buffer without VK_COMMAND_BUFFER_USAGE_SIMULTANEOUS_USE_BIT is pending already",
            )
        })?;
        if self.flags.one_time {
            self.status = Status::Invalid;
        }
        Ok((Arc::clone(commands), PendingUse::new(&self.pending)))
    }

    /// Returns the recorded commands, for a primary command buffer to execute.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is not executable.
    pub(crate) fn contents(&self) -> Result<Arc<Vec<Command>>, Error> {
        self.finished.clone().ok_or_else(|| {
            Error::usage(
                "VUID-vkCmdExecuteCommands-pCommandBuffers-00089",
                format!("a secondary command buffer is {:?}, not executable", self.status),
            )
        })
    }

    /// The id of a rule of the command that is being recorded.
    fn rule(&self, rule: &str) -> String {
        format!("VUID-{}-{rule}", self.command)
    }

    /// Appends a command.
    pub(crate) fn push(&mut self, command: Command) {
        host::push(&mut self.commands, command);
    }

    /// Appends a packet.
    pub(crate) fn packet(&mut self, packet: Packet) {
        host::push(&mut self.commands, Command::Packet(packet));
    }

    /// Fails inside a pass.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`].
    pub(crate) fn require_outside_pass(&self) -> Result<(), Error> {
        match self.pass {
            None => Ok(()),
            Some(_) => Err(Error::usage(self.rule("renderpass"), "the command must not be inside a render pass")),
        }
    }

    /// Fails outside a pass.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`].
    pub(crate) fn require_pass(&self) -> Result<(), Error> {
        self.pass().map(drop)
    }

    fn pass(&self) -> Result<&RenderScope, Error> {
        self.pass
            .as_ref()
            .ok_or_else(|| Error::usage(self.rule("renderpass"), "the command must be inside a render pass"))
    }

    /// The format of the current pass's colour attachment number `index`; `None` if it is unused.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] outside a pass.
    pub(crate) fn color_format(&self, index: usize) -> Result<Option<Format>, Error> {
        Ok(self.pass()?.color_formats().get(index).copied().flatten())
    }
}

/// The guarded body of a command that is recorded; see [`CommandBuffer::record`](CommandBuffer::record).
///
/// # Safety
/// The handle is live.
pub(crate) unsafe fn record(
    command_buffer: vk::CommandBuffer,
    command: &'static str,
    record: impl FnOnce(&mut Recorder) -> Result<(), Error>,
) {
    let () = guard(command_buffer, command, || {
        // SAFETY: the caller's promise.
        unsafe { handle::get(command_buffer)? }.record(command, record)
    });
}

/// The colour formats of the pass that a secondary command buffer continues.
///
/// # Safety
/// The inheritance info and its chain are valid.
unsafe fn inherited_formats(info: &vk::CommandBufferInheritanceInfo<'_>) -> Result<Vec<Option<Format>>, Error> {
    // SAFETY: the caller's promise.
    let formats = unsafe {
        if let Some(render_pass) = handle::get_optional(info.render_pass)? {
            render_pass.color_formats(info.subpass as usize).ok_or_else(|| {
                Error::usage(
                    "VUID-VkCommandBufferBeginInfo-flags-06001",
                    format!("the render pass has no subpass {}", info.subpass),
                )
            })?
        } else {
            let rendering = valid::find_in_chain::<vk::CommandBufferInheritanceRenderingInfo>(info.p_next);
            match rendering {
                None => Vec::new(),
                Some(rendering) => {
                    valid::slice(rendering.p_color_attachment_formats, rendering.color_attachment_count)?.to_vec()
                }
            }
        }
    };
    Ok(formats.into_iter().map(formats::device_format).collect())
}

#[doc(alias = "vkCreateCommandPool")]
pub(crate) fn create_command_pool(
    device: &Arc<Device>,
    create_info: &vk::CommandPoolCreateInfo<'_>,
) -> Result<Arc<CommandPool>, Error> {
    let device = Arc::clone(device);
    Ok(Arc::new(CommandPool::new(device, create_info.flags)))
}

/// # Safety
/// Nothing uses the pool's command buffers any more.
#[doc(alias = "vkDestroyCommandPool")]
pub(crate) unsafe fn destroy_command_pool(command_pool: Option<Arc<CommandPool>>) -> Result<(), Error> {
    match command_pool {
        // SAFETY: the caller's promise.
        Some(pool) => unsafe { pool.free_all() },
        None => Ok(()),
    }
}

#[doc(alias = "vkResetCommandPool")]
pub(crate) fn reset_command_pool(command_pool: &CommandPool) -> Result<(), Error> {
    command_pool.reset()
}

#[doc(alias = "vkAllocateCommandBuffers")]
pub(crate) fn allocate_command_buffers(
    command_pool: &CommandPool,
    level: vk::CommandBufferLevel,
    command_buffers: &mut [MaybeUninit<vk::CommandBuffer>],
) -> Result<(), Error> {
    for place in command_buffers {
        place.write(command_pool.allocate(level));
    }
    Ok(())
}

/// # Safety
/// Nothing uses the command buffers any more.
#[doc(alias = "vkFreeCommandBuffers")]
pub(crate) unsafe fn free_command_buffers(
    command_pool: &CommandPool,
    command_buffers: &[vk::CommandBuffer],
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe { command_pool.free(command_buffers) }
}

/// # Safety
/// The begin info, its inheritance info and their handles are valid.
#[doc(alias = "vkBeginCommandBuffer")]
pub(crate) unsafe fn begin_command_buffer(
    command_buffer: &CommandBuffer,
    begin_info: &vk::CommandBufferBeginInfo<'_>,
) -> Result<(), Error> {
    use vk::CommandBufferUsageFlags as Usage;
    let given = begin_info.flags;
    let inherits = command_buffer.is_secondary() && given.contains(Usage::RENDER_PASS_CONTINUE);
    let flags = BeginFlags {
        one_time: given.contains(Usage::ONE_TIME_SUBMIT),
        simultaneous: given.contains(Usage::SIMULTANEOUS_USE),
        inherited_pass: if inherits {
            // SAFETY: the caller's promise.
            unsafe { Some(inherited_formats(valid::input(begin_info.p_inheritance_info)?)?) }
        } else {
            None
        },
    };
    let mut recorder = command_buffer.recorder();
    let enabled = command_buffer.device().enabled();
    enabled.require(recorder.is_initial() || command_buffer.allows_reset(), || {
        Error::usage(
            "VUID-vkBeginCommandBuffer-commandBuffer-00050",
            "the command buffer's pool lacks VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT",
        )
    })?;
    recorder.begin(enabled, flags)
}

#[doc(alias = "vkEndCommandBuffer")]
pub(crate) fn end_command_buffer(command_buffer: &CommandBuffer) -> Result<(), Error> {
    command_buffer.end()
}

#[doc(alias = "vkResetCommandBuffer")]
pub(crate) fn reset_command_buffer(command_buffer: &CommandBuffer) -> Result<(), Error> {
    command_buffer.device().enabled().require(command_buffer.allows_reset(), || {
        Error::usage(
            "VUID-vkResetCommandBuffer-commandBuffer-00046",
            "the command buffer's pool lacks VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT",
        )
    })?;
    command_buffer.recorder().reset()
}

#[doc(alias = "vkCmdExecuteCommands")]
pub(crate) fn cmd_execute_commands(
    command_buffer: &CommandBuffer,
    command_buffers: &[Arc<CommandBuffer>],
) -> Result<(), Error> {
    if command_buffer.is_secondary() {
        return Err(Error::usage(
            "VUID-vkCmdExecuteCommands-bufferlevel",
            "a secondary command buffer executes others",
        ));
    }
    command_buffer.record("vkCmdExecuteCommands", |recorder| {
        recorder.require_no_gaussian_set()?;
        let mut contents = host::with_capacity(command_buffers.len());
        for secondary in command_buffers {
            if !secondary.is_secondary() {
                return Err(Error::usage(
                    "VUID-vkCmdExecuteCommands-pCommandBuffers-00088",
                    "a primary command buffer is executed from another",
                ));
            }
            contents.push(secondary.recorder().contents()?);
        }
        recorder.push(Command::Execute(contents));
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instance::Instance;
    use crate::options::Options;

    fn record(flags: BeginFlags) -> Recorder {
        let mut recorder = Recorder::new();
        recorder.begin(&Enabled::strict(), flags).unwrap();
        recorder.packet(Packet::Barrier);
        recorder.end().unwrap();
        recorder
    }

    #[test]
    fn a_recording_is_executable_again_and_again() {
        let mut recorder = record(BeginFlags::default());
        for _ in 0..2 {
            let (commands, _pending) = recorder.submit(&Enabled::strict()).unwrap();
            assert_eq!(commands.len(), 1);
        }
        let pending = recorder.submit(&Enabled::strict()).unwrap();
        assert!(recorder.submit(&Enabled::strict()).is_err(), "pending");
        assert!(recorder.reset().is_err(), "pending");
        drop(pending);
        recorder.reset().unwrap();
        assert!(recorder.submit(&Enabled::strict()).is_err(), "initial");
    }

    #[test]
    fn a_one_time_recording_is_submitted_once() {
        let mut recorder = record(BeginFlags { one_time: true, ..BeginFlags::default() });
        drop(recorder.submit(&Enabled::strict()).unwrap());
        assert!(recorder.submit(&Enabled::strict()).is_err());
        recorder.begin(&Enabled::strict(), BeginFlags::default()).unwrap();
    }

    #[test]
    fn simultaneous_use_allows_several_submissions() {
        let mut recorder = record(BeginFlags { simultaneous: true, ..BeginFlags::default() });
        let _first = recorder.submit(&Enabled::strict()).unwrap();
        recorder.submit(&Enabled::strict()).unwrap();
    }

    #[test]
    fn the_first_error_ends_up_at_the_end() {
        let mut recorder = Recorder::new();
        assert!(recorder.end().is_err(), "not recording");
        recorder.begin(&Enabled::strict(), BeginFlags::default()).unwrap();
        recorder.fail(Error::OutOfDeviceMemory("first".into()));
        recorder.fail(Error::OutOfDeviceMemory("second".into()));
        let error = recorder.end().unwrap_err();
        assert!(error.to_string().contains("first"));
        assert!(recorder.submit(&Enabled::strict()).is_err(), "invalid");
        recorder.begin(&Enabled::strict(), BeginFlags::default()).unwrap();
        recorder.end().unwrap();
    }

    #[test]
    fn a_panic_while_recording_fails_the_recording() {
        let instance = Instance::new(vk::API_VERSION_1_3, &[], Options::default()).unwrap();
        let simulated = simdevice::Device::new(&simdevice::Config::default()).unwrap();
        let device = Device::new(instance, Enabled::strict(), simulated, &[]).unwrap();
        let buffer = CommandBuffer {
            device,
            level: vk::CommandBufferLevel::PRIMARY,
            allows_reset: true,
            recorder: Mutex::new(Recorder::new()),
        };
        buffer.recorder().begin(&Enabled::strict(), Default::default()).unwrap();
        let record = || buffer.record("vkCmdDraw", |_| panic!("in a test"));
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(record)).is_err());
        assert!(matches!(buffer.end(), Err(Error::Panic(_))));
        buffer.recorder().begin(&Enabled::strict(), Default::default()).unwrap();
        buffer.end().unwrap();
    }
}
