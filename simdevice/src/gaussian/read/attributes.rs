//! Attributes: vertex fetch for Gaussians, from streams to structures of arrays.

use super::decoding::{Codebooks, Decoder, Encoded, Finish, quaternion};
use crate::format::Format;
use crate::gaussian::lanes::F32_LANES;
use crate::packet::{
    Activations, AttributeStream, Decoding, GaussianAppend, GaussianAttributes, IndexStream, RotationDecoding,
};

/// The attributes of a group's Gaussians as they are read from the streams: an array per component, an element per
/// lane.
#[derive(Clone, Debug)]
pub(crate) struct Attributes {
    pub(crate) position: [[f32; F32_LANES]; 3],
    pub(crate) scale: [[f32; F32_LANES]; 3],
    pub(crate) rotation: [[f32; F32_LANES]; 4],
    pub(crate) opacity: [f32; F32_LANES],
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
    pub(crate) fn second_scale(&self, lane: usize) -> f32 {
        let [a, b, c] = self.scale.each_ref().map(|scale| scale[lane]);
        a.max(b).min(a.max(c)).min(b.max(c))
    }

    /// Overwrites lane `to` with lane `from` of `others`.
    pub(crate) fn copy_lane(&mut self, to: usize, others: &Self, from: usize) {
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

/// The vertices and the instances of a group's Gaussians.
pub(crate) struct GroupVertices<'a> {
    /// The vertices, as many as the group has lanes in use.
    vertices: VertexNumbers<'a>,
    instances: InstanceNumbers,
    first_instance: u32,
    pub(crate) len: usize,
}

/// The instances of a group's lanes.
enum InstanceNumbers {
    /// All lanes are of this instance.
    One(u32),
    /// Instance after instance.
    Several(InstanceRun),
}

/// A run of Gaussians that goes on from an instance to the next.
#[derive(Clone, Copy)]
struct InstanceRun {
    /// The instance of lane 0.
    instance: u32,
    /// The place of lane 0 in its instance.
    place: u32,
    /// The Gaussians of an instance.
    count: u32,
}

impl InstanceRun {
    fn instance(self, lane: usize) -> u32 {
        self.instance.saturating_add((self.place + lane as u32) / self.count)
    }

    fn place(self, lane: usize) -> u32 {
        (self.place + lane as u32) % self.count
    }
}

enum VertexNumbers<'a> {
    /// Consecutive vertices, from this one on.
    From(u64),
    /// The draw's first vertex, and the places of lanes in their instances.
    Run(u64, InstanceRun),
    /// Vertex numbers read from an index buffer.
    Listed(Vec<u64>),
    /// The draw's first vertex, and the numbers of a cluster's vertices relative to it.
    Cluster(u64, &'a [u32]),
}

impl<'a> GroupVertices<'a> {
    /// The `len` vertices of `append` from number `start` of `instance` on. They go on in the next instances if `instance` has
    /// fewer.
    pub(crate) fn new(append: &GaussianAppend, instance: u32, start: u32, len: usize) -> Self {
        let first = u64::from(append.first);
        let first_instance = append.first_instance;
        if u64::from(start) + len as u64 <= u64::from(append.count) {
            let first = first + u64::from(start);
            let vertices = match &append.indices {
                None => VertexNumbers::From(first),
                Some(stream) => VertexNumbers::Listed(read_indices(stream, first, len)),
            };
            return Self { vertices, instances: InstanceNumbers::One(instance), first_instance, len };
        }
        let run = InstanceRun { instance, place: start, count: append.count };
        let vertices = match &append.indices {
            None => VertexNumbers::Run(first, run),
            Some(stream) => {
                let of_instance = read_indices(stream, first, append.count as usize);
                VertexNumbers::Listed((0..len).map(|lane| of_instance[run.place(lane) as usize]).collect())
            }
        };
        Self { vertices, instances: InstanceNumbers::Several(run), first_instance, len }
    }

    /// The vertices of `append` with these numbers, relative to its first vertex, for `instance`.
    pub(crate) fn of_cluster(append: &GaussianAppend, instance: u32, numbers: &'a [u32]) -> Self {
        Self {
            vertices: VertexNumbers::Cluster(append.first.into(), numbers),
            instances: InstanceNumbers::One(instance),
            first_instance: append.first_instance,
            len: numbers.len(),
        }
    }

    /// The element of `stream` that lane `lane` reads.
    pub(super) fn element(&self, stream: &AttributeStream, lane: usize) -> u64 {
        match stream.instance_divisor {
            Some(0) => u64::from(self.first_instance),
            Some(divisor) => {
                let instance = match self.instances {
                    InstanceNumbers::One(instance) => instance,
                    InstanceNumbers::Several(run) => run.instance(lane),
                };
                u64::from(self.first_instance) + u64::from((instance - self.first_instance) / divisor)
            }
            None => self.vertex(lane),
        }
    }

