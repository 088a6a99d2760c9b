//! The draws and programs that the tests share.

use super::super::{Bins, FrontEnd, Primitive, PrimitiveDraw, Surface, Varyings};
use crate::device::Device;
use crate::format::Format;
use crate::program::bindings::Bindings;
use crate::program::vertex::DrawPipeline;
use crate::runtime::Config;

use crate::packet::*;
use crate::packet::{AttributeStream, IndexStream};
use devmem::BufferRange;

use crate::program::interface::{
    DrawPrograms, FragmentInput, FragmentPrograms, Interpolation, Sampling, VertexInput, VertexOutput,
};

use crate::state::{DrawState, Rect, Topology};
use crate::stats::counters::Counters;
use devmem::Allocation;
use isa::builder::Builder;
use isa::ir::{Program, Rate, Type};
use std::sync::Arc;

/// The framebuffer's width. Neither it nor the height is a multiple of a macro-tile's side.
pub const WIDTH: u32 = 200;
/// The framebuffer's height.
pub const HEIGHT: u32 = 150;

/// All pixels.
pub const EVERYTHING: Rect = Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT };

/// The varying that holds the vertex's index.
pub const INDEX: usize = 0;
/// The varying that holds the instance's index.
pub const INSTANCE: usize = 1;
/// The varying that holds the second attribute's first component, perspective-correct.
pub const VALUE: usize = 2;
/// The varying that holds the same component, linear in the framebuffer.
pub const LINEAR: usize = 3;

/// A device with `threads` workers.
pub fn device(threads: usize) -> Device {
    let config = Config { threads, ..Config::default() };
    Device::new(&config).unwrap()
}

/// A program that copies inputs to outputs, each by slot.
pub fn copies(inputs: u32, copies: &[(u32, u32)]) -> Program {
    let mut b = Builder::new();
    let inputs: Vec<_> = (0..inputs).map(|slot| b.input(slot, Type::B32, Rate::Varying)).collect();
    for &(from, to) in copies {
        let out = b.output(to, Type::B32);
        b.assign(out, inputs[from as usize]);
    }
    b.finish().unwrap()
}

/// The four components of an attribute, as inputs.
pub fn attribute(stream: usize) -> impl Iterator<Item = Option<VertexInput>> {
    (0..4).map(move |component| Some(VertexInput::Attribute { stream, component }))
}

/// A fragment stage that reads varyings with these interpolations.
pub fn fragment(interpolation: &[Interpolation]) -> FragmentPrograms {
    let inputs = (0..).zip(interpolation).map(|(index, &interpolation)| {
        Some(FragmentInput::Varying { index, interpolation, sampling: Sampling::Center })
    });
    FragmentPrograms {
        program: Program::default(),
        inputs: inputs.collect(),
        outputs: Vec::new(),
        early_tests: false,
        post_depth_coverage: false,
        discards: false,
        per_sample: false,
        has_side_effects: false,
    }
}

