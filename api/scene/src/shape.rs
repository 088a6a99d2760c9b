//! One Gaussian, apart from its position and its colour.

use bytemuck::{Pod, Zeroable};

/// What one Gaussian is, apart from its position and its colour: 32 bytes, as a vertex buffer
/// holds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GaussianShape {
    /// Standard deviations along the Gaussian's own axes, in the scene's units (not logarithms).
    pub scale: [f32; 3],
    /// Rotation from the Gaussian's own axes to the scene's: a quaternion w, x, y, z as the file
    /// stores it. It need not be normalised; the device does that.
    pub rotation: [f32; 4],
    /// Opacity at the centre, 0 to 1 (not a logit).
    pub opacity: f32,
}

/// The logistic function, evaluated in binary64 and rounded once.
pub fn sigmoid(logit: f64) -> f32 {
    (1.0 / (1.0 + (-logit).exp())) as f32
}
