//! The per-pixel order and 2D Gaussians.

use super::*;
use crate::oracle::{OracleGeometry, OracleOrder};

/// A disc of a standard deviation of 1/64 at depth 1 on the axis, turned about y by an angle.
fn turned(angle: f64, color: [f32; 3]) -> Gaussian {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Gaussian {
        scale: [1.0 / 64.0, 1.0 / 64.0, 0.0],
        rotation: [cos as f32, 0.0, sin as f32, 0.0],
        sh: vec![color.map(dc)],
        ..sphere()
    }
}

fn flat() -> OracleState {
    OracleState { geometry: OracleGeometry::Surfel, ..unfiltered() }
}

#[test]
fn a_disc_is_where_rays_meet_its_plane() {
    let angle = 1.0f64;
    let picture = render(&[turned(angle, [0.5; 3])], &camera(), &flat());
    for (px, py) in [(32, 32), (33, 32), (31, 32), (34, 33), (30, 34)] {
        let [x, y] = [px, py].map(|p: u32| (f64::from(p) - 32.0) / 128.0);
        // u (cos, 0, -sin) / 64 + v (0, 1, 0) / 64 + (0, 0, 1) is tau (x, y, 1).
        let u = 64.0 * x / (angle.cos() + x * angle.sin());
        let v = 64.0 * y * (1.0 - u / 64.0 * angle.sin());
        let alpha = 0.5 * (-0.5 * (u * u + v * v)).exp();
        // The quaternion is rounded to binary32.
        assert!((at(&picture, px, py)[3] - alpha).abs() < 1e-6, "{px} {py}");
    }
    // One side of the disc is farther away.
    assert!(at(&picture, 33, 32)[3] > at(&picture, 31, 32)[3]);
}

#[test]
fn a_disc_is_no_less_than_its_filter() {
    let state = OracleState { low_pass: 0.5, ..flat() };
    // Edge on, and a point.
    let edge = turned(std::f64::consts::FRAC_PI_2, [0.5; 3]);
    let point = Gaussian { scale: [0.0; 3], ..edge.clone() };
    for gaussian in [edge, point] {
        let picture = render(&[gaussian], &camera(), &state);
        assert_close(at(&picture, 32, 32), [0.25, 0.25, 0.25, 0.5], 1e-7);
        let alpha = 0.5 * (-1.0f64).exp();
        assert!((at(&picture, 33, 32)[3] - alpha).abs() < 1e-7);
    }
}

#[test]
fn discs_that_cross_are_in_front_of_each_other() {
    let (red, green) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let crossing = [turned(0.7, red), turned(-0.7, green)];
    for state in [
        OracleState { order: OracleOrder::PerPixel, ..flat() },
        OracleState { order: OracleOrder::PerPixel, low_pass: 0.05, ..unfiltered() },
    ] {
        let picture = render(&crossing, &camera(), &state);
        let [left, right] = [31, 33].map(|x| at(&picture, x, 32));
        // The first goes behind the second on the left, where its x is negative: -x sin.
        assert!(left[1] > left[0] && right[0] > right[1], "{left:?} {right:?}");
        // In the middle their depths are equal, so they are in the order of the draw.
        assert_close(at(&picture, 32, 32), [0.5, 0.25, 0.0, 0.75], 1e-6);
    }
    let by_centre = render(&crossing, &camera(), &flat());
    assert!(at(&by_centre, 31, 32)[0] > at(&by_centre, 31, 32)[1]);
}
