//! A camera with its picture's size.

use gaurast::vk::{GaussianCameraGAURAST, GaussianCameraModelGAURAST};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::distortion::Distortion;

/// The default vertical field of view, in degrees.
pub const DEFAULT_FOV: f64 = 50.0;

/// The projection model of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// Perspective.
    #[default]
    #[serde(alias = "Pinhole")]
    Pinhole,
    /// Equidistant fisheye: focal lengths are pixels per radian.
    #[serde(alias = "Fisheye")]
    Fisheye,
    /// A panorama of longitude and latitude: focal lengths are pixels per radian.
    #[serde(alias = "Equirectangular")]
    Equirectangular,
    /// Parallel rays: focal lengths are pixels per unit of length.
    #[serde(alias = "Orthographic")]
    Orthographic,
}

/// The near plane of 3DGS, in the scene's units.
pub const DEFAULT_NEAR: f64 = 0.2;

/// A camera with its picture's size.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Camera {
    /// The projection model.
    #[serde(default)]
    pub model: Model,
    /// The rotation from world to camera, row by row: the directions right, down and forward in the world.
    pub rotation: [[f64; 3]; 3],
    /// The camera's position in the world.
    pub eye: [f64; 3],
    /// Focal lengths along x and y, in pixels.
    pub focal: [f64; 2],
    /// The principal point, in pixels from the picture's upper left corner.
    pub principal: [f64; 2],
    /// The distortion of the lens, of a pinhole or a fisheye.
    #[serde(default, skip_serializing_if = "Distortion::is_none")]
    pub distortion: Distortion,
    /// The picture's width in pixels.
    pub width: u32,
    /// The picture's height in pixels.
    pub height: u32,
    /// Gaussians are drawn beyond this depth, which is positive unless the camera is orthographic.
    #[serde(default = "default_near", skip_serializing_if = "is_default_near")]
    pub near: f64,
    /// Gaussians are drawn before this depth, which may be infinite.
    #[serde(default = "infinity", skip_serializing_if = "is_infinite")]
    pub far: f64,
}

fn default_near() -> f64 {
    DEFAULT_NEAR
}

fn is_default_near(near: &f64) -> bool {
    *near == DEFAULT_NEAR
}

fn infinity() -> f64 {
    f64::INFINITY
}

fn is_infinite(value: &f64) -> bool {
    value.is_infinite()
}

/// The reason that a camera's parameters are invalid.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraError {
    /// A number is infinite or not a number.
    #[error("the camera has a number that is not finite")]
    NotFinite,
    /// The eye is the target.
    #[error("the eye and the target are the same point")]
    NoDirection,
    /// Up is zero or along the line of sight.
    #[error("up is zero, or along the line of sight")]
    NoUp,
    /// The field of view is not between 0 and 180 degrees, or 360 for a fisheye.
    #[error("the field of view is not between 0 and 180 degrees, or 360 for a fisheye")]
    FieldOfView,
    /// A focal length is zero, or too large for binary32.
    #[error("the camera's focal length is zero or beyond binary32, which it is drawn in")]
    Focal,
    /// The near plane is not in front of the camera, or the far plane not behind it.
    #[error("the near plane is not in front of the camera, or the far plane is not beyond it")]
    Planes,
    /// The lens of a panorama or an orthographic camera distorts.
    #[error("the lens distorts, which only that of a pinhole or a fisheye does")]
    Distortion,
    /// A coefficient of the lens is not finite in binary32, or not one of its model.
    #[error("a coefficient of the lens is beyond binary32, or not one of its model")]
    Coefficients,
}

impl Camera {
    /// A camera at `eye` that looks at `target`, with `up` upwards in the picture. `fov` is the vertical field of view
    /// in degrees; `size` is the picture's size in pixels.
    ///
    /// # Errors
    /// See [`CameraError`].
    pub fn look_at(
        eye: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        fov: f64,
        size: [u32; 2],
    ) -> Result<Self, CameraError> {
        let [position, target, up] = [eye, target, up].map(DVec3::from_array);
        if !(position.is_finite() && target.is_finite() && up.is_finite() && fov.is_finite()) {
            return Err(CameraError::NotFinite);
        }
        if fov <= 0.0 || fov >= 180.0 {
            return Err(CameraError::FieldOfView);
        }
        let forward = (target - position).try_normalize().ok_or(CameraError::NoDirection)?;
        let right = up
            .try_normalize()
            .map(|up| forward.cross(up))
            .filter(|right| right.length() > 1e-9)
            .ok_or(CameraError::NoUp)?
            .normalize();
        let down = forward.cross(right);
        Ok(Self::new([right, down, forward].map(<[f64; 3]>::from), eye, fov, size))
    }

