//! Draws as commands give them, and what they read.

use std::collections::BTreeMap;
use std::mem::offset_of;
use std::sync::Arc;

use ash::vk;

use crate::bindings::Bindings;
use crate::decoding::Tables;
use crate::next::Next;

/// A draw, as `shaders/set.glsl` has it.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Draw {
    pub(crate) indices: u64,
    pub(crate) index_bytes: u32,
    pub(crate) index_count: u32,
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) vertex_offset: i32,
    pub(crate) first_instance: u32,
    pub(crate) instances: u32,
    pub(crate) base: u32,
    pub(crate) indirect_index: u32,
    pub(crate) is_indexed: u32,
    pub(crate) parameters: u64,
    pub(crate) draw_count: u64,
    pub(crate) harmonics: u64,
    pub(crate) harmonics_bytes: u32,
    pub(crate) harmonics_format: u32,
    pub(crate) harmonics_stride: u32,
    pub(crate) harmonics_coefficient_stride: u32,
    pub(crate) shaded: Shaded,
    pub(crate) tables: Tables,
}

/// The outputs of a projecting shader, as `shaders/set.glsl` has them.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Shaded {
    pub(crate) outputs: u64,
    first_vertex: u32,
    /// Of an instance. Without indices a kernel sets it.
    vertices: u32,
    instances: u32,
    first_instance: u32,
    /// The most outputs of a view.
    pub(crate) capacity: u32,
    unused: u32,
    /// `VkDrawIndirectCommand` or `VkDrawIndexedIndirectCommand`, as a kernel writes it.
    command: [u32; 5],
    unused_: u32,
}

impl Shaded {
    /// Room for a number of outputs of each view. `vertices` are those of an instance of an indexed draw, otherwise 0.
    pub(crate) fn with_room(vertices: u32, capacity: u32) -> Self {
        Self { vertices, capacity, ..Self::default() }
    }
}

/// Offsets of the two attributes of [`Shaded`] in a [`Draw`], each of four words.
pub(crate) const SHADED: [u32; 2] =
    [offset_of!(Draw, shaded) as u32, (offset_of!(Draw, shaded) + offset_of!(Shaded, instances)) as u32];
/// The offset of an indirect command in a [`Draw`].
pub(crate) const COMMAND: u64 = (offset_of!(Draw, shaded) + offset_of!(Shaded, command)) as u64;

/// A vertex buffer.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct VertexBuffer {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) address: u64,
    pub(crate) size: u64,
    /// The stride, if it is dynamic.
    pub(crate) stride: Option<u32>,
}

impl VertexBuffer {
    /// Binds the buffer, if there is one.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the application has bound the buffer in it.
    pub(crate) unsafe fn bind(&self, next: &Next, commands: vk::CommandBuffer, binding: u32) {
        if self.buffer == vk::Buffer::null() {
            return;
        }
        let strides = self.stride.map(|stride| [u64::from(stride)]);
        let strides = strides.as_ref().map(<[u64; 1]>::as_slice);
        let size = if self.size == 0 { vk::WHOLE_SIZE } else { self.size };
        let (buffers, offsets, sizes) = ([self.buffer], [self.offset], [size]);
        // SAFETY: the caller's promise.
        unsafe { next.cmd_bind_vertex_buffers2(commands, binding, &buffers, &offsets, Some(&sizes), strides) };
    }
}

/// The index buffer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IndexBuffer {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) ty: vk::IndexType,
    pub(crate) address: u64,
    pub(crate) size: u64,
    pub(crate) bytes: u32,
}

/// A draw as a command gives it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Call {
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) vertex_offset: i32,
    pub(crate) first_instance: u32,
    pub(crate) instances: u32,
    pub(crate) is_indexed: bool,
    /// The address of the parameters, or 0.
    pub(crate) parameters: u64,
    /// The address of the number of draws, or 0.
    pub(crate) draw_count: u64,
    pub(crate) indirect_index: u32,
}

/// A draw with a projecting shader, and all that it reads.
#[derive(Clone)]
pub(crate) struct ShaderDraw {
    pub(crate) call: Call,
    pub(crate) bindings: Arc<Bindings>,
    /// By binding.
    pub(crate) vertex_buffers: BTreeMap<u32, VertexBuffer>,
    pub(crate) index_buffer: Option<IndexBuffer>,
}
