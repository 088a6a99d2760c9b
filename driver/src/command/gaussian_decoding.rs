//! The command that binds the tables by which Gaussian draws' attributes are decoded.

use super::buffer::{CommandBuffer, Recorder};
use super::{Command, DecodingTable, DecodingTables, HarmonicsCodes, HarmonicsLabels};
use crate::abi::error::Error;
use crate::device_addresses::Addresses;
use ash::vk;
use gaurast::vk::{GaussianDecodingTableGAURAST, GaussianDecodingTablesGAURAST};
use simdevice::BufferRange;

#[doc(alias = "vkCmdBindGaussianDecodingTablesGAURAST")]
pub(crate) fn cmd_bind_gaussian_decoding_tables(
    command_buffer: &CommandBuffer,
    tables: &GaussianDecodingTablesGAURAST<'_>,
) -> Result<(), Error> {
    let addresses = command_buffer.device().addresses();
    command_buffer.record("vkCmdBindGaussianDecodingTablesGAURAST", |recorder: &mut Recorder| {
        let (codes, labels) = (&tables.codes, &tables.labels);
        let bound = DecodingTables {
            position: table(addresses, &tables.position)?,
            scale: table(addresses, &tables.scale)?,
            opacity: table(addresses, &tables.opacity)?,
            color: table(addresses, &tables.color)?,
            harmonics: table(addresses, &tables.spherical_harmonics)?,
            codes: HarmonicsCodes {
                range: range(addresses, codes.device_address, codes.size)?,
                stride: codes.stride,
                coefficient_stride: codes.coefficient_stride,
                component_stride: codes.component_stride,
            },
            labels: HarmonicsLabels {
                range: range(addresses, labels.device_address, labels.size)?,
                stride: labels.stride,
            },
        };
        recorder.push(Command::BindDecodingTables(Box::new(bound)));
        Ok(())
    })
}

fn table(addresses: &Addresses, table: &GaussianDecodingTableGAURAST) -> Result<DecodingTable, Error> {
    let is_binary64 = match table.format {
        vk::Format::R32_SFLOAT => false,
        vk::Format::R64_SFLOAT => true,
        _ if table.size == 0 => false,
        other => {
            return Err(Error::usage(
                "VUID-VkGaussianDecodingTableGAURAST-format-90100",
                format!("{other:?} is neither VK_FORMAT_R32_SFLOAT nor VK_FORMAT_R64_SFLOAT"),
            ));
        }
    };
    Ok(DecodingTable {
        range: range(addresses, table.device_address, table.size)?,
        is_binary64,
        stride: table.stride,
        chunk_size: table.chunk_size,
    })
}

/// The bytes at an address and of a size; `None` if that is 0.
fn range(addresses: &Addresses, address: u64, size: u64) -> Result<Option<BufferRange>, Error> {
    if size == 0 {
        return Ok(None);
    }
    addresses.range(address, size).map(Some).ok_or_else(|| {
        Error::usage(
            "VUID-VkGaussianDecodingTableGAURAST-deviceAddress-90099",
            format!("no buffer with an address holds {size} bytes at {address:#x}"),
        )
    })
}
