//! Attributes: vertex fetch for Gaussians, from streams to structures of arrays.

use super::lanes::F32_LANES;
use super::spherical_harmonics::{COEFFICIENT_FLOATS, MAX_COEFFICIENTS};
use crate::format::Format;
use crate::packet::{Activations, AttributeStream, GaussianAppend, GaussianAttributes, IndexStream};
use devmem::Allocation;
use std::ops::RangeInclusive;
use std::sync::{Arc, Weak};

/// The attributes of a group's Gaussians as they are read from the streams: an array per component, an element per
/// lane.
#[derive(Clone, Debug)]
pub(super) struct Attributes {
    pub(super) position: [[f32; F32_LANES]; 3],
    pub(super) scale: [[f32; F32_LANES]; 3],
    pub(super) rotation: [[f32; F32_LANES]; 4],
    pub(super) opacity: [f32; F32_LANES],
}

impl Default for Attributes {
    fn default() -> Self {
        Self {
            position: [[0.0; F32_LANES]; 3],
            scale: [[0.0; F32_LANES]; 3],
            rotation: [[0.0; F32_LANES]; 4],
            opacity: [0.0; F32_LANES],
        }
    }
}

impl Attributes {
    /// The second largest of a lane's three scales.
    pub(super) fn second_scale(&self, lane: usize) -> f32 {
        let [a, b, c] = self.scale.each_ref().map(|scale| scale[lane]);
        a.max(b).min(a.max(c)).min(b.max(c))
    }

    /// Overwrites lane `to` with lane `from` of `others`.
    pub(super) fn copy_lane(&mut self, to: usize, others: &Self, from: usize) {
        let copy = |own: &mut [f32; F32_LANES], other: &[f32; F32_LANES]| own[to] = other[from];
        for (own, other) in self.position.iter_mut().zip(&others.position) {
            copy(own, other);
        }
        for (own, other) in self.scale.iter_mut().zip(&others.scale) {
            copy(own, other);
        }
        for (own, other) in self.rotation.iter_mut().zip(&others.rotation) {
            copy(own, other);
        }
        copy(&mut self.opacity, &others.opacity);
    }
}

/// The largest stride in bytes for which consecutive vertices are read with one copy, gaps included. With a larger
/// stride each element is read by itself.
const WHOLE_SPAN_STRIDE: u32 = 64;

/// The vertices of one group of one instance.
pub(super) struct Group<'a> {
    /// The vertices, as many as the group has lanes in use.
    vertices: Vertices<'a>,
    pub(super) instance: u32,
    pub(super) first_instance: u32,
    pub(super) len: usize,
}

enum Vertices<'a> {
    /// Consecutive vertices, from this one on.
    From(u64),
    /// Vertex numbers read from an index buffer.
    Listed(Vec<u64>),
    /// The draw's first vertex, and the numbers of a cluster's vertices relative to it.
    Cluster(u64, &'a [u32]),
}

impl<'a> Group<'a> {
    /// The `len` vertices of `append` from number `start` on, for `instance`.
    pub(super) fn new(append: &GaussianAppend, instance: u32, start: u32, len: usize) -> Self {
        let first = u64::from(append.first) + u64::from(start);
        let vertices = match &append.indices {
            None => Vertices::From(first),
            Some(stream) => Vertices::Listed(read_indices(stream, first, len)),
        };
        Self { vertices, instance, first_instance: append.first_instance, len }
    }

    /// The vertices of `append` with these numbers, relative to its first vertex, for `instance`.
    pub(super) fn of_cluster(append: &GaussianAppend, instance: u32, numbers: &'a [u32]) -> Self {
        Self {
            vertices: Vertices::Cluster(append.first.into(), numbers),
            instance,
            first_instance: append.first_instance,
            len: numbers.len(),
        }
    }

    /// The element of `stream` that lane `lane` reads.
    fn element(&self, stream: &AttributeStream, lane: usize) -> u64 {
        match stream.instance_divisor {
            Some(0) => u64::from(self.first_instance),
            Some(divisor) => {
                u64::from(self.first_instance) + u64::from((self.instance - self.first_instance) / divisor)
            }
            None => match &self.vertices {
                Vertices::From(first) => first + lane as u64,
                Vertices::Listed(list) => list[lane],
                Vertices::Cluster(first, numbers) => first + u64::from(numbers[lane]),
            },
        }
    }

