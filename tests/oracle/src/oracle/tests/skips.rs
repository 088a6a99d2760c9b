//! Skipped Gaussians, and the reasons under which they are counted.

use super::*;
use crate::oracle::{OracleScene, SkipCounts};

#[track_caller]
fn assert_skipped(gaussian: Gaussian, expected: SkipCounts) {
    assert_skipped_in(gaussian, &OracleState::default(), expected);
}

#[track_caller]
fn assert_skipped_in(gaussian: Gaussian, state: &OracleState, expected: SkipCounts) {
    let picture = render(&[gaussian], &camera(), state);
    assert_eq!(picture.skips, expected);
    assert!(picture.nominal.iter().all(|rgba| *rgba == [0.0; 4]));
}

#[test]
fn non_finite_attributes() {
    let expected = SkipCounts { non_finite: 1, ..SkipCounts::default() };
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_skipped(Gaussian { position: [value, 0.0, 1.0], ..sphere() }, expected);
        assert_skipped(Gaussian { scale: [0.1, value, 0.1], ..sphere() }, expected);
        assert_skipped(Gaussian { rotation: [1.0, 0.0, 0.0, value], ..sphere() }, expected);
        assert_skipped(Gaussian { opacity: value, ..sphere() }, expected);
        assert_skipped(Gaussian { sh: vec![[0.0, 0.0, value]], ..sphere() }, expected);
    }
}

#[test]
fn coefficients_beyond_the_degree_drawn_do_not_matter() {
    let mut sh = vec![[0.0; 3]; 4];
    sh[3][1] = f32::NAN;
    let scene = SceneBuffers::new(1, [Gaussian { sh, ..sphere() }]);
    let mut input = scene.as_oracle();
    let draw = |input: &OracleScene| render_literal(input, &camera(), &OracleState::default()).skips.non_finite;
    assert_eq!(draw(&input), 1);
    input.requested_degree = 0;
    assert_eq!(draw(&input), 0);
}

#[test]
fn zero_quaternion_negative_scale_low_opacity() {
    let expected = SkipCounts { zero_quaternion: 1, ..SkipCounts::default() };
    assert_skipped(Gaussian { rotation: [0.0, -0.0, 0.0, 0.0], ..sphere() }, expected);
    let expected = SkipCounts { negative_scale: 1, ..SkipCounts::default() };
    assert_skipped(Gaussian { scale: [0.1, 0.1, -1e-30], ..sphere() }, expected);
    let expected = SkipCounts { opacity_below_floor: 1, ..SkipCounts::default() };
    let just_below = (1.0_f32 / 255.0).next_down();
    assert_skipped(Gaussian { opacity: just_below, ..sphere() }, expected);
    assert_skipped(Gaussian { opacity: -1.0, ..sphere() }, expected);
}

#[test]
fn at_the_floor_a_gaussian_is_drawn_at_its_centre() {
    let gaussian = Gaussian { opacity: 1.0 / 255.0, ..sphere() };
    let picture = render(&[gaussian], &camera(), &OracleState::default());
    assert_eq!(picture.skips.total(), 0);
    assert_eq!(at(&picture, 32, 32)[3], 1.0 - (1.0 - f64::from(1.0_f32 / 255.0)));
}

#[test]
fn near_and_far_are_strict_and_compare_binary32() {
    let near = SkipCounts { near: 1, ..SkipCounts::default() };
    for z in [0.2, 0.1, 0.0, -1.0] {
        assert_skipped(Gaussian { position: [0.0, 0.0, z], ..sphere() }, near);
    }
    let beyond = 0.2_f32.next_up();
    let gaussian = Gaussian { position: [0.0, 0.0, beyond], ..sphere() };
    let picture = render(std::slice::from_ref(&gaussian), &camera(), &OracleState::default());
    assert_eq!(picture.skips.total(), 0);
    // In binary64 it is beyond the near plane, in binary32 it is on it.
    let camera = OracleCamera { eye: [0.0, 0.0, 1e-8], ..camera() };
    assert_eq!(render(&[gaussian], &camera, &OracleState::default()).skips.near, 1);

    let camera = OracleCamera { far: 4.0, ..camera };
    for (z, expected) in [(4.0_f32, 1), (4.0_f32.next_down(), 1), (3.9, 0)] {
        let gaussian = Gaussian { position: [0.0, 0.0, z], ..sphere() };
        let camera = OracleCamera { eye: [0.0, 0.0, -2e-7], ..camera };
        assert_eq!(render(&[gaussian], &camera, &OracleState::default()).skips.far, expected, "{z}");
    }
}

#[test]
fn degenerate_covariance() {
    let expected = SkipCounts { degenerate_covariance: 1, ..SkipCounts::default() };
    // A line and a point without a low-pass filter have no area.
    assert_skipped_in(Gaussian { scale: [0.1, 0.0, 0.0], ..sphere() }, &unfiltered(), expected);
    assert_skipped_in(Gaussian { scale: [0.0; 3], ..sphere() }, &unfiltered(), expected);
    // With one they are drawn.
    let point = Gaussian { scale: [0.0; 3], ..sphere() };
    let picture = render(&[point], &camera(), &OracleState::default());
    assert_eq!(at(&picture, 32, 32)[3], 0.5);
}

#[test]
fn the_first_reason_counts() {
    let mut gaussian = Gaussian {
        position: [0.0, 0.0, -1.0],
        scale: [-1.0, f32::NAN, 1.0],
        rotation: [0.0; 4],
        opacity: 0.0,
        ..sphere()
    };
    assert_skipped(gaussian.clone(), SkipCounts { non_finite: 1, ..SkipCounts::default() });
    gaussian.scale[1] = 1.0;
    assert_skipped(gaussian.clone(), SkipCounts { zero_quaternion: 1, ..SkipCounts::default() });
    gaussian.rotation[2] = 1.0;
    assert_skipped(gaussian.clone(), SkipCounts { negative_scale: 1, ..SkipCounts::default() });
    gaussian.scale[0] = 1.0;
    let expected = SkipCounts { opacity_below_floor: 1, ..SkipCounts::default() };
    assert_skipped(gaussian.clone(), expected);
    gaussian.opacity = 1.0;
    assert_skipped(gaussian, SkipCounts { near: 1, ..SkipCounts::default() });
}

#[test]
fn nothing_finite_poisons_a_pixel() {
    let extremes = [
        Gaussian { scale: [f32::MAX; 3], ..sphere() },
        Gaussian { position: [f32::MAX, 0.0, 1.0], ..sphere() },
        Gaussian { position: [0.0, 0.0, f32::MAX], ..sphere() },
        Gaussian { rotation: [f32::MIN_POSITIVE / 4.0, 0.0, 0.0, 0.0], ..sphere() },
        Gaussian { opacity: f32::MAX, sh: vec![[f32::MIN; 3]], ..sphere() },
    ];
    let picture = render(&extremes, &camera(), &OracleState::default());
    assert!(picture.nominal.as_flattened().iter().all(|c| c.is_finite()));
}
