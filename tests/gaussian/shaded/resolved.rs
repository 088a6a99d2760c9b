//! Resolve shaders: their inputs equal the reference's values of each pixel, and their outputs reach the attachments.

use super::cloud::{cloud, level};
use super::device::{Case, REPLACE, SIZE, UPRIGHT, append, device, triangle, whole};
use gaurast_runner::simd_levels;
use gaurast_tests::oracle::resolve::{Resolved, resolve_scene, resolve_shaded};
use gaurast_tests::oracle::{OracleDepthFormat, OracleState, OracleTests};
use gaurast_tests::scenes;
use simdevice::Format;
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Rate, Type};
use simdevice::packet::GaussianFragmentStage;
use simdevice::program::bindings::Bindings;
use simdevice::program::fragment::GaussianFragmentProgram;
use simdevice::program::interface::{
    FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling, resolve,
};
use simdevice::runtime::SimdLevel;
use simdevice::state::gaussian::Camera;
use simdevice::state::{BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState, CompareOp};
use simdevice::stats::counters::Counter;
use std::sync::Arc;

/// A fragment program that writes its inputs, four to each attachment in turn.
fn passing_on(device: &simdevice::Device, inputs: &[FragmentInput]) -> GaussianFragmentStage {
    let mut builder = Builder::new();
    for slot in 0..inputs.len() as u32 {
        let input = builder.input(slot, Type::B32, Rate::Varying);
        let output = builder.output(slot, Type::B32);
        builder.assign(output, input);
    }
    let output = |slot: usize| FragmentOutput::Color { attachment: slot / 4, component: slot % 4, index: 0 };
    let programs = FragmentPrograms {
        program: builder.finish().expect("a program"),
        inputs: inputs.iter().copied().map(Some).collect(),
        outputs: (0..inputs.len()).map(|slot| Some(output(slot))).collect(),
        early_tests: false,
        post_depth_coverage: false,
        discards: false,
        per_sample: false,
        has_side_effects: false,
    };
    GaussianFragmentStage {
        program: Arc::new(GaussianFragmentProgram::new(device.level(), &programs).expect("a program")),
        bindings: Bindings::default(),
        sample_shading: false,
        alpha_to_coverage: false,
        alpha_to_one: false,
    }
}

fn varying(index: u32) -> FragmentInput {
    FragmentInput::Varying { index, interpolation: Interpolation::Perspective, sampling: Sampling::Center }
}

/// All inputs: the accumulated colour, then depths and positions.
fn everything() -> [FragmentInput; 8] {
    [
        varying(resolve::ACCUMULATED),
        varying(resolve::ACCUMULATED + 1),
        varying(resolve::ACCUMULATED + 2),
        varying(resolve::ACCUMULATED + 3),
        varying(resolve::EXPECTED_DEPTH),
        varying(resolve::MEDIAN_DEPTH),
        FragmentInput::FragCoord(0),
        FragmentInput::FragCoord(1),
    ]
}

const TOLERANCE: f64 = 5e-6;

/// True if a value is within the envelope of a pixel's outcomes.
fn within(ways: &[Resolved], value: f32, of: impl Fn(&Resolved) -> Vec<f64>) -> bool {
    let all = ways.iter().flat_map(of);
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let value = f64::from(value);
    low - TOLERANCE <= value && value <= high + TOLERANCE
}

/// Compares the inputs that a program wrote with the reference; returns the number of covered pixels.
#[track_caller]
fn check(name: &str, ways: &[Vec<Resolved>], color: &[[f32; 4]], shown: &[[f32; 4]]) -> usize {
    let mut covered = 0;
    for (index, ways) in ways.iter().enumerate() {
        let (color, shown) = (color[index], shown[index]);
        let fragment = shown != [-1.0; 4];
        let may_be = |is: bool| ways.iter().any(|way| way.covered == is);
        assert!(may_be(fragment), "{name}: pixel {index}");
        if !fragment {
            continue;
        }
        covered += 1;
        let ways: Vec<Resolved> = ways.iter().filter(|way| way.covered).cloned().collect();
        for channel in 0..4 {
            let is_within = within(&ways, color[channel], |way| vec![way.accumulated[channel]]);
            assert!(is_within, "{name}: pixel {index}: {color:?}, {ways:?}");
        }
        let [expected, median, x, y] = shown;
        let is_within = within(&ways, expected, |way| vec![way.expected_depth]);
        assert!(is_within, "{name}: pixel {index}: {expected}, {ways:?}");
        let mut medians = ways.iter().flat_map(|way| &way.median_depths);
        let is_one = medians.any(|depth| (depth - f64::from(median)).abs() <= 1e-7);
        let unknown = ways.iter().any(|way| way.medians_exhausted);
        assert!(is_one || unknown, "{name}: pixel {index}: {median}, {ways:?}");
        let (column, row) = (index as u32 % SIZE[0], index as u32 / SIZE[0]);
        assert_eq!([x, y], [column as f32 + 0.5, row as f32 + 0.5], "{name}");
    }
    covered
}

