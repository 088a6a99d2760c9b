//! Recording: a command buffer's life, and the little that must be known while it is recorded.

use super::record::Command;
use crate::error::Error;
use crate::lower::rendering::BegunPass;
use simdevice::host;
use simdevice::{Format, Packet};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Where a command buffer is in its life. It is pending while a [`Pending`] of it lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Status {
    Initial,
    Recording,
    Executable,
    Invalid,
}

/// How a recording may be used.
#[derive(Clone, Debug, Default)]
pub(crate) struct Usage {
    /// It is submitted once.
    pub(crate) one_time: bool,
    /// It may be submitted while it is pending.
    pub(crate) simultaneous: bool,
    /// It is a secondary that runs inside a pass with these colour formats.
    pub(crate) inherited_pass: Option<Vec<Option<Format>>>,
}

/// The pass that is being recorded.
enum Pass {
    /// A render pass, at one of its subpasses.
    Begun {
        begun: Box<BegunPass>,
        subpass: usize,
        formats: Vec<Option<Format>>,
    },
    /// Dynamic rendering.
    Dynamic { formats: Vec<Option<Format>> },
    /// The primary's.
    Inherited { formats: Vec<Option<Format>> },
}

/// What a command buffer records into.
pub(crate) struct Recorder {
    status: Status,
    usage: Usage,
    commands: Vec<Command>,
    finished: Option<Arc<Vec<Command>>>,
    pass: Option<Pass>,
    error: Option<Error>,
    pending: Arc<AtomicUsize>,
}

/// A submission's or another recording's use of a command buffer, which is pending as long as one lives.
#[derive(Debug)]
pub(crate) struct Pending(Arc<AtomicUsize>);

impl Pending {
    fn new(count: &Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::AcqRel);
        Self(Arc::clone(count))
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl Recorder {
    /// A command buffer in its initial state.
    pub(crate) fn new() -> Self {
        Self {
            status: Status::Initial,
            usage: Usage::default(),
            commands: Vec::new(),
            finished: None,
            pass: None,
            error: None,
            pending: Arc::default(),
        }
    }

    /// Whether it may be begun again without an explicit reset.
    pub(crate) fn is_initial(&self) -> bool {
        self.status == Status::Initial
    }

    /// Back to the initial state.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is pending.
    pub(crate) fn reset(&mut self) -> Result<(), Error> {
        if self.pending.load(Ordering::Acquire) > 0 {
            return Err(Error::usage(
                "VUID-vkResetCommandBuffer-commandBuffer-00045",
                "the command buffer is pending",
            ));
        }
        *self = Self::new();
        Ok(())
    }

    /// Starts recording anew.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is pending or recording.
    pub(crate) fn begin(&mut self, usage: Usage) -> Result<(), Error> {
        if self.status == Status::Recording {
            return Err(Error::usage(
                "VUID-vkBeginCommandBuffer-commandBuffer-00049",
                "the command buffer is already recording",
            ));
        }
        self.reset()?;
        self.status = Status::Recording;
        self.pass = usage
            .inherited_pass
            .clone()
            .map(|formats| Pass::Inherited { formats });
        self.usage = usage;
        Ok(())
    }

    /// Fails unless it is recording.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub(crate) fn require_recording(&self) -> Result<(), Error> {
        if self.status == Status::Recording {
            return Ok(());
        }
        Err(Error::usage(
            "VUID-vkCmd-commandBuffer-recording",
            format!("the command buffer is {:?}, not recording", self.status),
        ))
    }

