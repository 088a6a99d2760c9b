//! The kernel of draws that the fast kernel does not serve, whose resolve shader asks which Gaussians a pixel shows, or how far
//! away they are: in the order of the list, pixel by pixel, with sums in binary64.

use super::block_kernel::BlockKernel;
use super::exponents::neg_log2_alphas;
use crate::gaussian::splats::identity::Identity;
use crate::gaussian::splats::splat::SplatIndex;
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::grid::BLOCK_PIXELS;
use crate::raster::gaussian::inputs::TileInputs;
use crate::simd::exp2::exp2_of_negated;
use fearless_simd::{Simd, f32x16, prelude::*};

/// The sums of a pixel.
#[derive(Clone, Copy, Debug)]
struct Sum {
    color: [f64; 3],
    transmittance: f64,
    /// Sums of weighted depths, of weighted depth variables, and of weights.
    means: [f64; 3],
    /// The depth of the median, as the attachment holds it.
    depth: u32,
    /// The first that contributed, and the median.
    nearest_identity: Identity,
    median_identity: Identity,
    covered: bool,
    finished: bool,
}

impl Sum {
    fn new(is_open: bool) -> Self {
        Self {
            color: [0.0; 3],
            transmittance: 1.0,
            means: [0.0; 3],
            depth: 0,
            nearest_identity: Identity::default(),
            median_identity: Identity::default(),
            covered: false,
            finished: !is_open,
        }
    }
}

/// Compositing in the order of the list, with the identities of Gaussians.
pub(crate) struct Tracking<'a> {
    /// By group, as the splats.
    identities: &'a [Vec<Identity>],
    /// The pixels of a block that were to be touched.
    open: u32,
    sums: [Sum; BLOCK_PIXELS],
}

impl<'a> Tracking<'a> {
    /// Compositing of Gaussians that have these identities, into what was empty.
    pub(crate) fn new(identities: &'a [Vec<Identity>]) -> Self {
        Self { identities, open: 0, sums: [Sum::new(false); BLOCK_PIXELS] }
    }
}

impl BlockKernel for Tracking<'_> {
    fn begin(&mut self, accumulator: &Accumulator, block: usize) {
        self.open = accumulator.open_lanes(block);
        let open = self.open;
        self.sums = std::array::from_fn(|lane| Sum::new(open >> lane & 1 == 1));
    }

    fn is_open(&self, _: &Accumulator, _: usize) -> bool {
        self.sums.iter().any(|sum| !sum.finished)
    }

    #[inline(always)]
    fn composite<S: Simd>(
        &mut self,
        simd: S,
        inputs: &TileInputs<'_>,
        index: SplatIndex,
        _: &mut Accumulator,
        block: usize,
    ) -> u64 {
        let thresholds = &inputs.thresholds;
        let splat = index.of(inputs.splats);
        let neg_log2_alpha = neg_log2_alphas(simd, inputs, index, block);
        let mut reached = neg_log2_alpha.simd_le(thresholds.neg_log2_floor);
        if thresholds.depth_mode.tests() {
            reached &= inputs.ranges.pixels(simd, block, splat.look.depth);
        }
        let mut reached = reached.to_bitmask() as u32 & self.open;
        if reached == 0 {
            return 0;
        }
        let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
        let alphas = exp2_of_negated(simd, neg_log2_alpha).min(ceiling).to_array();
        let floor = f64::from(thresholds.transmittance_floor);
        let depth = f64::from(thresholds.depth_unit.decode(splat.look.depth));
        let identity = *index.of(self.identities);
        let mut accepted = 0;
        while reached != 0 {
            let lane = reached.trailing_zeros() as usize % BLOCK_PIXELS;
            reached &= reached - 1;
            let sum = &mut self.sums[lane];
            if sum.finished {
                continue;
            }
            let weight = sum.transmittance * f64::from(alphas[lane]);
            let rest = sum.transmittance - weight;
            if rest < floor {
                sum.finished = true;
                continue;
            }
            for (part, color) in sum.color.iter_mut().zip(splat.look.color) {
                *part += weight * f64::from(color);
            }
            let [depths, distances, weights] = &mut sum.means;
            *depths += weight * depth;
            *distances += weight * f64::from(identity.z);
            *weights += weight;
            if !sum.covered {
                sum.nearest_identity = identity;
            }
            if sum.transmittance >= 0.5 {
                sum.median_identity = identity;
                sum.depth = splat.look.depth;
            }
            sum.transmittance = rest;
            sum.covered = true;
            accepted += 1;
        }
        accepted
    }

    fn end(&mut self, accumulator: &mut Accumulator, block: usize) {
        for (lane, sum) in self.sums.iter().enumerate() {
            if self.open >> lane & 1 == 0 {
                continue;
            }
            let t = sum.transmittance as f32;
            accumulator.transmittance[block][lane] = if sum.finished { -t } else { t };
            for (channel, &color) in accumulator.color.iter_mut().zip(&sum.color) {
                channel[block][lane] = color as f32;
            }
            accumulator.median[block][lane] = sum.depth;
            accumulator.covered[block] |= u32::from(sum.covered) << lane;
            let [depths, distances, weights] = sum.means;
            accumulator.means[0][block][lane] = depths as f32;
            accumulator.means[1][block][lane] = weights as f32;
            let tracked = &mut accumulator.tracked;
            tracked.nearest[block][lane] = sum.nearest_identity.sequence;
            tracked.median[block][lane] = sum.median_identity.sequence;
            tracked.median_z[block][lane] = sum.median_identity.z;
            tracked.z_sums[block][lane] = distances as f32;
        }
    }
}
