//! The interface of a translated shader: inputs, outputs, descriptors, push constants.

use std::ops::Range;

use isa::ir::{ImageShape, Program};

/// A programmable stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Runs once for each vertex (or Gaussian).
    Vertex,
    /// Runs once for each output vertex of a patch.
    TessellationControl,
    /// Runs once for each vertex into which a patch is divided.
    TessellationEvaluation,
    /// Runs for each primitive.
    Geometry,
    /// Runs once for each fragment, in quads.
    Fragment,
    /// Runs in workgroups.
    Compute,
}

impl std::fmt::Display for Stage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Vertex => "vertex",
            Self::TessellationControl => "tessellation control",
            Self::TessellationEvaluation => "tessellation evaluation",
            Self::Geometry => "geometry",
            Self::Fragment => "fragment",
            Self::Compute => "compute",
        })
    }
}

/// The numeric type of a scalar at the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ScalarType {
    /// A float of 16 (in a register: 32), 32 or 64 bits.
    Float {
        /// Bits.
        width: u32,
    },
    /// A signed integer of 8 to 64 bits.
    Int {
        /// Bits.
        width: u32,
    },
    /// An unsigned integer of 8 to 64 bits.
    Uint {
        /// Bits.
        width: u32,
    },
    /// A truth value.
    Bool,
}

/// A value that Vulkan defines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are SPIR-V's")]
pub enum BuiltIn {
    Position,
    PointSize,
    ClipDistance,
    CullDistance,
    VertexIndex,
    InstanceIndex,
    BaseVertex,
    BaseInstance,
    DrawIndex,
    ViewIndex,
    DeviceIndex,
    Layer,
    ViewportIndex,
    PrimitiveId,
    InvocationId,
    PatchVertices,
    TessCoord,
    TessLevelOuter,
    TessLevelInner,
    FragCoord,
    PointCoord,
    FrontFacing,
    SampleId,
    SamplePosition,
    SampleMask,
    FragDepth,
    FragStencilRef,
    WorkgroupId,
    NumWorkgroups,
}

/// The interpolation of a fragment input between the vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// Perspective-correct.
    Perspective,
    /// Linear in the framebuffer.
    Linear,
    /// The provoking vertex's value.
    Flat,
}

/// The point within a pixel at which a fragment input is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sampling {
    /// At the pixel's centre (or at the sample, if the draw shades each sample).
    Center,
    /// At a point within both the pixel and the primitive.
    Centroid,
    /// At the sample.
    Sample,
}

/// The source of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InputSource {
    /// A vertex attribute or an interpolated output of the stage before.
    Location {
        /// The location.
        location: u32,
        /// The component, in units of 32 bits.
        component: u32,
        /// The interpolation; fragment stage only.
        interpolation: Interpolation,
        /// The sampling point; fragment stage only.
        sampling: Sampling,
    },
    /// A component, or an element, of a built-in.
    BuiltIn {
        /// The built-in.
        built_in: BuiltIn,
        /// Component or element.
        component: u32,
    },
    /// The number in the batch of the patch to which a lane belongs; tessellation evaluation stage only.
    Patch,
}

/// One scalar that the program reads, or a word of one of 64 bits that another stage writes. Its slot in the program is its index in [`Interface::inputs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Its source.
    pub source: InputSource,
    /// Its type.
    pub numeric: ScalarType,
}

/// The target of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum OutputTarget {
    /// An input of the next stage, or a colour attachment.
    Location {
        /// The location.
        location: u32,
        /// The component, in units of 32 bits.
        component: u32,
        /// The input of the blend equation, for dual-source blending.
        index: u32,
    },
    /// A component, or an element, of a built-in.
    BuiltIn {
        /// The built-in.
        built_in: BuiltIn,
        /// Component or element.
        component: u32,
    },
    /// The number of vertices that a lane emitted; geometry stage only.
    VertexCount,
}

/// One scalar, or a word of one of 64 bits, that the program writes. Its slot in the program is its index in [`Interface::outputs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// Its target.
    pub target: OutputTarget,
    /// Its type.
    pub numeric: ScalarType,
}

