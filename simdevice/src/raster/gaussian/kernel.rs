//! The kernel that composites a tile's Gaussians, chosen once for a draw.

use super::cut_off::CutOff;
use crate::gaussian::BinnedDraw;
use crate::gaussian::splats::ray_depth::RayDepths;
use crate::gaussian::splats::splat::SplatIndex;
use crate::gaussian::splats::surfel::Surfel;
use crate::state::gaussian::{GaussianPrecision, GaussianState};

/// The kernel that composites a tile, chosen once for a draw.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kernel<'a> {
    /// Volumes in the order of the list, in binary32.
    Fast,
    /// Volumes in the order of the list, in binary16.
    Half,
    /// Any shapes, in the order of the list or each pixel's own.
    Exact {
        /// By group, as the splats, if those are 2D Gaussians.
        surfels: Option<&'a [Vec<Surfel>]>,
        /// The inverse variance of 2D Gaussians' filter, if there is one.
        inverse_low_pass: Option<f64>,
        /// The depths that pixels sort by, if each does so for itself.
        depths: Option<RayDepths<'a>>,
        /// True if sums are kept in binary64 where the order is the list's; each pixel's own order always does so.
        wide_sums: bool,
        /// The shape outside which nothing contributes, if there is one.
        cut_off: Option<CutOff>,
    },
}

impl<'a> Kernel<'a> {
    /// The kernel of a draw.
    pub(crate) fn of(draw: &'a BinnedDraw) -> Self {
        let (surfels, depths) = (draw.surfels(), draw.ray_depths());
        let cut_off = CutOff::of(draw).filter(|_| !draw.are_lists_cut);
        if draw.state.precision == GaussianPrecision::Float16 {
            Self::Half
        } else if surfels.is_none() && depths.is_none() && cut_off.is_none() && !needs_f64_sums(&draw.state) {
            Self::Fast
        } else {
            let variance = f64::from(draw.state.low_pass_variance);
            Self::Exact {
                surfels,
                inverse_low_pass: (variance > 0.0).then(|| 1.0 / variance),
                depths,
                wide_sums: needs_f64_sums(&draw.state),
                cut_off,
            }
        }
    }

    /// The same kernel, except that pixels take the list's order.
    pub(crate) fn in_list_order(self) -> Self {
        match self {
            Self::Exact { surfels, inverse_low_pass, wide_sums, cut_off, .. } => {
                Self::Exact { surfels, inverse_low_pass, depths: None, wide_sums, cut_off }
            }
            other => other,
        }
    }

    /// The shape outside which nothing contributes, if there is one.
    pub(crate) fn cut_off(&self) -> Option<&CutOff> {
        match self {
            Self::Exact { cut_off, .. } => cut_off.as_ref(),
            Self::Fast | Self::Half => None,
        }
    }

    /// The surfel of a splat, if the draw has surfels.
    pub(crate) fn surfel(self, index: SplatIndex) -> Option<&'a Surfel> {
        match self {
            Self::Exact { surfels, .. } => Some(index.of(surfels?)),
            _ => None,
        }
    }
}

/// True if a draw's floors let more layers be seen through each other than the usual ones.
pub(crate) fn needs_f64_sums(state: &GaussianState) -> bool {
    let usual = GaussianState::default();
    state.transmittance_floor < usual.transmittance_floor || state.alpha_floor < usual.alpha_floor
}
