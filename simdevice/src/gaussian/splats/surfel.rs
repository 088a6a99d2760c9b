//! Surfels, or 2D Gaussians: flat discs whose exact projection is evaluated, without linearization.
//!
//! With the disc's axes `a` and `b` (scaled) and its centre `t`, all in camera axes, a ray `r` meets its plane at
//! `u a + v b + t`, where `u = (b x t) . r / w`, `v = (t x a) . r / w` and `w = (a x b) . r`: Cramer's rule for the
//! matrix `[a b t]`. With `r` at `d` pixels from the mean, the numerators are linear in `d` and zero at the mean, where
//! they lose no digits; `w` is linear, too. Everything is binary64, without fused operations.

use super::ellipse::Ellipse;
use super::footprint::{TileFootprint, TileSpan};
use crate::gaussian::view::visible::Visible;
use crate::limits::TILE_SIZE;
use fearless_simd::{Simd, f64x8, prelude::*};

/// The factor from a squared distance to an exponent of 2.
pub(crate) const UNIT: f64 = 0.5 / std::f64::consts::LN_2;

/// A margin for the rounding of places in the picture, in pixels, and relative to them.
const MARGIN: f64 = 1e-9;

/// The growth of an ellipse's covariance that contains rounding.
const GROWTH: f64 = 1e-4;

/// The least part of a sum of products that must not cancel for its digits to be trusted.
const LEAST_LEFT: f64 = 1e-4;

/// A disc in the picture.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Surfel {
    /// The mean, in framebuffer pixels.
    pub(crate) mean: [f64; 2],
    /// The gradients of `u w` and `v w` per pixel in x and y. Both are zero at the mean.
    pub(crate) across: [[f64; 2]; 2],
    /// The value of `w` at the mean, not negative, and its gradient per pixel in x and y.
    pub(crate) scale: [f64; 3],
    /// The upper bound of `w`: the ray meets the disc beyond the near plane only where `w` is between zero and this.
    pub(crate) limit: f64,
    /// The squared distance from which on alpha is below the floor.
    pub(crate) extent: f64,
    /// The centre of the low-pass filter's circle, in pixels from the mean.
    pub(crate) filter: [f64; 2],
    /// The radius of that circle out to that distance, in pixels; zero without a filter.
    pub(crate) radius: f64,
    /// The first tile of the cut-off, and the one after the last, along x and y, if there is a cut-off.
    pub(crate) tiles: [[f64; 2]; 2],
    /// The part of the picture in which rays meet the disc nearer than that distance.
    pub(crate) outline: Outline,
}

/// The part of the picture in which rays meet a disc nearer than its extent.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) enum Outline {
    /// No ray meets it.
    #[default]
    Empty,
    /// The disc is between the eye's plane and infinity.
    Ellipse(Ellipse),
    /// The disc reaches the eye's plane, or is seen so much edge-on that its ellipse has too few digits.
    Open,
}

impl Surfel {
    /// The same surfel at a mean, out to a squared distance, with a filter of a variance in px^2.
    pub(crate) fn placed(self, mean: [f64; 2], extent: f64, low_pass: f64) -> Self {
        let placed = Self { mean, extent, radius: (extent * low_pass).sqrt(), ..self };
        Self { outline: placed.outline(), ..placed }
    }

