//! The accuracy contract: Gaussian draws through the driver, compared with the binary64 oracle, at every SIMD level,
//! with one worker thread and with two.

use std::sync::Arc;

use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianLinearizationGAURAST,
    GaussianOrderGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_runner::{Case, Need, data, simd_levels};
use gaurast_scene::Scene;
use gaurast_scene::camera::{Camera, DEFAULT_FOV};
use gaurast_testkit::for_levels::ForLevels;
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleState, Reference, render_bounded};
use gaurast_tests::scenes::{self, SceneBuffers};
use glam::DVec3;

use super::{PLAYBOT, SKULL};

/// A trained scene of the test data.
pub(crate) const PLANT: &str = "splats/plant.splat";

pub(crate) type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// Devices of a SIMD level: with one thread, and with two.
pub(crate) struct Devices<'a> {
    level: &'a str,
    gpus: [Gpu; 2],
}

impl<'a> Devices<'a> {
    pub(crate) fn new(level: &'a str) -> Self {
        let gpus = [1, 2].map(|threads| {
            Gpu::embedded(&Settings { simd: Some(level), threads: Some(threads), ..Settings::default() })
                .expect("a device")
        });
        Self { level, gpus }
    }

    /// Draws `scene` in `state` from each of `views` on both devices and judges the pictures. All levels share the
    /// oracle's pictures, which are identified by `name` and the view's name.
    pub(crate) fn judge(&self, name: &str, scene: &SceneBuffers, state: State, views: &[View]) {
        let [images, same] = self.gpus.each_ref().map(|gpu| draw(gpu, scene, state, views));
        for ((view, image), same) in views.iter().zip(images).zip(same) {
            let reference = reference(name, scene, state, view);
            let name = format!("{name}, {}, {}", view.name, self.level);
            assert!(image == same, "{name}: two threads give another picture");
            assert_contract(&name, &image, &reference, view.limits);
        }
    }
}

/// The oracle's picture.
fn reference(name: &str, scene: &SceneBuffers, state: State, view: &View) -> Arc<Reference> {
    static REFERENCES: ForLevels<Reference> = ForLevels::new();
    REFERENCES.get(&format!("{name}, {}", view.name), || {
        let camera = OracleCamera::new(&view.camera, view.size).expect("a model that it has");
        let reference = render_bounded(&scene.as_oracle(), &camera, &OracleState::from(&state));
        let nominal = reference.nominal.iter();
        let covered = nominal.filter(|rgba| rgba[3] > 0.1).count();
        let is_made_up = view.limits == Limits::ENVELOPE_ONLY;
        assert!(is_made_up || covered > reference.nominal.len() / 20, "{name}: hardly anything is seen");
        reference
    })
}

/// A view of a scene, and the limits by which its picture is judged.
pub(crate) struct View {
    pub(crate) name: String,
    pub(crate) camera: GaussianCameraGAURAST<'static>,
    pub(crate) size: [u32; 2],
    pub(crate) limits: Limits,
}

/// Pictures of `scene`.
pub(crate) fn draw(gpu: &Gpu, scene: &SceneBuffers, state: State, views: &[View]) -> Vec<Vec<[f32; 4]>> {
    let options = GaussianOptions {
        state,
        // The device draws at most degree 3 here, so the oracle gets no more.
        ..GaussianOptions::new(scene.degree)
    };
    let pipeline = GaussianPipeline::new(gpu, &options);
    let on_device = GaussianScene::new(gpu, scene);
    let draw = |view: &View| {
        let target = Target::floats(gpu, view.size);
        gpu.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                on_device.bind(commands, &pipeline, &view.camera);
                commands.draw(0..on_device.count);
            });
        });
        target.read()
    };
    let images = views.iter().map(draw).collect();
    assert_eq!(gpu.messages(), []);
    images
}

/// The states in which generated scenes are drawn.
pub(crate) fn states() -> [(&'static str, State); 4] {
    let default = State::default();
    [
        ("default", default),
        ("opacity-compensated", default.antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED)),
        ("lax floors", default.alpha_floor(1e-4).transmittance_floor(0.0)),
        (
            "strict floors",
            default.low_pass_variance(0.05).alpha_floor(0.05).alpha_ceiling(0.9).transmittance_floor(0.02),
        ),
    ]
}

