//! The per-pixel order: depth along a pixel's ray, and which orders it allows.
//!
//! A pixel's ray starts at `e + R^T o` and runs along `R^T r`. With `B = diag(1 / s') R(q)^T`, the standard deviations `s'`
//! at least 2^-10 of the greatest (all 1 if that is 0), a Gaussian about `p` is greatest on the ray at
//! `tau = (a . b) / (a . a)`, where `a = B R^T r` and `b = B (p - e - R^T o)`. Depths are compared after rounding to 36 bits
//! of the significand, equal ones by the order of the draw.
//!
//! Where an honest binary64 implementation may round to another number, neighbours whose order that decides are
//! undecidable, and the reference follows both orders.

use super::pixel::{MAX_DECISIONS, Pixel};
use super::{OracleCamera, OracleModel};

/// The least standard deviation as a share of the greatest.
const LEAST_RATIO: f64 = 1.0 / 1024.0;

/// Roundings of binary64 granted to `a` and `b`.
const ROUNDINGS: f64 = 32.0;

/// A Gaussian in its own axes, in standard deviations.
#[derive(Clone, Copy, Debug)]
pub struct OwnAxes {
    /// B's rows, in world axes.
    rows: [[f64; 3]; 3],
    /// Its centre from the eye, in world axes.
    offset: [f64; 3],
}

/// A depth along a ray.
#[derive(Clone, Copy, Debug)]
pub struct RayDepth {
    /// What binary64 says.
    pub value: f64,
    /// How far an implementation in binary64 may be from it.
    pub error: f64,
}

impl OwnAxes {
    /// Of what is nowhere but in the picture.
    pub(super) const NONE: Self = Self {
        rows: [[0.0; 3]; 3],
        offset: [0.0; 3],
    };

    /// Of a Gaussian whose own axes are the columns of `axes` (row-major), `offset` from the eye.
    pub(super) fn new(axes: &[f64; 9], scale: [f64; 3], offset: [f64; 3]) -> Self {
        let greatest = scale[0].max(scale[1]).max(scale[2]);
        let rows = [0, 1, 2].map(|row| {
            let stretch = if greatest == 0.0 {
                1.0
            } else {
                1.0 / (scale[row] / greatest).max(LEAST_RATIO)
            };
            [0, 1, 2].map(|column| axes[3 * column + row] * stretch)
        });
        Self { rows, offset }
    }

    /// The depth along the ray through a point of the picture, in pixels from the viewport's corner.
    pub fn depth(&self, camera: &OracleCamera, [x, y]: [f64; 2]) -> RayDepth {
        let u = (x - f64::from(camera.principal[0])) / f64::from(camera.focal[0]);
        let v = (y - f64::from(camera.principal[1])) / f64::from(camera.focal[1]);
        let (origin, direction) = match camera.model {
            OracleModel::Pinhole => ([0.0; 3], [u, v, 1.0]),
            OracleModel::Orthographic => ([u, v, 0.0], [0.0, 0.0, 1.0]),
            OracleModel::Fisheye => {
                let angle = u.hypot(v);
                let across = if angle == 0.0 {
                    1.0
                } else {
                    angle.sin() / angle
                };
                ([0.0; 3], [across * u, across * v, angle.cos()])
            }
            OracleModel::Equirectangular => {
                let level = v.cos();
                ([0.0; 3], [level * u.sin(), v.sin(), level * u.cos()])
            }
        };
        let to_world = |camera_axes: [f64; 3]| {
            let r = camera.rotation.map(f64::from);
            [0, 1, 2].map(|i| (0..3).map(|k| r[3 * k + i] * camera_axes[k]).sum::<f64>())
        };
        let (origin, direction) = (to_world(origin), to_world(direction));
        self.along(origin, direction)
    }

