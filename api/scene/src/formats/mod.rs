//! The table of scene formats, the one place that lists them, and reading by it.

mod input;
mod ply;
mod splat;
mod spz;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use crate::error::{Fault, Place, Reason, SceneError};
use crate::scene::Scene;
use input::{Format, Input};

/// Reads the scene file at `path`.
///
/// # Errors
/// If the file cannot be opened or read, is of no known kind, or is malformed.
pub fn open(path: impl AsRef<Path>) -> Result<Scene, SceneError> {
    open_through(path.as_ref(), |file, _| file)
}

/// As [`open`], reading through what `wrap` makes of the file and its size in bytes: a reader that shows progress, say.
///
/// # Errors
/// As [`open`].
pub fn open_through<R: Read>(
    path: &Path,
    wrap: impl FnOnce(File, u64) -> R,
) -> Result<Scene, SceneError> {
    let io = |source| SceneError::Io {
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_dir() {
        return Err(io(std::io::ErrorKind::IsADirectory.into()));
    }
    let len = metadata.len();
    let mut reader = BufReader::with_capacity(1 << 20, wrap(file, len));
    read(path, &mut reader, len)
}

/// Reads a scene of `len` bytes from `reader`; `path` picks the format and names the file in errors.
///
/// # Errors
/// As [`open`].
pub fn read(path: &Path, reader: &mut dyn BufRead, len: u64) -> Result<Scene, SceneError> {
    let start = reader.fill_buf().map_err(|source| SceneError::Io {
        path: path.to_owned(),
        source,
    })?;
    let format = choose(path, start).ok_or_else(|| SceneError::UnknownFormat {
        path: path.to_owned(),
        known: known_extensions(),
    })?;
    log::debug!("reading {} as {}", path.display(), format.name());
    format
        .load(&mut Input::new(reader, len))
        .map_err(|fault| fault.of(path))
}

/// Every format that is known, in the order in which they are tried.
static FORMATS: &[&dyn Format] = &[
    &ply::Ply,
    &splat::Splat,
    &spz::Spz,
    &NotRead {
        name: "SOG",
        extensions: &["sog"],
        magic: Some(b"PK\x03\x04"),
    },
    &NotRead {
        name: "binary glTF",
        extensions: &["glb"],
        magic: Some(b"glTF"),
    },
    &NotRead {
        name: "glTF",
        extensions: &["gltf"],
        magic: None,
    },
];

/// A format that is known by name only.
struct NotRead {
    name: &'static str,
    extensions: &'static [&'static str],
    magic: Option<&'static [u8]>,
}

impl Format for NotRead {
    fn name(&self) -> &'static str {
        self.name
    }

    fn extensions(&self) -> &'static [&'static str] {
        self.extensions
    }

    fn magic(&self) -> Option<&'static [u8]> {
        self.magic
    }

    fn load(&self, _: &mut Input<'_>) -> Result<Scene, Fault> {
        Err(Reason::NotReadYet(self.name).at(Place::File))
    }
}

/// The format of the file `path` that begins with `start`: by extension, then by magic, because
/// a format without magic may begin with any bytes.
fn choose(path: &Path, start: &[u8]) -> Option<&'static dyn Format> {
    let extension = path
        .extension()
        .map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    let by_extension = FORMATS.iter().find(|format| {
        extension
            .as_deref()
            .is_some_and(|extension| format.extensions().contains(&extension))
    });
    let by_magic = || {
        FORMATS
            .iter()
            .find(|format| format.magic().is_some_and(|magic| start.starts_with(magic)))
    };
    by_extension.or_else(by_magic).copied()
}

/// The extensions of all formats that are known, for messages.
pub fn known_extensions() -> String {
    FORMATS
        .iter()
        .flat_map(|format| format.extensions())
        .map(|extension| format!(".{extension}"))
        .collect::<Vec<_>>()
        .join(", ")
}
