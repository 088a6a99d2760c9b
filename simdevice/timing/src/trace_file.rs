//! The bytes of a trace: JSON, or postcard's binary encoding for a trace of many pairs.

use crate::check::{self, TraceError};
use crate::work::Trace;

/// The first bytes of a binary trace, before postcard's encoding of [`Trace`].
pub const MAGIC: [u8; 8] = *b"gaurast\n";

/// The most pairs of a tile and a primitive, over all frames, of a trace in JSON.
pub const MOST_JSON_PAIRS: u64 = 1_000_000;

/// The reason that bytes can't be read as a trace, or a trace can't be written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The JSON is malformed, or a field is missing, unknown or of the wrong kind.
    #[error("not a trace of work: {0}")]
    Json(#[from] serde_json::Error),
    /// The binary encoding is malformed or ends early.
    #[error("not a binary trace of work of this version: {0}")]
    Binary(#[from] postcard::Error),
    /// Its numbers contradict each other.
    #[error(transparent)]
    Trace(#[from] TraceError),
}

/// The trace as bytes: binary if it has more than [`MOST_JSON_PAIRS`] pairs.
///
/// # Errors
/// Returns a [`FileError`] if memory does not suffice.
pub fn to_bytes(trace: &Trace) -> Result<Vec<u8>, FileError> {
    let pairs: u64 = trace.frames.iter().map(|frame| frame.pairs()).sum();
    if pairs > MOST_JSON_PAIRS {
        return Ok(postcard::to_extend(trace, MAGIC.to_vec())?);
    }
    Ok(serde_json::to_vec(trace)?)
}

/// The trace of bytes in either encoding, checked.
///
/// # Errors
/// Returns a [`FileError`] if the bytes are no trace, or its numbers contradict each other.
pub fn from_bytes(bytes: &[u8]) -> Result<Trace, FileError> {
    let trace: Trace = match bytes.strip_prefix(&MAGIC) {
        Some(binary) => postcard::from_bytes(binary)?,
        None => serde_json::from_slice(bytes)?,
    };
    check::check(&trace)?;
    Ok(trace)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::even_frame;
    use crate::work::{Mode, TRACE_VERSION};

    fn trace(pairs: u64) -> Trace {
        let mut frame = even_frame([320, 200], pairs, 0.3);
        let draw = &mut frame.draws[0];
        (draw.primitives, draw.drawn) = (5000, 5000);
        for (index, tile) in draw.tiles.iter_mut().enumerate() {
            tile.ids = (0..tile.listed).map(|k| (k * 77 + index as u32) % 5000).collect();
            tile.runs[0].waits = Some([0, 1, 2, 3, 5, 8, 13, 21]);
        }
        let mut triangles = draw.clone();
        triangles.mode = Mode::Triangle;
        frame.draws.push(triangles);
        frame.place();
        Trace { version: TRACE_VERSION, frames: vec![frame] }
    }

    #[test]
    fn traces_survive_both_encodings() {
        for (pairs, is_binary) in [(MOST_JSON_PAIRS / 2, false), (MOST_JSON_PAIRS / 2 + 260, true)] {
            let trace = trace(pairs);
            let bytes = to_bytes(&trace).unwrap();
            assert_eq!(bytes.starts_with(&MAGIC), is_binary, "{pairs}");
            assert_eq!(from_bytes(&bytes).unwrap(), trace);
        }
    }

    #[test]
    fn the_binary_encoding_is_smaller() {
        let [json, binary] =
            [MOST_JSON_PAIRS / 2, MOST_JSON_PAIRS / 2 + 260].map(|pairs| to_bytes(&trace(pairs)).unwrap());
        // An id below 16384 has at most two bytes, and five and a comma in JSON.
        assert!(2 * binary.len() < json.len(), "{} {}", binary.len(), json.len());
    }

    #[test]
    fn cut_and_changed_bytes_are_refused_or_read() {
        let bytes = to_bytes(&trace(MOST_JSON_PAIRS)).unwrap();
        for length in [0, 3, 8, 9, 100, bytes.len() / 2, bytes.len() - 1] {
            assert!(from_bytes(&bytes[..length]).is_err(), "{length}");
        }
        // A changed byte may give another trace, but no panic and no large allocation.
        for at in (8..bytes.len()).step_by(bytes.len() / 40) {
            let mut changed = bytes.clone();
            changed[at] ^= 0xff;
            let _read = from_bytes(&changed);
        }
        let mut old = trace(10);
        old.version = 3;
        let error = from_bytes(&to_bytes(&old).unwrap()).unwrap_err();
        assert_eq!(error.to_string(), "version 3; only traces of version 4 can be read");
    }
}
