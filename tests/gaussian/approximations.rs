//! The approximations that a pipeline allows, compared with the binary64 oracle. The error is within the extension's
//! bound, it is not zero, and it is the same for any number of threads.

use gaurast::vk::{
    PipelineGaussianApproximationStateCreateInfoGAURAST as Approximation,
    PipelineGaussianStateCreateInfoGAURAST as State,
};
use gaurast_runner::{Case, simd_levels};
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::oracle::spherical_harmonics::{coefficient_count, color};
use gaurast_tests::oracle::{OracleState, Reference, render_bounded};
use gaurast_tests::scenes::{self, Gaussian, SceneBuffers};

/// The picture's size; not a multiple of a tile.
const SIZE: [u32; 2] = [203, 139];

/// The distance that the contract allows without approximations.
const CONTRACT: f64 = 5e-6;

/// Several layers of faint discs that cover the picture, alternately bright and dark.
fn layers() -> SceneBuffers {
    let discs = (0..300).map(|layer| {
        let look = if layer % 2 == 0 { 1.5 } else { -1.5 };
        Gaussian {
            position: [0.0, 0.0, 3.0 + 0.01 * layer as f32],
            scale: [3.0, 3.0, 0.01],
            rotation: [1.0, 0.0, 0.0, 0.0],
            opacity: 0.02 + 0.0002 * layer as f32,
            sh: vec![[look, 0.0, -look]],
        }
    });
    SceneBuffers::new(0, discs)
}

/// The generated scene of the benchmarks, at the camera of the other scenes.
fn benchmark() -> SceneBuffers {
    let mut scene = SceneBuffers::from(&scenes::synthetic(1, 20_000));
    for [_, _, z] in &mut scene.positions {
        *z += 6.0;
    }
    scene
}

fn all_scenes() -> [(&'static str, SceneBuffers); 4] {
    [
        ("layers", layers()),
        ("benchmark", benchmark()),
        ("cloud", scenes::cloud(21, 3000, 1)),
        ("awkward", scenes::awkward(22, 200, 1)),
    ]
}

/// Draws a picture, with the approximation's structure if `allowed` is given.
fn draw(gpu: &Gpu, scene: &SceneBuffers, allowed: Option<[f32; 2]>) -> Vec<[f32; 4]> {
    let [error, budget] = allowed.unwrap_or_default();
    let approximation = Approximation::default().exponential_error(error).contribution_budget(budget);
    let mut state = State::default();
    if allowed.is_some() {
        state.p_next = (&raw const approximation).cast();
    }
    let options = GaussianOptions { state, ..GaussianOptions::new(scene.degree) };
    let pipeline = GaussianPipeline::new(gpu, &options);
    let on_device = GaussianScene::new(gpu, scene);
    let target = Target::floats(gpu, SIZE);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            let camera = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
            on_device.bind(commands, &pipeline, &camera);
            commands.draw(0..on_device.count);
        });
    });
    assert_eq!(gpu.messages(), []);
    target.read()
}

fn reference(scene: &SceneBuffers) -> Reference {
    let camera = scenes::camera(SIZE[0], SIZE[1]);
    render_bounded(&scene.as_oracle(), &camera, &OracleState::from(&State::default()))
}

fn gpu(threads: usize) -> Gpu {
    Gpu::embedded(&Settings { threads: Some(threads), ..Settings::default() }).expect("a device")
}

/// The distance of each pixel outside the oracle's envelope: of colours as a share of `range`, the range of colours,
/// and of alpha as it is.
fn distances(image: &[[f32; 4]], reference: &Reference, range: f64) -> Vec<f64> {
    let distance = |(index, pixel): (usize, &[f32; 4])| {
        let (least, greatest) = reference.envelope(index);
        (0..4)
            .map(|channel| {
                let value = f64::from(pixel[channel]);
                let off = (least[channel] - value).max(value - greatest[channel]);
                let rounding = CONTRACT * range.max(1.0);
                (off - rounding).max(0.0) / if channel < 3 { range } else { 1.0 }
            })
            .fold(0.0, f64::max)
    };
    image.iter().enumerate().map(distance).collect()
}

/// The greatest component of a Gaussian's colour. The background is black, and no colour is less.
fn range(scene: &SceneBuffers) -> f64 {
    let coefficients = coefficient_count(scene.degree);
    let eye = scenes::camera(SIZE[0], SIZE[1]).eye;
    let colors = (scene.positions.iter()).zip(scene.sh.chunks(coefficients));
    colors
        .flat_map(|(position, sh)| {
            let towards = std::array::from_fn(|axis| f64::from(position[axis]) - eye[axis]);
            let length = f64::hypot(f64::hypot(towards[0], towards[1]), towards[2]);
            color(scene.degree, towards.map(|axis| axis / length), sh)
        })
        .filter(|component| component.is_finite())
        .fold(0.0, f64::max)
}

#[gaurast_runner::test]
fn pictures_are_no_further_off_than_is_allowed() {
    let gpu = gpu(2);
    let state = State::default();
    // A pixel ends before the Gaussian that would leave less than the floor, so this much transmittance may remain.
    let finished = f64::from(state.transmittance_floor) / (1.0 - f64::from(state.alpha_ceiling));
    for (scene_name, scene) in all_scenes() {
        let (reference, range) = (reference(&scene), range(&scene));
        let exact = draw(&gpu, &scene, None);
        for allowed @ [error, budget] in
            [[1e-4, 0.0], [2e-3, 0.0], [0.0, 1.0 / 255.0], [0.0, 16.0 / 255.0], [2e-3, 4.0 / 255.0]]
        {
            let image = draw(&gpu, &scene, Some(allowed));
            let name = format!("{scene_name}, {allowed:?}");
            // A sparse scene in a small picture has few saturated blocks. The awkward scene may hide everything behind
            // alphas at the ceiling.
            let must_differ = match scene_name {
                "layers" => true,
                "awkward" => false,
                _ => error > 0.0,
            };
            assert!(image != exact || !must_differ, "{name}: nothing is approximated");
            let bound = f64::from(error) + f64::from(budget);
            let distances = distances(&image, &reference, range);
            let worst = distances.iter().copied().fold(0.0, f64::max);
            let flipped = distances.iter().filter(|distance| **distance > bound);
            // Only an error of the exponential changes the Gaussian at which a pixel ends, and it does so at few
            // pixels.
            let (flips, most) = if error > 0.0 { (image.len() / 100, bound + finished) } else { (0, bound) };
            assert!(flipped.count() <= flips, "{name}: {worst:e} exceeds {bound:e}");
            assert!(worst <= most, "{name}: {worst:e} exceeds {most:e}");
        }
    }
}

#[gaurast_runner::test]
fn what_allows_nothing_is_as_without() {
    let gpu = gpu(2);
    for (name, scene) in all_scenes() {
        let without = draw(&gpu, &scene, None);
        assert!(draw(&gpu, &scene, Some([0.0; 2])) == without, "{name}");
        // The error is less than the device's cheaper exponential has, so the exact one is used.
        assert!(draw(&gpu, &scene, Some([1e-6, 0.0])) == without, "{name}");
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn threads_change_nothing(case: &Case) {
    let allowed = Some([2e-3, 4.0 / 255.0]);
    let scene = scenes::cloud(21, 3000, 1);
    let picture = |threads| {
        let gpu =
            Gpu::embedded(&Settings { simd: Some(case.variant()), threads: Some(threads), ..Settings::default() })
                .expect("a device");
        draw(&gpu, &scene, allowed)
    };
    assert!(picture(1) == picture(3));
}