#[gaurast_runner::test(each = simd_levels())]
fn what_is_read_is_what_was_accumulated_at_a_level(test: &gaurast_runner::Case) {
    let outputs = cloud(41, 2000);
    let state = OracleState::default();
    let ways = resolve_shaded(&outputs, SIZE, &UPRIGHT, &state);
    let device = device(level(test));
    let case = Case {
        resolve: Some(passing_on(&device, &everything())),
        blend: vec![REPLACE; 2],
        clear: [-1.0; 4],
        ..whole(&device, &outputs)
    };
    let drawn = case.run(&device);
    let covered = check(test.variant(), &ways, &drawn.color, &drawn.others[0]);
    assert!(covered > 8000, "{covered}");
    let shaded = drawn.counters.get(Counter::FragmentInvocations);
    assert_eq!(shaded, covered as u64);
    assert_eq!(drawn.counters.get(Counter::SamplesPassed), covered as u64);
}

#[gaurast_runner::test]
fn depths_are_rounded_to_the_attachment_and_tested() {
    let outputs = cloud(42, 1500);
    let device = device(SimdLevel::Best);
    let depth = |one: &super::OracleOutputs| {
        let [_, _, z, w] = one.position.map(f64::from);
        (z / w) as f32
    };
    let before: Vec<_> = outputs.iter().filter(|one| depth(one) < 0.5).copied().collect();
    let ways = resolve_shaded(&before, SIZE, &UPRIGHT, &OracleState::default());
    let case = Case {
        resolve: Some(passing_on(&device, &everything())),
        blend: vec![REPLACE; 2],
        clear: [-1.0; 4],
        depth: Some((CompareOp::Less, true)),
        ..whole(&device, &outputs)
    };
    let drawn = case.run(&device);
    check("tested", &ways, &drawn.color, &drawn.others[0]);
    // The stored depth is the median that the program read.
    for (shown, stored) in std::iter::zip(&drawn.others[0], &drawn.depth) {
        let expected = if *shown == [-1.0; 4] { 0.5 } else { shown[1] };
        assert_eq!(*stored, expected);
    }
    let coarse = Case { depth_format: Format::D16Unorm, depth: None, ..case };
    let coarse = coarse.run(&device);
    let mut fragments = coarse.others[0].iter().filter(|shown| **shown != [-1.0; 4]);
    assert!(fragments.clone().count() > 5000);
    let is_held = |shown: &[f32; 4]| {
        let steps = f64::from(shown[1]) * 65535.0;
        (steps - steps.round()).abs() < 0.01
    };
    assert!(fragments.all(is_held));
}

