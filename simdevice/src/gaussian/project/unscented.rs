//! The unscented transform: projects points that represent a Gaussian, and takes the mean and covariance of their
//! projections.
//!
//! There are seven points: the mean, and one on either side along each axis at sqrt(3) standard deviations. In the
//! usual terms alpha is 1, beta 2 and kappa 0, so that the weights are 0 and 1/6 in the mean, 2 and 1/6 in the
//! covariance. No weight is negative, so that the covariance is positive semidefinite.

use super::scratch::Scratch;
use crate::gaussian::lanes::GROUP;
use crate::gaussian::linear_algebra::{self, cross, dot, length};
use crate::gaussian::view::camera::linearize;
use crate::gaussian::view::constants::ViewConstants;
use crate::state::gaussian::CameraModel;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The distance of the points from the mean, in standard deviations: the square root of the number of dimensions.
const DISTANCE: f64 = 1.732_050_807_568_877_2;

/// The weight of the mean's point in the covariance; `OTHER` is the weight of each other point.
const CENTER: f64 = 2.0;

const OTHER: f64 = 1.0 / 6.0;

/// The number of points of a Gaussian.
const POINTS: usize = 7;

/// The mean and the covariance of a Gaussian in the picture.
#[derive(Clone, Copy, Debug)]
struct Moments {
    mean: [f64; 2],
    covariance: Covariance,
}

/// The elements of a covariance, and its determinant.
#[derive(Clone, Copy, Debug)]
struct Covariance {
    xx: f64,
    xy: f64,
    yy: f64,
    determinant: f64,
}

/// Computes means and covariances of the kept Gaussians. Where the camera does not see all points, the Jacobian is
/// used, which must be computed already.
pub(crate) fn transform(view: &ViewConstants, by_matrices: bool, scratch: &mut Scratch) {
    let r = &view.rotation;
    let models = scratch.models.as_deref().filter(|_| by_matrices);
    let [fx, fy] = view.focal;
    for at in 0..scratch.lanes.len().min(GROUP) {
        let quaternion = scratch.rotation.each_ref().map(|lanes| lanes[at]);
        let scale = scratch.scale.each_ref().map(|lanes| lanes[at]);
        let own = axes(quaternion, scale);
        let rows = scratch.jacobian.each_ref().map(|row| row.each_ref().map(|lanes| lanes[at]));
        let t = scratch.camera.each_ref().map(|lanes| lanes[at]);
        let to_camera = |axis: [f64; 3]| {
            let axis = models.map_or(axis, |models| models.to_world(at, axis));
            [0, 3, 6].map(|row| r[row] * axis[0] + r[row + 1] * axis[1] + r[row + 2] * axis[2])
        };
        let has_place = !rows[0][0].is_nan();
        let seen = has_place.then(|| own.map(to_camera));
        let seen = seen.and_then(|axes| of_points(view.model, view.near.into(), t, axes));
        let moments = match seen {
            Some(moments) => {
                for (axis, place) in moments.mean.into_iter().enumerate() {
                    scratch.screen.mean[axis][at] = place * view.focal[axis] + view.center[axis];
                }
                let Covariance { xx, xy, yy, determinant } = moments.covariance;
                [fx * fx * xx, fx * fy * xy, fy * fy * yy, fx * fx * fy * fy * determinant]
            }
            None => {
                let deviations = own.map(|axis| rows.map(|row| dot(row, axis)));
                let Covariance { xx, xy, yy, determinant } = Covariance::new(&deviations);
                [xx, xy, yy, determinant]
            }
        };
        for (lanes, moment) in scratch.moments.iter_mut().zip(moments) {
            lanes[at] = moment;
        }
    }
}

/// The axes of a Gaussian, each as long as its standard deviation.
pub(crate) fn axes(quaternion: [f64; 4], scale: [f64; 3]) -> [[f64; 3]; 3] {
    let columns = linear_algebra::axes(quaternion);
    [0, 1, 2].map(|axis| columns[axis].map(|c| c * scale[axis]))
}

/// The moments in the picture of a Gaussian at `t` with these axes, all in camera axes, for focal lengths of 1. `None`
/// if the camera does not see all its points, or an edge of the picture separates them.
fn of_points(model: CameraModel, near: f64, t: [f64; 3], axes: [[f64; 3]; 3]) -> Option<Moments> {
    let straight = place(model, t);
    let mut places = [straight; POINTS];
    for (axis, pair) in axes.iter().zip(places[1..].as_chunks_mut::<2>().0) {
        for (sign, to) in [DISTANCE, -DISTANCE].into_iter().zip(pair) {
            let point = [0, 1, 2].map(|k| t[k] + sign * axis[k]);
            if !projects_continuously(model, near, t, point) {
                return None;
            }
            *to = place(model, point);
            if model == CameraModel::Equirectangular {
                to[0] = straight[0] + wrapped(to[0] - straight[0]);
            }
        }
    }
    let mean = [0, 1].map(|axis| {
        let others = places[1..].iter().map(|place| place[axis] - straight[axis]);
        straight[axis] + OTHER * others.sum::<f64>()
    });
    let deviations: [[f64; 2]; POINTS] = std::array::from_fn(|point| {
        let weight = if point == 0 { CENTER } else { OTHER };
        [0, 1].map(|axis| weight.sqrt() * (places[point][axis] - mean[axis]))
    });
    Some(Moments { mean, covariance: Covariance::new(&deviations) })
}

