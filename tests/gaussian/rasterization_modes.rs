//! The per-pixel order and 2D Gaussians against the binary64 oracle, at every SIMD level, with one worker thread and
//! with two.

use gaurast::vk::{
    GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianGeometryGAURAST, GaussianOrderGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_runner::{Case, simd_levels};
use gaurast_tests::compare::Limits;
use gaurast_tests::scenes;

use super::accuracy::{Devices, SIZE, View, generated_view};

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

fn flat() -> State {
    State::default().geometry(GaussianGeometryGAURAST::GAUSSIAN_2D).low_pass_variance(0.5)
}

/// The named states of each mode.
fn states() -> Vec<(&'static str, State)> {
    let lax = |state: State| state.alpha_floor(1e-4).transmittance_floor(0.0);
    let per_pixel = State::default().order(GaussianOrderGAURAST::PER_PIXEL);
    vec![
        ("per pixel", per_pixel),
        ("per pixel, lax floors", lax(per_pixel)),
        ("flat", flat()),
        ("flat, lax floors", lax(flat())),
        ("flat, no filter", flat().low_pass_variance(0.0)),
        ("flat, per pixel", flat().order(GaussianOrderGAURAST::PER_PIXEL)),
    ]
}

fn view(name: &str, camera: GaussianCameraGAURAST<'static>) -> View {
    View { name: name.to_owned(), camera, size: SIZE, limits: Limits::ENVELOPE_ONLY }
}

#[gaurast_runner::test(each = simd_levels())]
fn modes_keep_the_contract(case: &Case) {
    let devices = Devices::new(case.variant());
    let pinhole = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
    let parallel = pinhole
        .model(GaussianCameraModelGAURAST::ORTHOGRAPHIC)
        .focal_length([31.0, 29.0])
        .eye([0.2, -0.1, 5.0])
        .near_plane(-4.0);
    let views = [
        generated_view(Limits::ENVELOPE_ONLY),
        view("parallel", parallel),
        view("in its middle", pinhole.eye([0.2, -0.1, 5.0])),
    ];
    let mut scene = scenes::cloud(31, 2000, 1);
    for scale in scene.scales.as_flattened_mut() {
        *scale *= 3.0;
    }
    for (name, state) in states() {
        devices.judge(&format!("cloud 31 {name}"), &scene, state, &views);
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn awkward_scenes_stay_within_the_envelope(case: &Case) {
    let devices = Devices::new(case.variant());
    for seed in 200..215 {
        let scene = scenes::awkward(seed, 10 + 2 * (seed % 20) as usize, (seed % 2) as u32);
        for (name, state) in states() {
            let name = format!("awkward {seed} {name}");
            let views = [generated_view(Limits::ENVELOPE_ONLY)];
            devices.judge(&name, &scene, state, &views);
        }
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn ten_thousand_layers_on_a_pixel_are_sorted(case: &Case) {
    // Faint Gaussians in no particular order, so that no pixel is finished early.
    let mut scene = scenes::cloud(32, 10_000, 0);
    for (index, position) in scene.positions.iter_mut().enumerate() {
        let z = 2.0 + (index * 7919 % 10_000) as f32 * 1e-3;
        *position = [0.01 * z, -0.02 * z, z];
    }
    scene.scales.fill([0.05, 0.04, 0.01]);
    scene.opacities.fill(0.02);
    let state = State::default().order(GaussianOrderGAURAST::PER_PIXEL).transmittance_floor(0.0);
    let view = generated_view(Limits::ENVELOPE_ONLY);
    Devices::new(case.variant()).judge("10,000 layers", &scene, state, &[view]);
}