    /// A camera of vertical field of view `fov` in degrees, looking through its picture's centre.
    pub(crate) fn new(rotation: [[f64; 3]; 3], eye: [f64; 3], fov: f64, size: [u32; 2]) -> Self {
        let [width, height] = size.map(f64::from);
        let focal = height / 2.0 / libm::tan(fov.to_radians() / 2.0);
        Self {
            model: Model::Pinhole,
            rotation,
            eye,
            focal: [focal; 2],
            principal: [width / 2.0, height / 2.0],
            distortion: Distortion::default(),
            width: size[0],
            height: size[1],
            near: DEFAULT_NEAR,
            far: f64::INFINITY,
        }
    }

    /// Checks that the camera can draw: its numbers are finite, also in binary32, its planes are in order, and its lens is one
    /// that it can have.
    ///
    /// # Errors
    /// See [`CameraError`].
    pub fn check(&self) -> Result<(), CameraError> {
        let rotation = self.rotation.as_flattened();
        let binary32 = rotation.iter().chain(&self.principal);
        if !binary32.copied().all(|x| (x as f32).is_finite()) || !self.eye.iter().all(|x| x.is_finite()) {
            return Err(CameraError::NotFinite);
        }
        if !self.focal.iter().all(|f| (*f as f32).is_finite() && *f as f32 > 0.0) {
            return Err(CameraError::Focal);
        }
        let (near, far) = (self.near as f32, self.far as f32);
        let in_front = near > 0.0 || self.model == Model::Orthographic;
        if !near.is_finite() || !in_front || far.is_nan() || far <= near {
            return Err(CameraError::Planes);
        }
        if !self.distortion.is_none() {
            if !matches!(self.model, Model::Pinhole | Model::Fisheye) {
                return Err(CameraError::Distortion);
            }
            if !self.distortion.is_valid() {
                return Err(CameraError::Coefficients);
            }
        }
        Ok(())
    }

    /// The camera with other near and far planes.
    #[must_use]
    pub fn with_planes(&self, near: f64, far: f64) -> Self {
        Self { near, far, ..*self }
    }

    /// The camera with the picture magnified about the principal point.
    #[must_use]
    pub fn zoomed(&self, factor: f64) -> Self {
        Self { focal: self.focal.map(|focal| focal * factor), ..*self }
    }

    /// The camera with an ideal lens.
    #[must_use]
    pub fn undistorted(&self) -> Self {
        Self { distortion: Distortion::default(), ..*self }
    }

    /// An orthographic camera with the same axes and an ideal lens, which shows objects `distance` ahead as large as a pinhole camera
    /// does.
    #[must_use]
    pub fn orthographic(&self, distance: f64) -> Self {
        Self { model: Model::Orthographic, focal: self.focal.map(|focal| focal / distance), ..self.undistorted() }
    }

    /// A fisheye with the same axes and an ideal lens, whose vertical field of view is `fov` degrees.
    #[must_use]
    pub fn fisheye(&self, fov: f64) -> Self {
        let height = f64::from(self.height);
        Self {
            model: Model::Fisheye,
            focal: [height / fov.to_radians(); 2],
            principal: [f64::from(self.width) / 2.0, height / 2.0],
            ..self.undistorted()
        }
    }

    /// A panorama with the same axes and an ideal lens: all 360 by 180 degrees fill the picture.
    #[must_use]
    pub fn panorama(&self) -> Self {
        let [width, height] = [self.width, self.height].map(f64::from);
        Self {
            model: Model::Equirectangular,
            focal: [width / std::f64::consts::TAU, height / std::f64::consts::PI],
            principal: [width / 2.0, height / 2.0],
            ..self.undistorted()
        }
    }

