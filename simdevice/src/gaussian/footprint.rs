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

/// The ellipse `d^T S^-1 d <= extent` about `mean`, with `S = [a, b; b, c]` in px^2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    pub mean: [f64; 2],
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub determinant: f64,
    pub extent: f64,
}

/// The first and last integer `p` of `first..end` with `low <= p + 0.5 <= high`.
#[inline]
fn centres(low: f64, high: f64, first: i64, end: i64) -> Option<(i64, i64)> {
    let low = ((low - 0.5).ceil() as i64).max(first);
    let high = ((high - 0.5).floor() as i64).min(end - 1);
    (low <= high).then_some((low, high))
}

impl Ellipse {
    /// Appends the spans of tiles that hold a visible pixel centre's column and row inside the ellipse.
    ///
    /// The ellipse is convex, so that in each row of tiles the reached ones follow one another, and the
    /// columns that it spans within the row's pixel centres tell them exactly.
    #[inline]
    pub(crate) fn append_spans(&self, visible: &Visible, spans: &mut Vec<Span>) {
        let tile = i64::from(TILE_SIZE);
        let [x, y] = self.mean;
        let half_x = (self.a * self.extent).sqrt();
        let half_y = (self.c * self.extent).sqrt();
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
        if left / tile == right / tile && top / tile == bottom / tile {
            push(spans, top / tile, left, right);
            return;
        }
        // At height dy the ellipse spans slope dy -+ sqrt(width2 (extent - dy^2 / c)); its rightmost point
        // lies at dy = peak, its leftmost at -peak, and the sides are monotonic on either hand of these.
        let slope = self.b / self.c;
        let width2 = self.determinant / self.c;
        let peak = self.b * half_x / self.a;
        let half_width = |dy: f64| (width2 * (self.extent - dy * dy / self.c).max(0.0)).sqrt();
        for row in top / tile..=bottom / tile {
            let above = top.max(row * tile) as f64 + 0.5 - y;
            let below = bottom.min(row * tile + tile - 1) as f64 + 0.5 - y;
            let at = (-peak).max(above).min(below);
            let low = slope * at - half_width(at);
            let at = peak.max(above).min(below);
            let high = slope * at + half_width(at);
            if let Some((left, right)) = centres(x + low, x + high, visible.left, visible.right) {
                push(spans, row, left, right);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const VISIBLE: Visible = Visible {
        left: 3,
        top: 0,
        right: 200,
        bottom: 150,
    };

    fn spans(ellipse: &Ellipse) -> Vec<Span> {
        let mut spans = Vec::new();
        ellipse.append_spans(&VISIBLE, &mut spans);
        spans
    }

    /// The tiles that hold a visible pixel centre inside the ellipse.
    fn reached(ellipse: &Ellipse) -> Vec<(u16, u16)> {
        let mut tiles = std::collections::BTreeSet::new();
        for py in VISIBLE.top..VISIBLE.bottom {
            for px in VISIBLE.left..VISIBLE.right {
                let dx = px as f64 + 0.5 - ellipse.mean[0];
                let dy = py as f64 + 0.5 - ellipse.mean[1];
                let q = (ellipse.c * dx * dx - 2.0 * ellipse.b * dx * dy + ellipse.a * dy * dy)
                    / ellipse.determinant;
                if q <= ellipse.extent {
                    tiles.insert(((py / 16) as u16, (px / 16) as u16));
                }
            }
        }
        tiles.into_iter().collect()
    }

    fn ellipse(mean: [f64; 2], sigma: [f64; 2], angle: f64, extent: f64) -> Ellipse {
        let (sin, cos) = angle.sin_cos();
        let [p, q] = sigma.map(|s| s * s);
        Ellipse {
            mean,
            a: p * cos * cos + q * sin * sin,
            b: (p - q) * sin * cos,
            c: p * sin * sin + q * cos * cos,
            determinant: p * q,
            extent,
        }
    }

    #[test]
    fn a_small_one_reaches_its_own_tile() {
        let round = ellipse([40.2, 20.7], [0.6, 0.6], 0.0, 9.0);
        assert_eq!(
            spans(&round),
            [Span {
                row: 1,
                first: 2,
                end: 3
            }]
        );
    }

    #[test]
    fn one_that_is_elsewhere_reaches_nothing() {
        assert_eq!(spans(&ellipse([-10.0, 20.0], [2.0, 2.0], 0.3, 9.0)), []);
        assert_eq!(spans(&ellipse([50.0, 1e9], [2.0, 2.0], 0.3, 9.0)), []);
    }

    proptest! {
        #[test]
        fn every_tile_that_is_reached_is_listed_and_few_others(
            x in -30.0..230.0f64, y in -30.0..180.0f64,
            wide in 0.5..80.0f64, narrow in 0.5..10.0f64, angle in 0.0..3.2f64, extent in 0.1..12.0f64,
        ) {
            let ellipse = ellipse([x, y], [wide, narrow], angle, extent);
            let listed: std::collections::BTreeSet<_> = spans(&ellipse)
                .iter()
                .flat_map(|s| (s.first..s.end).map(|tile| (s.row, tile)))
                .collect();
            let reached = reached(&ellipse);
            for tile in &reached {
                prop_assert!(listed.contains(tile), "{tile:?} of {ellipse:?}");
            }
            // A listed tile that no centre reaches is one that the ellipse crosses between centres.
            let grown = Ellipse { extent: (ellipse.extent.sqrt() + 1.5 / narrow.min(wide)).powi(2), ..ellipse };
            let grown: std::collections::BTreeSet<_> = self::reached(&grown).into_iter().collect();
            for tile in &listed {
                prop_assert!(grown.contains(tile), "{tile:?} of {ellipse:?} is not near");
            }
        }
    }
}
