//! Random Gaussian draws in all modes: every SIMD level, with any number of threads, writes the bytes that SSE2 writes with one
//! thread, and counts the same.

use crate::common::{EVERYTHING, HEIGHT, OVER, WIDTH, attachment, bytes, multisampled, rendering};
use gaurast_runner::{Case, is_long, simd_levels};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simdevice::format::{Aspect, ClearValue};
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Rate, Type};
use simdevice::packet::*;
use simdevice::program::bindings::Bindings;
use simdevice::program::fragment::GaussianFragmentProgram;
use simdevice::program::interface::{
    FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling, resolve,
};
use simdevice::runtime::SimdLevel;
use simdevice::state::gaussian::{
    Camera, CameraModel, Distortion, DistortionModel, GaussianApproximation, GaussianCutOff, GaussianFootprint,
    GaussianGeometry, GaussianLinearization, GaussianOrder, GaussianPrecision, GaussianState, UnscentedTransform,
};
use simdevice::state::{BlendState, CompareOp, DepthStencil, DepthTest, Rect, StencilFace, StencilOp, Viewport};
use simdevice::stats::counters::{Counter, Unit};
use simdevice::{Allocation, BufferRange, CommandProcessor, Config, Device, Format, Packet};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The scenes that a level draws, and those that it draws with `GAURAST_TEST_LONG=1`.
const SCENES: [u64; 2] = [160, 20_000];

/// The result of a scene: the bytes of each attachment, and each counter of things.
struct Drawn {
    attachments: Vec<Vec<u8>>,
    counts: Vec<(Counter, u64)>,
}

/// A scene: the packets of its sets of Gaussians, and the pass that they are drawn in.
struct Scene {
    sets: Vec<Packet>,
    rendering: Rendering,
    /// A word for what is drawn, so that the test can tell that everything is.
    modes: Vec<String>,
}

#[gaurast_runner::test(each = simd_levels())]
fn every_level_and_every_number_of_threads_draws_the_same(case: &Case) {
    let level = SimdLevel::from_name(case.variant()).unwrap();
    let device = |simd, threads| Arc::new(Device::new(&Config { simd, threads, ..Config::default() }).unwrap());
    let simplest = device(SimdLevel::Baseline, 1);
    let others = [1, 2, 7].map(|threads| (threads, device(level, threads)));
    let (mut modes, mut empty) = (BTreeSet::new(), 0);
    let scenes = SCENES[usize::from(is_long())];
    for seed in 0..scenes {
        let (expected, of_scene) = draw(seed, &simplest);
        empty += u64::from(expected.counts.contains(&(Counter::PixelContributions, 0)));
        for (threads, device) in &others {
            let (drawn, _) = draw(seed, device);
            let name = format!("scene {seed} with {threads} threads: {of_scene:?}");
            for (drawn, expected) in drawn.counts.iter().zip(&expected.counts) {
                assert_eq!(drawn, expected, "{name}");
            }
            for (number, (drawn, expected)) in drawn.attachments.iter().zip(&expected.attachments).enumerate() {
                let at = drawn.iter().zip(expected).position(|(a, b)| a != b);
                assert_eq!(at, None, "byte of attachment {number} of {name}");
            }
        }
        modes.extend(of_scene);
    }
    assert!(empty < scenes / 4, "{empty} scenes are empty");
    // Every choice of every kind was taken.
    assert_eq!(modes.len(), MODES, "{modes:#?}");
}

/// Draws a scene twice on a device, since what is drawn again may be culled by clusters.
fn draw(seed: u64, device: &Arc<Device>) -> (Drawn, Vec<String>) {
    let scene = Scene::random(seed, device);
    let mut processor = CommandProcessor::new(Arc::clone(device));
    for _ in 0..2 {
        processor.execute(&Packet::BeginRendering(Box::new(scene.rendering.clone()))).unwrap();
        for packet in &scene.sets {
            processor.execute(packet).unwrap();
        }
        processor.execute(&Packet::EndRendering).unwrap();
    }
    let Rendering { color, depth, .. } = &scene.rendering;
    let attachments = color.iter().chain([depth]).flatten().map(|attachment| bytes(&attachment.view));
    let things = Counter::ALL.iter().filter(|counter| counter.info().unit == Unit::Count);
    let counts = things.map(|&counter| (counter, processor.counters().get(counter)));
    (Drawn { attachments: attachments.collect(), counts: counts.collect() }, scene.modes)
}

