//! The table of scene formats, the only place that lists them, and reading of scenes.

mod archive;
mod gltf;
mod ground;
mod input;
mod ksplat;
mod ply;
mod sog;
mod splat;
mod spz;
mod usd;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::axes::{AxesReason, FileAxes};
use crate::error::{Fault, Place, Reason, SceneError};
use crate::scene::Scene;
use crate::transform::Motion;
use input::{Format, Input, Origin};
pub use input::{Loaded, Options};

/// Reads the scene file at `path`, or the one in the folder `path`.
///
/// # Errors
/// If the file cannot be opened or read, is of no known kind, or is malformed.
pub fn open(path: impl AsRef<Path>) -> Result<Scene, SceneError> {
    open_with(path.as_ref(), &Options::default(), |file, _| file)
}

/// Reads like [`open`], through the reader that `wrap` makes of the file and its size in bytes; it can show progress,
/// for example.
///
/// # Errors
/// As [`open`].
pub fn open_with<R: Read>(
    path: &Path,
    options: &Options,
    wrap: impl FnOnce(File, u64) -> R,
) -> Result<Scene, SceneError> {
    load_with(path, options, wrap)?.decode()
}

/// Reads like [`open_with`], and leaves a compressed file's integers as they are.
///
/// # Errors
/// As [`open`].
pub fn load_with<R: Read>(
    path: &Path,
    options: &Options,
    wrap: impl FnOnce(File, u64) -> R,
) -> Result<Loaded, SceneError> {
    let path = &inside(path);
    let io = |source| io_error(path, source);
    let file = File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_dir() {
        return Err(io(std::io::ErrorKind::IsADirectory.into()));
    }
    let len = metadata.len();
    let mut reader = BufReader::with_capacity(1 << 20, wrap(file, len));
    load(path, &mut reader, len, options)
}

fn io_error(path: &Path, source: std::io::Error) -> SceneError {
    SceneError::Io { path: path.to_owned(), source }
}

/// The file that holds the scene of the folder `path`; `path` itself if it is not such a folder.
fn inside(path: &Path) -> PathBuf {
    [sog::META, sog::STREAMED_META]
        .map(|name| path.join(name))
        .into_iter()
        .find(|file| path.is_dir() && file.is_file())
        .unwrap_or_else(|| path.to_owned())
}

/// Reads a scene of `len` bytes from `reader`. `path` selects the format, names the file in errors, and gives the
/// folder of other files that the scene refers to.
///
/// # Errors
/// As [`open`].
pub fn read(path: &Path, reader: &mut dyn BufRead, len: u64) -> Result<Scene, SceneError> {
    read_with(path, reader, len, &Options::default())
}

/// Reads like [`read`], with `options`.
///
/// # Errors
/// As [`open`].
pub fn read_with(path: &Path, reader: &mut dyn BufRead, len: u64, options: &Options) -> Result<Scene, SceneError> {
    load(path, reader, len, options)?.decode()
}

/// Reads a scene of `len` bytes from `reader`, as [`read_with`] does, and leaves a compressed file's integers as they are.
fn load(path: &Path, reader: &mut dyn BufRead, len: u64, options: &Options) -> Result<Loaded, SceneError> {
    Input::new(reader, len, Origin { path, options })
        .unpacked(|input| {
            let format = choose(path, input.peek()?)
                .ok_or_else(|| Reason::UnknownFormat(known_to_user(path)).at(Place::File))?;
            log::debug!("reading {} as {}", path.display(), format.name());
            let mut loaded = format.load(input)?;
            if format.has_axes_of_cameras() {
                turn(&mut loaded, options);
            }
            match &mut loaded {
                Loaded::Decoded(scene) => scene.warn_of_dropped(),
                Loaded::Encoded(scene) => path.clone_into(&mut scene.path),
            }
            Ok(loaded)
        })
        .map_err(|fault| fault.of(path))
}

/// Turns a scene into the axes of scenes: from those that the caller or else the file names.
fn turn(loaded: &mut Loaded, options: &Options) {
    let given = options.axes.map(|axes| FileAxes { axes, reason: AxesReason::Given, of_cameras: true });
    let named = given.or(loaded.metadata_mut().axes);
    if let Some(FileAxes { axes, .. }) = named {
        match loaded {
            Loaded::Decoded(scene) => scene.apply(&Motion::new(axes.matrix(), DVec3::ZERO, scene.sh_degree())),
            Loaded::Encoded(scene) => scene.turn = axes.matrix(),
        }
    }
    loaded.metadata_mut().axes = named;
}

/// Every known format, in the order in which they are tried.
static FORMATS: &[&dyn Format] = &[
    &ply::Ply,
    &splat::Splat,
    &spz::Spz,
    &ksplat::KSplat,
    &sog::Sog,
    &sog::SogFolder,
    &gltf::Glb,
    &gltf::Gltf,
    &usd::Usda,
    &usd::Usdc,
    &usd::Usdz,
    &NotRead { name: "LCC", extensions: &["lcc", "lcc2"] },
];

/// A format of which only the name is known.
struct NotRead {
    name: &'static str,
    extensions: &'static [&'static str],
}

impl Format for NotRead {
    fn name(&self) -> &'static str {
        self.name
    }

    fn extensions(&self) -> &'static [&'static str] {
        self.extensions
    }

    fn is_read(&self) -> bool {
        false
    }

    fn load(&self, _: &mut Input<'_>) -> Result<Loaded, Fault> {
        Err(Reason::NotRead(self.name).at(Place::File))
    }
}

/// The format of the file `path` that begins with `start`. It is chosen by extension (without `gz`), then by magic,
/// because a format without magic may begin with any bytes.
fn choose(path: &Path, start: &[u8]) -> Option<&'static dyn Format> {
    let extension = |path: &Path| path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    let extension = match extension(path) {
        Some(gz) if gz == "gz" => path.file_stem().map(Path::new).and_then(extension),
        extension => extension,
    };
    let by_extension = FORMATS
        .iter()
        .find(|format| extension.as_deref().is_some_and(|extension| format.extensions().contains(&extension)));
    let by_magic = || FORMATS.iter().find(|format| format.magic().is_some_and(|magic| start.starts_with(magic)));
    by_extension.or_else(by_magic).copied()
}

/// The extensions of all formats with a reader, for the message that the format of `path` is unknown. Without an
/// extension, as on standard input, some formats can't be recognized.
fn known_to_user(path: &Path) -> String {
    let all = known_extensions();
    if path.extension().is_some() {
        return all;
    }
    let unmarked = extensions_of(|format| format.magic().is_none());
    format!("{all}; of these, {unmarked} are known by the names of their files alone")
}

/// The extensions of all formats with a reader, for messages.
pub fn known_extensions() -> String {
    extensions_of(|_| true)
}

/// The extensions of the formats with a reader that are `chosen`, with commas between them.
fn extensions_of(chosen: impl Fn(&dyn Format) -> bool) -> String {
    FORMATS
        .iter()
        .copied()
        .filter(|format| format.is_read() && chosen(*format))
        .flat_map(|format| format.extensions())
        .map(|extension| format!(".{extension}"))
        .collect::<Vec<_>>()
        .join(", ")
}
