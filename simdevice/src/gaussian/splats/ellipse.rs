//! The ellipse outside of which a Gaussian stays below the alpha floor, and the tiles and blocks that it reaches: by exact tests
//! against rectangles of pixel centres.

use super::footprint::{TileFootprint, TileSpan};
use crate::gaussian::view::visible::Visible;
use crate::limits::TILE_SIZE;

/// The ellipse `d^T S^-1 d <= extent` about `mean`, with `S = [a, b; b, c]` in px^2, in the form from which its spans
/// are computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    /// The centre in pixels.
    pub mean: [f64; 2],
    /// The half extents in x and y: `sqrt(a extent)` and `sqrt(c extent)`.
    pub half: [f64; 2],
    /// The horizontal middle at height `d.y` is at `d.x = slope d.y`: `b / c`.
    pub slope: f64,
    /// The half width at height `d.y` is `sqrt(narrowing (half.y^2 - d.y^2))`: `det / c^2`.
    pub narrowing: f64,
    /// The height at which it reaches furthest to the right: `b sqrt(extent / a)`.
    pub peak: f64,
}

/// The first and the last integer `p` of `first..=last` with `low <= p + 0.5 <= high`.
///
/// Integers stay in binary64 here, because conversions would cost more than the rest.
#[inline(always)]
fn centres(low: f64, high: f64, first: f64, last: f64) -> Option<[f64; 2]> {
    // Clamped to a pixel beyond the limits, the values are small enough for `floor` below.
    let low = smaller(larger(low - 0.5, first), last + 1.0);
    let high = larger(smaller(high - 0.5, last), first - 1.0);
    let [low, high] = [-floor(-low), floor(high)];
    (low <= high).then_some([low, high])
}

/// The greatest integer that is not greater than `value`, whose magnitude is below 2^51.
#[inline(always)]
fn floor(value: f64) -> f64 {
    // At this magnitude binary64 has no bits for a fraction, so the addition rounds.
    const WHOLE: f64 = (3u64 << 51) as f64;
    let nearest = (value + WHOLE) - WHOLE;
    if nearest > value { nearest - 1.0 } else { nearest }
}

/// The larger of the two; `b` if either is NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of the two; `b` if either is NaN.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The tile that contains pixel number `pixel`, an integer below 2^20. Adding 1.5 * 2^52 rounds a number to an integer
/// in the low bits.
#[inline(always)]
fn tile_of(pixel: f64) -> u16 {
    const PER_PIXEL: f64 = 1.0 / TILE_SIZE as f64;
    // The tile's centre maps to the tile's number, and all its pixels round to it.
    let middle = pixel * PER_PIXEL - 0.5 * (1.0 - PER_PIXEL);
    (middle + (3u64 << 51) as f64).to_bits() as u16
}

/// The tiles of a row that contain the pixels from the first to the last. Limits on the framebuffer's size make their numbers fit into
/// 16 bits.
#[inline(always)]
fn tiles_of([first, last]: [f64; 2]) -> TileSpan {
    TileSpan { first: tile_of(first), end: tile_of(last) + 1 }
}

impl Ellipse {
    /// The tiles whose visible pixel centres the ellipse may contain, or `None` if there are none. Spans that do not
    /// fit inline go to `others`.
    ///
    /// The ellipse is convex, so that in each row of tiles the reached ones are consecutive, and the columns that it
    /// spans between the row's first and last pixel centres give them exactly. The number of tiles in its bounding box
    /// that it does not reach is added to `beside`; without `beside`, the whole box is taken.
    #[inline(always)]
    pub(crate) fn reach(
        &self,
        visible: &Visible,
        others: &mut Vec<TileSpan>,
        beside: Option<&mut u64>,
    ) -> Option<TileFootprint> {
        let [x, y] = self.mean;
        let [half_x, half_y] = self.half;
        let ([first_x, last_x], [first_y, last_y]) = (visible.pixels(0), visible.pixels(1));
        let columns = centres(x - half_x, x + half_x, first_x, last_x);
        let rows = centres(y - half_y, y + half_y, first_y, last_y);
        let (Some([left, right]), Some([top, bottom])) = (columns, rows) else {
            return None;
        };
        let row = tile_of(top);
        let rows = tile_of(bottom) - row + 1;
        let clipped = left == first_x || right == last_x || top == first_y || bottom == last_y;
        let boxed = tiles_of([left, right]);
        let one = boxed.end - boxed.first == 1 && rows == 1 && !clipped;
        let mut reach = TileFootprint::new(row, rows, others);
        let Some(beside) = beside.filter(|_| !one) else {
            for number in 0..rows {
                reach.set(others, number, boxed);
            }
            return Some(reach);
        };
        let tile = f64::from(TILE_SIZE);
        let mut reached = 0;
        let mut row_top = f64::from(row) * tile;
        for number in 0..rows {
            let in_row = [larger(top, row_top), smaller(bottom, row_top + (tile - 1.0))];
            row_top += tile;
            if let Some(span) = self.span_between(in_row, [first_x, last_x]) {
                reached += u64::from(span.end - span.first);
                reach.set(others, number, span);
            }
        }
        let all = u64::from(rows) * u64::from(boxed.end - boxed.first);
        *beside += all.saturating_sub(reached);
        (reached > 0).then_some(reach)
    }

