//! Compares every stress scene at every SIMD level with the oracle.

use gaurast_runner::{Case, simd_levels};
use gaurast_testkit::for_levels::ForLevels;
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::compare::{Accuracy, Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleState, Reference, render_binary16, render_bounded};

use super::scenes::{Stress, all};

/// Draws a scene.
pub fn draw(gpu: &Gpu, stress: &Stress) -> Vec<[f32; 4]> {
    let options = GaussianOptions { state: stress.state, ..GaussianOptions::new(stress.scene.degree) };
    let pipeline = GaussianPipeline::new(gpu, &options);
    let on_device = GaussianScene::new(gpu, &stress.scene);
    let target = Target::floats(gpu, stress.size);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            on_device.bind(commands, &pipeline, &stress.camera);
            commands.draw(0..on_device.count);
        });
    });
    target.read()
}

/// Checks the properties that hold for every picture.
fn assert_sane(name: &str, image: &[[f32; 4]]) {
    for (index, pixel) in image.iter().enumerate() {
        let is_sane = pixel.iter().all(|c| c.is_finite() && *c >= 0.0) && pixel[3] <= 1.0;
        assert!(is_sane, "{name}: pixel {index} is {pixel:?}");
    }
}

/// A device of a SIMD level.
fn gpu(level: &str) -> Gpu {
    Gpu::embedded(&Settings { simd: Some(level), threads: Some(2), ..Settings::default() }).expect("a device")
}

#[gaurast_runner::test(each = simd_levels())]
fn every_scene_keeps_its_limit(case: &Case) {
    static REFERENCES: ForLevels<Reference> = ForLevels::new();
    let gpu = gpu(case.variant());
    let mut failures = Vec::new();
    for stress in all() {
        let reference = REFERENCES.get(stress.name, || {
            let camera = OracleCamera::new(&stress.camera, stress.size).expect("a camera");
            let state = OracleState::from(&stress.state);
            render_bounded(&stress.scene.as_oracle(), &camera, &state)
        });
        let is_empty = reference.nominal.iter().all(|rgba| *rgba == [0.0; 4]);
        assert_eq!(is_empty, stress.is_empty, "{}", stress.name);
        let limits = Limits { distance: stress.limit, ..Limits::ENVELOPE_ONLY };
        let image = draw(&gpu, &stress);
        let name = format!("{}, {}", stress.name, case.variant());
        assert_sane(&name, &image);
        let result = std::panic::catch_unwind(|| assert_contract(&name, &image, &reference, limits));
        if result.is_err() {
            failures.push(format!("{name}, since {}", stress.reason));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// binary16 is defined to the bit. Its limit is therefore zero, apart from the roundings that the last digits of a
/// mean, a covariance or a colour allow.
#[gaurast_runner::test(each = simd_levels())]
fn binary16_is_as_defined(case: &Case) {
    static REFERENCES: ForLevels<Reference> = ForLevels::new();
    let gpu = gpu(case.variant());
    let mut failures = Vec::new();
    for stress in all() {
        let stress = stress.in_binary16();
        let reference = REFERENCES.get(stress.name, || {
            let camera = OracleCamera::new(&stress.camera, stress.size).expect("a camera");
            let state = OracleState::from(&stress.state);
            render_binary16(&stress.scene.as_oracle(), &camera, &state)
        });
        let limits = Limits { distance: 0.0, ..Limits::ENVELOPE_ONLY };
        let accuracy = Accuracy::of(&draw(&gpu, &stress), &reference, limits);
        if !accuracy.holds() || accuracy.exhausted > 0 {
            failures.push(format!("{}: {accuracy}", stress.name));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
