//! The memory that kernels work in.

use std::ptr::NonNull;
use std::sync::Arc;

use ash::vk;

use crate::next::Next;

/// A buffer with memory of its own, which is freed with it.
pub(crate) struct Memory {
    next: Arc<Next>,
    pub(crate) buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    pub(crate) address: u64,
    pub(crate) size: u64,
    mapped: Option<NonNull<u32>>,
}

// SAFETY: what is mapped is read and written through shared references by volatile accesses only.
unsafe impl Send for Memory {}
// SAFETY: as above.
unsafe impl Sync for Memory {}

impl Memory {
    /// Allocates memory of the device, or such that the host sees as well.
    pub(crate) fn new(next: &Arc<Next>, size: u64, is_for_host: bool) -> Result<Self, vk::Result> {
        use vk::BufferUsageFlags as Usage;
        let usage = Usage::STORAGE_BUFFER
            | Usage::TRANSFER_DST
            | Usage::INDIRECT_BUFFER
            | Usage::VERTEX_BUFFER
            | Usage::SHADER_DEVICE_ADDRESS;
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the device lives as long as what is recorded on it.
        unsafe {
            let mut own = Self {
                buffer: next.create_buffer(&info, None)?,
                next: Arc::clone(next),
                memory: vk::DeviceMemory::null(),
                address: 0,
                size,
                mapped: None,
            };
            let needs = own.next.get_buffer_memory_requirements(own.buffer);
            let wanted = if is_for_host {
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT
            } else {
                vk::MemoryPropertyFlags::DEVICE_LOCAL
            };
            let types = next.memory.memory_types_as_slice().iter().enumerate();
            let mut usable = types.filter(|(index, _)| needs.memory_type_bits >> index & 1 != 0);
            let found = usable.clone().find(|(_, ty)| ty.property_flags.contains(wanted));
            let found = found.or_else(|| if is_for_host { None } else { usable.next() });
            let (index, _) = found.ok_or(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)?;
            let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needs.size)
                .memory_type_index(index as u32)
                .push_next(&mut flags);
            own.memory = own.next.allocate_memory(&info, None)?;
            own.next.bind_buffer_memory(own.buffer, own.memory, 0)?;
            let info = vk::BufferDeviceAddressInfo::default().buffer(own.buffer);
            own.address = own.next.get_buffer_device_address(&info);
            if is_for_host {
                let flags = vk::MemoryMapFlags::empty();
                let mapped = own.next.map_memory(own.memory, 0, vk::WHOLE_SIZE, flags)?;
                own.mapped = NonNull::new(mapped.cast());
            }
            Ok(own)
        }
    }

    /// A word, of memory that the host sees.
    pub(crate) fn word(&self, index: usize) -> u32 {
        let Some(mapped) = self.mapped.filter(|_| 4 * (index as u64) < self.size) else {
            return 0;
        };
        // SAFETY: the word lies in the mapped memory.
        unsafe { mapped.as_ptr().add(index).read_volatile() }
    }

    /// Writes a word, of memory that the host sees.
    pub(crate) fn set_word(&self, index: usize, value: u32) {
        if let Some(mapped) = self.mapped.filter(|_| 4 * (index as u64) < self.size) {
            // SAFETY: as above.
            unsafe { mapped.as_ptr().add(index).write_volatile(value) };
        }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: nothing that was recorded with the buffer is executed any more: it was reset or freed.
        unsafe {
            self.next.destroy_buffer(self.buffer, None);
            self.next.free_memory(self.memory, None);
        }
    }
}

/// The sizes of what a set needs in its scratch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// The most Gaussians.
    pub(crate) gaussians: u64,
    /// The most pairs of tile and Gaussian that are sorted.
    pub(crate) pairs: u64,
    pub(crate) tiles: u64,
    /// Bytes of parameters, draws, sources, cameras and lenses, and of pixels.
    pub(crate) parameters: u64,
    pub(crate) draws: u64,
    pub(crate) sources: u64,
    pub(crate) cameras: u64,
    pub(crate) lenses: u64,
    pub(crate) pixels: u64,
    /// Bytes of what projecting shaders write.
    pub(crate) outputs: u64,
    /// Samples that are tested.
    pub(crate) tested: u64,
    /// A resolve shader reads depths or Gaussians.
    pub(crate) has_inputs: bool,
    /// 2D Gaussians have a cut-off.
    pub(crate) has_rectangles: bool,
}

/// Offsets into scratch.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Places {
    pub(crate) parameters: u64,
    pub(crate) draws: u64,
    pub(crate) sources: u64,
    pub(crate) cameras: u64,
    pub(crate) lenses: u64,
    pub(crate) derived: u64,
    pub(crate) counters: u64,
    pub(crate) keys: u64,
    pub(crate) values: u64,
    pub(crate) pair_keys: u64,
    pub(crate) pair_values: u64,
    pub(crate) histogram: u64,
    pub(crate) totals: u64,
    pub(crate) sums: u64,
    pub(crate) reached: u64,
    pub(crate) ranges: u64,
    pub(crate) records: u64,
    pub(crate) pixels: u64,
    pub(crate) depths: u64,
    pub(crate) names: u64,
    pub(crate) copied_depths: u64,
    pub(crate) copied_stencils: u64,
    pub(crate) stored: u64,
    pub(crate) outputs: u64,
    pub(crate) rectangles: u64,
    /// The size of all.
    pub(crate) end: u64,
}

/// Bytes of a record of `shaders/set.glsl`.
const RECORD: u64 = 96;
/// Bytes of a rectangle of `shaders/set.glsl`.
const RECTANGLE: u64 = 24;
/// Keys of a workgroup in sorts and scans.
const BLOCK: u64 = 2048;

impl Places {
    pub(crate) fn of(extent: &Extent) -> Self {
        let mut places = Self::default();
        let mut end = 0_u64;
        let mut take = |size: u64| {
            let at = end;
            end += size.next_multiple_of(256);
            at
        };
        let (n, pairs) = (extent.gaussians, extent.pairs);
        let histogram = 256 * n.max(pairs).div_ceil(BLOCK).max(1);
        places.parameters = take(extent.parameters);
        places.draws = take(extent.draws);
        places.sources = take(extent.sources);
        places.cameras = take(extent.cameras);
        places.lenses = take(extent.lenses);
        places.derived = take(256);
        places.counters = take(256);
        places.keys = take(8 * n);
        places.values = take(8 * n);
        places.pair_keys = take(8 * pairs);
        places.pair_values = take(8 * pairs);
        places.histogram = take(4 * histogram);
        places.totals = take(4 * 256);
        places.sums = take(4 * n.div_ceil(BLOCK).max(1));
        places.reached = take(4 * n);
        places.ranges = take(8 * extent.tiles);
        places.records = take(RECORD * n);
        places.pixels = take(extent.pixels);
        places.depths = take(if extent.tested == 0 && !extent.has_inputs { 0 } else { 8 * n });
        places.names = take(if extent.has_inputs { 8 * n } else { 0 });
        places.copied_depths = take(4 * extent.tested);
        places.copied_stencils = take(4 * extent.tested);
        places.stored = take(8 * extent.tested);
        places.outputs = take(extent.outputs);
        places.rectangles = take(if extent.has_rectangles { RECTANGLE * n } else { 0 });
        places.end = end;
        places
    }
}
