//! Panoramas: the seam has no effect on the picture.

use gaurast::vk::{GaussianCameraGAURAST, PipelineGaussianStateCreateInfoGAURAST};
use gaurast_runner::{Case, simd_levels};
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::{self, SceneBuffers};

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// The picture's size; a quarter of a turn is a whole number of pixels.
const SIZE: [u32; 2] = [208, 104];

fn draw(
    gpu: &Gpu,
    scene: &SceneBuffers,
    state: State,
    camera: &GaussianCameraGAURAST,
    size: [u32; 2],
) -> Vec<[f32; 4]> {
    let options = GaussianOptions { state, ..GaussianOptions::new(scene.degree) };
    let pipeline = GaussianPipeline::new(gpu, &options);
    let on_device = GaussianScene::new(gpu, scene);
    let target = Target::floats(gpu, size);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            on_device.bind(commands, &pipeline, camera);
            commands.draw(0..on_device.count);
        });
    });
    assert_eq!(gpu.messages(), []);
    target.read()
}

/// A panorama from the middle of a cloud, rotated to the right by quarter turns.
fn panorama(quarters: usize) -> GaussianCameraGAURAST<'static> {
    let (sin, cos) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][quarters];
    // The rows of the matrix from camera to world. Its columns are right, down and forward.
    let axes = [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]];
    let size = SIZE.map(|side| side as f32);
    GaussianCameraGAURAST::panorama(&axes, [0.2, -0.1, 5.0], size).expect("a camera")
}

/// The greatest difference of components.
fn difference(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
    let components = a.as_flattened().iter().zip(b.as_flattened());
    components.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[gaurast_runner::test]
fn a_panorama_that_turns_shows_the_same_further_to_the_left() {
    let gpu = Gpu::embedded(&Settings::default()).expect("a device");
    let mut scene = scenes::cloud(21, 2000, 1);
    // Some Gaussians are wide, and one covers the pole.
    for (index, scale) in scene.scales.iter_mut().enumerate().take(60) {
        *scale = scale.map(|s| s * 3.0 + 0.01 * index as f32);
    }
    scene.positions[7] = [0.21, -2.0, 5.0];
    scene.scales[7] = [0.4; 3];
    scene.opacities[7] = 0.9;
    // Low floors, so that decisions change little and ellipses are large.
    let state = State::default().alpha_floor(1e-6).transmittance_floor(0.0);
    let straight = draw(&gpu, &scene, state, &panorama(0), SIZE);
    let covered = straight.iter().filter(|pixel| pixel[3] > 0.1).count();
    assert!(covered > straight.len() / 10, "{covered}");
    let [width, _] = SIZE.map(|side| side as usize);
    for quarters in 1..4 {
        let turned = draw(&gpu, &scene, state, &panorama(quarters), SIZE);
        let moved: Vec<[f32; 4]> = (0..straight.len())
            .map(|at| {
                let (y, x) = (at / width, at % width);
                straight[y * width + (x + quarters * width / 4) % width]
            })
            .collect();
        let difference = difference(&turned, &moved);
        assert!(difference < 5e-5, "{quarters}: {difference}");
    }
}

#[gaurast_runner::test]
fn what_straddles_the_seam_is_seen_on_both_sides() {
    let gpu = Gpu::embedded(&Settings::default()).expect("a device");
    // Straight behind the camera, above the horizon.
    let scene = SceneBuffers {
        positions: vec![[0.2, -0.6, 2.0]],
        scales: vec![[0.3; 3]],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]],
        opacities: vec![0.9],
        sh: vec![[1.0; 3]],
        degree: 0,
    };
    let picture = draw(&gpu, &scene, State::default(), &panorama(0), SIZE);
    let [width, height] = SIZE.map(|side| side as usize);
    let alpha = |x: usize, y: usize| picture[y * width + x][3];
    let row = height / 2 - (0.5f32.atan2(3.0) * height as f32 / std::f32::consts::PI) as usize;
    assert!(alpha(0, row) > 0.8 && alpha(width - 1, row) > 0.8);
    for x in 0..8 {
        let (left, right) = (alpha(x, row), alpha(width - 1 - x, row));
        assert!((left - right).abs() < 1e-4, "{x}: {left} {right}");
    }
    assert_eq!(alpha(width / 2, row), 0.0);
}

#[gaurast_runner::test(each = simd_levels())]
fn a_gaussian_over_a_pole_is_no_denser_than_elsewhere(case: &Case) {
    let gpu = Gpu::embedded(&Settings { simd: Some(case.variant()), ..Settings::default() }).expect("a device");
    let above = [[0.2, -2.1, 5.0], [0.25, 1.4, 4.98], [1.2, 0.4, 5.1]];
    let scene = SceneBuffers {
        positions: above.to_vec(),
        scales: vec![[0.3; 3]; 3],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; 3],
        opacities: vec![0.5; 3],
        sh: vec![[0.3; 3]; 3],
        degree: 0,
    };
    let (camera, state) = (panorama(1), State::default());
    let oracle = OracleCamera::new(&camera, SIZE).expect("a panorama");
    let expected = render_bounded(&scene.as_oracle(), &oracle, &OracleState::from(&state));
    let picture = draw(&gpu, &scene, state, &camera, SIZE);
    assert_contract("poles", &picture, &expected, Limits::ENVELOPE_ONLY);
    let [width, _] = SIZE.map(|side| side as usize);
    // The Gaussian covers the pole, so it covers all longitudes, once each.
    let top = &picture[..width];
    assert!(top.iter().all(|pixel| (0.49..0.500_01).contains(&pixel[3])));
}
