//! The cameras for which the command line asks.

use std::path::PathBuf;

use gaurast_picture::Background;
use gaurast_scene::camera::{Camera, CameraError, DEFAULT_FOV, Model};
use gaurast_scene::camera_files::{self, CameraFileError, CameraFileOptions, CroppedScene};
use gaurast_scene::camera_path::{self, Keyframe};
use gaurast_scene::camera_tracks;
use gaurast_scene::{Axes, DEFAULT_UP, Extent, Framing, Scene, Subject};
use glam::DVec3;
use thiserror::Error;

use crate::args::{CameraArguments, CameraModel};
use crate::sources::{Source, stem};

/// The default size of pictures.
pub const DEFAULT_SIZE: [u32; 2] = [1280, 720];

/// The default vertical field of view of a fisheye, in degrees.
const FISHEYE_FOV: f64 = 180.0;

/// An error of the cameras. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum ViewError {
    #[error(transparent)]
    CameraFile(#[from] CameraFileError),
    #[error(transparent)]
    Camera(#[from] CameraError),
    #[error("{}: there is no view in it", path.display())]
    NoViews { path: PathBuf },
    #[error("{}: view {view}: there are {count} views, counted from 0", path.display())]
    NoView { path: PathBuf, view: String, count: usize },
    #[error("{}: view {view}: {matches} views have this in their names", path.display())]
    NoName { path: PathBuf, view: String, matches: usize },
    #[error("--view {0}: neither an index, a range such as 3..7 or 0..100:10, nor all")]
    Range(String),
    #[error("--fov {0}: it is less than 180 degrees, unless the camera is a fisheye")]
    FieldOfView(f64),
    #[error("--view needs --cameras FILE, or a folder with a cameras.json as the scene")]
    NoCameras,
    #[error("{}: {source}", path.display())]
    PathFile { path: PathBuf, source: std::io::Error },
    #[error("{}: not a list of keyframes, nor a camera track: {source}", path.display())]
    Path { path: PathBuf, source: serde_json::Error },
    #[error("--axes {0}: these axes mirror the scene, and a camera file can't be mirrored with it")]
    Mirrored(Axes),
    #[error("{}: there is no keyframe", path.display())]
    NoKeyframe { path: PathBuf },
}

impl ViewError {
    /// Returns true if the command line is invalid whatever the files contain.
    pub fn is_misuse(&self) -> bool {
        matches!(self, Self::NoCameras | Self::Range(_) | Self::FieldOfView(_) | Self::Mirrored(_))
    }
}

/// A requested picture: its camera and its name.
#[derive(Clone, Debug)]
pub struct View {
    /// The photograph's name, if the camera belongs to one.
    pub name: Option<String>,
    pub camera: Camera,
}

/// The requested views.
#[derive(Debug, Default)]
pub struct Views {
    pub views: Vec<View>,
    /// The part of the scene that a camera file shows, if not all of it.
    pub cropped: Option<CroppedScene>,
    /// Notes for the user, a sentence each.
    pub notes: Vec<String>,
    /// The options that give the same view again, if the view was chosen to fit the scene.
    pub framing: Option<String>,
}

/// Cameras that are known before the scene is read, so that their errors are reported first.
pub enum Known {
    /// The selected cameras of a camera file.
    File(Views),
    /// The cameras of a path.
    Path(Vec<Camera>),
    /// The cameras depend on the scene.
    Scene,
}

impl Known {
    /// The number of views.
    pub fn count(&self, arguments: &CameraArguments) -> usize {
        match self {
            Self::File(views) => views.views.len(),
            Self::Path(cameras) => cameras.len(),
            Self::Scene => arguments.orbit.map_or(1, |count| count as usize),
        }
    }

    /// The background of the scene that a camera file gives.
    pub fn background(&self) -> Option<Background> {
        match self {
            Self::File(views) => views.cropped.map(|cropped| Background::Color(cropped.background)),
            Self::Path(_) | Self::Scene => None,
        }
    }

    /// Returns true if a camera file shows a part of the scene.
    pub fn crops(&self) -> bool {
        matches!(self, Self::File(views) if views.cropped.is_some())
    }

    /// Leaves out the part of the scene that a camera file does not show.
    pub fn crop(&mut self, scene: &mut Scene) {
        let Self::File(views) = self else {
            return;
        };
        let Some(CroppedScene { crop, .. }) = views.cropped else {
            return;
        };
        let turned = scene.metadata().axes.filter(|axes| axes.of_cameras);
        let count = scene.len();
        turned.map_or(crop, |axes| crop.with_axes(axes.axes)).apply(scene);
        views.notes.push(format!(
            "{} of {count} Gaussians are in the box to which the camera file crops the scene",
            scene.len()
        ));
    }
}

/// Reads the camera file or the path, if the arguments have one.
///
/// # Errors
/// See [`ViewError`].
pub fn read(arguments: &CameraArguments, source: &Source) -> Result<Known, ViewError> {
    if let Some(fov) = arguments.fov.filter(|fov| *fov >= 180.0)
        && !is_inside(arguments.model)
    {
        return Err(ViewError::FieldOfView(fov));
    }
    let size = arguments.size.map(|size| size.0);
    if let Some(path) = &arguments.path {
        return Ok(Known::Path(path_cameras(arguments, path, size.unwrap_or(DEFAULT_SIZE))?));
    }
    let by_hand = arguments.eye.is_some()
        || arguments.up.is_some()
        || arguments.azimuth.is_some()
        || arguments.elevation.is_some()
        || arguments.distance.is_some()
        || arguments.orbit.is_some()
        || arguments.fov.is_some();
    let beside = source.cameras.as_ref().filter(|_| !by_hand);
    let Some(path) = arguments.cameras.as_ref().or(beside) else {
        return if arguments.view.is_empty() { Ok(Known::Scene) } else { Err(ViewError::NoCameras) };
    };
    let mut views = Views::default();
    let mut options = CameraFileOptions {
        size: size.unwrap_or(DEFAULT_SIZE),
        dataparser: arguments.dataparser.clone(),
        undistorted: arguments.undistorted,
    };
    let transforms = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("transforms"));
    if options.dataparser.is_none() && transforms {
        options.dataparser.clone_from(&source.dataparser);
        if let Some(dataparser) = &source.dataparser {
            let note = format!("the cameras are taken to the model by {}", dataparser.display());
            views.notes.push(note);
        }
    }
    let file = camera_files::read(path, &options)?;
    views.notes.extend(file.ignored);
    views.cropped = file.crop;
    let chosen = if arguments.view.is_empty() {
        choose("0", path, &file.views)?
    } else {
        let mut chosen = Vec::new();
        for text in &arguments.view {
            chosen.extend(choose(text, path, &file.views)?);
        }
        chosen
    };
    let training_size = source.training_size.as_ref().filter(|_| source.cameras.as_ref() == Some(path));
    for index in chosen {
        let camera_files::View { name, camera } = file.views[index].clone();
        let own = [camera.width, camera.height];
        let [width, height] = size.or(training_size.map(|sizes| sizes.of(&name, own))).unwrap_or(own);
        if size.is_none() && [width, height] != own && views.views.is_empty() {
            views.notes.push(format!(
                "the pictures are as large as those of the training, {width}x{height}, as cfg_args says"
            ));
        }
        let camera = if [width, height] == own { camera } else { camera.resized([width, height]) };
        let name = if name.is_empty() { format!("{index:05}") } else { name };
        views.views.push(View { name: Some(name), camera });
    }
    Ok(Known::File(views))
}

