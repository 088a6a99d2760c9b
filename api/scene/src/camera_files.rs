//! Camera files: `cameras.json` of the original 3DGS code, and nerfstudio's `transforms.json`.

use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::Deserialize;
use thiserror::Error;

use crate::camera::{Camera, Model};

/// The most pixels along an axis that a camera file may claim.
const MAX_SIZE: f64 = 1e6;

/// How far a rotation's rows may be from orthonormal.
const TOLERANCE: f64 = 1e-3;

/// A camera of a file.
#[derive(Clone, Debug)]
pub struct View {
    /// The photograph's name, or empty.
    pub name: String,
    /// The camera, with the photograph's size.
    pub camera: Camera,
}

/// Why a camera file could not be read. Displayed as one sentence: file, place, reason.
#[derive(Debug, Error)]
pub enum CameraFileError {
    /// The file cannot be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is not JSON, or not of this shape.
    #[error("{}: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong, with line and column.
        source: serde_json::Error,
    },
    /// The file is neither of the two kinds.
    #[error("{}: this is neither a cameras.json (a list) nor a transforms.json (with frames)", path.display())]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
    /// A camera's numbers are not a camera.
    #[error("{}: view {view}: {reason}", path.display())]
    View {
        /// The file.
        path: PathBuf,
        /// The camera's index in the file, from 0.
        view: usize,
        /// What is wrong with it.
        reason: ViewError,
    },
}

/// What is wrong with a camera of a file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ViewError {
    /// The image size is not positive and reasonable.
    #[error("the image size is not positive whole numbers of pixels")]
    Size,
    /// A focal length is absent or not positive.
    #[error("the focal length is missing or not positive")]
    Focal,
    /// The rotation is not one.
    #[error("the rotation's rows are not perpendicular unit vectors")]
    Rotation,
    /// A model other than pinhole.
    #[error("camera model {0} is not read")]
    Model(String),
}

/// Reads all cameras of the file at `path`. `size` stands in for an image size that a
/// transforms.json doesn't give.
///
/// # Errors
/// If the file cannot be read, is of neither kind, or holds a camera that is none.
pub fn load(path: &Path, size: [u32; 2]) -> Result<Vec<View>, CameraFileError> {
    let text = fs::read_to_string(path).map_err(|source| CameraFileError::Io {
        path: path.to_owned(),
        source,
    })?;
    parse(path, &text, size)
}

fn parse(path: &Path, text: &str, size: [u32; 2]) -> Result<Vec<View>, CameraFileError> {
    let json = |source| CameraFileError::Json {
        path: path.to_owned(),
        source,
    };
    let views: Vec<Result<View, ViewError>> = match text.trim_start().as_bytes().first() {
        Some(b'[') => {
            let cameras: Vec<InriaCamera> = serde_json::from_str(text).map_err(json)?;
            cameras.into_iter().map(InriaCamera::view).collect()
        }
        Some(b'{') => {
            let Transforms { intrinsics, frames } = serde_json::from_str(text).map_err(json)?;
            let frames = frames.ok_or_else(|| CameraFileError::UnknownKind {
                path: path.to_owned(),
            })?;
            let view = |frame: Frame| frame.view(&intrinsics, size);
            frames.into_iter().map(view).collect()
        }
        _ => {
            return Err(CameraFileError::UnknownKind {
                path: path.to_owned(),
            });
        }
    };
    views
        .into_iter()
        .enumerate()
        .map(|(view, result)| {
            result.map_err(|reason| CameraFileError::View {
                path: path.to_owned(),
                view,
                reason,
            })
        })
        .collect()
}

/// One entry of cameras.json. The rotation is camera to world: its columns are the directions
/// right, down and forward.
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
        let camera = camera(
            [column(0), column(1), column(2)],
            self.position,
            [self.fx, self.fy],
            size.map(|s| s / 2.0),
            size,
        )?;
        Ok(View {
            name: self.img_name,
            camera,
        })
    }
}

#[derive(Deserialize)]
struct Transforms {
    #[serde(flatten)]
    intrinsics: Intrinsics,
    frames: Option<Vec<Frame>>,
}

/// What transforms.json holds once for all frames, and any frame may hold for itself.
#[derive(Clone, Default, Deserialize)]
struct Intrinsics {
    camera_model: Option<String>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    /// Horizontal field of view in radians.
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
}

