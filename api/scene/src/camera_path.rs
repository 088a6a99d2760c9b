//! Paths of cameras through keyframes.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::camera::{Camera, CameraError, DEFAULT_FOV, Model};
use crate::framing::DEFAULT_UP;

/// A camera that a path goes through.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// The camera's position.
    pub eye: [f64; 3],
    /// The point that it looks at.
    pub target: [f64; 3],
    /// The direction upwards in the picture.
    #[serde(default = "default_up")]
    pub up: [f64; 3],
    /// The vertical field of view in degrees. An orthographic camera shows the target as large as a pinhole with this
    /// field of view does; a panorama has none.
    #[serde(default = "default_fov")]
    pub fov: f64,
    /// The projection model. Between keyframes it is that of the one before.
    #[serde(default, skip_serializing_if = "is_pinhole")]
    pub camera: Model,
    /// The time at which the camera is here. Keyframes without times are one unit apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
}

fn default_up() -> [f64; 3] {
    DEFAULT_UP
}

fn default_fov() -> f64 {
    DEFAULT_FOV
}

fn is_pinhole(model: &Model) -> bool {
    *model == Model::Pinhole
}

impl Keyframe {
    /// The keyframe of a camera that looks at a point `distance` ahead of it.
    pub fn of(camera: &Camera, distance: f64) -> Self {
        let [_, down, forward] = camera.rotation.map(DVec3::from_array);
        let eye = DVec3::from_array(camera.eye);
        let height = f64::from(camera.height) / camera.focal[1];
        let fov = match camera.model {
            Model::Pinhole => 2.0 * libm::atan(height / 2.0).to_degrees(),
            Model::Orthographic => 2.0 * libm::atan(height / 2.0 / distance).to_degrees(),
            Model::Fisheye => height.to_degrees(),
            Model::Equirectangular => DEFAULT_FOV,
        };
        Self {
            eye: camera.eye,
            target: (eye + distance * forward).into(),
            up: (-down).into(),
            fov,
            camera: camera.model,
            time: None,
        }
    }

    /// The camera, with a picture of `size` pixels.
    ///
    /// # Errors
    /// See [`CameraError`].
    pub fn camera(&self, size: [u32; 2]) -> Result<Camera, CameraError> {
        let pinhole = |fov: f64| Camera::look_at(self.eye, self.target, self.up, fov, size);
        match self.camera {
            Model::Pinhole => pinhole(self.fov),
            Model::Orthographic => {
                let distance = DVec3::from_array(self.eye).distance(DVec3::from_array(self.target));
                Ok(pinhole(self.fov)?.orthographic(distance))
            }
            Model::Fisheye if self.fov > 0.0 && self.fov <= 360.0 => Ok(pinhole(DEFAULT_FOV)?.fisheye(self.fov)),
            Model::Fisheye => Err(CameraError::FieldOfView),
            Model::Equirectangular => Ok(pinhole(DEFAULT_FOV)?.panorama()),
        }
    }
}

/// `count` cameras along a smooth path through `keyframes`, the first and the last included. Without a count, the
/// keyframes' own cameras.
///
/// Eyes, targets and fields of view follow a Catmull-Rom spline.
///
/// # Errors
/// See [`CameraError`]; [`CameraError::NotFinite`] where times don't ascend.
pub fn along(keyframes: &[Keyframe], count: Option<usize>, size: [u32; 2]) -> Result<Vec<Camera>, CameraError> {
    let (Some(count), true) = (count, keyframes.len() > 1) else {
        return keyframes.iter().map(|frame| frame.camera(size)).collect();
    };
    let times: Vec<f64> = (keyframes.iter().enumerate()).map(|(i, frame)| frame.time.unwrap_or(i as f64)).collect();
    let ascending = times.windows(2).all(|pair| pair[0] < pair[1]);
    if !ascending || times.iter().any(|time| !time.is_finite()) {
        return Err(CameraError::NotFinite);
    }
    let (first, last) = (times[0], times[times.len() - 1]);
    (0..count)
        .map(|i| first + (last - first) * i as f64 / (count.max(2) - 1) as f64)
        .map(|time| at(keyframes, &times, time).camera(size))
        .collect()
}