#[gaurast_runner::test]
fn what_a_program_writes_is_blended() {
    let outputs = cloud(43, 1000);
    let device = device(SimdLevel::Best);
    let over = BlendEquation { source: BlendFactor::One, destination: BlendFactor::OneMinusSrcAlpha, op: BlendOp::Add };
    let blended = BlendState { equations: Some(BlendEquations::both(over)), write_mask: 0b0101 };
    let inputs = everything();
    let accumulated = [&inputs[..4], &inputs[..4]].concat();
    let case = |resolve| Case {
        resolve,
        blend: vec![blended, REPLACE],
        clear: [0.5, 0.25, 0.125, 1.0],
        ..whole(&device, &outputs)
    };
    let plain = case(None).run(&device);
    let shaded = case(Some(passing_on(&device, &accumulated))).run(&device);
    assert!(plain.color == shaded.color);
    // Only a program writes the second attachment.
    assert!(plain.others[0].iter().all(|texel| *texel == [0.5, 0.25, 0.125, 1.0]));
    let unblended = Case { blend: vec![REPLACE; 2], ..case(None) };
    assert!(unblended.run(&device).color == shaded.others[0]);
    // Alpha may become coverage.
    let by_alpha =
        GaussianFragmentStage { alpha_to_coverage: true, alpha_to_one: true, ..passing_on(&device, &accumulated) };
    let by_alpha = Case { depth: Some((CompareOp::Always, true)), ..case(Some(by_alpha)) };
    let by_alpha = by_alpha.run(&device);
    let mut kept = 0;
    for (index, (all, some)) in std::iter::zip(&shaded.others[0], &by_alpha.others[0]).enumerate() {
        if all[3] >= 0.5 && *all != [0.5, 0.25, 0.125, 1.0] {
            assert_eq!((&some[..3], some[3]), (&all[..3], 1.0));
            kept += 1;
        } else {
            // Discarded fragments write no depth either, and are not counted.
            assert_eq!(*some, [0.5, 0.25, 0.125, 1.0]);
            assert_eq!(by_alpha.depth[index], 0.5);
        }
    }
    assert_eq!(by_alpha.counters.get(Counter::SamplesPassed), kept);
    assert!(kept > 1000, "{kept}");
}

#[gaurast_runner::test]
fn samples_share_invocations_unless_each_is_shaded() {
    let outputs = cloud(44, 500);
    let device = device(SimdLevel::Best);
    let inputs = [
        varying(resolve::ACCUMULATED + 3),
        varying(resolve::ACCUMULATED),
        FragmentInput::FragCoord(0),
        FragmentInput::FragCoord(3),
    ];
    let case = |sample_shading| Case {
        resolve: Some(GaussianFragmentStage { sample_shading, ..passing_on(&device, &inputs) }),
        samples: 4,
        ..whole(&device, &outputs)
    };
    let (shared, each) = (case(false).run(&device), case(true).run(&device));
    let invocations = [&shared, &each].map(|drawn| drawn.counters.get(Counter::FragmentInvocations));
    assert_eq!(4 * invocations[0], invocations[1]);
    let covered = shared.color.iter().filter(|texel| texel[3] == 1.0).count();
    assert_eq!(covered as u64, invocations[0]);
    for (index, (shared, each)) in std::iter::zip(&shared.color, &each.color).enumerate() {
        if shared[3] == 0.0 {
            continue;
        }
        // The mean of the sample positions is the centre, and all other inputs are equal.
        assert_eq!(shared[..2], each[..2]);
        assert_eq!(shared[2], (index as u32 % SIZE[0]) as f32 + 0.5);
        assert!((shared[2] - each[2]).abs() < 1e-4);
    }
}

#[gaurast_runner::test]
fn samples_that_differ_are_shaded_for_themselves() {
    let outputs = cloud(45, 800);
    let device = device(SimdLevel::Best);
    let case = |sample_shading| Case {
        resolve: Some(GaussianFragmentStage { sample_shading, ..passing_on(&device, &everything()[..6]) }),
        blend: vec![REPLACE; 2],
        before: vec![triangle(&device, 4)],
        depth: Some((CompareOp::Less, true)),
        samples: 4,
        ..whole(&device, &outputs)
    };
    let (shared, each) = (case(false).run(&device), case(true).run(&device));
    let invocations = |drawn: &super::device::Drawn| drawn.counters.get(Counter::FragmentInvocations);
    assert!(shared.color == each.color && shared.others == each.others);
    let samples = invocations(&each);
    // In most pixels all samples agree, and in some at the triangle's edges they do not.
    let flat = Case { before: Vec::new(), ..case(false) };
    let flat = flat.run(&device);
    let pixels = invocations(&flat);
    assert_eq!(4 * pixels, flat.counters.get(Counter::SamplesPassed));
    assert!(invocations(&shared) < samples / 3, "{samples}");
    assert!(4 * invocations(&shared) > samples + 400, "{samples}");
}

