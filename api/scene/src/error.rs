//! Errors of scene files, and the places in the file where they occur.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// The reason that a scene could not be read. Displayed as one sentence: file, place, reason.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// Neither the name nor the first bytes identify the format.
    #[error("{}: this is not a scene file of a known kind ({known})", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The extensions that are known, with commas between them.
        known: String,
    },
    /// The format is known, but there is no reader for it.
    #[error(
        "{}: {format} files are not read; PlayCanvas' splat-transform converts them to .ply, which is",
        path.display()
    )]
    NotRead {
        /// The file.
        path: PathBuf,
        /// The format's name.
        format: &'static str,
    },
    /// The content is malformed.
    #[error("{}: {place}: {reason}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The place in the file.
        place: Place,
        /// The problem at that place.
        reason: Reason,
    },
}

/// A place in a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, counted from 1.
    Line(u64),
    /// A byte offset; in a compressed file, of the decompressed data.
    Byte(u64),
    /// The header, or a field of it.
    Header(&'static str),
    /// An entry of an archive, or a file that another one names.
    Entry(String),
    /// A part of a JSON document.
    Part(String),
    /// An element of a PLY file.
    Element(String),
    /// A property of an element of a PLY file.
    Property {
        /// The element's name.
        element: String,
        /// The property's name.
        property: String,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => f.write_str("the file"),
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Header(field) => write!(f, "header, {field}"),
            Self::Entry(name) => write!(f, "entry {name:?}"),
            Self::Part(part) => f.write_str(part),
            Self::Element(element) => write!(f, "element {element}"),
            Self::Property { element, property } => {
                write!(f, "element {element}, property {property}")
            }
        }
    }
}

/// The problem at a [`Place`].
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Reason {
    /// The system failed to read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The first bytes are not the format's.
    #[error("this is not {expected}")]
    Magic {
        /// The name of the expected format.
        expected: &'static str,
    },
    /// A version that is unknown or not read.
    #[error("version {found} is not one of those read ({read})")]
    Version {
        /// The file's version.
        found: u32,
        /// The versions that are read.
        read: &'static str,
    },
    /// The header's text is malformed.
    #[error("{0}")]
    Header(String),
    /// Something required is absent.
    #[error("it is missing")]
    Missing,
    /// An element or a property is declared twice.
    #[error("an element or a property is declared twice")]
    Twice,
    /// A property is a list.
    #[error("it is a list, not a single number")]
    List,
    /// A property has another type than the format demands.
    #[error("its type is {found}, not {expected}")]
    Type {
        /// The type in the file.
        found: String,
        /// The type that the format demands.
        expected: &'static str,
    },
    /// The number of f_rest properties is not three times that of a whole degree.
    #[error("{0} f_rest properties are not those of a whole spherical harmonics degree, 0 to 4")]
    ShCount(usize),
    /// A degree beyond 4.
    #[error("spherical harmonics degree {0} exceeds 4")]
    ShDegree(u32),
    /// A text that is not a number.
    #[error("{0:?} is not a number")]
    Number(String),
    /// Fewer or more values in a line than properties.
    #[error("the line has {found} values, and its element has {expected} properties")]
    Values {
        /// Values in the line.
        found: usize,
        /// Properties of the element.
        expected: usize,
    },
    /// A count that disagrees with another one.
    #[error("it holds {found} entries, and {expected} are needed")]
    Count {
        /// The number of entries found.
        found: u64,
        /// The number of entries expected.
        expected: u64,
    },
    /// The header claims more than the file can hold.
    #[error("{claimed} bytes are claimed, and {available} are there")]
    TooShort {
        /// The least number of bytes that the header's counts require.
        claimed: u64,
        /// The most bytes that the file can hold.
        available: u64,
    },
    /// The data ends early.
    #[error("the data ends here, too early")]
    Truncated,
    /// Data follows the end.
    #[error("there is data after the end of the scene")]
    Trailing,
    /// A file size that is not whole records.
    #[error("{len} bytes are not a whole number of {record}-byte records")]
    Records {
        /// The file's size in bytes.
        len: u64,
        /// A record's size in bytes.
        record: u64,
    },
    /// The compressed stream is damaged.
    #[error("the gzip stream is damaged ({0})")]
    Gzip(io::Error),
    /// A zstd stream is damaged.
    #[error("the zstd stream is damaged ({0})")]
    Zstd(String),
    /// A zip archive is damaged.
    #[error("the zip archive is damaged ({0})")]
    Zip(String),
    /// A WebP image is damaged.
    #[error("the WebP image is damaged ({0})")]
    Image(String),
    /// A JSON document is malformed, or not what the format demands.
    #[error("the JSON is malformed ({0})")]
    Json(String),
    /// A name that is empty, or that leads out of the folder or the archive.
    #[error("this is not the name of a file beside the one that has it")]
    Name,
    /// A file that another one names cannot be read.
    #[error("it cannot be read ({0})")]
    Companion(io::Error),
    /// An image of too few or far too many pixels.
    #[error("{width}x{height} pixels are not what {expected} entries need")]
    Pixels {
        /// The image's width.
        width: u32,
        /// The image's height.
        height: u32,
        /// Entries that it should hold.
        expected: u64,
    },
    /// A feature of the format that this reader does not support, or an unknown one. The text is a whole clause.
    #[error("{0}")]
    Unsupported(String),
    /// There is not enough memory.
    #[error("{0} bytes of memory cannot be had")]
    Memory(u64),
    /// A field holds a value outside its range.
    #[error("{found} is outside {range}")]
    Range {
        /// The value.
        found: u32,
        /// The range.
        range: &'static str,
    },
    /// The file holds points without scales, and the caller did not ask for drawing them.
    #[error(
        "it holds points without scales, which are no Gaussians: --points SIZE draws them as points of that diameter"
    )]
    PointCloud,
    /// There is no Gaussian.
    #[error("it holds no Gaussians")]
    Empty,
    /// The format is unknown; becomes [`SceneError::UnknownFormat`].
    #[error("this is not a scene file of a known kind ({0})")]
    UnknownFormat(String),
    /// The format has no reader; becomes [`SceneError::NotRead`].
    #[error("{0} files are not read")]
    NotRead(&'static str),
}

impl Reason {
    /// This reason, at `place`.
    pub(crate) fn at(self, place: Place) -> Fault {
        Fault { place, reason: self }
    }
}

/// A [`SceneError`] before the file's name is known.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) place: Place,
    pub(crate) reason: Reason,
}

impl Fault {
    /// This fault, of the file `path`.
    pub(crate) fn of(self, path: &Path) -> SceneError {
        let path = path.to_owned();
        match self.reason {
            Reason::UnknownFormat(known) => SceneError::UnknownFormat { path, known },
            Reason::NotRead(format) => SceneError::NotRead { path, format },
            Reason::Io(source) => SceneError::Io { path, source },
            reason => SceneError::Malformed { path, place: self.place, reason },
        }
    }
}
