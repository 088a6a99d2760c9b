//! Holding an image against a reference.
//!
//! Two questions, kept apart:
//! - *Does it keep the accuracy contract?* [`verdict`] answers yes or no, from the oracle's
//!   [`Reference`](crate::oracle::Reference); [`assert_contract`] makes a test of it.
//! - *How different do two pictures look?* [`Statistics`] says so for people and benchmark tables:
//!   greatest difference, 99.9th percentile, PSNR and FLIP.
//!
//! Images are slices of premultiplied red, green, blue and alpha, row by row from the top.

mod distance;
mod picture;
mod verdict;

pub use gaurast_picture::Statistics;
pub use picture::{PictureError, write_difference};
pub use verdict::{Limits, Verdict, assert_contract, verdict};