    /// The same view in a picture of another size: each axis is scaled on its own.
    #[must_use]
    pub fn resized(&self, [width, height]: [u32; 2]) -> Self {
        let scale = [f64::from(width) / f64::from(self.width), f64::from(height) / f64::from(self.height)];
        let scaled = |values: [f64; 2]| [values[0] * scale[0], values[1] * scale[1]];
        Self { focal: scaled(self.focal), principal: scaled(self.principal), width, height, ..*self }
    }

    /// The camera turned by `angle` radians about an axis through `pivot`.
    #[must_use]
    pub fn turned(&self, pivot: [f64; 3], axis: [f64; 3], angle: f64) -> Self {
        let pivot = DVec3::from_array(pivot);
        let turn = DMat3::from_axis_angle(DVec3::from_array(axis).normalize(), angle);
        let eye = pivot + turn * (DVec3::from_array(self.eye) - pivot);
        Self {
            rotation: self.rotation.map(|row| (turn * DVec3::from_array(row)).to_array()),
            eye: eye.to_array(),
            ..*self
        }
    }

    /// `count` cameras evenly around the origin at a distance of 4, somewhat above it, that look at it: a default path
    /// for scenes without cameras.
    pub fn orbit(count: usize, size: [u32; 2]) -> Vec<Self> {
        let eye = DVec3::new(0.0, -0.35, -1.0).normalize() * 4.0;
        let forward = -eye.normalize();
        let right = DVec3::X;
        let rotation = [right, forward.cross(right), forward].map(<[f64; 3]>::from);
        let first = Self::new(rotation, eye.to_array(), DEFAULT_FOV, size);
        (0..count)
            .map(|i| i as f64 / count as f64 * std::f64::consts::TAU)
            .map(|angle| first.turned([0.0; 3], [0.0, 1.0, 0.0], angle))
            .collect()
    }

    /// The position of a world point in the picture, in pixels, which may lie outside of it. None if the point is not in front
    /// of a pinhole or an orthographic camera, or if it is at or beyond the fold of the lens.
    pub fn project(&self, point: [f64; 3]) -> Option<[f64; 2]> {
        let rotation = DMat3::from_cols_array_2d(&self.rotation).transpose();
        let t = rotation * (DVec3::from_array(point) - DVec3::from_array(self.eye));
        let is_ahead = t.z > 0.0;
        let ideal = match self.model {
            Model::Pinhole => is_ahead.then(|| [t.x / t.z, t.y / t.z])?,
            Model::Orthographic => is_ahead.then_some([t.x, t.y])?,
            Model::Fisheye => {
                let across = libm::hypot(t.x, t.y);
                // The limit on the axis.
                let scale = if across > 0.0 { libm::atan2(across, t.z) / across } else { 0.0 };
                [scale * t.x, scale * t.y]
            }
            Model::Equirectangular => [libm::atan2(t.x, t.z), libm::atan2(t.y, libm::hypot(t.x, t.z))],
        };
        let place = if self.distortion.is_none() { ideal } else { self.distortion.distort(ideal)? };
        Some([0, 1].map(|axis| self.focal[axis] * place[axis] + self.principal[axis]))
    }

    /// The angle from the camera's axis, in radians, at which the lens folds, and from which on there is nothing in the
    /// picture. None if the lens doesn't fold.
    pub fn fold_angle(&self) -> Option<f64> {
        let fold = self.distortion.fold();
        let angle = if self.model == Model::Fisheye { fold } else { libm::atan(fold) };
        let greatest = if self.model == Model::Fisheye { std::f64::consts::PI } else { std::f64::consts::FRAC_PI_2 };
        (angle < greatest).then_some(angle)
    }

