//! Memory, views, descriptors, queries and submissions.

use std::collections::HashMap;
use std::ffi::c_void;
use std::sync::{Mutex, PoisonError};

use ash::vk;

use crate::next::next;
use crate::table::*;
use gaurast_layer_interface::slice;

/// Memory that the host writes.
#[derive(Clone, Copy)]
struct Memory {
    device: vk::Device,
    size: vk::DeviceSize,
    /// True if the application has mapped it, so that it can be mapped.
    is_mappable: bool,
    /// The address and the size of the application's mapping, if there is one.
    mapped: Option<(usize, vk::DeviceSize)>,
}

/// What memory held as the last command buffer ended.
type Contents = HashMap<vk::DeviceMemory, Vec<u8>>;

static MEMORIES: Mutex<Option<HashMap<vk::DeviceMemory, Memory>>> = Mutex::new(None);
static CONTENTS: Mutex<Option<Contents>> = Mutex::new(None);

fn memories<R>(look: impl FnOnce(&mut HashMap<vk::DeviceMemory, Memory>) -> R) -> R {
    look(MEMORIES.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default())
}

pub(super) unsafe extern "system" fn allocate_memory(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        let result = (next().allocate_memory)(device, info, allocator, memory);
        if result == vk::Result::SUCCESS {
            let size = (*info).allocation_size;
            memories(|all| all.insert(*memory, Memory { device, size, is_mappable: false, mapped: None }));
        }
        result
    }
}

pub(super) unsafe extern "system" fn free_memory(
    device: vk::Device,
    memory: vk::DeviceMemory,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    memories(|all| all.remove(&memory));
    if let Some(contents) = CONTENTS.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
        contents.remove(&memory);
    }
    // SAFETY: see the crate.
    unsafe { (next().free_memory)(device, memory, allocator) };
}

pub(super) unsafe extern "system" fn map_memory(
    device: vk::Device,
    memory: vk::DeviceMemory,
    offset: vk::DeviceSize,
    size: vk::DeviceSize,
    flags: vk::MemoryMapFlags,
    data: *mut *mut c_void,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        let result = (next().map_memory)(device, memory, offset, size, flags, data);
        if result == vk::Result::SUCCESS {
            let address = *data as usize;
            memories(|all| {
                if let Some(memory) = all.get_mut(&memory) {
                    let size = size.min(memory.size - offset);
                    memory.mapped = Some((address, size));
                    memory.is_mappable = true;
                }
            });
        }
        result
    }
}

pub(super) unsafe extern "system" fn unmap_memory(device: vk::Device, memory: vk::DeviceMemory) {
    memories(|all| all.get_mut(&memory).map(|memory| memory.mapped = None));
    // SAFETY: see the crate.
    unsafe { (next().unmap_memory)(device, memory) };
}

/// Calls `use_bytes` with the bytes of memory, if the host sees it.
fn with_bytes(memory: vk::DeviceMemory, known: Memory, use_bytes: impl FnOnce(&mut [u8])) {
    let next = next();
    // SAFETY: the memory lives; the mapping is the application's, or one that ends here; and no submission runs, since
    // the mutant's cases wait for each.
    unsafe {
        if let Some((address, size)) = known.mapped {
            use_bytes(std::slice::from_raw_parts_mut(address as *mut u8, size as usize));
            return;
        }
        let mut data = std::ptr::null_mut();
        let (whole, flags) = (vk::WHOLE_SIZE, vk::MemoryMapFlags::empty());
        if (next.map_memory)(known.device, memory, 0, whole, flags, &raw mut data) == vk::Result::SUCCESS {
            use_bytes(std::slice::from_raw_parts_mut(data.cast(), known.size as usize));
            (next.unmap_memory)(known.device, memory);
        }
    }
}

/// Remembers what memory holds as a command buffer ends.
pub(super) fn remember_memory() {
    if !HOST_LATE.is_active() {
        return;
    }
    let mut contents = Contents::new();
    for (memory, known) in memories(|all| all.clone()).into_iter().filter(|(_, known)| known.is_mappable) {
        with_bytes(memory, known, |bytes| drop(contents.insert(memory, bytes.to_vec())));
    }
    *CONTENTS.lock().unwrap_or_else(PoisonError::into_inner) = Some(contents);
}

/// Takes back what the host has written since the last command buffer ended.
fn take_back() {
    let contents = CONTENTS.lock().unwrap_or_else(PoisonError::into_inner).take();
    for (memory, old) in contents.into_iter().flatten() {
        let Some(known) = memories(|all| all.get(&memory).copied()) else {
            continue;
        };
        with_bytes(memory, known, |bytes| {
            if bytes.len() == old.len() && HOST_LATE.strikes(*bytes != *old) {
                bytes.copy_from_slice(&old);
            }
        });
    }
}

/// The command buffers that were submitted, each with how often.
static SUBMITTED: Mutex<Option<HashMap<vk::CommandBuffer, u32>>> = Mutex::new(None);

/// Forgets the submissions of a command buffer that is recorded anew.
pub(super) fn forget_submissions(commands: vk::CommandBuffer) {
    if let Some(submitted) = SUBMITTED.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
        submitted.remove(&commands);
    }
}

