//! Decoding of attributes from integers: what a pipeline says of it, and the tables that draws have.

use ash::vk;
use gaurast::vk::{
    GaussianDecodingGAURAST as Decoding, GaussianDecodingTableGAURAST as TableInfo,
    GaussianDecodingTablesGAURAST as TablesInfo, GaussianHarmonicsDecodingGAURAST as HarmonicsDecoding,
    PipelineGaussianDecodingStateCreateInfoGAURAST as DecodingState,
};

/// The place of the first harmonic in the kernels' list of attributes.
pub(crate) const HARMONICS: usize = 8;

/// The decodings of a pipeline.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Decodings {
    /// As `shaders/decoding.glsl` has them.
    pub(crate) word: u32,
    /// Coefficients from 1 on are no attributes.
    pub(crate) are_harmonics_decoded: bool,
    needs_tables: bool,
    /// Attributes between the bounds of chunks: position, scale, opacity, colour.
    in_chunks: [bool; 4],
}

impl Decodings {
    pub(crate) fn new(state: &DecodingState<'_>) -> Self {
        let of_attributes = [state.position, state.scale, state.opacity, state.color];
        let [position, scale, opacity, color] = of_attributes.map(|one| one.as_raw().cast_unsigned());
        let rotation = state.rotation.as_raw().cast_unsigned();
        let harmonics = state.spherical_harmonics.as_raw().cast_unsigned();
        let flags =
            u32::from(state.signed_log_position != vk::FALSE) << 12 | u32::from(state.base_color != vk::FALSE) << 13;
        let are_harmonics_decoded = state.spherical_harmonics != HarmonicsDecoding::NONE;
        Self {
            word: position | scale << 2 | rotation << 4 | opacity << 6 | color << 8 | harmonics << 10 | flags,
            are_harmonics_decoded,
            needs_tables: are_harmonics_decoded || of_attributes.iter().any(|one| *one != Decoding::NONE),
            in_chunks: of_attributes.map(|one| one == Decoding::CHUNK),
        }
    }

    /// True if something is decoded.
    pub(crate) fn is_used(&self) -> bool {
        self.word & ((1 << 12) - 1) != 0
    }

    /// True if the attribute at a place of the kernels' list holds integers.
    pub(crate) fn has_codes(&self, place: usize) -> bool {
        let shift = match place {
            // Position, scale, rotation, opacity.
            0..4 => 2 * place,
            HARMONICS => 8,
            _ => return false,
        };
        self.word >> shift & 3 != 0
    }

    /// The tables of a draw; `None` if it lacks one and draws nothing.
    pub(crate) fn tables(&self, bound: Option<&Tables>) -> Option<Tables> {
        if !self.needs_tables {
            return Some(Tables::default());
        }
        let has_chunks = |tables: &&Tables| {
            let mut of_attributes = self.in_chunks.iter().zip(&tables.numbers);
            of_attributes.all(|(in_chunks, table)| !in_chunks || table.chunk_size != 0)
        };
        bound.filter(has_chunks).copied()
    }
}

/// A table of numbers, as `shaders/set.glsl` has it.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Table {
    address: u64,
    bytes: u32,
    stride: u32,
    chunk_size: u32,
    is_binary64: u32,
}

impl Table {
    fn new(table: &TableInfo) -> Self {
        Self {
            address: table.device_address,
            bytes: bytes(table.size),
            stride: table.stride,
            chunk_size: table.chunk_size,
            is_binary64: u32::from(table.format == vk::Format::R64_SFLOAT),
        }
    }
}

/// The tables of a draw, as `shaders/set.glsl` has them.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Tables {
    /// Of positions, scales, opacities, colours and harmonics.
    numbers: [Table; 5],
    codes: u64,
    codes_bytes: u32,
    codes_stride: u32,
    coefficient_stride: u32,
    component_stride: u32,
    labels: u64,
    labels_bytes: u32,
    labels_stride: u32,
}

impl Tables {
    pub(crate) fn new(info: &TablesInfo<'_>) -> Self {
        let TablesInfo { position, scale, opacity, color, spherical_harmonics, codes, labels, .. } = info;
        Self {
            numbers: [position, scale, opacity, color, spherical_harmonics].map(Table::new),
            codes: codes.device_address,
            codes_bytes: bytes(codes.size),
            codes_stride: codes.stride,
            coefficient_stride: codes.coefficient_stride,
            component_stride: codes.component_stride,
            labels: labels.device_address,
            labels_bytes: bytes(labels.size),
            labels_stride: labels.stride,
        }
    }
}

/// A size as kernels have it.
fn bytes(size: u64) -> u32 {
    u32::try_from(size).unwrap_or(u32::MAX)
}