/// The number of words that a run's scenes have together.
const MODES: usize = 46;

impl Scene {
    fn random(seed: u64, device: &Device) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let views = *[1, 1, 2].choose(&mut rng).unwrap();
        let samples = *[1, 1, 1, 4].choose(&mut rng).unwrap();
        let color = multisampled(*COLORS.choose(&mut rng).unwrap(), samples, views, 0);
        let depth = DEPTHS.choose(&mut rng).unwrap().map(|format| multisampled(format, samples, views, 0));
        if let Some(depth) = &depth {
            let memory = &depth.image.memory;
            // Each is a depth in every format.
            let depths: Vec<f32> = (0..memory.len() / 4).map(|_| rng.random_range(0.3..1.0)).collect();
            memory.write(0, &depths).unwrap();
        }
        let format = depth.as_ref().map(|depth| depth.format);
        let state = state(&mut rng, format);
        let camera = camera(&mut rng, &state);
        let mut modes = vec![
            format!("{views} views"),
            format!("{samples} samples"),
            format!("{:?}", color.format),
            format!("depth {format:?}"),
            format!("{:?}", camera.model),
            format!("{:?}", state.order),
            format!("{:?}", state.geometry),
            format!("{:?}", state.precision),
            format!("{:?}", state.linearization),
            format!("{:?}", state.footprint.cut_off),
            format!("compensated: {}", state.opacity_compensated),
            format!("degree {}", state.sh_degree),
            format!("depth test: {}", state.depth_stencil.depth.is_some()),
        ];
        let stage = fragment_stage(&mut rng, device, &state, &mut modes);
        let mut further = camera;
        further.eye[0] += 0.25;
        let append = gaussians(&mut rng, state.sh_degree);
        modes.push(format!("instances: {}", append.instance_count > 1));
        let [width, height] = [WIDTH, HEIGHT].map(|size| size as f32);
        let begin = GaussianBegin {
            state: Arc::new(state),
            further_cameras: vec![further; views as usize - 1],
            camera,
            viewport: Viewport { x: 0.0, y: 0.0, width, height, min_depth: 0.0, max_depth: 1.0 },
            scissor: *[EVERYTHING, Rect { x: 7, y: 5, width: 100, height: 60 }].choose(&mut rng).unwrap(),
        };
        let mut sets = vec![Packet::GaussianBegin(Box::new(begin))];
        sets.extend(stage.map(|stage| Packet::GaussianFragmentStage(Box::new(stage))));
        sets.extend([Packet::GaussianAppend(Box::new(append)), Packet::GaussianEnd]);
        let clear = LoadOp::Clear(ClearValue::Float([0.1, 0.7, 0.3, 0.5]));
        let has_stencil = format.is_some_and(|format| format.plane(Aspect::Stencil).is_some());
        let rendering = Rendering {
            view_mask: if views > 1 { (1 << views) - 1 } else { 0 },
            depth: depth.as_ref().map(|depth| attachment(depth, LoadOp::Load)),
            stencil: depth.as_ref().filter(|_| has_stencil).map(|depth| attachment(depth, LoadOp::Load)),
            ..rendering(attachment(&color, clear))
        };
        Self { sets, rendering, modes }
    }
}

const COLORS: [Format; 5] = [
    Format::R8G8B8A8Unorm,
    Format::R8G8B8A8Srgb,
    Format::R16G16B16A16Unorm,
    Format::R16G16B16A16Sfloat,
    Format::R32G32B32A32Sfloat,
];

const DEPTHS: [Option<Format>; 5] = [
    None,
    Some(Format::D16Unorm),
    Some(Format::X8D24UnormPack32),
    Some(Format::D32Sfloat),
    Some(Format::D24UnormS8Uint),
];