pub(super) unsafe extern "system" fn queue_submit(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    if HOST_LATE.is_active() {
        take_back();
    }
    // SAFETY: see the crate.
    unsafe {
        let mut submits = slice(submits.cast::<vk::SubmitInfo<'static>>(), count).to_vec();
        if SUBMIT_FIRST_BATCH.strikes(count > 1) {
            submits.truncate(1);
        }
        let mut buffers: Vec<Vec<vk::CommandBuffer>> = Vec::new();
        for submit in &submits {
            let mut all = slice(submit.p_command_buffers, submit.command_buffer_count).to_vec();
            if SUBMIT_FIRST_BUFFER.strikes(all.len() > 1) {
                all.truncate(1);
            }
            let mut submitted = SUBMITTED.lock().unwrap_or_else(PoisonError::into_inner);
            all.retain(|&commands| {
                let times = submitted.get_or_insert_default().entry(commands).or_default();
                *times += 1;
                !SUBMITTED_ONCE.strikes(*times > 1)
            });
            buffers.push(all);
        }
        for (submit, own) in submits.iter_mut().zip(&buffers) {
            (submit.p_command_buffers, submit.command_buffer_count) = (own.as_ptr(), own.len() as u32);
        }
        (next().queue_submit)(queue, submits.len() as u32, submits.as_ptr(), fence)
    }
}

pub(super) unsafe extern "system" fn create_image_view(
    device: vk::Device,
    info: *const vk::ImageViewCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    view: *mut vk::ImageView,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        let mut info = *info;
        BASE_LAYER.replaces(&mut info.subresource_range.base_array_layer, 0);
        (next().create_image_view)(device, &raw const info, allocator, view)
    }
}

/// A descriptor: its set, binding and element.
type Descriptor = (vk::DescriptorSet, u32, u32);

/// The descriptors that were written, each with how often.
static WRITTEN: Mutex<Option<HashMap<Descriptor, u32>>> = Mutex::new(None);

pub(super) unsafe extern "system" fn allocate_descriptor_sets(
    device: vk::Device,
    info: *const vk::DescriptorSetAllocateInfo<'_>,
    sets: *mut vk::DescriptorSet,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        let result = (next().allocate_descriptor_sets)(device, info, sets);
        if result == vk::Result::SUCCESS {
            let made = slice(sets, (*info).descriptor_set_count);
            let mut written = WRITTEN.lock().unwrap_or_else(PoisonError::into_inner);
            written.get_or_insert_default().retain(|(set, ..), _| !made.contains(set));
        }
        result
    }
}

pub(super) unsafe extern "system" fn update_descriptor_sets(
    device: vk::Device,
    count: u32,
    writes: *const vk::WriteDescriptorSet<'_>,
    copy_count: u32,
    copies: *const vk::CopyDescriptorSet<'_>,
) {
    // SAFETY: see the crate; copies of structures and of infos outlive the call.
    unsafe {
        let mut writes = slice(writes.cast::<vk::WriteDescriptorSet<'static>>(), count).to_vec();
        let infos = writes.iter().map(|write| {
            use vk::DescriptorType as Type;
            let is_of_buffers = [Type::UNIFORM_BUFFER, Type::UNIFORM_BUFFER_DYNAMIC, Type::STORAGE_BUFFER];
            let count = if is_of_buffers.contains(&write.descriptor_type) { write.descriptor_count } else { 0 };
            let mut own = slice(write.p_buffer_info, count).to_vec();
            own.iter_mut().for_each(|info| DESCRIPTOR_OFFSET.replaces(&mut info.offset, 0));
            own
        });
        let infos: Vec<Vec<vk::DescriptorBufferInfo>> = infos.collect();
        for (write, own) in writes.iter_mut().zip(&infos).filter(|(_, own)| !own.is_empty()) {
            write.p_buffer_info = own.as_ptr();
        }
        if DESCRIPTOR_WRITTEN_ONCE.is_active() {
            let mut written = WRITTEN.lock().unwrap_or_else(PoisonError::into_inner);
            writes.retain(|write| {
                let descriptor = (write.dst_set, write.dst_binding, write.dst_array_element);
                let times = written.get_or_insert_default().entry(descriptor).or_default();
                *times += 1;
                !DESCRIPTOR_WRITTEN_ONCE.strikes(*times > 1)
            });
        }
        (next().update_descriptor_sets)(device, writes.len() as u32, writes.as_ptr(), copy_count, copies);
    }
}

/// The types of query pools.
static POOLS: Mutex<Option<HashMap<vk::QueryPool, vk::QueryType>>> = Mutex::new(None);

pub(super) unsafe extern "system" fn create_query_pool(
    device: vk::Device,
    info: *const vk::QueryPoolCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    pool: *mut vk::QueryPool,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        let result = (next().create_query_pool)(device, info, allocator, pool);
        if result == vk::Result::SUCCESS {
            let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
            pools.get_or_insert_default().insert(*pool, (*info).query_type);
        }
        result
    }
}

pub(super) unsafe extern "system" fn get_query_pool_results(
    device: vk::Device,
    pool: vk::QueryPool,
    first: u32,
    count: u32,
    size: usize,
    data: *mut c_void,
    stride: vk::DeviceSize,
    flags: vk::QueryResultFlags,
) -> vk::Result {
    // SAFETY: see the crate; the cases take results of 64 bits, packed.
    unsafe {
        let result = (next().get_query_pool_results)(device, pool, first, count, size, data, stride, flags);
        let ty =
            POOLS.lock().unwrap_or_else(PoisonError::into_inner).as_ref().and_then(|pools| pools.get(&pool).copied());
        if result != vk::Result::SUCCESS || !flags.contains(vk::QueryResultFlags::TYPE_64) {
            return result;
        }
        let values = std::slice::from_raw_parts_mut(data.cast::<u64>(), size / 8);
        let sum: u64 = values.iter().sum();
        for value in values {
            if ty == Some(vk::QueryType::OCCLUSION) {
                OCCLUSION_BOOLEAN.changes(value, |value| value.min(1));
                OCCLUSION_ZERO.replaces(value, 0);
                QUERIES_SUMMED.replaces(value, sum);
            }
            if ty == Some(vk::QueryType::PIPELINE_STATISTICS) {
                STATISTICS_ZERO.replaces(value, 0);
            }
        }
        result
    }
}
