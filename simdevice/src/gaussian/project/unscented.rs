//! The unscented transform: projects points that represent a Gaussian, and takes the mean and covariance of their
//! projections.
//!
//! There are seven points: the mean, and one on either side along each axis. By default these are at sqrt(3) standard
//! deviations: in the usual terms alpha is 1, beta 2 and kappa 0, so that the weights are 0 and 1/6 in the mean, 2 and 1/6
//! in the covariance. No weight is negative then, so that the covariance is positive semidefinite.

use super::scratch::Scratch;
use crate::gaussian::lanes::GROUP;
use crate::gaussian::linear_algebra::{self, cross, dot, length};
use crate::gaussian::view::camera::linearize;
use crate::gaussian::view::constants::ViewConstants;
use crate::gaussian::view::distortion::Lens;
use crate::gaussian::view::sigma_points::SigmaPoints;
use crate::state::gaussian::CameraModel;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The number of points of a Gaussian.
const POINTS: usize = 7;

/// The projection of a Gaussian's sigma points.
#[derive(Clone, Copy, Debug)]
enum Projected {
    /// The moments in the picture.
    Moments(Moments),
    /// The camera does not see all of the points, or an edge of the picture separates them.
    ByJacobian,
    /// Too few of the points lie in the picture for the Gaussian to be drawn.
    Outside,
}

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
        let camera = PointCamera { model: view.model, lens: view.lens.as_ref(), near: view.near.into() };
        let projected = if has_place {
            of_points(&camera, &view.sigma_points, t, own.map(to_camera))
        } else {
            Projected::ByJacobian
        };
        let moments = match projected {
            Projected::Moments(moments) => {
                for (axis, place) in moments.mean.into_iter().enumerate() {
                    scratch.screen.mean[axis][at] = place * view.focal[axis] + view.center[axis];
                }
                let Covariance { xx, xy, yy, determinant } = moments.covariance;
                let [xx, xy, yy] = [fx * fx * xx, fx * fy * xy, fy * fy * yy];
                // With a negative weight the sum may be no covariance, whatever its determinant is.
                let is_covariance = xx + view.low_pass >= 0.0 && yy + view.low_pass >= 0.0;
                [xx, xy, yy, if is_covariance { fx * fx * fy * fy * determinant } else { f64::NAN }]
            }
            Projected::ByJacobian => {
                let deviations = own.map(|axis| rows.map(|row| dot(row, axis)));
                let Covariance { xx, xy, yy, determinant } = Covariance::new(1.0, &deviations);
                [xx, xy, yy, determinant]
            }
            Projected::Outside => [f64::NAN; 4],
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

/// The camera of sigma points.
#[derive(Clone, Copy, Debug)]
struct PointCamera<'a> {
    model: CameraModel,
    lens: Option<&'a Lens>,
    near: f64,
}

/// The projection of a Gaussian at `t` with these axes, all in camera axes, for focal lengths of 1.
fn of_points(camera: &PointCamera<'_>, points: &SigmaPoints, t: [f64; 3], axes: [[f64; 3]; 3]) -> Projected {
    let straight = camera.place(t);
    let mut seen = [Some(straight); POINTS];
    for (axis, pair) in axes.iter().zip(seen[1..].as_chunks_mut::<2>().0) {
        for (sign, to) in [points.distance, -points.distance].into_iter().zip(pair) {
            let point = [0, 1, 2].map(|k| t[k] + sign * axis[k]);
            *to = camera.sees(t, point).then(|| {
                let [x, y] = camera.place(point);
                match camera.model {
                    CameraModel::Equirectangular => [straight[0] + wrapped(x - straight[0]), y],
                    _ => [x, y],
                }
            });
        }
    }
    if !points.show(&seen) {
        return Projected::Outside;
    }
    let mut places = [straight; POINTS];
    for (place, seen) in places.iter_mut().zip(seen) {
        let Some(seen) = seen else { return Projected::ByJacobian };
        *place = seen;
    }
    let mean = [0, 1].map(|axis| {
        let others = places[1..].iter().map(|place| place[axis] - straight[axis]);
        straight[axis] + points.other * others.sum::<f64>()
    });
    let deviations: [[f64; 2]; POINTS] = std::array::from_fn(|point| {
        let weight = if point == 0 { points.center.abs() } else { points.other };
        [0, 1].map(|axis| weight.sqrt() * (places[point][axis] - mean[axis]))
    });
    Projected::Moments(Moments { mean, covariance: Covariance::new(points.center.signum(), &deviations) })
}