/// The cameras for `scene`, with the requested models and planes.
///
/// # Errors
/// See [`ViewError`].
pub fn of_scene(known: Known, arguments: &CameraArguments, scene: &Scene, garden: bool) -> Result<Views, ViewError> {
    let extent = Extent::of(scene);
    let mut views = match known {
        Known::File(mut views) => {
            for view in &mut views.views {
                view.camera = turned_with(&view.camera, scene)?;
                view.camera = with_near(&view.camera, false, &extent);
            }
            views
        }
        Known::Path(cameras) => unnamed(cameras.iter().map(|camera| {
            let inside = [Model::Fisheye, Model::Equirectangular].contains(&camera.model);
            with_near(camera, inside || is_inside(arguments.model), &extent)
        })),
        Known::Scene => by_hand(arguments, &extent, scene, garden)?,
    };
    if arguments.model == CameraModel::Equirectangular && arguments.fov.is_some() {
        let note = "--fov is of no account: a panorama has 360 by 180 degrees";
        views.notes.push(note.to_owned());
    }
    let distorts = views.views.iter().any(|view| !view.camera.distortion.is_none());
    for view in &mut views.views {
        let camera = projected(&view.camera, arguments, &extent);
        let camera = camera.zoomed(arguments.zoom.unwrap_or(1.0));
        let near = arguments.near.unwrap_or(camera.near);
        view.camera = camera.with_planes(near, arguments.far.unwrap_or(camera.far));
        view.camera.check()?;
    }
    if distorts {
        let drawn = lenses(views.views.iter().map(|view| &view.camera));
        let left_out = || "--camera has an ideal lens, and the distortion of the file's is left out".to_owned();
        views.notes.push(drawn.unwrap_or_else(left_out));
    }
    if let Some(view) = views.views.first().filter(|view| view.camera.model == Model::Orthographic) {
        let scale = short(1.0 / view.camera.focal[1]);
        views.notes.push(format!("the scale of the picture is {scale} units a pixel"));
    }
    Ok(views)
}

