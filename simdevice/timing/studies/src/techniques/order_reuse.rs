//! Neo (arXiv 2511.12930): the list of a tile in the frame before, reused. It counts how many Gaussians of a tile's list
//! stay in it until the next frame, and by how many places they move.

use super::tile::{List, View};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Neo's tiles keep more than this share of their Gaussians.
pub const KEPT_SHARE: f64 = 0.78;

/// Tiles and Gaussians of two frames.
#[derive(Clone, Debug, Default)]
pub struct OrderReuse {
    /// The share of each tile's Gaussians that are in the same tile's list of the next frame.
    kept: Vec<f64>,
    /// The places by which each of these moves in the whole list.
    moved: Vec<u32>,
    /// The places by which each moves among those that stay: the work of repairing the order.
    moved_among_kept: Vec<u32>,
}

/// The figures of all pairs of frames of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReuseFigures {
    /// Degrees by which the camera turns between two frames.
    pub step_degrees: f64,
    /// Pairs of frames.
    pub steps: u32,
    /// The share of tiles that keep more than [`KEPT_SHARE`].
    pub tiles_above: f64,
    /// The share that nine of ten tiles exceed.
    pub kept_by_nine_of_ten: f64,
    /// The 99th percentile of the places by which Gaussians move in the whole list.
    pub moved: u32,
    /// The same among those that stay.
    pub moved_among_kept: u32,
}

/// The value below which a share of sorted values is.
fn quantile<T: Copy + Default>(sorted: &[T], share: f64) -> T {
    let index = (sorted.len() as f64 * share) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or_default()
}

impl OrderReuse {
    /// Adds a tile's lists of two frames, of ids in depth order.
    pub fn add_tile(&mut self, before: &[u32], after: &[u32]) {
        if before.is_empty() {
            return;
        }
        let places: HashMap<u32, usize> = after.iter().enumerate().map(|(place, &id)| (id, place)).collect();
        // The places before and after of those that stay, in the order before.
        let kept: Vec<_> =
            before.iter().enumerate().filter_map(|(place, id)| Some((place, *places.get(id)?))).collect();
        self.kept.push(kept.len() as f64 / before.len() as f64);
        self.moved.extend(kept.iter().map(|(before, after)| before.abs_diff(*after) as u32));
        let mut order: Vec<_> = (0..kept.len()).collect();
        order.sort_by_key(|&rank| kept[rank].1);
        self.moved_among_kept.extend(order.iter().enumerate().map(|(after, &before)| after.abs_diff(before) as u32));
    }

    /// Adds all tiles of two frames of the same size.
    pub fn add_frames(&mut self, frames: [&View; 2], lists: [&[List]; 2]) {
        let ids = |frame: usize, tile: usize| -> Vec<u32> {
            let places = lists[frame][tile].places.iter();
            places.map(|&place| frames[frame].footprints[place as usize].id).collect()
        };
        for tile in 0..lists[0].len().min(lists[1].len()) {
            self.add_tile(&ids(0, tile), &ids(1, tile));
        }
    }

    /// The figures of what was added.
    pub fn figures(&self, step_degrees: f64, steps: u32) -> ReuseFigures {
        let (mut kept, mut moved, mut among) = (self.kept.clone(), self.moved.clone(), self.moved_among_kept.clone());
        kept.sort_by(f64::total_cmp);
        moved.sort_unstable();
        among.sort_unstable();
        let above = kept.iter().filter(|&&share| share > KEPT_SHARE).count();
        ReuseFigures {
            step_degrees,
            steps,
            tiles_above: above as f64 / kept.len().max(1) as f64,
            kept_by_nine_of_ten: quantile(&kept, 0.1),
            moved: quantile(&moved, 0.99),
            moved_among_kept: quantile(&among, 0.99),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_permutation_moves_its_members() {
        let mut reuse = OrderReuse::default();
        // 7 moves from the front to the end, and the others by one place each.
        reuse.add_tile(&[7, 1, 2, 3], &[1, 2, 3, 7]);
        assert_eq!(
            (reuse.kept.as_slice(), reuse.moved_among_kept.as_slice()),
            ([1.0].as_slice(), [1, 1, 1, 3].as_slice())
        );
        assert_eq!(reuse.moved, [3, 1, 1, 1]);
    }

    #[test]
    fn insertions_move_places_but_no_order() {
        let mut reuse = OrderReuse::default();
        // Two come in front, and one of four goes.
        reuse.add_tile(&[1, 2, 3, 4], &[8, 9, 1, 2, 4]);
        assert_eq!(reuse.kept, [0.75]);
        assert_eq!(reuse.moved, [2, 2, 1]);
        assert_eq!(reuse.moved_among_kept, [0, 0, 0]);
        reuse.add_tile(&[], &[1]);
        reuse.add_tile(&[5], &[5]);
        let figures = reuse.figures(1.0, 2);
        assert_eq!([figures.tiles_above, figures.kept_by_nine_of_ten], [0.5, 0.75]);
        assert_eq!((figures.moved, figures.moved_among_kept), (2, 0));
    }
}
