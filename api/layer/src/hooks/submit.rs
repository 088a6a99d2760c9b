//! Submission: what buffers hold when draws execute.

use std::cell::Cell;
use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::ffi::c_void;
use std::hash::{Hash, Hasher};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;

use crate::device::{Device, State};
use crate::facts::Camera;
use crate::objects::{BufferDescriptor, Objects};
use crate::pending::{LateDraw, Pending, Signal};
use crate::recording::{Call, Draw, Operation};
use crate::report::Faults;
use crate::rules::contents;
use crate::rules::reader::Reader;
use gaurast_layer_interface::{find, slice};

const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;
/// The most views whose principal points are remembered.
const MOST_VIEWS: usize = 4096;
/// The most bytes of a transfer that the layer follows.
const MOST_BYTES: u64 = 512 << 20;

pub(super) unsafe extern "system" fn queue_submit(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(queue) else {
            return FAILED;
        };
        let Some(next) = own.next.queue_submit else {
            return FAILED;
        };
        let submits_ = slice(submits, count);
        let commands = submits_.iter().flat_map(|submit| slice(submit.p_command_buffers, submit.command_buffer_count));
        let commands: Vec<_> = commands.copied().collect();
        submit(&own, queue, fence, &commands, |state| signals(state, submits_), || next(queue, count, submits, fence))
    }
}

pub(super) unsafe extern "system" fn queue_submit2(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo2<'_>,
    fence: vk::Fence,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(queue) else {
            return FAILED;
        };
        let Some(next) = own.next.queue_submit2 else {
            return FAILED;
        };
        let submits_ = slice(submits, count);
        let infos =
            submits_.iter().flat_map(|submit| slice(submit.p_command_buffer_infos, submit.command_buffer_info_count));
        let commands: Vec<_> = infos.map(|info| info.command_buffer).collect();
        submit(&own, queue, fence, &commands, |state| signals2(state, submits_), || next(queue, count, submits, fence))
    }
}

