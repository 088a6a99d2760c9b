//! Gaussians that a vertex program projects, and fragments that a fragment program makes, sent to the device as
//! packets. They are compared with the reference, which gets the outputs of the vertex program.

mod cloud;
mod device;
mod resolved;

use cloud::{cloud, level};
use device::{Case, SIZE, UPRIGHT, device, draw, whole};
use gaurast_runner::simd_levels;
use gaurast_testkit::packets::buffer;
use gaurast_tests::oracle::shaded::{OracleOutputs, OracleViewport, project, render_shaded};
use gaurast_tests::oracle::{OracleOrder, OracleState, SkipReason};
use simdevice::packet::{Draw, IndexStream};
use simdevice::runtime::{FlushPolicy, SimdLevel};
use simdevice::state::CompareOp;
use simdevice::stats::counters::Counter;
use simdevice::{Config, Device};
use std::sync::Arc;

/// For each reason of skipping, a Gaussian that is skipped for it.
fn skipped() -> Vec<(OracleOutputs, SkipReason)> {
    let sound = OracleOutputs {
        position: [0.0, 0.0, 0.5, 1.0],
        covariance: [4.0, 0.0, 4.0],
        opacity: 0.9,
        color: [1.0; 3],
        key: Some(1.0),
    };
    let nan = f32::NAN;
    let at = |position| OracleOutputs { position, ..sound };
    let shaped = |covariance| OracleOutputs { covariance, ..sound };
    let (not_finite, near) = (SkipReason::NonFinite, SkipReason::Near);
    let degenerate = SkipReason::DegenerateCovariance;
    vec![
        (at([nan, 0.0, 0.5, 1.0]), not_finite),
        (at([0.0, f32::INFINITY, 0.5, 1.0]), not_finite),
        (shaped([4.0, nan, 4.0]), not_finite),
        (OracleOutputs { opacity: nan, ..sound }, not_finite),
        (OracleOutputs { color: [0.5, nan, 0.5], ..sound }, not_finite),
        (OracleOutputs { key: Some(nan), ..sound }, not_finite),
        (OracleOutputs { opacity: 0.003, ..sound }, SkipReason::OpacityBelowFloor),
        (at([0.0, 0.0, 0.5, 0.0]), near),
        (at([0.0, 0.0, -0.5, -1.0]), near),
        (at([0.0, 0.0, -0.001, 1.0]), near),
        (at([0.0, 0.0, 1.001, 1.0]), SkipReason::Far),
        // Negative definite, indefinite and semidefinite.
        (shaped([-4.0, 0.0, -4.0]), degenerate),
        (shaped([4.0, 9.0, 4.0]), degenerate),
        (shaped([4.0, 0.0, -0.3]), degenerate),
    ]
}

#[gaurast_runner::test(each = simd_levels())]
fn pictures_keep_the_contract_at_a_level(case: &gaurast_runner::Case) {
    let outputs = cloud(31, 3000);
    let device = device(level(case));
    let name = format!("shaded_{}", case.variant());
    let drawn = whole(&device, &outputs).check(&name, &device);
    assert_eq!(drawn.counters.get(Counter::VertexInvocations), 3000);
    assert_eq!(drawn.counters.get(Counter::GaussiansRead), 3000);
}

#[gaurast_runner::test]
fn modes_keep_the_contract() {
    let outputs = cloud(32, 800);
    let device = device(SimdLevel::Best);
    let default = OracleState::default();
    for (name, state) in [
        ("compensated", OracleState { opacity_compensated: true, ..default }),
        ("primitive_order", OracleState { order: OracleOrder::Primitive, ..default }),
        ("by_distance", OracleState { order: OracleOrder::RadialDistance, ..default }),
        ("unfiltered", OracleState { low_pass: 0.0, ..default }),
    ] {
        let case = Case { state, ..whole(&device, &outputs) };
        case.check(&format!("shaded_{name}"), &device);
    }
    // Without a key, Gaussians are sorted by w.
    let unkeyed: Vec<_> = (outputs.iter()).map(|one| OracleOutputs { key: None, ..*one }).collect();
    whole(&device, &unkeyed).check("shaded_unkeyed", &device);
    // Flipped viewports, and viewports with any corner, move only the means.
    for (name, corner, size) in [
        ("flipped", [0.0, SIZE[1] as f32], [SIZE[0] as f32, -(SIZE[1] as f32)]),
        ("large", [-20.25, -7.5], [190.5, 101.25]),
    ] {
        let case = Case { viewport: OracleViewport { corner, size }, ..whole(&device, &outputs) };
        case.check(&format!("shaded_{name}"), &device);
    }
}

