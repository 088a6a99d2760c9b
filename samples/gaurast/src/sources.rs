//! The scene's files and folders.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use gaurast_picture::Background;
use gaurast_scene::{AxesReason, FileAxes, Loaded, Options, Scene, SceneError, Transform};
use thiserror::Error;

use crate::args::{Choice, SceneArguments};
use crate::cfg_args::CfgArgs;
use crate::progress::Progress;
use crate::training_size::TrainingSize;

/// The generated garden's seed.
const SEED: u64 = 1;

/// The path that stands for standard input.
const STANDARD_INPUT: &str = "-";

/// The name of outputs if the scene has none.
const DEFAULT_NAME: &str = "gaurast";

/// The most scenes of a folder that a message names.
const NAMED: usize = 4;

/// A failure to read the scene. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum SourceError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{}: the folder holds several scenes, of which one must be named: {names}", path.display())]
    Several { path: PathBuf, names: String },
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    #[error(
        "{}: the folder holds no scene: neither 3DGS's point_cloud/iteration_N/point_cloud.ply, nor nerfstudio's \
         splat.ply, nor one scene file alone",
        path.display()
    )]
    NoScene { path: PathBuf },
    #[error(
        "{}: the folder holds a training checkpoint of nerfstudio: `ns-export gaussian-splat` makes a splat.ply of it",
        path.display()
    )]
    Checkpoint { path: PathBuf },
    #[error(
        "{}: a training checkpoint of gsplat, which is a program for Python: simple_trainer.py writes a .ply with --save-ply",
        path.display()
    )]
    GsplatCheckpoint { path: PathBuf },
    #[error(
        "{}: the folder holds COLMAP's cameras and points, which are no Gaussians: --cameras reads the cameras",
        path.display()
    )]
    Colmap { path: PathBuf },
    #[error("{option} is given {values} times, and there are {scenes} scenes")]
    Values { option: &'static str, scenes: usize, values: usize },
    #[error("{0} (--strict)")]
    Strict(String),
}

/// The scene's files, and the files that belong to them.
#[derive(Debug, Default)]
pub struct Source {
    /// The files; the generated garden if there is none.
    pub files: Vec<SourceFile>,
    /// The base name of outputs.
    pub name: String,
    /// Cameras that belong to it.
    pub cameras: Option<PathBuf>,
    /// The sizes in which the photographs of these cameras were trained.
    pub training_size: Option<TrainingSize>,
    /// nerfstudio's dataparser_transforms.json.
    pub dataparser: Option<PathBuf>,
    /// The background with which it was trained.
    pub background: Option<Background>,
    /// Notes about the contents of folders, a sentence each.
    pub notes: Vec<String>,
}

/// A file of the scene.
#[derive(Clone, Debug)]
pub struct SourceFile {
    pub path: PathBuf,
    /// Its place among the others.
    transform: Transform,
    /// The options of reading it.
    options: Options,
}

impl Source {
    /// The source that the command line names. Files next to the first scene belong to it.
    ///
    /// # Errors
    /// If it is a folder without a scene, or there are more transforms than scenes.
    pub fn of(arguments: &SceneArguments) -> Result<Self, SourceError> {
        let (scenes, transforms) = (&arguments.scenes, &arguments.transform);
        for (option, values) in [("--transform", transforms.len()), ("--axes", arguments.axes.len())] {
            if values > scenes.len() {
                return Err(SourceError::Values { option, scenes: scenes.len(), values });
            }
        }
        let mut source = Self { name: DEFAULT_NAME.to_owned(), ..Self::default() };
        let given = transforms.iter().map(|placement| placement.0);
        let given = given.chain(std::iter::repeat(Transform::default()));
        for (index, (path, transform)) in scenes.iter().zip(given).enumerate() {
            let Part { name, file, cameras, training_size, dataparser, background, notes } = part(path)?;
            if source.files.is_empty() {
                (source.name, source.cameras, source.training_size) = (name, cameras, training_size);
                (source.dataparser, source.background) = (dataparser, background);
            }
            let axes = match arguments.axes.get(index).or(arguments.axes.last()) {
                Some(Choice::Given(axes)) => Some(*axes),
                Some(Choice::Auto) | None => None,
            };
            let options = Options { level: arguments.level, axes, points: arguments.points };
            source.files.push(SourceFile { path: file, transform, options });
            source.notes.extend(notes);
        }
        Ok(source)
    }

