//! COLMAP's sparse models: `cameras` and `images`, as `.bin` or `.txt`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};

use super::unified::UnifiedLens;
use super::view::{CameraFile, CameraFileError, CameraFileOptions, FileDistortion, Numbers, View, ViewError};
use crate::camera::Model;
use crate::distortion::{Distortion, DistortionModel};

/// A camera model of COLMAP.
struct CameraModel {
    name: &'static str,
    /// The number of parameters, as present versions write them.
    parameters: usize,
    /// Another number, as earlier versions wrote them.
    earlier: Option<usize>,
}

const fn model(name: &'static str, parameters: usize) -> CameraModel {
    CameraModel { name, parameters, earlier: None }
}

/// COLMAP's camera models, by number.
const MODELS: [CameraModel; 18] = [
    model("SIMPLE_PINHOLE", 3),
    model("PINHOLE", 4),
    model("SIMPLE_RADIAL", 4),
    model("RADIAL", 5),
    model("OPENCV", 8),
    model("OPENCV_FISHEYE", 8),
    model("FULL_OPENCV", 12),
    model("FOV", 5),
    model("SIMPLE_RADIAL_FISHEYE", 4),
    model("RADIAL_FISHEYE", 5),
    model("THIN_PRISM_FISHEYE", 12),
    CameraModel { earlier: Some(14), ..model("RAD_TAN_THIN_PRISM_FISHEYE", 16) },
    model("SIMPLE_DIVISION", 4),
    model("DIVISION", 5),
    model("SIMPLE_FISHEYE", 3),
    model("FISHEYE", 4),
    model("EUCM", 6),
    CameraModel { earlier: Some(3), ..model("EQUIRECTANGULAR", 2) },
];

/// The greatest distance in pixels of a place from that of a lens which a polynomial stands for.
const FITTED_PIXELS: f64 = 0.01;

/// Bytes of a point of an image: its position and the number of the point in space.
const POINT: usize = 24;

/// The folder of the sparse model that `path` is, or that contains the file `path`.
pub(super) fn folder(path: &Path) -> Option<PathBuf> {
    let holds = |folder: &Path| {
        ["bin", "txt"].iter().any(|kind| {
            folder.join(format!("cameras.{kind}")).is_file() && folder.join(format!("images.{kind}")).is_file()
        })
    };
    if path.is_dir() {
        return ["", "sparse/0", "sparse", "0"].iter().map(|inner| path.join(inner)).find(|folder| holds(folder));
    }
    let name = path.file_stem()?.to_str()?;
    let folder = parent(path);
    let kind = path.extension().is_some_and(|e| e == "bin" || e == "txt");
    (kind && (name == "cameras" || name == "images") && holds(&folder)).then_some(folder)
}

fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// A camera's model, picture size and parameters.
struct Intrinsics {
    model: String,
    size: [f64; 2],
    parameters: Vec<f64>,
}

/// A camera's projection.
struct Lens {
    model: Model,
    focal: [f64; 2],
    principal: [f64; 2],
    distortion: FileDistortion,
}

impl Intrinsics {
    /// The projection.
    fn lens(&self) -> Result<Lens, ViewError> {
        let p = |index: usize| self.parameters.get(index).copied().unwrap_or(0.0);
        let simple = ([p(0), p(0)], [p(1), p(2)], 3);
        let full = ([p(0), p(1)], [p(2), p(3)], 4);
        let (model, (focal, principal, first)) = match self.model.as_str() {
            "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "SIMPLE_DIVISION" => (Model::Pinhole, simple),
            "PINHOLE" | "OPENCV" | "FULL_OPENCV" | "FOV" | "DIVISION" => (Model::Pinhole, full),
            "EUCM" => {
                let (focal, principal, _) = full;
                let (model, distortion) = self.unified(&UnifiedLens { alpha: p(4), beta: p(5) }, focal, principal);
                return Ok(Lens { model, focal, principal, distortion });
            }
            "SIMPLE_FISHEYE" | "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE" => (Model::Fisheye, simple),
            "FISHEYE" | "OPENCV_FISHEYE" | "THIN_PRISM_FISHEYE" | "RAD_TAN_THIN_PRISM_FISHEYE" => {
                (Model::Fisheye, full)
            }
            "EQUIRECTANGULAR" => {
                // A panorama fills its picture, whatever parameters the file gives.
                let [width, height] = self.size;
                let focal = [width / std::f64::consts::TAU, height / std::f64::consts::PI];
                return Ok(Lens {
                    model: Model::Equirectangular,
                    focal,
                    principal: [width / 2.0, height / 2.0],
                    distortion: FileDistortion::Drawn(Distortion::default()),
                });
            }
            other => return Err(ViewError::Model(other.to_owned())),
        };
        Ok(Lens { model, focal, principal, distortion: self.distortion(|index| p(first + index)) })
    }

