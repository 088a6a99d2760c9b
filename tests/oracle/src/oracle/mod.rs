//! The reference for Gaussian draws, in binary64.
//!
//! Every fast kernel is compared with it. It follows the seven normative steps of the extension's specification one by
//! one and shares no code with the driver or the device. It prefers readable code to fast code:
//!
//! | step | what | where |
//! |---|---|---|
//! | before | attributes from logarithms and logits | [`activation`] |
//! | before | attributes from the integers of compressed files | [`decoding`] |
//! | 1, 2 | what is skipped, and under which reason | [`project`] |
//! | 3, 4 | mean, covariance, determinant, opacity compensation | [`project`] |
//! | 4 | the compensated opacity that a cut-off may know | [`compensation`] |
//! | 3 | the distortion of a lens | [`lens`] |
//! | 1 to 5 | the same for outputs of a vertex shader | [`shaded`] |
//! | 5 | colour from spherical harmonics | [`spherical_harmonics`] |
//! | 6 | alpha at a pixel centre, and where it is cut off | [`splat`] |
//! | 7 | compositing front to back | [`pixel`] |
//! | 6, 7 | the same in binary16 | [`render_binary16`] |
//! | 7 | the per-pixel order | [`rays`], [`own_axes`] |
//! | 3, 6 | 2D Gaussians | [`surfel`] |
//! | then | the inputs of a resolve shader | [`resolve`] |
//! | then | depth and stencil tests, sample by sample | [`sample_tests`] |
//!
//! Rules that the text gives in a word or a number are data ([`Rules`]), so that the conformance cases can be held against an oracle
//! that follows other rules.
//!
//! The inputs are attributes and camera *after* conversion to binary32 (the eye: binary64), as the device gets them.
//! Each of them converts exactly to `f64`. Nothing is rounded again but the depth key, which the specification rounds.
//!
//! # Decisions that cannot be required of binary32
//!
//! Two comparisons decide if a Gaussian contributes to a pixel: `alpha >= alphaFloor` and `T (1 - alpha) <
//! transmittanceFloor`. If the two sides differ by less than the error of a correct binary32 implementation
//! ([`error_model`]), either result is right. The reference then calls the pixel *undecidable* and follows both
//! branches, up to [`MAX_DECISIONS`] times along one path. Such a pixel has several outcomes, the first of which is the
//! binary64 result. [`crate::compare`] compares an image with all of them.
//!
//! A third comparison, `T >= 1/2`, selects the Gaussian that is a pixel's median. It changes nothing else, so a pixel
//! keeps a list of all its possible medians.
//!
//! In the per-pixel order, neighbours whose depths along the ray may round either way are followed in both orders
//! ([`rays`]).
//!
//! A Gaussian whose mean is very near the fold of a lens, or behind a place that may be one, may be drawn or not ([`lens`]).
//!
//! With a relaxed precision ([`error_model::PrecisionClass`]) the granted errors are greater, so that orders of Gaussians and
//! depth tests are undecidable, too, and are followed both ways.
//!
//! Four more decisions exist and are not followed both ways:
//! - The depth key is `t.z` rounded to binary32. If the binary64 value is within its own error of the midpoint of two
//!   binary32 values, the key could be either. This happens to about one Gaussian in 10^8 and matters only if another
//!   Gaussian has one of these two keys. Such Gaussians are counted ([`Reference::undecidable_keys`]).
//! - A determinant may be zero in exact arithmetic and not in binary64, or the reverse. This needs `lowPass = 0` and a
//!   Gaussian of no thickness.
//! - A sigma point may be seen or not, or lie in the picture or not, within the rounding of binary64.
//! - The clamps (ceiling of alpha, `u` and `v`, colour) are continuous: both sides give the same value to within the
//!   error.

pub mod activation;
mod binary16;
pub mod compensation;
mod cut_off;
pub mod decoding;
pub mod error_model;
mod inputs;
mod instance;
pub mod lens;
pub mod own_axes;
mod panorama;
pub mod pixel;
pub mod project;
mod projection;
pub mod rays;
mod render;
pub mod resolve;
pub mod rules;
pub mod sample_tests;
pub mod shaded;
mod skips;
pub mod spherical_harmonics;
pub mod splat;
pub mod surfel;
mod unscented;
mod vectors;

#[cfg(test)]
mod tests;

pub use binary16::render_binary16;
pub use inputs::{
    OracleCamera, OracleCutOff, OracleGeometry, OracleInstance, OracleModel, OracleOrder, OracleScene,
    OracleSigmaPoints, OracleState,
};
pub use lens::OracleLens;
pub use pixel::MAX_DECISIONS;
pub use render::{Reference, render_bounded, render_literal};
pub use rules::Rules;
pub use sample_tests::{
    DepthCodes, OracleDepthFormat, OracleStencil, OracleTests, Stored, TestedReference, render_tested,
};
pub use skips::{SkipCounts, SkipReason};
