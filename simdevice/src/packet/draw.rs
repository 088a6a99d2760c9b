//! Draws, sorted sets of Gaussians and dispatches, and the streams that they read.

use super::decoding::Decodings;
use crate::format::Format;
use crate::program::bindings::Bindings;
use crate::program::compute::ComputeProgram;
use crate::program::fragment::GaussianFragmentProgram;
use crate::program::vertex::DrawPipeline;
use crate::state::gaussian::{Camera, GaussianState};
use crate::state::{DrawState, Rect, Viewport};
use crate::transform_feedback::TransformFeedback;
use devmem::{BufferRange, host};
use std::sync::Arc;

/// The source of one vertex attribute. An element outside of `buffer` reads as zero.
#[derive(Clone, Debug)]
pub struct AttributeStream {
    /// The vertex buffer, from the bound offset on.
    pub buffer: BufferRange,
    /// Bytes from one vertex to the next.
    pub stride: u32,
    /// Bytes from the vertex's start to the attribute.
    pub offset: u32,
    /// The format of the stored components.
    pub format: Format,
    /// The number of instances for which a value is used; 0 uses the first value for all. `None` reads by vertex.
    pub instance_divisor: Option<u32>,
}

/// An index buffer.
#[derive(Clone, Debug)]
pub struct IndexStream {
    /// The indices, from the bound offset on.
    pub buffer: BufferRange,
    /// Bytes per index: 1, 2 or 4.
    pub index_size: u32,
    /// The number that is added to every index.
    pub vertex_offset: i32,
    /// The index that restarts a primitive; `None` for the greatest of its size.
    pub restart: Option<u32>,
}

impl AttributeStream {
    /// The offset in memory of `bytes` bytes from an element on; `None` unless all of them are inside the buffer.
    #[inline]
    pub(crate) fn place(&self, element: u64, bytes: u64) -> Option<u64> {
        let start = element.checked_mul(self.stride.into())?.checked_add(self.offset.into())?;
        if start.checked_add(bytes)? > self.buffer.size {
            return None;
        }
        self.buffer.offset.checked_add(start)
    }

    /// The number of elements inside the buffer; `None` if all elements are the same.
    fn len(&self) -> Option<u64> {
        let stride = Some(u64::from(self.stride)).filter(|stride| *stride > 0)?;
        let memory = self.buffer.memory.len().saturating_sub(self.buffer.offset);
        let bytes = memory.min(self.buffer.size).saturating_sub(self.offset.into());
        let past_first = bytes.checked_sub(self.format.texel_size() as u64);
        Some(past_first.map_or(0, |bytes| bytes / stride + 1))
    }

    /// Reads bytes from an element on. Fills `out` with zeros unless all of the bytes are inside the buffer.
    #[inline]
    pub(crate) fn read(&self, element: u64, out: &mut [u8]) {
        let place = self.place(element, out.len() as u64);
        if place.is_none_or(|place| self.buffer.memory.read(place, out).is_err()) {
            out.fill(0);
        }
    }
}

impl IndexStream {
    /// The number of indices in the buffer.
    pub(crate) fn len(&self) -> u64 {
        let memory = self.buffer.memory.len();
        let bytes = memory.saturating_sub(self.buffer.offset);
        bytes.min(self.buffer.size) / u64::from(self.index_size.max(1))
    }

    /// The index that restarts a primitive.
    pub(crate) fn restart_index(&self) -> u32 {
        self.restart.unwrap_or(match self.index_size {
            1 => 0xFF,
            2 => 0xFFFF,
            _ => u32::MAX,
        })
    }

    /// Reads `len` indices from number `first` on into `out`, without the vertex offset. Indices outside of the buffer
    /// are zero.
    pub(crate) fn read(&self, first: u64, len: u32, out: &mut Vec<u32>) {
        let size = u64::from(self.index_size.max(1));
        out.clear();
        host::resize(out, len as usize, 0);
        let known = self.len().saturating_sub(first).min(len.into()) as usize;
        if known == 0 {
            return;
        }
        // The indices are inside the buffer, so that neither operation overflows.
        let start = self.buffer.offset + first * size;
        let out = &mut out[..known];
        let memory = &self.buffer.memory;
        // Reads inside the buffer do not fail.
        match self.index_size {
            1 => {
                let mut bytes: Vec<u8> = host::zeroed(known);
                let _ = memory.read(start, &mut bytes);
                out.iter_mut().zip(bytes).for_each(|(out, byte)| *out = byte.into());
            }
            2 => {
                let mut halves: Vec<u16> = host::zeroed(known);
                let _ = memory.read(start, &mut halves);
                out.iter_mut().zip(halves).for_each(|(out, half)| *out = half.into());
            }
            _ => {
                let _ = memory.read(start, out);
            }
        }
    }
}

