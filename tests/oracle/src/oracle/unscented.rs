//! The unscented transform.

use super::projection::mean_and_jacobian;
use super::vectors::{cross, dot, length};
use super::{OracleCamera, OracleModel, Rules, panorama};
use std::f64::consts::{FRAC_PI_2, PI};

/// Number of dimensions of the space that is projected.
const N: f64 = 3.0;
/// The transform's parameters; the third, beta, is one of the [`Rules`].
const ALPHA: f64 = 1.0;
const KAPPA: f64 = 0.0;

/// Points in the picture, less their mean, each times the root of its weight; the covariance is the sum of their
/// squares.
pub type Deviations = Vec<[f64; 2]>;

/// The mean of the picture of a Gaussian at `t` with these axes (each as long as a standard deviation), all in camera
/// axes, and its deviations. `None` if a sigma point is not visible together with the mean.
pub fn transform(
    camera: &OracleCamera,
    rules: &Rules,
    t: [f64; 3],
    axes: &[[f64; 3]; 3],
) -> Option<([f64; 2], Deviations)> {
    let lambda = ALPHA * ALPHA * (N + KAPPA) - N;
    let mut points = vec![t];
    for axis in axes {
        for sign in [1.0, -1.0] {
            points.push(std::array::from_fn(|k| t[k] + sign * (N + lambda).sqrt() * axis[k]));
        }
    }
    if !points[1..].iter().all(|&point| is_sigma_point_visible(camera, t, point)) {
        return None;
    }
    let center = mean_and_jacobian(camera, rules, t).0;
    let period = panorama::period(camera, rules);
    let places: Vec<[f64; 2]> = points
        .iter()
        .map(|&point| {
            let [x, y] = mean_and_jacobian(camera, rules, point).0;
            let dx = panorama::nearest(x - center[0], period).unwrap_or(x - center[0]);
            [center[0] + dx, y]
        })
        .collect();
    let other = 1.0 / (2.0 * (N + lambda));
    let in_mean = |index: usize| {
        if index == 0 { lambda / (N + lambda) } else { other }
    };
    let in_covariance = |index: usize| match index {
        0 => lambda / (N + lambda) + 1.0 - ALPHA * ALPHA + rules.unscented_beta,
        _ => other,
    };
    let mean = [0, 1].map(|axis| {
        let places = places.iter().enumerate();
        places.map(|(index, place)| in_mean(index) * place[axis]).sum::<f64>()
    });
    let deviations = places
        .iter()
        .enumerate()
        .map(|(index, place)| [0, 1].map(|axis| in_covariance(index).sqrt() * (place[axis] - mean[axis])));
    Some((mean, deviations.collect()))
}

/// True if a sigma point of a Gaussian at `t` is visible together with it. It must be beyond the near plane. For a
/// fisheye it must be less than a right angle away, and the backward axis must be outside the cone of that angle about
/// `t`. For a panorama the poles must be outside that cone.
fn is_sigma_point_visible(camera: &OracleCamera, t: [f64; 3], point: [f64; 3]) -> bool {
    let cosine = dot(t, point);
    let sine = length(cross(t, point));
    let apart = sine.atan2(cosine);
    let from = |axis: f64, rest: [f64; 2]| (rest[0] * rest[0] + rest[1] * rest[1]).sqrt().atan2(axis);
    match camera.model {
        OracleModel::Orthographic => true,
        OracleModel::Pinhole => point[2] > f64::from(camera.near),
        OracleModel::Fisheye => apart < FRAC_PI_2 && from(t[2], [t[0], t[1]]) + apart < PI,
        OracleModel::Equirectangular => from(t[1].abs(), [t[0], t[2]]) > apart,
    }
}
