//! nerfstudio's files: `transforms.json`, `dataparser_transforms.json` and `camera_path.json`.

use std::path::Path;

use glam::{DMat3, DMat4, DVec3};
use serde::Deserialize;

use super::view::{CameraFileOptions, CroppedScene, FileDistortion, Numbers, View, ViewError};
use crate::camera::Model;
use crate::crop::Crop;
use crate::distortion::{Distortion, DistortionModel};

/// A transforms.json, or any other JSON object.
#[derive(Deserialize)]
pub(super) struct Transforms {
    #[serde(flatten)]
    intrinsics: Intrinsics,
    frames: Option<Vec<Frame>>,
    camera_path: Option<serde_json::Value>,
    /// The transform that was applied to the frames' poses before they were written.
    applied_transform: Option<[[f64; 4]; 3]>,
    applied_scale: Option<f64>,
    fisheye_crop_radius: Option<f64>,
}

impl Transforms {
    /// Reports whether the file is the viewer's camera path instead.
    pub(super) fn is_camera_path(&self) -> bool {
        self.frames.is_none() && self.camera_path.is_some()
    }

    /// Returns true if the file has frames.
    pub(super) fn has_frames(&self) -> bool {
        self.frames.is_some()
    }

    /// The views of the frames.
    pub(super) fn views(
        self,
        options: &CameraFileOptions,
        folder: &Path,
        dataparser: Option<&Dataparser>,
        ignored: &mut Vec<String>,
    ) -> impl Iterator<Item = Result<View, ViewError>> {
        let placement = dataparser.map(|dataparser| {
            let applied = self.applied_transform.map_or(DMat4::IDENTITY, matrix);
            Placement {
                transform: matrix(dataparser.transform) * applied.inverse(),
                scale: dataparser.scale / self.applied_scale.unwrap_or(1.0),
            }
        });
        if self.fisheye_crop_radius.is_some() {
            ignored.push("fisheye_crop_radius is ignored: all that the lens sees is drawn".to_owned());
        }
        let views: Vec<_> = (self.frames.unwrap_or_default().into_iter())
            .map(|mut frame| {
                let given = frame.intrinsics.size(&self.intrinsics);
                let given = given.or_else(|| size_of_photograph(folder, &frame.file_path));
                if given.is_none() {
                    let [width, height] = options.size;
                    let note = format!(
                        "the file gives no size of its pictures, and its photographs are not beside it: {width}x{height} is taken"
                    );
                    if !ignored.contains(&note) {
                        ignored.push(note);
                    }
                }
                let [width, height] = given.unwrap_or(options.size.map(f64::from));
                (frame.intrinsics.w, frame.intrinsics.h) = (Some(width), Some(height));
                frame.view(&self.intrinsics, options, placement.as_ref(), ignored)
            })
            .collect();
        views.into_iter()
    }
}

/// A dataparser_transforms.json: the map from the photographs' world to that of the trained model.
#[derive(Deserialize)]
pub(super) struct Dataparser {
    transform: [[f64; 4]; 3],
    scale: f64,
}

/// The map from the frames of a transforms.json to the model's world: the transform, then the scale.
struct Placement {
    transform: DMat4,
    scale: f64,
}

fn matrix([x, y, z]: [[f64; 4]; 3]) -> DMat4 {
    DMat4::from_cols_array_2d(&[x, y, z, [0.0, 0.0, 0.0, 1.0]]).transpose()
}

/// Intrinsics, which transforms.json gives once for all frames and may override for a frame.
#[derive(Clone, Default, Deserialize)]
struct Intrinsics {
    camera_model: Option<String>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    /// The horizontal field of view in radians.
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    k5: Option<f64>,
    k6: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
    /// All coefficients of the lens, in place of the names: k1 to k4, p1 and p2; of a FISHEYE624 k0 to k5, p0, p1, and s0 to s3.
    distortion_params: Option<Vec<f64>>,
}

/// The camera model of a FISHEYE624, as Aria's glasses have it.
const FISHEYE624: &str = "FISHEYE624";

impl Intrinsics {
    /// The size of the picture in pixels.
    fn size(&self, shared: &Self) -> Option<[f64; 2]> {
        Some([self.w.or(shared.w)?, self.h.or(shared.h)?])
    }

