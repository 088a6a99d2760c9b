//! The interface of implementations under test.

use gaurast_oracle::oracle::Stored;
use gaurast_oracle::oracle::error_model::PrecisionClass;

use gaurast_testkit::Gpu;

use crate::draw::Draw;
use crate::picture::Picture;
use crate::program::Program;

/// The reason for which drawing failed, or there is nothing to test.
#[derive(Debug)]
pub struct Error(pub String);

/// An implementation under test: a driver's device, or any other renderer.
pub trait Implementation {
    /// The name of the implementation.
    fn name(&self) -> &str;

    /// The class of precision that it keeps.
    fn precision(&self) -> PrecisionClass {
        PrecisionClass::Full
    }

    /// The first feature, limit or format that a draw needs and the implementation lacks.
    fn missing(&self, draw: &Draw) -> Option<&'static str>;

    /// The first feature, limit or format that a program needs and the implementation lacks.
    fn missing_for(&self, _program: &Program) -> Option<&'static str> {
        Some("Vulkan commands")
    }

    /// The device that executes programs, if it is one.
    fn vulkan(&self) -> Option<&Gpu> {
        None
    }

    /// Draws. `stored` is the initial contents of the depth and stencil attachment.
    ///
    /// # Errors
    /// If drawing fails.
    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error>;
}