    /// The outline of the disc.
    ///
    /// `(u.d)^2 + (v.d)^2 <= extent (w + w'.d)^2` is `d^T P d - 2 extent w w'.d <= extent w^2` with
    /// `P = u u^T + v v^T - extent w' w'^T`. What could cancel is formed of the areas that the gradients span, since
    /// the ellipses of thin discs have axes of very different lengths.
    fn outline(&self) -> Outline {
        let [u, v] = self.across;
        let [w, wx, wy] = self.scale;
        if w.is_nan() || w <= 0.0 {
            return Outline::Empty;
        }
        let extent = self.extent;
        let gradient = [wx, wy];
        let area = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let length = |a: [f64; 2]| (a[0] * a[0] + a[1] * a[1]).sqrt();
        let (of_uv, of_u, of_v) = (area(u, v), area(u, gradient), area(v, gradient));
        let determinant = of_uv * of_uv - extent * (of_u * of_u + of_v * of_v);
        let terms = length(u) * length(v) + extent.sqrt() * length(gradient) * (length(u) + length(v));
        if !(of_uv.abs() > LEAST_LEFT * terms && determinant > LEAST_LEFT * of_uv * of_uv) {
            return Outline::Open;
        }
        let force = extent * w / determinant;
        let shift = [-force * (u[1] * of_u + v[1] * of_v), force * (u[0] * of_u + v[0] * of_v)];
        let level = extent * w * w * (of_uv * of_uv / determinant);
        // The covariance: level P^-1.
        let element = |i: usize, j: usize| u[i] * u[j] + v[i] * v[j] - extent * gradient[i] * gradient[j];
        let per_level = level / determinant;
        let [xx, xy, yy] = [per_level * element(1, 1), -per_level * element(0, 1), per_level * element(0, 0)];
        let mean = [self.mean[0] + shift[0], self.mean[1] + shift[1]];
        let size = mean[0].abs() + mean[1].abs() + xx.sqrt() + yy.sqrt();
        if !size.is_finite() {
            return Outline::Open;
        }
        // An ellipse of (1 + g) S + (1 + 1/g) m^2 I contains that of S with a rim of m.
        let margin = MARGIN * (1.0 + size);
        let rim = (1.0 + 1.0 / GROWTH) * margin * margin;
        let grown = 1.0 + GROWTH;
        let (a, b, c) = (grown * xx + rim, grown * xy, grown * yy + rim);
        let determinant = grown * grown * (level * per_level) + grown * rim * (xx + yy) + rim * rim;
        Outline::Ellipse(Ellipse {
            mean,
            half: [a.sqrt(), c.sqrt()],
            slope: b / c,
            narrowing: determinant / (c * c),
            peak: b / a.sqrt(),
        })
    }

    /// The circle of the filter, if there is a filter.
    fn circle(&self) -> Option<Ellipse> {
        let mean = [0, 1].map(|axis| self.mean[axis] + self.filter[axis]);
        let circle = Ellipse { mean, half: [self.radius; 2], slope: 0.0, narrowing: 1.0, peak: 0.0 };
        (self.radius > 0.0).then_some(circle)
    }

    /// False if no ray between `middle` and `half` pixels away from it in x and y meets the disc nearer than its extent.
    fn may_meet(&self, middle: [f64; 2], half: f64) -> bool {
        let [dx, dy] = [0, 1].map(|axis| middle[axis] - self.mean[axis]);
        let half = half + MARGIN * (1.0 + dx.abs() + dy.abs());
        let around = |[x, y]: [f64; 2]| half * (x.abs() + y.abs());
        let [u, v] = self.across.map(|along| {
            let [x, y] = along;
            ((dx * x + dy * y).abs() - around(along)).max(0.0)
        });
        let [w, wx, wy] = self.scale;
        let (w, margin) = (dx * wx + dy * wy + w, around([wx, wy]) + MARGIN * w);
        let greatest = (w + margin).min(self.limit);
        w - margin < self.limit
            && greatest > 0.0
            && u * u + v * v <= self.extent * (greatest * greatest) * (1.0 + MARGIN)
    }

