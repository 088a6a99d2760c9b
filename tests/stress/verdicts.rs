//! Every stress scene at every SIMD level against the oracle.
//!
//! `--nocapture` shows the table.

use gaurast_tests::compare::{Limits, assert_contract, verdict};
use gaurast_tests::contexts::{
    Context, DeviceScene, Pass, Pipeline, PipelineOptions, Settings, Target, simd_levels,
};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_binary16, render_bounded};

use crate::scenes::{Stress, all};

/// Draws a scene.
pub fn draw(context: &Context, stress: &Stress) -> Vec<[f32; 4]> {
    let options = PipelineOptions {
        state: stress.state,
        ..PipelineOptions::new(stress.scene.degree)
    };
    let pipeline = Pipeline::new(context, &options);
    let on_device = DeviceScene::new(context, &stress.scene);
    let target = Target::new(context, options.format, stress.size);
    context.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            commands.bind(&pipeline, &on_device, &stress.camera);
            commands.draw([on_device.count, 1, 0, 0]);
        });
    });
    target.read()
}

/// What holds of every picture, whatever is drawn.
fn assert_sane(name: &str, image: &[[f32; 4]]) {
    for (index, pixel) in image.iter().enumerate() {
        let is_sane = pixel.iter().all(|c| c.is_finite() && *c >= 0.0) && pixel[3] <= 1.0;
        assert!(is_sane, "{name}: pixel {index} is {pixel:?}");
    }
}

/// A device of each SIMD level.
fn contexts() -> Vec<(&'static str, Context)> {
    let context = |simd| {
        Context::embedded(&Settings {
            simd: Some(simd),
            threads: Some(2),
            ..Settings::default()
        })
    };
    let levels = simd_levels().into_iter();
    levels.map(|level| (level, context(level))).collect()
}

#[test]
fn every_scene_keeps_its_limit_at_every_level() {
    let contexts = contexts();
    println!("| scene | limit | reason | {} |", simd_levels().join(" | "));
    let mut failures = Vec::new();
    for stress in all() {
        let camera = OracleCamera::new(&stress.camera, stress.size).expect("a camera");
        let state = OracleState::from(&stress.state);
        let reference = render_bounded(&stress.scene.as_oracle(), &camera, &state);
        let is_empty = reference.nominal.iter().all(|rgba| *rgba == [0.0; 4]);
        assert_eq!(is_empty, stress.is_empty, "{}", stress.name);
        let limits = Limits {
            distance: stress.limit,
            ..Limits::ENVELOPE_ONLY
        };
        let mut cells = Vec::new();
        for (level, context) in &contexts {
            let image = draw(context, &stress);
            let name = format!("{}, {level}", stress.name);
            assert_sane(&name, &image);
            let judged = std::panic::catch_unwind(|| {
                assert_contract(&name, &image, &reference, limits).max_distance
            });
            cells.push(match judged {
                Ok(distance) => format!("{distance:.2e}"),
                Err(_) => {
                    failures.push(name);
                    "fails".to_owned()
                }
            });
        }
        let Stress {
            name,
            limit,
            reason,
            ..
        } = stress;
        println!(
            "| {name} | {limit:.1e} | {reason} | {} |",
            cells.join(" | ")
        );
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// binary16 is defined to the bit: its limit is zero, beyond what the last digits of a mean, a covariance or a colour
/// may round to.
#[test]
fn binary16_is_as_defined_at_every_level() {
    let contexts = contexts();
    let (mut failures, mut several, mut pixels) = (Vec::new(), 0, 0);
    for stress in all() {
        let stress = stress.in_binary16();
        let camera = OracleCamera::new(&stress.camera, stress.size).expect("a camera");
        let state = OracleState::from(&stress.state);
        let reference = render_binary16(&stress.scene.as_oracle(), &camera, &state);
        pixels += reference.nominal.len();
        several += reference.alternatives.len();
        let limits = Limits {
            distance: 0.0,
            ..Limits::ENVELOPE_ONLY
        };
        for (level, context) in &contexts {
            let image = draw(context, &stress);
            let name = format!("{}, binary16, {level}", stress.name);
            let judged = verdict(&image, &reference, limits);
            println!("{name}: {judged}");
            if !judged.holds() || judged.exhausted > 0 {
                failures.push(format!("{name}: {judged}"));
            }
        }
    }
    println!("{several} of {pixels} pixels may be one of several");
    assert!(failures.is_empty(), "{failures:#?}");
}
