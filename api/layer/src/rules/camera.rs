//! Cameras.

use ash::vk::TaggedStructure;
use gaurast::vk::{
    GaussianCameraDistortionGAURAST as Distortion, GaussianCameraGAURAST, GaussianCameraModelGAURAST as Model,
    GaussianDistortionModelGAURAST as DistortionModel,
};
use gaurast_layer_interface::find;

use crate::facts::{Camera, Facts, coefficients};
use crate::report::Faults;

/// The distortion in a camera's chain, if the structure is one.
///
/// # Safety
/// The camera's chain is valid, if its type is right.
pub(crate) unsafe fn lens<'a>(camera: &GaussianCameraGAURAST<'a>) -> Option<&'a Distortion<'a>> {
    let is_camera = camera.s_type == GaussianCameraGAURAST::STRUCTURE_TYPE;
    // SAFETY: the caller's promise.
    if is_camera { unsafe { find(camera.p_next) } } else { None }
}

/// Checks the cameras of `vkCmdSetGaussianCamerasGAURAST`; gives those that are right.
pub(crate) fn check_command(
    cameras: &[GaussianCameraGAURAST<'_>],
    lenses: &[Option<&Distortion<'_>>],
    count: u32,
    facts: &Facts,
    faults: &mut Faults,
) -> Option<Vec<Camera>> {
    let before = faults.0.len();
    faults.require(
        count >= 1 && count <= facts.max_views,
        "VUID-vkCmdSetGaussianCamerasGAURAST-cameraCount-90062",
        || {
            format!(
                "cameraCount is {count}, but must be at least 1 and at most maxMultiviewViewCount ({})",
                facts.max_views
            )
        },
    );
    for (index, (camera, lens)) in cameras.iter().zip(lenses).enumerate() {
        let name = format!("pCameras[{index}]");
        if camera.s_type == GaussianCameraGAURAST::STRUCTURE_TYPE {
            check(camera, &name, facts, faults);
            if let Some(lens) = lens {
                check_lens(lens, camera.model, &name, facts, faults);
            }
        } else {
            faults.error(
                "VUID-VkGaussianCameraGAURAST-sType-sType",
                format!(
                    "{name}.sType is {}, but must be VK_STRUCTURE_TYPE_GAUSSIAN_CAMERA_GAURAST ({})",
                    camera.s_type.as_raw(),
                    GaussianCameraGAURAST::STRUCTURE_TYPE.as_raw()
                ),
            );
        }
    }
    let is_right = faults.0[before..].iter().all(|fault| !fault.is_error);
    (is_right && !cameras.is_empty())
        .then(|| cameras.iter().zip(lenses).map(|(camera, lens)| Camera::of(camera, *lens)).collect())
}

/// Checks a camera's values.
pub(crate) fn check(camera: &GaussianCameraGAURAST<'_>, name: &str, facts: &Facts, faults: &mut Faults) {
    let c = camera;
    check_model(c.model, name, facts, faults);
    let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
    faults.require(finite(&c.rotation), "VUID-VkGaussianCameraGAURAST-rotation-90064", || {
        format!("{name}.rotation is {:?}, but must be finite", c.rotation)
    });
    let eye_is_finite = c.eye.iter().all(|value| value.is_finite());
    faults.require(eye_is_finite, "VUID-VkGaussianCameraGAURAST-eye-90065", || {
        format!("{name}.eye is {:?}, but must be finite", c.eye)
    });
    faults.require(finite(&c.principal_point), "VUID-VkGaussianCameraGAURAST-principalPoint-90066", || {
        format!("{name}.principalPoint is {:?}, but must be finite", c.principal_point)
    });
    faults.require(finite(&c.depth_coefficients), "VUID-VkGaussianCameraGAURAST-depthCoefficients-90067", || {
        format!("{name}.depthCoefficients is {:?}, but must be finite", c.depth_coefficients)
    });
    faults.require(
        finite(&c.focal_length) && c.focal_length.iter().all(|&f| f > 0.0),
        "VUID-VkGaussianCameraGAURAST-focalLength-90068",
        || format!("{name}.focalLength is {:?}, but must be finite and greater than 0", c.focal_length),
    );
    let near_is_right = c.near_plane.is_finite() && (c.near_plane > 0.0 || c.model == Model::ORTHOGRAPHIC);
    faults.require(near_is_right, "VUID-VkGaussianCameraGAURAST-nearPlane-90069", || {
        format!(
            "{name}.nearPlane is {}, but must be finite, and greater than 0 unless the camera is orthographic",
            c.near_plane
        )
    });
    faults.require(!near_is_right || c.far_plane > c.near_plane, "VUID-VkGaussianCameraGAURAST-farPlane-90070", || {
        format!("{name}.farPlane is {}, but must be greater than nearPlane ({})", c.far_plane, c.near_plane)
    });
    if finite(&c.rotation) {
        check_rotation(&c.rotation, name, faults);
    }
    if eye_is_finite {
        check_eye(c.eye, name, faults);
    }
    if c.focal_length.iter().any(|&f| f.is_finite() && f > MOST_FOCAL) {
        faults.warning(
            "GAURAST-Camera-focal-length",
            format!(
                "{name}.focalLength is {:?}: its unit is the pixel, and such a picture shows nothing",
                c.focal_length
            ),
        );
    }
}

/// A focal length that no camera has, in pixels.
const MOST_FOCAL: f32 = 1e9;

/// Warns of an eye that is no place among positions in binary32.
fn check_eye(eye: [f64; 3], name: &str, faults: &mut Faults) {
    if eye.iter().any(|value| *value != 0.0 && value.abs() < f64::MIN_POSITIVE) {
        faults.warning(
            "GAURAST-Camera-eye",
            format!("{name}.eye is {eye:?}: are these three floats? They are 64-bit floating point"),
        );
    } else if eye.iter().any(|value| value.abs() > f64::from(f32::MAX)) {
        faults.warning(
            "GAURAST-Camera-eye",
            format!("{name}.eye is {eye:?}, which is beyond all positions, whose attributes have 32 bits"),
        );
    }
}

/// Warns of a camera whose principal point is in the corner, or the middle of a picture of another size, in proportion.
pub(crate) fn check_picture(camera: &Camera, viewport: Option<[f32; 4]>, faults: &mut Faults) {
    let Some([_, _, width, height]) = viewport else { return };
    let sides = [width.abs(), height.abs()];
    if sides.iter().any(|&side| side < 32.0) {
        return;
    }
    if camera.model == Model::PINHOLE && camera.principal_point.iter().all(|c| c.abs() <= 1.0) {
        return faults.warning(
            "GAURAST-Draw-principal-point",
            format!(
                "principalPoint is {:?} with a viewport of {} x {}: it is in pixels from the upper left corner, and mostly the \
                 middle",
                camera.principal_point, sides[0], sides[1]
            ),
        );
    }
    let [across, down] = [0, 1].map(|axis| 2.0 * camera.principal_point[axis] / sides[axis]);
    let is_in_proportion = (across / down - 1.0).abs() < 0.02;
    let is_other = !(0.8..=1.25).contains(&across);
    if across > 0.05 && is_in_proportion && is_other {
        let [x, y] = camera.principal_point;
        faults.warning(
            "GAURAST-Draw-picture-size",
            format!(
                "principalPoint is ({x}, {y}), the middle of a picture of {} x {}, but the viewport is {} x {}: are the \
                 intrinsics those of another resolution?",
                2.0 * x,
                2.0 * y,
                sides[0],
                sides[1]
            ),
        );
    }
}

/// Checks the distortion of a camera's lens.
fn check_lens(lens: &Distortion<'_>, model: Model, name: &str, facts: &Facts, faults: &mut Faults) {
    let known = [
        DistortionModel::RATIONAL,
        DistortionModel::POLYNOMIAL,
        DistortionModel::POLYNOMIAL_FIRST,
        DistortionModel::FIELD_OF_VIEW,
        DistortionModel::DIVISION,
    ];
    if !known.contains(&lens.model) {
        return faults.error(
            "VUID-VkGaussianCameraDistortionGAURAST-model-parameter",
            format!("{name}'s distortion has the model {}, which is none", lens.model.as_raw()),
        );
    }
    let is_on = facts.features.gaussian_distortion != 0;
    faults.require(is_on, "VUID-VkGaussianCameraDistortionGAURAST-gaussianDistortion-90084", || {
        format!("{name} has a distortion, but the feature gaussianDistortion is not enabled")
    });
    let may_distort = model == Model::PINHOLE || model == Model::FISHEYE;
    faults.require(may_distort, "VUID-VkGaussianCameraDistortionGAURAST-model-90085", || {
        format!("{name} has a distortion, but its model is {model:?}, not PINHOLE or FISHEYE")
    });
    let is_finite = coefficients(lens).all(f32::is_finite);
    faults.require(is_finite, "VUID-VkGaussianCameraDistortionGAURAST-radial-90086", || {
        let Distortion { radial, tangential, thin_prism, .. } = lens;
        format!("{name}'s distortion is {radial:?}, {tangential:?}, {thin_prism:?}, but must be finite")
    });
    let has_one = matches!(lens.model, DistortionModel::FIELD_OF_VIEW | DistortionModel::DIVISION);
    let is_one = coefficients(lens).skip(1).all(|coefficient| coefficient == 0.0);
    faults.require(!has_one || is_one, "VUID-VkGaussianCameraDistortionGAURAST-radial-90087", || {
        format!("{name}'s distortion is a {:?}, of which all coefficients but radial[0] must be 0", lens.model)
    });
    let angle = lens.radial[0];
    let is_angle = (0.0..std::f32::consts::PI).contains(&angle);
    faults.require(
        lens.model != DistortionModel::FIELD_OF_VIEW || is_angle,
        "VUID-VkGaussianCameraDistortionGAURAST-radial-90088",
        || format!("{name}'s distortion has the angle {angle}, but it must be at least 0 and less than pi"),
    );
}

fn check_model(model: Model, name: &str, facts: &Facts, faults: &mut Faults) {
    let features = &facts.features;
    let feature = match model {
        Model::PINHOLE => return,
        Model::ORTHOGRAPHIC => ("orthographicCamera", features.orthographic_camera),
        Model::FISHEYE => ("fisheyeCamera", features.fisheye_camera),
        Model::EQUIRECTANGULAR => ("equirectangularCamera", features.equirectangular_camera),
        other => {
            return faults.error(
                "VUID-VkGaussianCameraGAURAST-model-parameter",
                format!("{name}.model is {}, which is no VkGaussianCameraModelGAURAST", other.as_raw()),
            );
        }
    };
    let (feature, is_on) = feature;
    faults.require(is_on != 0, "VUID-VkGaussianCameraGAURAST-model-90079", || {
        format!("{name}.model is {model:?}, but the feature {feature} is not enabled")
    });
}

/// Warns of a matrix that is no rotation, and no mirrored one.
fn check_rotation(rotation: &[f32; 9], name: &str, faults: &mut Faults) {
    let row = |row: usize| &rotation[3 * row..3 * row + 3];
    let dot = |a: usize, b: usize| -> f32 { row(a).iter().zip(row(b)).map(|(a, b)| a * b).sum() };
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    let off = pairs.map(|(a, b)| (dot(a, b) - f32::from(u8::from(a == b))).abs());
    let worst = off.into_iter().fold(0.0, f32::max);
    if worst > 1e-2 {
        faults.warning(
            "GAURAST-Camera-rotation",
            format!(
                "{name}.rotation is {rotation:?}, which is not orthonormal (R Rᵀ is off by {worst}): its rows are \
                     the directions \
                 right, down and forward of the picture in world space, without a scale or a projection"
            ),
        );
    }
}
