//! Tests of whole passes against a naive reference that processes each sample by itself, and each primitive in order.

mod special;
mod twin;

use super::*;
use crate::device::Device;
use crate::format::{Aspect, ClearValue, Format};
use crate::geometry::{Bins, PrimitiveKind, Varyings};
use crate::geometry::{PrimitiveDraw, PrimitiveSegment};
use crate::image::{Image, ImageDesc, ImageKind, ImageView};
use crate::level_of;
use crate::packet::{Attachment, LoadOp, Rendering, StoreOp};
use crate::program::bindings::Bindings;
use crate::program::vertex::DrawPipeline;
use crate::runtime::{Config, FlushPolicy};

use crate::pass::{Pass, PassDraw};

use crate::program::interface::{
    DrawPrograms, FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling,
};
use crate::raster::tile::{CENTER, SAMPLES_4};
use crate::state::*;
use crate::state::{DrawState, Rect, Topology};
use devmem::Allocation;
use gaurast_runner::{Case, simd_levels};
use isa::builder::Builder;
use isa::ir::{Program, Rate, Statement, Type};
use isa::level::SimdLevel;
use isa::op::Op;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// The framebuffer's width. Neither it nor the height is a multiple of a tile's side.
const WIDTH: u32 = 90;
const HEIGHT: u32 = 70;
const EVERYTHING: Rect = Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT };

fn image(format: Format, samples: u32, layers: u32) -> ImageView {
    let desc = ImageDesc {
        kind: ImageKind::D2,
        format,
        extent: [WIDTH, HEIGHT, 1],
        mip_levels: 1,
        array_layers: layers,
        samples,
    };
    let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
    ImageView {
        image: Arc::new(Image::new(desc, memory, 0).unwrap()),
        format,
        base_mip_level: 0,
        level_count: 1,
        base_layer: 0,
        layer_count: layers,
    }
}

/// The bytes of a texel.
fn texel(view: &ImageView, aspect: Aspect, layer: u32, sample: u32, [x, y]: [u32; 2]) -> Vec<u8> {
    let layout = view.image.subresource(aspect, 0, layer).unwrap();
    let layout = layout.sample(sample);
    let mut out = vec![0; layout.format.texel_size()];
    view.image.read_row(&layout, [x, y, 0], &mut out).unwrap();
    out
}

fn attachment(view: &ImageView, value: ClearValue) -> Attachment {
    Attachment {
        view: view.clone(),
        load: LoadOp::Clear(value),
        store: StoreOp::Store,
        resolve: None,
        multisampled: None,
    }
}

fn state(samples: u32) -> DrawState {
    DrawState {
        front_clockwise: false,
        samples,
        blend_constants: [0.25, 0.5, 0.75, 1.0],
        ..DrawState::new(Topology::TriangleList, [WIDTH, HEIGHT])
    }
}

/// A fragment stage with these inputs and outputs, slot by slot, that copies inputs to outputs. If `discards`, lanes
/// are killed where the input after the last output is above one half.
fn fragments(inputs: Vec<FragmentInput>, outputs: Vec<FragmentOutput>, discards: bool) -> FragmentPrograms {
    let mut b = Builder::new();
    let registers: Vec<_> = (0..inputs.len()).map(|slot| b.input(slot as u32, Type::B32, Rate::Varying)).collect();
    if discards {
        let half = b.f32(0.5);
        let more = b.compute(Op::FLt, &[half, registers[outputs.len()]]);
        b.begin_if(more);
        b.statement(Statement::Kill);
        b.end();
    }
    for (slot, input) in registers.iter().enumerate().take(outputs.len()) {
        let output = b.output(slot as u32, Type::B32);
        b.assign(output, *input);
    }
    FragmentPrograms {
        program: b.finish().unwrap(),
        inputs: inputs.into_iter().map(Some).collect(),
        outputs: outputs.into_iter().map(Some).collect(),
        early_tests: false,
        post_depth_coverage: false,
        discards,
        per_sample: false,
        has_side_effects: false,
    }
}

/// The varyings from 0 to `count` as inputs.
fn varyings(count: u32, interpolation: Interpolation, sampling: Sampling) -> Vec<FragmentInput> {
    (0..count).map(|index| FragmentInput::Varying { index, interpolation, sampling }).collect()
}

/// The components of a colour attachment as outputs.
fn color(attachment: usize, index: usize) -> Vec<FragmentOutput> {
    (0..4).map(|component| FragmentOutput::Color { attachment, component, index }).collect()
}

fn vertex_program() -> Program {
    Builder::new().finish().unwrap()
}

