//! Command buffers while they are recorded: their state, and what they will do that the layer follows.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ash::vk;

use crate::facts::{Camera, GaussianState, Harmonics};
use crate::objects::{BufferDescriptor, Pipeline, RenderPass, Subpass};

/// A bound vertex buffer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VertexBuffer {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    /// Bytes from the offset on, if they were said.
    pub(crate) size: Option<u64>,
    pub(crate) stride: Option<u32>,
}

/// The bound index buffer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IndexBuffer {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) ty: vk::IndexType,
}

/// A bound descriptor set.
#[derive(Clone, Debug)]
pub(crate) struct BoundSet {
    pub(crate) set: vk::DescriptorSet,
    pub(crate) dynamic_offsets: Vec<u32>,
}

/// A render pass instance.
#[derive(Clone, Debug)]
pub(crate) struct Pass {
    pub(crate) subpass: Subpass,
    /// The subpass of a render pass object; `None` in dynamic rendering.
    pub(crate) index: Option<SubpassIndex>,
    /// The viewports of draws so far.
    pub(crate) drawn: Vec<Option<[f32; 4]>>,
}

/// A subpass of a render pass object, by its number.
#[derive(Clone, Debug)]
pub(crate) struct SubpassIndex {
    pub(crate) render_pass: Arc<RenderPass>,
    pub(crate) index: usize,
}

/// The state that all draws of a set have in common.
#[derive(Clone)]
pub(crate) struct Shared {
    pub(crate) pipeline: Arc<Pipeline>,
    pub(crate) cameras: Vec<u8>,
    pub(crate) dynamic: BTreeMap<i32, Vec<u8>>,
}

/// A draw command's parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Call {
    /// First and number of vertices, and of instances.
    Vertices([u32; 4]),
    /// First and number of indices and of instances, and the vertex offset.
    Indices([u32; 4], i32),
    /// The buffer of parameters, their offset, and whether they are of indexed draws; of the first draw alone.
    Indirect(vk::Buffer, u64, bool),
}

/// A draw of Gaussians, whose contents are looked at when it is submitted.
pub(crate) struct Draw {
    pub(crate) pipeline: Arc<Pipeline>,
    /// The state with the values of its dynamic states.
    pub(crate) state: GaussianState,
    pub(crate) call: Call,
    pub(crate) vertex_buffers: BTreeMap<u32, VertexBuffer>,
    pub(crate) index_buffer: Option<IndexBuffer>,
    pub(crate) cameras: Option<Arc<Vec<Camera>>>,
    pub(crate) viewport: Option<[f32; 4]>,
    /// The set of the camera, and what was pushed for it.
    pub(crate) camera_set: Option<BoundSet>,
    pub(crate) pushed: Option<Option<BufferDescriptor>>,
    pub(crate) was_checked: AtomicBool,
}

/// The commands of a command buffer that the layer follows.
#[derive(Clone)]
pub(crate) enum Operation {
    Copy(vk::Buffer, vk::Buffer, Vec<vk::BufferCopy>),
    Update(vk::Buffer, u64, Arc<Vec<u8>>),
    Fill(vk::Buffer, u64, u64, u32),
    /// Something is written that the layer does not follow.
    Write(vk::Buffer),
    Draw(Arc<Draw>),
}

/// A command buffer.
#[derive(Clone, Default)]
pub(crate) struct Recording {
    pub(crate) pool: vk::CommandPool,
    pub(crate) pipeline: Option<Arc<Pipeline>>,
    pub(crate) vertex_buffers: BTreeMap<u32, VertexBuffer>,
    pub(crate) index_buffer: Option<IndexBuffer>,
    pub(crate) cameras: Option<Arc<Vec<Camera>>>,
    /// The values of dynamic states, by state.
    pub(crate) dynamic: BTreeMap<i32, Vec<u8>>,
    pub(crate) viewport: Option<[f32; 4]>,
    pub(crate) sets: BTreeMap<u32, BoundSet>,
    /// The first descriptor of bindings that were pushed, by set; `None` is one that the layer does not follow.
    pub(crate) pushed: BTreeMap<(u32, u32), Option<BufferDescriptor>>,
    pub(crate) harmonics: Option<Harmonics>,
    pub(crate) pass: Option<Pass>,
    /// A sorted set has begun; with what its draws share, after the first.
    pub(crate) set: Option<Option<Shared>>,
    pub(crate) operations: Vec<Operation>,
}

impl Recording {
    /// A command buffer of a pool, in which nothing is recorded.
    pub(crate) fn new(pool: vk::CommandPool) -> Self {
        Self { pool, ..Self::default() }
    }

    /// Begins a subpass, in which nothing is drawn yet.
    pub(crate) fn begin_pass(&mut self, subpass: Subpass, index: Option<SubpassIndex>) {
        self.pass = Some(Pass { subpass, index, drawn: Vec::new() });
    }

    /// Goes on with the next subpass.
    pub(crate) fn next_subpass(&mut self) {
        let Some(SubpassIndex { render_pass, index }) = self.pass.take().and_then(|pass| pass.index) else {
            return;
        };
        let index = index + 1;
        let subpass = render_pass.get(index).cloned().unwrap_or_default();
        self.begin_pass(subpass, Some(SubpassIndex { render_pass, index }));
    }

    /// The state that is undefined after other command buffers were executed.
    pub(crate) fn forget_state(&mut self) {
        *self = Self {
            pool: self.pool,
            pass: self.pass.take(),
            set: self.set.take(),
            operations: std::mem::take(&mut self.operations),
            ..Self::default()
        };
    }

    /// Sets a dynamic state's value.
    pub(crate) fn set_dynamic(&mut self, state: vk::DynamicState, value: impl Into<Vec<u8>>) {
        self.dynamic.insert(state.as_raw(), value.into());
    }

    /// The bits of a dynamic state of 32 bits.
    pub(crate) fn dynamic_bits(&self, state: vk::DynamicState) -> Option<u32> {
        let bytes = self.dynamic.get(&state.as_raw())?;
        Some(u32::from_ne_bytes(bytes.as_slice().try_into().ok()?))
    }
}
