//! Projection of 3D Gaussians to oriented quads on the processor, in binary32, as 3DGS does it.

use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Quat, Vec2, Vec3};

use gaurast_scene::Scene;
use gaurast_scene::camera::Camera;

/// The number of spherical harmonics that are evaluated at most: degree 3.
const COEFFICIENTS: usize = 16;

/// Variance that is added on the screen, in px^2.
const LOW_PASS: f32 = 0.3;

/// Gaussians nearer than this are not drawn.
const NEAR: f32 = 0.2;

/// A Gaussian on the screen, as the vertex shader reads it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Splat {
    mean: [f32; 2],
    major: [f32; 2],
    minor: [f32; 2],
    radius: f32,
    unused: f32,
    color: [f32; 4],
}

/// A camera with precomputed values for many Gaussians.
pub(super) struct Projection {
    rotation: Mat3,
    eye: Vec3,
    focal: Vec2,
    principal: Vec2,
    size: Vec2,
    /// Least and greatest slopes to which the Jacobian's point is clamped.
    slopes: [Vec2; 2],
    alpha_floor: f32,
    coefficients: usize,
}

impl Projection {
    pub(super) fn new(camera: &Camera, sh_degree: u32, alpha_floor: f32) -> Self {
        let focal = Vec2::from_array(camera.focal.map(|f| f as f32));
        let principal = Vec2::from_array(camera.principal.map(|c| c as f32));
        let size = Vec2::new(camera.width as f32, camera.height as f32);
        let beyond = 0.15 * size;
        Self {
            rotation: Mat3::from_cols_array_2d(&camera.rotation.map(|row| row.map(|c| c as f32))).transpose(),
            eye: Vec3::from_array(camera.eye.map(|c| c as f32)),
            focal,
            principal,
            size,
            slopes: [-(principal + beyond) / focal, (size - principal + beyond) / focal],
            alpha_floor,
            coefficients: (sh_degree as usize + 1).pow(2).min(COEFFICIENTS),
        }
    }

    /// Gaussian `index` of `scene` on the screen and its depth, or `None` if it is not visible.
    pub(super) fn splat(&self, scene: &Scene, index: usize) -> Option<(f32, Splat)> {
        let shape = &scene.shapes()[index];
        let position = Vec3::from_array(scene.positions()[index]);
        let view = self.rotation * (position - self.eye);
        // Written like this, the condition also rejects NaN.
        if !(view.z > NEAR && shape.opacity >= self.alpha_floor) {
            return None;
        }
        let slope = view.truncate() / view.z;
        let mean = self.focal * slope + self.principal;
        // The square of the distance at which alpha reaches its floor, in standard deviations.
        let reach = 2.0 * (shape.opacity / self.alpha_floor).ln();
        let radius = reach.sqrt();
        // The greatest reach is along the longest axis, enlarged by the slope of the view.
        let longest = Vec3::from_array(shape.scale).max_element();
        let bound =
            radius * (longest / view.z * self.focal.max_element() * (1.0 + self.widest_slope()) + LOW_PASS.sqrt());
        if self.misses(mean, Vec2::splat(bound)) {
            return None;
        }
        let [xx, xy, yy] = self.covariance(shape.scale, shape.rotation, view, slope);
        if self.misses(mean, Vec2::new(xx, yy).max(Vec2::ZERO).map(f32::sqrt) * radius) {
            return None;
        }
        let (major, minor) = axes(xx, xy, yy)?;
        let color = self.color(scene, index, position);
        Some((
            view.z,
            Splat {
                mean: mean.into(),
                major: major.into(),
                minor: minor.into(),
                radius,
                unused: 0.0,
                color: color.extend(shape.opacity).into(),
            },
        ))
    }

    fn widest_slope(&self) -> f32 {
        self.slopes[0].abs().max(self.slopes[1].abs()).element_sum()
    }

    fn misses(&self, mean: Vec2, half: Vec2) -> bool {
        let (least, greatest) = (mean - half, mean + half);
        !(greatest.cmpgt(Vec2::ZERO).all() && least.cmplt(self.size).all())
    }

    /// xx, xy and yy of the covariance on the screen.
    fn covariance(&self, scale: [f32; 3], rotation: [f32; 4], view: Vec3, slope: Vec2) -> [f32; 3] {
        let [w, x, y, z] = rotation;
        let axes = Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize());
        let slope = slope.clamp(self.slopes[0], self.slopes[1]);
        let along = self.focal / view.z;
        // Rows of the Jacobian times the view's rotation: world to screen.
        let rows = self.rotation.transpose();
        let row_x = (rows.x_axis - rows.z_axis * slope.x) * along.x;
        let row_y = (rows.y_axis - rows.z_axis * slope.y) * along.y;
        let scale = Vec3::from_array(scale);
        let x = axes.transpose() * row_x * scale;
        let y = axes.transpose() * row_y * scale;
        [x.dot(x) + LOW_PASS, x.dot(y), y.dot(y) + LOW_PASS]
    }

    /// The colour seen from the eye.
    fn color(&self, scene: &Scene, index: usize, position: Vec3) -> Vec3 {
        let stride = scene.sh_stride();
        let sh = &scene.sh()[index * stride..][..stride.min(self.coefficients)];
        let weights = harmonics((position - self.eye).normalize(), sh.len());
        let sum =
            sh.iter().zip(weights).fold(Vec3::splat(0.5), |sum, (sh, weight)| sum + weight * Vec3::from_array(*sh));
        sum.max(Vec3::ZERO)
    }
}