/// A draw of these primitives, with three vertices each and `per_vertex` varyings per vertex.
fn draw(
    device: &Device,
    fragment: Option<FragmentPrograms>,
    state: DrawState,
    primitives: Vec<Primitive>,
    values: Vec<u32>,
    per_vertex: usize,
) -> PrimitiveDraw {
    let programs = DrawPrograms {
        vertex: vertex_program(),
        vertex_inputs: Vec::new(),
        vertex_outputs: Vec::new(),
        varyings: per_vertex as u32,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment,
    };
    let area = Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT };
    let layers = primitives.iter().map(|p| u32::from(p.layer) + 1).max();
    let state = Arc::new(state);
    let scissors = state.scissors.clone().into_iter();
    PrimitiveDraw {
        pipeline: Arc::new(DrawPipeline::new(device.level(), &programs).unwrap()),
        state,
        bindings: Bindings::default(),
        regions: scissors.map(|scissor| scissor.intersect(area)).collect(),
        segments: vec![PrimitiveSegment {
            bins: Bins::everywhere(&primitives, area, device.runtime().config().macro_tile_size, layers.unwrap_or(1)),
            primitives,
            varyings: Varyings { values, per_vertex },
            lines: Vec::new(),
        }],
        counts_fragments: false,
        record: None,
    }
}

/// A triangle with random corners around the framebuffer and a constant depth.
fn triangle(rng: &mut ChaCha8Rng, index: u32) -> Primitive {
    let spread = *[600, 4000, 30_000].choose(rng).unwrap();
    let (w, h) = (WIDTH as i32 * 256, HEIGHT as i32 * 256);
    loop {
        let middle = [rng.random_range(0..w), rng.random_range(0..h)];
        let corners: [[i32; 2]; 3] =
            std::array::from_fn(|_| middle.map(|middle: i32| middle + rng.random_range(-spread..=spread)));
        let [a, b, c] = corners.map(|corner| corner.map(i64::from));
        if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0 {
            continue;
        }
        // There are few depths, so that they are often equal.
        let depth = rng.random_range(0..8) as f32 / 7.0;
        return Primitive {
            corners,
            offsets: rng.random(),
            depth: [depth; 3],
            inverse_w: [1.0; 3],
            vertices: [3 * index, 3 * index + 1, 3 * index + 2],
            provoking: 3 * index,
            id: index,
            kind: PrimitiveKind::Triangle,
            front: rng.random(),
            viewport: 0,
            layer: 0,
        };
    }
}

/// Runs draws as one pass, and returns the counters.
fn run(config: &Config, rendering: &Rendering, draws: impl Fn(&Device) -> Vec<PrimitiveDraw>) -> Counters {
    let device = Device::new(config).unwrap();
    let mut counters = Counters::default();
    let mut pass = Pass::begin(rendering).unwrap();
    for draw in draws(&device) {
        pass.push(PassDraw::Primitives(Box::new(draw)), device.runtime(), &mut counters).unwrap();
    }
    pass.end(device.runtime(), &mut counters).unwrap();
    counters
}

/// The configurations of a level that must all give the same result.
fn configs(simd: SimdLevel) -> [Config; 3] {
    let base = Config { threads: 1, simd, ..Config::default() };
    [
        base.clone(),
        Config { macro_tile_size: 16, threads: 3, ..base.clone() },
        Config { macro_tile_size: 128, flush: FlushPolicy::EveryDraw, ..base },
    ]
}

#[gaurast_runner::test(each = simd_levels())]
fn interpolation_agrees_with_binary64(case: &Case) {
    for (samples, each_shaded) in [(1, false), (4, false), (4, true)] {
        interpolate(samples, each_shaded, level_of(case));
    }
}