    /// The projection and distortion of a lens of the unified model: a pinhole if alpha is zero, whatever beta is; a fisheye's
    /// polynomial, if it is within [`FITTED_PIXELS`] of the lens all over the picture.
    fn unified(&self, lens: &UnifiedLens, focal: [f64; 2], principal: [f64; 2]) -> (Model, FileDistortion) {
        if lens.alpha == 0.0 {
            return (Model::Pinhole, FileDistortion::Drawn(Distortion::default()));
        }
        let side = |axis: usize| {
            let farthest = principal[axis].abs().max((self.size[axis] - principal[axis]).abs());
            farthest / focal[axis].abs()
        };
        let fitted = lens.fitted(libm::hypot(side(0), side(1)));
        if fitted.error * focal[0].abs().max(focal[1].abs()) <= FITTED_PIXELS {
            (Model::Fisheye, FileDistortion::Drawn(fitted.distortion))
        } else {
            (Model::Pinhole, FileDistortion::Other(format!("alpha = {}, beta = {}", lens.alpha, lens.beta)))
        }
    }

    /// The distortion of the lens, whose coefficients follow the principal point.
    fn distortion(&self, c: impl Fn(usize) -> f64) -> FileDistortion {
        let of = |model, radial| Distortion { model, radial, ..Distortion::default() };
        let one = |model, coefficient| of(model, [coefficient, 0.0, 0.0, 0.0, 0.0, 0.0]);
        FileDistortion::Drawn(match self.model.as_str() {
            "SIMPLE_RADIAL" | "RADIAL" => of(DistortionModel::Rational, [c(0), c(1), 0.0, 0.0, 0.0, 0.0]),
            "OPENCV" | "FULL_OPENCV" => Distortion {
                tangential: [c(2), c(3)],
                ..of(DistortionModel::Rational, [c(0), c(1), c(4), c(5), c(6), c(7)])
            },
            // The angle's sign does not matter.
            "FOV" => one(DistortionModel::FieldOfView, c(0).abs()),
            "SIMPLE_DIVISION" | "DIVISION" => one(DistortionModel::Division, c(0)),
            "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE" | "OPENCV_FISHEYE" => {
                of(DistortionModel::Polynomial, [c(0), c(1), c(2), c(3), 0.0, 0.0])
            }
            "THIN_PRISM_FISHEYE" => Distortion {
                tangential: [c(2), c(3)],
                thin_prism: [c(6), 0.0, c(7), 0.0],
                ..of(DistortionModel::Polynomial, [c(0), c(1), c(4), c(5), 0.0, 0.0])
            },
            "RAD_TAN_THIN_PRISM_FISHEYE" => Distortion {
                // p0 multiplies u^2, as OpenCV's p2 does.
                tangential: [c(7), c(6)],
                thin_prism: [c(8), c(9), c(10), c(11)],
                ..of(DistortionModel::PolynomialFirst, [c(0), c(1), c(2), c(3), c(4), c(5)])
            },
            _ => Distortion::default(),
        })
    }
}

/// A photograph's pose: world to camera.
struct Photograph {
    name: String,
    /// The rotation's quaternion w, x, y, z.
    rotation: [f64; 4],
    translation: [f64; 3],
    camera: u64,
}