#[gaurast_runner::test]
fn what_cannot_be_drawn_is_skipped_and_counted() {
    let device = device(SimdLevel::Best);
    let mut outputs = cloud(33, 300);
    let state = OracleState::default();
    let all = skipped();
    for (one, reason) in &all {
        assert_eq!(project(one, &UPRIGHT, &state).err(), Some(*reason), "{one:?}");
        outputs.push(*one);
    }
    let drawn = whole(&device, &outputs).check("shaded_skipped", &device);
    let expected = render_shaded(&outputs, SIZE, &UPRIGHT, &state).skips;
    let counted = |counter| drawn.counters.get(counter) as usize;
    assert_eq!(counted(Counter::SkippedNonFinite), expected.non_finite);
    assert_eq!(counted(Counter::SkippedFaint), expected.opacity_below_floor);
    assert_eq!(counted(Counter::SkippedNear), expected.near);
    assert_eq!(counted(Counter::SkippedFar), expected.far);
    assert_eq!(counted(Counter::SkippedDegenerate), expected.degenerate_covariance);
}

#[gaurast_runner::test]
fn draws_indices_and_instances_make_one_sorted_set() {
    let device = device(SimdLevel::Best);
    let outputs = cloud(34, 700);
    let expected = whole(&device, &outputs).run(&device);
    let in_two = Case {
        draws: vec![draw(&device, &outputs, 0, 300), draw(&device, &outputs, 300, 400)],
        ..whole(&device, &outputs)
    };
    assert!(in_two.run(&device).color == expected.color);
    // Indices that name every Gaussian twice. The order is that of the positions in the index buffer.
    let indices: Vec<u16> = (0..700).chain((0..700).rev()).collect();
    let indexed = Draw {
        indices: Some(IndexStream { buffer: buffer(&indices), index_size: 2, vertex_offset: 0, restart: None }),
        ..draw(&device, &outputs, 0, 1400)
    };
    let twice: Vec<_> = indices.iter().map(|&index| outputs[usize::from(index)]).collect();
    let case = Case { outputs: &twice, draws: vec![indexed], ..whole(&device, &outputs) };
    case.check("shaded_indexed", &device);
    // A second instance draws all Gaussians again, and is behind the first at equal depths.
    let instances = Draw { instance_count: 2, ..draw(&device, &outputs, 0, 700) };
    let again: Vec<_> = outputs.iter().chain(&outputs).copied().collect();
    let case = Case { outputs: &again, draws: vec![instances], ..whole(&device, &outputs) };
    case.check("shaded_instances", &device);
}

#[gaurast_runner::test]
fn centres_are_tested_for_depth_and_the_median_is_stored() {
    let device = device(SimdLevel::Best);
    let outputs = cloud(35, 1200);
    let depth = |one: &OracleOutputs| {
        let [_, _, z, w] = one.position.map(f64::from);
        (z / w) as f32
    };
    let before: Vec<_> = outputs.iter().filter(|one| depth(one) < 0.5).copied().collect();
    assert!(before.len() > 400 && before.len() < 800);
    let all = whole(&device, &outputs);
    let case = Case { outputs: &before, depth: Some((CompareOp::Less, true)), ..all };
    let drawn = case.check("shaded_depth", &device);
    let depths: Vec<f32> = before.iter().map(depth).collect();
    let covered = std::iter::zip(&drawn.color, &drawn.depth).filter(|(rgba, _)| rgba[3] > 0.0);
    let mut count = 0;
    for (_, stored) in covered {
        assert!(depths.contains(stored), "{stored} is no centre's depth");
        count += 1;
    }
    assert!(count > 1000, "{count}");
}

