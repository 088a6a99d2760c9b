//! Tiles that one primitive covers as a whole, with nothing that is tested later and fragments that take nothing but
//! varyings: a batch that needs no list of quads.

use super::super::batch::{BlockValues, LANES, divided, varying};
use super::super::setup::Setup;
use super::super::tile::AREA;
use crate::program::interface::Interpolation;
use crate::raster::setup::Needs;
use crate::raster::tile::{BLOCKS, block_corner};
use crate::simd::{bits_of, both, three};
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::exec::{Chunk, LaneMask};

// A tile fills the largest batch.
const _: () = assert!(AREA == LANES);

/// What the fragments of a tile get.
#[derive(Debug)]
pub struct FullTile {
    /// The barycentrics of corners 1 and 2, pixel by pixel.
    pub(super) linear: [[f32; AREA]; 2],
    /// The same, perspective-correct.
    pub(super) perspective: [[f32; AREA]; 2],
    pub(super) attributes: Vec<[f32; 3]>,
    pub(super) all: LaneMask,
    pub(super) none: LaneMask,
}

impl Default for FullTile {
    fn default() -> Self {
        Self {
            linear: [[0.0; AREA]; 2],
            perspective: [[0.0; AREA]; 2],
            attributes: Vec::new(),
            all: LaneMask::first(AREA),
            none: LaneMask::none(),
        }
    }
}

impl FullTile {
    /// Finds the barycentrics of all pixels; perspective-correct ones, too, if 1 / w is needed.
    #[inline(always)]
    pub(super) fn find_barycentrics<S: Simd>(
        &mut self,
        simd: S,
        setup: &Setup,
        at: [i32; 2],
        needs: Needs,
    ) {
        for block in 0..BLOCKS {
            let pixels = 16 * block..16 * (block + 1);
            let values = BlockValues::new(simd, setup, block_corner(at, block), needs);
            for (linear, lanes) in self.linear.iter_mut().zip(values.barycentrics) {
                lanes.store_slice(&mut linear[pixels.clone()]);
            }
            if needs.inverse_w {
                let weights = both(setup.weights, |weight| f32x16::splat(simd, weight));
                let [p1, p2] = divided(simd, values.barycentrics, values.inverse_w, weights);
                p1.store_slice(&mut self.perspective[0][pixels.clone()]);
                p2.store_slice(&mut self.perspective[1][pixels]);
            }
        }
    }

    /// A varying of all pixels.
    #[inline(always)]
    pub(super) fn interpolate<S: Simd>(
        &self,
        simd: S,
        interpolation: Interpolation,
        divides: bool,
        attribute: [f32; 3],
        out: &mut [Chunk],
    ) {
        let [b1, b2] = match interpolation {
            Interpolation::Flat => return out.fill(Chunk([attribute[0].to_bits(); 16])),
            Interpolation::Perspective if divides => &self.perspective,
            _ => &self.linear,
        };
        let (b1, b2) = (b1.as_chunks::<16>().0, b2.as_chunks::<16>().0);
        let attribute = three(attribute, |value| f32x16::splat(simd, value));
        for (out, (b1, b2)) in out.iter_mut().zip(b1.iter().zip(b2)) {
            let b1 = f32x16::simd_from(simd, *b1);
            let b2 = f32x16::simd_from(simd, *b2);
            *out = Chunk(bits_of(varying(attribute, [b1, b2])).into());
        }
    }
}