/// The kind of descriptor that a variable takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum DescriptorKind {
    Sampler,
    SampledImage,
    CombinedImageSampler,
    StorageImage,
    UniformTexelBuffer,
    StorageTexelBuffer,
    UniformBuffer,
    StorageBuffer,
    InputAttachment,
}

/// The image that a descriptor must hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageUse {
    /// Its kind.
    pub shape: ImageShape,
    /// The type that its texels are read as.
    pub numeric: ScalarType,
}

/// A descriptor, or an array of them, that the program uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShaderBinding {
    /// The descriptor set.
    pub set: u32,
    /// The binding in it.
    pub binding: u32,
    /// The kind of its descriptors.
    pub kind: DescriptorKind,
    /// The array's length, or 1. Of an array without a length, the greatest that the options permit.
    pub count: u32,
    /// True if the array has no length, so that the layout decides how many descriptors there are.
    pub is_unsized: bool,
    /// The program's resource slot of the first descriptor; the others follow. Resource slots are unique over all
    /// kinds; a combined image sampler uses the same slot for both.
    pub slot: u32,
    /// Buffers: the least size in bytes that covers all members but a runtime array.
    pub size: u64,
    /// True if the program may write to it.
    pub writable: bool,
    /// The image, for image descriptors.
    pub image: Option<ImageUse>,
    /// Input attachments: the index of the attachment.
    pub attachment: Option<u32>,
    /// The variable's name, for messages.
    pub name: Option<String>,
}

/// A fragment shader's promise about the depth that it writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthMode {
    /// It writes no depth.
    #[default]
    NotWritten,
    /// The depth may have any value.
    Replacing,
    /// The depth is at least the primitive's.
    Greater,
    /// The depth is at most the primitive's.
    Less,
    /// The depth is the primitive's. A depth that breaks this promise is written all the same.
    Unchanged,
}

/// The values of vertices in a batch's workgroup memory, where tessellation and geometry stages take and give them. Each
/// primitive or patch of the batch has the same number of bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VertexMemory {
    /// The first byte.
    pub start: u32,
    /// The bytes of each primitive or patch.
    pub stride: u32,
    /// The scalars that are read or written.
    pub scalars: Vec<MemoryScalar>,
}

/// A scalar in the memory of a primitive or patch, or a word of one of 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryScalar {
    /// The output that it is, of this stage or of the one before.
    pub target: OutputTarget,
    /// Its type.
    pub numeric: ScalarType,
    /// Its first byte, of the first vertex.
    pub offset: u32,
    /// The bytes from one vertex to the next; `None` for a value of the patch.
    pub vertex_stride: Option<u32>,
}

/// The exchange of vertices of a tessellation or geometry stage.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VertexExchange {
    /// The number of primitives or patches of a batch. A geometry stage has a lane for each; a tessellation control
    /// stage has a lane for each output vertex of each patch, in order.
    pub groups: u32,
    /// The lanes of a batch, a multiple of 16.
    pub lanes: u32,
    /// The inputs. They are preloaded.
    pub inputs: VertexMemory,
    /// The outputs. A vertex that a geometry stage emits begins with a word: bit 0 is 1 if the vertex is the first of a
    /// strip, and the bits above are the number of its stream.
    pub outputs: VertexMemory,
    /// Geometry: the bytes of an emitted vertex.
    pub vertex_bytes: u32,
}

/// The most buffers that transform feedback writes.
pub(crate) const MAX_TRANSFORM_FEEDBACK_BUFFERS: usize = 4;

/// The most streams of vertices that a geometry stage emits.
pub(crate) const MAX_VERTEX_STREAMS: usize = 4;

/// The outputs that transform feedback captures.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TransformFeedback {
    /// The bytes from one vertex to the next in each buffer; 0 if the buffer is not written.
    pub strides: [u32; MAX_TRANSFORM_FEEDBACK_BUFFERS],
    /// The stream of the vertices in each buffer.
    pub streams: [u32; MAX_TRANSFORM_FEEDBACK_BUFFERS],
    /// The scalars by buffer and offset. They don't overlap.
    pub scalars: Vec<CapturedScalar>,
}