fn unnamed(cameras: impl Iterator<Item = Camera>) -> Views {
    let view = |camera| View { name: None, camera };
    Views { views: cameras.map(view).collect(), ..Views::default() }
}

/// The camera of a file in the axes of `scene`, if the scene was turned and the file's coordinates are those of its cameras.
fn turned_with(camera: &Camera, scene: &Scene) -> Result<Camera, ViewError> {
    let Some(file_axes) = scene.metadata().axes.filter(|axes| axes.of_cameras) else {
        return Ok(camera.clone());
    };
    if file_axes.axes.is_mirrored() {
        return Err(ViewError::Mirrored(file_axes.axes));
    }
    let matrix = file_axes.axes.matrix();
    let turned = |vector: [f64; 3]| (matrix * DVec3::from_array(vector)).to_array();
    Ok(Camera { rotation: camera.rotation.map(turned), eye: turned(camera.eye), ..camera.clone() })
}

/// A sentence about the lenses of `cameras` that distort, if there are any.
pub fn lenses<'a>(cameras: impl IntoIterator<Item = &'a Camera>) -> Option<String> {
    let mut distinct: Vec<&Camera> = Vec::new();
    for camera in cameras {
        let is_known = |other: &&Camera| (other.model, other.distortion) == (camera.model, camera.distortion);
        if !camera.distortion.is_none() && !distinct.iter().any(is_known) {
            distinct.push(camera);
        }
    }
    let first = distinct.first()?;
    let lens = first.distortion;
    let fold = first.fold_angle().map_or_else(String::new, |angle| {
        format!(", up to {:.1} degrees from its axis, where it folds", angle.to_degrees())
    });
    let others = match distinct.len() - 1 {
        0 => String::new(),
        1 => ", and so does 1 other".to_owned(),
        count => format!(", and so do {count} others"),
    };
    Some(format!("the lens distorts and is drawn so ({}: {lens}){fold}{others}", lens.model.name()))
}

/// True if a camera of this model sees all around it, and thus stands in the scene.
fn is_inside(model: CameraModel) -> bool {
    matches!(model, CameraModel::Fisheye | CameraModel::Equirectangular)
}

/// The camera with a near plane that fits a small scene, or a place inside the scene.
fn with_near(camera: &Camera, inside: bool, extent: &Extent) -> Camera {
    let near = if inside { extent.near() / 4.0 } else { extent.near() };
    camera.with_planes(camera.near.min(near), camera.far)
}

/// The camera with the requested model.
fn projected(camera: &Camera, arguments: &CameraArguments, extent: &Extent) -> Camera {
    let orthographic = |flat: Camera, ahead: f64| {
        let far = camera.far.min(ahead + 100.0 * extent.radius());
        flat.with_planes(camera.near, far)
    };
    // The middle of the scene, or the target, has the same size as with a pinhole.
    let middle = arguments.target.map_or(extent.centre, |target| target.0);
    let ahead = distance_ahead(camera, middle).max(1e-6 * extent.radius());
    match (arguments.model, camera.model) {
        (CameraModel::Pinhole | CameraModel::Orthographic, Model::Orthographic) => orthographic(camera.clone(), ahead),
        (CameraModel::Orthographic, _) => orthographic(camera.orthographic(ahead), ahead),
        (CameraModel::Pinhole, _) | (CameraModel::Fisheye, Model::Fisheye) => camera.clone(),
        (CameraModel::Fisheye, _) => camera.fisheye(arguments.fov.unwrap_or(FISHEYE_FOV)),
        (CameraModel::Equirectangular, _) => camera.panorama(),
    }
}

/// The distance of `point` along the camera's axis.
fn distance_ahead(camera: &Camera, point: [f64; 3]) -> f64 {
    let [_, _, forward] = camera.rotation;
    (0..3).map(|axis| forward[axis] * (point[axis] - camera.eye[axis])).sum()
}