    /// True if consecutive lanes read consecutive elements of `stream`.
    fn is_consecutive(&self, stream: &AttributeStream) -> bool {
        stream.instance_divisor.is_none() && matches!(self.vertices, Vertices::From(_))
    }
}

/// Reads `len` vertex numbers from the index buffer, from its element `first` on, and adds the vertex offset.
fn read_indices(stream: &IndexStream, first: u64, len: usize) -> Vec<u64> {
    let mut indices = Vec::new();
    stream.read(first, len as u32, &mut indices);
    let vertex = |index: u32| {
        let vertex = i64::from(index) + i64::from(stream.vertex_offset);
        // A negative sum names no vertex. The largest number lies outside every buffer, which reads as zero.
        u64::try_from(vertex).unwrap_or(u64::from(u32::MAX))
    };
    indices.into_iter().map(vertex).collect()
}

/// The bytes of an attribute of this format, and true if its components are 32-bit floats.
fn layout(format: Format) -> (usize, bool) {
    let floats = matches!(
        format,
        Format::R32Sfloat | Format::R32G32Sfloat | Format::R32G32B32Sfloat | Format::R32G32B32A32Sfloat
    );
    (format.texel_size(), floats)
}

/// Reads attributes. It owns the bytes that a read needs in between.
#[derive(Default)]
pub(super) struct Fetcher {
    bytes: Vec<u8>,
}

impl Fetcher {
    /// Reads lanes `0..group.len` of `stream` into `out[component][lane]`.
    pub(super) fn read<const COMPONENTS: usize>(
        &mut self,
        stream: &AttributeStream,
        group: &Group<'_>,
        mut out: [&mut [f32; F32_LANES]; COMPONENTS],
    ) {
        let (size, floats) = layout(stream.format);
        if stream.instance_divisor.is_some() && group.len > 0 {
            let element = self.read_element(stream, group.element(stream, 0), size);
            let value = stream.format.decode(element);
            for (component, out) in out.iter_mut().enumerate() {
                out[..group.len].fill(value[component]);
            }
            return;
        }
        let step = self.read_bytes(stream, group, size);
        let elements = self.bytes.chunks(step).take(group.len).enumerate();
        if floats && size >= 4 * COMPONENTS {
            for (lane, bytes) in elements {
                let words = bytes.as_chunks::<4>().0;
                for (out, &word) in out.iter_mut().zip(words) {
                    out[lane] = f32::from_le_bytes(word);
                }
            }
            return;
        }
        for (lane, bytes) in elements {
            let value = stream.format.decode(&bytes[..size]);
            for (component, out) in out.iter_mut().enumerate() {
                out[lane] = value[component];
            }
        }
    }

    /// Reads a group's positions, scales, rotations and opacities, without the model's transform, and applies the
    /// activations.
    pub(super) fn read_own(&mut self, streams: &GaussianAttributes, group: &Group<'_>, out: &mut Attributes) {
        self.read(&streams.position, group, out.position.each_mut());
        self.read(&streams.scale, group, out.scale.each_mut());
        self.read(&streams.rotation, group, out.rotation.each_mut());
        self.read(&streams.opacity, group, [&mut out.opacity]);
        if streams.activations != Activations::default() {
            activate(streams.activations, group.len, out);
        }
    }

    /// Multiplies a group's opacities by the model's opacities, if the model has any.
    pub(super) fn fade(&mut self, streams: &GaussianAttributes, group: &Group<'_>, out: &mut Attributes) {
        if let Some(stream) = &streams.model.opacity {
            let mut factor = [0.0; F32_LANES];
            self.read(stream, group, [&mut factor]);
            for (opacity, factor) in out.opacity.iter_mut().zip(factor) {
                *opacity *= factor;
            }
        }
    }

    /// Reads an element of `size` bytes.
    fn read_element(&mut self, stream: &AttributeStream, element: u64, size: usize) -> &[u8] {
        self.grow(size);
        let bytes = &mut self.bytes[..size];
        stream.read(element, bytes);
        bytes
    }

