//! GBU (arXiv 2503.23625): a row of pixels is evaluated from left to right in coordinates in which the form is
//! `u^2 + v^2`. Along a row v stays and u grows by the same step, so that a pixel needs an addition and a product; and
//! the pixels that the Gaussian covers are one interval, so that no other pixel is evaluated.

use super::footprint::Footprint;
use super::tile::Pair;
use serde::{Deserialize, Serialize};
use timing::pe::Operations;
use timing::work::TILE_SIDE;

/// The operations of a pixel's form: without the transform, with the first one, and with both; GBU's text, as a digest of
/// it has them.
pub const PAPER_OPERATIONS: [f64; 3] = [11.0, 3.0, 2.0];

/// The operations of a row in [`RowTransform::row`] and [`Row::interval`]: dy, its two products, the first u, the square
/// of v, what is left of the cut, its root, and two ends of a difference and a quotient.
pub const ROW_OPERATIONS: f64 = 11.0;

/// The coordinates of a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowTransform {
    mean: [f64; 2],
    /// The growth of u from a pixel to the next one on its right.
    step: f64,
    /// The growth of u from a row to the next one below.
    shear: f64,
    /// The growth of v from a row to the next one below.
    height: f64,
}

/// A row of pixels in these coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// u at the row's first pixel.
    pub first: f64,
    /// The growth of u from a pixel to the next.
    pub step: f64,
    /// The square of v.
    pub rest: f64,
}

impl RowTransform {
    /// The factor of the conic: `a dx^2 + 2 b dx dy + c dy^2` is the square of `step dx + shear dy` and that of
    /// `height dy`.
    pub fn new(footprint: &Footprint) -> Self {
        let [a, b, c] = footprint.conic();
        let step = a.sqrt();
        let shear = b / step;
        Self { mean: footprint.mean, step, shear, height: (c - shear * shear).max(0.0).sqrt() }
    }

    /// The row whose first pixel has its centre there.
    pub fn row(&self, [x, y]: [f64; 2]) -> Row {
        let dy = y - self.mean[1];
        let v = self.height * dy;
        Row { first: self.step * (x - self.mean[0]) + self.shear * dy, step: self.step, rest: v * v }
    }
}

impl Row {
    /// The forms of the row's pixels, each from the one before by one addition and one product.
    pub fn forms(&self) -> impl Iterator<Item = f64> {
        let (step, rest) = (self.step, self.rest);
        std::iter::successors(Some(self.first), move |u| Some(u + step)).map(move |u| u * u + rest)
    }

    /// The interval of pixels, counted from the first, between which the form is at most a cut; None if there is none.
    pub fn interval(&self, cut: f64) -> Option<[f64; 2]> {
        let reach = cut - self.rest;
        (reach >= 0.0).then(|| [-reach.sqrt(), reach.sqrt()].map(|u| (u - self.first) / self.step))
    }
}

/// The rows and fragments of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RowWork {
    /// Pairs of a Gaussian and a tile with unfinished pixels.
    pub pairs: u64,
    /// Rows of tiles in which such a Gaussian covers a pixel.
    pub rows: u64,
    /// Pixels that it covers.
    pub fragments: u64,
    /// Pixels of the row in which it covers most, summed over the pairs.
    pub longest: u64,
}

impl RowWork {
    /// Counts a Gaussian in a tile.
    pub fn add(&mut self, pair: &Pair) {
        if pair.open.is_empty() {
            return;
        }
        self.pairs += 1;
        self.rows += pair.covered.rows().filter(|&pixels| pixels > 0).count() as u64;
        self.fragments += pair.covered.count();
        self.longest += pair.covered.rows().max().unwrap_or(0);
    }

    /// The share of a tile's pixels that a Gaussian of its list covers.
    pub fn covered(&self) -> f64 {
        self.fragments as f64 / (self.pairs * u64::from(TILE_SIDE * TILE_SIDE)) as f64
    }

    /// The share of the time in which lanes are busy if each has a row of the tile and all wait for the longest.
    pub fn lanes_busy(&self) -> f64 {
        self.fragments as f64 / (self.longest * u64::from(TILE_SIDE)) as f64
    }

    /// Additions and products of the exponent: of this project's PE in whole tiles, in the covered pixels alone, and of
    /// rows.
    pub fn operations(&self, exponent: Operations) -> [f64; 3] {
        let pixel = (exponent.add + exponent.mul) as f64;
        let [_, _, both] = PAPER_OPERATIONS;
        let tiles = self.pairs as f64 * f64::from(TILE_SIDE * TILE_SIDE);
        let by_rows = self.fragments as f64 * both + self.rows as f64 * ROW_OPERATIONS;
        [tiles * pixel, self.fragments as f64 * pixel, by_rows]
    }
}

#[cfg(test)]
mod tests {
    use super::super::mask::Mask;
    use super::*;

    #[test]
    fn a_row_has_the_forms_of_the_conic() {
        let footprint = Footprint { id: 0, mean: [5.3, 7.9], covariance: [6.0, -2.5, 3.0], opacity: 0.8 };
        let [a, b, c] = footprint.conic();
        let transform = RowTransform::new(&footprint);
        for y in 0..16 {
            let row = transform.row([0.5, f64::from(y) + 0.5]);
            for (x, form) in (0..16).zip(row.forms()) {
                let (dx, dy) = (f64::from(x) + 0.5 - 5.3, f64::from(y) + 0.5 - 7.9);
                let direct = a * dx * dx + 2.0 * b * dx * dy + c * dy * dy;
                assert!((form - direct).abs() < 1e-10 * (1.0 + direct), "{x} {y}: {form} {direct}");
            }
        }
    }

    #[test]
    fn an_interval_ends_where_the_form_is_at_the_cut() {
        // A circle of radius 3 around (8, 8): on its middle row from 5 to 11.
        let round = Footprint { id: 0, mean: [8.0; 2], covariance: [1.0, 0.0, 1.0], opacity: 1.0 };
        let transform = RowTransform::new(&round);
        let [left, right] = transform.row([0.0, 8.0]).interval(9.0).unwrap();
        assert!((left - 5.0).abs() < 1e-12 && (right - 11.0).abs() < 1e-12);
        assert_eq!(transform.row([0.0, 12.0]).interval(9.0), None);
    }

    #[test]
    fn lanes_wait_for_the_longest_row() {
        let footprint = Footprint { id: 0, mean: [0.0; 2], covariance: [1.0, 0.0, 1.0], opacity: 1.0 };
        let open = Mask::of(|_, _| true);
        let mut work = RowWork::default();
        // One row of eight pixels and one of four.
        work.add(&Pair { footprint, covered: Mask::of(|x, y| y == 2 && x < 8 || y == 3 && x < 4), open });
        work.add(&Pair { footprint, covered: open, open: Mask::default() });
        assert_eq!(work, RowWork { pairs: 1, rows: 2, fragments: 12, longest: 8 });
        assert!((work.covered() - 12.0 / 256.0).abs() < 1e-12 && (work.lanes_busy() - 12.0 / 128.0).abs() < 1e-12);
        let [tiles, covered, rows] = work.operations(Operations { add: 5, mul: 5, div: 0, exp: 0 });
        assert_eq!([tiles, covered, rows], [2560.0, 120.0, 12.0 * 2.0 + 2.0 * 11.0]);
    }
}
