//! A device's objects, as far as the layer follows them.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use ash::vk;

use crate::facts::{Decoding, GaussianState};

/// Memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory {
    pub(crate) size: u64,
    /// The host may map it.
    pub(crate) is_mappable: bool,
    /// The address at which the application has mapped it, and the offset and the size of what is mapped.
    pub(crate) mapped: Option<(usize, u64, u64)>,
}

impl Memory {
    /// Notes that the application has mapped it.
    pub(crate) fn map(&mut self, address: usize, offset: u64, size: u64) {
        let rest = self.size.saturating_sub(offset);
        self.mapped = Some((address, offset, size.min(rest)));
    }
}

/// A buffer.
#[derive(Clone, Debug)]
pub(crate) struct Buffer {
    /// Its number: handles are used again.
    pub(crate) serial: u64,
    pub(crate) size: u64,
    /// It may be a storage buffer.
    pub(crate) may_be_storage: bool,
    /// The memory that it is bound to, and its offset in it.
    pub(crate) memory: Option<(vk::DeviceMemory, u64)>,
    pub(crate) address: Option<vk::DeviceAddress>,
    /// The device may have written it in a way that the layer does not follow.
    pub(crate) is_written: bool,
    /// The bytes that transfers wrote, as far as the layer follows them, by offset.
    pub(crate) shadow: BTreeMap<u64, Arc<Vec<u8>>>,
}

/// A binding of a descriptor set's layout.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayoutBinding {
    pub(crate) binding: u32,
    pub(crate) ty: vk::DescriptorType,
    pub(crate) count: u32,
    pub(crate) stages: vk::ShaderStageFlags,
}

/// The bindings of a descriptor set's layout, in ascending order.
pub(crate) type SetLayout = Vec<LayoutBinding>;

/// The layouts of a pipeline layout's sets; one that is null or unknown is `None`.
pub(crate) type Layout = Vec<Option<Arc<SetLayout>>>;

/// A buffer in a descriptor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BufferDescriptor {
    pub(crate) buffer: vk::Buffer,
    /// The number of the buffer that had the handle when the descriptor was written.
    pub(crate) serial: u64,
    pub(crate) offset: u64,
    pub(crate) range: u64,
}

/// A descriptor set.
#[derive(Clone, Debug)]
pub(crate) struct Set {
    /// Its number: handles are used again.
    pub(crate) serial: u64,
    pub(crate) layout: Option<Arc<SetLayout>>,
    pub(crate) pool: vk::DescriptorPool,
    /// The first descriptor of bindings of buffers.
    pub(crate) buffers: BTreeMap<u32, BufferDescriptor>,
    /// It was written in a way that the layer does not follow.
    pub(crate) is_unknown: bool,
}

/// A subpass.
#[derive(Clone, Debug, Default)]
pub(crate) struct Subpass {
    pub(crate) view_mask: u32,
    /// Formats of colour attachments, and whether each is loaded.
    pub(crate) colors: Vec<(vk::Format, bool)>,
    /// The format of depth and stencil.
    pub(crate) depth: vk::Format,
    /// The number of the depth attachment, if the render pass clears it where this subpass begins.
    pub(crate) cleared_depth: Option<u32>,
}

/// The subpasses of a render pass.
pub(crate) type RenderPass = Vec<Subpass>;

/// A vertex buffer binding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VertexBinding {
    pub(crate) stride: u32,
    pub(crate) by_instance: bool,
    /// The number of instances that take the same element; 0: all of them.
    pub(crate) divisor: u32,
}

/// A vertex attribute.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attribute {
    pub(crate) binding: u32,
    pub(crate) format: vk::Format,
    pub(crate) offset: u32,
}

/// The depth test of a pipeline.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DepthTest {
    /// There is a depth attachment.
    pub(crate) is_there: bool,
    pub(crate) is_enabled: bool,
    pub(crate) writes: bool,
    pub(crate) op: vk::CompareOp,
    /// Depths of clip space are from -1.
    pub(crate) from_minus_one: bool,
}

/// A graphics pipeline.
pub(crate) struct Pipeline {
    /// Its number: handles are used again.
    pub(crate) serial: u64,
    /// The Gaussian state, if it draws Gaussians.
    pub(crate) gaussian: Option<GaussianState>,
    /// The exponential error and the contribution budget.
    pub(crate) approximation: Option<[f32; 2]>,
    /// The decodings of attributes.
    pub(crate) decoding: Option<Decoding>,
    pub(crate) has_fragment: bool,
    /// The states that are dynamic.
    pub(crate) dynamic: Vec<vk::DynamicState>,
    /// By binding.
    pub(crate) bindings: BTreeMap<u32, VertexBinding>,
    /// By location.
    pub(crate) attributes: BTreeMap<u32, Attribute>,
    /// The first colour attachment is replaced, not blended.
    pub(crate) replaces: bool,
    /// The viewport, if it is not dynamic.
    pub(crate) viewport: Option<[f32; 4]>,
    /// The least and the greatest depth of that viewport.
    pub(crate) depth_range: Option<[f32; 2]>,
    pub(crate) depth: DepthTest,
    /// The stages whose shaders read push constants.
    pub(crate) reads_constants: vk::ShaderStageFlags,
}