/// The keyframe at a time between the first and the last.
fn at(keyframes: &[Keyframe], times: &[f64], time: f64) -> Keyframe {
    let after = times.partition_point(|t| *t <= time).clamp(1, times.len() - 1);
    let part = (time - times[after - 1]) / (times[after] - times[after - 1]);
    let frame = |index: usize| &keyframes[index.min(keyframes.len() - 1)];
    let four = [frame((after - 1).saturating_sub(1)), frame(after - 1), frame(after), frame(after + 1)];
    let vector = |value: &dyn Fn(&Keyframe) -> [f64; 3]| -> [f64; 3] {
        let values = four.map(value);
        std::array::from_fn(|axis| spline(values.map(|v| v[axis]), part))
    };
    Keyframe {
        eye: vector(&|frame| frame.eye),
        target: vector(&|frame| frame.target),
        up: vector(&|frame| DVec3::from_array(frame.up).normalize_or_zero().to_array()),
        fov: spline(four.map(|frame| frame.fov), part),
        camera: four[1].camera,
        time: Some(time),
    }
}

/// The Catmull-Rom spline through the middle two of four values, `t` from 0 to 1 between them.
fn spline([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    let (square, cube) = (t * t, t * t * t);
    0.5 * (2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * square + (3.0 * b - a - 3.0 * c + d) * cube)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keyframe(x: f64) -> Keyframe {
        Keyframe {
            eye: [x, 0.0, -4.0],
            target: [x, 0.0, 0.0],
            up: DEFAULT_UP,
            fov: 40.0 + x,
            camera: Model::Pinhole,
            time: None,
        }
    }

    #[test]
    fn a_path_goes_through_its_keyframes() {
        let keyframes = [keyframe(0.0), keyframe(1.0), keyframe(5.0)];
        let cameras = along(&keyframes, Some(5), [64, 48]).expect("cameras");
        let eyes: Vec<f64> = cameras.iter().map(|camera| camera.eye[0]).collect();
        for (index, x) in [(0, 0.0), (2, 1.0), (4, 5.0)] {
            assert!((eyes[index] - x).abs() < 1e-12, "{eyes:?}");
        }
        assert!(eyes.windows(2).all(|pair| pair[0] < pair[1]), "{eyes:?}");
        assert_eq!(along(&keyframes, None, [64, 48]).expect("cameras").len(), 3);
        assert_eq!(along(&keyframes, Some(1), [64, 48]).expect("one").len(), 1);
        let backwards = [Keyframe { time: Some(3.0), ..keyframe(0.0) }, keyframe(1.0)];
        assert!(along(&backwards, Some(4), [64, 48]).is_err());
    }

    #[test]
    fn a_camera_is_its_keyframe_again() {
        let pinhole = keyframe(2.0).camera([64, 48]).expect("a camera");
        for camera in
            [pinhole.orthographic(3.0), pinhole.fisheye(180.0), pinhole.fisheye(90.0), pinhole.panorama(), pinhole]
        {
            let again = Keyframe::of(&camera, 4.0).camera([64, 48]).expect("a camera");
            assert_eq!(again.model, camera.model);
            for axis in 0..3 {
                assert!((camera.eye[axis] - again.eye[axis]).abs() < 1e-12);
            }
            for axis in 0..2 {
                assert!((camera.focal[axis] - again.focal[axis]).abs() < 1e-9);
            }
        }
        let wide = Keyframe { fov: 361.0, camera: Model::Fisheye, ..keyframe(0.0) };
        assert_eq!(wide.camera([8, 8]), Err(CameraError::FieldOfView));
    }
}