    /// The depth along a ray from `origin`, relative to the eye, both in world axes.
    pub fn along(&self, origin: [f64; 3], direction: [f64; 3]) -> RayDepth {
        let from = [0, 1, 2].map(|i| self.offset[i] - origin[i]);
        let a = self.rows.map(|row| dot(row, direction));
        let b = self.rows.map(|row| dot(row, from));
        let square = dot(a, a);
        let value = dot(a, b) / square;
        // Sums of products: each term's rounding, however the terms cancel.
        let unit = 0.5 * f64::EPSILON * ROUNDINGS;
        let size = |v: [f64; 3]| dot(v, v).sqrt();
        let stretch = self
            .rows
            .iter()
            .map(|&row| dot(row, row))
            .sum::<f64>()
            .sqrt();
        let error_a = unit * stretch * size(direction);
        let error_b = unit * stretch * (size(self.offset) + size(origin));
        let error = error_b / square.sqrt() + 3.0 * size(b) * error_a / square;
        RayDepth { value, error }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Rounds to 36 bits of the significand, halves away from zero.
pub fn rounded(depth: f64) -> f64 {
    let bits = depth.to_bits().wrapping_add(1 << 15);
    f64::from_bits(bits & !0xFFFF) + 0.0
}

/// Composites what reaches a pixel in every order that its depths allow: what binary64 says first, then the others.
///
/// `reached` is in the order of the draw; `add` adds one of it to a pixel.
pub(super) fn composite<T>(reached: &[(RayDepth, T)], add: impl Fn(&mut Pixel, &T)) -> Pixel {
    let mut nominal: Vec<usize> = (0..reached.len()).collect();
    let key = |index: usize| rounded(reached[index].0.value);
    nominal.sort_by(|&a, &b| key(a).total_cmp(&key(b)));
    let draw = |order: &[usize]| {
        let mut pixel = Pixel::EMPTY;
        for &index in order {
            add(&mut pixel, &reached[index].1);
        }
        pixel
    };
    let mut pixel = draw(&nominal);
    let swaps: Vec<usize> = (1..nominal.len())
        .filter(|&at| may_swap(reached, nominal[at - 1], nominal[at]))
        .collect();
    let followed = swaps.len().min(MAX_DECISIONS as usize);
    for which in 1..1usize << followed {
        let mut order = nominal.clone();
        for (bit, &at) in swaps[..followed].iter().enumerate() {
            if which >> bit & 1 == 1 {
                order.swap(at - 1, at);
            }
        }
        pixel.take_ways_of(draw(&order));
    }
    if followed < swaps.len() {
        pixel.exhaust();
    }
    pixel
}

/// Whether of two neighbours the second may come first.
fn may_swap<T>(reached: &[(RayDepth, T)], first: usize, second: usize) -> bool {
    let greatest = |depth: &RayDepth| rounded(depth.value + depth.error);
    let least = |depth: &RayDepth| rounded(depth.value - depth.error);
    let (latest, earliest) = (greatest(&reached[first].0), least(&reached[second].0));
    // Equal ones are in the order of the draw.
    earliest < latest || earliest == latest && second < first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_36_bits() {
        let step = 2.0f64.powi(-36);
        for x in [1.5, -1.5, 1.0 + step, -1.0 - 3.0 * step] {
            assert_eq!(rounded(x), x);
            assert_eq!(rounded(x + 0.4 * step), x);
            assert_eq!(rounded(x - 0.2 * step), x);
        }
        assert_eq!(rounded(1.0 + 0.5 * step), 1.0 + step);
        assert!(rounded(-0.0).is_sign_positive());
    }

    #[test]
    fn orders_are_followed_where_they_cannot_be_told() {
        let depth = |value: f64| RayDepth {
            value,
            error: 1e-14,
        };
        let step = 2.0f64.powi(-36);
        let swap = |a: f64, b: f64| may_swap(&[(depth(a), ()), (depth(b), ())], 0, 1);
        assert!(!swap(1.0, 2.0));
        // Equal for certain: the order of the draw.
        assert!(!swap(1.0, 1.0));
        // Either may round to the next number; where only the first may, they are equal at most.
        assert!(swap(1.0 + 0.5 * step, 1.0 + 0.5 * step));
        assert!(!swap(1.0 + 0.5 * step, 1.0 + 0.6 * step));
        assert!(!swap(1.0, 1.0 + 0.5 * step));
    }
}