    /// The distortion of the lens of a camera model.
    fn distortion(&self, shared: &Self, camera_model: &str, model: Model) -> Result<Distortion, ViewError> {
        let given = self.distortion_params.as_deref().or(shared.distortion_params.as_deref());
        if camera_model == FISHEYE624 {
            let Some(&[k1, k2, k3, k4, k5, k6, p0, p1, s1, s2, s3, s4]) = given else {
                return Err(ViewError::Parameters);
            };
            return Ok(Distortion {
                model: DistortionModel::PolynomialFirst,
                radial: [k1, k2, k3, k4, k5, k6],
                // p0 multiplies u^2, as OpenCV's p2 does.
                tangential: [p1, p0],
                thin_prism: [s1, s2, s3, s4],
            });
        }
        let named = |name: fn(&Self) -> Option<f64>| name(self).or(name(shared)).unwrap_or(0.0);
        let [k1, k2, k3, k4, p1, p2] = match given {
            Some(&[k1, k2, k3, k4, p1, p2]) => [k1, k2, k3, k4, p1, p2],
            Some(_) => return Err(ViewError::Parameters),
            None => {
                [named(|i| i.k1), named(|i| i.k2), named(|i| i.k3), named(|i| i.k4), named(|i| i.p1), named(|i| i.p2)]
            }
        };
        let [k5, k6] = [named(|i| i.k5), named(|i| i.k6)];
        // nerfstudio's k4 multiplies r^8. OpenCV's, which comes with k5 and k6, divides.
        let is_polynomial = model == Model::Fisheye || (k4 != 0.0 && k5 == 0.0 && k6 == 0.0);
        Ok(Distortion {
            model: if is_polynomial { DistortionModel::Polynomial } else { DistortionModel::Rational },
            radial: [k1, k2, k3, k4, k5, k6],
            tangential: [p1, p2],
            thin_prism: [0.0; 4],
        })
    }
}

/// The size of the photograph `name` in `folder`. Blender's files name photographs without their extensions.
fn size_of_photograph(folder: &Path, name: &str) -> Option<[f64; 2]> {
    let extensions = ["", ".png", ".jpg", ".jpeg", ".webp", ".PNG", ".JPG", ".JPEG"];
    let found =
        extensions.iter().find_map(|extension| imagesize::size(folder.join(format!("{name}{extension}"))).ok())?;
    Some([found.width, found.height].map(|side| side as f64))
}

#[derive(Deserialize)]
struct Frame {
    #[serde(default)]
    file_path: String,
    /// The rows of camera to world, with OpenGL's camera: columns right, up, back and position.
    transform_matrix: Vec<[f64; 4]>,
    #[serde(flatten)]
    intrinsics: Intrinsics,
}

impl Frame {
    fn view(
        self,
        shared: &Intrinsics,
        options: &CameraFileOptions,
        placement: Option<&Placement>,
        ignored: &mut Vec<String>,
    ) -> Result<View, ViewError> {
        let own = self.intrinsics;
        let size = own.size(shared).ok_or(ViewError::Size)?;
        let camera_model = own.camera_model.as_deref().or(shared.camera_model.as_deref()).unwrap_or("PINHOLE");
        let model = match camera_model {
            "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" => Model::Pinhole,
            "OPENCV_FISHEYE" | FISHEYE624 => Model::Fisheye,
            "EQUIRECTANGULAR" => Model::Equirectangular,
            other => return Err(ViewError::Model(other.to_owned())),
        };
        let of_angle = |angle: Option<f64>, side: f64| angle.map(|angle| side / 2.0 / libm::tan(angle / 2.0));
        let fx = own.fl_x.or(shared.fl_x).or_else(|| of_angle(own.camera_angle_x.or(shared.camera_angle_x), size[0]));
        let fy = own.fl_y.or(shared.fl_y).or_else(|| of_angle(own.camera_angle_y.or(shared.camera_angle_y), size[1]));
        let whole = model == Model::Equirectangular;
        let (fx, fy) = if whole {
            // A panorama fills its picture, whatever intrinsics the file gives.
            (Some(size[0] / std::f64::consts::TAU), Some(size[1] / std::f64::consts::PI))
        } else {
            (fx, fy)
        };
        // Pixels are square unless the file says otherwise.
        let fx = fx.or(fy).ok_or(ViewError::Focal)?;
        let principal = [own.cx.or(shared.cx).unwrap_or(size[0] / 2.0), own.cy.or(shared.cy).unwrap_or(size[1] / 2.0)];
        let distortion = FileDistortion::Drawn(own.distortion(shared, camera_model, model)?);
        let distortion = distortion.chosen(options.undistorted || whole, ignored)?;
        let rows = self.transform_matrix.first_chunk().ok_or(ViewError::Rotation)?;
        let (rotation, eye) = pose(*rows, placement);
        let focal = [fx, fy.unwrap_or(fx)];
        let camera = Numbers { model, rotation, eye, focal, principal, distortion, size }.camera()?;
        Ok(View { name: self.file_path, camera })
    }
}