/// The picture's size; odd, so that tiles are cut.
pub(crate) const SIZE: [u32; 2] = [211, 157];

/// The view of a generated scene.
pub(crate) fn generated_view(limits: Limits) -> View {
    let size = SIZE;
    View { name: "in front".to_owned(), camera: scenes::camera(size[0], size[1]).to_vulkan(), size, limits }
}

#[gaurast_runner::test(each = simd_levels())]
fn generated_scenes_keep_the_contract_in_every_state(case: &Case) {
    let devices = Devices::new(case.variant());
    for (seed, degree) in [(1, 0), (2, 1), (3, 2), (4, 3), (5, 4)] {
        let scene = scenes::cloud(seed, 3000, degree);
        for (name, state) in states() {
            let name = format!("cloud {seed} {name}");
            devices.judge(&name, &scene, state, &[generated_view(Limits::ENVELOPE_ONLY)]);
        }
    }
}

/// Views of a generated scene by cameras of the other models, one of them with Gaussians behind it.
fn other_cameras() -> Vec<View> {
    let size = [211, 157];
    let view = |name: &str, camera| View { name: name.to_owned(), camera, size, limits: Limits::ENVELOPE_ONLY };
    let pinhole = scenes::camera(size[0], size[1]).to_vulkan();
    let parallel = pinhole
        .model(GaussianCameraModelGAURAST::ORTHOGRAPHIC)
        .focal_length([31.0, 29.0])
        .depth_coefficients([0.0, 0.05]);
    let fisheye = pinhole.model(GaussianCameraModelGAURAST::FISHEYE);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let eye = [0.2, -0.1, 5.0];
    let panorama = GaussianCameraGAURAST::panorama(&axes, eye, [211.0, 157.0]).expect("a camera");
    vec![
        view("parallel", parallel),
        view("parallel, from its middle", parallel.eye([0.2, -0.1, 5.0]).near_plane(-4.0)),
        view("fisheye", fisheye.focal_length([120.0, 110.0])),
        view("fisheye, from its middle", fisheye.eye([0.2, -0.1, 5.0]).focal_length([32.0; 2])),
        view("panorama, from its middle", panorama),
        view(
            "panorama, a part, turned to a pole",
            panorama
                .rotation([1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0])
                .focal_length([60.0, 45.0])
                .principal_point([180.0, 70.0]),
        ),
        // The picture is more than three periods wide.
        view("panorama, many times around", panorama.focal_length([9.0, 40.0])),
    ]
}