/// A state that pipelines may have. Tests are those of a depth attachment of a format, if there is one.
fn state(rng: &mut ChaCha8Rng, depth: Option<Format>) -> GaussianState {
    use {GaussianCutOff as CutOff, GaussianOrder as Order};
    let geometry = *[GaussianGeometry::Volume, GaussianGeometry::Volume, GaussianGeometry::Surfel].choose(rng).unwrap();
    let order = *[Order::ViewDepth, Order::ViewDepth, Order::RadialDistance, Order::Primitive, Order::PerPixel]
        .choose(rng)
        .unwrap();
    let is_volume = geometry == GaussianGeometry::Volume;
    let is_half = is_volume && order != Order::PerPixel && rng.random_bool(0.2);
    let is_unscented = is_volume && rng.random_bool(0.3);
    let cut_off =
        *[CutOff::None, CutOff::None, CutOff::None, CutOff::Ellipse, CutOff::TileSquare, CutOff::TileRectangle]
            .choose(rng)
            .unwrap();
    let blend = *[OVER, BlendState { equations: None, write_mask: 0xF }].choose(rng).unwrap();
    GaussianState {
        sh_degree: rng.random_range(0..=4),
        linearization: if is_unscented { GaussianLinearization::Unscented } else { GaussianLinearization::Jacobian },
        unscented: if rng.random() { UnscentedTransform::default() } else { near_points(rng) },
        precision: if is_half { GaussianPrecision::Float16 } else { GaussianPrecision::Float32 },
        geometry,
        order,
        opacity_compensated: is_volume && rng.random_bool(0.4),
        low_pass_variance: *[0.3, 0.3, 0.0, 0.05, 1.0].choose(rng).unwrap(),
        alpha_floor: *[1.0 / 255.0, 1.0 / 255.0, 1e-4, 0.05, 0.0].choose(rng).unwrap(),
        alpha_ceiling: *[0.99, 0.99, 1.0, 0.9].choose(rng).unwrap(),
        transmittance_floor: *[1e-4, 1e-4, 0.0, 0.02].choose(rng).unwrap(),
        footprint: GaussianFootprint {
            cut_off,
            deviations: rng.random_range(1.0..4.0),
            compensation_floor: *[0.0, 0.000_025].choose(rng).unwrap(),
        },
        approximation: GaussianApproximation {
            exponential_error: *[0.0, 0.0, 1e-4, 2e-3].choose(rng).unwrap(),
            contribution_budget: *[0.0, 0.0, 0.01].choose(rng).unwrap(),
        },
        negative_one_to_one: rng.random_bool(0.2),
        sample_mask: *[u32::MAX, u32::MAX, 0b1101].choose(rng).unwrap(),
        depth_stencil: depth.map_or_else(DepthStencil::default, |format| tests(rng, format)),
        blend: vec![blend],
        ..GaussianState::default()
    }
}

/// The sigma points of an unscented transform that lie near the mean.
fn near_points(rng: &mut ChaCha8Rng) -> UnscentedTransform {
    UnscentedTransform {
        alpha: rng.random_range(0.1..1.5),
        beta: rng.random_range(0.0..2.0),
        kappa: rng.random_range(-1.0..1.0),
        picture_margin: *[f32::INFINITY, 0.0, 0.1].choose(rng).unwrap(),
        needs_all: rng.random_bool(0.2),
    }
}

/// The tests of a depth attachment of a format.
fn tests(rng: &mut ChaCha8Rng, format: Format) -> DepthStencil {
    let compare =
        *[CompareOp::Less, CompareOp::LessOrEqual, CompareOp::Greater, CompareOp::NotEqual, CompareOp::Always]
            .choose(rng)
            .unwrap();
    let depth = rng.random_bool(0.8).then(|| DepthTest { compare, write: rng.random_bool(0.7) });
    let face = StencilFace {
        fail: StencilOp::IncrementAndWrap,
        pass: StencilOp::Replace,
        depth_fail: StencilOp::Invert,
        compare: CompareOp::NotEqual,
        compare_mask: 3,
        write_mask: 0xFF,
        reference: 2,
    };
    DepthStencil {
        depth,
        bounds: rng.random_bool(0.2).then_some((0.4, 0.9)),
        stencil: (format.plane(Aspect::Stencil).is_some() && rng.random_bool(0.7)).then_some([face; 2]),
    }
}

/// A lens that distorts a little, and may fold in the picture.
fn lens(rng: &mut ChaCha8Rng) -> Distortion {
    let models = [
        DistortionModel::Rational,
        DistortionModel::Polynomial,
        DistortionModel::PolynomialFirst,
        DistortionModel::FieldOfView,
        DistortionModel::Division,
    ];
    let model = *models.choose(rng).unwrap();
    let first = rng.random_range(0.05..0.6);
    let mut few = |size: f32| rng.random_range(-size..size);
    match model {
        DistortionModel::FieldOfView | DistortionModel::Division => {
            Distortion { model, radial: [first, 0.0, 0.0, 0.0, 0.0, 0.0], tangential: [0.0; 2], thin_prism: [0.0; 4] }
        }
        _ => Distortion {
            model,
            radial: [few(0.3), few(0.1), few(0.02), few(0.1), few(0.02), 0.0],
            tangential: [few(0.01), few(0.01)],
            thin_prism: [few(0.01), few(0.01), few(0.01), few(0.01)],
        },
    }
}