/// Reads the model in `folder`. Views are in the order of their names.
pub(super) fn read(folder: &Path, options: &CameraFileOptions) -> Result<CameraFile, CameraFileError> {
    let (cameras_path, images_path) = ["bin", "txt"]
        .map(|kind| (folder.join(format!("cameras.{kind}")), folder.join(format!("images.{kind}"))))
        .into_iter()
        .find(|(cameras, images)| cameras.is_file() && images.is_file())
        .ok_or_else(|| CameraFileError::UnknownKind { path: folder.to_owned() })?;
    let binary = cameras_path.extension().is_some_and(|e| e == "bin");
    let bytes =
        |path: &Path| std::fs::read(path).map_err(|source| CameraFileError::Io { path: path.to_owned(), source });
    let damaged =
        |path: &Path, reason: &str| CameraFileError::Colmap { path: path.to_owned(), reason: reason.to_owned() };
    let (cameras, images) = (bytes(&cameras_path)?, bytes(&images_path)?);
    let (cameras, images) = if binary {
        (binary_cameras(&cameras), binary_images(&images))
    } else {
        (text_cameras(&cameras), text_images(&images))
    };
    let cameras = cameras.map_err(|reason| damaged(&cameras_path, &reason))?;
    let mut images = images.map_err(|reason| damaged(&images_path, reason))?;
    images.sort_by(|a, b| a.name.cmp(&b.name));
    let mut file = CameraFile::default();
    let mut unknown = Vec::new();
    for (view, image) in images.into_iter().enumerate() {
        let camera = cameras
            .get(&image.camera)
            .ok_or_else(|| damaged(&images_path, "an image is of a camera that is not there"))?;
        match image.view(camera, options, &mut file.ignored) {
            Ok(view) => file.views.push(view),
            Err(ViewError::Model(name)) => unknown.push((view, name)),
            Err(reason) => return Err(CameraFileError::View { path: images_path, view, reason }),
        }
    }
    // Views of models with unknown names are refused, and the others drawn.
    if let Some((view, name)) = unknown.first().cloned() {
        if file.views.is_empty() {
            return Err(CameraFileError::View { path: images_path, view, reason: ViewError::Model(name) });
        }
        let count = unknown.len();
        file.ignored.push(format!("{count} views are left out, whose camera model is not read, such as {name}"));
    }
    Ok(file)
}

/// Reads the points of the model in `folder`.
pub(super) fn points(folder: &Path) -> Result<Vec<[f64; 3]>, CameraFileError> {
    let binary = folder.join("points3D.bin");
    let is_binary = binary.is_file();
    let path = if is_binary { binary } else { folder.join("points3D.txt") };
    let bytes = std::fs::read(&path).map_err(|source| CameraFileError::Io { path: path.clone(), source })?;
    let points = if is_binary { binary_points(&bytes) } else { text_points(&bytes) };
    points.map_err(|reason| CameraFileError::Colmap { path, reason: reason.to_owned() })
}

impl Photograph {
    fn view(
        self,
        camera: &Intrinsics,
        options: &CameraFileOptions,
        ignored: &mut Vec<String>,
    ) -> Result<View, ViewError> {
        let Lens { model, focal, principal, distortion } = camera.lens()?;
        let distortion = distortion.chosen(options.undistorted, ignored)?;
        let [w, x, y, z] = self.rotation;
        let quaternion = DQuat::from_xyzw(x, y, z, w);
        let length = quaternion.length();
        if !length.is_finite() || length < 1e-9 {
            return Err(ViewError::Rotation);
        }
        let rotation = DMat3::from_quat(quaternion.normalize());
        let eye = -(rotation.transpose() * DVec3::from_array(self.translation));
        let camera = Numbers {
            model,
            rotation: rotation.transpose().to_cols_array_2d(),
            eye: eye.into(),
            focal,
            principal,
            distortion,
            size: camera.size,
        }
        .camera()?;
        Ok(View { name: self.name, camera })
    }
}