/// The values of timeline semaphores that the last of some batches signals: it ends after the others.
///
/// # Safety
/// The batches are valid.
unsafe fn signals(state: &State, submits: &[vk::SubmitInfo<'_>]) -> Vec<Signal> {
    let Some(last) = submits.last() else {
        return Vec::new();
    };
    // SAFETY: the caller's promise.
    unsafe {
        let values = find::<vk::TimelineSemaphoreSubmitInfo<'_>>(last.p_next);
        let values = values.map(|info| slice(info.p_signal_semaphore_values, info.signal_semaphore_value_count));
        let semaphores = slice(last.p_signal_semaphores, last.signal_semaphore_count).iter();
        let pairs = semaphores.zip(values.unwrap_or_default());
        let timelines = pairs.filter(|(semaphore, _)| state.objects.timelines.contains(semaphore));
        timelines.map(|(&semaphore, &value)| Signal { semaphore, value }).collect()
    }
}

/// As [`signals`].
///
/// # Safety
/// The batches are valid.
unsafe fn signals2(state: &State, submits: &[vk::SubmitInfo2<'_>]) -> Vec<Signal> {
    let Some(last) = submits.last() else {
        return Vec::new();
    };
    // SAFETY: the caller's promise.
    let infos = unsafe { slice(last.p_signal_semaphore_infos, last.signal_semaphore_info_count) };
    let timelines = infos.iter().filter(|info| state.objects.timelines.contains(&info.semaphore));
    timelines.map(|info| Signal { semaphore: info.semaphore, value: info.value }).collect()
}

/// Looks at command buffers that are submitted by `next`, and remembers them if they write what their draws read.
fn submit(
    own: &Device,
    queue: vk::Queue,
    fence: vk::Fence,
    commands: &[vk::CommandBuffer],
    signals: impl FnOnce(&State) -> Vec<Signal>,
    next: impl FnOnce() -> vk::Result,
) -> vk::Result {
    let mut pending = Pending { queue, fence, signals: Vec::new(), draws: Vec::new() };
    own.observe(|state, faults| {
        for late in take_signalled(own, state) {
            look_late(own, state, &late, faults);
        }
        pending.signals = signals(state);
        pending.draws = execute(own, state, commands, faults);
    });
    let result = next();
    if result == vk::Result::SUCCESS {
        own.observe(|state, _| state.pending.push(pending));
    }
    result
}

/// The draws of submissions whose fences or semaphores are signalled.
pub(super) fn take_signalled(device: &Device, state: &mut State) -> Vec<LateDraw> {
    state.pending.take_ended(|pending| is_signalled(device, pending))
}

/// Reports whether a submission has ended, as far as its fence and its semaphores tell.
fn is_signalled(device: &Device, pending: &Pending) -> bool {
    let of_fence = pending.fence != vk::Fence::null()
        && device.next.get_fence_status.is_some_and(|get| {
            // SAFETY: the fence lives: its destruction waits for the lock that the caller holds, and removes it.
            unsafe { get(device.handle, pending.fence) == vk::Result::SUCCESS }
        });
    let mut signals = pending.signals.iter();
    of_fence
        || signals.any(|signal| {
            let mut value = 0;
            let got = device.next.get_semaphore_counter_value.map(|get| {
                // SAFETY: the semaphore lives, as the fence does.
                unsafe { get(device.handle, signal.semaphore, &raw mut value) }
            });
            got == Some(vk::Result::SUCCESS) && value >= signal.value
        })
}

/// Follows what command buffers do, in order; gives the draws whose contents are known late.
fn execute(device: &Device, state: &mut State, commands: &[vk::CommandBuffer], faults: &mut Faults) -> Vec<LateDraw> {
    let recordings = commands.iter().filter_map(|commands| state.recordings.get(commands));
    let operations: Vec<_> = recordings.flat_map(|recording| recording.operations.clone()).collect();
    let last_dispatch = operations.iter().rposition(|operation| matches!(operation, Operation::Dispatch));
    let mut late = Vec::new();
    for operation in &operations {
        if let Operation::Draw(draw) = operation {
            note_cameras(device, state, draw);
        }
    }
    for (index, operation) in operations.into_iter().enumerate() {
        let objects = &mut state.objects;
        match operation {
            Operation::Copy(from, to, regions) => copy(device, objects, from, to, &regions),
            Operation::Update(to, offset, bytes) => write(objects, to, offset, bytes),
            Operation::Fill(to, offset, size, word) => {
                let rest = objects.buffers.get(&to).map_or(0, |buffer| buffer.size.saturating_sub(offset));
                let size = if size == vk::WHOLE_SIZE { rest } else { size };
                if size > MOST_BYTES {
                    forget(objects, to, offset, size);
                } else {
                    let words = vec![word.to_ne_bytes(); (size / 4) as usize];
                    write(objects, to, offset, Arc::new(words.concat()));
                }
            }
            Operation::Write(to) => {
                if let Some(buffer) = objects.buffers.get_mut(&to) {
                    buffer.is_written = true;
                }
            }
            Operation::Dispatch => {}
            Operation::Draw(draw) => {
                if look(device, state, &draw, faults) {
                    late.push(LateDraw { draw, is_followed: last_dispatch > Some(index) });
                }
            }
        }
    }
    late
}

/// Notes the principal points of a draw's cameras.
fn note_cameras(device: &Device, state: &mut State, draw: &Draw) {
    let cameras = contents::known_cameras(draw, &Contents::new(device, state, false));
    for camera in &cameras {
        if state.principal_points.len() >= MOST_VIEWS {
            state.principal_points.clear();
        }
        let points = state.principal_points.entry(contents::view_key(camera)).or_default();
        // Two tell as much as many.
        if points.len() < 2 {
            points.insert(camera.principal_point.map(f32::to_bits));
        }
    }
}

/// Looks at a draw as it is submitted, and at its contents once. Reports whether they are known only when it has ended.
fn look(device: &Device, state: &mut State, draw: &Draw, faults: &mut Faults) -> bool {
    let key = key(draw, &state.objects);
    let is_new = !draw.was_checked.load(Ordering::Relaxed) && !state.checked.contains(&key);
    let contents = Contents::new(device, state, false);
    let look = contents::Look { reader: &contents, facts: &device.facts, with_attributes: is_new };
    look.check(draw, faults);
    let is_late = contents.is_known_late.get();
    if !is_late {
        draw.was_checked.store(true, Ordering::Relaxed);
        state.checked.insert(key);
    }
    is_late
}

/// Looks at a draw when its submission has ended.
pub(super) fn look_late(device: &Device, state: &mut State, late: &LateDraw, faults: &mut Faults) {
    let draw = &*late.draw;
    let key = key(draw, &state.objects);
    let is_new = !draw.was_checked.load(Ordering::Relaxed) && !state.checked.contains(&key);
    let with_attributes = is_new && !late.is_followed;
    let mut found = Faults::default();
    let contents = Contents::new(device, state, true);
    let look = contents::Look { reader: &contents, facts: &device.facts, with_attributes };
    look.check(draw, &mut found);
    if with_attributes {
        draw.was_checked.store(true, Ordering::Relaxed);
        state.checked.insert(key);
    }
    for fault in &mut found.0 {
        fault.text += " (read when the submission had ended, since the device writes it)";
    }
    faults.0.append(&mut found.0);
}

/// A hash of a draw's pipeline, buffers and counts, by which each is checked once.
fn key(draw: &Draw, objects: &Objects) -> u64 {
    let mut hasher = DefaultHasher::new();
    draw.pipeline.serial.hash(&mut hasher);
    match draw.call {
        Call::Vertices(numbers) => numbers.hash(&mut hasher),
        Call::Indices(numbers, offset) => (numbers, offset).hash(&mut hasher),
        Call::Indirect(call) => (objects.serial_of(call.buffer), call.offset).hash(&mut hasher),
    }
    for (binding, bound) in &draw.inputs.vertex_buffers {
        (binding, objects.serial_of(bound.buffer), bound.offset).hash(&mut hasher);
    }
    hasher.finish()
}

fn copy(device: &Device, objects: &mut Objects, from: vk::Buffer, to: vk::Buffer, regions: &[vk::BufferCopy]) {
    for region in regions {
        let bytes = match usize::try_from(region.size) {
            Ok(length) if region.size <= MOST_BYTES => {
                objects.read(from, region.src_offset, length, false, |memory, offset, bytes| {
                    read_unmapped(device, memory, offset, bytes)
                })
            }
            _ => None,
        };
        match bytes {
            Some(bytes) => write(objects, to, region.dst_offset, Arc::new(bytes)),
            None => forget(objects, to, region.dst_offset, region.size),
        }
    }
}

/// Reports whether the host may map a buffer's memory.
fn is_mappable(objects: &Objects, buffer: vk::Buffer) -> bool {
    let memory = objects.buffers.get(&buffer).and_then(|buffer| buffer.memory);
    let memory = memory.and_then(|(memory, _)| objects.memories.get(&memory));
    memory.is_some_and(|memory| memory.is_mappable)
}

/// Notes what is written to a buffer. One that the host may map is no longer followed: host and device write it.
fn write(objects: &mut Objects, to: vk::Buffer, offset: u64, bytes: Arc<Vec<u8>>) {
    let both_write = is_mappable(objects, to);
    if let Some(buffer) = objects.buffers.get_mut(&to) {
        buffer.is_written |= both_write;
        buffer.write_shadow(offset, bytes);
    }
}

fn forget(objects: &mut Objects, to: vk::Buffer, offset: u64, size: u64) {
    let both_write = is_mappable(objects, to);
    if let Some(buffer) = objects.buffers.get_mut(&to) {
        buffer.is_written |= both_write;
        buffer.forget_shadow(offset, size);
    }
}

/// Maps memory that the application has not mapped, copies bytes of it, and unmaps it.
fn read_unmapped(device: &Device, memory: vk::DeviceMemory, offset: u64, bytes: &mut [u8]) -> bool {
    let next = &device.next;
    let (Some(map), Some(unmap)) = (next.map_memory, next.unmap_memory) else {
        return false;
    };
    let device = device.handle;
    let mut data: *mut c_void = std::ptr::null_mut();
    let flags = vk::MemoryMapFlags::empty();
    // SAFETY: the memory lives, is mappable and not mapped, and the lock on what changes keeps the application from
    // mapping it; the mapping is as long as its memory.
    unsafe {
        if map(device, memory, 0, vk::WHOLE_SIZE, flags, &raw mut data) != vk::Result::SUCCESS {
            return false;
        }
        let from = data.cast::<u8>().cast_const().add(offset as usize);
        from.copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len());
        unmap(device, memory);
    }
    true
}

/// The contents of buffers.
struct Contents<'a> {
    device: &'a Device,
    state: &'a State,
    /// The submission has ended, so that what the device has written is there.
    is_late: bool,
    /// Something was asked for that is known only then.
    is_known_late: Cell<bool>,
}

