//! Splats: projected Gaussians as the rasterizer's nine numbers, and the data that belong to them.

use super::footprint::{TileFootprint, TileSpan};
use super::identity::Identity;
use super::lanes::GROUP;
use super::ray_depth::RayDepth;
use super::scratch::ScreenGaussians;
use super::surfel::Surfel;
use crate::stats::counters::Counters;
use devmem::host;
use fearless_simd::{Simd, prelude::*};

/// A projected Gaussian as the tile engine reads it, in one cache line.
///
/// At offset `d` pixels from the mean, `log2(alpha) = log2_opacity - u^2 - v^2` with `u = factor[0] d.x` and
/// `v = factor[1] d.x + factor[2] d.y`. The factor is the Cholesky factor of the conic, scaled for base 2.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct Splat {
    /// The mean in framebuffer pixels.
    pub mean: [f64; 2],
    /// The scaled Cholesky factor of the conic, in 1/px.
    pub factor: [f64; 3],
    /// The base-2 logarithm of the opacity.
    pub log2_opacity: f32,
    pub look: SplatLook,
    /// True if its exponent is a difference of numbers so large that binary32 would lose it.
    pub needs_f64: bool,
    /// True if it is wider than the period of a panorama: it then counts within half a period of its mean only, where
    /// its copies do not. Such a one is steep.
    pub exceeds_period: bool,
}

/// A splat's colour and depth: what compositing takes besides its alphas. They are copied as one vector.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub(crate) struct SplatLook {
    /// Red, green, blue.
    pub color: [f32; 3],
    /// The centre's depth as the depth attachment holds it, if the draw tests or writes depth.
    pub depth: u32,
}

impl Splat {
    /// The splat of lane `at` of a group, with its colour and its centre's depth.
    #[inline(always)]
    pub(super) fn new(flat: &ScreenGaussians, at: usize, color: [f32; 3], depth: u32) -> Self {
        Self {
            mean: [flat.mean[0][at], flat.mean[1][at]],
            factor: [flat.factor[0][at], flat.factor[1][at], flat.factor[2][at]],
            log2_opacity: flat.log2_opacity[at] as f32,
            look: SplatLook { color, depth },
            needs_f64: flat.steep.has(at),
            exceeds_period: false,
        }
    }
}

/// The greatest base-2 logarithm of the opacity for which exponents are computed in binary32. Their rounding error
/// grows with it.
const STEEP_LOG2_OPACITY: f64 = 4.0;

/// The greatest factor, in 1/px, for which exponents are computed in binary32. Pixels are up to 1.5 px from a block's
/// middle. A low-pass variance of 0.3 px^2 keeps all factors below 1.6.
const STEEP_FACTOR: f64 = 8.0;

/// The Gaussians whose exponents must be computed in binary64. The result depends on each Gaussian alone.
#[inline(always)]
pub(super) fn are_steep<S: Simd>(factor: [S::f64s; 3], log2_opacity: S::f64s) -> S::mask64s {
    // The first and the last factor are never negative. NaN compares as not greater.
    let [a, b, c] = factor;
    (a.simd_gt(STEEP_FACTOR) | b.abs().simd_gt(STEEP_FACTOR))
        | (c.simd_gt(STEEP_FACTOR) | log2_opacity.simd_gt(STEEP_LOG2_OPACITY))
}

/// The least factor, in 1/px, whose binary16 value has full precision.
pub(super) const LEAST_HALF_FACTOR: f64 = 1.0 / 16384.0;

/// The greatest `u^2 + v^2` that binary16 rasterization may accept where exact arithmetic accepts `room`.
///
/// With a unit roundoff of 2^-11, `u` and the two terms of `v` have an error of three units each, and `v` one more. The
/// terms of `v` are at most `|v| + 2 |factor[1] / factor[0]| |u|`, so that thin Gaussians, where they cancel, have the
/// largest error. Sums, exponent, logarithm, power and floor add less than a quarter.
pub(crate) fn binary16_headroom(factor: [f64; 3], room: f64) -> f64 {
    const UNIT: f64 = 1.0 / 2048.0;
    let [a, b, c] = factor.map(f64::abs);
    // NaN has no bound.
    if a.min(c) >= LEAST_HALF_FACTOR {
        let stretch = 1.0 + 8.0 * UNIT * (1.0 + b / a);
        (room + 0.25 + 0.02 * room.abs()) * stretch * stretch
    } else {
        f64::INFINITY
    }
}

/// The group and the place in the group of the splat with index `name`.
#[inline(always)]
pub(crate) fn locate(name: u32) -> (usize, usize) {
    (name as usize / GROUP, name as usize % GROUP)
}

/// The result of projecting a group.
#[derive(Debug, Default)]
pub(crate) struct ProjectedGroup {
    /// The splats, in the order of the draw.
    pub splats: Vec<Splat>,
    /// The depth key of each, and its number in the set, which orders equal keys.
    pub keys: Vec<[u32; 2]>,
    /// The coefficients of each one's depth along a ray, in the per-pixel order.
    pub ray_depths: Vec<RayDepth>,
    /// The disc of each, for 2D Gaussians.
    pub surfels: Vec<Surfel>,
    /// The identity of each splat, if a fragment program reads it.
    pub identities: Vec<Identity>,
    /// The tiles of each.
    pub reaches: Vec<TileFootprint>,
    /// The spans of footprints that do not store them inline.
    pub spans: Vec<TileSpan>,
    /// The counts of Gaussians that were skipped, by reason.
    pub counters: Counters,
    /// The copies a period to the right and to the left, by side.
    pub copies: Vec<ProjectedGroup>,
}

impl ProjectedGroup {
    pub(super) fn reserve(&mut self, count: usize) {
        host::reserve(&mut self.splats, count);
        host::reserve(&mut self.keys, count);
        host::reserve(&mut self.reaches, count);
    }
}