#[gaurast_runner::test]
fn fixed_function_projection_is_resolved_in_the_depths_of_its_camera() {
    let scene = scenes::cloud(46, 2500, 0);
    let camera = scenes::camera(SIZE[0], SIZE[1]);
    let device = device(SimdLevel::Best);
    let depth_coefficients = [1.05, -2.1];
    let seen = Camera {
        focal_length: camera.focal,
        principal_point: camera.principal,
        depth_coefficients,
        ..Camera::default()
    };
    for (name, format, oracle) in [
        ("float", Format::D32Sfloat, OracleDepthFormat::Float),
        ("16 bits", Format::D16Unorm, OracleDepthFormat::Unorm(16)),
        ("24 bits", Format::X8D24UnormPack32, OracleDepthFormat::Unorm(24)),
    ] {
        let tests = OracleTests {
            negative_one_to_one: false,
            depth_coefficients,
            depth_range: [0.0, 1.0],
            format: oracle,
            depth: None,
            bounds: None,
            stencil: None,
        };
        let ways = resolve_scene(&scene.as_oracle(), &camera, &OracleState::default(), &tests);
        let case = Case {
            resolve: Some(passing_on(&device, &everything())),
            fixed: Some((append(&scene), seen)),
            blend: vec![REPLACE; 2],
            clear: [-1.0; 4],
            depth_format: format,
            ..whole(&device, &[])
        };
        let drawn = case.run(&device);
        let covered = check(name, &ways, &drawn.color, &drawn.others[0]);
        assert!(covered > 3000, "{name}: {covered}");
    }
}

/// The accumulated colour, depths and linear depths, and then the median and the nearest Gaussian.
fn tracked() -> [FragmentInput; 12] {
    [
        varying(resolve::ACCUMULATED),
        varying(resolve::ACCUMULATED + 1),
        varying(resolve::ACCUMULATED + 2),
        varying(resolve::ACCUMULATED + 3),
        varying(resolve::EXPECTED_DEPTH),
        varying(resolve::MEDIAN_DEPTH),
        varying(resolve::EXPECTED_LINEAR_DEPTH),
        varying(resolve::MEDIAN_LINEAR_DEPTH),
        varying(resolve::MEDIAN_GAUSSIAN),
        varying(resolve::MEDIAN_GAUSSIAN + 1),
        varying(resolve::NEAREST_GAUSSIAN),
        varying(resolve::NEAREST_GAUSSIAN + 1),
    ]
}

/// Holds what a program passed on of [`tracked`] against the reference, whose Gaussians have these numbers.
#[track_caller]
fn check_tracked(name: &str, ways: &[Vec<Resolved>], drawn: &super::device::Drawn, of: &[u32]) {
    let mut covered = 0;
    for (index, ways) in ways.iter().enumerate() {
        let (color, depths) = (drawn.color[index], drawn.others[0][index]);
        let named = drawn.others[1][index].map(f32::to_bits);
        let is_there = depths != [-1.0; 4];
        let ways: Vec<Resolved> = (ways.iter()).filter(|way| way.covered == is_there).cloned().collect();
        assert!(!ways.is_empty(), "{name}: pixel {index}");
        if !is_there {
            continue;
        }
        covered += 1;
        for channel in 0..4 {
            let is_within = within(&ways, color[channel], |way| vec![way.accumulated[channel]]);
            assert!(is_within, "{name}: pixel {index}: {color:?}, {ways:?}");
        }
        let [expected, _, linear, median] = depths;
        let is_within = within(&ways, expected, |way| vec![way.expected_depth]);
        assert!(is_within, "{name}: pixel {index}: {expected}, {ways:?}");
        // Depth variables are up to 8.
        let is_within = within(&ways, linear / 8.0, |way| vec![way.expected_distance / 8.0]);
        assert!(is_within, "{name}: pixel {index}: {linear}, {ways:?}");
        let [first, first_instance, nearest, nearest_instance] = named;
        assert_eq!([first_instance, nearest_instance], [0; 2], "{name}");
        let mut medians = ways.iter().flat_map(|way| &way.median_gaussians);
        let is_median = medians.any(|&(at, z)| of[at] == first && z == median);
        let is_unknown = ways.iter().any(|way| way.medians_exhausted);
        assert!(is_median || is_unknown, "{name}: pixel {index}: {first} at {median}, {ways:?}");
        let mut firsts = ways.iter().filter_map(|way| way.nearest);
        assert!(firsts.any(|at| of[at] == nearest), "{name}: pixel {index}: {nearest}, {ways:?}");
    }
    assert!(covered > 4000, "{name}: {covered}");
}

