//! The inputs and the account of compositing a tile.

use super::approximation::Approximation;
use super::depth_ranges::DepthRanges;
use super::kernel::Kernel;
use super::mode::{DepthMode, Exponential};
use crate::format::depth::DepthEncoding;
use crate::gaussian::BinnedDraw;
use crate::gaussian::splats::identity::Identity;
use crate::gaussian::splats::splat::{Splat, SplatIndex};
use crate::gaussian::view::center_depth::DepthTrend;
use crate::stats::optimizations::Optimizations;
use std::slice;

/// The greatest negated exponent of a power of two that is formed.
const GREATEST_NEG_LOG2: f64 = 126.0;

/// A bound of the error of exponents of alphas that are at least a half.
const CAP_MARGIN: f64 = 1e-4;

/// The constants of a draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Thresholds {
    /// Minus the base-2 logarithm of the alpha floor: no Gaussian contributes where that of its alpha is greater.
    pub(crate) neg_log2_floor: f32,
    /// For modes that compare alpha itself.
    pub(crate) alpha_floor: f32,
    pub(crate) alpha_ceiling: f32,
    /// The base-2 logarithm of the opacity above which an alpha may be rounded to more than the ceiling.
    pub(crate) least_capped: f32,
    pub(crate) transmittance_floor: f32,
    /// The encoding of depths as numbers.
    pub(crate) depth_unit: DepthEncoding,
    /// The use of depths and the exactness of powers, for code that is the same for all modes: where time matters they are
    /// constants.
    pub(crate) depth_mode: DepthMode,
    pub(crate) exponential: Exponential,
}

impl Thresholds {
    pub(crate) fn new(draw: &BinnedDraw, depth_mode: DepthMode) -> Self {
        let state = &draw.state;
        // Where there is no floor, less than the least normal number is nothing. No alpha reaches a floor above the
        // ceiling.
        let neg_log2_floor = if state.alpha_floor <= state.alpha_ceiling {
            (-libm::log2(state.alpha_floor.into())).min(GREATEST_NEG_LOG2) as f32
        } else {
            f32::NEG_INFINITY
        };
        Self {
            depth_unit: draw.depth_unit,
            depth_mode,
            exponential: Exponential::Exact,
            neg_log2_floor,
            alpha_floor: state.alpha_floor,
            alpha_ceiling: state.alpha_ceiling,
            least_capped: (libm::log2(state.alpha_ceiling.into()) - CAP_MARGIN) as f32,
            transmittance_floor: state.transmittance_floor,
        }
    }
}

/// A tile's Gaussians, and the constants of compositing them.
#[derive(Clone, Copy)]
pub(crate) struct TileInputs<'a> {
    pub(crate) splats: &'a [Vec<Splat>],
    /// By group, as the splats, if the Gaussians that pixels show are found.
    pub(crate) identities: Option<&'a [Vec<Identity>]>,
    pub(crate) kernel: Kernel<'a>,
    /// The numbers of the splats, in the order of the draw.
    pub(crate) list: &'a [u32],
    /// The work that is left out.
    pub(crate) optimizations: Optimizations,
    pub(crate) trend: DepthTrend,
    /// Half of a panorama's period: see [`BinnedDraw::half_period`].
    pub(crate) half_period: f64,
    /// The upper left corner of the tile, in pixels.
    pub(crate) corner: [u32; 2],
    pub(crate) thresholds: Thresholds,
    pub(crate) approximation: Approximation,
    /// The depths that pass the depth test.
    pub(crate) ranges: &'a DepthRanges,
}

impl<'a> TileInputs<'a> {
    /// The splat with a number.
    #[inline(always)]
    pub(crate) fn splat(&self, primitive: u32) -> &'a Splat {
        SplatIndex::new(primitive).of(self.splats)
    }

    /// A primitive's splat, which is on its way.
    #[inline(always)]
    pub(crate) fn prefetched(&self, primitive: u32) -> &'a Splat {
        let splat = self.splat(primitive);
        devmem::prefetch(slice::from_ref(splat));
        splat
    }

    /// The identity of a primitive's Gaussian; zeros if identities are not found.
    #[inline(always)]
    pub(crate) fn identity(&self, primitive: u32) -> Identity {
        self.identities.map_or(Identity::default(), |identities| *SplatIndex::new(primitive).of(identities))
    }
}

/// The account of compositing a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TileCounts {
    /// Entries of the tile's list, as far as there was need of it.
    pub(crate) listed: u64,
    pub(crate) pairs: u64,
    pub(crate) items: u64,
    /// Blocks that were not finished, summed over the pairs.
    pub(crate) open: u64,
    pub(crate) contributions: u64,
    pub(crate) tiles_hidden: u64,
    pub(crate) blocks_hidden: u64,
    pub(crate) blocks_left_out: u64,
    /// The number of hidden Gaussians that end a list, if work is recorded.
    pub(crate) hidden_rest: u32,
}

impl TileCounts {
    /// Adds the counts of another part of the tile's list.
    pub(crate) fn add(&mut self, more: &Self) {
        self.listed += more.listed;
        self.pairs += more.pairs;
        self.items += more.items;
        self.open += more.open;
        self.contributions += more.contributions;
        self.tiles_hidden += more.tiles_hidden;
        self.blocks_hidden += more.blocks_hidden;
        self.blocks_left_out += more.blocks_left_out;
        self.hidden_rest += more.hidden_rest;
    }
}
