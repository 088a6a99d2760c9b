//! Camera files: `cameras.json` of the original 3DGS code, nerfstudio's `transforms.json` and `camera_path.json`, camera
//! tracks, and COLMAP's folders of cameras and images.

mod colmap;
mod nerfstudio;
mod unified;
mod view;

use std::fs;
use std::path::Path;

use serde::Deserialize;

use crate::camera::{CameraError, Model};
use crate::camera_path::Keyframe;
use crate::camera_tracks;
use crate::distortion::Distortion;
use nerfstudio::{CameraPath, Dataparser, Transforms};
use view::Numbers;
pub use view::{CameraFile, CameraFileError, CameraFileOptions, CroppedScene, View, ViewError};

/// Reads all cameras of the file at `path`. `size` replaces an image size that a transforms.json doesn't give.
///
/// # Errors
/// Returns an error if the file can't be read, is of no known kind, or has an invalid camera.
pub fn load(path: &Path, size: [u32; 2]) -> Result<Vec<View>, CameraFileError> {
    let options = CameraFileOptions { size, dataparser: None, undistorted: false };
    Ok(read(path, &options)?.views)
}

/// Reads all cameras of the file, or of COLMAP's folder, at `path`.
///
/// # Errors
/// Returns an error if the file can't be read, is of no known kind, or has an invalid camera.
pub fn read(path: &Path, options: &CameraFileOptions) -> Result<CameraFile, CameraFileError> {
    if let Some(folder) = colmap::folder(path) {
        let mut file = colmap::read(&folder, options)?;
        if options.dataparser.is_some() {
            file.ignored.push("a dataparser's transform is for a transforms.json alone".to_owned());
        }
        return Ok(file);
    }
    let text = read_text(path)?;
    let dataparser = match &options.dataparser {
        Some(path) => Some(dataparser(path)?),
        None => None,
    };
    parse(path, &text, options, dataparser.as_ref())
}

/// The points in space that COLMAP has found, of the model in the folder at `path`.
///
/// # Errors
/// Returns an error if there is no such model, or its file of points can't be read.
pub fn colmap_points(path: &Path) -> Result<Vec<[f64; 3]>, CameraFileError> {
    let folder = colmap::folder(path).ok_or_else(|| CameraFileError::UnknownKind { path: path.to_owned() })?;
    colmap::points(&folder)
}

fn read_text(path: &Path) -> Result<String, CameraFileError> {
    fs::read_to_string(path).map_err(|source| CameraFileError::Io { path: path.to_owned(), source })
}

fn dataparser(path: &Path) -> Result<Dataparser, CameraFileError> {
    let text = read_text(path)?;
    serde_json::from_str(&text).map_err(|source| CameraFileError::Json { path: path.to_owned(), source })
}

fn parse(
    path: &Path,
    text: &str,
    options: &CameraFileOptions,
    dataparser: Option<&Dataparser>,
) -> Result<CameraFile, CameraFileError> {
    let json = |source| CameraFileError::Json { path: path.to_owned(), source };
    let unknown = || CameraFileError::UnknownKind { path: path.to_owned() };
    let (mut crop, mut ignored) = (None, Vec::new());
    let views: Vec<Result<View, ViewError>> = match text.trim_start().as_bytes().first() {
        Some(b'[') => {
            let cameras: Vec<InriaCamera> = serde_json::from_str(text).map_err(json)?;
            if dataparser.is_some() {
                ignored.push("a dataparser's transform is for a transforms.json alone".to_owned());
            }
            cameras.into_iter().map(InriaCamera::view).collect()
        }
        Some(b'{') => {
            let transforms: Transforms = serde_json::from_str(text).map_err(json)?;
            if transforms.is_camera_path() {
                let path: CameraPath = serde_json::from_str(text).map_err(json)?;
                crop = path.crop();
                path.views(options)
            } else if transforms.has_frames() {
                let folder = path.parent().unwrap_or(Path::new(""));
                transforms.views(options, folder, dataparser, &mut ignored).collect()
            } else {
                let keyframes = camera_tracks::parse(text, options.size).map_err(json)?;
                if keyframes.is_empty() {
                    return Err(unknown());
                }
                keyframes.iter().map(|keyframe| keyframe_view(keyframe, options.size)).collect()
            }
        }
        _ => return Err(unknown()),
    };
    let views = views
        .into_iter()
        .enumerate()
        .map(|(view, result)| result.map_err(|reason| CameraFileError::View { path: path.to_owned(), view, reason }))
        .collect::<Result<_, _>>()?;
    Ok(CameraFile { views, crop, ignored })
}