/// Bytes that are read from the front.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], &'static str> {
        let (taken, rest) = self.0.split_first_chunk().ok_or("it ends too early")?;
        self.0 = rest;
        Ok(*taken)
    }

    fn u32(&mut self) -> Result<u32, &'static str> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn u64(&mut self) -> Result<u64, &'static str> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    fn f64(&mut self) -> Result<f64, &'static str> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    fn text(&mut self) -> Result<&'a [u8], &'static str> {
        let end = (self.0.iter().position(|byte| *byte == 0)).ok_or("it ends within a name")?;
        let (text, rest) = self.0.split_at(end);
        self.0 = &rest[1..];
        Ok(text)
    }

    fn skip(&mut self, count: u64, size: usize) -> Result<(), &'static str> {
        let bytes = usize::try_from(count)
            .ok()
            .and_then(|count| count.checked_mul(size))
            .filter(|bytes| *bytes <= self.0.len())
            .ok_or("it ends too early")?;
        self.0 = &self.0[bytes..];
        Ok(())
    }
}

/// Parses a binary file of cameras. Models whose number of parameters has changed have the present one, or else the
/// earlier one with which the file has the right size.
fn binary_cameras(bytes: &[u8]) -> Result<HashMap<u64, Intrinsics>, String> {
    let present = binary_cameras_of(bytes, |model| model.parameters);
    present.or_else(|reason| {
        binary_cameras_of(bytes, |model| model.earlier.unwrap_or(model.parameters)).map_err(|_| reason)
    })
}

fn binary_cameras_of(
    bytes: &[u8],
    parameters_of: impl Fn(&CameraModel) -> usize,
) -> Result<HashMap<u64, Intrinsics>, String> {
    let mut bytes = Bytes(bytes);
    let count = bytes.u64()?;
    let mut cameras = HashMap::new();
    for _ in 0..count {
        let id = bytes.u32()?.into();
        let number = bytes.u32()?;
        // A record has no length, so that nothing after it could be read.
        let model = MODELS.get(number as usize).ok_or_else(|| {
            let last = MODELS.len() - 1;
            format!("camera {id} is of model {number}, and those up to {last} are known")
        })?;
        let size = [bytes.u64()? as f64, bytes.u64()? as f64];
        let parameters = (0..parameters_of(model)).map(|_| bytes.f64()).collect::<Result<_, _>>()?;
        cameras.insert(id, Intrinsics { model: model.name.to_owned(), size, parameters });
    }
    if bytes.0.is_empty() { Ok(cameras) } else { Err("there is data after its last camera".to_owned()) }
}

fn binary_images(bytes: &[u8]) -> Result<Vec<Photograph>, &'static str> {
    let mut bytes = Bytes(bytes);
    let count = bytes.u64()?;
    let mut images = Vec::new();
    for _ in 0..count {
        bytes.u32()?;
        let mut rotation = [0.0; 4];
        for part in &mut rotation {
            *part = bytes.f64()?;
        }
        let mut translation = [0.0; 3];
        for part in &mut translation {
            *part = bytes.f64()?;
        }
        let camera = bytes.u32()?.into();
        let name = String::from_utf8_lossy(bytes.text()?).into_owned();
        let points = bytes.u64()?;
        bytes.skip(points, POINT)?;
        images.push(Photograph { name, rotation, translation, camera });
    }
    Ok(images)
}

/// Parses a binary file of points: number, position, colour, error, and the images that see it.
fn binary_points(bytes: &[u8]) -> Result<Vec<[f64; 3]>, &'static str> {
    let mut bytes = Bytes(bytes);
    let count = bytes.u64()?;
    let mut points = Vec::new();
    for _ in 0..count {
        bytes.skip(1, 8)?;
        points.push([bytes.f64()?, bytes.f64()?, bytes.f64()?]);
        bytes.skip(1, 3 + 8)?;
        let images = bytes.u64()?;
        bytes.skip(images, 8)?;
    }
    Ok(points)
}

fn lines(bytes: &[u8]) -> Result<impl Iterator<Item = &str>, &'static str> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text")?;
    Ok(text.lines().filter(|line| !line.starts_with('#')))
}

fn number(word: Option<&str>) -> Result<f64, &'static str> {
    word.and_then(|word| word.parse().ok()).ok_or("a line lacks a number")
}

