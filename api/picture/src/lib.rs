//! Pictures of 32-bit floats: files that are written atomically, and differences between pictures.

mod atomic;
mod color;
mod files;
#[cfg(feature = "metrics")]
pub mod flip;
mod picture;
mod read;
mod size;
#[cfg(feature = "metrics")]
mod ssim;
#[cfg(feature = "metrics")]
mod statistics;

pub use atomic::{folder, write_atomically};
pub use color::Background;
pub use files::{
    Colors, DEFAULT_QUALITY, Encoding, OutputError, PictureFormat, check, check_place, encode, rgb, write,
    write_encoded,
};
pub use picture::Picture;
pub use read::read;
pub use size::Size;
#[cfg(feature = "metrics")]
pub use ssim::ssim;
#[cfg(feature = "metrics")]
pub use statistics::Statistics;