impl<'a> Contents<'a> {
    fn new(device: &'a Device, state: &'a State, is_late: bool) -> Self {
        Self { device, state, is_late, is_known_late: Cell::new(false) }
    }
}

impl Reader for Contents<'_> {
    fn read(&self, buffer: vk::Buffer, offset: u64, length: u64) -> Option<Vec<u8>> {
        let length = usize::try_from(length).ok()?;
        let objects = &self.state.objects;
        let bytes = objects.read(buffer, offset, length, self.is_late, |memory, offset, bytes| {
            read_unmapped(self.device, memory, offset, bytes)
        });
        if bytes.is_none() && !self.is_late && objects.is_known_late(buffer) {
            self.is_known_late.set(true);
        }
        bytes
    }

    fn size(&self, buffer: vk::Buffer) -> Option<u64> {
        Some(self.state.objects.buffers.get(&buffer)?.size)
    }

    fn is_late(&self) -> bool {
        self.is_late
    }

    fn lives(&self, buffer: vk::Buffer, serial: u64) -> bool {
        self.is_late || self.state.objects.serial_of(buffer) == serial
    }

    fn is_part_of_a_picture(&self, camera: &Camera) -> bool {
        let points = self.state.principal_points.get(&contents::view_key(camera));
        points.is_some_and(|points| points.len() > 1)
    }

    fn descriptor(&self, draw: &Draw) -> Option<Result<BufferDescriptor, String>> {
        let (set, binding) = (draw.state.camera_set, draw.state.camera_binding);
        if let Some(pushed) = draw.pushed {
            return pushed.map(Ok);
        }
        let Some(bound) = &draw.camera_set else {
            return Some(Err(format!("no descriptor set is bound at cameraSet ({set})")));
        };
        let known = self.state.objects.sets.get(&bound.set).filter(|known| known.serial == bound.serial);
        let Some(known) = known else {
            return (bound.serial != 0 && !self.is_late).then(|| {
                Err(format!(
                    "the descriptor set that is bound at cameraSet ({set}) was freed, or its pool reset or destroyed, \
                     before the submission"
                ))
            });
        };
        if known.is_unknown {
            return None;
        }
        let Some(&found) = known.buffers.get(&binding) else {
            return Some(Err(format!("the descriptor at set {set}, binding {binding} was not written")));
        };
        let layout = known.layout.as_ref()?;
        let offsets: HashMap<u32, u32> = (layout.iter())
            .filter(|other| {
                let (uniform, storage) =
                    (vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC, vk::DescriptorType::STORAGE_BUFFER_DYNAMIC);
                other.ty == uniform || other.ty == storage
            })
            .flat_map(|other| (0..other.count).map(|_| other.binding))
            .zip(bound.dynamic_offsets.iter().copied())
            .fold(HashMap::new(), |mut first, (binding, offset)| {
                first.entry(binding).or_insert(offset);
                first
            });
        let dynamic = offsets.get(&binding).copied().unwrap_or(0);
        Some(Ok(BufferDescriptor { offset: found.offset + u64::from(dynamic), ..found }))
    }
}