fn whole(word: Option<&str>) -> Result<u64, &'static str> {
    word.and_then(|word| word.parse().ok()).ok_or("a line lacks a whole number")
}

/// Parses a text file of cameras. A model of an unknown name is an error of its views alone.
fn text_cameras(bytes: &[u8]) -> Result<HashMap<u64, Intrinsics>, String> {
    let mut cameras = HashMap::new();
    for line in lines(bytes)?.filter(|line| !line.trim().is_empty()) {
        let mut words = line.split_whitespace();
        let id = whole(words.next())?;
        let model = words.next().ok_or("a line lacks the camera model")?;
        let size = [number(words.next())?, number(words.next())?];
        let parameters = words.map(|word| number(Some(word))).collect::<Result<Vec<_>, _>>()?;
        let known = MODELS.iter().find(|known| known.name == model);
        if known.is_some_and(|known| ![Some(known.parameters), known.earlier].contains(&Some(parameters.len()))) {
            return Err(format!("camera {id} has too many or too few parameters"));
        }
        cameras.insert(id, Intrinsics { model: model.to_owned(), size, parameters });
    }
    Ok(cameras)
}

/// Parses a text file of images. Each image has two lines, of which the second, its points, may be empty.
fn text_images(bytes: &[u8]) -> Result<Vec<Photograph>, &'static str> {
    let mut images = Vec::new();
    let mut lines = lines(bytes)?;
    while let Some(line) = lines.next() {
        if line.trim().is_empty() {
            continue;
        }
        let mut words = line.split_whitespace();
        whole(words.next())?;
        let mut numbers = [0.0; 7];
        for part in &mut numbers {
            *part = number(words.next())?;
        }
        let [w, x, y, z, tx, ty, tz] = numbers;
        let camera = whole(words.next())?;
        let name = words.collect::<Vec<_>>().join(" ");
        lines.next();
        images.push(Photograph { name, rotation: [w, x, y, z], translation: [tx, ty, tz], camera });
    }
    Ok(images)
}