/// A draw: see [`Packet::Draw`](crate::Packet::Draw) and
/// [`Packet::GaussianAppendDraw`](crate::Packet::GaussianAppendDraw).
#[derive(Clone, Debug)]
pub struct Draw {
    /// The programs.
    pub pipeline: Arc<DrawPipeline>,
    /// The state in effect.
    pub state: Arc<DrawState>,
    /// The streams of vertex attributes, numbered as
    /// [`VertexInput::Attribute`](crate::program::interface::VertexInput::Attribute) does.
    pub attributes: Vec<AttributeStream>,
    /// The bindings of the vertex program.
    pub vertex_bindings: Bindings,
    /// The bindings of the tessellation and geometry programs.
    pub primitive_bindings: PrimitiveBindings,
    /// The bindings of the fragment program.
    pub fragment_bindings: Bindings,
    /// The index buffer; without one vertices are consecutive.
    pub indices: Option<IndexStream>,
    /// The first vertex, or the first index.
    pub first: u32,
    /// The number of vertices or indices.
    pub count: u32,
    /// The first instance.
    pub first_instance: u32,
    /// The number of instances.
    pub instance_count: u32,
    /// The draw's number within an indirect command.
    pub draw_index: u32,
    /// The transform feedback that captures the draw's primitives, if it is active.
    pub transform_feedback: Option<Arc<TransformFeedback>>,
}

/// The bindings of the programs between the vertex and the fragment program.
#[derive(Clone, Debug, Default)]
pub struct PrimitiveBindings {
    /// Those of the tessellation control program.
    pub control: Bindings,
    /// Those of the tessellation evaluation program.
    pub evaluation: Bindings,
    /// Those of the geometry program.
    pub geometry: Bindings,
}

/// A dispatch: see [`Packet::Dispatch`](crate::Packet::Dispatch).
#[derive(Clone, Debug)]
pub struct Dispatch {
    /// The program that each workgroup runs.
    pub program: Arc<ComputeProgram>,
    /// The first workgroup's number in x, y and z.
    pub base: [u32; 3],
    /// The number of workgroups in x, y and z.
    pub count: [u32; 3],
    /// The bindings of the program.
    pub bindings: Bindings,
}

/// The beginning of a set: see [`Packet::GaussianBegin`](crate::Packet::GaussianBegin).
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianBegin {
    /// The state that the pipeline fixes.
    pub state: Arc<GaussianState>,
    /// The camera. Gaussians that a vertex program projects do not use it. In a pass with views it is the camera of the
    /// first view, and of all views that have no camera of their own.
    pub camera: Camera,
    /// The cameras of the pass's views after the first, in their order.
    pub further_cameras: Vec<Camera>,
    /// The viewport. Its width and height are W and H of the projection.
    pub viewport: Viewport,
    /// The pixels that may be written.
    pub scissor: Rect,
}

/// The functions that are applied to attributes as they are read: decodings first. They are computed in binary64 and rounded
/// once to binary32.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Activations {
    /// True if standard deviations are exponentials of the stored values.
    pub log_scale: bool,
    /// True if opacities are `1 / (1 + exp(-x))` of the stored values `x`.
    pub logit_opacity: bool,
    /// The decodings of the stored values.
    pub decodings: Decodings,
}

/// The vertex attributes of fixed-function projection.
#[derive(Clone, Debug)]
pub struct GaussianAttributes {
    /// The mean in world units: x, y, z.
    pub position: AttributeStream,
    /// Standard deviations in world units along the rotated axes: x, y, z.
    pub scale: AttributeStream,
    /// The quaternion w, x, y, z; it need not be normalised.
    pub rotation: AttributeStream,
    /// The opacity.
    pub opacity: AttributeStream,
    /// The `(degree + 1)^2` spherical harmonics coefficients of red, green and blue.
    pub spherical_harmonics: Vec<AttributeStream>,
    /// The functions from stored values to attributes.
    pub activations: Activations,
    /// The tables of the decodings, if there are any.
    pub tables: Option<Box<DecodingTables>>,
    /// The transform of the Gaussians, usually by instance.
    pub model: ModelAttributes,
}

