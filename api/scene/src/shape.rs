//! A Gaussian's scale, rotation and opacity.

use bytemuck::{Pod, Zeroable};

/// A Gaussian's scale, rotation and opacity: 32 bytes, in the layout of a vertex buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GaussianShape {
    /// Standard deviations along the Gaussian's own axes, in the scene's units (not logarithms).
    pub scale: [f32; 3],
    /// Rotation from the Gaussian's own axes to the scene's: a quaternion w, x, y, z as the file stores it. It need not
    /// be normalised; the device normalises it.
    pub rotation: [f32; 4],
    /// Opacity at the centre, 0 to 1 (not a logit).
    pub opacity: f32,
}

/// The logistic function, evaluated in binary64 and rounded once.
pub fn sigmoid(logit: f64) -> f32 {
    (1.0 / (1.0 + libm::exp(-logit))) as f32
}
