//! From clip space to the framebuffer: the viewport transform, snapping to 1/256 pixels, and clip codes.

use crate::state::{Rect, Viewport};

/// Sub-pixel units of a pixel.
pub(super) const ONE: i32 = 256;

/// Primitives are clipped in x and y only where they reach farther than this from the framebuffer's corner, in
/// pixels. Up to here binary32 resolves 1/256 pixel, coordinates have 24 bits, and edge functions some 50.
pub(super) const GUARD: f64 = 32_768.0;

/// The least w that is divided by: its reciprocal is finite.
pub(super) const LEAST_W: f32 = f32::from_bits((127 - 120) << 23);

/// Why a vertex needs clipping, bit by bit. A primitive that shares a bit of [`code::OUTSIDE`] among all its
/// vertices is invisible; one whose vertices have no bit of [`code::CLIP`] need not be clipped.
pub(super) mod code {
    /// Beyond the guard band.
    pub const GUARD: u32 = 0xF;
    /// Before the near plane.
    pub const NEAR: u32 = 1 << 4;
    /// Beyond the far plane.
    pub const FAR: u32 = 1 << 5;
    /// w is too small.
    pub const BEHIND: u32 = 1 << 6;
    /// Not a number, or infinite: the primitive is dropped.
    pub const INVALID: u32 = 1 << 7;
    /// Left of, right of, above, below the view volume.
    pub const SIDES: [u32; 4] = [1 << 8, 1 << 9, 1 << 10, 1 << 11];
    /// Beyond any side of the view volume.
    pub const ANY_SIDE: u32 = 0xF << 8;
    /// The first user clip distance is negative; the others follow.
    pub const USER: u32 = 1 << 16;
    /// All user clip distances.
    pub const ANY_USER: u32 = 0xFF << 16;
    /// The first cull distance is negative; the others follow.
    pub const CULL: u32 = 1 << 24;
    /// All cull distances.
    pub const ANY_CULL: u32 = 0xFF << 24;
    /// What makes clipping necessary.
    pub const CLIP: u32 = GUARD | NEAR | FAR | BEHIND | INVALID | ANY_USER;
    /// What makes a primitive invisible if all vertices share it.
    pub const OUTSIDE: u32 = NEAR | FAR | BEHIND | ANY_USER | ANY_SIDE | ANY_CULL;
}

/// A viewport as a scale and a translation: x, y, depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform {
    pub scale: [f32; 3],
    pub translate: [f32; 3],
    /// Whether near and far planes clip.
    pub clip_depth: bool,
    /// The normalized device coordinate of the near plane, 0 or -1; that of the far plane is 1.
    pub near: f32,
}

/// A vertex in the framebuffer.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WindowVertex {
    /// Pixels, not snapped.
    pub window: [f32; 2],
    /// 1/256 pixels.
    pub snapped: [i32; 2],
    /// Depth after the viewport transform.
    pub depth: f32,
    /// 1 / w.
    pub inverse_w: f32,
}

/// What 16 vertices become.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projections {
    pub window: [[f32; 16]; 2],
    pub snapped: [[i32; 16]; 2],
    pub depth: [f32; 16],
    pub inverse_w: [f32; 16],
    /// See [`code`].
    pub code: [u32; 16],
}

impl Transform {
    /// [`Transform::project`] and [`Transform::code`] of 16 positions: a loop for the compiler to vectorize.
    #[inline(always)]
    pub(super) fn project_all(&self, [x, y, z, w]: &[[f32; 16]; 4]) -> Projections {
        let mut all = Projections {
            window: [[0.0; 16]; 2],
            snapped: [[0; 16]; 2],
            depth: [0.0; 16],
            inverse_w: [0.0; 16],
            code: [0; 16],
        };
        for lane in 0..16 {
            let position = [x[lane], y[lane], z[lane], w[lane]];
            let one = self.project(position);
            for axis in 0..2 {
                all.window[axis][lane] = one.window[axis];
                all.snapped[axis][lane] = one.snapped[axis];
            }
            all.depth[lane] = one.depth;
            all.inverse_w[lane] = one.inverse_w;
            all.code[lane] = self.code(position, &one);
        }
        all
    }

    /// What stands in where a draw has no viewport.
    pub(super) const NONE: Self = Self {
        scale: [0.0; 3],
        translate: [0.0; 3],
        clip_depth: true,
        near: 0.0,
    };

