//! A Gaussian in its own axes: depth along a pixel's ray.
//!
//! A pixel's ray starts at `e + R^T o` and runs along `R^T r`. With `B = diag(1 / s') R(q)^T`, the standard deviations
//! `s'` at least 2^-10 of the greatest (all 1 if that is 0), a Gaussian about `p` is greatest on the ray at `tau = (a .
//! b) / (a . a)`, where `a = B R^T r` and `b = B (p - e - R^T o)`. Depths are compared after rounding to 36 bits of the
//! significand, equal ones by the order of the draw.

use super::vectors::dot;
use super::{OracleCamera, OracleModel};

/// The least standard deviation as a share of the greatest.
const LEAST_RATIO: f64 = 1.0 / 1024.0;

/// Number of binary64 roundings allowed for `a` and `b`.
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
    /// The binary64 result.
    pub value: f64,
    /// The possible error of an implementation in binary64.
    pub error: f64,
}

impl OwnAxes {
    /// The depth of a Gaussian that has no place in space, only in the picture.
    pub(super) const NONE: Self = Self { rows: [[0.0; 3]; 3], offset: [0.0; 3] };

    /// The own axes of a Gaussian: the columns of `axes` (row-major), with its centre at `offset` from the eye.
    pub(super) fn new(axes: &[f64; 9], scale: [f64; 3], offset: [f64; 3]) -> Self {
        let greatest = scale[0].max(scale[1]).max(scale[2]);
        let rows = [0, 1, 2].map(|row| {
            let stretch = if greatest == 0.0 { 1.0 } else { 1.0 / (scale[row] / greatest).max(LEAST_RATIO) };
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
                let across = if angle == 0.0 { 1.0 } else { angle.sin() / angle };
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
        // The sum of the rounding errors of all terms, even if the terms cancel.
        let unit = 0.5 * f64::EPSILON * ROUNDINGS;
        let size = |v: [f64; 3]| dot(v, v).sqrt();
        let stretch = self.rows.iter().map(|&row| dot(row, row)).sum::<f64>().sqrt();
        let error_a = unit * stretch * size(direction);
        let error_b = unit * stretch * (size(self.offset) + size(origin));
        let error = error_b / square.sqrt() + 3.0 * size(b) * error_a / square;
        RayDepth { value, error }
    }
}
