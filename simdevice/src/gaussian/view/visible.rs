//! The pixels that a draw may touch.

use crate::state::Rect;

/// The pixels that a draw may touch: a half-open rectangle in framebuffer coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Visible {
    pub left: i64,
    pub top: i64,
    pub right: i64,
    pub bottom: i64,
}

impl Visible {
    /// The first and the last pixel along an axis.
    #[inline(always)]
    pub fn pixels(&self, axis: usize) -> [f64; 2] {
        let [first, end] = [[self.left, self.right], [self.top, self.bottom]][axis];
        [first as f64, (end - 1) as f64]
    }
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