    /// The rows of tiles that may have visible pixel centres of the ellipse: the first one, and one past the last.
    pub(crate) fn rows(&self, visible: &Visible) -> Option<[u16; 2]> {
        let [first, last] = visible.pixels(1);
        let [top, bottom] = centres(self.mean[1] - self.half[1], self.mean[1] + self.half[1], first, last)?;
        Some([tile_of(top), tile_of(bottom) + 1])
    }

    /// The tiles of one of its [rows](Ellipse::rows) whose visible pixel centres the ellipse may contain.
    pub(crate) fn span(&self, visible: &Visible, row: u16) -> Option<TileSpan> {
        let (y, half_y) = (self.mean[1], self.half[1]);
        let [first, last] = visible.pixels(1);
        let top = f64::from(row) * f64::from(TILE_SIZE);
        let (first, last) = (larger(first, top), smaller(last, top + f64::from(TILE_SIZE) - 1.0));
        let in_row = centres(y - half_y, y + half_y, first, last)?;
        self.span_between(in_row, visible.pixels(0))
    }

    /// The tiles whose pixel centres the ellipse may contain between two rows of pixels of one row of tiles, among the `visible`
    /// columns of pixels from the first to the last.
    #[inline(always)]
    fn span_between(&self, [top, bottom]: [f64; 2], visible: [f64; 2]) -> Option<TileSpan> {
        let ([x, y], [first, last]) = (self.mean, visible);
        let [low, high] = self.sides(top + 0.5 - y, bottom + 0.5 - y);
        centres(x + low, x + high, first, last).map(tiles_of)
    }

    /// The blocks of 4x4 pixels, in the tile at `corner`, whose pixel centres the ellipse may contain: a bit for each, row by row.
    pub(crate) fn blocks(&self, corner: [u32; 2]) -> u64 {
        let [left, top] = [0, 1].map(|axis| f64::from(corner[axis]) - self.mean[axis]);
        let mut blocks = 0;
        for row in 0..4 {
            let first = top + f64::from(4 * row) + 0.5;
            let (above, below) = (larger(first, -self.half[1]), smaller(first + 3.0, self.half[1]));
            if above > below {
                continue;
            }
            let [low, high] = self.sides(above, below);
            for column in 0..4 {
                let first = left + f64::from(4 * column) + 0.5;
                let is_reached = low <= first + 3.0 && high >= first;
                blocks |= u64::from(is_reached) << (4 * row + column);
            }
        }
        blocks
    }

