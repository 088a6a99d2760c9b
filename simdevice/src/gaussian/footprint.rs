//! Which tiles a projected Gaussian reaches: exact tests of its alpha-floor ellipse against rectangles of
//! pixel centres.

use crate::packet::Rect;

/// The side in pixels of the tiles that hold Gaussian lists, as in the paper.
pub const TILE_SIZE: u32 = 16;

/// A run of tiles in one row of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    /// The row of tiles.
    pub row: u16,
    /// The first tile.
    pub first: u16,
    /// One past the last tile.
    pub end: u16,
}

/// The pixels that a draw may touch: half-open, in framebuffer coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Visible {
    pub left: i64,
    pub top: i64,
    pub right: i64,
    pub bottom: i64,
}

impl From<Rect> for Visible {
    fn from(rect: Rect) -> Self {
        Self {
            left: rect.x.into(),
            top: rect.y.into(),
            right: i64::from(rect.x) + i64::from(rect.width),
            bottom: i64::from(rect.y) + i64::from(rect.height),
        }
    }
}

/// The ellipse `d^T S^-1 d <= extent` about `mean`, with `S = [a, b; b, c]` in px^2, in the form that its
/// spans are found from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    /// Its centre in pixels.
    pub mean: [f64; 2],
    /// Half its extent in x and y: `sqrt(a extent)` and `sqrt(c extent)`.
    pub half: [f64; 2],
    /// At height `d.y` its middle is at `d.x = slope d.y`: `b / c`.
    pub slope: f64,
    /// There its half width is `sqrt(narrowing (half.y^2 - d.y^2))`: `det / c^2`.
    pub narrowing: f64,
    /// It reaches furthest to the right at this height: `b sqrt(extent / a)`.
    pub peak: f64,
}

/// The first and last integer `p` of `first..end` with `low <= p + 0.5 <= high`.
#[inline(always)]
fn centres(low: f64, high: f64, first: i64, end: i64) -> Option<(i64, i64)> {
    let low = ((low - 0.5).ceil() as i64).max(first);
    let high = ((high - 0.5).floor() as i64).min(end - 1);
    (low <= high).then_some((low, high))
}

impl Ellipse {
    /// Appends the spans of tiles that hold a visible pixel centre's column and row inside the ellipse.
    ///
    /// The ellipse is convex, so that in each row of tiles the reached ones follow one another, and the
    /// columns that it spans within the row's pixel centres tell them exactly. The tiles of its box that it does not
    /// reach are added to `beside`; without it, the whole box is listed.
    #[inline(always)]
    pub(crate) fn append_spans(
        &self,
        visible: &Visible,
        spans: &mut Vec<Span>,
        beside: Option<&mut u64>,
    ) {
        let tile = i64::from(TILE_SIZE);
        let [x, y] = self.mean;
        let [half_x, half_y] = self.half;
        let columns = centres(x - half_x, x + half_x, visible.left, visible.right);
        let rows = centres(y - half_y, y + half_y, visible.top, visible.bottom);
        let (Some((left, right)), Some((top, bottom))) = (columns, rows) else {
            return;
        };
        let push = |spans: &mut Vec<Span>, row: i64, left: i64, right: i64| {
            spans.push(Span {
                row: row as u16,
                first: (left / tile) as u16,
                end: (right / tile + 1) as u16,
            });
        };
        let clipped = left == visible.left
            || right == visible.right - 1
            || top == visible.top
            || bottom == visible.bottom - 1;
        if left / tile == right / tile && top / tile == bottom / tile && !clipped {
            push(spans, top / tile, left, right);
            return;
        }
        let Some(beside) = beside else {
            for row in top / tile..=bottom / tile {
                push(spans, row, left, right);
            }
            return;
        };
        // Both sides are monotonic above and below their furthest points, at -peak and peak.
        let side = |dy: f64, sign: f64| {
            let rest = (half_y * half_y - dy * dy).max(0.0);
            self.slope * dy + sign * (self.narrowing * rest).sqrt()
        };
        for row in top / tile..=bottom / tile {
            let above = top.max(row * tile) as f64 + 0.5 - y;
            let below = bottom.min(row * tile + tile - 1) as f64 + 0.5 - y;
            let low = side((-self.peak).max(above).min(below), -1.0);
            let high = side(self.peak.max(above).min(below), 1.0);
            *beside += (right / tile - left / tile + 1) as u64;
            if let Some((left, right)) = centres(x + low, x + high, visible.left, visible.right) {
                push(spans, row, left, right);
                *beside -= (right / tile - left / tile + 1) as u64;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    const VISIBLE: Visible = Visible {
        left: 3,
        top: 0,
        right: 200,
        bottom: 150,
    };

    /// `S = [a, b; b, c]` and the extent.
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
            let Self {
                mean,
                a,
                b,
                c,
                extent,
            } = *self;
            Ellipse {
                mean,
                half: [(a * extent).sqrt(), (c * extent).sqrt()],
                slope: b / c,
                narrowing: (a * c - b * b) / (c * c),
                peak: b * (extent / a).sqrt(),
            }
        }

        fn spans(&self) -> Vec<Span> {
            let mut spans = Vec::new();
            self.ellipse()
                .append_spans(&VISIBLE, &mut spans, Some(&mut 0));
            spans
        }

        /// The tiles that hold a visible pixel centre inside the ellipse.
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

    #[test]
    fn a_small_one_reaches_its_own_tile() {
        let round = Gaussian::new([40.2, 20.7], [0.6, 0.6], 0.0, 9.0);
        let tile = Span {
            row: 1,
            first: 2,
            end: 3,
        };
        assert_eq!(round.spans(), [tile]);
    }

    #[test]
    fn one_that_is_elsewhere_reaches_nothing() {
        assert_eq!(
            Gaussian::new([-10.0, 20.0], [2.0, 2.0], 0.3, 9.0).spans(),
            []
        );
        assert_eq!(Gaussian::new([50.0, 1e9], [2.0, 2.0], 0.3, 9.0).spans(), []);
        // Its bounding box reaches a corner of what is visible, but it does not.
        assert_eq!(
            Gaussian::new([-22.5, -26.4], [42.0, 0.5], 2.33, 1.3).spans(),
            []
        );
    }

    proptest! {
        #[test]
        fn every_tile_that_is_reached_is_listed_and_few_others(
            x in -30.0..230.0f64, y in -30.0..180.0f64,
            wide in 0.5..80.0f64, narrow in 0.5..10.0f64, angle in 0.0..3.2f64, extent in 0.1..12.0f64,
        ) {
            let gaussian = Gaussian::new([x, y], [wide, narrow], angle, extent);
            let listed: BTreeSet<_> = gaussian
                .spans()
                .iter()
                .flat_map(|s| (s.first..s.end).map(|tile| (s.row, tile)))
                .collect();
            for tile in gaussian.reached() {
                prop_assert!(listed.contains(&tile), "{tile:?} of {gaussian:?}");
            }
            // A listed tile that no centre reaches is one that the ellipse crosses between centres.
            let extent = (extent.sqrt() + 1.5 / narrow.min(wide)).powi(2);
            let near = Gaussian { extent, ..gaussian }.reached();
            for tile in &listed {
                prop_assert!(near.contains(tile), "{tile:?} of {gaussian:?} is not near");
            }
        }
    }
}
