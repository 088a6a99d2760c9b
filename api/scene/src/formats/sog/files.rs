//! Access to the files of a SOG scene: entries of a zip archive, or files of a folder.

use std::collections::HashMap;

use flate2::bufread::DeflateDecoder;
use image_webp::WebPDecoder;
use rawzip::{CompressionMethod, ZipArchive, ZipArchiveEntryWayfinder, ZipSliceArchive};

use crate::error::{Fault, Place, Reason};
use crate::formats::input::{MAX_EXPANSION, Origin, is_local, read_growing};
use crate::formats::spz::one_line;

/// The files of a scene.
pub(super) enum Files<'a> {
    /// The entries of a zip archive.
    Archive(Archive<'a>),
    /// The files of this folder, which is below that of the input.
    Folder(Origin<'a>, String),
}

/// A zip archive and the positions of its entries.
pub(super) struct Archive<'a> {
    archive: ZipSliceArchive<&'a [u8]>,
    entries: HashMap<Vec<u8>, Entry>,
}

/// An entry of a zip archive.
#[derive(Clone, Copy)]
struct Entry {
    place: ZipArchiveEntryWayfinder,
    method: CompressionMethod,
    compressed: u64,
    size: u64,
}

/// A decoded image.
pub(super) struct Image {
    channels: usize,
    texels: Vec<u8>,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Image {
    /// Red, green, blue and alpha of pixel `index`, row by row.
    #[inline]
    pub(super) fn texel(&self, index: usize) -> [u8; 4] {
        let texel = &self.texels[self.channels * index..][..self.channels];
        [texel[0], texel[1], texel[2], texel.get(3).copied().unwrap_or(255)]
    }
}

impl<'a> Files<'a> {
    /// The files in the zip archive `bytes`.
    pub(super) fn archive(bytes: &'a [u8]) -> Result<Self, Fault> {
        let damaged = |error: rawzip::Error| Reason::Zip(one_line(&error)).at(Place::File);
        let archive = ZipArchive::from_slice(bytes).map_err(damaged)?;
        let mut entries = HashMap::new();
        let mut listed = archive.entries();
        while let Some(entry) = listed.next_entry().map_err(damaged)? {
            let found = Entry {
                place: entry.wayfinder(),
                method: entry.compression_method(),
                compressed: entry.compressed_size_hint(),
                size: entry.uncompressed_size_hint(),
            };
            entries.insert(entry.file_path().as_ref().to_owned(), found);
        }
        Ok(Self::Archive(Archive { archive, entries }))
    }

    /// The files in `folder`, which is below that of `origin`.
    pub(super) fn folder(origin: Origin<'a>, folder: &str) -> Self {
        Self::Folder(origin, folder.to_owned())
    }

    /// Reads the file `name`.
    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>, Fault> {
        match self {
            Self::Folder(origin, folder) => origin.companion(&join(folder, name)),
            Self::Archive(archive) => archive.read(name).map_err(|reason| reason.at(Place::Entry(name.to_owned()))),
        }
    }

    /// Reads the image `name`, in which each of `expected` entries is a pixel.
    pub(super) fn image(&self, name: &str, expected: u64) -> Result<Image, Fault> {
        let bytes = self.read(name)?;
        image(&bytes, expected).map_err(|reason| reason.at(Place::Entry(name.to_owned())))
    }
}

/// The path of `name` in `folder`.
pub(super) fn join(folder: &str, name: &str) -> String {
    if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") }
}

impl Archive<'_> {
    fn read(&self, name: &str) -> Result<Vec<u8>, Reason> {
        if !is_local(name) {
            return Err(Reason::Name);
        }
        let entry = self.entries.get(name.as_bytes()).ok_or(Reason::Missing)?;
        let damaged = |error: &dyn std::fmt::Display| Reason::Zip(one_line(error));
        let stored = self.archive.get_entry(entry.place).map_err(|e| damaged(&e))?;
        let (claimed, available) = (entry.size, entry.compressed.saturating_mul(MAX_EXPANSION));
        if claimed > available {
            return Err(Reason::TooShort { claimed, available });
        }
        // The reader checks the size and the checksum.
        let bytes = match entry.method {
            CompressionMethod::STORE => read_growing(stored.verifying_reader(stored.data()), claimed + 1, 0),
            CompressionMethod::DEFLATE => {
                let decoder = DeflateDecoder::new(stored.data());
                read_growing(stored.verifying_reader(decoder), claimed + 1, 0)
            }
            _ => {
                let text = "its compression is none of those read (none, deflate)";
                return Err(Reason::Unsupported(text.to_owned()));
            }
        };
        bytes.map_err(|error| match error.kind() {
            std::io::ErrorKind::OutOfMemory => Reason::Memory(claimed),
            _ => damaged(&error),
        })
    }
}

/// The WebP image `bytes`, of at least `expected` pixels and not many more.
fn image(bytes: &[u8], expected: u64) -> Result<Image, Reason> {
    let damaged = |error: image_webp::DecodingError| Reason::Image(one_line(&error));
    let mut decoder = WebPDecoder::new(std::io::Cursor::new(bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    // Writers round sides up. A few bytes may claim an image of a gigabyte.
    if pixels < expected || pixels > 4 * expected + (1 << 20) {
        return Err(Reason::Pixels { width, height, expected });
    }
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let size = decoder.output_buffer_size().unwrap_or(usize::MAX);
    let mut texels = Vec::new();
    texels.try_reserve_exact(size).map_err(|_| Reason::Memory(size as u64))?;
    texels.resize(size, 0);
    decoder.read_image(&mut texels).map_err(damaged)?;
    Ok(Image { channels, texels, width, height })
}
