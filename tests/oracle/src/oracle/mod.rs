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
//! | 6 | alpha at a pixel centre, and where it is cut off | [`splat`] |
//! | 7 | compositing front to back | [`pixel`] |
//! | 6, 7 | the same in binary16 | [`render_binary16`] |
//! | 7 | the per-pixel order | [`rays`], [`own_axes`] |
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
mod cut_off;
pub mod error_model;
mod inputs;
mod instance;
pub mod own_axes;
mod panorama;
pub mod pixel;
pub mod project;
mod projection;
pub mod rays;
mod render;
pub mod resolve;
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
    OracleCamera, OracleCutOff, OracleGeometry, OracleInstance, OracleModel, OracleOrder,
    OracleScene, OracleState,
};
pub use pixel::MAX_DECISIONS;
pub use render::{Reference, render_bounded, render_literal};
pub use sample_tests::{
    OracleDepthFormat, OracleStencil, OracleTests, Stored, TestedReference, render_tested,
};
pub use skips::{SkipCounts, SkipReason};
