//! Tiles that one primitive covers as a whole, with nothing that is tested later and fragments that take nothing but
//! varyings: a batch that needs no list of quads.

use super::super::batch::{BlockValues, LANES, Needs, add_attributes, divided, varying};
use super::super::output::lanes_of;
use super::super::setup::Setup;
use super::super::tile::AREA;
use super::whole::{BLOCKS, block_corner};
use super::{Current, Renderer};
use crate::program::interface::{FragmentInput, Interpolation};
use crate::simd::{bits_of, both, three};
use crate::stats::counters::Counter;
use crate::stats::optimizations::Skip;
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::exec::{Chunk, LaneMask, Stopped, Watchdog};

// A tile fills the largest batch.
const _: () = assert!(AREA == LANES);

/// What the fragments of a tile get.
#[derive(Debug)]
pub struct FullTile {
    /// The barycentrics of corners 1 and 2, pixel by pixel.
    linear: [[f32; AREA]; 2],
    /// The same, perspective-correct.
    perspective: [[f32; AREA]; 2],
    attributes: Vec<[f32; 3]>,
    all: LaneMask,
    none: LaneMask,
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

impl Renderer<'_, '_> {
    /// Shades the tile at pixel `at`, which is there, in a draw that takes tiles at once.
    #[inline(always)]
    pub(super) fn shade_full_tile<S: Simd>(
        &mut self,
        simd: S,
        current: &mut Current<'_>,
        (tile, at): (usize, [i32; 2]),
    ) -> Result<(), Stopped> {
        let draw = self.draw;
        let Some(stage) = draw.stage else {
            return Ok(());
        };
        // Earlier fragments of the tile come first.
        if self.batch.has_tile(tile) {
            self.flush()?;
            current.record = None;
        }
        let interface = &stage.interface;
        let full = &mut *self.full;
        full.attributes.clear();
        let (primitive, varyings) = (current.primitive, current.varyings);
        add_attributes(primitive, interface, varyings, &mut full.attributes);
        let affine = current.setup.affine && draw.skips.has(Skip::Affine);
        let divides = draw.needs.inverse_w && !affine;
        if draw.needs.barycentrics {
            let needs = Needs {
                inverse_w: divides,
                ..draw.needs
            };
            full.find_barycentrics(simd, current.setup, at, needs);
        }
        let Some(machines) = self.machines.as_mut() else {
            return Ok(());
        };
        let machine = machines.of_size(1);
        for &(slot, kind, place) in &interface.inputs {
            if let FragmentInput::Varying { interpolation, .. } = kind {
                let attribute = full.attributes[place];
                let lanes = machine.input_mut(slot);
                full.interpolate(simd, interpolation, divides, attribute, lanes);
            }
        }
        let undivided = draw.needs.inverse_w && !divides;
        self.counters.add(Counter::BatchesAffine, undivided.into());
        let watchdog = Watchdog {
            limit: draw.limit,
            cancel: Some(self.cancel),
        };
        let resources = draw.bindings.resources();
        machine.run(&full.all, &full.none, &resources, watchdog)?;
        self.counters.add(Counter::FragmentInvocations, AREA as u64);
        for (index, output) in draw.colors.iter().enumerate() {
            if let (Some(output), Some(slots)) = (output, interface.colors.get(index)) {
                let sources = both(*slots, |slots| slots.map(|slot| lanes_of(machine, slot)));
                let plane = &mut self.buffers.color[index];
                let first = plane.start(tile, 0);
                output.write_tile(simd, &sources, first, plane.words_mut());
            }
        }
        Ok(())
    }
}

impl FullTile {
    /// Finds the barycentrics of all pixels; perspective-correct ones, too, if 1 / w is needed.
    #[inline(always)]
    fn find_barycentrics<S: Simd>(&mut self, simd: S, setup: &Setup, at: [i32; 2], needs: Needs) {
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
    fn interpolate<S: Simd>(
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
