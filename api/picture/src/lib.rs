//! Pictures of 32-bit floats: files that appear whole or not at all, and how much two pictures differ.

mod atomic;
mod files;
#[cfg(feature = "metrics")]
pub mod flip;
mod picture;
mod size;
#[cfg(feature = "metrics")]
mod statistics;

pub use atomic::{folder, write_atomically};
pub use files::{OutputError, PictureFormat, check, write};
pub use picture::Picture;
pub use size::Size;
#[cfg(feature = "metrics")]
pub use statistics::Statistics;
