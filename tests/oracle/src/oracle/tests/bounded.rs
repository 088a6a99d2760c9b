//! The bounded form gives what the literal form gives, bit for bit.

use super::*;
use crate::oracle::render_bounded;
use crate::scenes;

#[track_caller]
fn assert_same(scene: &SceneBuffers, camera: &OracleCamera, state: &OracleState) -> Reference {
    let literal = render_literal(&scene.as_oracle(), camera, state);
    let bounded = render_bounded(&scene.as_oracle(), camera, state);
    assert_eq!(literal.skips, bounded.skips);
    for (index, (a, b)) in literal.nominal.iter().zip(&bounded.nominal).enumerate() {
        assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits), "pixel {index}");
    }
    assert_eq!(literal, bounded);
    literal
}

fn states() -> [OracleState; 5] {
    let default = OracleState::default();
    [
        default,
        OracleState { opacity_compensated: true, ..default },
        OracleState { low_pass: 0.0, alpha_floor: 0.02, ..default },
        OracleState { alpha_floor: 0.0, ..default },
        OracleState { alpha_floor: 1e-12, transmittance_floor: 0.0, alpha_ceiling: 1.0, ..default },
    ]
}

#[test]
fn on_scenes_like_trained_ones() {
    for seed in 0..3 {
        let scene = scenes::cloud(seed, 300, 2);
        for state in states() {
            let picture = assert_same(&scene, &scenes::camera(48, 40), &state);
            assert!(picture.nominal.iter().any(|rgba| rgba[3] > 0.1));
        }
    }
}

#[test]
fn on_awkward_scenes() {
    let mut skips = crate::oracle::SkipCounts::default();
    for seed in 0..12 {
        let scene = scenes::awkward(seed, 60, 0);
        let camera = OracleCamera {
            principal: [3.0 + seed as f32, 40.0 - 2.0 * seed as f32],
            far: 8.0,
            ..scenes::camera(41, 29)
        };
        for state in states() {
            let picture = assert_same(&scene, &camera, &state);
            skips.non_finite += picture.skips.non_finite;
            skips.zero_quaternion += picture.skips.zero_quaternion;
            skips.negative_scale += picture.skips.negative_scale;
            skips.opacity_below_floor += picture.skips.opacity_below_floor;
            skips.near += picture.skips.near;
            skips.far += picture.skips.far;
        }
    }
    // The scenes contain the cases that they are made for.
    assert!(skips.non_finite > 0 && skips.zero_quaternion > 0 && skips.negative_scale > 0);
    assert!(skips.opacity_below_floor > 0 && skips.near > 0 && skips.far > 0);
}

#[test]
fn where_every_gaussian_is_undecidable() {
    // Opacities at the floor, so that each one counts at its centre or not at all.
    let mut scene = scenes::awkward(7, 80, 0);
    for (i, opacity) in scene.opacities.iter_mut().enumerate() {
        *opacity = (1.0 / 255.0) * (1.0 + 1e-7 * (i % 5) as f32);
    }
    let picture = assert_same(&scene, &scenes::camera(41, 29), &OracleState::default());
    assert!(!picture.alternatives.is_empty());
}
