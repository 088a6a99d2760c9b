//! Draws of points, lines and triangles: what the driver asks of the triangle mode.

use super::{AttributeStream, BlendState, IndexStream, Rect, Viewport};
use crate::bindings::Bindings;
pub use crate::geometry::DrawPipeline;
pub use crate::raster::gaussian::ResolveProgram;
use isa::ir::Program;
use std::sync::Arc;

/// The most colour attachments of a draw.
pub const MAX_COLOR_ATTACHMENTS: usize = 8;
/// The most viewports of a draw.
pub const MAX_VIEWPORTS: usize = 16;
/// The most clip and cull distances together.
pub const MAX_CLIP_CULL_DISTANCES: usize = 8;

/// What the varyings of a vertex program are that projects Gaussians, by number. Its position is the Gaussian's centre.
pub mod gaussian {
    /// The first of three: the covariance xx, xy, yy in px^2, along the framebuffer's axes.
    pub const COVARIANCE: u32 = 0;
    /// The opacity.
    pub const OPACITY: u32 = 3;
    /// The first of three: red, green, blue.
    pub const COLOR: u32 = 4;
    /// What the Gaussians are sorted by. If it is not written, that is the position's w.
    pub const DEPTH_KEY: u32 = 7;
    /// How many there are.
    pub const VARYINGS: u32 = 8;
}

/// What the varyings of a fragment program are that makes colours of what Gaussians accumulate, by number. All of them
/// are zero where no Gaussian contributed.
pub mod resolve {
    /// The first of four: (C, 1 - T).
    pub const ACCUMULATED: u32 = 0;
    /// The mean depth, weighted by contributions.
    pub const EXPECTED_DEPTH: u32 = 4;
    /// The depth of the last Gaussian that contributed where half of the transmittance or more was left.
    pub const MEDIAN_DEPTH: u32 = 5;
}

/// See [`Packet::GaussianResolveShader`](crate::Packet::GaussianResolveShader). Blending and write masks are those of the
/// [`GaussianState`](super::GaussianState), one per attachment.
#[derive(Clone, Debug)]
pub struct ResolveShader {
    /// The program.
    pub program: Arc<ResolveProgram>,
    /// What it is bound to.
    pub bindings: Bindings,
    /// Whether every sample is shaded for itself.
    pub sample_shading: bool,
    /// Alpha makes coverage.
    pub alpha_to_coverage: bool,
    /// Alpha becomes 1 after that.
    pub alpha_to_one: bool,
}

/// See [`Packet::Draw`](crate::Packet::Draw) and [`Packet::GaussianAppendDraw`](crate::Packet::GaussianAppendDraw).
#[derive(Clone, Debug)]
pub struct Draw {
    /// The programs.
    pub pipeline: Arc<DrawPipeline>,
    /// The state in effect.
    pub state: Arc<DrawState>,
    /// What [`VertexInput::Attribute`] counts in.
    pub attributes: Vec<AttributeStream>,
    /// What the vertex program is bound to.
    pub vertex_bindings: Bindings,
    /// What the fragment program is bound to.
    pub fragment_bindings: Bindings,
    /// The index buffer; without one vertices are consecutive.
    pub indices: Option<IndexStream>,
    /// The first vertex, or the first index.
    pub first: u32,
    /// How many vertices or indices.
    pub count: u32,
    /// The first instance.
    pub first_instance: u32,
    /// How many instances.
    pub instance_count: u32,
    /// The draw's number within an indirect command.
    pub draw_index: u32,
}

/// What [`DrawPipeline`] is made of. Slots of programs are indices into the lists here.
#[derive(Debug)]
pub struct DrawPrograms {
    /// The vertex program.
    pub vertex: Program,
    /// What its inputs are, by slot; 64-bit attributes are not read.
    pub vertex_inputs: Vec<Option<VertexInput>>,
    /// What its outputs are, by slot; `None` is not used by anyone.
    pub vertex_outputs: Vec<Option<VertexOutput>>,
    /// How many varyings there are, each a 32-bit scalar.
    pub varyings: u32,
    /// The fragment stage; without one only depth and stencil are written.
    pub fragment: Option<FragmentPrograms>,
}

