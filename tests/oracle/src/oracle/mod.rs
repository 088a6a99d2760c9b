//! What a Gaussian draw means, in binary64 and without haste.
//!
//! This is the reference that every fast kernel is held against. It follows the seven normative
//! steps of the extension's specification one by one, shares no code with the driver or the
//! device, and prefers the form that can be read over the form that runs:
//!
//! | step | what | where |
//! |---|---|---|
//! | before | attributes of logarithms and logits | [`activation`] |
//! | 1, 2 | what is skipped, and under which reason | [`project`] |
//! | 3, 4 | mean, covariance, determinant, opacity compensation | [`project`] |
//! | 1 to 5 | of what a vertex shader has projected | [`shaded`] |
//! | 5 | colour from spherical harmonics | [`spherical_harmonics`] |
//! | 6, 7 | alpha at a pixel centre, compositing front to back | [`pixel`] |
//! | 6, 7 | the same in binary16 | [`render_binary16`] |
//! | 7 | the per-pixel order | [`rays`] |
//! | 3, 6 | 2D Gaussians | [`surfel`] |
//! | then | what a resolve shader reads | [`resolve`] |
//! | then | depth and stencil, sample by sample | [`sample_tests`] |
//!
//! The inputs are attributes and camera *after* conversion to binary32 (the eye: binary64), which
//! is what the device is given too; every one of them converts exactly to `f64`, and nothing is
//! rounded again but the depth key, which the specification rounds.
//!
//! # Decisions that binary32 cannot be held to
//!
//! Two comparisons decide whether a Gaussian counts at a pixel: `alpha >= alphaFloor` and
//! `T (1 - alpha) < transmittanceFloor`. Where the two sides differ by less than an honest
//! binary32 implementation may err ([`error_model`]), the reference does not say which way is
//! right. It calls the pixel *undecidable* and follows both, up to [`MAX_DECISIONS`] times along
//! one path. A pixel then has several outcomes, the first of which is what binary64 says;
//! [`crate::compare`] holds an image against all of them.
//!
//! A third one, `T >= 1/2`, says which Gaussian is a pixel's median; nothing else follows from it, so a pixel
//! simply has every median that it may have.
//!
//! In the per-pixel order, neighbours whose depths along the ray may round either way are followed in both orders
//! ([`rays`]).
//!
//! Three more decisions exist and are not followed both ways:
//! - the depth key is `t.z` rounded to binary32. Where the binary64 value lies within its own
//!   rounding error of the middle between two binary32 values, the key could be either; that
//!   happens to about one Gaussian in 10^8 and matters only if another one has just that key. Such
//!   Gaussians are counted ([`Reference::undecidable_keys`]).
//! - a determinant that is zero in exact arithmetic and not in binary64, or the reverse, needs
//!   `lowPass = 0` and a Gaussian of no thickness.
//! - the clamps (ceiling of alpha, `u` and `v`, colour) are continuous: either side gives the same
//!   value to within the error itself.

pub mod activation;
mod binary16;
pub mod error_model;
mod instance;
mod panorama;
pub mod pixel;
pub mod project;
pub mod rays;
mod render;
pub mod resolve;
pub mod sample_tests;
pub mod shaded;
pub mod spherical_harmonics;
pub mod surfel;
mod unscented;

#[cfg(test)]
mod tests;

pub use binary16::render_binary16;
pub use pixel::MAX_DECISIONS;
pub use render::{Reference, render_bounded, render_literal};
pub use sample_tests::{
    OracleDepthFormat, OracleStencil, OracleTests, Stored, TestedReference, render_tested,
};

/// The Gaussians of a draw, in primitive order (by draw, instance, position in the draw).
///
/// All slices but `sh` have one entry per Gaussian.
#[derive(Clone, Copy, Debug)]
pub struct OracleScene<'a> {
    /// Centres in world space.
    pub positions: &'a [[f32; 3]],
    /// Standard deviations along the Gaussian's own axes (not their logarithms).
    pub scales: &'a [[f32; 3]],
    /// Rotations from the Gaussian's axes to world space, as quaternions `w, x, y, z` of any
    /// length but zero.
    pub rotations: &'a [[f32; 4]],
    /// Opacities (after the sigmoid); more than 1 is allowed.
    pub opacities: &'a [f32],
    /// Spherical harmonics coefficients, `(stored_degree + 1)^2` red-green-blue triples for each
    /// Gaussian, one Gaussian after the other, in the order of 3DGS.
    pub sh: &'a [[f32; 3]],
    /// Degree of what `sh` holds, 0 to 4.
    pub stored_degree: u32,
    /// Degree that the pipeline asks for; the lower of the two is drawn.
    pub requested_degree: u32,
    /// The model matrix and the factor of the opacity of each Gaussian, or nothing.
    pub instances: &'a [OracleInstance],
}

/// What places a copy of a Gaussian in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleInstance {
    /// The rows of a matrix from model to world space.
    pub matrix: [[f32; 4]; 3],
    /// The factor of the opacity.
    pub opacity: f32,
}

impl Default for OracleInstance {
    fn default() -> Self {
        Self {
            matrix: [
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
            ],
            opacity: 1.0,
        }
    }
}

