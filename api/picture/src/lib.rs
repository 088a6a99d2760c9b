//! Pictures of 32-bit floats: files that are written atomically, and differences between pictures.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use gaurast_picture::Picture;
//!
//! let grey = Picture { width: 2, height: 1, pixels: vec![[0.5, 0.5, 0.5, 1.0]; 2] };
//! let path = std::env::temp_dir().join("grey.exr");
//! gaurast_picture::write(&path, &grey, None)?;
//! assert_eq!(gaurast_picture::read(&path)?.pixels, grey.pixels);
//! # Ok(())
//! # }
//! ```

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod atomic;
mod color;
mod depth;
mod files;
#[cfg(feature = "metrics")]
#[allow(clippy::disallowed_methods, reason = "a metric: it judges pictures and is no part of one")]
pub mod flip;
mod picture;
mod read;
#[cfg(feature = "metrics")]
mod resize;
mod size;
#[cfg(feature = "metrics")]
#[allow(clippy::disallowed_methods, reason = "a metric: it judges pictures and is no part of one")]
mod ssim;
#[cfg(feature = "metrics")]
#[allow(clippy::disallowed_methods, reason = "a metric: it judges pictures and is no part of one")]
mod statistics;
#[cfg(feature = "metrics")]
mod tiles;

pub use atomic::{folder, write_atomically};
pub use color::Background;
pub use depth::{DepthFormat, DepthMap, write_depths};
pub use files::{
    Colors, DEFAULT_QUALITY, EncodeError, Encoding, OutputError, PictureFormat, check, check_place, encode, rgb, write,
    write_encoded,
};
pub use picture::Picture;
pub use read::{ReadError, read};
#[cfg(feature = "metrics")]
pub use resize::resized;
pub use size::Size;
#[cfg(feature = "metrics")]
pub use ssim::Ssim;
#[cfg(feature = "metrics")]
pub use statistics::Statistics;
