//! A round: Gaussians that are composited together.

use crate::gaussian::splats::identity::Identity;
use crate::gaussian::splats::splat::Splat;
use crate::raster::gaussian::inputs::TileInputs;
use crate::raster::gaussian::mode::Mode;

/// Gaussians that are composited together, at most [`ROUND`](crate::raster::gaussian::grid::ROUND).
pub(super) struct Round<'a> {
    pub(super) splats: &'a [&'a Splat],
    /// The numbers of the splats.
    pub(super) primitives: &'a [u32],
    /// The numbers of the next round's splats.
    pub(super) next: &'a [u32],
    pub(super) open: OpenBlocks,
    /// True if work is recorded.
    pub(super) is_recorded: bool,
}

impl Round<'_> {
    /// The identity of the round's Gaussian `number`; zeros if the mode does not find Gaussians.
    #[inline(always)]
    pub(super) fn identity<M: Mode>(&self, inputs: &TileInputs<'_>, number: usize) -> Identity {
        let primitive = self.primitives.get(number).filter(|_| M::DEPTH.tracks());
        primitive.map_or(Identity::default(), |&primitive| inputs.identity(primitive))
    }
}

/// The blocks of a tile that are not finished before a round.
#[derive(Clone, Copy)]
pub(super) struct OpenBlocks {
    /// A bit for each.
    pub(super) bits: u64,
    /// The number of them.
    pub(super) count: u8,
    /// The number of rows of pixels with an unfinished one, if work is recorded.
    pub(super) rows: u8,
}
