//! Comparison of an image with a reference.
//!
//! There are two kinds of comparison:
//! - The accuracy contract. [`Accuracy`] tells if an image keeps it, given the oracle's
//!   [`Reference`](crate::oracle::Reference). [`assert_contract`] makes a test of it.
//! - The visible difference. [`Statistics`] gives the greatest difference, the 99.9th percentile, PSNR and FLIP, for
//!   people and for tables of benchmarks.
//!
//! Images are slices of premultiplied red, green, blue and alpha, row by row from the top.

mod accuracy;
mod distance;
mod picture;

pub use accuracy::{Accuracy, Limits, assert_contract};
pub use gaurast_picture::Statistics;
pub use picture::{PictureError, write_difference};
