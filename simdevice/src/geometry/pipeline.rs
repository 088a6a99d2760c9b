//! Programs made ready for draws.

use crate::device::Device;
use crate::packet::draw::DrawPrograms;
use isa::validate::InvalidProgram;

/// A vertex and a fragment program ready for one device.
#[derive(Debug)]
pub struct DrawPipeline {
    pub(crate) programs: DrawPrograms,
}

impl DrawPipeline {
    /// Makes programs ready.
    ///
    /// # Errors
    /// [`InvalidProgram`] if one of them cannot run on the device.
    pub fn new(device: &Device, programs: DrawPrograms) -> Result<Self, InvalidProgram> {
        let _ = device;
        Ok(Self { programs })
    }
}
