//! Vertex fetch: reads attributes of a batch of vertices from device memory into the inputs of a shader core.

use crate::format::{Format, Numeric};
use crate::packet::{AttributeStream, Draw};
use crate::program::interface::VertexInput;
use crate::program::vertex::VERTEX_BATCH;
use isa::Vector;
use isa::machine::Machine;

/// The most bytes per vertex for which the span of all of a batch's elements is read with one copy.
const SPAN_BYTES: u64 = 256;

/// An attribute that the program reads.
struct Attribute<'a> {
    stream: &'a AttributeStream,
    /// The inputs that its components are copied to: slot and component.
    inputs: Vec<(u32, usize)>,
}

/// Reads the inputs of a draw's vertex program.
pub(super) struct Fetcher<'a> {
    draw: &'a Draw,
    /// The number of the view that is drawn.
    view: u32,
    attributes: Vec<Attribute<'a>>,
    /// The built-in inputs, such as the vertex index.
    numbers: Vec<(u32, VertexInput)>,
    bytes: Vec<u8>,
    packed: Vec<u8>,
}

impl<'a> Fetcher<'a> {
    /// Finds the inputs of the draw's program, and zeroes those without an attribute. `view` is the view's number.
    pub(super) fn new(draw: &'a Draw, view: u32, machine: &mut Machine) -> Self {
        let mut attributes: Vec<Attribute<'a>> = Vec::new();
        let mut numbers = Vec::new();
        for &(slot, _, input) in &draw.pipeline.vertex.inputs {
            match input {
                VertexInput::Attribute { stream, component } => {
                    let Some(stream) = draw.attributes.get(stream).filter(|_| component < 4) else {
                        machine.fill_input(slot, 0);
                        continue;
                    };
                    let known = attributes.iter_mut().find(|attribute| std::ptr::eq(attribute.stream, stream));
                    match known {
                        Some(attribute) => attribute.inputs.push((slot, component)),
                        None => attributes.push(Attribute { stream, inputs: vec![(slot, component)] }),
                    }
                }
                VertexInput::VertexIndex
                | VertexInput::InstanceIndex
                | VertexInput::BaseVertex
                | VertexInput::BaseInstance
                | VertexInput::DrawIndex
                | VertexInput::ViewIndex => numbers.push((slot, input)),
            }
        }
        Self { draw, view, attributes, numbers, bytes: Vec::new(), packed: Vec::new() }
    }

    /// Sets the inputs of a batch of vertices, given their numbers and their instances, counted from the draw's first.
    pub(super) fn fetch(&mut self, machine: &mut Machine, vertices: &[i64], instances: &[u32]) {
        let one_instance = instances.windows(2).all(|pair| pair[0] == pair[1]);
        self.set_numbers(machine, vertices, instances);
        let mut elements = [0; VERTEX_BATCH];
        for attribute in &self.attributes {
            let stream = attribute.stream;
            let first = i64::from(self.draw.first_instance);
            let count = match stream.instance_divisor {
                None => {
                    elements[..vertices.len()].copy_from_slice(vertices);
                    vertices.len()
                }
                Some(divisor) => {
                    let count = if one_instance || divisor == 0 { 1 } else { instances.len() };
                    for (element, &instance) in elements.iter_mut().zip(&instances[..count]) {
                        *element = first + i64::from(instance.checked_div(divisor).unwrap_or(0));
                    }
                    count
                }
            };
            let source = Source::read(stream, &elements[..count], &mut self.bytes);
            let broadcast = count < vertices.len();
            let out = Out { machine, inputs: &attribute.inputs, broadcast };
            if is_words(stream.format) {
                out.words(stream.format, &source, count);
            } else {
                source.pack(stream.format.texel_size(), count, &mut self.packed);
                out.decoded(stream.format, &self.packed, count);
            }
        }
    }

    fn set_numbers(&self, machine: &mut Machine, vertices: &[i64], instances: &[u32]) {
        let draw = self.draw;
        let offset = match &draw.indices {
            Some(stream) => stream.vertex_offset.cast_unsigned(),
            None => draw.first,
        };
        for &(slot, input) in &self.numbers {
            match input {
                VertexInput::VertexIndex => {
                    set_lanes(machine.input_mut(slot), vertices, |&number| number as u32);
                }
                VertexInput::InstanceIndex => {
                    set_lanes(machine.input_mut(slot), instances, |&i| draw.first_instance.wrapping_add(i));
                }
                VertexInput::BaseVertex => machine.fill_input(slot, offset),
                VertexInput::BaseInstance => machine.fill_input(slot, draw.first_instance),
                VertexInput::DrawIndex => machine.fill_input(slot, draw.draw_index),
                VertexInput::ViewIndex => machine.fill_input(slot, self.view),
                VertexInput::Attribute { .. } => {}
            }
        }
    }
}

/// Sets the lanes of an input from values. A uniform input takes the first value.
fn set_lanes<T>(chunks: &mut [Vector], values: &[T], bits: impl Fn(&T) -> u32) {
    if let ([chunk], Some(first)) = (&mut *chunks, values.first()) {
        *chunk = Vector([bits(first); 16]);
        return;
    }
    for (chunk, values) in chunks.iter_mut().zip(values.chunks(16)) {
        for (lane, value) in chunk.0.iter_mut().zip(values) {
            *lane = bits(value);
        }
    }
}

