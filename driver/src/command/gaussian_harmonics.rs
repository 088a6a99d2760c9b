//! The command that binds the buffer of Gaussian draws' spherical harmonics.

use super::buffer::{CommandBuffer, Recorder};
use super::{Command, HarmonicsBuffer};
use crate::abi::error::Error;
use crate::device_addresses::Addresses;
use crate::physical_device::formats;
use ash::vk;
use gaurast::vk::GaussianSphericalHarmonicsBufferGAURAST;
use simdevice::BufferRange;
use simdevice::Format;

#[doc(alias = "vkCmdBindGaussianSphericalHarmonicsGAURAST")]
pub(crate) fn cmd_bind_gaussian_spherical_harmonics(
    command_buffer: &CommandBuffer,
    buffer: &GaussianSphericalHarmonicsBufferGAURAST<'_>,
) -> Result<(), Error> {
    let addresses = command_buffer.device().addresses();
    let command = "vkCmdBindGaussianSphericalHarmonicsGAURAST";
    command_buffer.record(command, |recorder: &mut Recorder| {
        let bound = HarmonicsBuffer {
            range: range(addresses, buffer)?,
            format: format(buffer.format)?,
            stride: buffer.stride,
            coefficient_stride: buffer.coefficient_stride,
        };
        recorder.push(Command::BindHarmonics(Box::new(bound)));
        Ok(())
    })
}

/// The bytes at an address and of a size.
fn range(addresses: &Addresses, buffer: &GaussianSphericalHarmonicsBufferGAURAST<'_>) -> Result<BufferRange, Error> {
    let (address, size) = (buffer.device_address, buffer.size);
    addresses.range(address, size).ok_or_else(|| {
        Error::usage(
            "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-deviceAddress-90016",
            format!("no buffer with an address holds {size} bytes at {address:#x}"),
        )
    })
}

fn format(format: vk::Format) -> Result<Format, Error> {
    let features = formats::properties(format).buffer_features;
    let found = formats::device_format(format).filter(|found| {
        features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER) && !found.is_integer() && found.components().len() >= 3
    });
    found.ok_or_else(|| {
        Error::usage(
            "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-format-90017",
            format!("{format:?} is no format of vertex attributes that are no integers and have 3 components or more"),
        )
    })
}
