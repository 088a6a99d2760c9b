//! Conversion of the tables by which attributes are decoded to the streams that the device reads.

use super::draw::DrawError;
use crate::command::{DecodingTable, DecodingTables, HarmonicsBuffer};
use crate::pipeline::gaussian::decoding::{DecodingState, HarmonicsMethod, Method};
use simdevice::packet::{self, AttributeStream, Decoding, Decodings, HarmonicsDecoding};
use simdevice::{BufferRange, Format};
use std::sync::Arc;

/// The decodings of a draw, with the tables that they read.
pub(super) struct DrawDecodings<'a> {
    state: &'a DecodingState,
    tables: &'a DecodingTables,
    /// A range of no bytes, for tables without any.
    empty: BufferRange,
}

impl<'a> DrawDecodings<'a> {
    /// The decodings of a pipeline with the tables that are bound; `None` if it reads no tables. `positions` is the buffer
    /// of positions.
    ///
    /// # Errors
    /// [`DrawError::DecodingTables`] if no tables are bound, [`DrawError::ChunkSize`] if a chunk has no size.
    pub(super) fn new(
        state: &'a DecodingState,
        tables: Option<&'a DecodingTables>,
        positions: &BufferRange,
    ) -> Result<Option<Self>, DrawError> {
        if !state.needs_tables() {
            return Ok(None);
        }
        let tables = tables.ok_or(DrawError::DecodingTables)?;
        let used = [
            (state.position, &tables.position),
            (state.scale, &tables.scale),
            (state.opacity, &tables.opacity),
            (state.color, &tables.color),
        ];
        if used.iter().any(|(method, table)| *method == Method::Chunk && table.chunk_size == 0) {
            return Err(DrawError::ChunkSize);
        }
        let empty = BufferRange { memory: Arc::clone(&positions.memory), offset: 0, size: 0 };
        Ok(Some(Self { state, tables, empty }))
    }

    /// The ways of decoding, with what the tables say of them.
    pub(super) fn decodings(&self) -> Decodings {
        let (state, tables) = (self.state, self.tables);
        let codes = packet::HarmonicsCodes {
            component_stride: tables.codes.component_stride,
            is_binary64: tables.harmonics.is_binary64,
        };
        Decodings {
            position: decoding(state.position, &tables.position),
            signed_log_position: state.signed_log_position,
            scale: decoding(state.scale, &tables.scale),
            rotation: state.rotation,
            opacity: decoding(state.opacity, &tables.opacity),
            color: decoding(state.color, &tables.color),
            base_color: state.base_color,
            harmonics: match state.harmonics {
                HarmonicsMethod::None => HarmonicsDecoding::None,
                HarmonicsMethod::Codebook => HarmonicsDecoding::Codebook(codes),
                HarmonicsMethod::Palette => HarmonicsDecoding::Palette(codes),
            },
        }
    }

    /// The streams of the tables that are read.
    pub(super) fn tables(&self) -> packet::DecodingTables {
        let (state, tables) = (self.state, self.tables);
        let stream = |method: Method, table: &DecodingTable| {
            let buffer = table.range.as_ref().unwrap_or(&self.empty).clone();
            (method != Method::None).then(|| unsigned(buffer, table.stride, Format::R8Uint))
        };
        let labels = || {
            let buffer = tables.labels.range.as_ref().unwrap_or(&self.empty).clone();
            unsigned(buffer, tables.labels.stride, Format::R16Uint)
        };
        let of_harmonics = if state.harmonics == HarmonicsMethod::None { Method::None } else { Method::Codebook };
        packet::DecodingTables {
            position: stream(state.position, &tables.position),
            scale: stream(state.scale, &tables.scale),
            opacity: stream(state.opacity, &tables.opacity),
            color: stream(state.color, &tables.color),
            harmonics: stream(of_harmonics, &tables.harmonics),
            labels: (state.harmonics == HarmonicsMethod::Palette).then(labels),
        }
    }

    /// The streams of the codes of red, of the coefficients from 1 on to before `count`; none if they are not decoded.
    pub(super) fn codes(&self, count: usize) -> Vec<AttributeStream> {
        if self.state.harmonics == HarmonicsMethod::None {
            return Vec::new();
        }
        let codes = &self.tables.codes;
        let buffer = HarmonicsBuffer {
            range: codes.range.as_ref().unwrap_or(&self.empty).clone(),
            format: Format::R8Uint,
            stride: codes.stride,
            coefficient_stride: codes.coefficient_stride.into(),
        };
        (1..count as u64).map(|number| buffer.coefficient(number - 1)).collect()
    }
}

fn decoding(method: Method, table: &DecodingTable) -> Decoding {
    let is_binary64 = table.is_binary64;
    match method {
        Method::None => Decoding::None,
        Method::Chunk => Decoding::Chunk { size: table.chunk_size, is_binary64 },
        Method::Codebook => Decoding::Codebook { is_binary64 },
    }
}

/// A stream of integers by vertex.
fn unsigned(buffer: BufferRange, stride: u32, format: Format) -> AttributeStream {
    AttributeStream { buffer, stride, offset: 0, format, instance_divisor: None }
}