impl OracleScene<'_> {
    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether the draw has no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The degree that is drawn.
    pub fn degree(&self) -> u32 {
        self.stored_degree.min(self.requested_degree)
    }

    /// The coefficients of Gaussian `index` up to the degree that is drawn.
    fn coefficients(&self, index: usize) -> &[[f32; 3]] {
        let stored = spherical_harmonics::coefficient_count(self.stored_degree);
        let drawn = spherical_harmonics::coefficient_count(self.degree());
        &self.sh[index * stored..][..drawn]
    }
}

/// How a camera projects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OracleModel {
    /// Perspective.
    #[default]
    Pinhole,
    /// Parallel.
    Orthographic,
    /// Equidistant fisheye.
    Fisheye,
    /// Longitude and latitude of all directions.
    Equirectangular,
}

/// What a Gaussian is in space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OracleGeometry {
    /// A volume.
    #[default]
    Volume,
    /// A flat disc; the third scale is not read.
    Surfel,
}

/// What Gaussians are sorted by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OracleOrder {
    /// The depth variable.
    #[default]
    ViewDepth,
    /// The distance from the eye.
    RadialDistance,
    /// The order of the draw.
    Primitive,
    /// At each pixel, the depth at which a Gaussian is greatest on the pixel's ray.
    PerPixel,
}

/// A camera and the viewport that it fills, as `VkGaussianCameraGAURAST` holds them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleCamera {
    /// How it projects.
    pub model: OracleModel,
    /// Width of the viewport in pixels.
    pub width: u32,
    /// Height of the viewport in pixels.
    pub height: u32,
    /// World to camera, row-major; the camera looks along +z, +x is right and +y is down.
    pub rotation: [f32; 9],
    /// Where the camera is in world space.
    pub eye: [f64; 3],
    /// Focal lengths in pixels (per unit of length, or per radian).
    pub focal: [f32; 2],
    /// Principal point in pixels from the viewport's upper left corner.
    pub principal: [f32; 2],
    /// Gaussians are drawn where `near < z`.
    pub near: f32,
    /// Gaussians are drawn where `z < far`.
    pub far: f32,
}

/// The pipeline's Gaussian state. The defaults are the extension's, which are those of 3DGS.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleState {
    /// Variance in px^2 added to both axes of the projected covariance.
    pub low_pass: f32,
    /// A Gaussian contributes to a pixel where its alpha is at least this.
    pub alpha_floor: f32,
    /// Alpha is at most this.
    pub alpha_ceiling: f32,
    /// A pixel is finished before the Gaussian that would bring its transmittance below this.
    pub transmittance_floor: f32,
    /// Whether opacity makes up for the area that the low-pass filter adds.
    pub opacity_compensated: bool,
    /// Whether Gaussians are projected by the unscented transform.
    pub unscented: bool,
    /// What Gaussians are.
    pub geometry: OracleGeometry,
    /// What Gaussians are sorted by.
    pub order: OracleOrder,
}

impl Default for OracleState {
    fn default() -> Self {
        Self {
            low_pass: 0.3,
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: 0.99,
            transmittance_floor: 1e-4,
            opacity_compensated: false,
            unscented: false,
            geometry: OracleGeometry::Volume,
            order: OracleOrder::ViewDepth,
        }
    }
}

/// Why a Gaussian is not drawn at all. A Gaussian is counted under the first reason that holds,
/// in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkipReason {
    /// A position, scale, quaternion, opacity or coefficient of the drawn degree is not finite.
    NonFinite,
    /// All four components of the quaternion are zero.
    ZeroQuaternion,
    /// A scale is below zero.
    NegativeScale,
    /// The opacity, before compensation, is below the alpha floor.
    OpacityBelowFloor,
    /// `near < z` does not hold.
    Near,
    /// `z < far` does not hold.
    Far,
    /// The determinant of the projected covariance is not positive and finite, or the model matrix is singular.
    DegenerateCovariance,
}

/// How many Gaussians were skipped, by the first reason that holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs, reason = "the fields are the reasons of `SkipReason`")]
pub struct SkipCounts {
    pub non_finite: usize,
    pub zero_quaternion: usize,
    pub negative_scale: usize,
    pub opacity_below_floor: usize,
    pub near: usize,
    pub far: usize,
    pub degenerate_covariance: usize,
}

impl SkipCounts {
    /// Counts one Gaussian.
    fn count(&mut self, reason: SkipReason) {
        *match reason {
            SkipReason::NonFinite => &mut self.non_finite,
            SkipReason::ZeroQuaternion => &mut self.zero_quaternion,
            SkipReason::NegativeScale => &mut self.negative_scale,
            SkipReason::OpacityBelowFloor => &mut self.opacity_below_floor,
            SkipReason::Near => &mut self.near,
            SkipReason::Far => &mut self.far,
            SkipReason::DegenerateCovariance => &mut self.degenerate_covariance,
        } += 1;
    }

    /// All that were skipped.
    pub fn total(&self) -> usize {
        self.non_finite
            + self.zero_quaternion
            + self.negative_scale
            + self.opacity_below_floor
            + self.near
            + self.far
            + self.degenerate_covariance
    }
}
