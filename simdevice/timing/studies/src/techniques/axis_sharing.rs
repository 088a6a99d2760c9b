//! Axis-shared terms (arXiv 2506.07069): the terms of the exponent that depend on the column alone are computed once for
//! a column, and those of the row once for a row. A pixel has one product of the two and two additions left.

use super::tile::Pair;
use serde::{Deserialize, Serialize};
use timing::pe::Operations;

/// The operations of the exponent in this project's PE (`studies/src/pe.rs`): two differences, five products, and three
/// additions, of which one adds the logarithm of the opacity.
pub const EXPONENT: Operations = Operations { add: 5, mul: 5, div: 0, exp: 0 };
/// The terms of a column: `dx`, `a dx^2` by two products, and `b dx`.
const COLUMN: Operations = Operations { add: 1, mul: 3, div: 0, exp: 0 };
/// The terms of a row: `dy`, and `c dy^2` by two products, to which the logarithm of the opacity is added.
const ROW: Operations = Operations { add: 2, mul: 2, div: 0, exp: 0 };
/// Operations that are left for a pixel: the product of `b dx` and `dy`, and the sum of three.
const PIXEL: Operations = Operations { add: 2, mul: 1, div: 0, exp: 0 };

/// The paper's counts of multiply-adds for a pixel's alpha: before sharing, and after it, over a tile of 16x16 pixels.
pub const PAPER_ALPHA: [f64; 2] = [8.0 + 4.0, 2.31 + 2.13];

fn sum(operations: Operations) -> f64 {
    (operations.add + operations.mul) as f64
}

/// The share of additions and multiplications that sharing saves where a Gaussian is evaluated in `pixels`, which have
/// so many different columns and rows: of the exponent, and of all of a pixel's operations.
pub fn saved(pixels: f64, columns: f64, rows: f64) -> [f64; 2] {
    let before = pixels * sum(EXPONENT);
    let after = pixels * sum(PIXEL) + columns * sum(COLUMN) + rows * sum(ROW);
    [EXPONENT, Operations::GAUSSIAN].map(|whole| (before - after) / (pixels * sum(whole)))
}

/// The pixels, columns and rows in which Gaussians are evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sharing {
    /// Pairs of a Gaussian and a tile with unfinished pixels.
    pub pairs: u64,
    /// Pairs of such a Gaussian and a 4x4 block with unfinished pixels that it covers.
    pub blocks: u64,
    /// Pairs of such a Gaussian and a column of these blocks.
    pub block_columns: u64,
    /// Pairs of such a Gaussian and a row of these blocks.
    pub block_rows: u64,
}

impl Sharing {
    /// Counts a Gaussian in a tile.
    pub fn add(&mut self, pair: &Pair) {
        if pair.open.is_empty() {
            return;
        }
        self.pairs += 1;
        let blocks = pair.covered.and(&pair.open).blocks();
        let has = |bits: u16| u64::from(blocks & bits != 0);
        self.blocks += u64::from(blocks.count_ones());
        self.block_columns += (0..4).map(|column| has(0x1111 << column)).sum::<u64>();
        self.block_rows += (0..4).map(|row| has(0xf << (4 * row))).sum::<u64>();
    }

    /// The saved shares if whole tiles are evaluated.
    pub fn in_tiles(&self) -> [f64; 2] {
        saved(256.0, 16.0, 16.0)
    }

    /// The saved shares if only blocks that are reached are evaluated, and these share terms over the tile.
    pub fn in_blocks(&self) -> [f64; 2] {
        let times = |blocks: u64, pixels: f64| blocks as f64 * pixels;
        saved(times(self.blocks, 16.0), times(self.block_columns, 4.0), times(self.block_rows, 4.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::footprint::Footprint;
    use super::super::mask::Mask;
    use super::*;

    #[test]
    fn the_papers_counts_give_its_first_figure() {
        let [before, after] = PAPER_ALPHA;
        assert!((1.0 - after / before - 0.63).abs() < 0.001);
        // Five products and two differences of columns and rows are shared by 16 pixels, and two of each are left.
        assert!((2.0 + 5.0 / 16.0 - 2.31f64).abs() < 0.003 && (2.0 + 2.0 / 16.0 - 2.13f64).abs() < 0.006);
    }

    #[test]
    fn sharing_saves_less_in_fewer_pixels() {
        // In a tile: 1 + 5/16 products and 2 + 3/16 additions of ten operations are left.
        let [exponent, all] = saved(256.0, 16.0, 16.0);
        assert!((exponent - (10.0 - 3.5) / 10.0).abs() < 1e-12 && (all - 6.5 / 21.0).abs() < 1e-12);
        assert!(saved(16.0, 4.0, 4.0)[0] < exponent);
        // A pixel alone shares nothing, and the logarithm is added as before.
        assert!((saved(1.0, 1.0, 1.0)[0] - (10.0 - 11.0) / 10.0).abs() < 1e-12);
    }

    #[test]
    fn shared_terms_sum_to_the_exponent() {
        let ([a, b, c], log_opacity) = ([-0.2, 0.07, -0.1], -0.4);
        let (dx, dy) = ([0.5f64, 1.5, -3.0], [2.0f64, -1.25, 0.75]);
        let columns = dx.map(|dx| [a * dx * dx, b * dx]);
        let rows = dy.map(|dy| [c * dy * dy + log_opacity, dy]);
        for (dx, [square, product]) in dx.into_iter().zip(columns) {
            for [rest, dy] in rows {
                let direct = (a * dx + b * dy) * dx + c * dy * dy + log_opacity;
                assert!((square + product * dy + rest - direct).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn columns_and_rows_of_blocks_are_counted_once() {
        let footprint = Footprint { id: 0, mean: [0.0; 2], covariance: [1.0, 0.0, 1.0], opacity: 1.0 };
        let open = Mask::of(|_, _| true);
        let mut sharing = Sharing::default();
        // Two blocks beside each other, and one below the first.
        sharing.add(&Pair { footprint, covered: Mask::of(|x, y| (x < 8 && y < 4) || (x < 4 && y < 8)), open });
        assert_eq!(sharing, Sharing { pairs: 1, blocks: 3, block_columns: 2, block_rows: 2 });
        sharing.add(&Pair { footprint, covered: open, open: Mask::default() });
        assert_eq!(sharing.pairs, 1);
    }
}
