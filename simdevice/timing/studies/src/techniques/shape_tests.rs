//! GSCore (doi 10.1145/3620666.3651385): lists by a box along the ellipse's axes instead of a square, subtiles that a
//! Gaussian does not touch are skipped, and lists are sorted in chunks, so that chunks after the tile's end are not.

use super::footprint::{Footprint, OrientedBox, Rectangle};
use super::tile::View;
use serde::{Deserialize, Serialize};
use timing::work::{DrawWork, TILE_SIDE};

const SIDE: f64 = TILE_SIDE as f64;
/// The ratio of the longer axis to the shorter one above which the box is tested; others are binned by their square. A
/// re-implementation has this number and [`CHUNK`].
const LEAST_RATIO: f64 = 2.0;
/// The Gaussians of a chunk that is sorted at once.
pub const CHUNK: u32 = 256;

/// Pairs of Gaussians with tiles and with parts of these, by each test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShapeTests {
    /// Pairs with tiles by the squares of the original code.
    pub squares: u64,
    /// Pairs with tiles by boxes along the axes of each ellipse.
    pub boxes: u64,
    /// Pairs with tiles by boxes where the ellipse is long, and by squares elsewhere.
    pub long_boxes: u64,
    /// Pairs with tiles by the exact test.
    pub exact: u64,
    /// Pairs with subtiles of 8x8 pixels that the box of a pair of `boxes` touches.
    pub box_subtiles_8: u64,
    /// The same with subtiles of 4x4 pixels.
    pub box_subtiles_4: u64,
    /// Pairs with blocks of 4x4 pixels of the exact test.
    pub exact_blocks: u64,
}

/// The number of subtiles of a tile for which a condition holds.
fn subtiles(corner: [f64; 2], side: f64, condition: impl Fn(&Rectangle) -> bool) -> u64 {
    let count = (SIDE / side) as u32;
    let place = |number: u32| [number % count, number / count];
    let subtile = |number: u32| {
        let at = place(number);
        Rectangle::pixels([0, 1].map(|axis| corner[axis] + f64::from(at[axis]) * side), side)
    };
    (0..count * count).filter(|&number| condition(&subtile(number))).count() as u64
}

impl ShapeTests {
    /// The pairs of a view.
    pub fn of(view: &View) -> Self {
        let tile = |corner| Rectangle::pixels(corner, SIDE);
        let boxed = |footprint: &Footprint, corner| OrientedBox::new(footprint).overlaps(&tile(corner));
        let boxes = view.lists(Footprint::square, boxed);
        let exact = view.exact_lists();
        let mut tests = Self {
            squares: view.pairs(Footprint::square, |_, _| true),
            boxes: boxes.iter().map(|list| list.places.len() as u64).sum(),
            long_boxes: view.pairs(Footprint::square, |footprint, corner| {
                footprint.elongation() <= LEAST_RATIO || boxed(footprint, corner)
            }),
            exact: exact.iter().map(|list| list.places.len() as u64).sum(),
            ..Self::default()
        };
        for list in &boxes {
            for &place in &list.places {
                let oriented = OrientedBox::new(&view.footprints[place as usize]);
                let touches = |rectangle: &Rectangle| oriented.overlaps(rectangle);
                tests.box_subtiles_8 += subtiles(list.corner(), 8.0, touches);
                tests.box_subtiles_4 += subtiles(list.corner(), 4.0, touches);
            }
        }
        for list in &exact {
            for &place in &list.places {
                let footprint = view.footprints[place as usize];
                tests.exact_blocks += subtiles(list.corner(), 4.0, |rectangle| {
                    footprint.reaches(&Rectangle::centres(rectangle.low, 4.0))
                });
            }
        }
        tests
    }
}

/// The entries of lists that are sorted, with and without the chunks that no tile reaches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChunkSorting {
    /// Entries of all lists.
    pub listed: u64,
    /// Entries of the chunks that a tile begins before its pixels are finished.
    pub sorted: u64,
}

impl ChunkSorting {
    /// The entries of a draw.
    pub fn of(draw: &DrawWork) -> Self {
        let sorted = |listed: u32, needed: u32| u64::from(needed.next_multiple_of(CHUNK).min(listed));
        Self { listed: draw.pairs(), sorted: draw.tiles.iter().map(|tile| sorted(tile.listed, tile.needed())).sum() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::work::TileWork;

    #[test]
    fn a_diagonal_needle_touches_few_tiles_of_its_square() {
        // Deviations of 30 and 1 pixels along the diagonal, in the middle of 12x12 tiles.
        let (long, short) = (900.0, 1.0);
        let covariance = [0.5 * (long + short), 0.5 * (long - short), 0.5 * (long + short)];
        let needle = Footprint { id: 0, mean: [96.0; 2], covariance, opacity: 1.0 };
        let tests = ShapeTests::of(&View { size: [192, 192], footprints: vec![needle] });
        assert_eq!(tests.squares, 144);
        assert_eq!(tests.long_boxes, tests.boxes);
        assert!(tests.boxes < 48 && tests.exact <= tests.boxes + 4, "{tests:?}");
        assert!(tests.box_subtiles_4 < 16 * tests.boxes && tests.box_subtiles_8 < 4 * tests.boxes);
        assert!(4 * tests.box_subtiles_8 >= tests.box_subtiles_4);
    }

    #[test]
    fn a_round_gaussian_is_binned_by_its_square() {
        let round = Footprint { id: 0, mean: [40.0; 2], covariance: [25.0, 0.0, 25.0], opacity: 1.0 };
        let tests = ShapeTests::of(&View { size: [80, 80], footprints: vec![round] });
        assert_eq!([tests.squares, tests.long_boxes], [9, 9]);
    }

    #[test]
    fn chunks_after_the_end_are_not_sorted() {
        let mut ended = TileWork::open([0, 0], 1000);
        ended.runs[0].primitives = 300;
        let draw = DrawWork { tiles: vec![ended, TileWork::open([1, 0], 10)], ..DrawWork::default() };
        assert_eq!(ChunkSorting::of(&draw), ChunkSorting { listed: 1010, sorted: 512 + 10 });
    }
}
