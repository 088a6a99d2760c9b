//! Cases that hold any implementation of `VK_GAURAST_gaussian_primitive_topology` against the extension's text.
//!
//! A [`Case`] is a [`Draw`]: plain data of which both the commands and the oracle's answer follow, and the
//! features that it needs, too. Cases are made from tables, chapter by chapter ([`cases`]). [`Case::run`] draws one on a
//! [`Device`] and judges what the attachments hold by the binary64 oracle's envelope and the distance that the text allows.
//! The program `gaurast-conformance` runs them on any driver; the workspace's tests run the same ones on this driver.

pub mod cases;
pub mod device;
pub mod draw;
pub mod judge;
#[cfg(feature = "mistakes")]
pub mod mistakes;
pub mod record;
pub mod report;
pub mod second;

pub use cases::{Case, all};
pub use device::Device;
pub use draw::Draw;
pub use second::Second;

use std::panic::{AssertUnwindSafe, catch_unwind};

use device::Error;
use gaurast_oracle::compare::write_difference;
use gaurast_oracle::oracle::Stored;
use judge::{Expected, expected, stored_before};
use record::Picture;

/// What is held against the text: a driver's device, or anything else that draws.
pub trait Implementation {
    /// What it calls itself.
    fn name(&self) -> &str;

    /// The first feature, limit or format that a draw needs and it lacks.
    fn missing(&self, draw: &Draw) -> Option<&'static str>;

    /// Draws, where the depth and stencil attachment holds what is `stored`.
    ///
    /// # Errors
    /// If it fails to.
    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error>;
}

/// The implementation of a name: `second`, or a driver as [`Device::open`] takes it.
///
/// # Errors
/// If there is none.
pub fn open(name: &str) -> Result<Box<dyn Implementation>, Error> {
    match name {
        "second" => Ok(Box::new(Second)),
        driver => Ok(Box::new(Device::open(driver)?)),
    }
}

/// What came of a case.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The picture is right, and this far from the envelope.
    Pass(f64),
    /// Something is wrong.
    Fail(Failure),
    /// The device lacks this feature, limit or format.
    NotSupported(&'static str),
}

/// A case that failed.
#[derive(Clone, Debug)]
pub struct Failure {
    /// What is wrong.
    pub message: String,
    /// What was expected and what was drawn, if anything was.
    picture: Option<(Box<Expected>, Vec<[f32; 4]>)>,
}

impl Failure {
    /// Writes a picture of three panels, expected, drawn, and how far it is from the envelope, as `path`; returns whether
    /// there is one.
    pub fn write(&self, path: &std::path::Path) -> bool {
        self.picture.as_ref().is_some_and(|(expected, drawn)| {
            write_difference(path, drawn, &expected.color, expected.distance).is_ok()
        })
    }
}

impl Case {
    /// Has an implementation draw the case, and judges the picture. What it does not support is not drawn.
    pub fn run(&self, device: &dyn Implementation) -> Outcome {
        let draw = self.draw();
        if let Some(feature) = device.missing(&draw) {
            return Outcome::NotSupported(feature);
        }
        let before = stored_before(&draw);
        let nothing = |message: String| {
            Outcome::Fail(Failure {
                message,
                picture: None,
            })
        };
        let drawn = catch_unwind(AssertUnwindSafe(|| device.draw(&draw, &before)));
        let picture = match drawn {
            Ok(Ok(picture)) => picture,
            Ok(Err(error)) => return nothing(error.0),
            Err(_) => return nothing("the driver panics".to_owned()),
        };
        let expected = expected(&draw, &before);
        match expected.fault(&picture) {
            None => Outcome::Pass(expected.verdict(&picture).max_distance),
            Some(message) => Outcome::Fail(Failure {
                message,
                picture: Some((Box::new(expected), picture.color)),
            }),
        }
    }
}