    /// Returns true if the scene is the generated garden.
    pub fn is_garden(&self) -> bool {
        self.files.is_empty()
    }

    /// Reads the scene. A compressed file that is all of it is not decoded.
    ///
    /// # Errors
    /// The errors of the file's reader.
    pub fn load_as_it_lies(&self, progress: Progress) -> Result<(Loaded, Duration), SourceError> {
        match &self.files[..] {
            [file] if file.transform == Transform::default() && file.path != Path::new(STANDARD_INPUT) => {
                let start = Instant::now();
                Ok((file.read(progress)?, start.elapsed()))
            }
            _ => self.load(progress).map(|(scene, time)| (scene.into(), time)),
        }
    }

    /// Reads the scene, or generates it.
    ///
    /// # Errors
    /// The errors of the file's reader.
    pub fn load(&self, progress: Progress) -> Result<(Scene, Duration), SourceError> {
        let start = Instant::now();
        if self.is_garden() {
            let _step = progress.step("generating");
            let garden = gaurast_scene::garden::scene(SEED, gaurast_scene::garden::DEFAULT_COUNT);
            return Ok((garden, start.elapsed()));
        }
        let mut scene = Scene::default();
        for file in &self.files {
            let SourceFile { path, transform, options } = file;
            let part = if path == Path::new(STANDARD_INPUT) {
                read_standard_input(options)?
            } else {
                file.read(progress)?.decode()?
            };
            let first = scene.is_empty() && scene.mesh().is_empty();
            if first && *transform == Transform::default() {
                scene = part;
            } else {
                scene.append(&part, transform);
            }
        }
        Ok((scene, start.elapsed()))
    }
}

impl SourceFile {
    /// Reads the file. A compressed one is not decoded.
    fn read(&self, progress: Progress) -> Result<Loaded, SceneError> {
        let bar = progress.bytes("reading", 0);
        let loaded = gaurast_scene::load_with(&self.path, &self.options, |file, len| {
            bar.set_length(len);
            bar.wrap_read(file)
        })?;
        bar.finish_and_clear();
        Ok(loaded)
    }
}

/// Reads the scene on standard input, which is read whole before its format is chosen.
fn read_standard_input(options: &Options) -> Result<Scene, SceneError> {
    let path = Path::new("standard input");
    let mut bytes = Vec::new();
    let read = std::io::stdin().lock().read_to_end(&mut bytes);
    read.map_err(|source| SceneError::Io { path: path.to_owned(), source })?;
    gaurast_scene::read_with(path, &mut &bytes[..], bytes.len() as u64, options)
}

/// Checks that no scene's file holds what the picture may lack.
///
/// # Errors
/// The first warning of a file.
pub fn check_strictly(scene: &Scene) -> Result<(), SourceError> {
    match scene.metadata().warnings.first() {
        Some(warning) => Err(SourceError::Strict(warning.clone())),
        None => Ok(()),
    }
}

/// The axes that are taken, and why.
pub fn axes_and_reason(file_axes: &FileAxes) -> String {
    let reason = match file_axes.reason {
        AxesReason::Given => "as --axes says",
        AxesReason::File => "as the file says",
        AxesReason::Ground => "with which the ground is below",
        AxesReason::Format => "the format's, since the file names none",
    };
    format!("{}, {reason}", file_axes.axes)
}

/// One scene of several.
#[derive(Debug, Default)]
struct Part {
    file: PathBuf,
    name: String,
    cameras: Option<PathBuf>,
    training_size: Option<TrainingSize>,
    dataparser: Option<PathBuf>,
    background: Option<Background>,
    notes: Vec<String>,
}

