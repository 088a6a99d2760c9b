//! Outputs of vertex shaders and inputs of resolve shaders, against values worked out by hand.

use super::super::resolve::resolve_shaded;
use super::super::shaded::{OracleOutputs, OracleViewport, project, render_shaded};
use super::{assert_close, at, unfiltered};
use crate::oracle::OracleState;

const SIZE: [u32; 2] = [64, 64];
const VIEWPORT: OracleViewport = OracleViewport { corner: [0.0; 2], size: [64.0; 2] };

/// A vertex shader's outputs for a disc in the middle of pixel (40, 24), 4 px^2, at depth `z` of 1.
fn disc(z: f32) -> OracleOutputs {
    OracleOutputs {
        position: [2.0 * 8.5 / 32.0, -2.0 * 7.5 / 32.0, 2.0 * z, 2.0],
        covariance: [4.0, 0.0, 4.0],
        opacity: 0.5,
        color: [1.0, 0.5, -0.25],
        key: None,
    }
}

#[test]
fn one_gaussian_where_the_viewport_puts_it() {
    let picture = render_shaded(&[disc(0.5)], SIZE, &VIEWPORT, &unfiltered());
    assert_close(at(&picture, 40, 24), [0.5, 0.25, -0.125, 0.5], 1e-15);
    let alpha = 0.5 * (-0.5_f64 * 10.0 / 4.0).exp();
    assert!((at(&picture, 43, 23)[3] - alpha).abs() < 1e-15);
    // With a flipped viewport the mean is mirrored, and the covariance is not.
    let flipped = OracleViewport { corner: [0.0, 64.0], size: [64.0, -64.0] };
    let slanted = OracleOutputs { covariance: [4.0, 1.0, 2.0], ..disc(0.5) };
    let upright = project(&slanted, &VIEWPORT, &unfiltered()).unwrap();
    let flipped = project(&slanted, &flipped, &unfiltered()).unwrap();
    assert_eq!(upright.mean, [40.5, 24.5]);
    assert_eq!(flipped.mean, [40.5, 39.5]);
    assert_eq!(upright.covariance, flipped.covariance);
}

#[test]
fn compensation_takes_the_determinant_of_what_was_written() {
    let state = OracleState { low_pass: 0.25, opacity_compensated: true, ..OracleState::default() };
    let splat = project(&disc(0.5), &VIEWPORT, &state).unwrap();
    assert!((splat.opacity - 0.5 * 4.0 / 4.25).abs() < 1e-15);
    // Rounding may have left a slightly negative area.
    let less = OracleOutputs { covariance: [4.0, 4.000_001, 4.0], ..disc(0.5) };
    assert_eq!(project(&less, &VIEWPORT, &state).unwrap().opacity, 0.0);
}

#[test]
fn depths_are_expected_and_median() {
    let layers = [0.75, 0.25].map(|z| OracleOutputs { key: Some(z), opacity: 0.25, ..disc(z) });
    let pixels = resolve_shaded(&layers, SIZE, &VIEWPORT, &unfiltered());
    let [way] = &pixels[24 * 64 + 40][..] else {
        panic!("the pixel is undecidable");
    };
    // Weights of 1/4 and 3/16; the second comes where more than one half is left.
    let expected = (0.25 * 0.25 + 0.1875 * 0.75) / 0.4375;
    assert!((way.expected_depth - expected).abs() < 1e-15);
    assert_eq!(way.median_depths, [0.75]);
    assert_eq!(way.accumulated[3], 0.4375);
    assert!(way.covered && !pixels[0][0].covered);
}