    /// The leftmost and rightmost extent between two heights, all relative to the centre.
    #[inline(always)]
    fn sides(&self, above: f64, below: f64) -> [f64; 2] {
        // Each side is monotonic above and below its furthest point, at height -peak and peak.
        let left = smaller(larger(-self.peak, above), below);
        let right = smaller(larger(self.peak, above), below);
        let square = self.half[1] * self.half[1];
        let width = [
            (self.narrowing * larger(square - left * left, 0.0)).sqrt(),
            (self.narrowing * larger(square - right * right, 0.0)).sqrt(),
        ];
        [self.slope * left - width[0], self.slope * right + width[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    const VISIBLE: Visible = Visible { left: 3, top: 0, right: 200, bottom: 150 };

    /// A Gaussian with covariance `S = [a, b; b, c]`, cut off at `extent`.
    #[derive(Clone, Copy, Debug)]
    struct Gaussian {
        mean: [f64; 2],
        a: f64,
        b: f64,
        c: f64,
        extent: f64,
    }

    impl Gaussian {
        fn new(mean: [f64; 2], sigma: [f64; 2], angle: f64, extent: f64) -> Self {
            let (sin, cos) = angle.sin_cos();
            let [p, q] = sigma.map(|s| s * s);
            Self {
                mean,
                a: p * cos * cos + q * sin * sin,
                b: (p - q) * sin * cos,
                c: p * sin * sin + q * cos * cos,
                extent,
            }
        }

        fn ellipse(&self) -> Ellipse {
            let Self { mean, a, b, c, extent } = *self;
            Ellipse {
                mean,
                half: [(a * extent).sqrt(), (c * extent).sqrt()],
                slope: b / c,
                narrowing: (a * c - b * b) / (c * c),
                peak: b * (extent / a).sqrt(),
            }
        }

        /// The row, the first tile, and one past the last tile of each row that has tiles.
        fn spans(&self) -> Vec<(u32, u16, u16)> {
            // The group's list already has spans of other Gaussians.
            let mut others = vec![TileSpan::default(); 70_000];
            let reach = self.ellipse().reach(&VISIBLE, &mut others, Some(&mut 0));
            let spans = reach.iter().flat_map(|reach| reach.spans(&others));
            spans.filter(|(_, span)| span.first < span.end).map(|(row, span)| (row, span.first, span.end)).collect()
        }

        /// The tiles that hold a visible pixel centre inside the ellipse, by testing every pixel.
        fn reached(&self) -> BTreeSet<(u16, u16)> {
            let mut tiles = BTreeSet::new();
            for py in VISIBLE.top..VISIBLE.bottom {
                for px in VISIBLE.left..VISIBLE.right {
                    let dx = px as f64 + 0.5 - self.mean[0];
                    let dy = py as f64 + 0.5 - self.mean[1];
                    let q = self.c * dx * dx - 2.0 * self.b * dx * dy + self.a * dy * dy;
                    if q <= self.extent * (self.a * self.c - self.b * self.b) {
                        tiles.insert(((py / 16) as u16, (px / 16) as u16));
                    }
                }
            }
            tiles
        }
    }

    #[gaurast_runner::test]
    fn a_small_one_reaches_its_own_tile() {
        let round = Gaussian::new([40.2, 20.7], [0.6, 0.6], 0.0, 9.0);
        assert_eq!(round.spans(), [(1, 2, 3)]);
    }

    #[gaurast_runner::test]
    fn one_that_is_elsewhere_reaches_nothing() {
        assert_eq!(Gaussian::new([-10.0, 20.0], [2.0, 2.0], 0.3, 9.0).spans(), []);
        assert_eq!(Gaussian::new([50.0, 1e9], [2.0, 2.0], 0.3, 9.0).spans(), []);
        // Its bounding box reaches a corner of the visible pixels; the ellipse does not.
        assert_eq!(Gaussian::new([-22.5, -26.4], [42.0, 0.5], 2.33, 1.3).spans(), []);
    }

    proptest! {
        #[gaurast_runner::test]
        fn every_tile_that_is_reached_is_listed_and_few_others(
            x in -30.0..230.0f64, y in -30.0..180.0f64,
            wide in 0.5..80.0f64, narrow in 0.5..10.0f64, angle in 0.0..3.2f64, extent in 0.1..12.0f64,
        ) {
            let gaussian = Gaussian::new([x, y], [wide, narrow], angle, extent);
            let listed: BTreeSet<_> = gaussian
                .spans()
                .iter()
                .flat_map(|&(row, first, end)| (first..end).map(move |tile| (row as u16, tile)))
                .collect();
            for tile in gaussian.reached() {
                prop_assert!(listed.contains(&tile), "{tile:?} of {gaussian:?}");
            }
            // A listed tile without a reached centre is one that the ellipse crosses between centres.
            let extent = (extent.sqrt() + 1.5 / narrow.min(wide)).powi(2);
            let near = Gaussian { extent, ..gaussian }.reached();
            for tile in &listed {
                prop_assert!(near.contains(tile), "{tile:?} of {gaussian:?} is not near");
            }
        }
    }
}