fn part(path: &Path) -> Result<Part, SourceError> {
    if path.is_dir() {
        return folder(path);
    }
    if path.extension().is_some_and(|extension| extension == "pt") {
        return Err(SourceError::GsplatCheckpoint { path: path.to_owned() });
    }
    // Standard input has no name.
    let name = if path == Path::new(STANDARD_INPUT) { DEFAULT_NAME.to_owned() } else { stem(path) };
    Ok(Part { name, file: path.to_owned(), dataparser: beside(path, "dataparser_transforms.json"), ..Part::default() })
}

/// A file's name without its folder and its extensions.
pub fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.split('.').next().unwrap_or_default();
    if stem.is_empty() { DEFAULT_NAME.to_owned() } else { stem.to_owned() }
}

fn beside(path: &Path, name: &str) -> Option<PathBuf> {
    Some(gaurast_picture::folder(path).join(name)).filter(|path| path.is_file())
}

fn folder(path: &Path) -> Result<Part, SourceError> {
    let io = |source| SourceError::Io { path: path.to_owned(), source };
    let whole = path.canonicalize().map_err(io)?;
    let name = whole.file_name().map_or(DEFAULT_NAME.to_owned(), |name| name.to_string_lossy().into_owned());
    let there = |name: &str| Some(path.join(name)).filter(|path| path.is_file());
    let mut part = Part {
        name,
        cameras: there("cameras.json"),
        dataparser: there("dataparser_transforms.json"),
        ..Part::default()
    };
    part.file = if let Some((iteration, file)) = newest_iteration(&path.join("point_cloud")) {
        part.notes.push(format!("iteration {iteration} is drawn"));
        file
    } else if let Some((step, file)) = newest_step(&path.join("ply")) {
        part.notes.push(format!("step {step} is drawn"));
        file
    } else if let Some(file) = there("point_cloud.ply").or_else(|| there("splat.ply")) {
        file
    } else if there("meta.json").or_else(|| there("lod-meta.json")).is_some() {
        // A SOG scene of several files.
        path.to_owned()
    } else {
        only_scene(path)?
    };
    if let Some(arguments) = there("cfg_args")
        && let Ok(text) = std::fs::read_to_string(arguments)
    {
        let arguments = CfgArgs::parse(&text);
        if arguments.flag("white_background") == Some(true) {
            part.background = Some(Background::Color([1.0; 3]));
            part.notes.push("the background is white, as cfg_args says".to_owned());
        }
        part.training_size = Some(TrainingSize::new(&arguments, path));
    }
    Ok(part)
}

/// The scene of the highest iteration in a folder `point_cloud`.
fn newest_iteration(folder: &Path) -> Option<(u64, PathBuf)> {
    let entries = folder.read_dir().ok()?.flatten();
    entries
        .filter_map(|entry| {
            let name = entry.file_name();
            let iteration = name.to_str()?.strip_prefix("iteration_")?.parse().ok()?;
            let file = entry.path().join("point_cloud.ply");
            file.is_file().then_some((iteration, file))
        })
        .max_by_key(|(iteration, _)| *iteration)
}

/// The scene of the highest step in gsplat's folder `ply`.
fn newest_step(folder: &Path) -> Option<(u64, PathBuf)> {
    let entries = folder.read_dir().ok()?.flatten();
    entries
        .filter_map(|entry| {
            let name = entry.file_name();
            let step = name.to_str()?.strip_prefix("point_cloud_")?.strip_suffix(".ply")?.parse().ok()?;
            Some((step, entry.path()))
        })
        .max_by_key(|(step, _)| *step)
}