/// Compares every varying, depth and 1 / w of a large triangle in perspective with binary64, at the pixels' centres or
/// at the samples.
fn interpolate(samples: u32, each_shaded: bool, simd: SimdLevel) {
    let config = Config { threads: 1, simd, ..Config::default() };
    let corners = [[-3000, 700], [26_000, -900], [9000, 20_000]];
    let offsets = [[-32_768, 20_000], [31_000, 32_767], [-9000, -32_768]];
    let (depth, inverse_w) = ([0.1, 0.9, 0.4], [2.0, 0.01, 0.5]);
    let values: [[f32; 2]; 3] = [[1.0, -4.0], [0.0, 3.0], [0.5, 100.0]];
    let mut inputs = varyings(1, Interpolation::Perspective, Sampling::Center);
    inputs.push(FragmentInput::Varying { index: 1, interpolation: Interpolation::Linear, sampling: Sampling::Center });
    inputs.extend([FragmentInput::FragCoord(2), FragmentInput::FragCoord(3)]);
    let target = image(Format::R32G32B32A32Sfloat, samples, 1);
    let rendering = Rendering {
        area: EVERYTHING,
        layer_count: 1,
        view_mask: 0,
        color: vec![Some(attachment(&target, ClearValue::Float([-9.0; 4])))],
        depth: None,
        stencil: None,
    };
    let counters = run(&config, &rendering, |device| {
        let primitive = Primitive {
            corners,
            offsets,
            depth,
            inverse_w,
            vertices: [0, 1, 2],
            provoking: 0,
            id: 0,
            kind: PrimitiveKind::Triangle,
            front: true,
            viewport: 0,
            layer: 0,
        };
        let bits = values.as_flattened().iter().map(|v| v.to_bits()).collect();
        let stage = fragments(inputs.clone(), color(0, 0), false);
        vec![draw(
            device,
            Some(stage),
            DrawState { sample_shading: each_shaded, ..state(samples) },
            vec![primitive],
            bits,
            2,
        )]
    });
    let [a, b, c] = [0, 1, 2].map(|corner: usize| {
        let along = |axis: usize| f64::from(corners[corner][axis]) + f64::from(offsets[corner][axis]) / 65_536.0;
        [along(0), along(1)]
    });
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let mut covered = 0;
    let places: &[_] = if each_shaded { &SAMPLES_4 } else { &CENTER };
    for (sample, y) in (0..places.len()).flat_map(|sample| (0..HEIGHT).map(move |y| (sample, y))) {
        for x in 0..WIDTH {
            let bytes = texel(&target, Aspect::Color, 0, sample as u32, [x, y]);
            let found = Format::R32G32B32A32Sfloat.decode(&bytes);
            if found[0] == -9.0 {
                continue;
            }
            covered += 1;
            let [within_x, within_y] = places[sample].map(f64::from);
            let p = [f64::from(x) * 256.0 + within_x, f64::from(y) * 256.0 + within_y];
            let side =
                |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            let weights = [side(b, c, p) / area, side(c, a, p) / area, side(a, b, p) / area];
            let sum = |of: [f64; 3]| (0..3).map(|i| weights[i] * of[i]).sum::<f64>();
            let w = sum(inverse_w.map(f64::from));
            let perspective =
                (0..3).map(|i| weights[i] * f64::from(inverse_w[i]) * f64::from(values[i][0])).sum::<f64>() / w;
            let linear = sum(values.map(|v| f64::from(v[1])));
            let expected = [perspective, linear, sum(depth.map(f64::from)), w];
            let tolerance = [1e-6, 2e-5, 1.2e-7, 4e-7 * w.abs().max(0.1)];
            for i in 0..4 {
                let error = (f64::from(found[i]) - expected[i]).abs();
                assert!(error <= tolerance[i], "{x} {y} {i}: {} {}", found[i], expected[i]);
            }
        }
    }
    assert!(covered > 2000);
    if places.len() == samples as usize {
        assert_eq!(counters.get(Counter::FragmentInvocations), covered);
        assert_eq!(counters.get(Counter::SamplesPassed), covered);
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn where_each_sample_is_shaded_fragments_are_at_their_sample(case: &Case) {
    let config = Config { threads: 1, simd: level_of(case), ..Config::default() };
    let target = image(Format::R32G32B32A32Sfloat, 4, 1);
    let rendering = Rendering {
        area: EVERYTHING,
        layer_count: 1,
        view_mask: 0,
        color: vec![Some(attachment(&target, ClearValue::Float([-9.0; 4])))],
        depth: None,
        stencil: None,
    };
    run(&config, &rendering, |device| {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let everywhere =
            Primitive { corners: [[-1000, -1000], [100_000, -1000], [-1000, 100_000]], ..triangle(&mut rng, 0) };
        let inputs = vec![FragmentInput::FragCoord(0), FragmentInput::FragCoord(1)];
        let mut outputs = color(0, 0);
        outputs.truncate(2);
        let state = DrawState { sample_shading: true, ..state(4) };
        let stage = fragments(inputs, outputs, false);
        vec![draw(device, Some(stage), state, vec![everywhere], Vec::new(), 0)]
    });
    for (sample, place) in (0..).zip(SAMPLES_4) {
        for at in 0..WIDTH * HEIGHT {
            let pixel = [at % WIDTH, at / WIDTH];
            let bytes = texel(&target, Aspect::Color, 0, sample, pixel);
            let found = Format::R32G32B32A32Sfloat.decode(&bytes);
            let expected = [0, 1].map(|axis: usize| pixel[axis] as f32 + place[axis] as f32 / 256.0);
            assert_eq!(found[..2], expected);
        }
    }
}
