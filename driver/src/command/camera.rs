//! The cameras of Gaussian draws.

use super::Command;
use super::buffer::Recorder;
use crate::abi::error::Error;
use crate::physical_device::limits;
use gaurast::vk::{GaussianCameraDataGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST};
use simdevice::BufferRange;
use simdevice::state::gaussian::{Camera, CameraModel};
use std::fmt::Debug;

/// Converts a camera for the device.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for a model that the device does not have, [`Error::InvalidUsage`] for values that no
/// camera has.
fn camera(camera: &GaussianCameraGAURAST) -> Result<Camera, Error> {
    let model = match camera.model {
        GaussianCameraModelGAURAST::PINHOLE => CameraModel::Pinhole,
        GaussianCameraModelGAURAST::ORTHOGRAPHIC => CameraModel::Orthographic,
        GaussianCameraModelGAURAST::FISHEYE => CameraModel::Fisheye,
        GaussianCameraModelGAURAST::EQUIRECTANGULAR => CameraModel::Equirectangular,
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

#[doc(alias = "vkCmdSetGaussianCamerasGAURAST")]
pub(crate) fn cmd_set_gaussian_cameras(
    recorder: &mut Recorder,
    cameras: &[GaussianCameraGAURAST<'_>],
) -> Result<(), Error> {
    let most = limits::properties().max_multiview_view_count as usize;
    if cameras.is_empty() || cameras.len() > most {
        return Err(Error::usage(
            "VUID-vkCmdSetGaussianCamerasGAURAST-cameraCount-90062",
            format!(
                "cameraCount is {}, but must be at least 1 and at most maxMultiviewViewCount ({most})",
                cameras.len()
            ),
        ));
    }
    let cameras = cameras.iter().map(camera).collect::<Result<_, _>>()?;
    recorder.push(Command::SetCameras(cameras));
    Ok(())
}

/// Bytes of a `VkGaussianCameraDataGAURAST`.
const DATA_BYTES: usize = size_of::<GaussianCameraDataGAURAST>();

/// Reads the `VkGaussianCameraDataGAURAST` of camera `number` from a uniform buffer.
///
/// # Errors
/// As [`camera`]; [`Error::InvalidUsage`] if the buffer is too short.
pub(super) fn read(range: &BufferRange, number: usize) -> Result<Camera, Error> {
    let mut words = [0u32; DATA_BYTES / 4];
    let start = (number * DATA_BYTES) as u64;
    let inside = range.size >= start + DATA_BYTES as u64;
    let place = range.offset.saturating_add(start);
    if !inside || range.memory.read(place, &mut words).is_err() {
        return Err(Error::usage(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025",
            format!("it has {} bytes, and camera {number} begins at byte {start} and takes {DATA_BYTES}", range.size),
        ));
    }
    let float = |word: usize| f32::from_bits(words[word]);
    let double = |word: usize| f64::from_bits(u64::from(words[word]) | u64::from(words[word + 1]) << 32);
    let pair = |word: usize| [float(word), float(word + 1)];
    // Rows of the rotation have four words each, of which the last is padding.
    let rotation = std::array::from_fn(|element| float(8 + element / 3 * 4 + element % 3));
    camera(
        &GaussianCameraGAURAST::default()
            .model(GaussianCameraModelGAURAST::from_raw(words[6].cast_signed()))
            .rotation(rotation)
            .eye([double(0), double(2), double(4)])
            .focal_length(pair(20))
            .principal_point(pair(22))
            .depth_coefficients(pair(24))
            .near_plane(float(26))
            .far_plane(float(27)),
    )
}

fn validate(camera: &GaussianCameraGAURAST, model: CameraModel) -> Result<(), Error> {
    let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
    let c = camera;
    let rules: [(bool, &str, &str, &dyn Debug); 7] = [
        (finite(&c.rotation), "VUID-VkGaussianCameraGAURAST-rotation-90064", "rotation must be finite", &c.rotation),
        (
            c.eye.iter().all(|value| value.is_finite()),
            "VUID-VkGaussianCameraGAURAST-eye-90065",
            "eye must be finite",
            &c.eye,
        ),
        (
            finite(&c.focal_length) && c.focal_length.iter().all(|&f| f > 0.0),
            "VUID-VkGaussianCameraGAURAST-focalLength-90068",
            "focalLength must be finite and greater than 0",
            &c.focal_length,
        ),
        (
            finite(&c.principal_point),
            "VUID-VkGaussianCameraGAURAST-principalPoint-90066",
            "principalPoint must be finite",
            &c.principal_point,
        ),
        (
            (c.near_plane > 0.0 || model == CameraModel::Orthographic) && c.near_plane.is_finite(),
            "VUID-VkGaussianCameraGAURAST-nearPlane-90069",
            "nearPlane must be finite, and greater than 0 unless the camera is orthographic",
            &c.near_plane,
        ),
        (
            c.far_plane > c.near_plane,
            "VUID-VkGaussianCameraGAURAST-farPlane-90070",
            "farPlane must be greater than nearPlane",
            &c.far_plane,
        ),
        (
            finite(&c.depth_coefficients),
            "VUID-VkGaussianCameraGAURAST-depthCoefficients-90067",
            "depthCoefficients must be finite",
            &c.depth_coefficients,
        ),
    ];
    match rules.iter().find(|(holds, ..)| !holds) {
        None => Ok(()),
        Some((_, vuid, rule, value)) => Err(Error::usage(*vuid, format!("{rule}, but is {value:?}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simdevice::Allocation;

    fn good() -> GaussianCameraGAURAST<'static> {
        GaussianCameraGAURAST::default().focal_length([500.0, 510.0]).principal_point([320.0, 240.0])
    }

    #[test]
    fn a_camera_is_taken_as_it_is() {
        let converted = camera(&good()).unwrap();
        assert_eq!(converted.focal_length, [500.0, 510.0]);
        assert_eq!(converted.principal_point, [320.0, 240.0]);
        assert_eq!((converted.near_plane, converted.far_plane), (0.2, f32::INFINITY));
    }

    #[test]
    fn only_an_orthographic_camera_sees_what_is_behind_it() {
        let behind = good().near_plane(-5.0);
        assert!(camera(&behind).is_err());
        let parallel = behind.model(GaussianCameraModelGAURAST::ORTHOGRAPHIC);
        assert_eq!(camera(&parallel).unwrap().model, CameraModel::Orthographic);
    }

    #[test]
    fn a_uniform_buffer_holds_what_a_command_sets() {
        let set = good()
            .model(GaussianCameraModelGAURAST::FISHEYE)
            .eye([1e6 + 0.125, -2.5, 1e-9])
            .rotation(std::array::from_fn(|element| element as f32 - 3.5))
            .depth_coefficients([0.25, -0.75])
            .near_plane(0.5)
            .far_plane(70.0);
        let data = GaussianCameraDataGAURAST::from(&set);
        let mut bytes = Vec::new();
        bytes.extend(data.eye.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(data.model.as_raw().to_le_bytes());
        bytes.extend([0xFF; 4]);
        let rows = data.rotation.as_flattened().iter().enumerate();
        // Padding is ignored, so it has another value here.
        bytes.extend(rows.flat_map(|(index, value)| match index % 4 {
            3 => f32::NAN.to_le_bytes(),
            _ => value.to_le_bytes(),
        }));
        let rest = [data.focal_length, data.principal_point, data.depth_coefficients];
        bytes.extend(rest.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend([data.near_plane, data.far_plane].map(f32::to_le_bytes).concat());
        bytes.extend([0xFF; 16]);
        assert_eq!(bytes.len(), DATA_BYTES);
        let memory = Allocation::new_zeroed(4096).unwrap();
        let range = |size| BufferRange { memory: memory.clone(), offset: 64, size };
        for number in [0, 1, 5] {
            memory.write(64 + 128 * number, &bytes).unwrap();
            let end = 128 * (number + 1);
            let number = number as usize;
            assert_eq!(read(&range(end), number).unwrap(), camera(&set).unwrap());
            assert!(read(&range(end - 1), number).is_err());
        }
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
            good().model(GaussianCameraModelGAURAST::from_raw(77)),
        ];
        for bad in bad {
            assert!(camera(&bad).is_err(), "{bad:?}");
        }
    }
}
