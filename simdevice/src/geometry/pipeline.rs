//! Programs made ready for draws.

use crate::device::Device;
use crate::packet::draw::DrawPrograms;
use crate::raster::fragment::FragmentStage;
use isa::validate::InvalidProgram;

/// A vertex and a fragment program ready for one device.
#[derive(Debug)]
pub struct DrawPipeline {
    pub(crate) programs: DrawPrograms,
    /// The fragment program.
    pub(crate) fragment: Option<FragmentStage>,
}

impl DrawPipeline {
    /// Makes programs ready.
    ///
    /// # Errors
    /// [`InvalidProgram`] if one of them cannot run on the device.
    pub fn new(device: &Device, programs: DrawPrograms) -> Result<Self, InvalidProgram> {
        let fragment = programs.fragment.as_ref();
        let fragment = fragment
            .map(|fragment| FragmentStage::new(device.level(), fragment))
            .transpose()?;
        Ok(Self { programs, fragment })
    }
}
