//! Spherical harmonics in a buffer.

use ash::vk::{self, TaggedStructure};
use gaurast::vk::GaussianSphericalHarmonicsBufferGAURAST;

use crate::formats::Format;
use crate::objects::Objects;
use crate::report::Faults;

/// Checks the buffer of `vkCmdBindGaussianSphericalHarmonicsGAURAST`; `is_vertex_format` tells what formats can be
/// fetched.
pub(crate) fn check(
    bound: &GaussianSphericalHarmonicsBufferGAURAST<'_>,
    objects: &Objects,
    is_vertex_format: impl FnOnce(vk::Format) -> bool,
    faults: &mut Faults,
) {
    if bound.s_type != GaussianSphericalHarmonicsBufferGAURAST::STRUCTURE_TYPE {
        return faults.error(
            "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-sType-sType",
            format!(
                "pBuffer->sType is {}, but must be VK_STRUCTURE_TYPE_GAUSSIAN_SPHERICAL_HARMONICS_BUFFER_GAURAST ({})",
                bound.s_type.as_raw(),
                GaussianSphericalHarmonicsBufferGAURAST::STRUCTURE_TYPE.as_raw()
            ),
        );
    }
    check_range(bound, objects, faults);
    let id = "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-format-90017";
    let format = Format::of(bound.format);
    if format.is_integer || format.components < 3 {
        faults.error(
            id,
            format!("format is {:?}, but must have 3 components or more that are no integers", bound.format),
        );
    } else if format.word_bytes() > 4 {
        faults.error(id, format!("format is {:?}, whose components have more than 32 bits", bound.format));
    } else if !is_vertex_format(bound.format) {
        faults.error(
            id,
            format!("format is {:?}, which does not support VK_FORMAT_FEATURE_VERTEX_BUFFER_BIT", bound.format),
        );
    } else if bound.stride == 0 && bound.coefficient_stride == 0 {
        faults.warning(
            "GAURAST-Harmonics-stride",
            "stride and coefficientStride are 0: all coefficients of all Gaussians are the same",
        );
    } else if bound.size < u64::from(format.bytes) {
        faults.warning(
            "GAURAST-Harmonics-size",
            format!("size is {}: not one coefficient lies within it, and all read as zeros", bound.size),
        );
    } else {
        check_alignment(bound, u64::from(format.word_bytes()), faults);
    }
}

/// Warns of coefficients that do not begin at a multiple of their components' size.
fn check_alignment(bound: &GaussianSphericalHarmonicsBufferGAURAST<'_>, word: u64, faults: &mut Faults) {
    let numbers = [
        ("deviceAddress", bound.device_address),
        ("stride", u64::from(bound.stride)),
        ("coefficientStride", bound.coefficient_stride),
    ];
    let wrong = numbers.into_iter().find(|(_, number)| !number.is_multiple_of(word.max(1)));
    if let Some((name, number)) = wrong {
        faults.warning(
            "GAURAST-Harmonics-alignment",
            format!(
                "{name} is {} beyond a multiple of {word}, the bytes of a component of {:?}",
                number % word,
                bound.format
            ),
        );
    }
}

fn check_range(bound: &GaussianSphericalHarmonicsBufferGAURAST<'_>, objects: &Objects, faults: &mut Faults) {
    let id = "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-deviceAddress-90016";
    let address = bound.device_address;
    match objects.buffer_at(address) {
        None => faults
            .error(id, format!("deviceAddress is {address:#x}, which is within no buffer whose address was asked for")),
        Some((_, buffer)) => {
            let start = address - buffer.address.unwrap_or_default();
            faults.require(bound.size <= buffer.size - start, id, || {
                format!(
                    "size is {}, but the buffer has {} bytes from deviceAddress on",
                    bound.size,
                    buffer.size - start
                )
            });
        }
    }
}