    /// The vertex of lane `lane`.
    pub(super) fn vertex(&self, lane: usize) -> u64 {
        match &self.vertices {
            VertexNumbers::From(first) => first + lane as u64,
            VertexNumbers::Run(first, run) => first + u64::from(run.place(lane)),
            VertexNumbers::Listed(list) => list[lane],
            VertexNumbers::Cluster(first, numbers) => first + u64::from(numbers[lane]),
        }
    }

    /// The first three components of the element of `stream` that lane `lane` reads.
    pub(super) fn triple(&self, stream: &AttributeStream, lane: usize) -> [f32; 3] {
        let mut bytes = [0u8; 16];
        let bytes = &mut bytes[..stream.format.texel_size().min(16)];
        stream.read(self.element(stream, lane), bytes);
        let [first, second, third, _] = stream.format.decode(bytes);
        [first, second, third]
    }

    /// True if all lanes read one element of `stream`.
    pub(super) fn is_uniform(&self, stream: &AttributeStream) -> bool {
        match (stream.instance_divisor, &self.instances) {
            (None, _) => false,
            (Some(divisor), instances) => divisor == 0 || matches!(instances, InstanceNumbers::One(_)),
        }
    }

    /// True if consecutive lanes read consecutive elements of `stream`.
    fn is_consecutive(&self, stream: &AttributeStream) -> bool {
        match (stream.instance_divisor, &self.instances) {
            (None, _) => matches!(self.vertices, VertexNumbers::From(_)),
            (Some(divisor), InstanceNumbers::Several(run)) => divisor == 1 && run.count == 1,
            (Some(_), InstanceNumbers::One(_)) => false,
        }
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

/// True if the components of an attribute of this format are 32-bit floats.
fn is_of_floats(format: Format) -> bool {
    matches!(format, Format::R32Sfloat | Format::R32G32Sfloat | Format::R32G32B32Sfloat | Format::R32G32B32A32Sfloat)
}

/// Reads attributes. It owns the bytes that a read needs in between, and the codebooks that it has read. It lives no longer
/// than the reading of a set.
#[derive(Default)]
pub(crate) struct Fetcher {
    bytes: Vec<u8>,
    pub(super) codebooks: Codebooks,
}

impl Fetcher {
    /// Reads lanes `0..group.len` of `stream` into `out[component][lane]`.
    pub(crate) fn read<const COMPONENTS: usize>(
        &mut self,
        stream: &AttributeStream,
        group: &GroupVertices<'_>,
        mut out: [&mut [f32; F32_LANES]; COMPONENTS],
    ) {
        let (size, floats) = (stream.format.texel_size(), is_of_floats(stream.format));
        if group.is_uniform(stream) && group.len > 0 {
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

    /// Reads a group's positions, scales, rotations and opacities, without the model's transform. Decodes them and applies
    /// the activations.
    pub(crate) fn read_own(&mut self, streams: &GaussianAttributes, group: &GroupVertices<'_>, out: &mut Attributes) {
        if streams.activations != Activations::default() {
            return self.read_activated(streams, group, out);
        }
        self.read(&streams.position, group, out.position.each_mut());
        self.read(&streams.scale, group, out.scale.each_mut());
        self.read(&streams.rotation, group, out.rotation.each_mut());
        self.read(&streams.opacity, group, [&mut out.opacity]);
    }

    /// Reads a group's positions, and decodes them.
    pub(super) fn read_positions(
        &mut self,
        streams: &GaussianAttributes,
        group: &GroupVertices<'_>,
        out: &mut [[f32; F32_LANES]; 3],
    ) {
        let decodings = &streams.activations.decodings;
        let is_signed_log = decodings.signed_log_position && decodings.position != Decoding::None;
        let positions = Encoded {
            stream: &streams.position,
            decoding: decodings.position,
            table: streams.tables.as_ref().and_then(|tables| tables.position.as_ref()),
            finish: if is_signed_log { Finish::SignedExponential } else { Finish::None },
        };
        let decoder = Decoder::of_lengths(&positions, &mut self.codebooks);
        self.read_encoded(&positions, decoder, group, out.each_mut());
    }

    /// The same as [`Self::read_own`] where decodings or activations are applied: `exp` to logarithms of scales, the logistic
    /// function to logits of opacities.
    #[inline(never)]
    fn read_activated(&mut self, streams: &GaussianAttributes, group: &GroupVertices<'_>, out: &mut Attributes) {
        let Activations { log_scale, logit_opacity, decodings } = &streams.activations;
        let tables = streams.tables.as_deref();
        self.read_positions(streams, group, &mut out.position);
        let scales = Encoded {
            stream: &streams.scale,
            decoding: decodings.scale,
            table: tables.and_then(|tables| tables.scale.as_ref()),
            finish: if *log_scale { Finish::Exponential } else { Finish::None },
        };
        let decoder = Decoder::of_lengths(&scales, &mut self.codebooks);
        self.read_encoded(&scales, decoder, group, out.scale.each_mut());
        match decodings.rotation {
            RotationDecoding::None => self.read(&streams.rotation, group, out.rotation.each_mut()),
            decoding => self.decode_rotations(decoding, &streams.rotation, group, &mut out.rotation),
        }
        let opacities = Encoded {
            stream: &streams.opacity,
            decoding: decodings.opacity,
            table: tables.and_then(|tables| tables.opacity.as_ref()),
            finish: if *logit_opacity { Finish::Logistic } else { Finish::None },
        };
        let decoder = Decoder::of_opacities(&opacities, &mut self.codebooks);
        self.read_encoded(&opacities, decoder, group, [&mut out.opacity]);
    }

    /// Reads lanes `0..group.len` of an attribute into `out[component][lane]`: what the decoder makes of the elements, or, without
    /// a decoder, the finished elements.
    fn read_encoded<const COMPONENTS: usize>(
        &mut self,
        encoded: &Encoded<'_, '_>,
        decoder: Option<Decoder<'_, COMPONENTS>>,
        group: &GroupVertices<'_>,
        mut out: [&mut [f32; F32_LANES]; COMPONENTS],
    ) {
        if let Some(decoder) = decoder {
            return self.decode(&decoder, encoded.stream, group, out);
        }
        self.read(encoded.stream, group, out.each_mut().map(|lanes| &mut **lanes));
        if encoded.finish != Finish::None {
            for lanes in out {
                let lanes = &mut lanes[..group.len];
                let numbers: [f64; F32_LANES] =
                    std::array::from_fn(|lane| lanes.get(lane).copied().map_or(0.0, f64::from));
                encoded.finish.values(&numbers[..lanes.len()], lanes);
            }
        }
    }

    /// Reads lanes `0..group.len` of `stream` into `out[component][lane]`: what the decoder makes of the elements.
    fn decode<const COMPONENTS: usize>(
        &mut self,
        decoder: &Decoder<'_, COMPONENTS>,
        stream: &AttributeStream,
        group: &GroupVertices<'_>,
        mut out: [&mut [f32; F32_LANES]; COMPONENTS],
    ) {
        let mut elements = [0; F32_LANES];
        self.each_element(stream, group, |lane, element| elements[lane] = element);
        decoder.decode_all(|lane| group.vertex(lane), &elements[..group.len], &mut out);
    }

    /// Reads lanes `0..group.len` of quaternions. Those that lie beyond their buffer are zeros.
    fn decode_rotations(
        &mut self,
        decoding: RotationDecoding,
        stream: &AttributeStream,
        group: &GroupVertices<'_>,
        out: &mut [[f32; F32_LANES]; 4],
    ) {
        let size = stream.format.texel_size() as u64;
        self.each_element(stream, group, |lane, element| {
            let is_beyond = element == 0 && stream.place(group.element(stream, lane), size).is_none();
            let quaternion = if is_beyond { [0.0; 4] } else { quaternion(decoding, element) };
            for (out, component) in out.iter_mut().zip(quaternion) {
                out[lane] = component as f32;
            }
        });
    }

    /// Calls `take` with each lane in use and its element of `stream`, which has at most 8 bytes.
    fn each_element(&mut self, stream: &AttributeStream, group: &GroupVertices<'_>, mut take: impl FnMut(usize, u64)) {
        let size = stream.format.texel_size().min(8);
        let step = self.read_bytes(stream, group, size);
        for (lane, bytes) in self.bytes.chunks(step).take(group.len).enumerate() {
            let mut element = [0; 8];
            element[..size].copy_from_slice(&bytes[..size]);
            take(lane, u64::from_le_bytes(element));
        }
    }

    /// Multiplies a group's opacities by the model's opacities, if the model has any.
    pub(crate) fn fade(&mut self, streams: &GaussianAttributes, group: &GroupVertices<'_>, out: &mut Attributes) {
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
    fn read_bytes(&mut self, stream: &AttributeStream, group: &GroupVertices<'_>, size: usize) -> usize {
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