/// The fragment stage of [`DrawPrograms`].
#[derive(Debug)]
pub struct FragmentPrograms {
    /// The program.
    pub program: Program,
    /// What its inputs are, by slot.
    pub inputs: Vec<Option<FragmentInput>>,
    /// What its outputs are, by slot; `None` is written nowhere.
    pub outputs: Vec<Option<FragmentOutput>>,
    /// Depth and stencil are tested before it, whatever it does.
    pub early_tests: bool,
    /// It may kill or demote.
    pub discards: bool,
    /// It must run for each sample.
    pub per_sample: bool,
    /// It writes to memory, so that it cannot be skipped.
    pub has_side_effects: bool,
}

/// What the device puts into a vertex program's input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VertexInput {
    /// Component `component` (0 to 3) of an attribute. What a format lacks is 0, or 1 for the fourth component.
    Attribute {
        /// The attribute's index in [`Draw::attributes`].
        stream: usize,
        /// Which component.
        component: usize,
    },
    /// The vertex's index, `vertex_offset` included.
    VertexIndex,
    /// The instance's number, the first instance included.
    InstanceIndex,
    /// The first vertex, or the vertex offset.
    BaseVertex,
    /// The first instance.
    BaseInstance,
    /// [`Draw::draw_index`].
    DrawIndex,
}

/// What a vertex program's output is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VertexOutput {
    /// A component of the position in clip space.
    Position(usize),
    /// The side of a point in pixels.
    PointSize,
    /// A distance that is clipped at 0.
    ClipDistance(usize),
    /// A distance: primitives that are negative in all vertices are culled.
    CullDistance(usize),
    /// The layer that is rendered to.
    Layer,
    /// The viewport.
    ViewportIndex,
    /// A varying.
    Varying(u32),
}

/// How a varying follows from its values at the vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// Perspective-correct.
    Perspective,
    /// Linear in the framebuffer.
    Linear,
    /// The provoking vertex's bits.
    Flat,
}

/// Where within a pixel a varying is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sampling {
    /// At the pixel's centre, or at the sample where each sample is shaded.
    Center,
    /// At a point within both the pixel and the primitive.
    Centroid,
    /// At the sample.
    Sample,
}

/// What the device puts into a fragment program's input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FragmentInput {
    /// A varying.
    Varying {
        /// Its number.
        index: u32,
        /// How it follows from the vertices.
        interpolation: Interpolation,
        /// Where.
        sampling: Sampling,
    },
    /// x, y, depth, 1 / w.
    FragCoord(usize),
    /// The place within a point, 0 to 1.
    PointCoord(usize),
    /// A Bool register: whether the primitive faces the front.
    FrontFacing,
    /// The primitive's number within the draw's instance.
    PrimitiveId,
    /// The sample shaded.
    SampleId,
    /// The sample's place within the pixel, 0 to 1.
    SamplePosition(usize),
    /// The samples covered that this invocation is for.
    SampleMask,
    /// The layer.
    Layer,
    /// The viewport.
    ViewportIndex,
}

/// Where a fragment program's output goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FragmentOutput {
    /// A component of a colour attachment's source, the second source (of dual-source blending) if `index` is 1.
    Color {
        /// The attachment.
        attachment: usize,
        /// The component.
        component: usize,
        /// 0 or 1.
        index: usize,
    },
    /// The depth.
    Depth,
    /// Samples to keep.
    SampleMask,
}

/// How vertices make primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum Topology {
    PointList,
    LineList,
    LineStrip,
    TriangleList,
    TriangleStrip,
    TriangleFan,
    LineListWithAdjacency,
    LineStripWithAdjacency,
    TriangleListWithAdjacency,
    TriangleStripWithAdjacency,
}

/// What of a polygon is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum PolygonMode {
    Fill,
    Line,
    Point,
}

/// A comparison: `reference op stored`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum CompareOp {
    Never,
    Less,
    Equal,
    LessOrEqual,
    Greater,
    NotEqual,
    GreaterOrEqual,
    Always,
}

/// What becomes of a stencil value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum StencilOp {
    Keep,
    Zero,
    Replace,
    IncrementAndClamp,
    DecrementAndClamp,
    Invert,
    IncrementAndWrap,
    DecrementAndWrap,
}

/// The stencil test of one face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StencilFace {
    /// When the stencil test fails.
    pub fail: StencilOp,
    /// When both tests pass.
    pub pass: StencilOp,
    /// When only the depth test fails.
    pub depth_fail: StencilOp,
    /// `reference & compare_mask op stored & compare_mask`.
    pub compare: CompareOp,
    /// The bits compared.
    pub compare_mask: u8,
    /// The bits written.
    pub write_mask: u8,
    /// The reference.
    pub reference: u8,
}