/// A scalar that transform feedback captures, or a word of one of 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CapturedScalar {
    /// The output.
    pub target: OutputTarget,
    /// The buffer.
    pub buffer: u32,
    /// The first byte within a vertex, a multiple of 4.
    pub offset: u32,
}

/// The domain of tessellated patches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are SPIR-V's")]
pub enum Domain {
    Triangles,
    Quads,
    Isolines,
}

/// The spacing of the vertices of a tessellated edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are SPIR-V's")]
pub enum Spacing {
    Equal,
    FractionalEven,
    FractionalOdd,
}

/// The primitives that a geometry stage takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are SPIR-V's")]
pub enum InputPrimitive {
    Points,
    Lines,
    LinesAdjacency,
    Triangles,
    TrianglesAdjacency,
}

/// The primitives that a geometry stage emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are SPIR-V's")]
pub enum OutputPrimitive {
    Points,
    LineStrip,
    TriangleStrip,
}

/// The execution modes of tessellation and geometry stages. Both tessellation stages may have those of tessellation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PrimitiveModes {
    /// Tessellation: the domain.
    pub domain: Option<Domain>,
    /// Tessellation: the spacing.
    pub spacing: Option<Spacing>,
    /// Tessellation: true if triangles are clockwise.
    pub clockwise: Option<bool>,
    /// Tessellation: true if the vertices become points.
    pub point_mode: bool,
    /// Tessellation control: the number of vertices of an output patch. Geometry: the most vertices that are emitted.
    pub output_vertices: Option<u32>,
    /// Geometry: the number of invocations for each primitive.
    pub invocations: Option<u32>,
    /// Geometry: the primitives that it takes.
    pub input: Option<InputPrimitive>,
    /// Geometry: the primitives that it emits.
    pub output: Option<OutputPrimitive>,
}

/// A translated shader's interface.
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    /// The stage.
    pub stage: Stage,
    /// The scalars that it reads; see [`Input`].
    pub inputs: Vec<Input>,
    /// The scalars that it writes; see [`Output`].
    pub outputs: Vec<Output>,
    /// The descriptors that it is bound to.
    pub descriptors: Vec<ShaderBinding>,
    /// The bytes of push constants that it declares.
    pub push_constants: Option<Range<u32>>,
    /// Compute: invocations of a workgroup in x, y and z; 1 otherwise.
    pub workgroup_size: [u32; 3],
    /// Fragment: true if depth and stencil are tested before the shader.
    pub early_fragment_tests: bool,
    /// Fragment: true if the sample mask that it reads is that after early tests.
    pub post_depth_coverage: bool,
    /// Fragment: the promise about the depth that it writes.
    pub depth: DepthMode,
    /// Fragment: true if it may kill or demote.
    pub discards: bool,
    /// Fragment: true if it must run for each sample.
    pub per_sample: bool,
    /// Tessellation and geometry: the execution modes.
    pub modes: PrimitiveModes,
    /// Tessellation and geometry: the exchange of vertices.
    pub exchange: VertexExchange,
    /// The last stage before rasterization: the outputs that transform feedback captures, if there are any.
    pub transform_feedback: Option<TransformFeedback>,
    /// True if it stores to buffers or images, or uses atomics, so that it can't be skipped.
    pub has_side_effects: bool,
    /// True if it accesses memory by device addresses.
    pub uses_addresses: bool,
}

impl Interface {
    /// The locations that the program reads, in order, each with the type of its first scalar.
    pub fn locations_read(&self) -> Vec<(u32, ScalarType)> {
        let mut found: Vec<(u32, u32, ScalarType)> = self
            .inputs
            .iter()
            .filter_map(|input| match input.source {
                InputSource::Location { location, component, .. } => Some((location, component, input.numeric)),
                InputSource::BuiltIn { .. } | InputSource::Patch => None,
            })
            .collect();
        found.sort_by_key(|(location, component, _)| (*location, *component));
        found.dedup_by_key(|(location, ..)| *location);
        found.into_iter().map(|(location, _, numeric)| (location, numeric)).collect()
    }
}

/// A shader ready for the device.
#[derive(Clone, Debug, PartialEq)]
pub struct Shader {
    /// The program.
    pub program: Program,
    /// The meaning of its input, output and resource slots.
    pub interface: Interface,
}
