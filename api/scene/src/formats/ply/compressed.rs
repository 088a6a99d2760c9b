//! PlayCanvas's compressed PLY (`.compressed.ply`).
//!
//! Element `chunk` holds the bounds of every 256 Gaussians (position, log-scale and, in newer
//! files, colour); element `vertex` packs a Gaussian into four words relative to them: position
//! and log-scale as 11, 10 and 11 bits, the quaternion's three smallest components as 10 bits
//! each with the index of the largest, colour and opacity as 8 bits each. The optional element
//! `sh` holds the other coefficients as bytes over -4 to 4, channel by channel.

use std::path::PathBuf;

use glam::DMat3;
use ply_rs_bw::ply::ScalarType;

use super::table::Table;
use super::{columns, inria};
use crate::encoded::{Attribute, CODEBOOK, Decoding, EncodedHarmonics, EncodedScene, Form, Stream, harmonics_bytes};
use crate::error::{Fault, Place, Reason};
use crate::metadata::Metadata;

/// Gaussians per chunk.
const CHUNK: usize = 256;

/// The properties of `chunk`: minima and maxima of positions, log-scales and colours.
const BOUNDS: [&str; 18] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
    "min_r",
    "min_g",
    "min_b",
    "max_r",
    "max_g",
    "max_b",
];

/// The number of bounds in older files, whose colours range over 0 to 1.
const BOUNDS_WITHOUT_COLOUR: usize = 12;

const PACKED: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

/// The bytes of a Gaussian's words.
const WORDS: usize = 4 * PACKED.len();

/// Reads the scene.
pub(super) fn load(mut table: Table<'_, '_>) -> Result<EncodedScene, Fault> {
    let packed = PACKED
        .iter()
        .map(|name| table.column_of("vertex", name, &ScalarType::UInt, "uint"))
        .collect::<Result<Vec<_>, _>>()?;
    let count = table.count("vertex")?;
    if count == 0 {
        return Err(Reason::Empty.at(Place::Element("vertex".to_owned())));
    }
    let chunks = read_chunks(&mut table, count)?;
    let has_sh = table.element("sh").is_some();
    let (sh_degree, rest) = if has_sh { inria::rest_columns(&table, "sh")? } else { (0, Vec::new()) };
    if has_sh {
        for i in 0..rest.len() {
            table.column_of("sh", &format!("f_rest_{i}"), &ScalarType::UChar, "uchar")?;
        }
        same_count("sh", table.count("sh")?, count)?;
    }

    let mut metadata = Metadata::default();
    if let Some(warning) = columns::warning(&table, "vertex", |name| PACKED.contains(&name)) {
        metadata.warn(warning);
    }
    let unbounded = chunks.iter().filter(|bounds| !bounds.iter().all(|bound| bound.is_finite())).count();
    if unbounded > 0 {
        let all = chunks.len();
        metadata.warn(format!("{unbounded} of {all} chunks of Gaussians have bounds that are not finite"));
    }
    let mut words = stream(count, WORDS)?;
    table.read("vertex", &packed, |_, values| {
        words.bytes.extend(values.iter().flat_map(|value| (*value as u32).to_le_bytes()));
    })?;
    let mut numbers = chunks.concat();
    let mut harmonics = None;
    if sh_degree > 0 {
        let mut codes = stream(count, harmonics_bytes(sh_degree))?;
        table.read_blocks("sh", &rest, |rows| rows.append_bytes(&mut codes.bytes))?;
        let component_stride = codes.stride / 3;
        harmonics = Some(EncodedHarmonics {
            codes,
            coefficient_stride: 1,
            component_stride,
            codebook: numbers.len(),
            labels: None,
        });
        numbers.extend((0..CODEBOOK).map(sh_value));
    }
    let word =
        |index: usize, decoding: Decoding| Attribute { stream: 0, offset: 4 * index, form: Form::Word, decoding };
    let chunks = |first: usize| Decoding::Chunks { table: first, stride: BOUNDS.len(), size: CHUNK };
    Ok(EncodedScene {
        count,
        sh_degree,
        streams: vec![words],
        position: word(0, chunks(0)),
        rotation: word(1, Decoding::SmallestThree),
        scale: word(2, chunks(6)),
        color: word(3, chunks(12)),
        // The lowest byte of the colour's word.
        opacity: Attribute { form: Form::Bytes, ..word(3, Decoding::None) },
        has_signed_log_positions: false,
        has_logit_opacities: false,
        has_base_colors: true,
        numbers,
        harmonics,
        turn: DMat3::IDENTITY,
        metadata,
        path: PathBuf::new(),
    })
}

/// A stream with room for `count` times `stride` bytes, and without any yet.
fn stream(count: usize, stride: usize) -> Result<Stream, Fault> {
    let mut bytes = Vec::new();
    let size = count.saturating_mul(stride);
    bytes.try_reserve_exact(size).map_err(|_| Reason::Memory(size as u64).at(Place::File))?;
    Ok(Stream { bytes, stride })
}

/// Minima and maxima of one chunk, in the order of [`BOUNDS`].
type Bounds = [f64; BOUNDS.len()];

fn read_chunks(table: &mut Table<'_, '_>, gaussians: usize) -> Result<Vec<Bounds>, Fault> {
    let chunk = "chunk";
    let coloured = table.element(chunk).is_some_and(|element| element.properties.contains_key("min_r"));
    let names = if coloured { &BOUNDS[..] } else { &BOUNDS[..BOUNDS_WITHOUT_COLOUR] };
    let columns = names
        .iter()
        .map(|name| table.column_of(chunk, name, &ScalarType::Float, "float"))
        .collect::<Result<Vec<_>, _>>()?;
    same_count(chunk, table.count(chunk)?, gaussians.div_ceil(CHUNK))?;
    let mut chunks = Vec::with_capacity(gaussians.div_ceil(CHUNK));
    table.read(chunk, &columns, |_, values| {
        let mut bounds = [0.0; BOUNDS.len()];
        bounds[15..].fill(1.0);
        bounds[..values.len()].copy_from_slice(values);
        chunks.push(bounds);
    })?;
    Ok(chunks)
}

fn same_count(element: &str, found: usize, expected: usize) -> Result<(), Fault> {
    if found == expected {
        return Ok(());
    }
    let (found, expected) = (found as u64, expected as u64);
    Err(Reason::Count { found, expected }.at(Place::Element(element.to_owned())))
}

/// The value of a byte: the middle of its interval, except that the extremes are exact.
fn sh_value(byte: usize) -> f64 {
    let fraction = match byte {
        0 => 0.0,
        255 => 1.0,
        _ => (byte as f64 + 0.5) / 256.0,
    };
    (fraction - 0.5) * 8.0
}
