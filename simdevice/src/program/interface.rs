//! The interfaces of programs: the meanings of the slots of their inputs and outputs.

use crate::limits::MAX_TRANSFORM_FEEDBACK_BUFFERS;
use crate::tessellation::Tessellation;
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
    /// The number of varyings that the fragment stage reads, each a 32-bit scalar.
    pub varyings: u32,
    /// The outputs of the last stage before rasterization that transform feedback writes.
    pub captured: Option<CapturedOutputs>,
    /// The tessellation stages.
    pub tessellation: Option<TessellationPrograms>,
    /// The geometry stage.
    pub geometry: Option<GeometryPrograms>,
    /// The fragment stage. Without one only depth and stencil are written.
    pub fragment: Option<FragmentPrograms>,
}

impl DrawPrograms {
    /// The number of varyings that the fragment stage reads: none if there is no such stage.
    pub(crate) fn varyings_read(&self) -> u32 {
        self.fragment.as_ref().map_or(0, |_| self.varyings)
    }
}

/// The outputs that transform feedback writes, by buffer.
#[derive(Clone, Debug, Default)]
pub struct CapturedOutputs {
    /// The number of varyings that are written. Their numbers follow those of the varyings that the fragment stage reads.
    pub varyings: u32,
    /// The buffers.
    pub buffers: [CapturedVertex; MAX_TRANSFORM_FEEDBACK_BUFFERS],
}

/// The layout of a vertex in a buffer of transform feedback.
#[derive(Clone, Debug, Default)]
pub struct CapturedVertex {
    /// The bytes from one vertex to the next; 0 if the buffer is not written.
    pub stride: u32,
    /// The stream of the vertices.
    pub stream: u32,
    /// The values in the order of their offsets. Bytes between them are not written.
    pub values: Vec<CapturedValue>,
}

/// A 32-bit value of a vertex in a buffer of transform feedback.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CapturedValue {
    /// The first byte within the vertex, a multiple of 4.
    pub offset: u32,
    /// The number of the varying.
    pub varying: u32,
}

/// A program that takes vertices of primitives or patches from the stage before. The outputs of a vertex program that
/// such a program takes are its varyings.
#[derive(Debug)]
pub struct PrimitiveProgram {
    /// The program. The vertices that it takes are preloaded.
    pub program: Program,
    /// The meanings of its inputs, by slot.
    pub inputs: Vec<Option<PrimitiveInput>>,
    /// The vertices that it takes. Their values are numbered as the stage before gives them.
    pub input_memory: VertexMemory,
    /// The number of primitives or patches of a batch.
    pub groups: u32,
    /// The lanes of a batch.
    pub lanes: u32,
}

/// The values of vertices in a batch's workgroup memory.
#[derive(Clone, Debug, Default)]
pub struct VertexMemory {
    /// The first byte.
    pub start: u32,
    /// The bytes of each primitive or patch.
    pub stride: u32,
    /// The values that are exchanged.
    pub values: Vec<VertexValue>,
}

/// A 32-bit value of each vertex, or of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VertexValue {
    /// The number of the value among those that the stage before gives.
    pub number: u32,
    /// The first byte, within a primitive or patch, of the first vertex.
    pub offset: u32,
    /// The bytes from one vertex to the next; `None` for a value of the patch.
    pub vertex_stride: Option<u32>,
}

/// The tessellation stages of [`DrawPrograms`].
#[derive(Debug)]
pub struct TessellationPrograms {
    /// The control program: a lane for each vertex of an output patch.
    pub control: PrimitiveProgram,
    /// The vertices and the patch that it gives.
    pub output_memory: VertexMemory,
    /// The first byte, within a patch, of each outer level; `None` is 0.
    pub outer_levels: [Option<u32>; 4],
    /// The first byte, within a patch, of each inner level; `None` is 0.
    pub inner_levels: [Option<u32>; 2],
    /// The number of vertices of an output patch.
    pub output_vertices: u32,
    /// The evaluation program: a lane for each vertex into which patches are divided.
    pub evaluation: PrimitiveProgram,
    /// The meanings of its outputs, by slot; `None` is not used.
    pub outputs: Vec<Option<VertexOutput>>,
    /// The way in which patches are divided.
    pub tessellation: Tessellation,
}

/// The geometry stage of [`DrawPrograms`].
#[derive(Debug)]
pub struct GeometryPrograms {
    /// The program: a lane for each invocation of each primitive.
    pub program: PrimitiveProgram,
    /// The number of invocations for each primitive.
    pub invocations: u32,
    /// The slot of the output that counts a lane's vertices.
    pub count: u32,
    /// The vertices that it gives. Each begins with a word: bit 0 is 1 if the vertex is the first of a strip, and the
    /// bits above are the number of its stream.
    pub output_memory: VertexMemory,
    /// The bytes of a vertex that it gives.
    pub vertex_bytes: u32,
    /// The meanings of the values that it gives; `None` is not used.
    pub outputs: Vec<Option<VertexOutput>>,
    /// The number of corners of the primitives that it gives: 1 to 3.
    pub corners: usize,
}

/// The value that the device gives to an input of a tessellation or geometry program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PrimitiveInput {
    /// The primitive's or patch's number within the draw's instance.
    PrimitiveId,
    /// The number of a geometry program's invocation.
    InvocationId,
    /// The number of vertices of a patch.
    PatchVertices,
    /// The number in the batch of the patch.
    Patch,
    /// A coordinate of the vertex within the patch's domain: 0 to 2.
    TessCoord(usize),
    /// The layer of the view that is drawn; 0 without views.
    ViewIndex,
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
    /// True if the sample mask that the program reads is that after early tests.
    pub post_depth_coverage: bool,
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
    /// The primitive's number; geometry programs only.
    PrimitiveId,
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
    /// The alpha of alpha to coverage, where it is not attachment 0's.
    CoverageAlpha,
    /// The depth.
    Depth,
    /// The mask of samples to keep.
    SampleMask,
    /// The reference value of the stencil test and of the operation that replaces.
    StencilReference,
}

/// The value that the device gives to an input of a compute program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComputeInput {
    /// The workgroup's number along an axis: 0 to 2.
    WorkgroupId(usize),
    /// The number of workgroups of the dispatch along an axis: 0 to 2.
    WorkgroupCount(usize),
}
