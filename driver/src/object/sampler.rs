//! Samplers.

use crate::capabilities::limits;
use crate::error::Error;
use ash::vk;
use simdevice::texture::{self, AddressMode, BorderColor, CompareOp, Filter, MipmapMode};

/// A sampler.
#[derive(Debug)]
pub(crate) struct Sampler {
    /// The device's half.
    pub(crate) state: texture::Sampler,
}

crate::objects! { vk::Sampler => Sampler; }

impl Sampler {
    /// A sampler as its create info asks for.
    ///
    /// # Errors
    /// [`Error::FeatureNotPresent`] for anisotropy, and for filters, modes and colours of extensions.
    pub(crate) fn new(info: &vk::SamplerCreateInfo<'_>) -> Result<Self, Error> {
        if info.anisotropy_enable != vk::FALSE {
            return Err(Error::FeatureNotPresent("samplerAnisotropy".into()));
        }
        let [u, v, w] = [
            info.address_mode_u,
            info.address_mode_v,
            info.address_mode_w,
        ]
        .map(address_mode);
        let compares = info.compare_enable != vk::FALSE;
        let bias = limits::MAX_SAMPLER_LOD_BIAS;
        Ok(Self {
            state: texture::Sampler {
                mag_filter: filter(info.mag_filter)?,
                min_filter: filter(info.min_filter)?,
                mipmap_mode: mipmap_mode(info.mipmap_mode),
                address_modes: [u?, v?, w?],
                mip_lod_bias: info.mip_lod_bias.clamp(-bias, bias),
                min_lod: info.min_lod,
                max_lod: info.max_lod,
                compare_op: compares.then(|| compare_op(info.compare_op)),
                border_color: border_color(info.border_color)?,
                unnormalized_coordinates: info.unnormalized_coordinates != vk::FALSE,
            },
        })
    }
}

/// A filter for the device.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for filters of extensions.
pub(crate) fn filter(filter: vk::Filter) -> Result<Filter, Error> {
    match filter {
        vk::Filter::NEAREST => Ok(Filter::Nearest),
        vk::Filter::LINEAR => Ok(Filter::Linear),
        other => Err(Error::FeatureNotPresent(format!("filter {other:?}"))),
    }
}

fn mipmap_mode(mode: vk::SamplerMipmapMode) -> MipmapMode {
    match mode {
        vk::SamplerMipmapMode::LINEAR => MipmapMode::Linear,
        _ => MipmapMode::Nearest,
    }
}

fn address_mode(mode: vk::SamplerAddressMode) -> Result<AddressMode, Error> {
    match mode {
        vk::SamplerAddressMode::REPEAT => Ok(AddressMode::Repeat),
        vk::SamplerAddressMode::MIRRORED_REPEAT => Ok(AddressMode::MirroredRepeat),
        vk::SamplerAddressMode::CLAMP_TO_EDGE => Ok(AddressMode::ClampToEdge),
        vk::SamplerAddressMode::CLAMP_TO_BORDER => Ok(AddressMode::ClampToBorder),
        vk::SamplerAddressMode::MIRROR_CLAMP_TO_EDGE => Ok(AddressMode::MirrorClampToEdge),
        other => Err(Error::FeatureNotPresent(format!("address mode {other:?}"))),
    }
}

fn compare_op(op: vk::CompareOp) -> CompareOp {
    match op {
        vk::CompareOp::LESS => CompareOp::Less,
        vk::CompareOp::EQUAL => CompareOp::Equal,
        vk::CompareOp::LESS_OR_EQUAL => CompareOp::LessOrEqual,
        vk::CompareOp::GREATER => CompareOp::Greater,
        vk::CompareOp::NOT_EQUAL => CompareOp::NotEqual,
        vk::CompareOp::GREATER_OR_EQUAL => CompareOp::GreaterOrEqual,
        vk::CompareOp::ALWAYS => CompareOp::Always,
        _ => CompareOp::Never,
    }
}

fn border_color(color: vk::BorderColor) -> Result<BorderColor, Error> {
    match color {
        vk::BorderColor::FLOAT_TRANSPARENT_BLACK | vk::BorderColor::INT_TRANSPARENT_BLACK => {
            Ok(BorderColor::TRANSPARENT_BLACK)
        }
        vk::BorderColor::FLOAT_OPAQUE_BLACK => Ok(BorderColor::FLOAT_OPAQUE_BLACK),
        vk::BorderColor::FLOAT_OPAQUE_WHITE => Ok(BorderColor::FLOAT_OPAQUE_WHITE),
        vk::BorderColor::INT_OPAQUE_BLACK => Ok(BorderColor::INT_OPAQUE_BLACK),
        vk::BorderColor::INT_OPAQUE_WHITE => Ok(BorderColor::INT_OPAQUE_WHITE),
        other => Err(Error::FeatureNotPresent(format!("border colour {other:?}"))),
    }
}