/// The rotation from world to camera, and the eye, from the rows of an OpenGL camera's matrix.
fn pose(rows: [[f64; 4]; 3], placement: Option<&Placement>) -> ([[f64; 3]; 3], [f64; 3]) {
    let rows = match placement {
        None => rows,
        Some(placement) => {
            let placed = (placement.transform * matrix(rows)).transpose();
            let [x, y, z, _] = placed.to_cols_array_2d();
            [x, y, z].map(|[a, b, c, position]| [a, b, c, placement.scale * position])
        }
    };
    let [x, y, z] = rows;
    let column = |c: usize, sign: f64| [sign * x[c], sign * y[c], sign * z[c]];
    ([column(0, 1.0), column(1, -1.0), column(2, -1.0)], column(3, 1.0))
}

/// A camera_path.json, as the viewer exports it.
#[derive(Deserialize)]
pub(super) struct CameraPath {
    #[serde(default)]
    camera_type: Option<String>,
    render_width: f64,
    render_height: f64,
    camera_path: Vec<PathFrame>,
    crop: Option<PathCrop>,
}

#[derive(Deserialize)]
struct PathFrame {
    /// The camera-to-world matrix, row by row.
    camera_to_world: Vec<f64>,
    /// The vertical field of view in degrees. A panorama has none.
    #[serde(default)]
    fov: f64,
}

/// The box to which the viewer crops the scene.
#[derive(Deserialize)]
struct PathCrop {
    crop_center: [f64; 3],
    /// The lengths of the sides.
    crop_scale: [f64; 3],
    /// Roll, pitch and yaw in radians.
    #[serde(default)]
    crop_rot: [f64; 3],
    crop_bg_color: PathColor,
}

/// A colour, each channel 0 to 255.
#[derive(Deserialize)]
struct PathColor {
    r: f32,
    g: f32,
    b: f32,
}

impl CameraPath {
    /// The part of the scene that is shown, if it is cropped.
    pub(super) fn crop(&self) -> Option<CroppedScene> {
        let PathCrop { crop_center, crop_scale, crop_rot, crop_bg_color: PathColor { r, g, b } } =
            self.crop.as_ref()?;
        let crop = Crop::turned_by(*crop_center, *crop_rot, *crop_scale);
        Some(CroppedScene { crop, background: [*r, *g, *b].map(|channel| channel / 255.0) })
    }

    /// The views, named by their numbers.
    pub(super) fn views(self, _: &CameraFileOptions) -> Vec<Result<View, ViewError>> {
        let size = [self.render_width, self.render_height];
        let view = |frame: &PathFrame| {
            let half = libm::tan(frame.fov.to_radians() / 2.0);
            let (model, focal) = match self.camera_type.as_deref() {
                None | Some("perspective") => (Model::Pinhole, [size[1] / 2.0 / half; 2]),
                // nerfstudio takes the focal length of a pinhole with this angle.
                Some("fisheye") => (Model::Fisheye, [size[1] / 2.0 / half; 2]),
                Some("equirectangular") => {
                    (Model::Equirectangular, [size[0] / std::f64::consts::TAU, size[1] / std::f64::consts::PI])
                }
                Some(other) => return Err(ViewError::Model(other.to_owned())),
            };
            let rows: &[f64; 16] = (frame.camera_to_world.first_chunk()).ok_or(ViewError::Rotation)?;
            let row = |r: usize| std::array::from_fn(|c| rows[4 * r + c]);
            let (rotation, eye) = pose([row(0), row(1), row(2)], None);
            let camera = Numbers {
                model,
                rotation: orthonormal(rotation),
                eye,
                focal,
                principal: size.map(|side| side / 2.0),
                distortion: Distortion::default(),
                size,
            }
            .camera()?;
            Ok(View { name: String::new(), camera })
        };
        self.camera_path.iter().map(view).collect()
    }
}

/// The rotation nearest to rows that a viewer has rounded; the rows themselves if they are not near to one.
fn orthonormal(rows: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let [right, down, _] = rows.map(DVec3::from_array);
    let right = right.normalize_or_zero();
    let down = (down - down.dot(right) * right).normalize_or_zero();
    let fixed = [right, down, right.cross(down)];
    let given = DMat3::from_cols_array_2d(&rows);
    let near = given.abs_diff_eq(DMat3::from_cols(fixed[0], fixed[1], fixed[2]), 0.01);
    if near { fixed.map(<[f64; 3]>::from) } else { rows }
}