/// The tables that decodings read. A table of bounds has an element for each chunk: the minima of all components, then
/// their maxima. A codebook has one element, of 256 numbers. What lies outside of a table's buffer reads as zeros.
#[derive(Clone, Debug, Default)]
pub struct DecodingTables {
    /// That of positions, if they are decoded.
    pub position: Option<AttributeStream>,
    /// That of scales, if they are decoded.
    pub scale: Option<AttributeStream>,
    /// That of opacities, if they are decoded.
    pub opacity: Option<AttributeStream>,
    /// That of coefficient 0, if it is decoded.
    pub color: Option<AttributeStream>,
    /// The codebook of the other coefficients, if they are decoded.
    pub harmonics: Option<AttributeStream>,
    /// The numbers of vertices' entries in a palette, 16 bits each, if there is one.
    pub labels: Option<AttributeStream>,
}

impl DecodingTables {
    /// All tables that there are.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &AttributeStream> {
        let Self { position, scale, opacity, color, harmonics, labels } = self;
        [position, scale, opacity, color, harmonics, labels].into_iter().flatten()
    }
}

/// The vertex attributes that place a copy of Gaussians in the world.
#[derive(Clone, Debug, Default)]
pub struct ModelAttributes {
    /// The rows of a 3x4 matrix from the Gaussians' space to the world, with 4 components each. `None` is the identity.
    pub matrix: Option<Box<[AttributeStream; 3]>>,
    /// The factor of the opacity. `None` is 1.
    pub opacity: Option<AttributeStream>,
}

impl ModelAttributes {
    /// True if there is a matrix or a factor.
    pub fn is_some(&self) -> bool {
        self.matrix.is_some() || self.opacity.is_some()
    }
}

/// Gaussians with attributes: see [`Packet::GaussianAppend`](crate::Packet::GaussianAppend).
#[derive(Clone, Debug)]
pub struct GaussianAppend {
    /// The attributes of the Gaussians.
    pub attributes: GaussianAttributes,
    /// The index buffer that selects vertices. Without one, vertices are consecutive.
    pub indices: Option<IndexStream>,
    /// The first vertex, or the first index.
    pub first: u32,
    /// The number of vertices or indices.
    pub count: u32,
    /// The first instance.
    pub first_instance: u32,
    /// The number of instances.
    pub instance_count: u32,
}

impl GaussianAppend {
    /// The number of Gaussians: vertices times instances.
    pub fn gaussians(&self) -> u64 {
        u64::from(self.count) * u64::from(self.instance_count)
    }

    /// The number of Gaussians [within the buffers](Self::within_buffers).
    pub fn gaussians_within_buffers(&self) -> u64 {
        let [count, instance_count] = self.counts_within_buffers();
        u64::from(count) * u64::from(instance_count)
    }

    /// The same without the vertices and the instances that have no rotation in its buffer. They would read zeros, and a Gaussian
    /// with a quaternion of zeros is skipped.
    #[must_use]
    pub fn within_buffers(&self) -> Self {
        let [count, instance_count] = self.counts_within_buffers();
        Self { count, instance_count, ..self.clone() }
    }

    /// The numbers of vertices and of instances within the buffers.
    fn counts_within_buffers(&self) -> [u32; 2] {
        let (mut count, mut instance_count) = (self.count, self.instance_count);
        let rotation = &self.attributes.rotation;
        let Some(rotations) = rotation.len() else {
            return [count, instance_count];
        };
        let most = |first: u32, times: u32| {
            let rest = rotations.saturating_sub(first.into()).saturating_mul(times.into());
            u32::try_from(rest).unwrap_or(u32::MAX)
        };
        match rotation.instance_divisor {
            None if self.indices.is_none() => count = count.min(most(self.first, 1)),
            None | Some(0) => {}
            Some(divisor) => instance_count = instance_count.min(most(self.first_instance, divisor)),
        }
        [count, instance_count]
    }
}

/// The fragment program of a set: see [`Packet::GaussianFragmentStage`](crate::Packet::GaussianFragmentStage). Blending
/// and write masks are those of [`GaussianState`], one per attachment.
#[derive(Clone, Debug)]
pub struct GaussianFragmentStage {
    /// The program.
    pub program: Arc<GaussianFragmentProgram>,
    /// The bindings of the program.
    pub bindings: Bindings,
    /// True if the program runs once for each sample.
    pub sample_shading: bool,
    /// True if the alpha of the fragment determines its coverage.
    pub alpha_to_coverage: bool,
    /// True if alpha is replaced by 1 after coverage was determined.
    pub alpha_to_one: bool,
}
