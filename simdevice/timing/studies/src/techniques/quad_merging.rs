//! VR-Pipe (arXiv 2502.17078): Gaussians as quads of the graphics pipeline, of which a depth or stencil test removes the
//! fragments of finished pixels (early termination), and of which the shader cores blend two of the same place before
//! the ROPs do (quad merging).

use super::tile::Pair;
use crate::rivals::{Fragments, Quads};
use serde::{Deserialize, Serialize};
use timing::config::Config;

/// The capacities in quads of a bin of a tile, in which quads of the same place can meet. What VR-Pipe's bins hold could
/// not be read.
pub const BINS: [u32; 4] = [32, 64, 128, 256];

/// The fragments and quads of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Merging {
    /// Fragments, which are pairs of a pixel and a Gaussian whose alpha is at least its floor there.
    pub fragments: u64,
    /// Fragments of unfinished pixels.
    pub open_fragments: u64,
    /// Quads of 2x2 pixels with such a fragment.
    pub open_quads: u64,
    /// Quads that the ROPs blend if quads of the same place in a bin are blended in twos before, for each capacity of
    /// [`BINS`].
    pub merged_quads: [u64; BINS.len()],
}

impl Merging {
    /// The ratio of fragments without early termination to those with it.
    pub fn termination(&self) -> f64 {
        self.fragments as f64 / self.open_fragments as f64
    }

    /// The ratio of quads before merging to those after it, for each capacity.
    pub fn merging(&self) -> [f64; BINS.len()] {
        self.merged_quads.map(|quads| self.open_quads as f64 / quads as f64)
    }

    /// The ratio of the pipeline's time without early termination and merging to that with both, for a capacity. Every
    /// fragment that is left is shaded; only merged ones are blended.
    pub fn speed_up(&self, gaussians: u64, size: [u32; 2], config: &Config) -> [f64; BINS.len()] {
        let time = |shaded: f64, blended: f64| {
            Quads::of(&Fragments { shaded, blended, gaussians: gaussians as f64 }, size, config).milliseconds()
        };
        let (all, open) = (self.fragments as f64, self.open_fragments as f64);
        self.merging().map(|merging| time(all, all) / time(open, open / merging))
    }
}

/// Quads of a tile that wait for another one of the same place.
#[derive(Clone, Debug)]
struct Bin {
    capacity: u32,
    held: u32,
    /// The number of quads held of each of the tile's 64 places.
    quads: [u32; 64],
}

impl Bin {
    fn new(capacity: u32) -> Self {
        Self { capacity, held: 0, quads: [0; 64] }
    }

    /// Adds a quad at a place. Returns the number of quads that are blended then.
    fn add(&mut self, place: usize) -> u64 {
        self.quads[place] += 1;
        self.held += 1;
        if self.held == self.capacity { self.flush() } else { 0 }
    }

    /// Empties the bin. Returns the number of quads that are blended.
    fn flush(&mut self) -> u64 {
        self.held = 0;
        self.quads.iter_mut().map(|quads| u64::from(std::mem::take(quads).div_ceil(2))).sum()
    }
}

/// The counter of a tile's fragments and quads.
#[derive(Clone, Debug)]
pub struct MergingCounter {
    merging: Merging,
    bins: [Bin; BINS.len()],
}

impl Default for MergingCounter {
    fn default() -> Self {
        Self { merging: Merging::default(), bins: BINS.map(Bin::new) }
    }
}

impl MergingCounter {
    /// Counts a Gaussian in the tile.
    pub fn add(&mut self, pair: &Pair) {
        let open = pair.covered.and(&pair.open);
        self.merging.fragments += pair.covered.count();
        self.merging.open_fragments += open.count();
        let quads = open.quads();
        self.merging.open_quads += u64::from(quads.count_ones());
        for place in (0..64).filter(|place| quads >> place & 1 == 1) {
            for (bin, merged) in self.bins.iter_mut().zip(&mut self.merging.merged_quads) {
                *merged += bin.add(place);
            }
        }
    }

    /// Ends a tile: its bins are emptied.
    pub fn end_tile(&mut self) {
        for (bin, merged) in self.bins.iter_mut().zip(&mut self.merging.merged_quads) {
            *merged += bin.flush();
        }
    }

    /// The counts of all tiles that ended.
    pub fn merging(&self) -> Merging {
        self.merging
    }
}

#[cfg(test)]
mod tests {
    use super::super::footprint::Footprint;
    use super::super::mask::Mask;
    use super::*;

    fn pair(covered: Mask, open: Mask) -> Pair {
        let footprint = Footprint { id: 0, mean: [0.0; 2], covariance: [1.0, 0.0, 1.0], opacity: 1.0 };
        Pair { footprint, covered, open }
    }

    #[test]
    fn quads_meet_in_bins_that_hold_them() {
        let all = Mask::of(|_, _| true);
        let mut counter = MergingCounter::default();
        (0..5).for_each(|_| counter.add(&pair(all, all)));
        counter.end_tile();
        let merging = counter.merging();
        assert_eq!((merging.fragments, merging.open_quads), (5 * 256, 5 * 64));
        // A Gaussian has 64 quads here: bins of 32 and 64 never hold two of a place, one of 128 holds two, and one of 256
        // holds four.
        assert_eq!(merging.merged_quads, [5 * 64, 5 * 64, 3 * 64, 3 * 64]);
    }

    #[test]
    fn finished_pixels_have_no_fragments() {
        let (all, half) = (Mask::of(|_, _| true), Mask::of(|x, _| x < 8));
        let mut counter = MergingCounter::default();
        counter.add(&pair(all, all));
        counter.add(&pair(all, half));
        counter.end_tile();
        let merging = counter.merging();
        assert_eq!([merging.fragments, merging.open_fragments], [512, 384]);
        assert!((merging.termination() - 4.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn blending_bounds_the_speed_up() {
        let config = Config::preset("orin-nx-10w", &[]).unwrap();
        let merging = Merging {
            fragments: 4_000_000,
            open_fragments: 2_000_000,
            open_quads: 1_000_000,
            merged_quads: [1_000_000, 1_000_000, 800_000, 500_000],
        };
        let speed_up = merging.speed_up(1000, [640, 360], &config);
        assert!((speed_up[0] - 2.0).abs() < 1e-9);
        // Twice as many quads merge, but shading does not become less.
        assert!(speed_up[3] <= 4.0 && speed_up[3] >= speed_up[2]);
    }
}
