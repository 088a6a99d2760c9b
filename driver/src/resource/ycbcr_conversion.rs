//! Sampler Y'CbCr conversions: how samplers make colours of the luma and chroma of images.

use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::convert;
use crate::physical_device::formats;
use ash::vk;
use simdevice::texture::{Swizzle, YcbcrConversion};
use std::ffi::c_void;
use std::sync::Arc;

/// A conversion. Views of images have it too, and samples follow the view's.
#[derive(Debug)]
pub(crate) struct SamplerYcbcrConversion {
    /// The format of the images.
    pub(crate) format: vk::Format,
    /// The component mapping before the conversion.
    pub(crate) swizzle: Swizzle,
    /// The device's conversion.
    pub(crate) state: YcbcrConversion,
}

objects! { vk::SamplerYcbcrConversion => SamplerYcbcrConversion; }

/// The conversion in a chain, if there is one.
///
/// # Errors
/// [`Error::InvalidHandle`] if it is not a conversion.
///
/// # Safety
/// The chain and its handles are valid.
pub(crate) unsafe fn chained_conversion<'a>(
    chain: *const c_void,
) -> Result<Option<&'a Arc<SamplerYcbcrConversion>>, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        match valid::find_in_chain::<vk::SamplerYcbcrConversionInfo<'_>>(chain) {
            Some(info) => handle::get_optional(info.conversion),
            None => Ok(None),
        }
    }
}

/// Creates a conversion. Chroma is reconstructed implicitly, which is as exact as the explicit way that the create info may
/// ask for.
#[doc(alias = "vkCreateSamplerYcbcrConversion")]
pub(crate) fn create_sampler_ycbcr_conversion(
    create_info: &vk::SamplerYcbcrConversionCreateInfo<'_>,
) -> Result<Arc<SamplerYcbcrConversion>, Error> {
    let info = create_info;
    let Some(format) = formats::ycbcr_format(info.format) else {
        return Err(Error::usage(
            "VUID-VkSamplerYcbcrConversionCreateInfo-format-01650",
            format!("a conversion of {:?}, whose luma and chroma are not apart", info.format),
        ));
    };
    Ok(Arc::new(SamplerYcbcrConversion {
        format: info.format,
        swizzle: convert::swizzle(info.components),
        state: YcbcrConversion {
            model: convert::ycbcr_model(info.ycbcr_model)?,
            range: convert::ycbcr_range(info.ycbcr_range)?,
            bits: format.bits,
            chroma_locations: [
                convert::chroma_location(
                    info.x_chroma_offset,
                    "VUID-VkSamplerYcbcrConversionCreateInfo-xChromaOffset-parameter",
                )?,
                convert::chroma_location(
                    info.y_chroma_offset,
                    "VUID-VkSamplerYcbcrConversionCreateInfo-yChromaOffset-parameter",
                )?,
            ],
            chroma_filter: convert::filter(info.chroma_filter)?,
        },
    }))
}