/// The standard deviations along the ellipse's axes, or `None` if the covariance has no ellipse.
fn axes(xx: f32, xy: f32, yy: f32) -> Option<(Vec2, Vec2)> {
    let (middle, half) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
    let spread = half.hypot(xy);
    let greatest = middle + spread;
    // The least eigenvalue from the determinant and the greatest one: this cancels less than a difference.
    let least = (xx * yy - xy * xy) / greatest;
    if !(least > 0.0 && greatest.is_finite()) {
        return None;
    }
    // The longer of the two rows to which the axis is perpendicular.
    let direction = if half >= 0.0 { Vec2::new(half + spread, xy) } else { Vec2::new(xy, spread - half) };
    let direction = direction.try_normalize().unwrap_or(Vec2::X);
    Some((direction * greatest.sqrt(), direction.perp() * least.sqrt()))
}

/// The first `count` real spherical harmonics with the signs and order of 3DGS, zeros after them.
fn harmonics(direction: Vec3, count: usize) -> [f32; COEFFICIENTS] {
    let mut weights = [0.0; COEFFICIENTS];
    weights[0] = 0.282_094_8;
    if count < 4 {
        return weights;
    }
    let Vec3 { x, y, z } = direction;
    weights[1..4].copy_from_slice(&[-0.488_602_5 * y, 0.488_602_5 * z, -0.488_602_5 * x]);
    if count < 9 {
        return weights;
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    weights[4..9].copy_from_slice(&[
        1.092_548_4 * x * y,
        -1.092_548_4 * y * z,
        0.315_391_57 * (2.0 * zz - xx - yy),
        -1.092_548_4 * x * z,
        0.546_274_2 * (xx - yy),
    ]);
    if count < 16 {
        return weights;
    }
    weights[9..].copy_from_slice(&[
        -0.590_043_6 * y * (3.0 * xx - yy),
        2.890_611_4 * x * y * z,
        -0.457_045_8 * y * (4.0 * zz - xx - yy),
        0.373_176_34 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.457_045_8 * x * (4.0 * zz - xx - yy),
        1.445_305_7 * z * (xx - yy),
        -0.590_043_6 * x * (xx - 3.0 * yy),
    ]);
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_those_of_the_covariance() {
        for [xx, xy, yy] in
            [[4.0, 0.0, 1.0], [1.0, 0.0, 4.0], [2.0, 0.0, 2.0], [5.0, 1.5, 1.0], [1.0, -2.0, 9.0], [100.0, 99.0, 99.0]]
        {
            let (major, minor) = axes(xx, xy, yy).expect("an ellipse");
            let sum = [
                major.x * major.x + minor.x * minor.x,
                major.x * major.y + minor.x * minor.y,
                major.y * major.y + minor.y * minor.y,
            ];
            for (sum, expected) in sum.into_iter().zip([xx, xy, yy]) {
                assert!((sum - expected).abs() < 1e-4 * xx.max(yy), "{sum} {expected}");
            }
            assert!(major.dot(minor).abs() < 1e-3, "{major} {minor}");
        }
        assert_eq!(axes(1.0, 1.0, 1.0), None);
        assert_eq!(axes(f32::NAN, 0.0, 1.0), None);
    }

    #[test]
    fn only_what_may_be_seen_is_projected() {
        let camera = Camera::look_at([0.; 3], [0., 0., 1.], [0., -1., 0.], 90.0, [64, 64]).expect("a camera");
        let mut scene = Scene::with_capacity(0, 4);
        for (position, opacity) in
            [([0.0, 0.0, 4.0], 0.5), ([0.0, 0.0, -4.0], 0.5), ([0.0, 0.0, 4.0], 0.001), ([9.0, 0.0, 4.0], 0.5)]
        {
            let shape = gaurast_scene::GaussianShape { scale: [0.1; 3], rotation: [2.0, 0.0, 0.0, 0.0], opacity };
            scene.push(position, shape, &[[0.0; 3]]);
        }
        let projection = Projection::new(&camera, 0, 1.0 / 255.0);
        let (depth, splat) = projection.splat(&scene, 0).expect("seen");
        assert_eq!((depth, splat.mean), (4.0, [32.0, 32.0]));
        assert_eq!(splat.color, [0.5; 4]);
        let deviation = (0.8_f32.powi(2) + LOW_PASS).sqrt();
        assert!((Vec2::from_array(splat.major).length() - deviation).abs() < 1e-4);
        for index in 1..4 {
            assert_eq!(projection.splat(&scene, index), None, "{index}");
        }
    }
}