#[gaurast_runner::test(each = simd_levels())]
fn gaussians_are_named_at_a_level(test: &gaurast_runner::Case) {
    let outputs = cloud(47, 2000);
    let ways = resolve_shaded(&outputs, SIZE, &UPRIGHT, &OracleState::default());
    let device = device(level(test));
    let all: Vec<u32> = (0..outputs.len() as u32).collect();
    let case = Case {
        resolve: Some(passing_on(&device, &tracked())),
        blend: vec![REPLACE; 3],
        clear: [-1.0; 4],
        // Two draws of a set; the second begins in the middle of the buffer.
        draws: vec![super::draw(&device, &outputs, 0, 700), super::draw(&device, &outputs, 700, 1300)],
        ..whole(&device, &outputs)
    };
    let drawn = case.run(&device);
    check_tracked(test.variant(), &ways, &drawn, &all);
    // What is left out by depth is not named.
    let is_before = |one: &&super::OracleOutputs| {
        let [_, _, z, w] = one.position.map(f64::from);
        ((z / w) as f32) < 0.5
    };
    let of: Vec<u32> = (0..).zip(&outputs).filter_map(|(number, one)| is_before(&one).then_some(number)).collect();
    let before: Vec<_> = outputs.iter().filter(is_before).copied().collect();
    let ways = resolve_shaded(&before, SIZE, &UPRIGHT, &OracleState::default());
    let tested = Case { depth: Some((CompareOp::Less, true)), ..case };
    let drawn = tested.run(&device);
    check_tracked(test.variant(), &ways, &drawn, &of);
    for (shown, stored) in std::iter::zip(&drawn.others[0], &drawn.depth) {
        let expected = if *shown == [-1.0; 4] { 0.5 } else { shown[1] };
        assert_eq!(*stored, expected);
    }
}

#[gaurast_runner::test]
fn samples_that_differ_name_their_own_gaussians() {
    let outputs = cloud(48, 800);
    let device = device(SimdLevel::Best);
    let case = |sample_shading| Case {
        resolve: Some(GaussianFragmentStage { sample_shading, ..passing_on(&device, &tracked()[..8]) }),
        blend: vec![REPLACE; 2],
        before: vec![triangle(&device, 4)],
        depth: Some((CompareOp::Less, true)),
        samples: 4,
        ..whole(&device, &outputs)
    };
    let (shared, each) = (case(false).run(&device), case(true).run(&device));
    assert!(shared.color == each.color && shared.others == each.others);
    let covered = shared.others[0].iter().filter(|shown| shown[3] > 0.0);
    assert!(covered.count() > 1000);
}

#[gaurast_runner::test]
fn a_camera_is_read_without_gaussians() {
    let scene = scenes::cloud(49, 500, 0);
    let camera = scenes::camera(SIZE[0], SIZE[1]);
    let device = device(SimdLevel::Best);
    let seen = Camera {
        eye: [0.25, -0.5, 1.0e6],
        rotation: [0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        focal_length: camera.focal,
        principal_point: camera.principal,
        depth_coefficients: [1.05, -2.1],
        near_plane: 0.25,
        ..Camera::default()
    };
    let mut placed = scene.clone();
    for position in &mut placed.positions {
        *position = [position[1], -position[0], position[2] + 1.0e6];
    }
    let inputs: Vec<FragmentInput> = (0..24).map(|at| varying(resolve::CAMERA + at)).collect();
    let drawn = Case {
        resolve: Some(passing_on(&device, &inputs)),
        fixed: Some((append(&placed), seen)),
        blend: vec![REPLACE; 6],
        clear: [-1.0; 4],
        ..whole(&device, &[])
    };
    let drawn = drawn.run(&device);
    let expected = [
        [0.0, 1.0, 0.0, 0.5],
        [-1.0, 0.0, 0.0, 0.25],
        [0.0, 0.0, 1.0, -1.0e6],
        [camera.focal[0], camera.focal[1], camera.principal[0], camera.principal[1]],
        [1.05, -2.1, 0.25, f32::INFINITY],
        [0.25, -0.5, 1.0e6, 0.0],
    ];
    let pictures = std::iter::once(&drawn.color).chain(&drawn.others);
    for (picture, expected) in pictures.zip(expected) {
        let shown: Vec<_> = picture.iter().filter(|texel| **texel != [-1.0; 4]).collect();
        assert!(shown.len() > 1000 && shown.iter().all(|texel| **texel == expected));
    }
}