/// The view of a keyframe, which has no name.
fn keyframe_view(keyframe: &Keyframe, size: [u32; 2]) -> Result<View, ViewError> {
    let camera = keyframe.camera(size).map_err(|error| match error {
        CameraError::NotFinite => ViewError::NotFinite,
        CameraError::FieldOfView | CameraError::Focal | CameraError::Planes => ViewError::Focal,
        CameraError::NoDirection | CameraError::NoUp => ViewError::Rotation,
        CameraError::Distortion | CameraError::Coefficients => ViewError::Coefficients,
    })?;
    Ok(View { name: String::new(), camera })
}

/// An entry of cameras.json. The rotation is camera to world: its columns are the directions right, down and forward.
#[derive(Deserialize)]
struct InriaCamera {
    #[serde(default)]
    img_name: String,
    width: f64,
    height: f64,
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
    fx: f64,
    fy: f64,
}

impl InriaCamera {
    fn view(self) -> Result<View, ViewError> {
        let size = [self.width, self.height];
        let column = |c: usize| self.rotation.map(|row| row[c]);
        let camera = Numbers {
            model: Model::Pinhole,
            rotation: [column(0), column(1), column(2)],
            eye: self.position,
            focal: [self.fx, self.fy],
            principal: size.map(|s| s / 2.0),
            distortion: Distortion::default(),
            size,
        }
        .camera()?;
        Ok(View { name: self.img_name, camera })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distortion::DistortionModel;

    fn read(text: &str) -> Result<Vec<View>, CameraFileError> {
        read_with(text, false, None).map(|file| file.views)
    }

    fn read_with(text: &str, undistorted: bool, dataparser: Option<&str>) -> Result<CameraFile, CameraFileError> {
        let options = CameraFileOptions { size: [640, 480], dataparser: None, undistorted };
        let dataparser: Option<Dataparser> = dataparser.map(|text| serde_json::from_str(text).expect("JSON"));
        parse(Path::new("cameras.json"), text, &options, dataparser.as_ref())
    }

    #[track_caller]
    fn close(a: Option<[f64; 2]>, b: [f64; 2]) {
        let a = a.expect("in front");
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} {b:?}");
    }

