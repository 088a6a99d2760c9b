//! Gaussians in the picture: the output of projection.

use crate::gaussian::lanes::{Bits, GroupF64, NO_GROUP_F64, log2};
use crate::gaussian::splats::binary16::binary16_headroom;
use crate::gaussian::splats::ellipse::Ellipse;
use crate::gaussian::splats::splat::{Splat, SplatLook};
use crate::gaussian::view::constants::ViewConstants;
use crate::state::gaussian::GaussianPrecision;
use fearless_simd::{Simd, prelude::*};

/// The factor from a base-2 exponent to a natural one: `q / 2 = LN_2 (u^2 + v^2)`.
pub(crate) const LN_2: f64 = std::f64::consts::LN_2;

/// The greatest base-2 logarithm of the opacity for which exponents are computed in binary32. Their rounding error
/// grows with it.
const GREATEST_F32_LOG2_OPACITY: f64 = 4.0;

/// The greatest factor, in 1/px, for which exponents are computed in binary32. Pixels are up to 1.5 px from a block's
/// middle. A low-pass variance of 0.3 px^2 keeps all factors below 1.6.
const GREATEST_F32_FACTOR: f64 = 8.0;

/// Gaussians in the picture: the output of projection.
pub(crate) struct ScreenGaussians {
    pub(crate) mean: [GroupF64; 2],
    pub(crate) determinant: GroupF64,
    pub(crate) log2_opacity: GroupF64,
    /// The elements whose exponents must be computed in binary64.
    pub(crate) needs_f64: Bits,
    /// The factors of the exponent: see [`Splat::factor`](Splat::factor).
    pub(crate) factor: [GroupF64; 3],
    /// The covariance in the picture: xx, xy and yy in px^2.
    pub(crate) covariance: [GroupF64; 3],
    /// The greatest `d^T S^-1 d` at which the alpha floor may be reached, S being the covariance. Negative where it is
    /// reached nowhere.
    pub(crate) extent: GroupF64,
}

impl Default for ScreenGaussians {
    fn default() -> Self {
        Self {
            mean: [NO_GROUP_F64; 2],
            determinant: NO_GROUP_F64,
            log2_opacity: NO_GROUP_F64,
            needs_f64: Bits::default(),
            factor: [NO_GROUP_F64; 3],
            covariance: [NO_GROUP_F64; 3],
            extent: NO_GROUP_F64,
        }
    }
}

impl ScreenGaussians {
    /// The splat of element `at`, with its colour and its centre's depth.
    #[inline(always)]
    pub(crate) fn splat(&self, at: usize, color: [f32; 3], depth: u32) -> Splat {
        Splat {
            mean: [self.mean[0][at], self.mean[1][at]],
            factor: [self.factor[0][at], self.factor[1][at], self.factor[2][at]],
            log2_opacity: self.log2_opacity[at] as f32,
            look: SplatLook { color, depth },
            needs_f64: self.needs_f64.has(at),
            exceeds_period: false,
        }
    }

    /// The ellipse outside of which element `at` does not reach the alpha floor. Its sizes are NaN where it reaches
    /// the floor nowhere.
    pub(crate) fn ellipse(&self, at: usize) -> Ellipse {
        let [a, b, c] = self.covariance.each_ref().map(|lanes| lanes[at]);
        let extent = self.extent[at];
        let half_x = (a * extent).sqrt();
        Ellipse {
            mean: self.mean.each_ref().map(|lanes| lanes[at]),
            half: [half_x, (c * extent).sqrt()],
            slope: b / c,
            narrowing: self.determinant[at] / c / c,
            peak: b / a * half_x,
        }
    }
}

/// Computes the numbers that rasterization and the search for tiles need, for Gaussians from lane `at` on. The inputs
/// are the covariances in the picture before the low-pass filter (xx, xy, yy) in px^2, their determinants, and
/// opacities.
#[inline(always)]
pub(crate) fn shape<S: Simd>(
    view: &ViewConstants,
    simd: S,
    at: usize,
    [xx, xy, yy]: [S::f64s; 3],
    area2: S::f64s,
    mut o: S::f64s,
    screen: &mut ScreenGaussians,
) {
    let number = |value: f64| S::f64s::splat(simd, value);
    let store = |value: S::f64s, lanes: &mut GroupF64| {
        value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
    };
    let low_pass = number(view.low_pass);
    let determinant = area2 + low_pass * (xx + yy) + low_pass * low_pass;
    store(determinant, &mut screen.determinant);
    if view.compensated {
        let mut ratio = area2 / determinant;
        // With a negative weight, a covariance may have a negative determinant.
        if view.compensation_floor > 0.0 || view.sigma_points.center < 0.0 {
            ratio = ratio.max(number(view.compensation_floor));
        }
        o *= ratio.sqrt();
    }
    let log2_opacity = log2(simd, o);
    store(log2_opacity, &mut screen.log2_opacity);

    let (a, b, c) = (xx + low_pass, xy, yy + low_pass);
    // alpha = opacity exp(-q / 2) = 2^(log2 opacity - q / (2 ln 2)), and
    // q = d.x^2 / a + (a / det) (d.y - (b / a) d.x)^2.
    let unit = (0.5 / LN_2).sqrt();
    let per_a = number(1.0) / a;
    let vertical = (a / determinant).sqrt() * unit;
    let factor = [per_a.sqrt() * unit, -(b * per_a) * vertical, vertical];
    store(factor[0], &mut screen.factor[0]);
    store(factor[1], &mut screen.factor[1]);
    store(factor[2], &mut screen.factor[2]);
    if at == 0 {
        screen.needs_f64 = Bits::default();
    }
    screen.needs_f64.set(at, need_f64::<S>(factor, log2_opacity));
    // The tile engine evaluates the exponent in binary32. A margin wider than its error keeps every pixel that it would
    // accept. Gaussians that still cannot reach the floor have a negative extent.
    let log2_range = log2_opacity - view.log2_floor;
    let mut extent = (log2_range + log2_range.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
    if view.precision == GaussianPrecision::Float16 {
        for lane in at..at + S::f64s::LEN {
            let factor = [0, 1, 2].map(|element| screen.factor[element][lane]);
            let log2_range = screen.log2_opacity[lane] - view.log2_floor;
            screen.extent[lane] = binary16_headroom(factor, log2_range) * (2.0 * LN_2);
        }
        extent = S::f64s::from_slice(simd, &screen.extent[at..at + S::f64s::LEN]);
    }
    store(extent, &mut screen.extent);
    for (element, lanes) in [a, b, c].into_iter().zip(&mut screen.covariance) {
        store(element, lanes);
    }
}

/// The Gaussians whose exponents must be computed in binary64. The result depends on each Gaussian alone.
#[inline(always)]
pub(crate) fn need_f64<S: Simd>(factor: [S::f64s; 3], log2_opacity: S::f64s) -> S::mask64s {
    // The first and the last factor are never negative. NaN compares as not greater.
    let [a, b, c] = factor;
    (a.simd_gt(GREATEST_F32_FACTOR) | b.abs().simd_gt(GREATEST_F32_FACTOR))
        | (c.simd_gt(GREATEST_F32_FACTOR) | log2_opacity.simd_gt(GREATEST_F32_LOG2_OPACITY))
}
