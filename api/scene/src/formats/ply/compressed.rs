//! PlayCanvas's compressed PLY (`.compressed.ply`).
//!
//! Element `chunk` holds the bounds of every 256 Gaussians (position, log-scale and, in newer
//! files, colour); element `vertex` packs a Gaussian into four words relative to them: position
//! and log-scale as 11, 10 and 11 bits, the quaternion's three smallest components as 10 bits
//! each with the index of the largest, colour and opacity as 8 bits each. The optional element
//! `sh` holds the other coefficients as bytes over -4 to 4, channel by channel.

use std::f64::consts::FRAC_1_SQRT_2;

use ply_rs_bw::ply::ScalarType;

use super::table::Table;
use super::{columns, inria};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::SH_C0;
use crate::scene::Scene;
use crate::shape::GaussianShape;

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

/// Reads the scene.
pub(super) fn load(mut table: Table<'_, '_>) -> Result<Scene, Fault> {
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
    let (degree, rest) = if has_sh { inria::rest_columns(&table, "sh")? } else { (0, Vec::new()) };
    if has_sh {
        for i in 0..rest.len() {
            table.column_of("sh", &format!("f_rest_{i}"), &ScalarType::UChar, "uchar")?;
        }
        same_count("sh", table.count("sh")?, count)?;
    }

    let mut scene = Scene::try_with_capacity(degree, count)?;
    if let Some(warning) = columns::warning(&table, "vertex", |name| PACKED.contains(&name)) {
        scene.metadata_mut().warn(warning);
    }
    let unbounded = chunks.iter().filter(|bounds| !bounds.iter().all(|bound| bound.is_finite())).count();
    if unbounded > 0 {
        let all = chunks.len();
        scene.metadata_mut().warn(format!("{unbounded} of {all} chunks of Gaussians have bounds that are not finite"));
    }
    let mut sh = vec![[0.0; 3]; scene.sh_stride()];
    table.read("vertex", &packed, |index, words| {
        let words = std::array::from_fn(|i| words[i] as u32);
        let (position, shape, colour) = unpack(&chunks[index / CHUNK], words);
        sh[0] = colour;
        scene.push(position, shape, &sh);
    })?;
    if has_sh {
        let mut values = vec![0.0; rest.len()];
        table.read("sh", &rest, |index, bytes| {
            for (value, byte) in values.iter_mut().zip(bytes) {
                *value = sh_value(*byte);
            }
            inria::unpack_rest(&values, &mut scene.sh_of_mut(index)[1..]);
        })?;
    }
    Ok(scene)
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

/// Position, shape and constant coefficient of a Gaussian.
fn unpack(bounds: &Bounds, words: [u32; 4]) -> ([f32; 3], GaussianShape, [f32; 3]) {
    let [position, rotation, scale, colour] = words;
    let between = |first: usize, axis: usize, t: f64| {
        let (min, max) = (bounds[first + axis], bounds[first + 3 + axis]);
        min * (1.0 - t) + max * t
    };
    let position = unpack_11_10_11(position);
    let scale = unpack_11_10_11(scale);
    let channel = |index: usize| bits(colour, 24 - 8 * index as u32, 8);
    let shape = GaussianShape {
        scale: std::array::from_fn(|axis| libm::exp(between(6, axis, scale[axis])) as f32),
        rotation: unpack_rotation(rotation),
        opacity: channel(3) as f32,
    };
    (
        std::array::from_fn(|axis| between(0, axis, position[axis]) as f32),
        shape,
        std::array::from_fn(|c| ((between(12, c, channel(c)) - 0.5) / SH_C0) as f32),
    )
}

/// `count` bits of `word` from bit `shift`, as a fraction of their maximum.
fn bits(word: u32, shift: u32, count: u32) -> f64 {
    let max = (1 << count) - 1;
    f64::from((word >> shift) & max) / f64::from(max)
}

fn unpack_11_10_11(word: u32) -> [f64; 3] {
    [bits(word, 21, 11), bits(word, 11, 10), bits(word, 0, 11)]
}

/// Decodes a quaternion w, x, y, z. The two highest bits are the index of the largest component; the other three
/// components follow in order, over -1/sqrt(2) to 1/sqrt(2).
fn unpack_rotation(word: u32) -> [f32; 4] {
    let small = [20, 10, 0].map(|shift| (bits(word, shift, 10) - 0.5) / FRAC_1_SQRT_2);
    let largest = (1.0 - small.iter().map(|c| c * c).sum::<f64>()).max(0.0).sqrt();
    let which = (word >> 30) as usize;
    let mut small = small.into_iter();
    std::array::from_fn(|i| {
        let component = if i == which { Some(largest) } else { small.next() };
        component.unwrap_or_default() as f32
    })
}

/// The value of a byte: the middle of its interval, except that the extremes are exact.
fn sh_value(byte: f64) -> f64 {
    let fraction = match byte {
        0.0 => 0.0,
        255.0 => 1.0,
        _ => (byte + 0.5) / 256.0,
    };
    (fraction - 0.5) * 8.0
}