    /// The camera as a Vulkan structure for draws, to which [`Distortion::to_vulkan`] may be chained.
    pub fn to_vulkan(&self) -> GaussianCameraGAURAST<'static> {
        let rotation = self.rotation.as_flattened();
        let model = match self.model {
            Model::Pinhole => GaussianCameraModelGAURAST::PINHOLE,
            Model::Fisheye => GaussianCameraModelGAURAST::FISHEYE,
            Model::Equirectangular => GaussianCameraModelGAURAST::EQUIRECTANGULAR,
            Model::Orthographic => GaussianCameraModelGAURAST::ORTHOGRAPHIC,
        };
        GaussianCameraGAURAST::default()
            .model(model)
            .rotation(std::array::from_fn(|i| rotation[i] as f32))
            .eye(self.eye)
            .focal_length(self.focal.map(|f| f as f32))
            .principal_point(self.principal.map(|c| c as f32))
            .near_plane(self.near as f32)
            .far_plane(self.far as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn close(a: Option<[f64; 2]>, b: [f64; 2]) {
        let a = a.expect("in front");
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
    }

    /// The camera with a lens of k1 = -0.4.
    fn with_lens(camera: &Camera) -> Camera {
        let distortion = Distortion { radial: [-0.4, 0.0, 0.0, 0.0, 0.0, 0.0], ..Distortion::default() };
        Camera { distortion, ..camera.clone() }
    }

    #[test]
    fn look_at_puts_known_points_where_they_belong() {
        // From (0, 0, -4) along +z with -y upwards: x is right, y is down.
        let camera = Camera::look_at([0., 0., -4.], [0.; 3], [0., -1., 0.], 90.0, [200, 100]).expect("a camera");
        assert_eq!(camera.rotation, [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]);
        // A vertical field of view of 90 degrees: 4 ahead, 4 down is the lower edge.
        close(camera.project([0., 4., 0.]), [100., 100.]);
        close(camera.project([2., 0., 0.]), [125., 50.]);
        assert_eq!(camera.project([0., 0., -5.]), None);

        // Y-up world, seen from +z: x is still right, and y is up.
        let camera = Camera::look_at([1., 1., 5.], [1., 1., 0.], [0., 1., 0.], 90.0, [200, 100]).expect("a camera");
        close(camera.project([1., 1., 0.]), [100., 50.]);
        close(camera.project([2., 2., 0.]), [110., 40.]);
    }

    #[test]
    fn cameras_that_are_none() {
        let look = |eye, target, up, fov| Camera::look_at(eye, target, up, fov, [8, 8]).err();
        let (o, z, y) = ([0.; 3], [0., 0., 1.], [0., 1., 0.]);
        assert_eq!(look(o, o, y, 50.), Some(CameraError::NoDirection));
        assert_eq!(look(o, z, z, 50.), Some(CameraError::NoUp));
        assert_eq!(look(o, z, o, 50.), Some(CameraError::NoUp));
        assert_eq!(look(o, z, y, 180.), Some(CameraError::FieldOfView));
        assert_eq!(look(o, [f64::NAN; 3], y, 50.), Some(CameraError::NotFinite));
    }

    #[test]
    fn cameras_that_cannot_be_drawn_with_are_told() {
        let camera = Camera::orbit(1, [8, 8]).remove(0);
        assert_eq!(camera.check(), Ok(()));
        let with = |change: &dyn Fn(&mut Camera)| {
            let mut changed = camera.clone();
            change(&mut changed);
            changed.check().err()
        };
        assert_eq!(with(&|c| c.focal[0] = 1e308), Some(CameraError::Focal));
        assert_eq!(with(&|c| c.focal[1] = 1e-60), Some(CameraError::Focal));
        assert_eq!(with(&|c| c.principal[0] = 1e39), Some(CameraError::NotFinite));
        assert_eq!(with(&|c| c.eye[2] = f64::NAN), Some(CameraError::NotFinite));
        assert_eq!(with(&|c| c.near = 0.0), Some(CameraError::Planes));
        assert_eq!(with(&|c| c.far = 0.1), Some(CameraError::Planes));
        let orthographic = Camera { near: -1.0, ..camera.orthographic(4.0) };
        assert_eq!(orthographic.check(), Ok(()));
        assert!((orthographic.focal[0] - camera.focal[0] / 4.0).abs() < 1e-12);
        let distorted = with_lens(&camera);
        assert_eq!(distorted.check(), Ok(()));
        let other = Camera { model: Model::Orthographic, ..distorted };
        assert_eq!(other.check(), Err(CameraError::Distortion));
    }

    #[test]
    fn planes_are_in_a_stored_camera_only_where_they_are_others() {
        let camera = Camera::orbit(1, [8, 8]).remove(0);
        let text = serde_json::to_string(&camera).expect("text");
        assert!(!text.contains("near") && !text.contains("far"), "{text}");
        let camera = camera.with_planes(0.01, 50.0);
        let text = serde_json::to_string(&camera).expect("text");
        assert_eq!(serde_json::from_str::<Camera>(&text).expect("a camera"), camera);
        let distorted = with_lens(&camera);
        let text = serde_json::to_string(&distorted).expect("text");
        assert_eq!(serde_json::from_str::<Camera>(&text).expect("a camera"), distorted);
    }

    #[test]
    fn a_lens_moves_points_and_shows_none_beyond_its_fold() {
        let ideal = Camera {
            eye: [0.0; 3],
            rotation: DMat3::IDENTITY.to_cols_array_2d(),
            ..Camera::orbit(1, [64, 48]).remove(0)
        };
        let distorted = with_lens(&ideal);
        // At the slope 1 / 2 the radius is 1 - 0.4 / 4 times as large.
        let [cx, cy] = ideal.principal;
        close(distorted.project([0.5, 0.0, 1.0]), [cx + 0.45 * ideal.focal[0], cy]);
        // 1 - 1.2 r^2 = 0.
        let fold = distorted.fold_angle().expect("it folds");
        assert!((libm::tan(fold) - (1.0 / 1.2_f64).sqrt()).abs() < 1e-12);
        assert!(distorted.project([0.91, 0.0, 1.0]).is_some() && distorted.project([0.92, 0.0, 1.0]).is_none());
        assert_eq!(ideal.fold_angle(), None);
        // Scaled pictures of it are of the same lens, and other projections have an ideal one.
        close(distorted.zoomed(2.0).project([0.5, 0.0, 1.0]), [cx + 0.9 * ideal.focal[0], cy]);
        assert_eq!(distorted.panorama(), ideal.panorama());
        assert_eq!(
            (distorted.fisheye(90.0), distorted.orthographic(2.0)),
            (ideal.fisheye(90.0), ideal.orthographic(2.0))
        );
        // A fisheye sees what is beside it and behind it.
        let fisheye = ideal.fisheye(180.0);
        close(fisheye.project([0.0, 2.0, 0.0]), [32.0, 48.0]);
        assert!(fisheye.project([1.0, 0.0, -1.0]).is_some());
    }

    #[test]
    fn resizing_scales_both_axes_separately() {
        let camera = Camera::look_at([0.; 3], [0., 0., 1.], [0., -1., 0.], 60.0, [400, 300]).expect("a camera");
        let resized = camera.resized([800, 900]);
        let point = [0.1, -0.2, 1.0];
        let [x, y] = camera.project(point).expect("in front");
        close(resized.project(point), [2.0 * x, 3.0 * y]);
    }

    #[test]
    fn an_orbit_looks_at_the_middle_from_all_sides() {
        let cameras = Camera::orbit(7, [64, 48]);
        assert_eq!(cameras.len(), 7);
        for camera in &cameras {
            close(camera.project([0.; 3]), [32., 24.]);
            // A point above the horizon appears above it.
            let [_, y] = camera.project([0., -0.5, 0.]).expect("in front");
            assert!(y < 24.0);
            let rows = DMat3::from_cols_array_2d(&camera.rotation);
            assert!((rows.determinant() - 1.0).abs() < 1e-9);
        }
        assert!(cameras[0] != cameras[1]);
    }

    #[test]
    fn a_panorama_fills_its_picture() {
        let pinhole = Camera::orbit(1, [200, 100]).remove(0);
        let panorama = pinhole.panorama();
        assert_eq!(panorama.rotation, pinhole.rotation);
        let turn = [panorama.focal[0] * std::f64::consts::TAU, panorama.focal[1] * std::f64::consts::PI];
        close(Some(turn), [200.0, 100.0]);
        let fisheye = pinhole.fisheye(180.0);
        close(Some(fisheye.focal.map(|focal| focal * std::f64::consts::PI)), [100.0; 2]);
        assert_eq!(panorama.to_vulkan().model, GaussianCameraModelGAURAST::EQUIRECTANGULAR);
    }

    #[test]
    fn vulkan_takes_the_same_camera() {
        let camera = Camera::look_at([3., 1., 2.], [0.; 3], [0., 0., 1.], 60.0, [64, 48]).expect("a camera");
        let vulkan = camera.to_vulkan();
        assert_eq!(vulkan.eye, [3., 1., 2.]);
        assert_eq!(vulkan.rotation[5], camera.rotation[1][2] as f32);
        assert_eq!(vulkan.principal_point, [32., 24.]);
        assert_eq!((vulkan.near_plane, vulkan.far_plane), (0.2, f32::INFINITY));
    }
}
