//! The `.splat` format of antimatter15's viewer: records of 32 bytes and nothing else.
//!
//! A record is position (3 floats), scale (3 floats, linear), colour and opacity (4 bytes, 0 to
//! 255) and a quaternion w, x, y, z (4 bytes, 128 being zero), little-endian. The frame is that
//! of PLY files.

use super::input::{Format, Input, Loaded};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::SH_C0;
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// The format.
pub(super) struct Splat;

/// Bytes of one Gaussian.
const RECORD: usize = 32;

impl Format for Splat {
    fn name(&self) -> &'static str {
        "splat"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["splat"]
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
        let bytes = input.rest()?;
        let (records, rest) = bytes.as_chunks::<RECORD>();
        if !rest.is_empty() {
            let (len, record) = (bytes.len() as u64, RECORD as u64);
            return Err(Reason::Records { len, record }.at(Place::File));
        }
        if records.is_empty() {
            return Err(Reason::Empty.at(Place::File));
        }
        Ok(Scene::try_generate(0, records.len(), |index, sh| gaussian(&records[index], sh))?.into())
    }
}

/// Decodes a record. Returns its position and shape, and writes its colour to `sh`.
fn gaussian(record: &[u8; RECORD], sh: &mut [[f32; 3]]) -> ([f32; 3], GaussianShape) {
    let float = |index: usize| f32::from_le_bytes(std::array::from_fn(|byte| record[4 * index + byte]));
    let colour = |channel: usize| ((f64::from(record[24 + channel]) / 255.0 - 0.5) / SH_C0) as f32;
    let shape = GaussianShape {
        scale: std::array::from_fn(|axis| float(3 + axis)),
        rotation: std::array::from_fn(|i| (f32::from(record[28 + i]) - 128.0) / 128.0),
        opacity: f32::from(record[27]) / 255.0,
    };
    sh[0] = std::array::from_fn(colour);
    (std::array::from_fn(float), shape)
}