    /// Copies the group's elements into `bytes` and returns the distance in bytes from one to the next.
    fn read_bytes(&mut self, stream: &AttributeStream, group: &Group<'_>, size: usize) -> usize {
        let stride = stream.stride as usize;
        if group.is_consecutive(stream) && stream.stride <= WHOLE_SPAN_STRIDE && stride >= size && group.len > 0 {
            let span = stride * (group.len - 1) + size;
            self.grow(span);
            let first = group.element(stream, 0);
            if stream.place(first, span as u64).is_some() {
                stream.read(first, &mut self.bytes[..span]);
                return stride;
            }
        }
        self.grow(size * group.len);
        let elements = self.bytes.chunks_exact_mut(size).take(group.len);
        for (lane, element) in elements.enumerate() {
            stream.read(group.element(stream, lane), element);
        }
        size
    }

    /// Makes `bytes` at least so long.
    fn grow(&mut self, bytes: usize) {
        if self.bytes.len() < bytes {
            self.bytes.resize(bytes, 0);
        }
    }
}

/// Applies the activations to the first `len` lanes: `exp` to logarithms of scales, the logistic function to logits of
/// opacities.
#[cold]
fn activate(activations: Activations, len: usize, out: &mut Attributes) {
    let apply = |lanes: &mut [f32; F32_LANES], function: fn(f64) -> f64| {
        for value in lanes.iter_mut().take(len) {
            *value = function(f64::from(*value)) as f32;
        }
    };
    if activations.log_scale {
        let scales = out.scale.iter_mut();
        scales.for_each(|lanes| apply(lanes, f64::exp));
    }
    if activations.logit_opacity {
        apply(&mut out.opacity, |logit| 1.0 / (1.0 + (-logit).exp()));
    }
}

/// The byte offset in `stream`'s buffer of the element that lane `lane` reads.
fn at(stream: &AttributeStream, group: &Group<'_>, lane: usize) -> u64 {
    group.element(stream, lane).saturating_mul(u64::from(stream.stride)).saturating_add(u64::from(stream.offset))
}

/// Reads the spherical harmonics of single lanes.
pub(super) struct CoefficientReader<'a> {
    streams: &'a [AttributeStream],
    /// True if the coefficients of a vertex follow one another in memory as 32-bit floats.
    packed: bool,
}

impl<'a> CoefficientReader<'a> {
    /// A reader of these streams, one stream per coefficient.
    pub(super) fn new(streams: &'a [AttributeStream]) -> Self {
        let follows = |a: &AttributeStream, b: &AttributeStream| {
            Arc::ptr_eq(&a.buffer.memory, &b.buffer.memory)
                && a.buffer.offset == b.buffer.offset
                && a.buffer.size == b.buffer.size
                && a.stride == b.stride
                && a.instance_divisor == b.instance_divisor
                && b.format == Format::R32G32B32Sfloat
                && a.offset.checked_add(12) == Some(b.offset)
        };
        let packed = streams.first().is_some_and(|s| s.format == Format::R32G32B32Sfloat)
            && streams.windows(2).all(|pair| follows(&pair[0], &pair[1]));
        Self { streams, packed }
    }

    /// The number of floats in a vertex's coefficients: three for each coefficient.
    pub(super) fn floats(&self) -> usize {
        3 * self.streams.len().min(MAX_COEFFICIENTS)
    }

    /// Starts to load the first `count` coefficients of `lane` into the processor's cache, if they are packed.
    #[inline(always)]
    pub(super) fn prefetch(&self, group: &Group<'_>, lane: usize, count: usize) {
        if let Some(stream) = self.streams.first().filter(|_| self.packed) {
            let start = stream.buffer.offset.saturating_add(at(stream, group, lane));
            let count = count.min(self.streams.len());
            stream.buffer.memory.prefetch(start, 12 * count);
        }
    }