#[derive(Deserialize)]
struct Frame {
    #[serde(default)]
    file_path: String,
    /// Camera to world, with OpenGL's camera: columns right, up, back and position.
    transform_matrix: Vec<[f64; 4]>,
    #[serde(flatten)]
    intrinsics: Intrinsics,
}

impl Frame {
    fn view(self, shared: &Intrinsics, size: [u32; 2]) -> Result<View, ViewError> {
        let own = self.intrinsics;
        let model = own.camera_model.or_else(|| shared.camera_model.clone());
        if let Some(model) = model
            && !["OPENCV", "PINHOLE", "SIMPLE_PINHOLE"].contains(&model.as_str())
        {
            return Err(ViewError::Model(model));
        }
        let size = [
            own.w.or(shared.w).unwrap_or(size[0].into()),
            own.h.or(shared.h).unwrap_or(size[1].into()),
        ];
        let of_angle =
            |angle: Option<f64>, side: f64| angle.map(|angle| side / 2.0 / (angle / 2.0).tan());
        let fx = own
            .fl_x
            .or(shared.fl_x)
            .or_else(|| of_angle(own.camera_angle_x.or(shared.camera_angle_x), size[0]));
        let fy = own
            .fl_y
            .or(shared.fl_y)
            .or_else(|| of_angle(own.camera_angle_y.or(shared.camera_angle_y), size[1]));
        // Pixels are square unless the file says otherwise.
        let fx = fx.or(fy).ok_or(ViewError::Focal)?;
        let principal = [
            own.cx.or(shared.cx).unwrap_or(size[0] / 2.0),
            own.cy.or(shared.cy).unwrap_or(size[1] / 2.0),
        ];
        let [x, y, z] = self
            .transform_matrix
            .first_chunk()
            .ok_or(ViewError::Rotation)?;
        let column = |c: usize, sign: f64| [sign * x[c], sign * y[c], sign * z[c]];
        let camera = camera(
            [column(0, 1.0), column(1, -1.0), column(2, -1.0)],
            column(3, 1.0),
            [fx, fy.unwrap_or(fx)],
            principal,
            size,
        )?;
        Ok(View {
            name: self.file_path,
            camera,
        })
    }
}

/// A camera of checked numbers; `rotation` is world to camera.
fn camera(
    rotation: [[f64; 3]; 3],
    eye: [f64; 3],
    focal: [f64; 2],
    principal: [f64; 2],
    size: [f64; 2],
) -> Result<Camera, ViewError> {
    if !size
        .iter()
        .all(|s| (1.0..=MAX_SIZE).contains(s) && s.fract() == 0.0)
    {
        return Err(ViewError::Size);
    }
    if !focal.iter().all(|f| *f > 0.0 && f.is_finite()) {
        return Err(ViewError::Focal);
    }
    let orthonormal = (0..3).all(|i| {
        (0..3).all(|j| {
            let dot: f64 = rotation[i]
                .iter()
                .zip(rotation[j])
                .map(|(a, b)| a * b)
                .sum();
            (dot - f64::from(u8::from(i == j))).abs() <= TOLERANCE
        })
    });
    if !orthonormal {
        return Err(ViewError::Rotation);
    }
    Ok(Camera {
        model: Model::Pinhole,
        rotation,
        eye,
        focal,
        principal,
        width: size[0] as u32,
        height: size[1] as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<View>, CameraFileError> {
        parse(Path::new("cameras.json"), text, [640, 480])
    }

    #[track_caller]
    fn close(a: Option<[f64; 2]>, b: [f64; 2]) {
        let a = a.expect("in front");
        assert!(
            a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6),
            "{a:?} {b:?}"
        );
    }

    /// Looks along +x of the world: right is -z, down is +y.
    const INRIA: &str = r#"[{"id": 0, "img_name": "a", "width": 200, "height": 100,
        "position": [1, 2, 3], "rotation": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        "fy": 80, "fx": 50}]"#;

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
        let fisheye = r#"{"camera_model": "OPENCV_FISHEYE", "fl_x": 1, "frames":
            [{"transform_matrix": []}]}"#;
        assert!(refused(fisheye).contains("OPENCV_FISHEYE"));
        assert!(refused(r#"{"frames": [{"transform_matrix": []}]}"#).contains("focal"));
        assert!(
            refused(r#"{"fl_x": 9, "frames": [{"transform_matrix": []}]}"#).contains("rotation")
        );
        for cut in 0..INRIA.len() {
            assert!(read(&INRIA[..cut]).is_err());
        }
    }
}
