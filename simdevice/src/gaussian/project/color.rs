//! Colours of kept Gaussians: the spherical harmonics in the directions from the eye, a batch of directions at a time.

use super::scratch::Scratch;
use crate::gaussian::lanes::{GROUP, GroupF64};
use crate::gaussian::read::group::GroupAttributes;
use crate::gaussian::read::harmonics::Harmonics;
use crate::gaussian::spherical_harmonics::{Bases, COEFFICIENT_FLOATS, DIRECTIONS};
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::float::FusedMultiply;

/// The vectors from the eye to the means of the kept Gaussians, in the axes of the Gaussians' own space.
pub(crate) fn toward<'a>(group: &GroupAttributes<'_>, scratch: &'a Scratch) -> &'a [GroupF64; 3] {
    match &scratch.models {
        Some(models) if group.matrices.is_some() => &models.toward,
        _ => &scratch.offset,
    }
}

/// The least and the greatest square of a length that is formed in binary32. Numbers of such lengths neither overflow
/// nor lose digits to underflow.
const SQUARES: [f32; 2] = [1e-20, 1e20];

/// Gives vectors the length 1, in binary32. Changes nothing and returns false if the square of a length is outside of
/// [`SQUARES`].
#[inline(always)]
pub(crate) fn normalize<S: Simd>(simd: S, vectors: &mut [[f32; DIRECTIONS]; 3]) -> bool {
    let [x, y, z] = vectors.each_ref().map(|lanes| f32x16::from_slice(simd, lanes));
    let square = z.fused_add(z, y.fused_add(y, x * x));
    let [least, greatest] = SQUARES;
    if !square.max(least).min(greatest).simd_eq(square).all_true() {
        return false;
    }
    let per_length = f32x16::splat(simd, 1.0) / square.sqrt();
    for (lanes, part) in vectors.iter_mut().zip([x, y, z]) {
        (part * per_length).store_slice(lanes);
    }
    true
}

/// Computes the directions of a batch of elements from the vectors `toward` them, whatever their lengths.
#[cold]
pub(crate) fn normalize_wide(toward: &[GroupF64; 3], batch: &[usize], directions: &mut [[f32; DIRECTIONS]; 3]) {
    for (number, &at) in batch.iter().enumerate() {
        let vector = toward.each_ref().map(|lanes| lanes[at % GROUP]);
        let [x, y, z] = vector.map(f64::abs);
        let unit = 1.0 / x.max(y).max(z);
        let [x, y, z] = vector.map(|part| part * unit);
        let per_length = 1.0 / (x * x + y * y + z * z).sqrt();
        for (lanes, part) in directions.iter_mut().zip([x, y, z]) {
            lanes[number % DIRECTIONS] = (part * per_length) as f32;
        }
    }
}

/// A kept lane and its colour.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ColoredLane {
    pub(super) at: usize,
    /// Red, green and blue; the fourth number is unused.
    pub(super) color: [f32; 4],
}

/// The coloured lanes of a batch of directions.
pub(crate) struct Colored {
    lanes: [ColoredLane; DIRECTIONS],
    len: usize,
}

impl Colored {
    #[inline(always)]
    pub(super) fn all(&self) -> &[ColoredLane] {
        &self.lanes[..self.len.min(DIRECTIONS)]
    }
}

/// Computes the colours of a batch of elements from `COUNT` coefficients each, in the directions of `bases`. Elements
/// whose coefficients are not finite are left out. `lanes` are the elements' lanes, and `read` is scratch, of zeros where
/// the draw has no coefficients.
#[inline(always)]
pub(crate) fn color<S: Simd, const COUNT: usize>(
    simd: S,
    group: &GroupAttributes<'_>,
    lanes: &[usize],
    batch: &[usize],
    bases: &Bases,
    read: &mut [f32; COEFFICIENT_FLOATS],
) -> Colored {
    let mut colored = [ColoredLane::default(); DIRECTIONS];
    let mut len = 0;
    // One more than there are, since vectors have four numbers and coefficients three.
    let needed = 3 * COUNT + 1;
    let held = if group.reader.floats() + 1 >= needed { group.harmonics } else { Harmonics::default() };
    for (number, &at) in batch.iter().enumerate() {
        let lane = lanes[at % GROUP];
        let coefficients = match held.first(lane, needed) {
            Some(coefficients) => coefficients,
            None => group.read_harmonics(lane, read),
        };
        if let Some(color) = bases.color_of::<S, COUNT>(simd, number, coefficients) {
            let to = &mut colored[len % DIRECTIONS];
            to.at = at % GROUP;
            color.store_slice(&mut to.color);
            len += 1;
        }
    }
    Colored { lanes: colored, len }
}