    /// Reads the coefficients of `lane`: red, green and blue of each in turn.
    pub(super) fn read(&self, group: &Group<'_>, lane: usize, out: &mut [f32; COEFFICIENT_FLOATS]) {
        let at = |stream| at(stream, group, lane);
        let count = self.streams.len().min(MAX_COEFFICIENTS);
        let out = &mut out[..3 * count];
        if self.packed {
            let stream = &self.streams[0];
            let start = at(stream);
            let size = size_of_val(out) as u64;
            let inside = start.checked_add(size).is_some_and(|end| end <= stream.buffer.size);
            if inside && stream.buffer.memory.read(stream.buffer.offset.saturating_add(start), out).is_ok() {
                return;
            }
        }
        for (stream, out) in self.streams.iter().zip(out.chunks_exact_mut(3)) {
            let mut bytes = [0u8; 16];
            let bytes = &mut bytes[..layout(stream.format).0.min(16)];
            stream.read(group.element(stream, lane), bytes);
            out.copy_from_slice(&stream.format.decode(bytes)[..3]);
        }
    }
}

/// Spherical harmonics in host memory: those of all lanes, one lane after the other, or none.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Harmonics<'a> {
    floats: &'a [f32],
    /// The number of floats per lane. A draw of a lower degree uses the first of them.
    stride: usize,
}

impl<'a> Harmonics<'a> {
    /// The harmonics of lanes of `stride` floats each.
    pub(super) fn new(floats: &'a [f32], stride: usize) -> Self {
        Self { floats, stride }
    }

    /// The floats from the given lane's first on, or an empty slice if there are none.
    #[inline(always)]
    pub(super) fn from(&self, lane: usize) -> &'a [f32] {
        self.floats.get(lane * self.stride..).unwrap_or_default()
    }

    /// The given lane's first `count` floats and those after it, if there are so many.
    #[inline(always)]
    pub(super) fn first(&self, lane: usize, count: usize) -> Option<&'a [f32]> {
        let start = lane * self.stride;
        self.floats.get(start..start + count)
    }

    /// The floats of a range of lanes, if they are held and a lane has at most `most`.
    #[inline(always)]
    pub(super) fn of_all(&self, lanes: RangeInclusive<usize>, most: usize) -> Option<&'a [f32]> {
        let (first, end) = (*lanes.start(), *lanes.end() + 1);
        let are_there = (1..=most).contains(&self.stride);
        self.floats.get(first * self.stride..end * self.stride).filter(|_| are_there)
    }
}

/// Identifies the bytes that an attribute is read from: the memory, its generation, the place in it, and the format.
#[derive(Debug)]
pub(super) struct SourceFingerprint {
    memory: Weak<Allocation>,
    generation: u64,
    /// Offset and size of the buffer in the memory, then stride and offset of the attribute.
    place: [u64; 4],
    format: Format,
    instance_divisor: Option<u32>,
}

impl SourceFingerprint {
    pub(super) fn new(stream: &AttributeStream) -> Self {
        let buffer = &stream.buffer;
        Self {
            memory: Arc::downgrade(&buffer.memory),
            generation: buffer.memory.generation(),
            place: [buffer.offset, buffer.size, stream.stride.into(), stream.offset.into()],
            format: stream.format,
            instance_divisor: stream.instance_divisor,
        }
    }

    /// The memory, if it is still allocated.
    pub(super) fn memory(&self) -> Option<Arc<Allocation>> {
        self.memory.upgrade()
    }

    /// True if the memory is still allocated and nothing was written to it since.
    pub(super) fn is_current(&self) -> bool {
        let memory = self.memory.upgrade();
        memory.is_some_and(|memory| memory.generation() == self.generation)
    }

    pub(super) fn is_same(&self, other: &Self) -> bool {
        let how = |own: &Self| (own.generation, own.format, own.instance_divisor);
        self.is_same_buffer(other) && how(self) == how(other)
    }

    /// True if both name the same place in the same memory, of whatever generation and format.
    pub(super) fn is_same_buffer(&self, other: &Self) -> bool {
        self.memory.ptr_eq(&other.memory) && self.place == other.place
    }
}

/// True if an attribute is in memory that only the device writes.
pub(super) fn is_device_local(stream: &AttributeStream) -> bool {
    !stream.buffer.memory.is_host_visible()
}
