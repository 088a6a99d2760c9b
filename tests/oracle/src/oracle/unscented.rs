//! The unscented transform.

use super::projection::{ideal_radius, mean_and_jacobian};
use super::vectors::{cross, dot, length};
use super::{OracleCamera, OracleModel, OracleState, Rules, panorama};
use std::f64::consts::{FRAC_PI_2, PI};

/// Number of dimensions of the space that is projected.
const N: f64 = 3.0;

/// A vector in the picture that counts in a covariance by its square, times a sign.
#[derive(Clone, Copy, Debug)]
pub struct Deviation {
    /// The vector in pixels, times the root of its weight's magnitude.
    pub at: [f64; 2],
    /// 1, or -1 for a negative weight.
    pub sign: f64,
}

/// The moments of the sigma points' places.
#[derive(Clone, Debug)]
pub struct Moments {
    /// The mean.
    pub mean: [f64; 2],
    /// The points less their mean.
    pub deviations: Vec<Deviation>,
    /// The sum of the magnitudes of the weights in the mean.
    pub weights: f64,
    /// The greatest length of a point's Jacobian, by row.
    pub steepest: [f64; 2],
}

/// The picture of a Gaussian by its sigma points.
#[derive(Clone, Debug)]
pub enum Transformed {
    /// The covariance is the sum of the deviations' squares.
    Moments(Moments),
    /// A sigma point is not visible together with the mean.
    Unseen,
    /// Too few points lie in the picture.
    OutsidePicture,
}

/// Projects a Gaussian at `t` with these axes (each as long as a standard deviation), all in camera axes, by its sigma points.
pub fn transform(camera: &OracleCamera, state: &OracleState, t: [f64; 3], axes: &[[f64; 3]; 3]) -> Transformed {
    let rules = &state.rules;
    let [alpha, beta, kappa] =
        [state.sigma_points.alpha, state.sigma_points.beta, state.sigma_points.kappa].map(f64::from);
    let lambda = alpha * alpha * (N + kappa) - N;
    let mut points = vec![t];
    for axis in axes {
        for sign in [1.0, -1.0] {
            points.push(std::array::from_fn(|k| t[k] + sign * (N + lambda).sqrt() * axis[k]));
        }
    }
    let is_visible = |index: usize| index == 0 || is_sigma_point_visible(camera, rules, t, points[index]);
    let all_visible = (0..points.len()).all(is_visible);
    if state.sigma_points.picture_margin < f32::INFINITY {
        let counts = |index: usize| {
            is_visible(index) && is_in_picture(camera, state, mean_and_jacobian(camera, rules, points[index]).0)
        };
        let is_drawn =
            if state.sigma_points.all { (0..points.len()).all(counts) } else { (0..points.len()).any(counts) };
        if !is_drawn {
            return Transformed::OutsidePicture;
        }
    }
    if !all_visible {
        return Transformed::Unseen;
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
        0 => lambda / (N + lambda) + 1.0 - alpha * alpha + rules.unscented_beta.unwrap_or(beta),
        _ => other,
    };
    let mean = [0, 1].map(|axis| {
        let places = places.iter().enumerate();
        places.map(|(index, place)| in_mean(index) * place[axis]).sum::<f64>()
    });
    let deviations = places.iter().enumerate().map(|(index, place)| {
        let weight = in_covariance(index);
        let root = weight.abs().sqrt();
        Deviation { at: [0, 1].map(|axis| root * (place[axis] - mean[axis])), sign: weight.signum() }
    });
    let steepest = |axis: usize| {
        let rows = points.iter().map(|&point| length(mean_and_jacobian(camera, rules, point).1[axis]));
        rows.fold(0.0, f64::max)
    };
    Transformed::Moments(Moments {
        mean,
        deviations: deviations.collect(),
        weights: (0..points.len()).map(|index| in_mean(index).abs()).sum(),
        steepest: [0, 1].map(steepest),
    })
}

/// True if a pixel lies in the viewport or its margin.
fn is_in_picture(camera: &OracleCamera, state: &OracleState, pixel: [f64; 2]) -> bool {
    let margin = f64::from(state.sigma_points.picture_margin);
    let inside = |at: f64, size: u32| {
        let size = f64::from(size);
        -margin * size <= at && at < size + margin * size
    };
    inside(pixel[0], camera.width) && inside(pixel[1], camera.height)
}

/// True if a sigma point of a Gaussian at `t` is visible together with it. It must be beyond the near plane. For a
/// fisheye it must be less than a right angle away, and the backward axis must be outside the cone of that angle about
/// `t`. For a panorama the poles must be outside that cone.
fn is_sigma_point_visible(camera: &OracleCamera, rules: &Rules, t: [f64; 3], point: [f64; 3]) -> bool {
    if let Some(lens) = &camera.lens
        && rules.lenses_fold
        && ideal_radius(camera, rules, point) >= lens.fold().least
    {
        return false;
    }
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