/// The scene files in `folder`, by name.
fn scenes(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let known = gaurast_scene::known_extensions();
    let mut found = Vec::new();
    for entry in folder.read_dir()? {
        let path = entry?.path();
        let extension = path.extension().map(|e| format!(".{}", e.to_string_lossy()));
        // A .json file may be of any kind.
        let is_scene = |e: String| e != ".json" && known.split(", ").any(|k| k == e);
        if path.is_file() && extension.is_some_and(is_scene) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The only scene file in `folder`.
fn only_scene(folder: &Path) -> Result<PathBuf, SourceError> {
    let path = || folder.to_owned();
    let mut found = scenes(folder).map_err(|source| SourceError::Io { path: path(), source })?;
    if found.len() < 2 {
        return found.pop().ok_or_else(|| why_none(folder));
    }
    let name = |file: &PathBuf| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut names: Vec<String> = found.iter().take(NAMED).map(name).collect();
    if found.len() > NAMED {
        names.push(format!("and {} more", found.len() - NAMED));
    }
    Err(SourceError::Several { path: path(), names: names.join(", ") })
}

fn why_none(path: &Path) -> SourceError {
    let path_buf = path.to_owned();
    let holds = |names: &[&str]| names.iter().any(|name| path.join(name).exists());
    if holds(&["nerfstudio_models", "config.yml"]) {
        SourceError::Checkpoint { path: path_buf }
    } else if holds(&["ckpts"]) {
        SourceError::GsplatCheckpoint { path: path_buf.join("ckpts") }
    } else if holds(&["sparse", "cameras.bin", "cameras.txt"]) {
        SourceError::Colmap { path: path_buf }
    } else {
        SourceError::NoScene { path: path_buf }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touch(folder: &Path, name: &str, text: &str) {
        let path = folder.join(name);
        std::fs::create_dir_all(gaurast_picture::folder(&path)).expect("folders");
        std::fs::write(path, text).expect("written");
    }

    fn of(folder: &Path) -> Result<Source, SourceError> {
        Source::of(&SceneArguments { scenes: vec![folder.to_owned()], ..SceneArguments::default() })
    }

    #[test]
    fn inrias_output_is_its_highest_iteration() {
        let folder = tempfile::tempdir().expect("a folder");
        for iteration in [7000, 30_000, 900] {
            touch(folder.path(), &format!("point_cloud/iteration_{iteration}/point_cloud.ply"), "");
        }
        touch(folder.path(), "cameras.json", "[]");
        touch(folder.path(), "cfg_args", "Namespace(sh_degree=3, white_background=True)");
        let source = of(folder.path()).expect("a scene");
        let file = &source.files[0].path;
        assert!(file.ends_with("iteration_30000/point_cloud.ply"), "{file:?}");
        assert!(source.cameras.is_some());
        assert_eq!(source.background, Some(Background::Color([1.0; 3])));
        assert_eq!(source.notes.len(), 2);
    }

    #[test]
    fn folders_without_a_scene_say_what_they_hold() {
        let folder = tempfile::tempdir().expect("a folder");
        let refused = || {
            let error = of(folder.path()).expect_err("no scene");
            error.to_string()
        };
        assert!(refused().contains("holds no scene"), "{}", refused());
        touch(folder.path(), "sparse/0/cameras.bin", "");
        assert!(refused().contains("COLMAP"), "{}", refused());
        touch(folder.path(), "nerfstudio_models/step.ckpt", "");
        assert!(refused().contains("ns-export"), "{}", refused());
        touch(folder.path(), "a.ply", "");
        assert!(of(folder.path()).is_ok());
        touch(folder.path(), "b.spz", "");
        assert!(refused().contains("one must be named: a.ply, b.spz"), "{}", refused());
        touch(folder.path(), "splat.ply", "");
        let source = of(folder.path()).expect("nerfstudio's");
        assert!(source.files[0].path.ends_with("splat.ply"));
    }

    #[test]
    fn names_are_those_of_files() {
        assert_eq!(stem(Path::new("a/guitar.compressed.ply")), "guitar");
        assert_eq!(stem(Path::new(".ply")), "gaurast");
    }
}
