//! The area that a picture covers, and its range of depths.

use crate::linear::widened;

/// A viewport, in pixels of the framebuffer. Its height may be negative.
#[derive(Clone, Copy, Debug)]
pub struct Viewport {
    /// The left edge.
    pub x: f32,
    /// The upper edge, or the lower one if the height is negative.
    pub y: f32,
    /// The width.
    pub width: f32,
    /// The height.
    pub height: f32,
    /// The framebuffer depth of a depth of 0.
    pub min_depth: f32,
    /// The framebuffer depth of a depth of 1.
    pub max_depth: f32,
}

impl Viewport {
    /// A viewport over a whole attachment of width x height pixels.
    pub fn whole(width: usize, height: usize) -> Self {
        Self { x: 0.0, y: 0.0, width: width as f32, height: height as f32, min_depth: 0.0, max_depth: 1.0 }
    }

    /// Width and height, without signs.
    pub(crate) fn size(&self) -> [f64; 2] {
        [f64::from(self.width), f64::from(self.height).abs()]
    }

    /// The upper left corner of the area.
    pub(crate) fn origin(&self) -> [f64; 2] {
        [f64::from(self.x), f64::from(self.y) + f64::from(self.height).min(0.0)]
    }

    /// A camera's depth as the viewport maps it.
    pub(crate) fn mapped(&self, depth: f64) -> f64 {
        let [least, greatest] = widened([self.min_depth, self.max_depth]);
        least + depth.clamp(0.0, 1.0) * (greatest - least)
    }
}