    /// The tiles that the disc and the filter's circle may reach, if there are any. Spans that do not fit inline go to `others`.
    pub(crate) fn reach(&self, visible: &Visible, others: &mut Vec<TileSpan>) -> Option<TileFootprint> {
        // NaN reaches no tile.
        if !(self.extent >= 0.0 && self.mean[0].is_finite() && self.mean[1].is_finite()) {
            return None;
        }
        let tiles = |axis: usize| {
            let [first, last] = visible.pixels(axis);
            // The conversion ends at the greatest number.
            let number = |tiles: f64| tiles as u16;
            let tile = f64::from(TILE_SIZE);
            (first <= last).then(|| [number(first / tile), number(last / tile + 1.0)])
        };
        let circle = self.circle();
        let disc = match &self.outline {
            Outline::Empty => None,
            Outline::Ellipse(ellipse) => ellipse.rows(visible),
            Outline::Open => tiles(1),
        };
        let rows = [disc, circle.and_then(|circle| circle.rows(visible))].into_iter().flatten();
        let [first, end] = rows.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?;
        let mut reach = TileFootprint::new(first, end - first, others);
        let mut reaches_any = false;
        for row in first..end {
            let disc = match &self.outline {
                Outline::Empty => None,
                Outline::Ellipse(ellipse) => ellipse.span(visible, row),
                Outline::Open => tiles(0).and_then(|columns| self.open_span(columns, row)),
            };
            let spans = [disc, circle.and_then(|circle| circle.span(visible, row))].into_iter().flatten();
            // Both shapes contain the mean, so that their union in a row of tiles is taken as one span.
            if let Some(span) = spans.reduce(|a, b| TileSpan { first: a.first.min(b.first), end: a.end.max(b.end) }) {
                reach.set(others, row - first, span);
                reaches_any = true;
            }
        }
        reaches_any.then_some(reach)
    }

    /// The tiles of a row in which rays may meet an open disc, among the columns from the first to one before the end.
    fn open_span(&self, [first, end]: [u16; 2], row: u16) -> Option<TileSpan> {
        let tile = f64::from(TILE_SIZE);
        let middle = |tiles: u16| (f64::from(tiles) + 0.5) * tile;
        let is_met = |column: &u16| self.may_meet([middle(*column), middle(row)], 0.5 * (tile - 1.0));
        let from = (first..end).find(is_met)?;
        let to = (from..end).rev().find(is_met)?;
        Some(TileSpan { first: from, end: to + 1 })
    }

    /// The blocks of 4x4 pixels that it may reach in the tile of 16x16 pixels at `corner`: a bit for each, row by row.
    pub(crate) fn blocks(&self, corner: [u32; 2]) -> u64 {
        let disc = match &self.outline {
            Outline::Empty => 0,
            Outline::Ellipse(ellipse) => ellipse.blocks(corner),
            Outline::Open => (0..16u32).fold(0, |bits, block| {
                let middle =
                    [corner[0] + 4 * (block % 4), corner[1] + 4 * (block / 4)].map(|pixel| f64::from(pixel) + 2.0);
                bits | u64::from(self.may_meet(middle, 1.5)) << block
            }),
        };
        disc | self.circle().map_or(0, |circle| circle.blocks(corner))
    }

    /// The amount that is subtracted from the exponent of 2 at eight points, `dx` and `dy` pixels from the mean.
    /// `inverse_low_pass` is the inverse of the filter's variance, if there is a filter.
    #[inline(always)]
    pub(crate) fn falloff<S: Simd>(
        &self,
        simd: S,
        dx: f64x8<S>,
        dy: f64x8<S>,
        inverse_low_pass: Option<f64>,
    ) -> f64x8<S> {
        let [[ux, uy], [vx, vy]] = self.across;
        let [w, wx, wy] = self.scale;
        let (u, v) = (dx * ux + dy * uy, dx * vx + dy * vy);
        let w = dx * wx + dy * wy + w;
        let square = w * w;
        let meets = w.simd_gt(0.0) & w.simd_lt(self.limit) & square.simd_gt(0.0);
        let infinite = f64x8::splat(simd, f64::INFINITY);
        let mut distance = meets.select((u * u + v * v) / square, infinite);
        if let Some(inverse) = inverse_low_pass {
            let (dx, dy) = (dx - self.filter[0], dy - self.filter[1]);
            let filter = (dx * dx + dy * dy) * inverse;
            distance = distance.simd_lt(filter).select(distance, filter);
        }
        distance * UNIT
    }
}
