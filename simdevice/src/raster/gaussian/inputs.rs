//! The inputs and the account of compositing a tile, and the kernel that does it.
//!
//! A draw may let the plain kernel leave something inexact ([`Approximation`]).
//!
//! *Powers of two of fewer terms.* An alpha that errs by a part e of it changes a pixel by that part of what the
//! Gaussian contributes, times the difference of two colours at most; all contributions add up to one.
//!
//! *TransmittanceBits that is left.* What is behind a transmittance of T contributes T at most, whatever it is. A block
//! all of whose pixels have no more than the budget is looked at no further. (To leave out what is faint in front of
//! others, too, needs a sum for each block and a bound of each Gaussian's alpha in it; that took as long as it saved.)

use super::accumulator::{NOT_TERMINATED, TransmittanceBits};
use super::cut_off::CutOff;
use crate::format::depth::DepthEncoding;
use crate::gaussian::BinnedDraw;
use crate::gaussian::depth::DepthTrend;
use crate::gaussian::identity::Identity;
use crate::gaussian::ray_depth::RayDepths;
use crate::gaussian::splat::{Splat, locate};
use crate::gaussian::surfel::Surfel;
use crate::simd::exp2::{CUBIC, QUADRATIC, exp2_of_negated};
use crate::state::gaussian::{GaussianApproximation, GaussianPrecision, GaussianState};
use crate::stats::optimizations::Optimizations;
use fearless_simd::{Simd, f32x16};
use std::slice;

/// Powers of two are formed down to this one.
const MOST_FALL: f64 = 126.0;

/// A bound of the error of exponents of alphas that are at least a half.
const CAP_MARGIN: f64 = 1e-4;

/// The kernel's use of depths: a constant, so that what isn't done costs nothing. Each from [`NO_DEPTH`] on does what
/// those from there to it do; before it are [`FAST_POWERS`] and [`FASTER_POWERS`].
pub(super) type DepthMode = u8;
/// Nothing: it only finishes the pixels that some Gaussian reaches.
pub(super) const FIND_REACHED: DepthMode = 0;
/// Composites.
pub(super) const NO_DEPTH: DepthMode = 3;
/// Leaves out what fails the test.
pub(super) const TEST_DEPTH: DepthMode = 4;
/// Also finds the median.
pub(super) const FIND_MEDIAN: DepthMode = 5;
/// And what the mean is made of.
pub(super) const FIND_MEAN: DepthMode = 6;

/// The constants of a draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thresholds {
    /// Minus the base-2 logarithm of the alpha floor: no Gaussian contributes where its alpha has fallen further.
    pub(super) most_fall: f32,
    /// For modes that compare alpha itself.
    pub(super) alpha_floor: f32,
    pub(super) alpha_ceiling: f32,
    /// The base-2 logarithm of the opacity above which an alpha may be rounded to more than the ceiling.
    pub(super) least_capped: f32,
    pub(super) transmittance_floor: f32,
    /// The encoding of depths as numbers.
    pub(super) depth_unit: DepthEncoding,
    /// The mode, for code that is the same for all of them: where time matters it is a constant.
    pub(super) depth_mode: DepthMode,
}

impl Thresholds {
    pub(super) fn new(draw: &BinnedDraw, depth_mode: DepthMode) -> Self {
        let state = &draw.state;
        // Where there is no floor, less than the least normal number is nothing. No alpha reaches a floor above the
        // ceiling.
        let most_fall = if state.alpha_floor <= state.alpha_ceiling {
            (-f64::from(state.alpha_floor).log2()).min(MOST_FALL) as f32
        } else {
            f32::NEG_INFINITY
        };
        Self {
            depth_unit: draw.depth_unit,
            depth_mode,
            most_fall,
            alpha_floor: state.alpha_floor,
            alpha_ceiling: state.alpha_ceiling,
            least_capped: (f64::from(state.alpha_ceiling).log2() - CAP_MARGIN) as f32,
            transmittance_floor: state.transmittance_floor,
        }
    }
}

/// The kernel that composites a tile, chosen once for a draw.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kernel<'a> {
    /// Volumes in the order of the list, in binary32.
    Fast,
    /// Volumes in the order of the list, in binary16.
    Half,
    /// Any shapes, in the order of the list or each pixel's own.
    Exact {
        /// By batch, as the splats, if those are 2D Gaussians.
        surfels: Option<&'a [Vec<Surfel>]>,
        /// The inverse variance of 2D Gaussians' filter, if there is one.
        inverse_low_pass: Option<f64>,
        /// The depths that pixels sort by, if each does so for itself.
        depths: Option<RayDepths<'a>>,
        /// True if sums are kept in binary64 where the order is the list's; each pixel's own order always does so.
        wide_sums: bool,
        /// The shape outside which nothing contributes, if there is one.
        cut_off: Option<CutOff>,
        /// By batch, as the splats, if which they are is tracked. They are in the order of the list then.
        identities: Option<&'a [Vec<Identity>]>,
    },
}

