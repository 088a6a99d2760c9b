//! GCC (arXiv 2507.15300): preprocessing of a Gaussian only if it is needed, and each Gaussian loaded once.

use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use timing::stages::{self, GaussianCounts};
use timing::work::DrawWork;

/// The Gaussians of a draw that its lists name, and those that were fetched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Conditional {
    /// Gaussians in at least one list: those whose colours stage 1 computes.
    pub listed: u64,
    /// Gaussians that at least one tile fetched before its pixels were finished.
    pub fetched: u64,
    /// Fetches: pairs of such a tile and a Gaussian.
    pub fetches: u64,
}

impl Conditional {
    /// The Gaussians of a draw with ids; None if it has none.
    pub fn of(draw: &DrawWork) -> Option<Self> {
        let (mut listed, mut fetched): (HashSet<u32>, HashSet<u32>) = Default::default();
        for tile in &draw.tiles {
            if tile.ids.len() != tile.listed as usize {
                return None;
            }
            listed.extend(&tile.ids);
            fetched.extend(tile.ids.iter().take(tile.needed() as usize));
        }
        Some(Self { listed: listed.len() as u64, fetched: fetched.len() as u64, fetches: draw.needed_pairs() })
    }

    /// The share of preprocessed Gaussians that no tile fetched.
    pub fn unused(&self) -> f64 {
        1.0 - self.fetched as f64 / self.listed as f64
    }

    /// The number of times that a fetched Gaussian is loaded.
    pub fn loads(&self) -> f64 {
        self.fetches as f64 / self.fetched as f64
    }

    /// The share of stage 1's bytes that are saved if colours are computed only for fetched Gaussians, of `read`
    /// Gaussians with harmonics of this degree.
    pub fn saved_bytes(&self, read: u64, degree: u32) -> f64 {
        let bytes = |drawn: u64| {
            let counts = GaussianCounts { read, projected: read, drawn, degree, ..GaussianCounts::default() };
            stages::gaussian(&counts)[0].bytes
        };
        1.0 - bytes(self.fetched) / bytes(self.listed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::work::TileWork;

    #[test]
    fn what_no_tile_fetched_is_unused() {
        let tile = |ids: &[u32], needed: u32| {
            let mut tile = TileWork::open([0, 0], ids.len() as u32);
            tile.runs[0].primitives = needed;
            tile.ids = ids.to_vec();
            tile
        };
        let mut draw = DrawWork { tiles: vec![tile(&[4, 5, 6, 7], 2), tile(&[5, 6], 1)], ..DrawWork::default() };
        let conditional = Conditional::of(&draw).unwrap();
        assert_eq!(conditional, Conditional { listed: 4, fetched: 2, fetches: 3 });
        assert_eq!([conditional.unused(), conditional.loads()], [0.5, 1.5]);
        // 12 and 80 bytes of each that is read, and 192 of each colour of degree 3.
        let saved = conditional.saved_bytes(10, 3);
        assert!((saved - 2.0 * 192.0 / (920.0 + 4.0 * 192.0)).abs() < 1e-12);
        draw.tiles[1].ids.clear();
        assert_eq!(Conditional::of(&draw), None);
    }
}
