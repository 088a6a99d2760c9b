//! Surfels, or 2D Gaussians: flat discs whose exact projection is evaluated, without linearization.
//!
//! With the disc's axes `a` and `b` (scaled) and its centre `t`, all in camera axes, a ray `r` meets its plane at
//! `u a + v b + t`, where `u = (b x t) . r / w`, `v = (t x a) . r / w` and `w = (a x b) . r`: Cramer's rule for the
//! matrix `[a b t]`. With `r` at `d` pixels from the mean, the numerators are linear in `d` and zero at the mean, where
//! they lose no digits; `w` is linear, too. Everything is binary64, without fused operations.

use fearless_simd::{Simd, f64x8, prelude::*};

/// The factor from a squared distance to an exponent of 2.
pub(crate) const UNIT: f64 = 0.5 / std::f64::consts::LN_2;

/// A disc in the picture.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Surfel {
    /// The gradients of `u w` and `v w` per pixel in x and y. Both are zero at the mean.
    pub(crate) across: [[f64; 2]; 2],
    /// The value of `w` at the mean, not negative, and its gradient per pixel in x and y.
    pub(crate) scale: [f64; 3],
    /// The upper bound of `w`: the ray meets the disc beyond the near plane only where `w` is between zero and this.
    pub(crate) limit: f64,
    /// The bounding box of pixels that it may reach: left, right, top, bottom, in framebuffer pixels.
    pub(crate) bounds: [f64; 4],
}

impl Surfel {
    /// The blocks of 4x4 pixels that it may reach in the tile of 16x16 pixels at `corner`: a bit for each, row by row.
    pub(crate) fn blocks(&self, corner: [u32; 2]) -> u64 {
        let axis = |axis: usize| {
            let corner = f64::from(corner[axis]);
            let [low, high] = [self.bounds[2 * axis] - corner, self.bounds[2 * axis + 1] - corner];
            let touched = |block: &usize| {
                let first = (4 * block) as f64 + 0.5;
                first + 3.0 >= low && first <= high
            };
            (0..4).filter(touched).fold(0u64, |bits, block| bits | 1 << block)
        };
        let (columns, rows) = (axis(0), axis(1));
        let mut blocks = 0;
        for row in (0..4).filter(|row| rows >> row & 1 == 1) {
            blocks |= columns << (4 * row);
        }
        blocks
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
            let filter = (dx * dx + dy * dy) * inverse;
            distance = distance.simd_lt(filter).select(distance, filter);
        }
        distance * UNIT
    }
}