/// True if components are whole 32-bit words that need no conversion.
fn is_words(format: Format) -> bool {
    let words = matches!(format.numeric(), Numeric::Sfloat | Numeric::Uint | Numeric::Sint);
    words && format.components().iter().all(|component| component.bits == 32)
}

/// Elements that were read into host memory.
struct Source<'a> {
    bytes: &'a [u8],
    /// The byte offset of each element.
    starts: [u32; VERTEX_BATCH],
}

impl<'a> Source<'a> {
    /// Reads elements. Elements that lie outside the buffer are zero.
    fn read(stream: &AttributeStream, elements: &[i64], scratch: &'a mut Vec<u8>) -> Self {
        let size = stream.format.texel_size();
        let mut starts = [0; VERTEX_BATCH];
        let least = elements.iter().copied().min().unwrap_or(0);
        let greatest = elements.iter().copied().max().unwrap_or(0);
        let stride = u64::from(stream.stride);
        let span = (greatest.abs_diff(least)).saturating_mul(stride).saturating_add(size as u64);
        if span <= SPAN_BYTES * elements.len() as u64
            && greatest.abs_diff(least) <= 4 * elements.len() as u64
            && let Some(offset) = place(stream, least, span)
        {
            scratch.resize(span as usize, 0);
            if stream.buffer.memory.read(offset, scratch).is_ok() {
                for (start, &element) in starts.iter_mut().zip(elements) {
                    *start = (element.abs_diff(least) * stride) as u32;
                }
                return Self { bytes: scratch, starts };
            }
        }
        scratch.clear();
        scratch.resize(size * elements.len(), 0);
        for (lane, bytes) in scratch.chunks_exact_mut(size).enumerate() {
            starts[lane] = (lane * size) as u32;
            if let Ok(element) = u64::try_from(elements[lane]) {
                stream.read(element, bytes);
            }
        }
        Self { bytes: scratch, starts }
    }

    /// Splits elements of `N` words each into components.
    fn words<const N: usize>(&self, starts: &[u32], words: &mut [[u32; VERTEX_BATCH]; 4]) {
        for (lane, &start) in starts.iter().enumerate() {
            let bytes = &self.bytes[start as usize..][..4 * N];
            for (component, word) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
                component[lane] = u32::from_le_bytes(*word);
            }
        }
    }

    /// Copies the elements so that they follow one another.
    fn pack(&self, size: usize, count: usize, packed: &mut Vec<u8>) {
        packed.clear();
        for &start in &self.starts[..count] {
            packed.extend_from_slice(&self.bytes[start as usize..][..size]);
        }
    }
}

/// The result of [`AttributeStream::place`]; `None` for a negative element, too.
fn place(stream: &AttributeStream, element: i64, bytes: u64) -> Option<u64> {
    stream.place(u64::try_from(element).ok()?, bytes)
}

/// The inputs that an attribute's components are copied to.
struct Out<'a> {
    machine: &'a mut Machine,
    inputs: &'a [(u32, usize)],
    /// True if all lanes take the same element.
    broadcast: bool,
}

impl Out<'_> {
    /// Sets inputs from components that are words.
    fn words(self, format: Format, source: &Source, count: usize) {
        let one = if format.is_integer() { 1 } else { 1f32.to_bits() };
        let components = format.components();
        let mut words = [[0; VERTEX_BATCH]; 4];
        let starts = &source.starts[..count];
        match components.len() {
            1 => source.words::<1>(starts, &mut words),
            2 => source.words::<2>(starts, &mut words),
            3 => source.words::<3>(starts, &mut words),
            _ => source.words::<4>(starts, &mut words),
        }
        for &(slot, component) in self.inputs {
            let chunks = self.machine.input_mut(slot);
            // The order in memory may differ from the order of components.
            let wanted = [
                crate::format::Channel::R,
                crate::format::Channel::G,
                crate::format::Channel::B,
                crate::format::Channel::A,
            ][component];
            let Some(place) = components.iter().position(|c| c.channel == wanted) else {
                chunks.fill(Vector([if component == 3 { one } else { 0 }; 16]));
                continue;
            };
            if self.broadcast || chunks.len() == 1 {
                chunks.fill(Vector([words[place][0]; 16]));
                continue;
            }
            let used = count.div_ceil(16);
            for (chunk, words) in chunks.iter_mut().zip(&words[place].as_chunks().0[..used]) {
                chunk.0 = *words;
            }
        }
    }

    /// Sets inputs from packed elements that must be decoded.
    fn decoded(self, format: Format, packed: &[u8], count: usize) {
        let mut texels = [[0.0; 4]; VERTEX_BATCH];
        let texels = &mut texels[..count];
        format.decode_row(packed, texels);
        for &(slot, component) in self.inputs {
            let chunks = self.machine.input_mut(slot);
            if self.broadcast {
                chunks.fill(Vector([texels[0][component].to_bits(); 16]));
            } else {
                set_lanes(chunks, texels, |texel| texel[component].to_bits());
            }
        }
    }
}
