//! Conformance cases, which test any implementation of `VK_GAURAST_gaussian_primitive_topology` against the extension's
//! text.
//!
//! Most cases are a [`Draw`]: plain data from which the commands, the required features and the oracle's answer are
//! derived. Others are a [`Program`]: Vulkan commands, and the draws whose pictures they must leave, however they are
//! recorded. Cases are made from tables, by chapter ([`cases`]). [`run`] lets an [`Implementation`] draw a case, and
//! compares the attachments with the binary64 oracle's envelope, within the distance that the text allows. The program
//! `gaurast-conformance` runs the cases on any driver; the workspace's tests run them on this driver.

pub mod cases;
pub mod device;
pub mod draw;
pub mod features;
pub mod implementation;
pub mod judge;
pub mod mistakes;
pub mod mutants;
pub mod oracle;
mod picture;
mod program;
mod record;
mod rendering;
pub mod report;
mod resolved;
mod run;
pub mod second;
mod stage;

pub use cases::{Case, all};
pub use device::Device;
pub use draw::Draw;
pub use implementation::{Error, Implementation};
pub use mistakes::{MISTAKES, Mistake};
pub use oracle::Oracle;
pub use picture::Picture;
pub use program::Program;
pub use run::{Expectation, Failure, Outcome, missing, run};
pub use second::Second;

/// Opens the implementation with this name: `second`, `oracle`, or a driver as [`Device::open`] accepts it.
///
/// # Errors
/// If there is no such implementation.
pub fn open(name: &str) -> Result<Box<dyn Implementation>, Error> {
    match name {
        "second" => Ok(Box::new(Second)),
        "oracle" => Ok(Box::new(Oracle::default())),
        driver => Ok(Box::new(Device::open(driver)?)),
    }
}