#[gaurast_runner::test]
fn clip_space_may_begin_at_minus_w() {
    let device = device(SimdLevel::Best);
    let outputs = cloud(36, 1200);
    let moved: Vec<_> = outputs
        .iter()
        .map(|one| {
            let mut one = *one;
            let [_, _, z, w] = one.position;
            one.position[2] = 2.0 * z - w;
            one
        })
        .collect();
    let depth = |one: &OracleOutputs| {
        let [_, _, z, w] = one.position.map(f64::from);
        (z / w / 2.0 + 0.5) as f32
    };
    let depths: Vec<f32> = moved.iter().map(depth).collect();
    let case = |outputs, negative_one_to_one| Case {
        negative_one_to_one,
        draws: vec![draw(&device, outputs, 0, 1200)],
        ..whole(&device, outputs)
    };
    let [expected, drawn] =
        [(&outputs[..], false), (&moved[..], true)].map(|(outputs, both)| case(outputs, both).run(&device));
    assert!(drawn.color == expected.color);
    let clipped = case(&moved, false).run(&device);
    assert!(clipped.counters.get(Counter::SkippedNear) > 100);
    assert_eq!(drawn.counters.get(Counter::SkippedNear), 0);
    let stored = Case { depth: Some((CompareOp::Less, true)), ..case(&moved, true) };
    let stored = stored.run(&device).depth;
    let before = stored.iter().filter(|&&depth| depth != 0.5);
    let before: Vec<_> = before.collect();
    assert!(before.len() > 1000, "{}", before.len());
    assert!(before.into_iter().all(|depth| depths.contains(depth)));
}

#[gaurast_runner::test]
fn neither_threads_nor_flushes_change_a_bit() {
    let outputs = cloud(36, 5000);
    let one = device(SimdLevel::Best);
    let expected = whole(&one, &outputs).run(&one);
    for (threads, flush) in [(1, FlushPolicy::WhenFull), (3, FlushPolicy::EveryDraw)] {
        let config = Config { threads, flush, macro_tile_size: 32, ..Config::default() };
        let device = Arc::new(Device::new(&config).expect("a device"));
        let drawn = whole(&device, &outputs).run(&device);
        assert!(drawn.color == expected.color, "{threads} threads");
    }
}

#[gaurast_runner::test]
fn extreme_values_keep_the_contract() {
    let device = device(SimdLevel::Best);
    let mut outputs = cloud(37, 200);
    let sound = outputs[0];
    let at = |position| OracleOutputs { position, ..sound };
    let shaped = |covariance| OracleOutputs { position: [0.25, -0.25, 0.5, 1.0], covariance, opacity: 0.5, ..sound };
    outputs.extend([
        at([1e30, -1e30, 0.5, 1.0]),
        at([f32::MAX, f32::MAX, 0.0, 1e-38]),
        at([1e-39, 1e-39, 1e-39, 2e-39]),
        at([0.0, 0.0, f32::MAX, f32::MAX]),
        // Covers everything, covers nothing, thin, thinner than binary32 can represent, and circular up to rounding.
        shaped([1e30, 0.0, 1e30]),
        shaped([f32::MAX, 0.0, f32::MAX]),
        shaped([1e-30, 0.0, 1e-30]),
        shaped([1e6, 999_999.9, 1e6]),
        shaped([0.0; 3]),
        shaped([1e4, 0.0, 0.0]),
        shaped([9.0, 9.0, 9.0]),
        OracleOutputs { opacity: 1e30, ..shaped([4.0, 1.0, 4.0]) },
    ]);
    whole(&device, &outputs).check("shaded_extremes", &device);
    let compensated =
        Case { state: OracleState { opacity_compensated: true, ..OracleState::default() }, ..whole(&device, &outputs) };
    compensated.check("shaded_extremes_compensated", &device);
}
