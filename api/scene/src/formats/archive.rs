//! Zip archives, as scene formats use them: entries that are stored or deflated.

use std::collections::HashMap;

use flate2::bufread::DeflateDecoder;
use rawzip::{CompressionMethod, ZipArchive, ZipArchiveEntryWayfinder, ZipSliceArchive};

use super::input::{MAX_EXPANSION, is_local, read_growing};
use super::spz::one_line;
use crate::error::{Fault, Place, Reason};

/// A zip archive and the positions of its entries.
pub(super) struct Archive<'a> {
    archive: ZipSliceArchive<&'a [u8]>,
    entries: HashMap<Vec<u8>, Entry>,
    first: Vec<u8>,
}

/// An entry of a zip archive.
#[derive(Clone, Copy)]
struct Entry {
    place: ZipArchiveEntryWayfinder,
    method: CompressionMethod,
    compressed: u64,
    size: u64,
}

impl<'a> Archive<'a> {
    /// The zip archive `bytes`.
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self, Fault> {
        let damaged = |error: rawzip::Error| Reason::Zip(one_line(&error)).at(Place::File);
        let archive = ZipArchive::from_slice(bytes).map_err(damaged)?;
        let mut entries = HashMap::new();
        let mut first = Vec::new();
        let mut listed = archive.entries();
        while let Some(entry) = listed.next_entry().map_err(damaged)? {
            let found = Entry {
                place: entry.wayfinder(),
                method: entry.compression_method(),
                compressed: entry.compressed_size_hint(),
                size: entry.uncompressed_size_hint(),
            };
            let name = entry.file_path().as_ref().to_owned();
            if entries.is_empty() {
                first.clone_from(&name);
            }
            entries.insert(name, found);
        }
        Ok(Self { archive, entries, first })
    }

    /// The name of the first entry; empty if there is none.
    pub(super) fn first(&self) -> String {
        String::from_utf8_lossy(&self.first).into_owned()
    }

    /// Reads the entry `name`.
    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>, Fault> {
        self.content(name).map_err(|reason| reason.at(Place::Entry(name.to_owned())))
    }

    fn content(&self, name: &str) -> Result<Vec<u8>, Reason> {
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
