//! Pixels where binary32 cannot be required to take a given branch.

use super::*;
use crate::oracle::project::project;
use crate::oracle::{MAX_DECISIONS, error_model};

/// A state whose alpha floor equals the alpha of `sphere()` at pixel (34, 32), up to a relative `distance`.
fn floor_near_alpha(distance: f64) -> (OracleState, f64) {
    let alpha = 0.5 * (-0.5_f64).exp();
    let alpha_floor = (alpha * (1.0 + distance)) as f32;
    (OracleState { alpha_floor, ..unfiltered() }, alpha)
}

fn index(x: usize, y: usize) -> usize {
    y * 64 + x
}

#[test]
fn an_alpha_next_to_the_floor_goes_both_ways() {
    for distance in [1e-7, -1e-7] {
        let (state, alpha) = floor_near_alpha(distance);
        let picture = render(&[sphere()], &camera(), &state);
        let drawn = [0.5 * alpha, 0.5 * alpha, 0.5 * alpha, alpha];
        let (first, second) = if distance > 0.0 { ([0.0; 4], drawn) } else { (drawn, [0.0; 4]) };
        // The four pixels at a distance of 2 px, and no others.
        let at_the_edge = [index(32, 30), index(30, 32), index(34, 32), index(32, 34)];
        assert_eq!(picture.alternatives.len(), 4);
        for pixel in at_the_edge {
            let outcomes: Vec<_> = picture.outcomes(pixel).copied().collect();
            assert_eq!(outcomes.len(), 2);
            assert_close(outcomes[0], first, 1e-15);
            assert_close(outcomes[1], second, 1e-15);
            let (least, greatest) = picture.envelope(pixel);
            assert_eq!(least, [0.0; 4]);
            assert_close(greatest, drawn, 1e-15);
        }
        assert_eq!(picture.exhausted, 0);
    }
    // Further away it is decidable.
    for distance in [1e-4, -1e-4] {
        let (state, _) = floor_near_alpha(distance);
        assert!(render(&[sphere()], &camera(), &state).alternatives.is_empty());
    }
}

#[test]
fn a_transmittance_next_to_the_floor_goes_both_ways() {
    // Two layers leave 1/16 of 1/16; then a floor just above or below that.
    let layer = |z, opacity| Gaussian { position: [0.0, 0.0, z], opacity, ..sphere() };
    let layers = [layer(1.0, 0.9375), layer(2.0, 0.9375), layer(3.0, 0.5), layer(4.0, 0.9375)];
    for (distance, nominal) in [(1e-7, 1.0 / 16.0), (-1e-7, 1.0 / 256.0)] {
        let state =
            OracleState { transmittance_floor: (f64::from(1.0 / 256.0_f32) * (1.0 + distance)) as f32, ..unfiltered() };
        let picture = render(&layers, &camera(), &state);
        let outcomes: Vec<f64> = picture.outcomes(index(32, 32)).map(|rgba| 1.0 - rgba[3]).collect();
        // It finishes before the second layer or before the third: no path reaches the fourth.
        assert_eq!(outcomes[0], nominal, "{distance}");
        assert_eq!(outcomes.len(), 2);
        assert_eq!(outcomes[1], if nominal == 1.0 / 16.0 { 1.0 / 256.0 } else { 1.0 / 16.0 });
    }
}

#[test]
fn decisions_multiply_up_to_a_limit() {
    // Coincident Gaussians, every one of them undecidable at the same four pixels.
    let (state, _) = floor_near_alpha(1e-7);
    for count in 1..=8_u32 {
        let layers: Vec<Gaussian> = (0..count).map(|_| sphere()).collect();
        let picture = render(&layers, &camera(), &state);
        let followed = count.min(MAX_DECISIONS);
        assert_eq!(picture.outcomes(index(34, 32)).count(), 1 << followed);
        assert_eq!(picture.exhausted, if count > MAX_DECISIONS { 4 } else { 0 });
    }
}

#[test]
fn a_floor_of_zero_and_the_ceiling_are_decidable() {
    let state = OracleState { alpha_floor: 0.0, transmittance_floor: 0.0, ..unfiltered() };
    let strong = Gaussian { opacity: 2.0, ..sphere() };
    let picture = render(&vec![strong; 20], &camera(), &state);
    assert!(picture.alternatives.is_empty());
    // Alpha reaches every pixel within the range of binary64.
    assert!(picture.nominal.iter().all(|rgba| rgba[3] >= 0.0));
    assert!(at(&picture, 44, 32)[3] > 0.0);
}

#[test]
fn needles_are_granted_more_than_spheres() {
    let error = |gaussian: Gaussian, d: [f64; 2]| {
        let scene = SceneBuffers::new(0, [gaussian]);
        let splat = project(&scene.as_oracle(), &camera(), &OracleState::default(), 0).unwrap();
        let (q, w) = splat.cholesky.solve(d);
        assert!(q < 4.0);
        splat.error.alpha(w, q)
    };
    let fixed = error_model::FIXED * error_model::UNIT_ROUNDOFF;
    let sphere_error = error(sphere(), [2.0, 2.0]);
    assert!(sphere_error > fixed && sphere_error < 2.0 * fixed, "{sphere_error}");
    let half = std::f32::consts::FRAC_PI_8;
    let needle = Gaussian { scale: [1.0, 1e-3, 1e-3], rotation: [half.cos(), 0.0, 0.0, half.sin()], ..sphere() };
    // 57 px along the needle, and 0.7 px to its side.
    let needle_error = error(needle, [40.0, 41.0]);
    assert!(needle_error > 2.0 * sphere_error && needle_error < 1e-3, "{needle_error}");
}

#[test]
fn keys_between_two_binary32_values_are_counted() {
    // t.z = 1 + 2^-24, halfway between 1 and the next binary32 value.
    let camera = OracleCamera { eye: [0.0, 0.0, -error_model::UNIT_ROUNDOFF], ..camera() };
    assert_eq!(render(&[sphere()], &camera, &unfiltered()).undecidable_keys, 1);
    let camera = OracleCamera { eye: [0.0; 3], ..camera };
    assert_eq!(render(&[sphere()], &camera, &unfiltered()).undecidable_keys, 0);
}