impl Covariance {
    /// The sums of squares and products of weighted deviations, of which the first counts by its sign. The determinant is
    /// itself summed from squares, so that no digits cancel where deviations are almost on a line.
    fn new(first_sign: f64, deviations: &[[f64; 2]]) -> Self {
        let (mut xx, mut xy, mut yy, mut determinant) = (0.0, 0.0, 0.0, 0.0);
        for (number, &[x, y]) in deviations.iter().enumerate() {
            let sign = if number == 0 { first_sign } else { 1.0 };
            xx += sign * (x * x);
            xy += sign * (x * y);
            yy += sign * (y * y);
            for (earlier, &[earlier_x, earlier_y]) in deviations[..number].iter().enumerate() {
                let sign = if earlier == 0 { first_sign } else { 1.0 };
                let area = earlier_x * y - earlier_y * x;
                determinant += sign * (area * area);
            }
        }
        Self { xx, xy, yy, determinant }
    }
}

impl PointCamera<'_> {
    fn place(&self, t: [f64; 3]) -> [f64; 2] {
        let unbounded = [[f64::NEG_INFINITY; 2], [f64::INFINITY; 2]];
        linearize(self.model, self.lens, unbounded, t).place
    }

    /// True if the camera sees `point` of a Gaussian at `t`, and the projection is continuous between them.
    fn sees(&self, t: [f64; 3], point: [f64; 3]) -> bool {
        projects_continuously(self.model, self.near, t, point)
            // A place beyond the fold is NaN.
            && (self.lens.is_none() || !self.place(point)[0].is_nan())
    }
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
    use crate::state::Viewport;
    use crate::state::gaussian::{Camera, Distortion, DistortionModel, UnscentedTransform};

    const AXES: [[f64; 3]; 3] = [[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.3]];

    fn sigma_points(transform: UnscentedTransform) -> SigmaPoints {
        let viewport = Viewport { x: 0.0, y: 0.0, width: 8.0, height: 8.0, min_depth: 0.0, max_depth: 1.0 };
        SigmaPoints::new(&transform, &Camera::default(), &viewport)
    }

    /// The moments of a Gaussian with the axes [`AXES`]; `None` if some point is not seen.
    fn moments(model: CameraModel, t: [f64; 3]) -> Option<Moments> {
        let camera = PointCamera { model, lens: None, near: 0.2 };
        match of_points(&camera, &sigma_points(UnscentedTransform::default()), t, AXES) {
            Projected::Moments(moments) => Some(moments),
            _ => None,
        }
    }

    #[gaurast_runner::test]
    fn other_points_find_the_covariance_of_a_linear_camera_too() {
        let camera = PointCamera { model: CameraModel::Orthographic, lens: None, near: 0.2 };
        let points = sigma_points(UnscentedTransform { alpha: 0.1, ..UnscentedTransform::default() });
        let Projected::Moments(moments) = of_points(&camera, &points, [1.0, 2.0, 5.0], AXES) else {
            panic!("all points are seen");
        };
        let Covariance { xx, yy, determinant, .. } = moments.covariance;
        assert!((xx - 0.01).abs() < 1e-9 && (yy - 0.04).abs() < 1e-9 && (determinant - 0.0004).abs() < 1e-9);
    }

    #[gaurast_runner::test]
    fn points_beyond_the_fold_leave_it_to_the_jacobian() {
        let (model, radial) = (DistortionModel::Polynomial, [-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let lens = Lens::new(&Distortion { model, radial, tangential: [0.0; 2], thin_prism: [0.0; 4] });
        let camera = PointCamera { model: CameraModel::Pinhole, lens: Some(&lens), near: 0.2 };
        let points = sigma_points(UnscentedTransform::default());
        let at = |x: f64| of_points(&camera, &points, [x, 0.0, 2.0], AXES);
        assert!(matches!(at(0.5), Projected::Moments(_)));
        assert!(matches!(at(1.6), Projected::ByJacobian));
    }

    #[gaurast_runner::test]
    fn a_linear_camera_takes_covariances_as_they_are() {
        let t = [1.0, 2.0, -5.0];
        let moments = moments(CameraModel::Orthographic, t).unwrap();
        assert_eq!(moments.mean, [1.0, 2.0]);
        let expected = [0.01, 0.0, 0.04, 0.0004];
        let Covariance { xx, xy, yy, determinant } = moments.covariance;
        let found = [xx, xy, yy, determinant];
        let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(close, "{found:?}");
    }

    #[gaurast_runner::test]
    fn points_that_are_not_seen_leave_it_to_the_jacobian() {
        let seen = |model, t| moments(model, t).is_some();
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
            moments(CameraModel::Equirectangular, t).unwrap()
        });
        assert!((behind.covariance.xx - ahead.covariance.xx).abs() < 1e-12);
        assert!((behind.mean[0].abs() - PI).abs() < 1e-12);
    }
}
