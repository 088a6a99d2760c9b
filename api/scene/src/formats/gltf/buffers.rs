//! A document's buffers: in a binary file, in the document itself, or in separate files.

use std::borrow::Cow;

use base64::Engine;

use super::document::Document;
use crate::error::{Fault, Place, Reason};
use crate::formats::input::Origin;

/// A document's buffers, read when they are needed.
pub(super) struct Buffers<'a> {
    pub(super) document: &'a Document,
    /// The first buffer, if a binary file has it.
    binary: Option<&'a [u8]>,
    /// The buffers that have been read so far.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    pub(super) origin: Origin<'a>,
}

impl<'a> Buffers<'a> {
    /// The buffers of `document`, whose first one may be a binary file's chunk `binary`.
    pub(super) fn new(document: &'a Document, binary: Option<&'a [u8]>, origin: Origin<'a>) -> Self {
        Self { document, binary, buffers: document.buffers.iter().map(|_| None).collect(), origin }
    }

    /// The bytes of buffer view `index`, and the distance between its elements. Messages name it `place`.
    pub(super) fn view(&mut self, index: usize, place: &str) -> Result<(&[u8], Option<usize>), Fault> {
        let at = |reason: Reason, field: &str| reason.at(Place::Part(format!("{place}, {field}")));
        let document = self.document;
        let view = document.buffer_views.get(index).ok_or_else(|| at(Reason::Missing, "bufferView"))?;
        // A file that doesn't require the extension has the data uncompressed, too, in a buffer for other readers.
        let compressed = view.extensions.keys().find(|n| n.contains("compression"));
        if let Some(extension) = compressed.filter(|_| !self.has_data(view.buffer)) {
            let text = format!("its data is compressed by {extension:?}, which is not read");
            return Err(at(Reason::Unsupported(text), "bufferView"));
        }
        let buffer = self.buffer(view.buffer)?;
        let bytes = view.byte_offset.checked_add(view.byte_length).and_then(|end| buffer.get(view.byte_offset..end));
        let bytes = bytes.ok_or_else(|| {
            let claimed = (view.byte_offset as u64).saturating_add(view.byte_length as u64);
            let available = buffer.len() as u64;
            at(Reason::TooShort { claimed, available }, "bufferView")
        })?;
        Ok((bytes, view.byte_stride))
    }

    /// False if buffer `index` is a placeholder without bytes.
    fn has_data(&self, index: usize) -> bool {
        let buffer = self.document.buffers.get(index);
        buffer.is_none_or(|buffer| buffer.uri.is_some() || index == 0 && self.binary.is_some())
    }

    /// The bytes of all buffers that can be read.
    pub(super) fn total_bytes(&mut self) -> u64 {
        (0..self.document.buffers.len()).map(|index| self.buffer(index).map_or(0, |bytes| bytes.len() as u64)).sum()
    }

    /// The bytes of buffer `index`.
    fn buffer(&mut self, index: usize) -> Result<&[u8], Fault> {
        let document = self.document;
        let at = |reason: Reason| reason.at(Place::Part(format!("buffer {index}")));
        let buffer = document.buffers.get(index).ok_or_else(|| at(Reason::Missing))?;
        if self.buffers[index].is_none() {
            let bytes: Cow<'a, [u8]> = match &buffer.uri {
                None if index == 0 => Cow::Borrowed(self.binary.ok_or_else(|| at(Reason::Missing))?),
                None => return Err(at(Reason::Missing)),
                Some(uri) => Cow::Owned(resource(uri, self.origin).map_err(|fault| match fault.place {
                    Place::File => at(fault.reason),
                    _ => fault,
                })?),
            };
            self.buffers[index] = Some(bytes);
        }
        let bytes = self.buffers[index].as_deref().unwrap_or_default();
        bytes.get(..buffer.byte_length).ok_or_else(|| {
            let (claimed, available) = (buffer.byte_length as u64, bytes.len() as u64);
            at(Reason::TooShort { claimed, available })
        })
    }
}

/// The bytes of `uri`: base64 data in it, or a file in the document's folder.
fn resource(uri: &str, origin: Origin<'_>) -> Result<Vec<u8>, Fault> {
    let Some(data) = uri.strip_prefix("data:") else {
        return origin.companion(&percent_decoded(uri));
    };
    let malformed = || {
        let text = "its data is not base64";
        Reason::Unsupported(text.to_owned()).at(Place::File)
    };
    let (kind, data) = data.split_once(',').ok_or_else(malformed)?;
    if !kind.ends_with(";base64") {
        return Err(malformed());
    }
    base64::engine::general_purpose::STANDARD.decode(data).map_err(|_| malformed())
}

/// `text` with each `%` and its two hexadecimal digits replaced by the byte that they encode.
fn percent_decoded(text: &str) -> String {
    let digit = |byte: Option<&u8>| char::from(*byte?).to_digit(16);
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        match (digit(bytes.get(at + 1)), digit(bytes.get(at + 2))) {
            (Some(high), Some(low)) if bytes[at] == b'%' => {
                decoded.push((16 * high + low) as u8);
                at += 3;
            }
            _ => {
                decoded.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&decoded).into_owned()
}