impl<'a> Kernel<'a> {
    pub(super) fn of(draw: &'a BinnedDraw) -> Self {
        let (surfels, depths) = (draw.surfels(), draw.ray_depths());
        let cut_off = CutOff::of(draw).filter(|_| !draw.are_lists_cut);
        let identities = draw.identities();
        let is_plain = cut_off.is_none() && identities.is_none();
        if draw.state.precision == GaussianPrecision::Float16 {
            Self::Half
        } else if surfels.is_none() && depths.is_none() && is_plain && !needs_f64_sums(&draw.state) {
            Self::Fast
        } else {
            let variance = f64::from(draw.state.low_pass_variance);
            Self::Exact {
                surfels,
                inverse_low_pass: (variance > 0.0).then(|| 1.0 / variance),
                depths,
                wide_sums: needs_f64_sums(&draw.state),
                cut_off,
                identities,
            }
        }
    }

    /// The same kernel, except that pixels take the list's order and nothing is tracked.
    pub(super) fn in_list_order(self) -> Self {
        match self {
            Self::Exact { surfels, inverse_low_pass, wide_sums, cut_off, .. } => {
                Self::Exact { surfels, inverse_low_pass, depths: None, wide_sums, cut_off, identities: None }
            }
            other => other,
        }
    }

    /// The shape outside which nothing contributes, if there is one.
    pub(super) fn cut_off(&self) -> Option<&CutOff> {
        match self {
            Self::Exact { cut_off, .. } => cut_off.as_ref(),
            Self::Fast | Self::Half => None,
        }
    }

    pub(super) fn surfel(self, (batch, place): (usize, usize)) -> Option<&'a Surfel> {
        match self {
            Self::Exact { surfels, .. } => Some(&surfels?[batch][place]),
            _ => None,
        }
    }
}

/// True if a draw's floors let more layers be seen through each other than the usual ones.
pub(super) fn needs_f64_sums(state: &GaussianState) -> bool {
    let usual = GaussianState::default();
    state.transmittance_floor < usual.transmittance_floor || state.alpha_floor < usual.alpha_floor
}

/// Composites with powers of two of a cubic.
pub(super) const FAST_POWERS: DepthMode = 1;
/// Composites with powers of two of a parabola.
pub(super) const FASTER_POWERS: DepthMode = 2;

/// The approximations of the plain kernel in a draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Approximation {
    /// [`NO_DEPTH`], or what is cheaper.
    pub(super) powers: DepthMode,
    /// Blocks with no more light are finished.
    pub(super) light: TransmittanceBits,
}

impl Approximation {
    /// As exactly as it can.
    pub(super) const EXACT: Self = Self { powers: NO_DEPTH, light: NOT_TERMINATED };

    /// As a state allows it in a mode; all but the plain one are exact.
    pub(super) fn of(state: &GaussianState, mode: &Kernel<'_>, depth: DepthMode) -> Self {
        if depth != NO_DEPTH || !matches!(mode, Kernel::Fast) {
            return Self::EXACT;
        }
        let GaussianApproximation { exponential_error, contribution_budget } = state.approximation;
        Self {
            powers: if exponential_error >= QUADRATIC.error {
                FASTER_POWERS
            } else if exponential_error >= CUBIC.error {
                FAST_POWERS
            } else {
                NO_DEPTH
            },
            light: TransmittanceBits::of(contribution_budget),
        }
    }
}

/// 2 to the power of `-fall`, as a mode has it.
#[inline(always)]
pub(super) fn power<S: Simd>(simd: S, mode: DepthMode, fall: f32x16<S>) -> f32x16<S> {
    match mode {
        FAST_POWERS => CUBIC.of_negated(simd, fall),
        FASTER_POWERS => QUADRATIC.of_negated(simd, fall),
        _ => exp2_of_negated(simd, fall),
    }
}

/// A tile's Gaussians, and the constants of compositing them.
#[derive(Clone, Copy)]
pub(super) struct TileInputs<'a> {
    pub(super) splats: &'a [Vec<Splat>],
    pub(super) mode: Kernel<'a>,
    pub(super) list: &'a [u32],
    /// The work that is left out.
    pub(super) optimizations: Optimizations,
    pub(super) trend: DepthTrend,
    /// Half of a panorama's period: see [`BinnedDraw::half_period`].
    pub(super) half_period: f64,
    pub(super) corner: [u32; 2],
    pub(super) thresholds: Thresholds,
    pub(super) way: Approximation,
}

impl<'a> TileInputs<'a> {
    #[inline(always)]
    pub(super) fn splat(&self, primitive: u32) -> &'a Splat {
        let (batch, place) = locate(primitive);
        &self.splats[batch][place]
    }

    /// A primitive's splat, which is on its way.
    #[inline(always)]
    pub(super) fn prefetched(&self, primitive: u32) -> &'a Splat {
        let splat = self.splat(primitive);
        devmem::prefetch(slice::from_ref(splat));
        splat
    }
}

/// The account of compositing a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TileCounts {
    /// Entries of the tile's list, as far as there was need of it.
    pub(super) listed: u64,
    pub(super) pairs: u64,
    pub(super) items: u64,
    /// Blocks that were not finished, summed over the pairs.
    pub(super) open: u64,
    pub(super) contributions: u64,
    pub(super) tiles_hidden: u64,
    pub(super) blocks_hidden: u64,
    pub(super) blocks_left_out: u64,
    /// The number of hidden Gaussians that end a list, if work is recorded.
    pub(super) hidden_rest: u32,
}

impl TileCounts {
    pub(super) fn add(&mut self, more: &Self) {
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