/// Depth and stencil state. By default nothing is tested.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthStencil {
    /// The depth test; `None` passes always and writes nothing.
    pub depth: Option<DepthTest>,
    /// The depth bounds that the stored depth must lie in.
    pub bounds: Option<(f32, f32)>,
    /// The stencil test of front and back faces.
    pub stencil: Option<[StencilFace; 2]>,
}

/// The depth test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DepthTest {
    /// `fragment op stored`.
    pub compare: CompareOp,
    /// Whether depth is written where it passes.
    pub write: bool,
}

/// Depth bias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthBias {
    /// In units of the depth format's resolution.
    pub constant: f32,
    /// The greatest bias if positive, the least if negative; none if 0.
    pub clamp: f32,
    /// Times the polygon's greatest slope.
    pub slope: f32,
}

/// A logic operation of source s and destination d.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum LogicOp {
    Clear,
    And,
    AndReverse,
    Copy,
    AndInverted,
    NoOp,
    Xor,
    Or,
    Nor,
    Equivalent,
    Invert,
    OrReverse,
    CopyInverted,
    OrInverted,
    Nand,
    Set,
}

/// The fixed-function state of a draw, static and dynamic alike.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawState {
    /// How vertices make primitives.
    pub topology: Topology,
    /// Whether the greatest index restarts the primitive.
    pub primitive_restart: bool,
    /// The viewports.
    pub viewports: Vec<Viewport>,
    /// The scissors, one for each viewport.
    pub scissors: Vec<Rect>,
    /// Depth is clamped to the viewport's range, and primitives are not clipped at the near and far planes.
    pub depth_clamp: bool,
    /// Nothing is rasterized.
    pub rasterizer_discard: bool,
    /// What of polygons is drawn.
    pub polygon_mode: PolygonMode,
    /// Whether front faces are culled.
    pub cull_front: bool,
    /// Whether back faces are culled.
    pub cull_back: bool,
    /// Whether front faces are clockwise in the framebuffer (y down); else they are counter-clockwise.
    pub front_clockwise: bool,
    /// Depth bias, if enabled.
    pub depth_bias: Option<DepthBias>,
    /// The width of lines in pixels.
    pub line_width: f32,
    /// Whether the provoking vertex is the last, not the first.
    pub provoking_last: bool,
    /// Samples per pixel of the pass: 1 or 4.
    pub samples: u32,
    /// The samples that may be covered.
    pub sample_mask: u32,
    /// Whether every sample is shaded for itself.
    pub sample_shading: bool,
    /// Alpha makes coverage.
    pub alpha_to_coverage: bool,
    /// Alpha becomes 1 after that.
    pub alpha_to_one: bool,
    /// Depth and stencil.
    pub depth_stencil: DepthStencil,
    /// The logic operation, if enabled; it then replaces blending.
    pub logic_op: Option<LogicOp>,
    /// Blending and write masks, one per colour attachment.
    pub blend: Vec<BlendState>,
    /// The constants of the constant blend factors.
    pub blend_constants: [f32; 4],
}

impl DrawState {
    /// Filled primitives over a framebuffer of that many pixels, one sample each: nothing is culled, tested, biased or
    /// blended, and front faces are clockwise. Attachments have no state yet.
    pub fn new(topology: Topology, [width, height]: [u32; 2]) -> Self {
        Self {
            topology,
            primitive_restart: false,
            viewports: vec![Viewport {
                x: 0.0,
                y: 0.0,
                width: width as f32,
                height: height as f32,
                min_depth: 0.0,
                max_depth: 1.0,
            }],
            scissors: vec![Rect {
                x: 0,
                y: 0,
                width,
                height,
            }],
            depth_clamp: false,
            rasterizer_discard: false,
            polygon_mode: PolygonMode::Fill,
            cull_front: false,
            cull_back: false,
            front_clockwise: true,
            depth_bias: None,
            line_width: 1.0,
            provoking_last: false,
            samples: 1,
            sample_mask: u32::MAX,
            sample_shading: false,
            alpha_to_coverage: false,
            alpha_to_one: false,
            depth_stencil: DepthStencil {
                depth: None,
                bounds: None,
                stencil: None,
            },
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
        }
    }
}
