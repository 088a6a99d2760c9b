//! The sigma points of the unscented transform: their distance from the mean, their weights, and the part of the picture
//! in which they count.

use crate::state::Viewport;
use crate::state::gaussian::{Camera, UnscentedTransform};

/// The number of dimensions of a Gaussian.
const DIMENSIONS: f64 = 3.0;

/// The sigma points of a view.
#[derive(Clone, Debug)]
pub(crate) struct SigmaPoints {
    /// The distance of the points from the mean, in standard deviations.
    pub(crate) distance: f64,
    /// The weight of the mean's point in the covariance. It may be negative.
    pub(crate) center: f64,
    /// The weight of each other point, in the mean and in the covariance.
    pub(crate) other: f64,
    /// Bounds of the points that count, for focal lengths of 1 and relative to the principal point; `None` if Gaussians are
    /// drawn wherever their points lie.
    pub(crate) picture: Option<[[f64; 2]; 2]>,
    /// True if all points must lie in these bounds, false if one must.
    pub(crate) needs_all: bool,
    /// True if the points are those that are taken by default.
    pub(crate) are_default: bool,
}

impl SigmaPoints {
    pub(crate) fn new(transform: &UnscentedTransform, camera: &Camera, viewport: &Viewport) -> Self {
        let [alpha, beta, kappa] = [transform.alpha, transform.beta, transform.kappa].map(f64::from);
        // n + lambda in the usual terms.
        let spread = alpha * alpha * (DIMENSIONS + kappa);
        let size = [viewport.width, viewport.height].map(f64::from);
        let margin = f64::from(transform.picture_margin);
        let place = |axis: usize, pixel: f64| {
            (pixel - f64::from(camera.principal_point[axis])) / f64::from(camera.focal_length[axis])
        };
        let picture = [
            [0, 1].map(|axis| place(axis, -margin * size[axis])),
            [0, 1].map(|axis| place(axis, size[axis] + margin * size[axis])),
        ];
        Self {
            distance: spread.sqrt(),
            center: (spread - DIMENSIONS) / spread + 1.0 - alpha * alpha + beta,
            other: 1.0 / (2.0 * spread),
            picture: (margin < f64::INFINITY).then_some(picture),
            needs_all: transform.needs_all,
            are_default: *transform == UnscentedTransform::default(),
        }
    }

    /// True if a Gaussian is drawn whose points project to `places`; `None` is a point that the camera does not see.
    pub(crate) fn show(&self, places: &[Option<[f64; 2]>]) -> bool {
        let Some([least, end]) = self.picture else {
            return true;
        };
        let is_inside = |place: &Option<[f64; 2]>| {
            place.is_some_and(|place| (0..2).all(|axis| (least[axis]..end[axis]).contains(&place[axis])))
        };
        if self.needs_all { places.iter().all(is_inside) } else { places.iter().any(is_inside) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEWPORT: Viewport = Viewport { x: 7.0, y: 0.0, width: 100.0, height: 50.0, min_depth: 0.0, max_depth: 1.0 };

    #[gaurast_runner::test]
    fn the_default_has_no_negative_weight() {
        let points = SigmaPoints::new(&UnscentedTransform::default(), &Camera::default(), &VIEWPORT);
        assert_eq!((points.distance, points.center, points.other), (3.0f64.sqrt(), 2.0, 1.0 / 6.0));
        assert!(points.are_default && points.show(&[None]));
    }

    #[gaurast_runner::test]
    fn near_points_have_a_negative_weight_in_their_middle() {
        let transform = UnscentedTransform { alpha: 0.1, ..UnscentedTransform::default() };
        let points = SigmaPoints::new(&transform, &Camera::default(), &VIEWPORT);
        assert!((points.distance - 0.173_205).abs() < 1e-6 && (points.center + 96.01).abs() < 1e-3);
    }

    #[gaurast_runner::test]
    fn points_count_in_the_picture_and_its_margin() {
        let camera = Camera { focal_length: [10.0, 10.0], principal_point: [50.0, 25.0], ..Camera::default() };
        let transform = UnscentedTransform { picture_margin: 0.1, ..UnscentedTransform::default() };
        let any = SigmaPoints::new(&transform, &camera, &VIEWPORT);
        let all = SigmaPoints::new(&UnscentedTransform { needs_all: true, ..transform }, &camera, &VIEWPORT);
        let [inside, outside] = [Some([-5.9, 2.9]), Some([-6.1, 0.0])];
        assert!(any.show(&[outside, inside, None]) && !any.show(&[outside, None]));
        assert!(all.show(&[inside, inside]) && !all.show(&[inside, outside]) && !all.show(&[inside, None]));
    }
}
