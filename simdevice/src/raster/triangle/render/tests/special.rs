//! Tests of features that random states do not cover: samples, layers, resolves, side effects, programs that do not
//! end.

use super::*;
use crate::packet::{Attachment, AttachmentResolve, Rendering};
use devmem::BufferRange;
use isa::ir::{Address, AtomicOp, Binding, Format as Element, Space};
use isa::machine::Stopped;
use std::time::Duration;

fn single() -> Config {
    Config { threads: 1, ..Config::default() }
}

/// A triangle with these corners in 1/256 pixels, clockwise in the framebuffer.
fn over(corners: [[i32; 2]; 3], layer: u16) -> Primitive {
    Primitive {
        corners,
        offsets: [[0; 2]; 3],
        depth: [0.5; 3],
        inverse_w: [1.0; 3],
        vertices: [0, 1, 2],
        provoking: 0,
        id: 7,
        kind: PrimitiveKind::Triangle,
        front: true,
        viewport: 0,
        layer,
    }
}

/// The corners of a triangle that covers the framebuffer.
const LARGE: [[i32; 2]; 3] = [[-100, -100], [60_000, -100], [-100, 60_000]];

fn rendering(color: Vec<Attachment>) -> Rendering {
    Rendering {
        area: EVERYTHING,
        layer_count: 1,
        view_mask: 0,
        color: color.into_iter().map(Some).collect(),
        depth: None,
        stencil: None,
    }
}

const WIDE: Format = Format::R32G32B32A32Sfloat;

#[gaurast_runner::test]
fn each_sample_is_shaded_for_itself() {
    let target = image(WIDE, 4, 1);
    let inputs = vec![
        FragmentInput::SampleId,
        FragmentInput::SamplePosition(0),
        FragmentInput::FragCoord(1),
        FragmentInput::Varying { index: 0, interpolation: Interpolation::Linear, sampling: Sampling::Sample },
    ];
    let pass = rendering(vec![attachment(&target, ClearValue::Float([-1.0; 4]))]);
    let counters = run(&single(), &pass, |device| {
        // The varying is x in pixels.
        let values = LARGE.map(|[x, _]| (x as f32 / 256.0).to_bits());
        let stage = fragments(inputs.clone(), color(0, 0), false);
        let primitives = vec![over(LARGE, 0)];
        vec![draw(device, Some(stage), state(4), primitives, values.to_vec(), 1)]
    });
    for sample in 0..4u32 {
        let [dx, dy] = SAMPLES_4[sample as usize].map(|at| at as f32 / 256.0);
        for (x, y) in [(0, 0), (33, 17), (WIDTH - 1, HEIGHT - 1)] {
            let found = WIDE.decode(&texel(&target, Aspect::Color, 0, sample, [x, y]));
            assert_eq!(found[0].to_bits(), sample);
            assert_eq!(found[1..3], [dx, y as f32 + dy]);
            assert!((found[3] - (x as f32 + dx)).abs() < 1e-4, "{}", found[3]);
        }
    }
    let all = u64::from(4 * WIDTH * HEIGHT);
    assert_eq!(counters.get(Counter::FragmentInvocations), all);
    assert_eq!(counters.get(Counter::SamplesPassed), all);
}

#[gaurast_runner::test]
fn centroids_lie_within_the_primitive() {
    let target = image(WIDE, 4, 1);
    // Half a pixel wide, between the edge of pixels and their centres. The centres are outside, where the varying is
    // above 1.
    let corners = [[1020, 10], [1150, 10], [1020, 15_000]];
    let varying = |sampling| FragmentInput::Varying { index: 0, interpolation: Interpolation::Perspective, sampling };
    let inputs = vec![
        varying(Sampling::Centroid),
        varying(Sampling::Center),
        FragmentInput::SampleMask,
        FragmentInput::PrimitiveId,
    ];
    let pass = rendering(vec![attachment(&target, ClearValue::Float([-9.0; 4]))]);
    run(&single(), &pass, |device| {
        let values = [0.0f32, 1.0, 0.0].map(f32::to_bits);
        let stage = fragments(inputs.clone(), color(0, 0), false);
        let primitives = vec![over(corners, 0)];
        vec![draw(device, Some(stage), state(4), primitives, values.to_vec(), 1)]
    });
    let (mut covered, mut outside) = (0, 0);
    for at in 0..WIDTH * HEIGHT {
        let place = [at % WIDTH, at / WIDTH];
        let samples: Vec<[f32; 4]> =
            (0..4).map(|sample| WIDE.decode(&texel(&target, Aspect::Color, 0, sample, place))).collect();
        let mask: u32 = (0..4).filter(|&sample| samples[sample as usize][0] != -9.0).map(|sample| 1 << sample).sum();
        for found in samples.iter().filter(|found| found[0] != -9.0) {
            covered += 1;
            outside += u32::from(!(0.0..=1.0).contains(&found[1]));
            assert!((-1e-6..=1.000_001).contains(&found[0]), "{found:?}");
            assert_eq!(found[2].to_bits(), mask);
            assert_eq!(found[3].to_bits(), 7);
        }
    }
    assert!(covered > 30 && outside > 5, "{covered} {outside}");
}

