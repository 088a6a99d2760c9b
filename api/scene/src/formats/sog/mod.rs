//! PlayCanvas's SOG, versions 1 and 2: a JSON document and WebP images, in which a pixel is a Gaussian.
//!
//! The document, `meta.json`, is with its images in a zip archive (`.sog`) or in a folder. A streamed scene has a
//! document `lod-meta.json` that names several such documents, of different levels of detail. The frame is that of PLY
//! files.

mod attributes;
mod document;
mod files;
mod streamed;

use serde::Deserialize;

use super::input::{Format, Input, Loaded};
use crate::error::{Fault, Place};
use document::parse;
pub(super) use document::{META, STREAMED_META};
use files::Files;

/// The largest document that is read, in bytes.
const MAX_META: u64 = 1 << 28;

/// The format as a zip archive.
pub(super) struct Sog;

impl Format for Sog {
    fn name(&self) -> &'static str {
        "SOG"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["sog", "zip"]
    }

    fn magic(&self) -> Option<&'static [u8]> {
        Some(b"PK\x03\x04")
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
        let archive = input.rest()?;
        let files = Files::archive(&archive)?;
        let meta = files.read(META)?;
        Ok(attributes::load(&meta, &files)?.into())
    }
}

/// The format as a document in a folder with its images, or a streamed scene's document.
pub(super) struct SogFolder;

impl Format for SogFolder {
    fn name(&self) -> &'static str {
        "SOG (a folder)"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["json"]
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
        let meta = input.up_to(MAX_META)?;
        /// The field that distinguishes the two documents.
        #[derive(Deserialize)]
        struct Kind {
            tree: Option<serde::de::IgnoredAny>,
        }
        let kind: Kind = parse(&meta, Place::File)?;
        if kind.tree.is_some() {
            Ok(streamed::load(&meta, input.origin())?.into())
        } else {
            Ok(attributes::load(&meta, &Files::folder(input.origin(), ""))?.into())
        }
    }
}
