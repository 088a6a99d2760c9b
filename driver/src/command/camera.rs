//! The cameras of Gaussian draws.

use super::Command;
use super::buffer::Recorder;
use crate::abi::error::Error;
use crate::abi::valid;
use crate::physical_device::limits;
use gaurast::vk::{
    GaussianCameraDataGAURAST, GaussianCameraDistortionGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST,
    GaussianDistortionModelGAURAST,
};
use simdevice::BufferRange;
use simdevice::state::gaussian::{Camera, CameraModel, Distortion, DistortionModel};
use std::f32::consts::PI;
use std::fmt::Debug;

/// Converts a camera for the device, with an ideal lens.
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
        distortion: None,
    })
}

/// Converts a camera of a model with its distortion, if its chain has one that distorts.
///
/// # Errors
/// [`Error::InvalidUsage`] for a distortion that no camera, or none of this model, has.
///
/// # Safety
/// The camera's chain is valid.
unsafe fn distortion(camera: &GaussianCameraGAURAST<'_>, model: CameraModel) -> Result<Option<Distortion>, Error> {
    // SAFETY: the caller's promise.
    match unsafe { valid::find_in_chain::<GaussianCameraDistortionGAURAST<'_>>(camera.p_next) } {
        None => Ok(None),
        Some(chained) => convert_distortion(chained, model),
    }
}

fn convert_distortion(
    chained: &GaussianCameraDistortionGAURAST<'_>,
    model: CameraModel,
) -> Result<Option<Distortion>, Error> {
    let &GaussianCameraDistortionGAURAST { radial, tangential, thin_prism, .. } = chained;
    let distortion_model = match chained.model {
        GaussianDistortionModelGAURAST::RATIONAL => DistortionModel::Rational,
        GaussianDistortionModelGAURAST::POLYNOMIAL => DistortionModel::Polynomial,
        GaussianDistortionModelGAURAST::POLYNOMIAL_FIRST => DistortionModel::PolynomialFirst,
        GaussianDistortionModelGAURAST::FIELD_OF_VIEW => DistortionModel::FieldOfView,
        GaussianDistortionModelGAURAST::DIVISION => DistortionModel::Division,
        other => {
            return Err(Error::usage(
                "VUID-VkGaussianCameraDistortionGAURAST-model-parameter",
                format!("{other:?} is not a VkGaussianDistortionModelGAURAST"),
            ));
        }
    };
    if !matches!(model, CameraModel::Pinhole | CameraModel::Fisheye) {
        return Err(Error::usage(
            "VUID-VkGaussianCameraDistortionGAURAST-model-90085",
            format!("a lens that distorts is that of a PINHOLE or a FISHEYE, but the camera's model is {model:?}"),
        ));
    }
    let first = radial[0];
    let others = || radial[1..].iter().chain(&tangential).chain(&thin_prism);
    if !first.is_finite() || !others().all(|coefficient| coefficient.is_finite()) {
        return Err(Error::usage(
            "VUID-VkGaussianCameraDistortionGAURAST-radial-90086",
            format!("coefficients must be finite, but are {radial:?}, {tangential:?} and {thin_prism:?}"),
        ));
    }
    let has_others = others().any(|coefficient| *coefficient != 0.0);
    if has_others && matches!(distortion_model, DistortionModel::FieldOfView | DistortionModel::Division) {
        return Err(Error::usage(
            "VUID-VkGaussianCameraDistortionGAURAST-radial-90087",
            format!("all coefficients of {distortion_model:?} but the first radial one must be 0"),
        ));
    }
    if distortion_model == DistortionModel::FieldOfView && !(0.0..PI).contains(&first) {
        return Err(Error::usage(
            "VUID-VkGaussianCameraDistortionGAURAST-radial-90088",
            format!("the angle of FIELD_OF_VIEW must be at least 0 and less than pi, but is {first}"),
        ));
    }
    let distorts = first != 0.0 || has_others;
    Ok(distorts.then_some(Distortion { model: distortion_model, radial, tangential, thin_prism }))
}

/// # Safety
/// The cameras' chains are valid.
#[doc(alias = "vkCmdSetGaussianCamerasGAURAST")]
pub(crate) unsafe fn cmd_set_gaussian_cameras(
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
    let with_lens = |given: &GaussianCameraGAURAST<'_>| {
        let ideal = camera(given)?;
        // SAFETY: the caller's promise.
        let distortion = unsafe { distortion(given, ideal.model) }?;
        Ok(Camera { distortion, ..ideal })
    };
    let cameras = cameras.iter().map(with_lens).collect::<Result<_, Error>>()?;
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
    fn a_distortion_is_taken_as_it_is_and_zeros_are_none() {
        let given = GaussianCameraDistortionGAURAST::default()
            .model(GaussianDistortionModelGAURAST::POLYNOMIAL)
            .radial([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
            .tangential([0.7, 0.8])
            .thin_prism([0.9, 1.0, 1.1, 1.2]);
        let taken = convert_distortion(&given, CameraModel::Fisheye).unwrap().unwrap();
        let expected = Distortion {
            model: DistortionModel::Polynomial,
            radial: given.radial,
            tangential: given.tangential,
            thin_prism: given.thin_prism,
        };
        assert_eq!(taken, expected);
        let zeros = GaussianCameraDistortionGAURAST::default().model(GaussianDistortionModelGAURAST::FIELD_OF_VIEW);
        assert_eq!(convert_distortion(&zeros, CameraModel::Pinhole).unwrap(), None);
    }

    #[test]
    fn what_no_lens_does_is_refused() {
        let of = |model| GaussianCameraDistortionGAURAST::default().model(model);
        let first = |k| [k, 0.0, 0.0, 0.0, 0.0, 0.0];
        let bad = [
            of(GaussianDistortionModelGAURAST::from_raw(9)),
            of(GaussianDistortionModelGAURAST::RATIONAL).radial(first(f32::NAN)),
            of(GaussianDistortionModelGAURAST::POLYNOMIAL).thin_prism([0.0, 0.0, 0.0, f32::INFINITY]),
            of(GaussianDistortionModelGAURAST::DIVISION).tangential([0.0, 0.1]),
            of(GaussianDistortionModelGAURAST::FIELD_OF_VIEW).radial([1.0, 0.1, 0.0, 0.0, 0.0, 0.0]),
            of(GaussianDistortionModelGAURAST::FIELD_OF_VIEW).radial(first(PI)),
            of(GaussianDistortionModelGAURAST::FIELD_OF_VIEW).radial(first(-0.1)),
        ];
        for bad in bad {
            assert!(convert_distortion(&bad, CameraModel::Pinhole).is_err(), "{bad:?}");
        }
        let good = of(GaussianDistortionModelGAURAST::DIVISION).radial(first(-0.2));
        assert!(convert_distortion(&good, CameraModel::Pinhole).is_ok());
        for model in [CameraModel::Orthographic, CameraModel::Equirectangular] {
            assert!(convert_distortion(&good, model).is_err());
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