/// The programs of a draw: positions come from attribute 0, and varyings are those of the constants above. The outputs
/// `extra` take the components of attribute 2.
pub fn programs(extra: &[VertexOutput]) -> DrawPrograms {
    use Interpolation::*;
    let mut pairs = vec![(0, 0), (1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (6, 6), (6, 7)];
    pairs.extend((0..extra.len() as u32).map(|index| (10 + index % 4, 8 + index)));
    let mut inputs: Vec<_> = attribute(0).collect();
    inputs.extend([Some(VertexInput::VertexIndex), Some(VertexInput::InstanceIndex)]);
    inputs.extend(attribute(1));
    inputs.extend(attribute(2));
    let mut outputs: Vec<_> = (0..4).map(|c| Some(VertexOutput::Position(c))).collect();
    outputs.extend((0..4).map(|number| Some(VertexOutput::Varying(number))));
    outputs.extend(extra.iter().map(|&output| Some(output)));
    DrawPrograms {
        vertex: copies(14, &pairs),
        vertex_inputs: inputs,
        vertex_outputs: outputs,
        varyings: 4,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: Some(fragment(&[Flat, Flat, Perspective, Linear])),
    }
}

/// A state without any culling.
pub fn state(topology: Topology) -> DrawState {
    DrawState::new(topology, [WIDTH, HEIGHT])
}

/// A buffer of these elements.
pub fn buffer<T: bytemuck::NoUninit>(elements: &[T]) -> BufferRange {
    let size = size_of_val(elements) as u64;
    let memory = Allocation::new_zeroed(size.max(4)).unwrap();
    memory.write(0, elements).unwrap();
    BufferRange { memory, offset: 0, size }
}

/// A stream of tightly packed elements.
pub fn stream<T: bytemuck::NoUninit>(elements: &[T], format: Format) -> AttributeStream {
    AttributeStream {
        buffer: buffer(elements),
        stride: size_of::<T>() as u32,
        offset: 0,
        format,
        instance_divisor: None,
    }
}

/// An index buffer of 32-bit indices.
pub fn indices(elements: &[u32]) -> IndexStream {
    IndexStream { buffer: buffer(elements), index_size: 4, vertex_offset: 0, restart: None }
}

/// A draw of these positions with the programs of [`programs`].
pub fn draw(device: &Device, topology: Topology, positions: &[[f32; 4]]) -> Draw {
    draw_with(device, programs(&[]), state(topology), positions)
}

/// A draw of these positions with other programs and state.
pub fn draw_with(device: &Device, programs: DrawPrograms, state: DrawState, positions: &[[f32; 4]]) -> Draw {
    let values: Vec<f32> = (0..positions.len()).map(|vertex| vertex as f32).collect();
    Draw {
        pipeline: Arc::new(DrawPipeline::new(device.level(), &programs).unwrap()),
        state: Arc::new(state),
        attributes: vec![stream(positions, Format::R32G32B32A32Sfloat), stream(&values, Format::R32Sfloat)],
        vertex_bindings: Bindings::default(),
        primitive_bindings: PrimitiveBindings::default(),
        fragment_bindings: Bindings::default(),
        indices: None,
        first: 0,
        count: positions.len() as u32,
        first_instance: 0,
        instance_count: 1,
        draw_index: 0,
        transform_feedback: None,
    }
}

/// The result of a draw, with its segments joined.
#[derive(Debug, Default)]
pub struct Found {
    pub primitives: Vec<Primitive>,
    pub varyings: Varyings,
    pub bins: Vec<(u32, Bins)>,
    pub regions: Vec<Rect>,
}

impl Found {
    /// Joins the segments of a part.
    pub fn new(part: PrimitiveDraw) -> Self {
        let mut found = Self { regions: part.regions, ..Self::default() };
        for segment in part.segments {
            let per_vertex = segment.varyings.per_vertex;
            let vertices = (found.varyings.values.len() / per_vertex.max(1)) as u32;
            found.bins.push((found.primitives.len() as u32, segment.bins));
            found.primitives.extend(segment.primitives.iter().map(|primitive| Primitive {
                vertices: primitive.vertices.map(|vertex| vertex + vertices),
                provoking: primitive.provoking + vertices,
                ..*primitive
            }));
            found.varyings.values.extend(segment.varyings.values);
            found.varyings.per_vertex = per_vertex;
        }
        found
    }

    /// The primitives in a macro-tile's list.
    pub fn binned(&self, macro_tile: [u32; 2], layer: u32) -> Vec<u32> {
        let lists = self.bins.iter().flat_map(|(before, bins)| {
            let list = bins.primitives_of(macro_tile, layer).iter();
            list.map(move |number| before + number)
        });
        lists.collect()
    }

    /// The number of pairs of a macro-tile and a primitive.
    pub fn pairs(&self) -> u64 {
        self.bins.iter().map(|(_, bins)| bins.pairs()).sum()
    }
}

/// The result of a draw, part by part.
pub fn parts(device: &Device, draw: &Draw) -> (Vec<Found>, Counters) {
    let surface = Surface { area: EVERYTHING, layers: 4, view: None, depth: Some(Format::D32Sfloat) };
    let mut counters = Counters::default();
    let mut front = FrontEnd::new(draw, surface, device.runtime(), &mut counters);
    let mut parts = Vec::new();
    while let Some(part) = front.next_segments(&mut counters).unwrap() {
        parts.push(Found::new(part));
    }
    (parts, counters)
}

/// The result of a draw of at most one part.
pub fn run(device: &Device, draw: &Draw) -> Found {
    let (mut parts, _) = parts(device, draw);
    assert!(parts.len() <= 1);
    parts.pop().unwrap_or_default()
}

/// A varying of a vertex of the output, as a float.
pub fn varying(draw: &Found, vertex: u32, number: usize) -> f32 {
    f32::from_bits(varying_bits(draw, vertex, number))
}

/// A varying of a vertex of the output.
pub fn varying_bits(draw: &Found, vertex: u32, number: usize) -> u32 {
    draw.varyings.values[vertex as usize * draw.varyings.per_vertex + number]
}

/// Twice the signed area of a triangle.
pub fn area(corners: [[i32; 2]; 3]) -> i64 {
    let [a, b, c] = corners.map(|corner| corner.map(i64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The clip-space position, with w = 1, of a point given in pixels.
pub fn at_pixel(x: f32, y: f32, z: f32) -> [f32; 4] {
    [x / WIDTH as f32 * 2.0 - 1.0, y / HEIGHT as f32 * 2.0 - 1.0, z, 1.0]
}
