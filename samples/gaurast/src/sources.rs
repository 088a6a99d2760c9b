//! Scenes by file and by folder.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use gaurast_picture::Background;
use gaurast_scene::{Scene, SceneError};
use thiserror::Error;

use crate::progress::Progress;

/// The generated garden's seed.
const SEED: u64 = 1;

/// Why there is no scene. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum SourceError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{}: {source}", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
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
        "{}: the folder holds COLMAP's cameras and points, which are no Gaussians: --cameras reads the cameras",
        path.display()
    )]
    Colmap { path: PathBuf },
}

/// A scene's file, and what lies beside it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// The file; the generated garden if there is none.
    pub file: Option<PathBuf>,
    /// What outputs are named after.
    pub name: String,
    /// Cameras that belong to it.
    pub cameras: Option<PathBuf>,
    /// nerfstudio's dataparser_transforms.json.
    pub dataparser: Option<PathBuf>,
    /// The background that it was trained with.
    pub background: Option<Background>,
    /// What the folder led to, a sentence each.
    pub notes: Vec<String>,
}

impl Source {
    /// The source at `path`.
    ///
    /// # Errors
    /// If it is a folder without a scene.
    pub fn of(path: Option<&Path>) -> Result<Self, SourceError> {
        let Some(path) = path else {
            return Ok(Self {
                name: "gaurast".to_owned(),
                ..Self::default()
            });
        };
        if path.is_dir() {
            return folder(path);
        }
        Ok(Self {
            name: stem(path),
            file: Some(path.to_owned()),
            dataparser: beside(path, "dataparser_transforms.json"),
            ..Self::default()
        })
    }

    /// Reads the scene, or generates it.
    ///
    /// # Errors
    /// As the file's reader.
    pub fn load(&self, progress: Progress) -> Result<(Scene, Duration), SourceError> {
        let start = Instant::now();
        let scene = match &self.file {
            Some(path) => {
                let bar = progress.bytes("reading", 0);
                let scene = gaurast_scene::open_through(path, |file, len| {
                    bar.set_length(len);
                    bar.wrap_read(file)
                })?;
                bar.finish_and_clear();
                scene
            }
            None => {
                let _step = progress.step("generating");
                gaurast_scene::garden::scene(SEED, gaurast_scene::garden::DEFAULT_COUNT)
            }
        };
        Ok((scene, start.elapsed()))
    }
}

/// A file's name without its folder and its extensions.
pub fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.split('.').next().unwrap_or_default();
    if stem.is_empty() {
        "gaurast".to_owned()
    } else {
        stem.to_owned()
    }
}

fn beside(path: &Path, name: &str) -> Option<PathBuf> {
    Some(gaurast_picture::folder(path).join(name)).filter(|path| path.is_file())
}

fn folder(path: &Path) -> Result<Source, SourceError> {
    let io = |source| SourceError::Io {
        path: path.to_owned(),
        source,
    };
    let whole = path.canonicalize().map_err(io)?;
    let name = whole.file_name().map_or("gaurast".to_owned(), |name| {
        name.to_string_lossy().into_owned()
    });
    let there = |name: &str| Some(path.join(name)).filter(|path| path.is_file());
    let mut source = Source {
        name,
        cameras: there("cameras.json"),
        dataparser: there("dataparser_transforms.json"),
        ..Source::default()
    };
    if let Some((iteration, file)) = newest_iteration(&path.join("point_cloud")) {
        source.notes.push(format!("iteration {iteration} is drawn"));
        source.file = Some(file);
    } else if let Some(file) = there("point_cloud.ply").or_else(|| there("splat.ply")) {
        source.file = Some(file);
    } else {
        source.file = only_scene(path).map_err(io)?;
    }
    if source.file.is_none() {
        return Err(why_none(path));
    }
    if let Some(arguments) = there("cfg_args")
        && let Ok(text) = std::fs::read_to_string(arguments)
        && text.contains("white_background=True")
    {
        source.background = Some(Background::Color([1.0; 3]));
        source
            .notes
            .push("the background is white, as cfg_args says".to_owned());
    }
    Ok(source)
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

/// The scene file in `folder`, if there is exactly one.
fn only_scene(folder: &Path) -> std::io::Result<Option<PathBuf>> {
    let known = gaurast_scene::known_extensions();
    let mut found = Vec::new();
    for entry in folder.read_dir()? {
        let path = entry?.path();
        let extension = path
            .extension()
            .map(|e| format!(".{}", e.to_string_lossy()));
        if path.is_file() && extension.is_some_and(|e| known.split(", ").any(|k| k == e)) {
            found.push(path);
        }
    }
    Ok(if found.len() == 1 { found.pop() } else { None })
}

fn why_none(path: &Path) -> SourceError {
    let path_buf = path.to_owned();
    let holds = |names: &[&str]| names.iter().any(|name| path.join(name).exists());
    if holds(&["nerfstudio_models", "config.yml"]) {
        SourceError::Checkpoint { path: path_buf }
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

    #[test]
    fn inrias_output_is_its_highest_iteration() {
        let folder = tempfile::tempdir().expect("a folder");
        for iteration in [7000, 30_000, 900] {
            touch(
                folder.path(),
                &format!("point_cloud/iteration_{iteration}/point_cloud.ply"),
                "",
            );
        }
        touch(folder.path(), "cameras.json", "[]");
        touch(
            folder.path(),
            "cfg_args",
            "Namespace(sh_degree=3, white_background=True)",
        );
        let source = Source::of(Some(folder.path())).expect("a scene");
        let file = source.file.expect("a file");
        assert!(
            file.ends_with("iteration_30000/point_cloud.ply"),
            "{file:?}"
        );
        assert!(source.cameras.is_some());
        assert_eq!(source.background, Some(Background::Color([1.0; 3])));
        assert_eq!(source.notes.len(), 2);
    }

    #[test]
    fn folders_without_a_scene_say_what_they_hold() {
        let folder = tempfile::tempdir().expect("a folder");
        let refused = || {
            let error = Source::of(Some(folder.path())).expect_err("no scene");
            error.to_string()
        };
        assert!(refused().contains("holds no scene"), "{}", refused());
        touch(folder.path(), "sparse/0/cameras.bin", "");
        assert!(refused().contains("COLMAP"), "{}", refused());
        touch(folder.path(), "nerfstudio_models/step.ckpt", "");
        assert!(refused().contains("ns-export"), "{}", refused());
        touch(folder.path(), "a.ply", "");
        assert!(Source::of(Some(folder.path())).is_ok());
        touch(folder.path(), "b.spz", "");
        assert!(Source::of(Some(folder.path())).is_err());
        touch(folder.path(), "splat.ply", "");
        let source = Source::of(Some(folder.path())).expect("nerfstudio's");
        assert!(source.file.expect("a file").ends_with("splat.ply"));
    }

    #[test]
    fn names_are_those_of_files() {
        assert_eq!(stem(Path::new("a/guitar.compressed.ply")), "guitar");
        assert_eq!(stem(Path::new(".ply")), "gaurast");
    }
}
