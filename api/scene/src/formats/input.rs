//! The trait of a scene format, and its input.

use std::io::{self, BufRead, BufReader, ErrorKind, Read};
use std::path::{Component, Path};

use flate2::bufread::GzDecoder;

use crate::axes::Axes;
use crate::encoded::EncodedScene;
use crate::error::{Fault, Place, Reason, SceneError};
use crate::metadata::Metadata;
use crate::scene::Scene;

/// Deflate's highest ratio of expansion. A header that claims more is malformed.
pub(super) const MAX_EXPANSION: u64 = 1032;

/// The first bytes of a gzip stream.
pub(super) const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// The options of a reader.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// The level of detail of a scene that has several (streamed SOG): 0 is the finest.
    pub level: u32,
    /// The axes of the file, instead of those that it names and those of its format.
    pub axes: Option<Axes>,
    /// The diameter, in the scene's units, with which points without scales are drawn. None refuses them.
    pub points: Option<f64>,
}

/// A format of scene files.
pub(super) trait Format: Sync {
    /// The name, as messages show it.
    fn name(&self) -> &'static str;

    /// Extensions of file names, lower case, without the first dot.
    fn extensions(&self) -> &'static [&'static str];

    /// The first bytes that only this format has, if there are any.
    fn magic(&self) -> Option<&'static [u8]> {
        None
    }

    /// Returns true if there is a reader of this format.
    fn is_read(&self) -> bool {
        true
    }

    /// Returns true if the file's coordinates are those of its cameras. False if the format has axes of its own, into which
    /// writers convert scenes; its reader converts them back.
    fn has_axes_of_cameras(&self) -> bool {
        true
    }

    /// Reads a whole scene. A format with the axes of its cameras leaves them as they are.
    ///
    /// # Errors
    /// Returns an error if the input is malformed. A reader allocates nothing that is larger than the input can hold.
    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault>;
}

/// A scene as its file was read.
#[derive(Clone, Debug)]
pub enum Loaded {
    /// As Gaussians.
    Decoded(Scene),
    /// As integers, of a format that has them.
    Encoded(Box<EncodedScene>),
}

impl Loaded {
    /// The scene as Gaussians.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn decode(self) -> Result<Scene, SceneError> {
        match self {
            Self::Decoded(scene) => Ok(scene),
            Self::Encoded(scene) => scene.decode(),
        }
    }

    /// The scene's metadata, for changes.
    pub(super) fn metadata_mut(&mut self) -> &mut Metadata {
        match self {
            Self::Decoded(scene) => scene.metadata_mut(),
            Self::Encoded(scene) => &mut scene.metadata,
        }
    }
}

impl From<Scene> for Loaded {
    fn from(scene: Scene) -> Self {
        Self::Decoded(scene)
    }
}

impl From<EncodedScene> for Loaded {
    fn from(scene: EncodedScene) -> Self {
        Self::Encoded(Box::new(scene))
    }
}

/// The input of a [`Format`]: bytes in order, their number, and the number of those that have been read.
pub(super) struct Input<'a> {
    reader: &'a mut dyn BufRead,
    len: u64,
    position: u64,
    /// True if the bytes come out of a gzip stream; then `len` is an upper bound.
    gzip: bool,
    origin: Origin<'a>,
}

/// The origin of an input: its file, and the caller's options.
#[derive(Clone, Copy)]
pub(super) struct Origin<'a> {
    /// The file.
    pub(super) path: &'a Path,
    /// The caller's options.
    pub(super) options: &'a Options,
}

impl Origin<'_> {
    /// Reads the file `name` in the folder of the input.
    pub(super) fn companion(&self, name: &str) -> Result<Vec<u8>, Fault> {
        let at = |reason: Reason| reason.at(Place::Entry(name.to_owned()));
        if !is_local(name) {
            return Err(at(Reason::Name));
        }
        let path = self.path.parent().unwrap_or(Path::new("")).join(name);
        let read = || {
            let file = std::fs::File::open(&path)?;
            let metadata = file.metadata()?;
            if metadata.is_dir() {
                return Err(ErrorKind::IsADirectory.into());
            }
            read_growing(file, metadata.len(), metadata.len())
        };
        read().map_err(|error| at(Reason::Companion(error)))
    }
}

impl<'a> Input<'a> {
    /// An input of `len` bytes.
    pub(super) fn new(reader: &'a mut dyn BufRead, len: u64, origin: Origin<'a>) -> Self {
        Self { reader, len, position: 0, gzip: false, origin }
    }