#[gaurast_runner::test(each = simd_levels())]
fn every_camera_and_every_order_keep_the_contract(case: &Case) {
    let devices = Devices::new(case.variant());
    let scene = scenes::cloud(11, 3000, 2);
    let orders = [
        ("by view depth", GaussianOrderGAURAST::VIEW_DEPTH),
        ("by distance", GaussianOrderGAURAST::RADIAL_DISTANCE),
        ("as drawn", GaussianOrderGAURAST::PRIMITIVE),
        ("pixel by pixel", GaussianOrderGAURAST::PER_PIXEL),
    ];
    for (name, order) in orders {
        let mut views = other_cameras();
        views.push(generated_view(Limits::ENVELOPE_ONLY));
        devices.judge(&format!("cloud 11 {name}"), &scene, State::default().order(order), &views);
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn unscented_projection_keeps_the_contract_through_every_camera(case: &Case) {
    let devices = Devices::new(case.variant());
    let state = State::default().linearization(GaussianLinearizationGAURAST::UNSCENTED);
    let compensated = state.antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED);
    let mut scene = scenes::cloud(13, 2000, 1);
    // Large Gaussians show the difference.
    for scale in scene.scales.iter_mut().step_by(5) {
        *scale = scale.map(|s| 8.0 * s);
    }
    let mut views = other_cameras();
    views.push(generated_view(Limits::ENVELOPE_ONLY));
    for (name, state) in [("unscented", state), ("compensated", compensated)] {
        devices.judge(&format!("cloud 13 {name}"), &scene, state, &views);
    }
    for seed in 200..212 {
        let scene = scenes::awkward(seed, 20, (seed % 4) as u32);
        devices.judge(&format!("awkward {seed} unscented"), &scene, state, &views);
    }
}

#[gaurast_runner::test]
fn orders_give_different_pictures() {
    let gpu = Gpu::embedded(&Settings::default()).expect("a device");
    let scene = scenes::cloud(12, 3000, 0);
    let view = generated_view(Limits::ENVELOPE_ONLY);
    let picture = |order| {
        let mut drawn = draw(&gpu, &scene, State::default().order(order), std::slice::from_ref(&view));
        drawn.remove(0)
    };
    let by_depth = picture(GaussianOrderGAURAST::VIEW_DEPTH);
    assert!(by_depth != picture(GaussianOrderGAURAST::RADIAL_DISTANCE));
    assert!(by_depth != picture(GaussianOrderGAURAST::PRIMITIVE));
    let by_pixel = picture(GaussianOrderGAURAST::PER_PIXEL);
    assert!(by_depth != by_pixel && by_pixel != picture(GaussianOrderGAURAST::RADIAL_DISTANCE));
}

#[gaurast_runner::test(each = simd_levels())]
fn awkward_scenes_stay_within_the_envelope_in_every_state(case: &Case) {
    let devices = Devices::new(case.variant());
    // Few Gaussians per scene, because a huge opaque one hides the others.
    for seed in 100..160 {
        let scene = scenes::awkward(seed, 10 + 2 * (seed % 20) as usize, (seed % 4) as u32);
        for (name, state) in states() {
            let name = format!("awkward {seed} {name}");
            devices.judge(&name, &scene, state, &[generated_view(Limits::ENVELOPE_ONLY)]);
        }
    }
}

/// The views of trained scenes: the whole scene, a side of it from nearby, and the view from its middle.
pub(crate) fn views(scene: &Scene) -> Vec<View> {
    let (centre, radius) = bulk(scene);
    let look = |from: [f64; 3], to: [f64; 3], fov, size| {
        let [eye, target] = [from, to].map(|at| (centre + radius * DVec3::from(at)).into());
        Camera::look_at(eye, target, [0.0, -1.0, 0.0], fov, size).expect("a camera")
    };
    [[640, 480], [1920, 1080]]
        .into_iter()
        .flat_map(|size| {
            let cameras = [
                ("whole", gaurast_scene::frame_middle(scene, DEFAULT_FOV, size)),
                ("side", look([1.4, -0.5, 0.9], [0.0, 0.1, 0.1], 60.0, size)),
                ("inside", look([0.1, 0.0, 0.1], [-1.0, 0.2, 0.6], 75.0, size)),
            ];
            cameras.map(|(name, camera)| View {
                name: format!("{name}, {}x{}", size[0], size[1]),
                camera: camera.to_vulkan(),
                size,
                limits: Limits::CONTRACT,
            })
        })
        .collect()
}

/// The centre of a scene's opaque Gaussians, and the distance from it within which half of them are.
fn bulk(scene: &Scene) -> (DVec3, f64) {
    let opaque: Vec<DVec3> = scene
        .positions()
        .iter()
        .zip(scene.shapes())
        .filter(|(_, shape)| shape.opacity > 0.5)
        .map(|(position, _)| DVec3::from(position.map(f64::from)))
        .collect();
    let median = |mut values: Vec<f64>| {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let centre: [f64; 3] = std::array::from_fn(|axis| median(opaque.iter().map(|p| p[axis]).collect()));
    let centre = DVec3::from(centre);
    (centre, median(opaque.iter().map(|p| p.distance(centre)).collect()))
}

/// Judges the pictures of a scene file.
fn file_keeps_the_contract(case: &Case, name: &'static str) {
    let scene = gaurast_scene::open(data(name)).expect("a scene");
    let views = views(&scene);
    let scene = SceneBuffers::from(&scene);
    Devices::new(case.variant()).judge(name, &scene, State::default(), &views);
}

#[gaurast_runner::test(needs = [Need::Data(SKULL)], each = simd_levels())]
fn skull_keeps_the_contract(case: &Case) {
    file_keeps_the_contract(case, SKULL);
}

#[gaurast_runner::test(needs = [Need::Data(PLAYBOT)], each = simd_levels())]
fn playbot_keeps_the_contract(case: &Case) {
    file_keeps_the_contract(case, PLAYBOT);
}

#[gaurast_runner::test(needs = [Need::Data(PLANT)], each = simd_levels())]
fn plant_keeps_the_contract(case: &Case) {
    file_keeps_the_contract(case, PLANT);
}
