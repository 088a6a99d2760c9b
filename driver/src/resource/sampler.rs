//! Samplers.

use super::ycbcr_conversion::chained_conversion;
use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::abi::valid;
use crate::convert;
use crate::physical_device::limits;
use ash::vk;
use simdevice::texture;
use std::sync::Arc;

/// A sampler.
#[derive(Debug)]
pub(crate) struct Sampler {
    /// The device's sampler.
    pub(crate) state: texture::Sampler,
}

objects! { vk::Sampler => Sampler; }

impl Sampler {
    /// A sampler from its create info and the structures in its chain.
    ///
    /// # Errors
    /// [`Error::FeatureNotPresent`] for filters, modes and colours of extensions; [`Error::InvalidUsage`] for an
    /// unknown comparison.
    pub(crate) fn new(
        info: &vk::SamplerCreateInfo<'_>,
        reduction: Option<vk::SamplerReductionMode>,
        custom_border: Option<vk::ClearColorValue>,
    ) -> Result<Self, Error> {
        let is_anisotropic = info.anisotropy_enable != vk::FALSE;
        let most = limits::MAX_SAMPLER_ANISOTROPY;
        let [u, v, w] = [info.address_mode_u, info.address_mode_v, info.address_mode_w].map(convert::address_mode);
        let compares = info.compare_enable != vk::FALSE;
        let compare_op = compares
            .then(|| convert::compare_op(info.compare_op, "VUID-VkSamplerCreateInfo-compareEnable-01080"))
            .transpose()?;
        let bias = limits::MAX_SAMPLER_LOD_BIAS;
        Ok(Self {
            state: texture::Sampler {
                mag_filter: convert::filter(info.mag_filter)?,
                min_filter: convert::filter(info.min_filter)?,
                mipmap_mode: convert::mipmap_mode(info.mipmap_mode),
                address_modes: [u?, v?, w?],
                mip_lod_bias: info.mip_lod_bias.clamp(-bias, bias),
                min_lod: info.min_lod,
                max_lod: info.max_lod,
                compare_op,
                border_color: match custom_border {
                    Some(color) => convert::custom_border_color(color),
                    None => convert::border_color(info.border_color)?,
                },
                has_seams: info.flags.contains(vk::SamplerCreateFlags::NON_SEAMLESS_CUBE_MAP_EXT),
                unnormalized_coordinates: info.unnormalized_coordinates != vk::FALSE,
                max_anisotropy: match is_anisotropic {
                    true => info.max_anisotropy.clamp(1.0, most),
                    false => 1.0,
                },
                reduction: match reduction {
                    Some(mode) => convert::reduction(mode)?,
                    None => texture::Reduction::WeightedAverage,
                },
            },
        })
    }
}

/// # Safety
/// The create info's chain and its handles are valid.
#[doc(alias = "vkCreateSampler")]
pub(crate) unsafe fn create_sampler(create_info: &vk::SamplerCreateInfo<'_>) -> Result<Arc<Sampler>, Error> {
    // SAFETY: the caller's promise.
    let (reduction, border) = unsafe {
        (
            valid::find_in_chain::<vk::SamplerReductionModeCreateInfo<'_>>(create_info.p_next),
            valid::find_in_chain::<vk::SamplerCustomBorderColorCreateInfoEXT<'_>>(create_info.p_next),
        )
    };
    // SAFETY: the caller's promise.
    let conversion = unsafe { chained_conversion(create_info.p_next)? };
    if conversion.is_some() && create_info.unnormalized_coordinates != vk::FALSE {
        return Err(Error::usage(
            "VUID-VkSamplerCreateInfo-addressModeU-01646",
            "a sampler with a conversion has unnormalized coordinates, which chroma cannot have",
        ));
    }
    let is_custom =
        matches!(create_info.border_color, vk::BorderColor::FLOAT_CUSTOM_EXT | vk::BorderColor::INT_CUSTOM_EXT);
    if is_custom && border.is_none() {
        return Err(Error::usage(
            "VUID-VkSamplerCreateInfo-borderColor-04011",
            "the border colour is a custom one, and there is none",
        ));
    }
    Sampler::new(
        create_info,
        reduction.map(|info| info.reduction_mode),
        border.filter(|_| is_custom).map(|info| info.custom_border_color),
    )
    .map(Arc::new)
}
