//! The viewport transform from clip space to the framebuffer, snapping to 1/256 pixels, and clip codes.

use crate::state::{Rect, Viewport};

/// The number of sub-pixel units in a pixel.
pub(super) const ONE: i32 = 256;

/// The distance of the guard band from the framebuffer's corner, in pixels. Primitives are clipped in x and y only
/// beyond it. Up to this distance binary32 resolves 1/256 pixel, coordinates have 24 bits, and edge functions about 50.
pub(super) const GUARD: f64 = 32_768.0;

/// The least w for a division: its reciprocal is finite.
pub(super) const LEAST_W: f32 = f32::from_bits((127 - 120) << 23);

/// The bits of a clip code, which say against what a vertex must be clipped. A primitive whose vertices all share a bit
/// of [`code::OUTSIDE`] is invisible. A primitive whose vertices have no bit of [`code::CLIP`] need not be clipped.
pub(super) mod code {
    /// Beyond the guard band.
    pub const GUARD: u32 = 0xF;
    /// In front of the near plane.
    pub const NEAR: u32 = 1 << 4;
    /// Beyond the far plane.
    pub const FAR: u32 = 1 << 5;
    /// w is less than [`LEAST_W`].
    pub const BEHIND: u32 = 1 << 6;
    /// A coordinate is NaN or infinite: the primitive is dropped.
    pub const INVALID: u32 = 1 << 7;
    /// Left of, right of, above or below the view volume.
    pub const SIDES: [u32; 4] = [1 << 8, 1 << 9, 1 << 10, 1 << 11];
    /// Beyond any side of the view volume.
    pub const ANY_SIDE: u32 = 0xF << 8;
    /// The first user clip distance is negative. The next bits are for the other distances.
    pub const USER: u32 = 1 << 16;
    /// Any user clip distance is negative.
    pub const ANY_USER: u32 = 0xFF << 16;
    /// The first cull distance is negative. The next bits are for the other distances.
    pub const CULL: u32 = 1 << 24;
    /// Any cull distance is negative.
    pub const ANY_CULL: u32 = 0xFF << 24;
    /// The bits that make clipping necessary.
    pub const CLIP: u32 = GUARD | NEAR | FAR | BEHIND | INVALID | ANY_USER;
    /// The bits that make a primitive invisible if all its vertices share one.
    pub const OUTSIDE: u32 = NEAR | FAR | BEHIND | ANY_USER | ANY_SIDE | ANY_CULL;
}

/// A viewport as a scale and a translation of x, y and depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform {
    pub scale: [f32; 3],
    pub translate: [f32; 3],
    /// True if the near and far planes clip.
    pub clip_depth: bool,
    /// The normalized device coordinate of the near plane, 0 or -1; that of the far plane is 1.
    pub near: f32,
}

/// A vertex in the framebuffer.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WindowVertex {
    /// The position in pixels, not snapped.
    pub window: [f32; 2],
    /// The position in 1/256 pixels.
    pub snapped: [i32; 2],
    /// Depth after the viewport transform.
    pub depth: f32,
    /// 1 / w.
    pub inverse_w: f32,
}

/// The projections of 16 vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projections {
    pub window: [[f32; 16]; 2],
    pub snapped: [[i32; 16]; 2],
    pub depth: [f32; 16],
    pub inverse_w: [f32; 16],
    /// The clip codes; see [`code`].
    pub code: [u32; 16],
}

impl Transform {
    /// The results of [`Transform::project`] and [`Transform::code`] for 16 positions, in a loop that the compiler
    /// vectorizes.
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

    /// The transform of a draw without viewports.
    pub(super) const NONE: Self = Self { scale: [0.0; 3], translate: [0.0; 3], clip_depth: true, near: 0.0 };

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

    /// Divides by w and maps to the viewport. Each coordinate is rounded after the division, and once more after a
    /// fused multiplication and addition.
    #[inline(always)]
    pub(super) fn project(&self, [x, y, z, w]: [f32; 4]) -> WindowVertex {
        let inverse_w = 1.0 / w;
        let map = |ndc: f32, axis: usize| {
            let (scale, translate) = (self.scale[axis], self.translate[axis]);
            (f64::from(ndc) * f64::from(scale) + f64::from(translate)) as f32
        };
        let window = [map(x * inverse_w, 0), map(y * inverse_w, 1)];
        WindowVertex { window, snapped: [snap(window[0]), snap(window[1])], depth: map(z * inverse_w, 2), inverse_w }
    }

    /// The clip code of a vertex at this position. `window_vertex` is its projection.
    #[inline(always)]
    pub(super) fn code(&self, position: [f32; 4], window_vertex: &WindowVertex) -> u32 {
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
        let [wx, wy] = window_vertex.window;
        // Comparisons with NaN, which the division may give, are false.
        let inside = (wx.abs() <= guard) & (wy.abs() <= guard);
        code | bit(!inside & !behind, code::GUARD)
    }

    /// The coefficients (a, b) of a plane of the guard band (left, right, top, bottom): the distance inside is a times
    /// x or y, plus b times w.
    pub(super) fn guard_plane(&self, side: usize) -> [f64; 2] {
        let axis = side / 2;
        let (scale, translate) = (f64::from(self.scale[axis]), f64::from(self.translate[axis]));
        if side.is_multiple_of(2) { [scale, GUARD + translate] } else { [-scale, GUARD - translate] }
    }
}

/// Adding this to a number of magnitude below 2^51 rounds it to an integer, ties to even.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// The bound of the magnitude of snapped coordinates, in 1/256 pixels.
const FARTHEST: f64 = 16_777_216.0;

/// Snaps a window coordinate to 1/256 pixels: the distance from the centre of pixel 0 is rounded, ties to even.
#[inline(always)]
pub(super) fn snap(window: f32) -> i32 {
    let scaled = f64::from((window - 0.5) * ONE as f32);
    #[expect(clippy::manual_clamp, reason = "it would leave what is no number as it is")]
    let scaled = scaled.max(-FARTHEST).min(FARTHEST);
    // The integer is in the sum's low bits.
    (scaled + ROUND).to_bits() as i32 + ONE / 2
}

/// Snaps a window coordinate as [`snap`] does, but with ties away from zero, for lines and points.
pub(super) fn snap_away(window: f32) -> i32 {
    snap_length(window - 0.5) + ONE / 2
}

/// Snaps a length in pixels to 1/256 pixels, ties away from zero.
pub(super) fn snap_length(length: f32) -> i32 {
    let scaled = f64::from(length * ONE as f32).clamp(-FARTHEST, FARTHEST);
    (scaled + 0.5f64.copysign(scaled)) as i32
}

/// The pixels whose centres lie within a viewport. Its edges are snapped as vertices are.
pub(super) fn pixels(viewport: &Viewport) -> Rect {
    let span = |start: f32, length: f32| {
        let (a, b) = (snap(start), snap(start + length));
        let first = |edge: i32| (edge + ONE / 2 - 1) >> 8;
        let (first, end) = (first(a.min(b)), first(a.max(b)));
        (first, (end - first) as u32)
    };
    let (x, width) = span(viewport.x, viewport.width);
    let (y, height) = span(viewport.y, viewport.height);
    Rect { x, y, width, height }
}