/// All objects of a device that the layer looks at.
#[derive(Default)]
pub(crate) struct Objects {
    serial: u64,
    pub(crate) memories: HashMap<vk::DeviceMemory, Memory>,
    pub(crate) buffers: HashMap<vk::Buffer, Buffer>,
    pub(crate) modules: HashMap<vk::ShaderModule, Arc<Vec<u32>>>,
    pub(crate) set_layouts: HashMap<vk::DescriptorSetLayout, Arc<SetLayout>>,
    pub(crate) layouts: HashMap<vk::PipelineLayout, Arc<Layout>>,
    pub(crate) sets: HashMap<vk::DescriptorSet, Set>,
    pub(crate) render_passes: HashMap<vk::RenderPass, Arc<RenderPass>>,
    pub(crate) pipelines: HashMap<vk::Pipeline, Arc<Pipeline>>,
    pub(crate) timelines: HashSet<vk::Semaphore>,
}

impl Objects {
    /// A number that no object had before.
    pub(crate) fn next_serial(&mut self) -> u64 {
        self.serial += 1;
        self.serial
    }

    /// The buffer in which an address is, if the layer knows it.
    pub(crate) fn buffer_at(&self, address: vk::DeviceAddress) -> Option<(vk::Buffer, &Buffer)> {
        let holds = |buffer: &Buffer| {
            let start = buffer.address;
            start.is_some_and(|start| start <= address && address - start < buffer.size)
        };
        let found = self.buffers.iter().find(|(_, buffer)| holds(buffer));
        found.map(|(&handle, buffer)| (handle, buffer))
    }

    /// The number of the buffer that has a handle; 0 where there is none.
    pub(crate) fn serial_of(&self, buffer: vk::Buffer) -> u64 {
        self.buffers.get(&buffer).map_or(0, |buffer| buffer.serial)
    }

    /// Reports whether a buffer's bytes are known only after what writes them has ended.
    pub(crate) fn is_known_late(&self, handle: vk::Buffer) -> bool {
        let Some(buffer) = self.buffers.get(&handle) else {
            return false;
        };
        let memory = buffer.memory.and_then(|(memory, _)| self.memories.get(&memory));
        buffer.is_written && memory.is_some_and(|memory| memory.is_mappable)
    }

    /// Bytes of a buffer that the layer is sure of, as the device finds them if nothing else is written meanwhile; with
    /// `is_late`, what the device has written, too. `read_mappable` reads memory that the application has not mapped.
    pub(crate) fn read(
        &self,
        handle: vk::Buffer,
        offset: u64,
        length: usize,
        is_late: bool,
        read_mappable: impl FnOnce(vk::DeviceMemory, u64, &mut [u8]) -> bool,
    ) -> Option<Vec<u8>> {
        let buffer = self.buffers.get(&handle)?;
        let is_unsure = buffer.is_written && !(is_late && self.is_known_late(handle));
        if is_unsure || offset.checked_add(length as u64)? > buffer.size {
            return None;
        }
        let (memory_handle, start) = buffer.memory?;
        let memory = self.memories.get(&memory_handle)?;
        if !memory.is_mappable {
            return from_shadow(&buffer.shadow, offset, length);
        }
        let mut bytes = vec![0; length];
        let place = start + offset;
        match memory.mapped {
            Some((address, first, size)) => {
                if place < first || place + length as u64 > first + size {
                    return None;
                }
                let from = address + usize::try_from(place - first).ok()?;
                // SAFETY: the application has mapped these bytes, and unmaps them or frees the memory only by commands
                // that wait for the lock that the caller holds. It may write them meanwhile: they are numbers, any of
                // which is a value.
                unsafe {
                    std::ptr::copy_nonoverlapping(from as *const u8, bytes.as_mut_ptr(), length);
                };
                Some(bytes)
            }
            None => read_mappable(memory_handle, place, &mut bytes).then_some(bytes),
        }
    }
}

/// Bytes that transfers have written, if they wrote all of them.
fn from_shadow(shadow: &BTreeMap<u64, Arc<Vec<u8>>>, offset: u64, length: usize) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(length);
    while bytes.len() < length {
        let place = offset + bytes.len() as u64;
        let (&start, piece) = shadow.range(..=place).next_back()?;
        let from = usize::try_from(place - start).ok()?;
        let rest = piece.get(from..).filter(|rest| !rest.is_empty())?;
        let count = rest.len().min(length - bytes.len());
        bytes.extend_from_slice(&rest[..count]);
    }
    Some(bytes)
}

impl Buffer {
    /// Notes what a transfer has written. Pieces that it covers in part lose that part.
    pub(crate) fn write_shadow(&mut self, offset: u64, bytes: Arc<Vec<u8>>) {
        self.forget_shadow(offset, bytes.len() as u64);
        self.shadow.insert(offset, bytes);
    }

    /// Notes that something unknown was written.
    pub(crate) fn forget_shadow(&mut self, offset: u64, length: u64) {
        let end = offset.saturating_add(length);
        let overlapping: Vec<u64> = (self.shadow.range(..end))
            .filter(|&(&start, piece)| start + piece.len() as u64 > offset)
            .map(|(&start, _)| start)
            .collect();
        for start in overlapping {
            let Some(piece) = self.shadow.remove(&start) else {
                continue;
            };
            let piece_end = start + piece.len() as u64;
            if start < offset {
                let kept = piece[..(offset - start) as usize].to_vec();
                self.shadow.insert(start, Arc::new(kept));
            }
            if piece_end > end {
                let kept = piece[(end - start) as usize..].to_vec();
                self.shadow.insert(end, Arc::new(kept));
            }
        }
    }
}