    /// Ends recording.
    ///
    /// # Errors
    /// The first error met while recording, or [`Error::Usage`] if it was not recording or a pass has not ended. The
    /// command buffer is invalid then.
    pub(crate) fn end(&mut self) -> Result<(), Error> {
        self.require_recording()?;
        self.status = Status::Invalid;
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        if !matches!(self.pass, None | Some(Pass::Inherited { .. })) {
            return Err(Error::usage(
                "VUID-vkEndCommandBuffer-commandBuffer-00060",
                "a render pass has not ended",
            ));
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

    /// What was recorded, to be executed.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is not executable, or pending and not for simultaneous use.
    pub(crate) fn submit(&mut self) -> Result<(Arc<Vec<Command>>, Pending), Error> {
        let Some(commands) = self
            .finished
            .as_ref()
            .filter(|_| self.status == Status::Executable)
        else {
            return Err(Error::usage(
                "VUID-vkQueueSubmit-pCommandBuffers-00070",
                format!("a command buffer is {:?}, not executable", self.status),
            ));
        };
        if self.pending.load(Ordering::Acquire) > 0 && !self.usage.simultaneous {
            return Err(Error::usage(
                "VUID-vkQueueSubmit-pCommandBuffers-00071",
                "a command buffer without VK_COMMAND_BUFFER_USAGE_SIMULTANEOUS_USE_BIT is pending already",
            ));
        }
        if self.usage.one_time {
            self.status = Status::Invalid;
        }
        Ok((Arc::clone(commands), Pending::new(&self.pending)))
    }

    /// What was recorded, for a primary command buffer to execute.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is not executable.
    pub(crate) fn contents(&self) -> Result<Arc<Vec<Command>>, Error> {
        self.finished.clone().ok_or_else(|| {
            Error::usage(
                "VUID-vkCmdExecuteCommands-pCommandBuffers-00089",
                format!(
                    "a secondary command buffer is {:?}, not executable",
                    self.status
                ),
            )
        })
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
    /// [`Error::Usage`].
    pub(crate) fn require_outside_pass(&self) -> Result<(), Error> {
        match self.pass {
            None => Ok(()),
            Some(_) => Err(Error::usage(
                "VUID-vkCmd-renderpass",
                "the command must not be inside a render pass",
            )),
        }
    }

    /// Fails outside a pass.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub(crate) fn require_pass(&self) -> Result<(), Error> {
        self.pass().map(drop)
    }

    fn pass(&self) -> Result<&Pass, Error> {
        self.pass.as_ref().ok_or_else(|| {
            Error::usage(
                "VUID-vkCmd-renderpass",
                "the command must be inside a render pass",
            )
        })
    }

    /// The format of the current pass's colour attachment number `index`; `None` where it is unused.
    ///
    /// # Errors
    /// [`Error::Usage`] outside a pass.
    pub(crate) fn color_format(&self, index: usize) -> Result<Option<Format>, Error> {
        let (Pass::Begun { formats, .. } | Pass::Dynamic { formats } | Pass::Inherited { formats }) =
            self.pass()?;
        Ok(formats.get(index).copied().flatten())
    }

    /// Begins a render pass at its first subpass.
    ///
    /// # Errors
    /// [`Error::Usage`] inside a pass, or if the framebuffer lacks an attachment.
    pub(crate) fn begin_render_pass(&mut self, begun: BegunPass) -> Result<(), Error> {
        self.require_outside_pass()?;
        self.enter_subpass(Box::new(begun), 0)
    }

    /// Goes on with the next subpass.
    ///
    /// # Errors
    /// [`Error::Usage`] outside a render pass, or after its last subpass.
    pub(crate) fn next_subpass(&mut self) -> Result<(), Error> {
        match self.pass.take() {
            Some(Pass::Begun { begun, subpass, .. }) => {
                self.packet(Packet::EndRendering);
                self.enter_subpass(begun, subpass + 1)
            }
            other => {
                self.pass = other;
                Err(not_begun("a render pass"))
            }
        }
    }

    fn enter_subpass(&mut self, begun: Box<BegunPass>, subpass: usize) -> Result<(), Error> {
        let packet = begun.subpass(subpass)?;
        for clear in begun.clears_before_reads(subpass)? {
            self.packet(clear);
        }
        let formats = color_formats(&packet);
        self.packet(packet);
        self.pass = Some(Pass::Begun {
            begun,
            subpass,
            formats,
        });
        Ok(())
    }

    /// Ends a render pass.
    ///
    /// # Errors
    /// [`Error::Usage`] outside a render pass.
    pub(crate) fn end_render_pass(&mut self) -> Result<(), Error> {
        match self.pass.take() {
            Some(Pass::Begun { .. }) => {
                self.packet(Packet::EndRendering);
                Ok(())
            }
            other => {
                self.pass = other;
                Err(not_begun("a render pass"))
            }
        }
    }

    /// Begins dynamic rendering by its packet.
    ///
    /// # Errors
    /// [`Error::Usage`] inside a pass.
    pub(crate) fn begin_rendering(&mut self, packet: Packet) -> Result<(), Error> {
        self.require_outside_pass()?;
        self.pass = Some(Pass::Dynamic {
            formats: color_formats(&packet),
        });
        self.packet(packet);
        Ok(())
    }

    /// Ends dynamic rendering.
    ///
    /// # Errors
    /// [`Error::Usage`] outside dynamic rendering.
    pub(crate) fn end_rendering(&mut self) -> Result<(), Error> {
        match self.pass.take() {
            Some(Pass::Dynamic { .. }) => {
                self.packet(Packet::EndRendering);
                Ok(())
            }
            other => {
                self.pass = other;
                Err(not_begun("dynamic rendering"))
            }
        }
    }
}

fn not_begun(what: &str) -> Error {
    Error::usage(
        "VUID-vkCmdEndRendering-None-06161",
        format!("{what} has not begun in this command buffer"),
    )
}

/// The formats of the colour attachments of a [`Packet::BeginRendering`].
fn color_formats(packet: &Packet) -> Vec<Option<Format>> {
    let Packet::BeginRendering(rendering) = packet else {
        return Vec::new();
    };
    let format = |attachment: &Option<simdevice::packet::Attachment>| {
        attachment.as_ref().map(|attachment| attachment.view.format)
    };
    rendering.color.iter().map(format).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(usage: Usage) -> Recorder {
        let mut recorder = Recorder::new();
        recorder.begin(usage).unwrap();
        recorder.packet(Packet::Barrier);
        recorder.end().unwrap();
        recorder
    }

    #[test]
    fn a_recording_is_executable_again_and_again() {
        let mut recorder = record(Usage::default());
        for _ in 0..2 {
            let (commands, _pending) = recorder.submit().unwrap();
            assert_eq!(commands.len(), 1);
        }
        let pending = recorder.submit().unwrap();
        assert!(recorder.submit().is_err(), "pending");
        assert!(recorder.reset().is_err(), "pending");
        drop(pending);
        recorder.reset().unwrap();
        assert!(recorder.submit().is_err(), "initial");
    }

    #[test]
    fn a_one_time_recording_is_submitted_once() {
        let mut recorder = record(Usage {
            one_time: true,
            ..Usage::default()
        });
        drop(recorder.submit().unwrap());
        assert!(recorder.submit().is_err());
        recorder.begin(Usage::default()).unwrap();
    }

    #[test]
    fn simultaneous_use_allows_several_submissions() {
        let mut recorder = record(Usage {
            simultaneous: true,
            ..Usage::default()
        });
        let _first = recorder.submit().unwrap();
        recorder.submit().unwrap();
    }

    #[test]
    fn the_first_error_ends_up_at_the_end() {
        let mut recorder = Recorder::new();
        assert!(recorder.end().is_err(), "not recording");
        recorder.begin(Usage::default()).unwrap();
        recorder.fail(Error::OutOfDeviceMemory("first".into()));
        recorder.fail(Error::OutOfDeviceMemory("second".into()));
        let error = recorder.end().unwrap_err();
        assert!(error.to_string().contains("first"));
        assert!(recorder.submit().is_err(), "invalid");
        recorder.begin(Usage::default()).unwrap();
        recorder.end().unwrap();
    }

    #[test]
    fn passes_are_begun_and_ended() {
        let mut recorder = Recorder::new();
        recorder.begin(Usage::default()).unwrap();
        assert!(recorder.end_rendering().is_err());
        assert!(recorder.require_pass().is_err());
        recorder.begin_rendering(Packet::Barrier).unwrap();
        assert!(recorder.require_outside_pass().is_err());
        assert!(recorder.end_render_pass().is_err());
        assert!(recorder.next_subpass().is_err());
        assert!(recorder.color_format(0).unwrap().is_none());
        recorder.end_rendering().unwrap();
        recorder.require_outside_pass().unwrap();
        recorder.begin_rendering(Packet::Barrier).unwrap();
        assert!(recorder.end().is_err(), "a pass has not ended");
    }
}
