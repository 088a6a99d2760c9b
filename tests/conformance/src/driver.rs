//! A driver's device as an implementation under test.

use gaurast_oracle::oracle::Stored;

use crate::device::{Device, Error};
use crate::draw::Draw;
use crate::implementation::{Implementation, Picture};
use crate::record::record;

/// A device of a Vulkan driver.
pub struct Driver(Device);

impl Driver {
    /// Opens the device of a driver, as [`Device::open`] does.
    ///
    /// # Errors
    /// If there is no such device, or Vulkan fails.
    pub fn open(driver: &str) -> Result<Self, Error> {
        Ok(Self(Device::open(driver)?))
    }
}

impl Implementation for Driver {
    fn name(&self) -> &str {
        &self.0.name
    }

    fn missing(&self, draw: &Draw) -> Option<&'static str> {
        draw.missing(&self.0)
    }

    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error> {
        record(&self.0, draw, stored)
    }
}
