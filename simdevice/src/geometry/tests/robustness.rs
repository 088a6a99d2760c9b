//! Tests that no draw panics, and that the result is independent of the number of workers.

use super::scene::*;

use crate::packet::*;
use crate::program::interface::VertexOutput;

use crate::state::{DepthBias, DepthBiasUnit, DrawState, PolygonMode, Topology, Viewport};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A random float that is often a special value.
fn wild(rng: &mut ChaCha8Rng) -> f32 {
    let odd = [0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, 1e-40, -1.0, 1e30];
    match rng.random_range(0..4) {
        0 => odd[rng.random_range(0..odd.len())],
        1 => f32::from_bits(rng.random()),
        _ => rng.random_range(-2.0..2.0),
    }
}

#[gaurast_runner::test]
fn wild_numbers_are_survived() {
    let device = device(1);
    let mut rng = ChaCha8Rng::seed_from_u64(61);
    let topologies = [Topology::PointList, Topology::LineStrip, Topology::TriangleStrip];
    for round in 0..300 {
        let positions: Vec<[f32; 4]> = (0..60).map(|_| std::array::from_fn(|_| wild(&mut rng))).collect();
        let extra: Vec<[f32; 4]> = (0..60).map(|_| std::array::from_fn(|_| wild(&mut rng))).collect();
        let programs = programs(&[
            VertexOutput::PointSize,
            VertexOutput::ClipDistance(7),
            VertexOutput::CullDistance(0),
            if round % 2 == 0 { VertexOutput::ViewportIndex } else { VertexOutput::Layer },
        ]);
        let mut draw_state = state(topologies[round % 3]);
        draw_state.polygon_mode = [PolygonMode::Fill, PolygonMode::Line, PolygonMode::Point][rng.random_range(0..3)];
        draw_state.line_width = wild(&mut rng);
        if draw_state.line_width.is_nan() {
            draw_state.line_width = f32::INFINITY;
        }
        draw_state.depth_clamp = rng.random();
        draw_state.samples = [1, 4][rng.random_range(0..2)];
        draw_state.depth_bias = Some(DepthBias {
            constant: wild(&mut rng),
            unit: DepthBiasUnit::DEFAULT,
            clamp: wild(&mut rng),
            slope: wild(&mut rng),
        });
        if rng.random_bool(0.5) {
            draw_state.viewports[0] = Viewport {
                x: wild(&mut rng),
                y: wild(&mut rng),
                width: wild(&mut rng),
                height: wild(&mut rng),
                min_depth: wild(&mut rng),
                max_depth: wild(&mut rng),
            };
        }
        let mut draw = draw_with(&device, programs, draw_state, &positions);
        draw.attributes.push(stream(&extra, crate::Format::R32G32B32A32Sfloat));
        let found = run(&device, &draw);
        for primitive in &found.primitives {
            assert!(area(primitive.corners) > 0);
            assert!(primitive.corners.iter().flatten().all(|c| c.abs() < 1 << 25));
            let vertices = found.varyings.values.len() / found.varyings.per_vertex;
            assert!(primitive.vertices.iter().all(|&vertex| (vertex as usize) < vertices));
        }
    }
}

