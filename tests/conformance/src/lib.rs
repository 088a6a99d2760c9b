//! Cases that hold any implementation of `VK_GAURAST_gaussian_primitive_topology` against the extension's text.
//!
//! A [`Case`] is a [`Draw`]: plain data of which both the commands and the oracle's answer follow, and the features that it
//! needs, too. Cases are made from tables, chapter by chapter ([`cases`]). [`run`] has an [`Implementation`] draw one, and judges
//! what the attachments hold by the binary64 oracle's envelope and the distance that the text allows.
//! The program `gaurast-conformance` runs them on any driver; the workspace's tests run the same ones on this driver.

pub mod cases;
pub mod device;
pub mod draw;
pub mod driver;
pub mod implementation;
pub mod judge;
#[cfg(feature = "mistakes")]
pub mod mistakes;
pub mod record;
pub mod report;
mod resolved;
mod run;
pub mod second;

pub use cases::{Case, all};
pub use draw::Draw;
pub use driver::Driver;
pub use implementation::{Implementation, Picture};
pub use run::{Failure, Outcome, run};
pub use second::Second;

use device::Error;

/// The implementation of a name: `second`, or a driver as [`Driver::open`] takes it.
///
/// # Errors
/// If there is none.
pub fn open(name: &str) -> Result<Box<dyn Implementation>, Error> {
    match name {
        "second" => Ok(Box::new(Second)),
        driver => Ok(Box::new(Driver::open(driver)?)),
    }
}