/// A camera among the Gaussians.
fn camera(rng: &mut ChaCha8Rng, state: &GaussianState) -> Camera {
    let is_flat = state.geometry == GaussianGeometry::Surfel;
    let models = [CameraModel::Pinhole, CameraModel::Orthographic, CameraModel::Fisheye, CameraModel::Equirectangular];
    let model = *models[..if is_flat { 2 } else { 4 }].choose(rng).unwrap();
    let focal = match model {
        CameraModel::Pinhole => 120.0,
        CameraModel::Orthographic => 25.0,
        CameraModel::Fisheye => 50.0,
        CameraModel::Equirectangular => WIDTH as f32 / std::f32::consts::TAU,
    };
    // The rotation of a quaternion, rounded.
    let [w, x, y, z] = [1.0, rng.random_range(-0.3..0.3f32), rng.random_range(-0.3..0.3), rng.random_range(-0.3..0.3)];
    let s = 2.0 / (w * w + x * x + y * y + z * z);
    let is_parallel = model == CameraModel::Orthographic;
    let may_distort = matches!(model, CameraModel::Pinhole | CameraModel::Fisheye)
        && !is_flat
        && state.order != GaussianOrder::PerPixel;
    let distortion = (may_distort && rng.random()).then(|| lens(rng));
    Camera {
        model,
        rotation: [
            1.0 - s * (y * y + z * z),
            s * (x * y - w * z),
            s * (x * z + w * y),
            s * (x * y + w * z),
            1.0 - s * (x * x + z * z),
            s * (y * z - w * x),
            s * (x * z - w * y),
            s * (y * z + w * x),
            1.0 - s * (x * x + y * y),
        ],
        eye: [0; 3].map(|_| rng.random_range(-0.5..0.5)),
        focal_length: [focal, focal * rng.random_range(0.8..1.2)],
        principal_point: [WIDTH, HEIGHT].map(|size| size as f32 * rng.random_range(0.4..0.6)),
        near_plane: if is_parallel { -1.0 } else { 0.2 },
        far_plane: *[f32::INFINITY, 7.0].choose(rng).unwrap(),
        depth_coefficients: if is_parallel { [0.1, 0.1] } else { [1.02, -0.2] },
        distortion,
    }
}

/// A program that replaces a set's colours, or none.
fn fragment_stage(
    rng: &mut ChaCha8Rng,
    device: &Device,
    state: &GaussianState,
    modes: &mut Vec<String>,
) -> Option<GaussianFragmentStage> {
    // Depth variables and indices are tracked in the order of the list, in binary32 or binary64.
    let is_tracked = state.order != GaussianOrder::PerPixel && state.precision == GaussianPrecision::Float32;
    let firsts = [resolve::ACCUMULATED, resolve::EXPECTED_DEPTH, resolve::MEDIAN_GAUSSIAN];
    let first = *firsts[..if is_tracked { 3 } else { 1 }].choose(rng).unwrap();
    if rng.random_bool(0.6) {
        return None;
    }
    modes.push(format!("program of inputs from {first}"));
    let mut b = Builder::new();
    for slot in 0..4 {
        let input = b.input(slot, Type::B32, Rate::Varying);
        let output = b.output(slot, Type::B32);
        b.assign(output, input);
    }
    let input = |number| FragmentInput::Varying {
        index: first + number,
        interpolation: Interpolation::Flat,
        sampling: Sampling::Center,
    };
    let programs = FragmentPrograms {
        program: b.finish().unwrap(),
        inputs: (0..4).map(|number| Some(input(number))).collect(),
        outputs: (0..4).map(|component| Some(FragmentOutput::Color { attachment: 0, component, index: 0 })).collect(),
        early_tests: false,
        post_depth_coverage: false,
        discards: false,
        per_sample: false,
        has_side_effects: false,
    };
    Some(GaussianFragmentStage {
        program: Arc::new(GaussianFragmentProgram::new(device.level(), &programs).unwrap()),
        bindings: Bindings::default(),
        sample_shading: false,
        alpha_to_coverage: false,
        alpha_to_one: false,
    })
}

