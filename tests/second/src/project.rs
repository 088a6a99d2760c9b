//! Steps 1 to 5: the projection of one Gaussian to the picture.

use crate::harmonics;
use crate::linear::{Matrix, Vector, apply, cross, dot, length, row_times, scaled, subtract, widened};
use crate::viewport::Viewport;

/// The attributes of one Gaussian, as binary32.
#[derive(Clone, Copy, Debug)]
pub struct Gaussian<'a> {
    /// The mean, in units of world space.
    pub position: [f32; 3],
    /// Standard deviations along the Gaussian's own axes, in units of world space.
    pub scale: [f32; 3],
    /// A quaternion, w first, that rotates the Gaussian's own axes to those of the world.
    pub rotation: [f32; 4],
    /// The greatest alpha, before compensation.
    pub opacity: f32,
    /// Coefficients of red, green and blue: at least (degree + 1)^2 of them.
    pub harmonics: &'a [[f32; 3]],
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Rows: right, down and forward of the picture, in world space.
    pub rotation: [[f32; 3]; 3],
    /// The eye, in units of world space.
    pub eye: [f64; 3],
    /// Focal lengths, in pixels.
    pub focal_length: [f32; 2],
    /// The principal point, in pixels from the upper left corner of the viewport's area.
    pub principal_point: [f32; 2],
    /// The near plane: Gaussians with a greater depth are drawn.
    pub near_plane: f32,
    /// The far plane: Gaussians with a smaller depth are drawn. It may be infinite.
    pub far_plane: f32,
    /// The coefficients of the depth: the first, plus the second divided by z.
    pub depth_coefficients: [f32; 2],
}

/// The change of the opacity with the low-pass filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Antialiasing {
    /// The opacity does not change.
    Dilate,
    /// The opacity decreases as the projected area increases.
    OpacityCompensated,
}

/// The Gaussian state of a pipeline.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// The degree of harmonics that is drawn: 0 to 4.
    pub spherical_harmonics_degree: usize,
    /// The change of the opacity with the low-pass filter.
    pub antialiasing: Antialiasing,
    /// The variance of the low-pass filter, in px^2.
    pub low_pass_variance: f32,
    /// The least alpha that contributes.
    pub alpha_floor: f32,
    /// The greatest alpha.
    pub alpha_ceiling: f32,
    /// The least transmittance that a pixel may reach.
    pub transmittance_floor: f32,
}

/// A Gaussian after projection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projected {
    /// The mean, in pixels from the upper left corner of the viewport's area.
    pub(crate) mean: [f64; 2],
    /// Rows of M.
    pub(crate) rows: [Vector; 2],
    pub(crate) low_pass: f64,
    /// The determinant of S.
    pub(crate) determinant: f64,
    pub(crate) opacity: f64,
    pub(crate) color: Vector,
    /// Depth and sort key.
    pub(crate) z: f32,
}

impl Projected {
    /// The diagonal of S, in px^2.
    pub(crate) fn variances(&self) -> [f64; 2] {
        self.rows.map(|row| dot(row, row) + self.low_pass)
    }

    /// d^T S^-1 d, computed as a square: the adjugate of M M^T, applied to d twice. No digits cancel for long and
    /// narrow S.
    pub(crate) fn squared_distance(&self, d: [f64; 2]) -> f64 {
        let across = subtract(scaled(self.rows[1], d[0]), scaled(self.rows[0], d[1]));
        (dot(across, across) + self.low_pass * (d[0] * d[0] + d[1] * d[1])) / self.determinant
    }
}

/// Projects the Gaussian; returns `None` if a step skips it.
pub(crate) fn project(
    gaussian: &Gaussian<'_>,
    camera: &Camera,
    viewport: &Viewport,
    state: &State,
) -> Option<Projected> {
    let coefficients = &gaussian.harmonics[..(state.spherical_harmonics_degree + 1).pow(2)];
    // Step 1.
    let finite = gaussian.position.iter().chain(&gaussian.scale).chain(&gaussian.rotation).chain([&gaussian.opacity]);
    if !finite.chain(coefficients.iter().flatten()).all(|value| value.is_finite())
        || gaussian.rotation.iter().all(|&component| component == 0.0)
        || gaussian.scale.iter().any(|&scale| scale < 0.0)
        || gaussian.opacity < state.alpha_floor
    {
        return None;
    }
    // Step 2.
    let direction = subtract(widened(gaussian.position), camera.eye);
    let to_camera: Matrix = camera.rotation.map(widened);
    let t = apply(&to_camera, direction);
    let z = t[2] as f32;
    if !(camera.near_plane < z && z < camera.far_plane) {
        return None;
    }
    // Step 3.
    let focal = widened(camera.focal_length);
    let principal = widened(camera.principal_point);
    let slopes = [t[0] / t[2], t[1] / t[2]];
    let mean = [0, 1].map(|axis| focal[axis] * slopes[axis] + principal[axis]);
    let to_world = turn(gaussian.rotation);
    let rows = [0, 1].map(|axis| {
        let size = viewport.size()[axis];
        let margin = 0.15 * size / focal[axis];
        let least = -(principal[axis] / focal[axis] + margin);
        let greatest = (size - principal[axis]) / focal[axis] + margin;
        let mut jacobian = [0.0, 0.0, -focal[axis] * slopes[axis].clamp(least, greatest) / t[2]];
        jacobian[axis] = focal[axis] / t[2];
        let row = row_times(row_times(jacobian, &to_camera), &to_world);
        [0, 1, 2].map(|own| row[own] * f64::from(gaussian.scale[own]))
    });
    // Step 4.
    let low_pass = f64::from(state.low_pass_variance);
    let area = length(cross(rows[0], rows[1]));
    let trace = dot(rows[0], rows[0]) + dot(rows[1], rows[1]);
    let determinant = area * area + low_pass * trace + low_pass * low_pass;
    if !(determinant > 0.0 && determinant.is_finite()) {
        return None;
    }
    let opacity = f64::from(gaussian.opacity)
        * match state.antialiasing {
            Antialiasing::Dilate => 1.0,
            Antialiasing::OpacityCompensated => area / determinant.sqrt(),
        };
    Some(Projected { mean, rows, low_pass, determinant, opacity, color: color(direction, coefficients), z })
}

/// R(q), of a quaternion that need not be normalized.
fn turn(quaternion: [f32; 4]) -> Matrix {
    let largest = quaternion.iter().fold(0.0f32, |largest, component| largest.max(component.abs()));
    let scaled = widened(quaternion).map(|component| component / f64::from(largest));
    let norm = scaled.iter().map(|component| component * component).sum::<f64>().sqrt();
    let [w, x, y, z] = scaled.map(|component| component / norm);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// Step 5: the colour in a direction, which need not be normalized.
fn color(direction: Vector, coefficients: &[[f32; 3]]) -> Vector {
    let functions = harmonics::functions(scaled(direction, 1.0 / length(direction)));
    [0, 1, 2].map(|component| {
        let sum: f64 = coefficients.iter().zip(functions).map(|(k, y)| y * f64::from(k[component])).sum();
        (0.5 + sum).clamp(0.0, f64::from(f32::MAX))
    })
}