    /// A camera that looks along +x of the world: right is -z, down is +y.
    const INRIA: &str = r#"[{"id": 0, "img_name": "a", "width": 200, "height": 100,
        "position": [1, 2, 3], "rotation": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        "fy": 80, "fx": 50}]"#;

    #[test]
    fn a_transforms_json_without_a_size_has_that_of_its_photographs() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("transforms.json");
        let text = r#"{"camera_angle_x": 1.0, "frames": [{"file_path": "./train/r_0",
            "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]}"#;
        fs::write(&path, text).expect("written");
        let options = CameraFileOptions { size: [640, 480], dataparser: None, undistorted: false };
        let file = super::read(&path, &options).expect("a camera");
        assert_eq!((file.views[0].camera.width, file.views[0].camera.height), (640, 480));
        assert!(file.ignored[0].contains("640x480 is taken"), "{:?}", file.ignored);
        // The first bytes of a PNG file of 800 by 600 pixels.
        let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x03\x20\0\0\x02\x58\x08\x06\0\0\0";
        fs::create_dir(folder.path().join("train")).expect("a folder");
        fs::write(folder.path().join("train/r_0.png"), png).expect("written");
        let file = super::read(&path, &options).expect("a camera");
        let camera = &file.views[0].camera;
        assert_eq!((camera.width, camera.height), (800, 600));
        assert!((camera.focal[0] - 400.0 / libm::tan(0.5)).abs() < 1e-9);
        assert!(file.ignored.is_empty());
    }

    #[test]
    fn inria_camera_projects_known_points() {
        let views = read(INRIA).expect("a camera");
        assert_eq!((views.len(), views[0].name.as_str()), (1, "a"));
        let camera = &views[0].camera;
        close(camera.project([3., 2., 3.]), [100., 50.]);
        close(camera.project([3., 3., 2.]), [125., 90.]);
        assert_eq!(camera.project([0., 2., 3.]), None);
    }

    #[test]
    fn nerfstudio_camera_projects_known_points() {
        // OpenGL's identity camera looks along -z with y up.
        let text = r#"{"camera_model": "OPENCV", "fl_x": 50, "fl_y": 80, "cx": 90, "cy": 60,
            "w": 200, "h": 100, "k1": 0.0, "frames": [{"file_path": "a.png", "transform_matrix":
            [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}]}"#;
        let camera = &read(text).expect("a camera")[0].camera;
        close(camera.project([1., 2., 1.]), [90., 60.]);
        close(camera.project([2., 3., 1.]), [115., 20.]);

        let by_angle = r#"{"camera_angle_x": 1.5707963267948966, "frames": [{"transform_matrix":
            [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]}"#;
        let camera = &read(by_angle).expect("a camera")[0].camera;
        assert_eq!((camera.width, camera.height), (640, 480));
        close(camera.project([1., 0., -1.]), [640., 240.]);
        close(camera.project([0., 0.75, -1.]), [320., 0.]);
    }

    #[test]
    fn malformed_files_are_refused_in_one_sentence() {
        let refused = |text: &str| {
            let error = read(text).expect_err(text).to_string();
            assert_eq!(error.lines().count(), 1, "{error}");
            assert!(error.starts_with("cameras.json: "), "{error}");
            error
        };
        assert!(refused("").contains("neither"));
        assert!(refused("{}").contains("neither"));
        assert!(refused("[{]").contains("line 1"));
        assert!(refused(&INRIA.replace("\"fx\"", "\"f\"")).contains("missing field `fx`"));
        assert!(refused(&INRIA.replace("50", "-50")).contains("view 0: the focal length"));
        assert!(refused(&INRIA.replace("200", "0")).contains("image size"));
        assert!(refused(&INRIA.replace("200", "1e300")).contains("image size"));
        assert!(refused(&INRIA.replace("[0, 0, 1]", "[0, 0, 2]")).contains("perpendicular"));
        assert!(refused(&INRIA.replace("[1, 2, 3]", "[1, 2]")).contains("line"));
        assert!(refused(&INRIA.replace("50", "1e999")).contains("number out of range"));
        assert!(refused(&INRIA.replace("50", "1e308")).contains("beyond binary32"));
        let thin = r#"{"camera_model": "THIN_PRISM_FISHEYE", "fl_x": 1, "frames":
            [{"transform_matrix": []}]}"#;
        assert!(refused(thin).contains("THIN_PRISM_FISHEYE"));
        assert!(refused(r#"{"frames": [{"transform_matrix": []}]}"#).contains("focal"));
        assert!(refused(r#"{"fl_x": 9, "frames": [{"transform_matrix": []}]}"#).contains("rotation"));
        for cut in 0..INRIA.len() {
            assert!(read(&INRIA[..cut]).is_err());
        }
    }

    const FISHEYE: &str = r#"{"camera_model": "OPENCV_FISHEYE", "fl_x": 50, "cx": 90, "cy": 60,
        "w": 200, "h": 100, "k1": 0.0, "frames": [{"transform_matrix":
        [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}]}"#;

    #[test]
    fn a_lens_is_read_or_left_out_and_told() {
        let camera = &read(FISHEYE).expect("a camera")[0].camera;
        assert_eq!((camera.model, camera.focal, camera.distortion), (Model::Fisheye, [50.0; 2], Distortion::default()));
        let distorted = FISHEYE.replace("\"k1\": 0.0", "\"k1\": -0.05, \"p2\": 0.001");
        let lens = read(&distorted).expect("a camera")[0].camera.distortion;
        assert_eq!((lens.model, lens.to_string().as_str()), (DistortionModel::Polynomial, "k1 = -0.05, p2 = 0.001"));
        let file = read_with(&distorted, true, None).expect("left out");
        assert_eq!(file.views[0].camera, *camera);
        assert_eq!(file.ignored, ["the lens's distortion (k1 = -0.05, p2 = 0.001) is left out"]);
        let cropped = FISHEYE.replace("\"k1\"", "\"fisheye_crop_radius\": 90, \"k1\"");
        let file = read_with(&cropped, false, None).expect("a camera");
        assert!(file.ignored[0].contains("fisheye_crop_radius is ignored"), "{:?}", file.ignored);
    }

    #[test]
    fn a_transforms_jsons_lenses_are_those_of_nerfstudio() {
        let lens = |model: &str, coefficients: &str| {
            let text = FISHEYE.replace("OPENCV_FISHEYE", model).replace("\"k1\": 0.0", coefficients);
            read(&text).map(|views| views[0].camera.distortion)
        };
        let opencv = lens("OPENCV", "\"k1\": 0.5, \"k2\": 0.25, \"k3\": 0.125, \"p1\": 1, \"p2\": 2").expect("a lens");
        let radial = [0.5, 0.25, 0.125, 0.0, 0.0, 0.0];
        assert_eq!((opencv.model, opencv.radial, opencv.tangential), (DistortionModel::Rational, radial, [1.0, 2.0]));
        // nerfstudio's k4 multiplies the eighth power; OpenCV's, with k5 and k6, divides.
        assert_eq!(lens("OPENCV", "\"k4\": 0.5").expect("a lens").model, DistortionModel::Polynomial);
        assert_eq!(lens("OPENCV", "\"k4\": 0.5, \"k6\": 1").expect("a lens").model, DistortionModel::Rational);
        let aria =
            lens("FISHEYE624", "\"distortion_params\": [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]").expect("a lens");
        assert_eq!((aria.model, aria.radial[5], aria.tangential), (DistortionModel::PolynomialFirst, 6.0, [8.0, 7.0]));
        assert_eq!(aria.thin_prism, [9.0, 10.0, 11.0, 12.0]);
        let six = lens("OPENCV", "\"distortion_params\": [1, 2, 3, 0, 5, 6]").expect("a lens");
        assert_eq!(
            (six.model, six.radial, six.tangential),
            (DistortionModel::Rational, [1.0, 2.0, 3.0, 0.0, 0.0, 0.0], [5.0, 6.0])
        );
        let refused = lens("OPENCV", "\"distortion_params\": [1, 2]").expect_err("two numbers").to_string();
        assert!(refused.contains("distortion_params"), "{refused}");
        assert!(lens("OPENCV", "\"k1\": 1e300").expect_err("too large").to_string().contains("beyond binary32"));
    }

    #[test]
    fn a_dataparsers_transform_takes_cameras_to_the_model() {
        // Half a turn about z, moved by (1, 0, 0), then scaled by 0.5.
        let dataparser = r#"{"transform": [[-1, 0, 0, 1], [0, -1, 0, 0], [0, 0, 1, 0]], "scale": 0.5}"#;
        let file = read_with(FISHEYE, false, Some(dataparser)).expect("a camera");
        let camera = &file.views[0].camera;
        assert_eq!(camera.eye, [0.0, -1.0, 1.5]);
        assert_eq!(camera.rotation[0], [-1.0, 0.0, 0.0]);
        // A transform that was already applied to the frames is part of the file's transform.
        let applied = FISHEYE.replace(
            "\"w\"",
            "\"applied_transform\": [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0]], \"applied_scale\": 0.25, \"w\"",
        );
        let dataparser = r#"{"transform": [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0]], "scale": 0.25}"#;
        let file = read_with(&applied, false, Some(dataparser)).expect("a camera");
        assert_eq!(file.views[0].camera.eye, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn a_viewers_camera_path_is_read() {
        let text = r#"{"camera_type": "perspective", "render_height": 100, "render_width": 200, "fps": 24,
            "camera_path": [{"camera_to_world": [1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1], "fov": 90}]}"#;
        let camera = &read(text).expect("a camera")[0].camera;
        assert_eq!((camera.width, camera.height, camera.eye), (200, 100, [1.0, 2.0, 3.0]));
        assert!((camera.focal[0] - 50.0).abs() < 1e-9);
        // nerfstudio takes a fisheye's focal length from the angle as that of a pinhole.
        let camera = &read(&text.replace("perspective", "fisheye")).expect("a camera")[0].camera;
        assert_eq!(camera.model, Model::Fisheye);
        assert!((camera.focal[0] - 50.0).abs() < 1e-9);
        let panorama = text.replace("perspective", "equirectangular").replace(", \"fov\": 90", "");
        let camera = &read(&panorama).expect("a camera")[0].camera;
        assert_eq!(camera.model, Model::Equirectangular);
        let stereo = read(&text.replace("perspective", "omnidirectional")).expect_err("two pictures").to_string();
        assert!(stereo.contains("camera model omnidirectional is not read"), "{stereo}");
    }

    #[test]
    fn a_camera_path_crops_the_scene() {
        let text = r#"{"render_height": 100, "render_width": 200, "camera_path": [{"camera_to_world":
            [1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1], "fov": 90}], "crop": {"crop_center": [1, 2, 3],
            "crop_scale": [2, 4, 6], "crop_rot": [0, 0, 0], "crop_bg_color": {"r": 255, "g": 0, "b": 51}}}"#;
        let cropped = read_with(text, false, None).expect("a path").crop.expect("a crop");
        assert_eq!((cropped.crop.centre, cropped.crop.lengths), ([1.0, 2.0, 3.0], [2.0, 4.0, 6.0]));
        assert_eq!(cropped.background, [1.0, 0.0, 0.2]);
        let whole = text.replace("\"crop\": {", "\"crop\": null, \"other\": {");
        assert_eq!(read_with(&whole, false, None).expect("a path").crop, None);
    }

    #[test]
    fn a_camera_track_has_a_view_for_each_keyframe() {
        let text = r#"{"version": 4, "keyframes": [{"time": 0, "position": [1, -2, -3], "rotation": [1, 0, 0, 0],
            "focal_length_mm": 24, "easing": 0}]}"#;
        let camera = &read(text).expect("a track")[0].camera;
        assert_eq!((camera.width, camera.height, camera.eye), (640, 480, [1.0, 2.0, 3.0]));
        assert!(read(&text.replace("[1, 0, 0, 0]", "[0, 0, 0, 0]")).is_err());
    }
}
