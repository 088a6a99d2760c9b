//! The interfaces of programs: the meaning of the slots of their inputs and outputs.

use isa::ir::Program;

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
    /// The depth of the last Gaussian that contributed where half of the transmittance or more was left: the median.
    pub const MEDIAN_DEPTH: u32 = 5;
    /// The mean depth variable, weighted by contributions.
    pub const EXPECTED_LINEAR_DEPTH: u32 = 6;
    /// The depth variable of the median.
    pub const MEDIAN_LINEAR_DEPTH: u32 = 7;
    /// The first of two: the vertex index and the instance index of the median.
    pub const MEDIAN_GAUSSIAN: u32 = 8;
    /// The first of two, of the first Gaussian that contributed.
    pub const NEAREST_GAUSSIAN: u32 = 10;
    /// The first of those that the camera is: [`CAMERA_LOCATIONS`] of four each.
    pub const CAMERA: u32 = 12;
    /// How many vectors the camera is.
    pub const CAMERA_LOCATIONS: u32 = 6;
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
    /// The view that is drawn, which is its layer; 0 without views.
    ViewIndex,
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

/// What the device puts into a program's input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComputeInput {
    /// The workgroup's number along an axis: 0 to 2.
    WorkgroupId(usize),
    /// How many workgroups the dispatch has along an axis: 0 to 2.
    WorkgroupCount(usize),
}
