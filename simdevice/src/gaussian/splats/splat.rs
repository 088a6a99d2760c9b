//! The splat: a projected Gaussian as the rasterizer's nine numbers.

use crate::gaussian::lanes::GROUP;

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
    /// its copies do not. Such a one needs binary64.
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

/// The place of a splat among those of a set: lists of splats hold it as a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SplatIndex {
    pub(crate) group: usize,
    /// The place in the group.
    pub(crate) place: usize,
}

impl SplatIndex {
    /// The index that a number stands for: the group's number times [`GROUP`], plus the place.
    #[inline(always)]
    pub(crate) fn new(number: u32) -> Self {
        Self { group: number as usize / GROUP, place: number as usize % GROUP }
    }

    /// The splat's item of `items`, which are by group, in the order of the splats.
    #[inline(always)]
    pub(crate) fn of<T>(self, items: &[impl AsRef<[T]>]) -> &T {
        &items[self.group].as_ref()[self.place]
    }
}