/// Parses a text file of points.
fn text_points(bytes: &[u8]) -> Result<Vec<[f64; 3]>, &'static str> {
    let point = |line: &str| {
        let mut words = line.split_whitespace().skip(1);
        Ok([number(words.next())?, number(words.next())?, number(words.next())?])
    };
    lines(bytes)?.filter(|line| !line.trim().is_empty()).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERAS: &str = "# cameras\n1 PINHOLE 200 100 50 80 90 60\n2 OPENCV 64 48 50 50 32 24 0.1 0 0 0\n";
    /// b looks along +z from (1, 2, 3); a is the same, rotated half a turn about y.
    const IMAGES: &str = "# images\n7 1 0 0 0 -1 -2 -3 1 b.png\n\n9 0 0 1 0 1 -2 3 1 a.png\n1 2 -1\n";

    fn model(cameras: &[u8], images: &[u8], kind: &str) -> Result<CameraFile, CameraFileError> {
        let folder = tempfile::tempdir().expect("a folder");
        let sparse = folder.path().join("sparse/0");
        std::fs::create_dir_all(&sparse).expect("folders");
        std::fs::write(sparse.join(format!("cameras.{kind}")), cameras).expect("written");
        std::fs::write(sparse.join(format!("images.{kind}")), images).expect("written");
        let options = CameraFileOptions { size: [8, 8], dataparser: None, undistorted: false };
        super::super::read(folder.path(), &options)
    }

    #[track_caller]
    fn check(file: &CameraFile) {
        let names: Vec<&str> = file.views.iter().map(|view| view.name.as_str()).collect();
        assert_eq!(names, ["a.png", "b.png"]);
        for (view, [x, y, z]) in [(1, [1.5, 2.5, 5.0]), (0, [0.5, 2.5, 1.0])] {
            let camera = &file.views[view].camera;
            let at = camera.project([x, y, z]).expect("in front");
            let expected = [50.0 * 0.25 + 90.0, 80.0 * 0.25 + 60.0];
            for axis in 0..2 {
                assert!((at[axis] - expected[axis]).abs() < 1e-9, "{view}: {at:?}");
            }
            assert_eq!((camera.width, camera.height), (200, 100));
        }
    }

    #[test]
    fn points_are_read() {
        let expected = [[1.0, 2.0, 3.5], [-4.0, 0.0, 6.0]];
        let text = "# points\n7 1 2 3.5 255 0 9 0.5 1 2 3 4\n9 -4 0 6 0 0 0 0.25\n";
        assert_eq!(text_points(text.as_bytes()), Ok(expected.to_vec()));
        assert!(text_points(b"7 1 2").is_err());
        let mut binary = 2_u64.to_le_bytes().to_vec();
        for (point, images) in expected.iter().zip([2_usize, 0]) {
            binary.extend(7_u64.to_le_bytes());
            binary.extend(point.iter().flat_map(|part| part.to_le_bytes()));
            binary.extend([255, 0, 9]);
            binary.extend(0.5_f64.to_le_bytes());
            binary.extend((images as u64).to_le_bytes());
            binary.extend(vec![0; 8 * images]);
        }
        assert_eq!(binary_points(&binary), Ok(expected.to_vec()));
        for cut in 0..binary.len() {
            assert!(binary_points(&binary[..cut]).is_err(), "{cut}");
        }
    }

    #[test]
    fn text_and_binary_models_are_the_same_cameras() {
        check(&model(CAMERAS.as_bytes(), IMAGES.as_bytes(), "txt").expect("cameras"));
        let mut cameras = 1_u64.to_le_bytes().to_vec();
        cameras.extend(1_u32.to_le_bytes());
        cameras.extend(1_u32.to_le_bytes());
        cameras.extend([200_u64, 100].iter().flat_map(|side| side.to_le_bytes()));
        cameras.extend([50.0_f64, 80.0, 90.0, 60.0].iter().flat_map(|p| p.to_le_bytes()));
        let mut images = 2_u64.to_le_bytes().to_vec();
        for (name, pose, points) in [
            ("b.png", [1.0_f64, 0.0, 0.0, 0.0, -1.0, -2.0, -3.0], 0_u64),
            ("a.png", [0.0, 0.0, 1.0, 0.0, 1.0, -2.0, 3.0], 2),
        ] {
            images.extend(7_u32.to_le_bytes());
            images.extend(pose.iter().flat_map(|part| part.to_le_bytes()));
            images.extend(1_u32.to_le_bytes());
            images.extend(name.as_bytes());
            images.push(0);
            images.extend(points.to_le_bytes());
            images.extend(vec![0; POINT * points as usize]);
        }
        check(&model(&cameras, &images, "bin").expect("cameras"));
        for cut in [0, 9, 40, images.len() - 1] {
            let refused = model(&cameras, &images[..cut], "bin").expect_err("it is cut");
            assert_eq!(refused.to_string().lines().count(), 1, "{refused}");
        }
    }

    #[test]
    fn lenses_are_read_and_unknown_cameras_refused() {
        let distorted = IMAGES.replace(" 1 b.png", " 2 b.png");
        let file = model(CAMERAS.as_bytes(), distorted.as_bytes(), "txt").expect("cameras");
        let lenses = [0, 1].map(|view: usize| file.views[view].camera.distortion.to_string());
        assert_eq!(lenses, ["", "k1 = 0.1"]);
        let missing = IMAGES.replace(" 1 b.png", " 5 b.png");
        let refused = model(CAMERAS.as_bytes(), missing.as_bytes(), "txt").expect_err("missing");
        assert!(refused.to_string().contains("not there"), "{refused}");
        let unknown = CAMERAS.replace("PINHOLE", "MIRROR");
        let refused = model(unknown.as_bytes(), IMAGES.as_bytes(), "txt").expect_err("unknown");
        assert!(refused.to_string().contains("camera model MIRROR is not read"), "{refused}");
        // Views of other cameras are drawn.
        let unknown = CAMERAS.replace("2 OPENCV", "2 MIRROR");
        let images = IMAGES.replace(" 1 b.png", " 2 b.png");
        let file = model(unknown.as_bytes(), images.as_bytes(), "txt").expect("the other view");
        assert_eq!(file.views.len(), 1);
        assert_eq!(file.views[0].name, "a.png");
        assert!(file.ignored[0].contains("1 views are left out") && file.ignored[0].contains("MIRROR"));
    }

    /// A binary file of one camera, 200 by 100 pixels.
    fn binary_camera(model: u32, parameters: &[f64]) -> Vec<u8> {
        let mut cameras = 1_u64.to_le_bytes().to_vec();
        cameras.extend([1, model].iter().flat_map(|word: &u32| word.to_le_bytes()));
        cameras.extend([200_u64, 100].iter().flat_map(|side| side.to_le_bytes()));
        cameras.extend(parameters.iter().flat_map(|p| p.to_le_bytes()));
        cameras
    }

    /// A binary file of one image of camera 1.
    fn binary_image() -> Vec<u8> {
        let mut images = 1_u64.to_le_bytes().to_vec();
        images.extend(7_u32.to_le_bytes());
        images.extend([1.0_f64, 0.0, 0.0, 0.0, -1.0, -2.0, -3.0].iter().flat_map(|part| part.to_le_bytes()));
        images.extend(1_u32.to_le_bytes());
        images.extend(b"a.png\0");
        images.extend(0_u64.to_le_bytes());
        images
    }

    /// Tests each model, by number, with all coefficients zero, and with the last one not zero.
    #[test]
    fn every_model_is_read_with_its_lens() {
        let simple = [0, 2, 3, 8, 9, 12, 14];
        let fisheyes = [5, 8, 9, 10, 11, 14, 15];
        // Its coefficients are not those of the file.
        let unified = 16;
        for (number, entry) in (0..).zip(&MODELS) {
            for count in [Some(entry.parameters), entry.earlier].into_iter().flatten() {
                let first: &[f64] =
                    if simple.contains(&number) { &[50.0, 90.0, 60.0] } else { &[50.0, 80.0, 90.0, 60.0] };
                let mut parameters = vec![0.0; count.max(first.len())];
                parameters[..first.len()].copy_from_slice(first);
                parameters.truncate(count);
                if entry.name == "EUCM" {
                    parameters[5] = 1.0;
                }
                let read = |parameters: &[f64]| model(&binary_camera(number, parameters), &binary_image(), "bin");
                let camera = read(&parameters).expect(entry.name).views.remove(0).camera;
                let expected = match number {
                    17 => Model::Equirectangular,
                    _ if fisheyes.contains(&number) => Model::Fisheye,
                    _ => Model::Pinhole,
                };
                assert_eq!(camera.model, expected, "{}", entry.name);
                if number < 17 {
                    let focal = if simple.contains(&number) { [50.0; 2] } else { [50.0, 80.0] };
                    assert_eq!((camera.focal, camera.principal), (focal, [90.0, 60.0]), "{}", entry.name);
                }
                if count > first.len() && number < 17 {
                    if number == unified {
                        parameters[4] = 0.6;
                        let camera = read(&parameters).expect(entry.name).views.remove(0).camera;
                        assert_eq!(camera.model, Model::Fisheye);
                        assert!(!camera.distortion.is_none());
                        // The picture reaches far beyond what a polynomial of a nearly ideal lens serves.
                        parameters[4] = 0.001;
                        let refused = read(&parameters).expect_err(entry.name).to_string();
                        assert!(refused.contains("the lens distorts (alpha = 0.001, beta = 1)"), "{refused}");
                    } else {
                        parameters[count - 1] = 0.125;
                        let lens = read(&parameters).expect(entry.name).views[0].camera.distortion;
                        assert!(lens.to_string().ends_with("= 0.125"), "{}: {lens}", entry.name);
                    }
                }
            }
        }
        let refused = model(&binary_camera(18, &[0.0; 4]), &binary_image(), "bin").expect_err("unknown").to_string();
        assert!(refused.contains("camera 1 is of model 18, and those up to 17 are known"), "{refused}");
    }
}