#[gaurast_runner::test]
fn primitives_go_to_their_layer_and_samples_are_resolved() {
    let (target, resolved) = (image(Format::R8G8B8A8Unorm, 4, 2), image(Format::R8G8B8A8Unorm, 1, 2));
    let mut color_attachment = attachment(&target, ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    color_attachment.resolve = Some(AttachmentResolve { view: resolved.clone(), mode: ResolveMode::Average });
    let pass = Rendering { layer_count: 2, view_mask: 0, ..rendering(vec![color_attachment]) };
    let corners = [[0, 0], [9000, 100], [100, 9000]];
    run(&single(), &pass, |device| {
        let inputs = varyings(4, Interpolation::Flat, Sampling::Center);
        let stage = fragments(inputs, color(0, 0), false);
        let values = [1.0f32, 0.6, 0.2, 1.0].map(f32::to_bits).to_vec();
        vec![draw(device, Some(stage), state(4), vec![over(corners, 1)], values, 4)]
    });
    let mut partial = 0;
    for at in 0..WIDTH * HEIGHT {
        let place = [at % WIDTH, at / WIDTH];
        let empty = texel(&resolved, Aspect::Color, 0, 0, place);
        assert_eq!(empty, [0, 0, 0, 255], "layer 0 is as it was cleared");
        let covered =
            (0..4).filter(|&sample| texel(&target, Aspect::Color, 1, sample, place) == [255, 153, 51, 255]).count();
        let mean = covered as f32 / 4.0;
        let expected = Format::R8G8B8A8Unorm.encode([mean, mean * 0.6, mean * 0.2, 1.0]);
        assert_eq!(texel(&resolved, Aspect::Color, 1, 0, place), expected[..4]);
        partial += u32::from((1..4).contains(&covered));
    }
    assert!(partial > 20);
}

/// A program that adds 1 to a buffer's first word.
fn counting() -> FragmentPrograms {
    let mut b = Builder::new();
    let one = b.u32(1);
    let space = Space::Buffer(Binding { slot: 0, count: 1, index: None });
    let address = Address { space, base: None, offset: 0 };
    b.atomic(AtomicOp::IAdd, address, Element::B32, one, None);
    FragmentPrograms {
        program: b.finish().unwrap(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        early_tests: false,
        post_depth_coverage: false,
        discards: false,
        per_sample: false,
        has_side_effects: true,
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn a_pass_without_attachments_has_side_effects_of_what_is_covered(case: &Case) {
    let memory = Allocation::new_zeroed(64).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let primitives: Vec<_> = (0..50).map(|index| triangle(&mut rng, index)).collect();
    for config in configs(level_of(case)) {
        memory.fill(0, 64, 0).unwrap();
        let generation = memory.generation();
        let counters = run(&config, &rendering(Vec::new()), |device| {
            let stage = Some(counting());
            let mut draw = draw(device, stage, state(1), primitives.clone(), Vec::new(), 0);
            draw.bindings.buffers = vec![Some(BufferRange { memory: memory.clone(), offset: 0, size: 64 })];
            draw.bindings.written = vec![memory.clone()];
            vec![draw]
        });
        let mut word = [0u32];
        memory.read(0, &mut word).unwrap();
        assert!(word[0] > 1000);
        assert_eq!(u64::from(word[0]), counters.get(Counter::FragmentInvocations));
        assert_eq!(u64::from(word[0]), counters.get(Counter::SamplesPassed));
        assert_ne!(memory.generation(), generation);
    }
}

#[gaurast_runner::test]
fn a_program_that_does_not_end_is_stopped() {
    let mut b = Builder::new();
    b.begin_loop();
    b.end();
    let endless = FragmentPrograms { program: b.finish().unwrap(), has_side_effects: true, ..counting() };
    let config = Config { threads: 2, shader_timeout: Duration::from_millis(5), ..Config::default() };
    let device = Device::new(&config).unwrap();
    let mut pass = Pass::begin(&rendering(Vec::new())).unwrap();
    let mut counters = Counters::default();
    let primitives = vec![over(LARGE, 0)];
    let draw = draw(&device, Some(endless), state(1), primitives, Vec::new(), 0);
    pass.push(PassDraw::Primitives(Box::new(draw)), device.runtime(), &mut counters).unwrap();
    assert!(matches!(pass.end(device.runtime(), &mut counters), Err(Stopped::TimedOut { .. })));
}