/// Gaussians about the camera. A few have attributes that are not finite, out of range or extreme.
fn gaussians(rng: &mut ChaCha8Rng, degree: u32) -> GaussianAppend {
    let coefficients = (degree + 1) * (degree + 1);
    let stride = 4 * (11 + 3 * coefficients);
    let count = rng.random_range(20..700);
    let activations =
        Activations { log_scale: rng.random_bool(0.3), logit_opacity: rng.random_bool(0.3), ..Activations::default() };
    let size_of_all = *[0.3, 1.0, 3.0f32].choose(rng).unwrap();
    let mut floats: Vec<f32> = Vec::new();
    for _ in 0..count {
        let z: f32 = if rng.random_bool(0.8) { rng.random_range(0.1..8.0) } else { rng.random_range(-8.0..0.1) };
        let mut position = [rng.random_range(-0.8..0.8) * z, rng.random_range(-0.6..0.6) * z, z];
        let size = size_of_all * 10.0f32.powf(rng.random_range(-3.0..-0.3));
        let mut scale = [size, size * rng.random_range(0.01..1.0), size * rng.random_range(0.01..1.0)];
        let mut rotation = [0; 4].map(|_| rng.random_range(-1.0..1.0f32));
        let mut opacity = rng.random_range(0.0..1.1f32);
        match rng.random_range(0..60) {
            0 => position[rng.random_range(0..3)] = *[f32::NAN, f32::INFINITY, 1e30, -1e6].choose(rng).unwrap(),
            1 => scale[rng.random_range(0..3)] = *[0.0, 1e-30, 1e4, -1.0, f32::NAN].choose(rng).unwrap(),
            2 => rotation = *[[0.0; 4], [1e-40, 0.0, 0.0, 0.0], [1e30; 4]].choose(rng).unwrap(),
            3 => opacity = *[100.0, 1e20, f32::NAN, -1.0].choose(rng).unwrap(),
            4 => position = position.map(|x| 1e3 * x),
            5 => scale = [3.0 * size, 1e-4 * size, 1e-5 * size],
            _ => {}
        }
        if activations.log_scale {
            scale = scale.map(f32::ln);
        }
        if activations.logit_opacity {
            opacity = (opacity / (1.001 - opacity)).ln();
        }
        floats.extend(position.iter().chain(&scale).chain(&rotation));
        floats.push(opacity);
        floats.extend((0..3 * coefficients).map(|_| rng.random_range(-1.0..1.5f32)));
    }
    let vertices = memory(&floats, rng.random_bool(0.5));
    let stream = |offset: u32, format| AttributeStream {
        buffer: vertices.clone(),
        stride,
        offset: 4 * offset,
        format,
        instance_divisor: None,
    };
    let (model, instance_count) =
        if rng.random_bool(0.25) { (models(rng), 2) } else { (ModelAttributes::default(), 1) };
    GaussianAppend {
        attributes: GaussianAttributes {
            position: stream(0, Format::R32G32B32Sfloat),
            scale: stream(3, Format::R32G32B32Sfloat),
            rotation: stream(6, Format::R32G32B32A32Sfloat),
            opacity: stream(10, Format::R32Sfloat),
            model,
            activations,
            tables: None,
            spherical_harmonics: (0..coefficients).map(|k| stream(11 + 3 * k, Format::R32G32B32Sfloat)).collect(),
        },
        indices: None,
        first: 0,
        count,
        first_instance: 0,
        instance_count,
    }
}

/// The matrices and factors of two instances.
fn models(rng: &mut ChaCha8Rng) -> ModelAttributes {
    let mut rows = [[0.0f32; 4]; 8];
    for instance in rows.as_chunks_mut::<4>().0 {
        for (number, row) in instance.iter_mut().enumerate() {
            *row = [0; 4].map(|_| rng.random_range(-0.3..0.3));
            row[number] += 0.8;
        }
    }
    let buffer = memory(rows.as_flattened(), false);
    let stream = |row: u32| AttributeStream {
        buffer: buffer.clone(),
        stride: 64,
        offset: 16 * row,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: Some(1),
    };
    let opacity = AttributeStream { format: Format::R32Sfloat, offset: 60, ..stream(3) };
    ModelAttributes { matrix: Some(Box::new([stream(0), stream(1), stream(2)])), opacity: Some(opacity) }
}

/// Memory with these floats, which the host may map or not.
fn memory(floats: &[f32], host_visible: bool) -> BufferRange {
    let size = size_of_val(floats) as u64;
    let memory = Allocation::new(size, host_visible).unwrap();
    memory.write(0, floats).unwrap();
    BufferRange { memory, offset: 0, size }
}
