//! Depth and stencil tests and multisampling of Gaussian draws, against the binary64 oracle.
//!
//! Triangles are drawn first. Their depths and stencils are read back and given to the oracle, and the oracle's picture
//! of the Gaussians is blended over the colours.

use ash::ext::{depth_clip_control, extended_dynamic_state3};
use ash::vk;
use gaurast::vk::{GaussianCameraGAURAST, GaussianOrderGAURAST};
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Attachments, GaussianOptions, GaussianPipeline, GaussianScene, Settings, over};
use gaurast_testkit::{
    Buffer, Commands, Gpu, Output, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex, depth_test,
};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::hybrid::{Held, depth_format, held};
use gaurast_tests::oracle::{OracleCamera, OracleStencil, OracleTests, TestedReference, render_tested};
use gaurast_tests::scenes::{self, SceneBuffers};

/// The picture's size; odd, so that tiles are cut.
const SIZE: [u32; 2] = [107, 83];

/// The near and the far plane of the depth buffer.
const PLANES: [f32; 2] = [1.0, 16.0];

const COMPARES: [vk::CompareOp; 8] = [
    vk::CompareOp::NEVER,
    vk::CompareOp::LESS,
    vk::CompareOp::EQUAL,
    vk::CompareOp::LESS_OR_EQUAL,
    vk::CompareOp::GREATER,
    vk::CompareOp::NOT_EQUAL,
    vk::CompareOp::GREATER_OR_EQUAL,
    vk::CompareOp::ALWAYS,
];

const FORMATS: [vk::Format; 5] = [
    vk::Format::D16_UNORM,
    vk::Format::X8_D24_UNORM_PACK32,
    vk::Format::D32_SFLOAT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::D32_SFLOAT_S8_UINT,
];

/// Depth coefficients that map the near plane to 0 and the far plane to 1, or the reverse.
fn coefficients(reverse: bool) -> [f32; 2] {
    let [near, far] = PLANES;
    if reverse {
        [-near / (far - near), near * far / (far - near)]
    } else {
        [far / (far - near), -near * far / (far - near)]
    }
}

fn camera(reverse: bool) -> GaussianCameraGAURAST<'static> {
    scenes::camera(SIZE[0], SIZE[1]).to_vulkan().depth_coefficients(coefficients(reverse))
}

/// A cloud in which many Gaussians are at the same depths.
fn layered_cloud(seed: u64, count: usize) -> SceneBuffers {
    let mut scene = scenes::cloud(seed, count, 1);
    for position in &mut scene.positions {
        let z = (2.0 * position[2]).round() / 2.0;
        *position = [position[0] * z / position[2], position[1] * z / position[2], z];
    }
    for scale in &mut scene.scales {
        *scale = scale.map(|s| 4.0 * s);
    }
    scene
}

/// A target of floats.
fn target(depth: vk::Format, samples: u32) -> TargetOptions {
    TargetOptions {
        size: SIZE,
        colors: vec![vk::Format::R32G32B32A32_SFLOAT],
        depth: Some(depth),
        samples,
        resolve: false,
    }
}

/// Triangles all over the target, at depths among those of the Gaussians; one is slanted.
fn triangles(reverse: bool) -> Vec<Vertex> {
    let [c0, c1] = coefficients(reverse).map(f64::from);
    let depth = |z: f64| (c0 + c1 / z) as f32;
    let corner = |[x, y]: [f32; 2], z: f64, shade: f32| Vertex {
        position: [x, y, depth(z), 1.0],
        color: [shade, 0.5 * shade, 1.0 - shade, 1.0],
    };
    let flat = |points: [[f32; 2]; 3], z: f64, shade: f32| points.map(|point| corner(point, z, shade));
    let mut all = Vec::new();
    all.extend(flat([[-1.1, -0.9], [0.1, -0.8], [-0.7, 0.7]], 4.0, 0.2));
    all.extend(flat([[-0.2, -0.95], [0.9, -0.9], [0.3, 0.2]], 6.5, 0.5));
    all.extend(flat([[-0.9, 0.95], [0.2, 0.9], [-0.3, 0.1]], 2.5, 0.8));
    all.extend([corner([0.0, 0.9], 2.2, 0.9), corner([0.95, 0.8], 7.0, 0.1), corner([0.7, -0.2], 11.0, 0.4)]);
    all
}

