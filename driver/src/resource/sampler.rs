//! Samplers.

use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::convert;
use crate::physical_device::limits;
use ash::vk;
use simdevice::texture;
use std::sync::Arc;

/// A sampler.
#[derive(Debug)]
pub(crate) struct Sampler {
    /// The device's half.
    pub(crate) state: texture::Sampler,
}

objects! { vk::Sampler => Sampler; }

impl Sampler {
    /// A sampler as its create info asks for.
    ///
    /// # Errors
    /// [`Error::FeatureNotPresent`] for anisotropy, and for filters, modes and colours of extensions;
    /// [`Error::InvalidUsage`] for a comparison that is none.
    pub(crate) fn new(info: &vk::SamplerCreateInfo<'_>) -> Result<Self, Error> {
        if info.anisotropy_enable != vk::FALSE {
            return Err(Error::FeatureNotPresent("samplerAnisotropy".into()));
        }
        let [u, v, w] = [
            info.address_mode_u,
            info.address_mode_v,
            info.address_mode_w,
        ]
        .map(convert::address_mode);
        let compares = info.compare_enable != vk::FALSE;
        let compare_op = compares
            .then(|| {
                convert::compare_op(
                    info.compare_op,
                    "VUID-VkSamplerCreateInfo-compareEnable-01080",
                )
            })
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
                border_color: convert::border_color(info.border_color)?,
                unnormalized_coordinates: info.unnormalized_coordinates != vk::FALSE,
            },
        })
    }
}

#[doc(alias = "vkCreateSampler")]
pub(crate) fn create_sampler(
    create_info: &vk::SamplerCreateInfo<'_>,
) -> Result<Arc<Sampler>, Error> {
    Sampler::new(create_info).map(Arc::new)
}
