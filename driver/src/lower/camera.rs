//! The camera of Gaussian draws.

use crate::error::Error;
use gaurast::vk::{GaussianCameraGAURAST, GaussianCameraModelGAURAST};
use simdevice::packet::{Camera, CameraModel};

/// A camera for the device.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for a model that the device does not have, [`Error::Usage`] for values that are no
/// camera's.
pub(crate) fn camera(camera: &GaussianCameraGAURAST) -> Result<Camera, Error> {
    let model = match camera.model {
        GaussianCameraModelGAURAST::PINHOLE => CameraModel::Pinhole,
        GaussianCameraModelGAURAST::ORTHOGRAPHIC => CameraModel::Orthographic,
        GaussianCameraModelGAURAST::FISHEYE => CameraModel::Fisheye,
        GaussianCameraModelGAURAST::EQUIRECTANGULAR => {
            return Err(Error::FeatureNotPresent(format!(
                "the camera model {:?}",
                camera.model
            )));
        }
        other => {
            return Err(Error::usage(
                "VUID-VkGaussianCameraGAURAST-model-parameter",
                format!("{other:?} is not a VkGaussianCameraModelGAURAST"),
            ));
        }
    };
    validate(camera, model)?;
    Ok(Camera {
        model,
        rotation: camera.rotation,
        eye: camera.eye,
        focal_length: camera.focal_length,
        principal_point: camera.principal_point,
        near_plane: camera.near_plane,
        far_plane: camera.far_plane,
        depth_coefficients: camera.depth_coefficients,
    })
}

fn validate(camera: &GaussianCameraGAURAST, model: CameraModel) -> Result<(), Error> {
    let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
    let c = camera;
    let rules = [
        (
            finite(&c.rotation),
            "VUID-VkGaussianCameraGAURAST-rotation-value",
            "rotation must be finite",
        ),
        (
            c.eye.iter().all(|value| value.is_finite()),
            "VUID-VkGaussianCameraGAURAST-eye-value",
            "eye must be finite",
        ),
        (
            finite(&c.focal_length) && c.focal_length.iter().all(|&f| f > 0.0),
            "VUID-VkGaussianCameraGAURAST-focalLength-value",
            "focalLength must be finite and greater than 0",
        ),
        (
            finite(&c.principal_point),
            "VUID-VkGaussianCameraGAURAST-principalPoint-value",
            "principalPoint must be finite",
        ),
        (
            (c.near_plane > 0.0 || model == CameraModel::Orthographic) && c.near_plane.is_finite(),
            "VUID-VkGaussianCameraGAURAST-nearPlane-value",
            "nearPlane must be finite, and greater than 0 unless the camera is orthographic",
        ),
        (
            c.far_plane > c.near_plane,
            "VUID-VkGaussianCameraGAURAST-farPlane-value",
            "farPlane must be greater than nearPlane",
        ),
        (
            finite(&c.depth_coefficients),
            "VUID-VkGaussianCameraGAURAST-depthCoefficients-value",
            "depthCoefficients must be finite",
        ),
    ];
    match rules.iter().find(|(holds, ..)| !holds) {
        None => Ok(()),
        Some((_, vuid, rule)) => Err(Error::usage(vuid, format!("{rule}; the camera is {c:?}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> GaussianCameraGAURAST<'static> {
        GaussianCameraGAURAST::default()
            .focal_length([500.0, 510.0])
            .principal_point([320.0, 240.0])
    }

    #[test]
    fn a_camera_is_taken_as_it_is() {
        let lowered = camera(&good()).unwrap();
        assert_eq!(lowered.focal_length, [500.0, 510.0]);
        assert_eq!(lowered.principal_point, [320.0, 240.0]);
        assert_eq!(
            (lowered.near_plane, lowered.far_plane),
            (0.2, f32::INFINITY)
        );
    }

    #[test]
    fn only_an_orthographic_camera_sees_what_is_behind_it() {
        let behind = good().near_plane(-5.0);
        assert!(camera(&behind).is_err());
        let parallel = behind.model(GaussianCameraModelGAURAST::ORTHOGRAPHIC);
        assert_eq!(camera(&parallel).unwrap().model, CameraModel::Orthographic);
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        let bad = [
            good().focal_length([0.0, 1.0]),
            good().focal_length([f32::NAN, 1.0]),
            good().principal_point([f32::INFINITY, 0.0]),
            good().eye([f64::NAN, 0.0, 0.0]),
            good().rotation([f32::NAN; 9]),
            good().near_plane(0.0),
            good().near_plane(2.0).far_plane(1.0),
            good().far_plane(f32::NAN),
            good().depth_coefficients([f32::NAN, 0.0]),
            good().model(GaussianCameraModelGAURAST::EQUIRECTANGULAR),
            good().model(GaussianCameraModelGAURAST::from_raw(77)),
        ];
        for bad in bad {
            assert!(camera(&bad).is_err(), "{bad:?}");
        }
    }
}