#[gaurast_runner::test]
fn numbers_at_the_end_of_their_range_are_survived() {
    let device = device(1);
    let positions = [at_pixel(10.0, 10.0, 0.5), at_pixel(90.0, 10.0, 0.5), at_pixel(90.0, 90.0, 0.5)];
    let base = draw(&device, Topology::TriangleList, &positions);
    let drawn = |change: &dyn Fn(&mut Draw)| {
        let mut draw = base.clone();
        change(&mut draw);
        run(&device, &draw).primitives.len()
    };
    assert_eq!(drawn(&|_| {}), 1);
    assert_eq!(drawn(&|draw| draw.count = 0), 0);
    assert_eq!(drawn(&|draw| draw.instance_count = 0), 0);
    assert_eq!(drawn(&|draw| (draw.first, draw.count) = (u32::MAX, 3)), 0);
    assert_eq!(drawn(&|draw| draw.first_instance = u32::MAX), 1);
    assert_eq!(drawn(&|draw| (draw.first_instance, draw.instance_count) = (u32::MAX - 1, 3)), 3);
    assert_eq!(drawn(&|draw| draw.attributes.clear()), 0);
    let indexed = |draw: &mut Draw, list: &[u32], offset: i32| {
        let mut stream = indices(list);
        stream.vertex_offset = offset;
        draw.indices = Some(stream);
    };
    assert_eq!(drawn(&|draw| indexed(draw, &[0, 1, u32::MAX], i32::MAX)), 0);
    assert_eq!(drawn(&|draw| indexed(draw, &[0, 1, 2], i32::MIN)), 0);
    assert_eq!(drawn(&|draw| indexed(draw, &[1, 2, 3], -1)), 1);
    // Indices outside of the buffer are zero.
    assert_eq!(drawn(&|draw| indexed(draw, &[0, 1], 0)), 0);
    assert_eq!(
        drawn(&|draw| {
            indexed(draw, &[0, 1, 2], 0);
            (draw.first, draw.count) = (u32::MAX - 1, 6);
        }),
        0
    );
    let without = |change: &dyn Fn(&mut DrawState)| {
        drawn(&|draw: &mut Draw| {
            let mut state = (*draw.state).clone();
            change(&mut state);
            draw.state = state.into();
        })
    };
    assert_eq!(without(&|state| state.viewports.clear()), 0);
    assert_eq!(without(&|state| state.scissors.clear()), 0);
    assert_eq!(without(&|state| state.rasterizer_discard = true), 0);
    assert_eq!(without(&|state| state.scissors[0].width = 0), 0);
}

#[gaurast_runner::test]
fn the_number_of_workers_changes_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(71);
    let positions: Vec<[f32; 4]> = (0..4000).map(|_| [0, 1, 2, 3].map(|_| rng.random_range(-1.0..1.5f32))).collect();
    let list: Vec<u32> = (0..30_000).map(|_| rng.random_range(0..4000)).collect();
    let mut seen = None;
    for threads in [1, 2, 5] {
        let device = device(threads);
        let mut draw = draw(&device, Topology::TriangleList, &positions);
        draw.indices = Some(indices(&list));
        (draw.count, draw.instance_count) = (30_000, 2);
        let found = run(&device, &draw);
        assert!(found.primitives.len() > 5000);
        let found = format!("{:?} {:?} {:?}", found.primitives, found.varyings, found.bins);
        assert_eq!(*seen.get_or_insert_with(|| found.clone()), found, "{threads} threads");
    }
}

#[gaurast_runner::test]
fn a_vertex_program_without_end_is_stopped() {
    use super::super::{FrontEnd, Surface};
    use crate::{Config, Device};
    use isa::ir::{Label, Program, Statement};
    let config = Config { threads: 2, shader_timeout: std::time::Duration::from_millis(20), ..Config::default() };
    let device = Device::new(&config).unwrap();
    let mut programs = programs(&[]);
    programs.vertex = Program::default();
    programs.vertex.body.push(Statement::Loop { label: Label(0), body: Vec::new(), continuing: Vec::new() });
    let mut draw = draw_with(&device, programs, state(Topology::PointList), &[[0.0; 4]]);
    draw.count = 10_000;
    let surface = Surface { area: EVERYTHING, layers: 1, view: None, depth: None };
    let mut counters = crate::stats::counters::Counters::default();
    let mut front = FrontEnd::new(&draw, surface, device.runtime(), &mut counters);
    let stopped = front.next_segments(&mut counters).unwrap_err();
    assert!(matches!(stopped, isa::machine::Stopped::TimedOut { .. }));
}
