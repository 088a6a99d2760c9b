//! Command buffers while they are recorded: their state, and what they will do that the layer follows.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ash::vk;

use crate::facts::{Camera, DecodingTables, GaussianState, Harmonics};
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

/// Harmonics in a buffer, and the buffer in which their address was.
#[derive(Clone, Copy)]
pub(crate) struct BoundHarmonics {
    pub(crate) harmonics: Harmonics,
    /// The buffer and its number.
    pub(crate) buffer: Option<(vk::Buffer, u64)>,
}

/// Tables by which attributes are decoded, and the buffers in which their addresses were.
#[derive(Clone)]
pub(crate) struct BoundTables {
    pub(crate) tables: DecodingTables,
    /// The buffers and their numbers.
    pub(crate) buffers: Vec<(vk::Buffer, u64)>,
}

/// All that attributes and indices come from.
#[derive(Clone, Default)]
pub(crate) struct Inputs {
    pub(crate) vertex_buffers: BTreeMap<u32, VertexBuffer>,
    pub(crate) index_buffer: Option<IndexBuffer>,
    pub(crate) harmonics: Option<BoundHarmonics>,
    pub(crate) decoding_tables: Option<BoundTables>,
}

/// A bound descriptor set.
#[derive(Clone, Debug)]
pub(crate) struct BoundSet {
    pub(crate) set: vk::DescriptorSet,
    /// The number of the set that had the handle when it was bound.
    pub(crate) serial: u64,
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
    /// The depth that is cleared to where the pass begins, if it is.
    pub(crate) cleared_depth: Option<f32>,
    /// The comparisons of draws so far that write depths.
    pub(crate) depth_writers: Vec<vk::CompareOp>,
}

/// The depths that a draw's depths are compared with.
#[derive(Clone, Debug)]
pub(crate) struct DepthUse {
    pub(crate) op: vk::CompareOp,
    /// Depths of clip space are from -1.
    pub(crate) from_minus_one: bool,
    /// The least and the greatest depth of the viewport, if they are known.
    pub(crate) range: Option<[f32; 2]>,
    /// See [`Pass::cleared_depth`].
    pub(crate) cleared: Option<f32>,
    /// See [`Pass::depth_writers`].
    pub(crate) writers: Vec<vk::CompareOp>,
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
    /// Parameters in a buffer.
    Indirect(Indirect),
}

/// Draws whose parameters are in a buffer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Indirect {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) is_indexed: bool,
    /// The number of draws, or the greatest one.
    pub(crate) count: u32,
    pub(crate) stride: u32,
    /// The buffer of the number of draws, and its offset.
    pub(crate) counted: Option<(vk::Buffer, u64)>,
}

/// A draw of Gaussians, whose contents are looked at when it is submitted.
pub(crate) struct Draw {
    pub(crate) pipeline: Arc<Pipeline>,
    /// The state with the values of its dynamic states.
    pub(crate) state: GaussianState,
    pub(crate) call: Call,
    pub(crate) inputs: Inputs,
    pub(crate) cameras: Option<Arc<Vec<Camera>>>,
    pub(crate) viewport: Option<[f32; 4]>,
    /// The depth test, if there is one.
    pub(crate) depth: Option<DepthUse>,
    /// The first draw of the sorted set, if it is another.
    pub(crate) first_of_set: Option<Arc<Draw>>,
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
    /// Compute shaders run.
    Dispatch,
    Draw(Arc<Draw>),
}

/// A command buffer.
#[derive(Clone, Default)]
pub(crate) struct Recording {
    pub(crate) pool: vk::CommandPool,
    pub(crate) pipeline: Option<Arc<Pipeline>>,
    pub(crate) inputs: Inputs,
    pub(crate) cameras: Option<Arc<Vec<Camera>>>,
    /// The values of dynamic states, by state.
    pub(crate) dynamic: BTreeMap<i32, Vec<u8>>,
    pub(crate) viewport: Option<[f32; 4]>,
    pub(crate) depth_range: Option<[f32; 2]>,
    /// The stages for which constants were pushed.
    pub(crate) constants: vk::ShaderStageFlags,
    pub(crate) sets: BTreeMap<u32, BoundSet>,
    /// The first descriptor of bindings that were pushed, by set; `None` is one that the layer does not follow.
    pub(crate) pushed: BTreeMap<(u32, u32), Option<BufferDescriptor>>,
    pub(crate) pass: Option<Pass>,
    /// A sorted set has begun; with what its draws share, after the first.
    pub(crate) set: Option<Option<Shared>>,
    /// The first draw of that set.
    pub(crate) first_of_set: Option<Arc<Draw>>,
    /// The sources of cameras so far.
    pub(crate) sources: Sources,
    pub(crate) operations: Vec<Operation>,
}

/// Sources of the cameras of a command buffer.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sources {
    /// True if it sets cameras.
    pub(crate) sets: bool,
    /// True if it draws through cameras that commands set.
    pub(crate) by_command: bool,
    /// True if it draws through cameras in a buffer.
    pub(crate) by_buffer: bool,
}

impl Recording {
    /// A command buffer of a pool, in which nothing is recorded.
    pub(crate) fn new(pool: vk::CommandPool) -> Self {
        Self { pool, ..Self::default() }
    }

    /// Begins a subpass, in which nothing is drawn yet.
    pub(crate) fn begin_pass(&mut self, subpass: Subpass, index: Option<SubpassIndex>, cleared_depth: Option<f32>) {
        let (drawn, depth_writers) = Default::default();
        self.pass = Some(Pass { subpass, index, drawn, cleared_depth, depth_writers });
    }

    /// Goes on with the next subpass.
    pub(crate) fn next_subpass(&mut self) {
        let Some(SubpassIndex { render_pass, index }) = self.pass.take().and_then(|pass| pass.index) else {
            return;
        };
        let index = index + 1;
        let subpass = render_pass.get(index).cloned().unwrap_or_default();
        self.begin_pass(subpass, Some(SubpassIndex { render_pass, index }), None);
    }

    /// The state that is undefined after other command buffers were executed.
    pub(crate) fn forget_state(&mut self) {
        *self = Self {
            pool: self.pool,
            pass: self.pass.take(),
            set: self.set.take(),
            sources: self.sources,
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