    /// The origin of the input.
    pub(super) fn origin(&self) -> Origin<'a> {
        self.origin
    }

    /// The size in bytes; for the contents of a gzip stream, an upper bound.
    pub(super) fn size(&self) -> u64 {
        self.len
    }

    /// True if the bytes come out of a gzip stream.
    pub(super) fn is_compressed(&self) -> bool {
        self.gzip
    }

    /// The most bytes that have not been read.
    pub(super) fn remaining(&self) -> u64 {
        self.len.saturating_sub(self.position)
    }

    /// Reads bytes to fill `buffer`.
    pub(super) fn fill(&mut self, buffer: &mut [u8]) -> Result<(), Fault> {
        let position = self.position;
        let gzip = self.gzip;
        self.read_exact(buffer).map_err(|error| read_fault(error, position, gzip))
    }

    /// Reads `len` bytes, which are allocated as they are read.
    pub(super) fn bytes(&mut self, len: u64) -> Result<Vec<u8>, Fault> {
        let bytes = self.up_to(len)?;
        if (bytes.len() as u64) < len {
            return Err(Reason::Truncated.at(Place::Byte(self.position)));
        }
        Ok(bytes)
    }

    /// Reads all remaining bytes.
    pub(super) fn rest(&mut self) -> Result<Vec<u8>, Fault> {
        self.up_to(self.remaining())
    }

    /// Reads at most `len` bytes, which are allocated as they are read.
    pub(super) fn up_to(&mut self, len: u64) -> Result<Vec<u8>, Fault> {
        let (position, gzip) = (self.position, self.gzip);
        let known = if gzip { 0 } else { len.min(self.remaining()) };
        read_growing(self, len, known).map_err(|error| match error.kind() {
            ErrorKind::OutOfMemory => Reason::Memory(len).at(Place::File),
            _ => read_fault(error, position, gzip),
        })
    }

    /// Appends the next line to `line`, including its end; at most `limit` bytes.
    pub(super) fn line(&mut self, line: &mut Vec<u8>, limit: u64) -> Result<(), Fault> {
        let (position, gzip) = (self.position, self.gzip);
        self.take(limit).read_until(b'\n', line).map_err(|error| read_fault(error, position, gzip))?;
        Ok(())
    }

    /// The next bytes of the input, which are not consumed.
    pub(super) fn peek(&mut self) -> Result<&[u8], Fault> {
        let (position, gzip) = (self.position, self.gzip);
        self.reader.fill_buf().map_err(|error| read_fault(error, position, gzip))
    }

    /// Calls `load` with this input or, if it is a gzip stream, with its contents. Nothing may follow the stream.
    pub(super) fn unpacked<T>(&mut self, load: impl FnOnce(&mut Input<'_>) -> Result<T, Fault>) -> Result<T, Fault> {
        if self.gzip || !self.peek()?.starts_with(&GZIP_MAGIC) {
            return load(self);
        }
        let origin = self.origin;
        let len = self.len.saturating_mul(MAX_EXPANSION);
        let mut decoder = BufReader::new(GzDecoder::new(&mut *self));
        let mut inner = Input::new(&mut decoder, len, origin);
        inner.gzip = true;
        let loaded = load(&mut inner)?;
        // Reads the stream to its end, which has its checksum.
        let at = inner.position;
        let mut rest = inner.take(1 << 20);
        io::copy(&mut rest, &mut io::sink()).map_err(|error| read_fault(error, at, true))?;
        if rest.limit() == 0 {
            return Err(Reason::Trailing.at(Place::Byte(at)));
        }
        if self.remaining() > 0 {
            return Err(Reason::Trailing.at(Place::File));
        }
        Ok(loaded)
    }
}

/// True if `name` is the name of a file in a folder or below it, on any system.
pub(super) fn is_local(name: &str) -> bool {
    const DEVICES: [&str; 4] = ["con", "prn", "aux", "nul"];
    let device = |part: &str| {
        let stem = part.split('.').next().unwrap_or(part).trim_end();
        let stem = stem.to_ascii_lowercase();
        let port = stem
            .strip_prefix("com")
            .or_else(|| stem.strip_prefix("lpt"))
            .is_some_and(|digit| digit.len() == 1 && digit != "0");
        port || DEVICES.contains(&stem.as_str())
    };
    !name.is_empty()
        && !name.contains(['\\', ':', '\0'])
        && Path::new(name).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        && !name.split('/').any(device)
}

/// Reads at most `len` bytes. Memory for `known` of them is reserved at once, for the others as they are read, so that
/// a claimed size costs nothing.
pub(super) fn read_growing(reader: impl Read, len: u64, known: u64) -> io::Result<Vec<u8>> {
    const STEP: usize = 1 << 20;
    let no_memory = |_| io::Error::from(ErrorKind::OutOfMemory);
    let mut reader = reader.take(len);
    let mut bytes = Vec::new();
    let known = usize::try_from(known.min(len)).unwrap_or(usize::MAX);
    bytes.try_reserve_exact(known).map_err(no_memory)?;
    loop {
        let wanted = usize::try_from(reader.limit()).unwrap_or(usize::MAX);
        let step = wanted.min(STEP.max(bytes.len()).max(known - bytes.len().min(known)));
        if step == 0 {
            return Ok(bytes);
        }
        if bytes.capacity() - bytes.len() < step {
            bytes.try_reserve_exact(step).map_err(no_memory)?;
        }
        // `read_to_end` grows only beyond the capacity.
        if (&mut reader).take(step as u64).read_to_end(&mut bytes)? < step {
            return Ok(bytes);
        }
    }
}

/// The fault of an `error` in reading at byte `position`, in a gzip stream or not.
fn read_fault(error: io::Error, position: u64, gzip: bool) -> Fault {
    match error.kind() {
        ErrorKind::UnexpectedEof => Reason::Truncated.at(Place::Byte(position)),
        ErrorKind::InvalidInput | ErrorKind::InvalidData if gzip => Reason::Gzip(error).at(Place::Byte(position)),
        _ => Reason::Io(error).at(Place::Byte(position)),
    }
}

impl Read for Input<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.reader.read(buffer)?;
        self.position += read as u64;
        Ok(read)
    }
}

impl BufRead for Input<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.reader.consume(amount);
        self.position += amount as u64;
    }
}
