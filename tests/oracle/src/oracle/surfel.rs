//! 2D Gaussians: the intersection of a pixel's ray with a disc's plane.
//!
//! In camera axes a disc has the scaled axes `a` and `b` and the centre `t`. A ray from `g` along `r` meets its plane
//! where `u a + v b + t - g = tau r`: by Cramer's rule `u = ((b x t') . r) / w`, `v = ((t' x a) . r) / w`, `tau = ((a x
//! b) . t') / w`, `w = (a x b) . r`, `t' = t - g`. The squared distance is `u^2 + v^2` where the ray meets the plane
//! (for a pinhole: at `tau > nearPlane`), or the filter's `|x - mean|^2 / lowPass` if that is less.

use super::error_model::{PrecisionClass, Rounding, UNIT_ROUNDOFF};
use super::{OracleCamera, OracleModel};

/// Number of roundings, of binary64 or with a relaxed precision of binary32, allowed for the numerators and for `w`.
const ROUNDINGS: f64 = 64.0;

/// A disc in camera axes.
#[derive(Clone, Copy, Debug)]
pub struct Surfel {
    pub(super) camera: OracleCamera,
    /// `a` and `b`.
    pub(super) axes: [[f64; 3]; 2],
    /// `t`.
    pub(super) centre: [f64; 3],
    /// The middle of the filter, which is the centre's pixel without a cut-off.
    pub(super) mean: [f64; 2],
    /// The squares of half the sides of its rectangle at one standard deviation, if it has a cut-off.
    pub(super) rectangle: Option<[f64; 2]>,
    /// The filter's variance.
    pub(super) low_pass: f64,
    /// The depth beyond which a pinhole's rays meet it.
    pub(super) beyond: f64,
    /// Relative error of alpha that is allowed for every disc.
    pub(super) fixed: f64,
    /// The magnitude of the operands whose difference the centre is.
    pub(super) operands: f64,
    /// The roundings of its projection.
    pub(super) rounding: Rounding,
}

impl Surfel {
    /// The squared distance of the pixel at (x, y), and the relative error of alpha.
    pub(super) fn distance(&self, [x, y]: [f64; 2]) -> (f64, f64) {
        let camera = &self.camera;
        let place = [x, y];
        let ray = [0, 1].map(|axis| (place[axis] - f64::from(camera.principal[axis])) / f64::from(camera.focal[axis]));
        let (origin, direction) = match camera.model {
            OracleModel::Orthographic => ([ray[0], ray[1], 0.0], [0.0, 0.0, 1.0]),
            _ => ([0.0; 3], [ray[0], ray[1], 1.0]),
        };
        let t = [0, 1, 2].map(|i| self.centre[i] - origin[i]);
        let [a, b] = self.axes;
        let w = dot(cross(a, b), direction);
        let [u, v] = [cross(b, t), cross(t, a)].map(|c| dot(c, direction) / w);
        let depth = dot(cross(a, b), t) / w;
        let is_met = match camera.model {
            OracleModel::Orthographic => w != 0.0,
            _ => w != 0.0 && depth > self.beyond,
        };
        let (unit, reach) = match self.rounding.class {
            PrecisionClass::Full => (0.5 * f64::EPSILON * ROUNDINGS, length(self.centre)),
            PrecisionClass::Relaxed => (UNIT_ROUNDOFF * ROUNDINGS, length(self.centre) + self.operands),
        };
        let (size_a, size_b) = (length(a), length(b));
        let error_w = unit * size_a * size_b * length(direction) / w.abs();
        let error_uv = unit * (size_a + size_b) * (reach + length(origin)) * length(direction) / w.abs();
        let met = u * u + v * v;
        let met_error = 2.0 * met.sqrt() * error_uv + 2.0 * met * error_w;
        let d = [x - self.mean[0], y - self.mean[1]];
        let filter = (d[0] * d[0] + d[1] * d[1]) / self.low_pass;
        let filter_error = match self.rounding.class {
            PrecisionClass::Full => 0.0,
            PrecisionClass::Relaxed => {
                let place = self.rounding.place;
                2.0 * UNIT_ROUNDOFF * (d[0].abs() * place[0] + d[1].abs() * place[1]) / self.low_pass
            }
        };
        let (distance, error) = if is_met && !(self.low_pass > 0.0 && filter < met) {
            (met, met_error)
        } else if self.low_pass > 0.0 {
            (filter, filter_error)
        } else {
            (f64::INFINITY, 0.0)
        };
        // The exponent is rounded once, and once more when its parts are added.
        let rounding = UNIT_ROUNDOFF * (self.fixed + 4.0 * distance.min(1e4));
        (distance, (rounding + 0.5 * error).min(1.0))
    }

    /// Left, right, top and bottom of the pixels that a squared distance of `q` may reach.
    pub(super) fn bounds(&self, q: f64) -> [f64; 4] {
        let everything = [f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY];
        // The ball about the disc.
        let radius = q.sqrt() * (length(self.axes[0]) + length(self.axes[1]));
        let circle = (q * self.low_pass).sqrt();
        let z = self.centre[2];
        let mut bounds = everything;
        for axis in 0..2 {
            let (focal, principal) = (f64::from(self.camera.focal[axis]), f64::from(self.camera.principal[axis]));
            let sides = [self.centre[axis] - radius, self.centre[axis] + radius];
            let places = match self.camera.model {
                OracleModel::Orthographic => vec![sides[0], sides[1]],
                _ if z - radius > 1e-6 * z => {
                    sides.iter().flat_map(|side| [side / (z - radius), side / (z + radius)]).collect()
                }
                _ => return everything,
            };
            let pixels = places.iter().map(|place| focal * place + principal);
            let least = pixels.clone().fold(self.mean[axis] - circle, f64::min);
            let greatest = pixels.fold(self.mean[axis] + circle, f64::max);
            (bounds[2 * axis], bounds[2 * axis + 1]) = (least, greatest);
        }
        bounds
    }
}

/// The rectangle of the outline of a disc of one standard deviation: its middle, in pixels from the centre's, and half its sides.
/// `None` if the outline touches the eye's plane.
pub(super) fn rectangle(camera: &OracleCamera, [a, b]: [[f64; 3]; 2], t: [f64; 3]) -> Option<[[f64; 2]; 2]> {
    let is_parallel = camera.model == OracleModel::Orthographic;
    let divisor = a[2] * a[2] + b[2] * b[2] - t[2] * t[2];
    if !is_parallel && divisor == 0.0 {
        return None;
    }
    let sides = [0, 1].map(|i| {
        let focal = f64::from(camera.focal[i]);
        if is_parallel {
            return [0.0, focal * a[i].hypot(b[i])];
        }
        let [along_a, along_b] = [a, b].map(|axis| focal * (axis[i] - axis[2] * t[i] / t[2]));
        let middle = (along_a * a[2] + along_b * b[2]) / divisor;
        let square = middle * middle - (along_a * along_a + along_b * along_b) / divisor;
        [middle, square.max(1e-4).sqrt()]
    });
    Some([[sides[0][0], sides[1][0]], [sides[0][1], sides[1][1]]])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