    pub(super) fn new(viewport: &Viewport, clip_depth: bool, negative_one_to_one: bool) -> Self {
        let (half_width, half_height) = (0.5 * viewport.width, 0.5 * viewport.height);
        let (first, last) = (viewport.min_depth, viewport.max_depth);
        let (near, scale, translate) = if negative_one_to_one {
            (-1.0, 0.5 * (last - first), 0.5 * (last + first))
        } else {
            (0.0, last - first, first)
        };
        Self {
            scale: [half_width, half_height, scale],
            translate: [half_width + viewport.x, half_height + viewport.y, translate],
            clip_depth,
            near,
        }
    }

    /// Divides by w and maps to the viewport. Each coordinate is rounded after the division and once more after
    /// multiplication and addition, which are fused.
    #[inline(always)]
    pub(super) fn project(&self, [x, y, z, w]: [f32; 4]) -> WindowVertex {
        let inverse_w = 1.0 / w;
        let map = |ndc: f32, axis: usize| {
            let (scale, translate) = (self.scale[axis], self.translate[axis]);
            (f64::from(ndc) * f64::from(scale) + f64::from(translate)) as f32
        };
        let window = [map(x * inverse_w, 0), map(y * inverse_w, 1)];
        WindowVertex {
            window,
            snapped: [snap(window[0]), snap(window[1])],
            depth: map(z * inverse_w, 2),
            inverse_w,
        }
    }

    /// Why a vertex at this position needs clipping; `projected` is its projection.
    #[inline(always)]
    pub(super) fn code(&self, position: [f32; 4], projected: &WindowVertex) -> u32 {
        let [x, y, z, w] = position;
        let bit = |condition: bool, bit: u32| if condition { bit } else { 0 };
        let finite = (x * 0.0 + y * 0.0) + (z * 0.0 + w * 0.0) == 0.0;
        let mut code = bit(!finite, code::INVALID);
        let behind = w < LEAST_W;
        code |= bit(behind, code::BEHIND);
        code |= bit(x < -w, code::SIDES[0]) | bit(x > w, code::SIDES[1]);
        code |= bit(y < -w, code::SIDES[2]) | bit(y > w, code::SIDES[3]);
        code |= bit(self.clip_depth & (z < self.near * w), code::NEAR);
        code |= bit(self.clip_depth & (z > w), code::FAR);
        let guard = GUARD as f32;
        let [wx, wy] = projected.window;
        // Comparisons are false for what the division made NaN.
        let inside = (wx.abs() <= guard) & (wy.abs() <= guard);
        code | bit(!inside & !behind, code::GUARD)
    }

    /// A plane of the guard band (left, right, top, bottom): a position's x or y, times the first, and w, times the
    /// second, add up to how far it is inside.
    pub(super) fn guard_plane(&self, side: usize) -> [f64; 2] {
        let axis = side / 2;
        let (scale, translate) = (f64::from(self.scale[axis]), f64::from(self.translate[axis]));
        if side.is_multiple_of(2) {
            [scale, GUARD + translate]
        } else {
            [-scale, GUARD - translate]
        }
    }
}

/// Adding this to a number of magnitude below 2^51 rounds it to an integer, ties to even.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Coordinates stay below this magnitude in 1/256 pixels, wherever they were.
const FARTHEST: f64 = 16_777_216.0;

/// Snaps a window coordinate to 1/256 pixels: the distance from the centre of pixel 0 is rounded, ties to even.
#[inline(always)]
pub(super) fn snap(window: f32) -> i32 {
    let scaled = f64::from((window - 0.5) * ONE as f32);
    #[expect(
        clippy::manual_clamp,
        reason = "it would leave what is no number as it is"
    )]
    let scaled = scaled.max(-FARTHEST).min(FARTHEST);
    // The sum's low bits are the integer.
    (scaled + ROUND).to_bits() as i32 + ONE / 2
}

/// As [`snap`], with ties away from zero, as lines and points are snapped.
pub(super) fn snap_away(window: f32) -> i32 {
    snap_length(window - 0.5) + ONE / 2
}

/// Snaps a length in pixels to 1/256 pixels, ties away from zero.
pub(super) fn snap_length(length: f32) -> i32 {
    let scaled = f64::from(length * ONE as f32).clamp(-FARTHEST, FARTHEST);
    (scaled + 0.5f64.copysign(scaled)) as i32
}

/// The pixels whose centres lie within a viewport, edges snapped as vertices are.
pub(super) fn pixels(viewport: &Viewport) -> Rect {
    let span = |start: f32, length: f32| {
        let (a, b) = (snap(start), snap(start + length));
        let first = |edge: i32| (edge + ONE / 2 - 1) >> 8;
        let (first, end) = (first(a.min(b)), first(a.max(b)));
        (first, (end - first) as u32)
    };
    let (x, width) = span(viewport.x, viewport.width);
    let (y, height) = span(viewport.y, viewport.height);
    Rect {
        x,
        y,
        width,
        height,
    }
}
