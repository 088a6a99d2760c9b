//! Submission: what buffers hold when draws execute.

use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::ffi::c_void;
use std::hash::{Hash, Hasher};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;

use crate::device::{Device, State};
use crate::objects::{BufferDescriptor, Objects};
use crate::recording::{Call, Draw, Operation};
use crate::report::Faults;
use crate::rules::contents::{self, Reader};
use gaurast_layer_interface::slice;

const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;
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
        let submits_ = slice(submits, count).iter();
        let commands = submits_.flat_map(|submit| slice(submit.p_command_buffers, submit.command_buffer_count));
        let commands: Vec<_> = commands.copied().collect();
        own.observe(|state, faults| execute(&own, state, &commands, faults));
        next(queue, count, submits, fence)
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
        let infos = slice(submits, count)
            .iter()
            .flat_map(|submit| slice(submit.p_command_buffer_infos, submit.command_buffer_info_count));
        let commands: Vec<_> = infos.map(|info| info.command_buffer).collect();
        own.observe(|state, faults| execute(&own, state, &commands, faults));
        next(queue, count, submits, fence)
    }
}

/// Follows what command buffers do, in order.
fn execute(device: &Device, state: &mut State, commands: &[vk::CommandBuffer], faults: &mut Faults) {
    let recordings = commands.iter().filter_map(|commands| state.recordings.get(commands));
    let operations: Vec<_> = recordings.flat_map(|recording| recording.operations.clone()).collect();
    for operation in operations {
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
            Operation::Draw(draw) => look(device, state, &draw, faults),
        }
    }
}

/// Looks at a draw's contents, once.
fn look(device: &Device, state: &mut State, draw: &Draw, faults: &mut Faults) {
    if draw.was_checked.swap(true, Ordering::Relaxed) || !state.checked.insert(key(draw, &state.objects)) {
        return;
    }
    let contents = Contents { device, objects: &state.objects };
    contents::check(draw, &contents, &device.facts, faults);
}

/// A hash of a draw's pipeline, buffers and counts, by which each is checked once.
fn key(draw: &Draw, objects: &Objects) -> u64 {
    let mut hasher = DefaultHasher::new();
    draw.pipeline.serial.hash(&mut hasher);
    match draw.call {
        Call::Vertices(numbers) => numbers.hash(&mut hasher),
        Call::Indices(numbers, offset) => (numbers, offset).hash(&mut hasher),
        Call::Indirect(buffer, offset, _) => (serial(objects, buffer), offset).hash(&mut hasher),
    }
    for (binding, bound) in &draw.vertex_buffers {
        (binding, serial(objects, bound.buffer), bound.offset).hash(&mut hasher);
    }
    hasher.finish()
}

fn serial(objects: &Objects, buffer: vk::Buffer) -> u64 {
    objects.buffers.get(&buffer).map_or(0, |buffer| buffer.serial)
}

fn copy(device: &Device, objects: &mut Objects, from: vk::Buffer, to: vk::Buffer, regions: &[vk::BufferCopy]) {
    for region in regions {
        let bytes = if region.size > MOST_BYTES {
            None
        } else {
            let contents = Contents { device, objects };
            contents.read(from, region.src_offset, region.size)
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

/// The contents of buffers.
struct Contents<'a> {
    device: &'a Device,
    objects: &'a Objects,
}

impl Contents<'_> {
    /// Maps memory that the application has not mapped, copies bytes of it, and unmaps it.
    fn read_unmapped(&self, memory: vk::DeviceMemory, offset: u64, bytes: &mut [u8]) -> bool {
        let next = &self.device.next;
        let (Some(map), Some(unmap)) = (next.map_memory, next.unmap_memory) else {
            return false;
        };
        let device = self.device.handle;
        let mut data: *mut c_void = std::ptr::null_mut();
        let flags = vk::MemoryMapFlags::empty();
        // SAFETY: the memory lives, is mappable and not mapped, and the lock on what changes keeps the application
        // from mapping it; the mapping is as long as its memory.
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
}

impl Reader for Contents<'_> {
    fn read(&self, buffer: vk::Buffer, offset: u64, length: u64) -> Option<Vec<u8>> {
        let length = usize::try_from(length).ok()?;
        self.objects.read(buffer, offset, length, |memory, offset, bytes| self.read_unmapped(memory, offset, bytes))
    }

    fn size(&self, buffer: vk::Buffer) -> Option<u64> {
        Some(self.objects.buffers.get(&buffer)?.size)
    }

    fn descriptor(&self, draw: &Draw) -> Option<Result<BufferDescriptor, String>> {
        let (set, binding) = (draw.state.camera_set, draw.state.camera_binding);
        if let Some(pushed) = draw.pushed {
            return pushed.map(Ok);
        }
        let Some(bound) = &draw.camera_set else {
            return Some(Err(format!("no descriptor set is bound at cameraSet ({set})")));
        };
        let known = self.objects.sets.get(&bound.set)?;
        if known.is_unknown {
            return None;
        }
        let Some(&(buffer, offset, range)) = known.buffers.get(&binding) else {
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
        Some(Ok((buffer, offset + u64::from(dynamic), range)))
    }
}
