//! The interfaces of programs: the meanings of the slots of their inputs and outputs.

use isa::ir::Program;

/// The varyings of a vertex program that projects Gaussians, by number. The position that it writes is the Gaussian's
/// centre.
pub mod gaussian {
    /// The first of three: the covariance xx, xy, yy in px^2, along the framebuffer's axes.
    pub const COVARIANCE: u32 = 0;
    /// The opacity.
    pub const OPACITY: u32 = 3;
    /// The first of three: red, green, blue.
    pub const COLOR: u32 = 4;
    /// The value that the Gaussians are sorted by. If it is not written, they are sorted by the position's w.
    pub const DEPTH_KEY: u32 = 7;
    /// The number of varyings.
    pub const VARYINGS: u32 = 8;
}

/// The varyings of a fragment program that computes a pixel's colours from its accumulated Gaussians, by number. All of
/// them are zero if no Gaussian contributed.
pub mod resolve {
    /// The first of four: the accumulated colour C as red, green and blue, and 1 - T with the transmittance T.
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
    /// The number of vectors that the camera takes.
    pub const CAMERA_LOCATIONS: u32 = 6;
}

/// The programs of a [`DrawPipeline`](crate::program::vertex::DrawPipeline). Slots of programs are indices into the
/// lists of inputs and outputs.
#[derive(Debug)]
pub struct DrawPrograms {
    /// The vertex program.
    pub vertex: Program,
    /// The meanings of its inputs, by slot. 64-bit attributes are not read.
    pub vertex_inputs: Vec<Option<VertexInput>>,
    /// The meanings of its outputs, by slot; `None` is not used.
    pub vertex_outputs: Vec<Option<VertexOutput>>,
    /// The number of varyings, each a 32-bit scalar.
    pub varyings: u32,
    /// The fragment stage. Without one only depth and stencil are written.
    pub fragment: Option<FragmentPrograms>,
}

/// The fragment stage of [`DrawPrograms`].
#[derive(Debug)]
pub struct FragmentPrograms {
    /// The program.
    pub program: Program,
    /// The meanings of its inputs, by slot.
    pub inputs: Vec<Option<FragmentInput>>,
    /// The meanings of its outputs, by slot; `None` is not used.
    pub outputs: Vec<Option<FragmentOutput>>,
    /// True if depth and stencil are tested before the program, whatever it does.
    pub early_tests: bool,
    /// True if the program may discard fragments or demote invocations to helpers.
    pub discards: bool,
    /// True if the program must run once for each sample.
    pub per_sample: bool,
    /// True if the program writes memory, so that it cannot be skipped.
    pub has_side_effects: bool,
}

/// The value that the device gives to an input of a vertex program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VertexInput {
    /// Component `component` (0 to 3) of an attribute. A component that the format lacks is 0, or 1 for the fourth
    /// component.
    Attribute {
        /// The attribute's index in [`Draw::attributes`](crate::packet::Draw::attributes).
        stream: usize,
        /// The component's index.
        component: usize,
    },
    /// The vertex's index, including `vertex_offset`.
    VertexIndex,
    /// The instance's number, including the first instance.
    InstanceIndex,
    /// The first vertex, or the vertex offset.
    BaseVertex,
    /// The first instance.
    BaseInstance,
    /// The draw's number within an indirect command: [`Draw::draw_index`](crate::packet::Draw::draw_index).
    DrawIndex,
    /// The layer of the view that is drawn; 0 without views.
    ViewIndex,
}

/// The meaning of an output of a vertex program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VertexOutput {
    /// A component of the position in clip space.
    Position(usize),
    /// The side of a point in pixels.
    PointSize,
    /// A clip distance. Primitives are clipped at its zero.
    ClipDistance(usize),
    /// A cull distance. Primitives are culled if it is negative at all of their vertices.
    CullDistance(usize),
    /// The layer that is rendered to.
    Layer,
    /// The index of the viewport.
    ViewportIndex,
    /// A varying.
    Varying(u32),
}

/// The interpolation of a varying between its values at the vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// Perspective-correct interpolation.
    Perspective,
    /// Linear interpolation in the framebuffer.
    Linear,
    /// The value at the provoking vertex, without interpolation.
    Flat,
}

/// The point within a pixel at which a varying is interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sampling {
    /// The pixel's centre, or the sample if the program runs once for each sample.
    Center,
    /// A point that is inside both the pixel and the primitive.
    Centroid,
    /// The sample.
    Sample,
}

/// The value that the device gives to an input of a fragment program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FragmentInput {
    /// A varying.
    Varying {
        /// The varying's number.
        index: u32,
        /// The interpolation between the vertices.
        interpolation: Interpolation,
        /// The point of the interpolation.
        sampling: Sampling,
    },
    /// A component of the fragment's coordinates: x, y, depth, 1 / w.
    FragCoord(usize),
    /// A coordinate within a point primitive, 0 to 1.
    PointCoord(usize),
    /// A Bool register: true if the primitive faces the front.
    FrontFacing,
    /// The primitive's number within the draw's instance.
    PrimitiveId,
    /// The number of the sample that is shaded.
    SampleId,
    /// A coordinate of the sample's position within the pixel, 0 to 1.
    SamplePosition(usize),
    /// The covered samples that the invocation shades.
    SampleMask,
    /// The layer.
    Layer,
    /// The index of the viewport.
    ViewportIndex,
}

/// The destination of an output of a fragment program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FragmentOutput {
    /// A component of a colour attachment's source.
    Color {
        /// The attachment.
        attachment: usize,
        /// The component.
        component: usize,
        /// The source: 0, or 1 for the second source of dual-source blending.
        index: usize,
    },
    /// The depth.
    Depth,
    /// The mask of samples to keep.
    SampleMask,
}

/// The value that the device gives to an input of a compute program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComputeInput {
    /// The workgroup's number along an axis: 0 to 2.
    WorkgroupId(usize),
    /// The number of workgroups of the dispatch along an axis: 0 to 2.
    WorkgroupCount(usize),
}