/// The camera given by options, or one that fits the scene; or an orbit that starts there.
fn by_hand(arguments: &CameraArguments, extent: &Extent, scene: &Scene, garden: bool) -> Result<Views, ViewError> {
    let size = arguments.size.map_or(DEFAULT_SIZE, |size| size.0);
    let up = arguments.up.map_or(DEFAULT_UP, |up| up.0);
    let inside = is_inside(arguments.model);
    // A field of view for a fisheye does not fit a pinhole.
    let fov = arguments.fov.filter(|_| !inside);
    let framed = arguments.azimuth.is_some()
        || arguments.elevation.is_some()
        || arguments.distance.is_some()
        || arguments.up.is_some()
        || arguments.target.is_some();
    let mut said = None;
    let (camera, pivot) = match (arguments.eye, arguments.target) {
        (Some(eye), Some(target)) => {
            let camera = Camera::look_at(eye.0, target.0, up, fov.unwrap_or(DEFAULT_FOV), size)?;
            (with_near(&camera, inside, extent), target.0)
        }
        _ if garden && !framed && arguments.orbit.is_none() => {
            let camera = gaurast_scene::garden::camera(fov, size)?;
            (camera, extent.centre)
        }
        _ if inside && arguments.distance.is_none() => {
            let azimuth = arguments.azimuth.unwrap_or(0.0);
            let camera = gaurast_scene::inside(extent, azimuth, up, DEFAULT_FOV, size)?;
            said = Some(format!("standing at {}", triple(camera.eye)));
            (camera, extent.centre)
        }
        _ => {
            let framing = Framing {
                azimuth: arguments.azimuth,
                elevation: arguments.elevation,
                distance: arguments.distance,
                target: arguments.target.map(|target| target.0),
                up,
                ..Framing::new(fov.unwrap_or(DEFAULT_FOV), size)
            };
            let subject = Subject::of(scene);
            let framed = if arguments.orbit.is_some() { framing.orbit(&subject)? } else { framing.framed(&subject)? };
            let (azimuth, elevation) = framing.angles();
            let distance = short(framed.distance);
            let placed = format!("framed by --azimuth {azimuth:.1} --elevation {elevation:.1} --distance {distance}");
            let given = [
                ("--target", Some(place(framed.target, framed.distance))),
                ("--up", arguments.up.map(|up| triple(up.0))),
                ("--fov", fov.map(|fov| fov.to_string())),
                ("--zoom", arguments.zoom.map(|zoom| zoom.to_string())),
            ];
            let given = given.into_iter().filter_map(|(name, value)| Some(format!(" {name} {}", value?)));
            said = Some(given.fold(placed, |said, option| said + &option));
            (framed.camera, framed.target)
        }
    };
    let mut views = match arguments.orbit {
        None => unnamed([camera].into_iter()),
        Some(count) => {
            let turned = |i: u32| {
                let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
                camera.turned(pivot, up, angle)
            };
            unnamed((0..count).map(turned))
        }
    };
    views.framing = said;
    Ok(views)
}

/// A number with five significant digits.
pub fn short(number: f64) -> f64 {
    format!("{number:.4e}").parse().unwrap_or(number)
}

/// A point in the form of an option's value, with digits for a ten-thousandth of `distance`.
fn place(point: [f64; 3], distance: f64) -> String {
    let digits = libm::ceil(4.0 - libm::log10(distance)).clamp(0.0, 12.0) as usize;
    let rounded = point.map(|value| format!("{value:.digits$}").parse::<f64>().unwrap_or(value) + 0.0);
    rounded.map(|value| value.to_string()).join(",")
}

/// Three numbers in the form of an option's value.
fn triple(values: [f64; 3]) -> String {
    values.map(|value| short(value).to_string()).join(",")
}

fn path_cameras(arguments: &CameraArguments, path: &std::path::Path, size: [u32; 2]) -> Result<Vec<Camera>, ViewError> {
    let text = std::fs::read_to_string(path).map_err(|source| ViewError::PathFile { path: path.to_owned(), source })?;
    let is_track = text.trim_start().starts_with('{');
    let keyframes: Result<Vec<Keyframe>, _> =
        if is_track { camera_tracks::parse(&text, size) } else { serde_json::from_str(&text) };
    let keyframes = keyframes.map_err(|source| ViewError::Path { path: path.to_owned(), source })?;
    if keyframes.is_empty() {
        return Err(ViewError::NoKeyframe { path: path.to_owned() });
    }
    let count = arguments.frames.map(|count| count as usize);
    Ok(camera_path::along(&keyframes, count, size)?)
}