/// A draw and its tests.
struct Case {
    name: String,
    target: TargetOptions,
    reverse: bool,
    /// True if the state is set by a command, not by the pipeline, where depths before the viewport are from -1 to 1.
    sets_depths: bool,
    /// The viewport's depths of 0 and 1.
    range: [f32; 2],
    options: GaussianOptions<'static>,
}

impl Case {
    fn new(name: String, depth: vk::Format, samples: u32) -> Self {
        Self {
            name,
            target: target(depth, samples),
            reverse: false,
            sets_depths: false,
            range: [0.0, 1.0],
            options: GaussianOptions { blend: vec![over()], ..GaussianOptions::new(0) },
        }
    }

    /// The camera, whose depths before the viewport are from 0 or -1 to 1.
    fn camera(&self) -> GaussianCameraGAURAST<'static> {
        let [c0, c1] = coefficients(self.reverse);
        let camera = camera(self.reverse);
        if self.options.negative_one_to_one { camera.depth_coefficients([2.0 * c0 - 1.0, 2.0 * c1]) } else { camera }
    }

    fn tests(&self) -> OracleTests {
        let state = &self.options.depth_stencil;
        OracleTests {
            depth_coefficients: self.camera().depth_coefficients,
            negative_one_to_one: self.options.negative_one_to_one,
            depth_range: self.range,
            format: depth_format(&self.target),
            depth: (state.depth_test_enable != vk::FALSE)
                .then_some((state.depth_compare_op, state.depth_write_enable != vk::FALSE)),
            bounds: (state.depth_bounds_test_enable != vk::FALSE)
                .then_some([state.min_depth_bounds, state.max_depth_bounds]),
            stencil: (state.stencil_test_enable != vk::FALSE).then_some(OracleStencil { state: state.front }),
        }
    }

    /// Draws the triangles, then the Gaussians if there is a scene.
    fn draw(&self, gpu: &Gpu, scene: Option<&SceneBuffers>) -> Output {
        let target = Target::new(gpu, &self.target);
        let corners = triangles(self.reverse);
        let vertices = Buffer::of(gpu, &corners);
        // Each triangle writes its number as stencil.
        let stencil = vk::StencilOpState {
            pass_op: vk::StencilOp::REPLACE,
            compare_op: vk::CompareOp::ALWAYS,
            compare_mask: 255,
            write_mask: 255,
            ..vk::StencilOpState::default()
        };
        let pipeline = Pipeline::new(
            gpu,
            &target,
            &PipelineOptions {
                depth_stencil: depth_test(vk::CompareOp::ALWAYS).stencil_test_enable(true).front(stencil).back(stencil),
                dynamic: vec![vk::DynamicState::STENCIL_REFERENCE],
                ..PipelineOptions::default()
            },
        );
        let gaussians = scene.map(|scene| {
            let options = GaussianOptions {
                stored_degree: scene.degree,
                drawn_degree: scene.degree,
                formats: target.attachment_formats(),
                negative_one_to_one: self.options.negative_one_to_one != self.sets_depths,
                ..self.options.clone()
            };
            let pipeline = GaussianPipeline::new(gpu, &options);
            (pipeline, GaussianScene::new(gpu, scene))
        });
        let pass = Pass {
            depth: vk::ClearDepthStencilValue { depth: if self.reverse { 0.0 } else { 1.0 }, stencil: 7 },
            ..Pass::default()
        };
        target.draw(gpu, &pass, |commands: &Commands| {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            for triangle in 0..corners.len() as u32 / 3 {
                commands.stencil_reference(triangle);
                commands.draw(3 * triangle..3 * triangle + 3);
            }
            if let Some((pipeline, scene)) = &gaussians {
                let size = SIZE.map(|side| side as f32);
                commands.viewport([0.0, 0.0, size[0], size[1]], self.range);
                if self.sets_depths {
                    let states = extended_dynamic_state3::Device::new(gpu.instance(), gpu.device());
                    let set = self.options.negative_one_to_one;
                    // SAFETY: the command buffer records, and its device has the extension.
                    unsafe { states.cmd_set_depth_clip_negative_one_to_one(commands.raw, set) };
                }
                scene.draw(commands, pipeline, &self.camera());
            }
        })
    }

    /// Draws the case and compares it with the oracle; returns the number of samples that have a fragment.
    fn judge(&self, gpu: &Gpu, scene: &SceneBuffers) -> usize {
        let before = held(&self.target, &self.draw(gpu, None));
        let after = held(&self.target, &self.draw(gpu, Some(scene)));
        let oracle = OracleCamera::new(&self.camera(), SIZE).expect("a pinhole");
        let state = (&self.options.state).into();
        let mut fragments = 0;
        for (sample, (before, after)) in before.iter().zip(&after).enumerate() {
            let name = format!("{}, sample {sample}", self.name);
            if self.options.sample_mask >> sample & 1 == 0 {
                assert!(before.color == after.color, "{name}: a masked sample changed");
                assert_eq!(before.stored, after.stored, "{name}");
                continue;
            }
            let tests = self.tests();
            let reference = render_tested(&scene.as_oracle(), &oracle, &state, &tests, &before.stored);
            judge_sample(&name, &reference, before, after);
            fragments += reference.fragments[0];
        }
        fragments
    }
}