impl Covariance {
    /// The sums of squares and products of weighted deviations. The determinant is itself summed from squares, so that no
    /// digits cancel where deviations are almost on a line.
    fn new(deviations: &[[f64; 2]]) -> Self {
        let (mut xx, mut xy, mut yy, mut determinant) = (0.0, 0.0, 0.0, 0.0);
        for (number, &[x, y]) in deviations.iter().enumerate() {
            xx += x * x;
            xy += x * y;
            yy += y * y;
            for &[earlier_x, earlier_y] in &deviations[..number] {
                let area = earlier_x * y - earlier_y * x;
                determinant += area * area;
            }
        }
        Self { xx, xy, yy, determinant }
    }
}

fn place(model: CameraModel, t: [f64; 3]) -> [f64; 2] {
    let unbounded = [[f64::NEG_INFINITY; 2], [f64::INFINITY; 2]];
    linearize(model, unbounded, t).place
}

/// True if the camera sees `point` of a Gaussian at `t`, and the projection is continuous between them. A pinhole sees
/// points beyond the near plane. Cameras that see all around accept points at less than a right angle from `t`, with no
/// singularity of the projection as near as that.
fn projects_continuously(model: CameraModel, near: f64, t: [f64; 3], point: [f64; 3]) -> bool {
    let angle = || libm::atan2(length(cross(t, point)), dot(t, point));
    let [x, y, z] = t;
    match model {
        CameraModel::Pinhole => point[2] > near,
        CameraModel::Orthographic => true,
        CameraModel::Fisheye => {
            let angle = angle();
            angle < FRAC_PI_2 && libm::atan2(libm::hypot(x, y), z) + angle < PI
        }
        CameraModel::Equirectangular => {
            let latitude = libm::atan2(y, libm::hypot(x, z)).abs();
            latitude + angle() < FRAC_PI_2
        }
    }
}

/// An angle modulo a whole turn, in [-pi, pi), if it is at most one turn outside.
fn wrapped(angle: f64) -> f64 {
    if angle >= PI {
        angle - TAU
    } else if angle < -PI {
        angle + TAU
    } else {
        angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXES: [[f64; 3]; 3] = [[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.3]];

    #[gaurast_runner::test]
    fn a_linear_camera_takes_covariances_as_they_are() {
        let t = [1.0, 2.0, -5.0];
        let moments = of_points(CameraModel::Orthographic, 0.2, t, AXES).unwrap();
        assert_eq!(moments.mean, [1.0, 2.0]);
        let expected = [0.01, 0.0, 0.04, 0.0004];
        let Covariance { xx, xy, yy, determinant } = moments.covariance;
        let found = [xx, xy, yy, determinant];
        let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(close, "{found:?}");
    }

    #[gaurast_runner::test]
    fn points_that_are_not_seen_leave_it_to_the_jacobian() {
        let seen = |model, t| of_points(model, 0.2, t, AXES).is_some();
        assert!(seen(CameraModel::Pinhole, [0.0, 0.0, 0.8]));
        assert!(!seen(CameraModel::Pinhole, [0.0, 0.0, 0.7]));
        assert!(seen(CameraModel::Fisheye, [0.0, 1.0, -1.0]));
        assert!(!seen(CameraModel::Fisheye, [0.0, 0.1, -1.0]));
        assert!(!seen(CameraModel::Fisheye, [0.1, 0.1, 0.1]));
        assert!(seen(CameraModel::Equirectangular, [0.0, 1.0, -1.0]));
        assert!(!seen(CameraModel::Equirectangular, [0.1, 1.0, 0.1]));
    }

    #[gaurast_runner::test]
    fn a_panorama_s_points_stay_together_at_the_seam() {
        let [ahead, behind] = [1.0, -1.0].map(|sign| {
            let t = [0.0, 0.2, 2.0 * sign];
            of_points(CameraModel::Equirectangular, 0.2, t, AXES).unwrap()
        });
        assert!((behind.covariance.xx - ahead.covariance.xx).abs() < 1e-12);
        assert!((behind.mean[0].abs() - PI).abs() < 1e-12);
    }
}