/// The indices of the views that `text` selects.
fn choose(text: &str, path: &std::path::Path, views: &[camera_files::View]) -> Result<Vec<usize>, ViewError> {
    let count = views.len();
    let no_view = |view: &str| ViewError::NoView { path: path.to_owned(), view: view.to_owned(), count };
    if count == 0 {
        return Err(ViewError::NoViews { path: path.to_owned() });
    }
    let text = text.trim();
    if text == "all" {
        return Ok((0..count).collect());
    }
    if let Some((first, rest)) = text.split_once("..") {
        let (last, step) = rest.split_once(':').unwrap_or((rest, "1"));
        let number = |word: &str, otherwise: usize| {
            if word.is_empty() {
                return Ok(otherwise);
            }
            (word.trim_start_matches('=').parse::<usize>()).map_err(|_| ViewError::Range(text.to_owned()))
        };
        let (first, last) = (number(first, 0)?, number(last, count.saturating_sub(1))?);
        let step = number(step, 1)?;
        if first > last || step == 0 {
            return Err(ViewError::Range(text.to_owned()));
        }
        return if last < count { Ok((first..=last).step_by(step).collect()) } else { Err(no_view(text)) };
    }
    // A number is an index, unless it has the form of a photograph's name.
    let leading_zero = text.len() > 1 && text.starts_with('0');
    if let (Ok(index), false) = (text.parse::<usize>(), leading_zero) {
        if index < count {
            return Ok(vec![index]);
        }
        if !views.iter().any(|view| view.name.contains(text)) {
            return Err(no_view(text));
        }
    }
    let of_name = |matches: &dyn Fn(&str) -> bool| -> Vec<usize> {
        let named = views.iter().enumerate().filter(|(_, view)| matches(&view.name));
        named.map(|(index, _)| index).collect()
    };
    let file = |name: &str| name.rsplit('/').next().unwrap_or_default().to_owned();
    let stem_of = |name: &str| stem(std::path::Path::new(name));
    let tests: [&dyn Fn(&str) -> bool; 5] = [
        &|name| name == text,
        &|name| file(name) == text,
        &|name| stem_of(name) == text,
        // Camera files of 3DGS name photographs without extension.
        &|name| file(name) == stem_of(text),
        &|name| name.contains(text),
    ];
    let found = tests.into_iter().map(of_name).find(|found| !found.is_empty());
    match found.as_deref() {
        Some([one]) => Ok(vec![*one]),
        found => Err(ViewError::NoName {
            path: path.to_owned(),
            view: text.to_owned(),
            matches: found.map_or(0, <[usize]>::len),
        }),
    }
}

/// The views as keyframes for `--path`.
pub fn keyframes(views: &[View], scene: &Scene) -> Vec<Keyframe> {
    let extent = Extent::of(scene);
    let keyframe = |view: &View| {
        let ahead = distance_ahead(&view.camera, extent.centre);
        let distance = if ahead > 0.0 { ahead } else { extent.radius() };
        Keyframe::of(&view.camera, distance)
    };
    views.iter().map(keyframe).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn named(names: &[&str]) -> Vec<camera_files::View> {
        let camera = Camera::orbit(1, [8, 8]).remove(0);
        let view = |name: &&str| camera_files::View { name: (*name).to_owned(), camera: camera.clone() };
        names.iter().map(view).collect()
    }

    #[test]
    fn views_are_chosen_by_index_range_and_name() {
        let views = named(&["images/a.png", "b/00003.jpg", "DSC8679", "DSC8680", "e"]);
        let choose = |text: &str| choose(text, Path::new("c.json"), &views);
        let chosen = |text: &str| choose(text).expect(text);
        assert_eq!(chosen("3"), [3]);
        assert_eq!(chosen("all"), [0, 1, 2, 3, 4]);
        assert_eq!(chosen("1..3"), [1, 2, 3]);
        assert_eq!(chosen("..2"), [0, 1, 2]);
        assert_eq!(chosen("0..4:2"), [0, 2, 4]);
        assert_eq!(chosen("a"), [0]);
        assert_eq!(chosen("a.png"), [0]);
        assert_eq!(chosen("00003"), [1]);
        assert_eq!(chosen("8680"), [3], "no index");
        assert_eq!(chosen("DSC8679.JPG"), [2]);
        assert_eq!(chosen("images/DSC8680.png"), [3]);
        for (bad, reason) in [
            ("5", "there are 5 views"),
            ("2..9", "there are 5 views"),
            ("3..1", "neither"),
            ("0..3:0", "neither"),
            ("a..b", "neither"),
            ("DSC", "2 views have this"),
            ("nobody", "0 views have this"),
        ] {
            let error = choose(bad).expect_err(bad).to_string();
            assert!(error.contains(reason), "{bad}: {error}");
        }
    }
}