/// Compares the stored values of one sample of each pixel with the oracle.
fn judge_sample(name: &str, reference: &TestedReference, before: &Held, after: &Held) {
    let behind: Vec<_> = before.color.iter().map(|c| c.map(f64::from)).collect();
    let composite = reference.color.over(&behind);
    assert_contract(name, &after.color, &composite, Limits::ENVELOPE_ONLY);
    let mut unknown = 0;
    for (at, &depth) in after.stored.depth.iter().enumerate() {
        match &reference.depth[at] {
            Some(allowed) => {
                assert!(
                    allowed.iter().any(|codes| codes.contains(depth)),
                    "{name}: pixel {at} stores depth {depth:#x}, not one of {allowed:x?}"
                );
            }
            None => unknown += 1,
        }
    }
    assert!(unknown * 1000 < reference.depth.len(), "{name}: {unknown} depths unknown");
    for (at, stencil) in after.stored.stencil.iter().enumerate() {
        let allowed = &reference.stencil[at];
        assert!(allowed.contains(stencil), "{name}: pixel {at} stores {stencil}, not {allowed:?}");
    }
}

fn gpu() -> Gpu {
    Gpu::embedded(&Settings::default()).expect("a device")
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn every_comparison_works_in_every_format_both_ways() {
    let (gpu, scene) = (gpu(), layered_cloud(1, 1500));
    let mut drawn = 0;
    for format in FORMATS {
        for (op, reverse) in COMPARES.into_iter().flat_map(|op| [(op, false), (op, true)]) {
            let mut case = Case::new(format!("{op:?} {format:?} reverse {reverse}"), format, 1);
            case.reverse = reverse;
            case.options.depth_stencil = depth_test(op);
            let fragments = case.judge(&gpu, &scene);
            drawn += usize::from(fragments > 0);
            assert_eq!(fragments == 0, op == vk::CompareOp::NEVER, "{}", case.name);
        }
    }
    assert_eq!(drawn, FORMATS.len() * 14);
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn samples_are_tested_one_by_one() {
    let (gpu, scene) = (gpu(), layered_cloud(2, 1500));
    for (format, op, write, mask) in [
        (vk::Format::D32_SFLOAT, vk::CompareOp::LESS, true, u32::MAX),
        (vk::Format::D32_SFLOAT, vk::CompareOp::LESS, false, 0b1010),
        (vk::Format::D16_UNORM, vk::CompareOp::GREATER, true, u32::MAX),
        (vk::Format::D16_UNORM, vk::CompareOp::EQUAL, true, u32::MAX),
        (vk::Format::D24_UNORM_S8_UINT, vk::CompareOp::NOT_EQUAL, true, 0b0111),
        (vk::Format::X8_D24_UNORM_PACK32, vk::CompareOp::LESS_OR_EQUAL, true, u32::MAX),
    ] {
        let name = format!("4 samples {op:?} {format:?} mask {mask:x}");
        let mut case = Case::new(name, format, 4);
        case.options.depth_stencil = depth_test(op).depth_write_enable(write);
        case.options.sample_mask = mask;
        case.judge(&gpu, &scene);
    }
    // Without tests all samples get the same values.
    let case = Case::new("4 samples untested".to_owned(), vk::Format::D32_SFLOAT, 4);
    case.judge(&gpu, &scene);
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn depth_ranges_bounds_and_orders_apply() {
    let (gpu, scene) = (gpu(), layered_cloud(3, 1500));
    let less = depth_test(vk::CompareOp::LESS);
    let mut case = Case::new("a range".to_owned(), vk::Format::D32_SFLOAT, 1);
    case.range = [0.25, 0.875];
    case.options.depth_stencil = less;
    case.judge(&gpu, &scene);
    case.name = "a reversed range".to_owned();
    case.range = [1.0, 0.5];
    case.judge(&gpu, &scene);
    let mut case = Case::new("bounds".to_owned(), vk::Format::D32_SFLOAT, 1);
    let bounds = less.depth_bounds_test_enable(true).min_depth_bounds(0.2).max_depth_bounds(0.81);
    case.options.depth_stencil = bounds;
    case.judge(&gpu, &scene);
    case.name = "bounds alone".to_owned();
    case.options.depth_stencil = bounds.depth_test_enable(false);
    case.judge(&gpu, &scene);
    for order in
        [GaussianOrderGAURAST::RADIAL_DISTANCE, GaussianOrderGAURAST::PRIMITIVE, GaussianOrderGAURAST::PER_PIXEL]
    {
        let mut case = Case::new(format!("{order:?}"), vk::Format::D32_SFLOAT, 1);
        case.options.depth_stencil = less;
        case.options.state = case.options.state.order(order);
        case.judge(&gpu, &scene);
    }
}

/// Depths before the viewport are from -1 where the pipeline or a command says so.
#[gaurast_runner::test(needs = [GLSLANG])]
fn depths_may_begin_at_minus_one() {
    let mut states = vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT::default()
        .extended_dynamic_state3_depth_clip_negative_one_to_one(true);
    let mut control = vk::PhysicalDeviceDepthClipControlFeaturesEXT::default().depth_clip_control(true);
    control.p_next = (&raw mut states).cast();
    let extensions = [depth_clip_control::NAME, extended_dynamic_state3::NAME];
    let gpu = Gpu::extended(&extensions, &mut control).expect("a device");
    let scene = layered_cloud(5, 1500);
    for (format, reverse, range, sets_depths) in [
        (vk::Format::D32_SFLOAT, false, [0.0, 1.0], false),
        (vk::Format::D32_SFLOAT, true, [0.25, 0.875], true),
        (vk::Format::D16_UNORM, false, [1.0, 0.5], true),
    ] {
        let mut case = Case::new(format!("from -1, {format:?}"), format, 1);
        case.reverse = reverse;
        case.range = range;
        case.sets_depths = sets_depths;
        case.options.negative_one_to_one = true;
        case.options.depth_stencil = depth_test(match reverse {
            false => vk::CompareOp::LESS,
            true => vk::CompareOp::GREATER,
        });
        if sets_depths {
            let state = vk::DynamicState::DEPTH_CLIP_NEGATIVE_ONE_TO_ONE_EXT;
            case.options.dynamic.push(state);
        }
        assert!(case.judge(&gpu, &scene) > 0, "{}", case.name);
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn stencil_is_tested_first_and_written_last() {
    use vk::StencilOp as Op;
    let (gpu, scene) = (gpu(), layered_cloud(4, 1500));
    let all = [
        Op::KEEP,
        Op::ZERO,
        Op::REPLACE,
        Op::INCREMENT_AND_CLAMP,
        Op::DECREMENT_AND_CLAMP,
        Op::INVERT,
        Op::INCREMENT_AND_WRAP,
        Op::DECREMENT_AND_WRAP,
    ];
    for (index, compare) in COMPARES.into_iter().enumerate() {
        let face = vk::StencilOpState {
            fail_op: all[(index + 1) % 8],
            pass_op: all[(index + 3) % 8],
            depth_fail_op: all[(index + 6) % 8],
            compare_op: compare,
            compare_mask: 3,
            write_mask: [255, 0x0E][index % 2],
            reference: 1,
        };
        let format = [vk::Format::D24_UNORM_S8_UINT, vk::Format::D32_SFLOAT_S8_UINT][index % 2];
        let mut case = Case::new(format!("stencil {compare:?}"), format, 1);
        case.options.depth_stencil = depth_test(vk::CompareOp::LESS).stencil_test_enable(true).front(face);
        case.judge(&gpu, &scene);
        case.name = format!("stencil {compare:?} without depth");
        case.options.depth_stencil = case.options.depth_stencil.depth_test_enable(false);
        case.judge(&gpu, &scene);
    }
}
