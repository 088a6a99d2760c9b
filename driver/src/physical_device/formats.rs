//! The features of each format. The formats themselves, and the storage of texels, are the device's.

#[cfg(test)]
mod required;
#[cfg(test)]
mod tests;
mod ycbcr;

pub(crate) use ycbcr::{YcbcrFormat, ycbcr_format};

use super::{limits, memory};
use crate::abi::error::Error;
use ash::vk;
use simdevice::Format;
use simdevice::format::{Aspect, Channel, Numeric};
use std::sync::LazyLock;

/// The device's format of the same name, if it has one.
pub(crate) fn device_format(format: vk::Format) -> Option<Format> {
    /// The formats by the values of Vulkan's core formats, which are consecutive.
    static FORMATS: LazyLock<Vec<Option<Format>>> = LazyLock::new(|| {
        (0..=vk::Format::ASTC_12X12_SRGB_BLOCK.as_raw())
            .map(|raw| named(&format!("{:?}", vk::Format::from_raw(raw))))
            .collect()
    });
    match format {
        vk::Format::A4R4G4B4_UNORM_PACK16 => Some(Format::A4R4G4B4UnormPack16),
        vk::Format::A4B4G4R4_UNORM_PACK16 => Some(Format::A4B4G4R4UnormPack16),
        vk::Format::A1B5G5R5_UNORM_PACK16_KHR => Some(Format::A1B5G5R5UnormPack16),
        vk::Format::A8_UNORM_KHR => Some(Format::A8Unorm),
        vk::Format::R10X6_UNORM_PACK16 => Some(Format::R10X6UnormPack16),
        vk::Format::R10X6G10X6_UNORM_2PACK16 => Some(Format::R10X6G10X6Unorm2Pack16),
        vk::Format::R10X6G10X6B10X6A10X6_UNORM_4PACK16 => Some(Format::R10X6G10X6B10X6A10X6Unorm4Pack16),
        vk::Format::R12X4_UNORM_PACK16 => Some(Format::R12X4UnormPack16),
        vk::Format::R12X4G12X4_UNORM_2PACK16 => Some(Format::R12X4G12X4Unorm2Pack16),
        vk::Format::R12X4G12X4B12X4A12X4_UNORM_4PACK16 => Some(Format::R12X4G12X4B12X4A12X4Unorm4Pack16),
        _ => *FORMATS.get(usize::try_from(format.as_raw()).ok()?)?,
    }
}

/// The device's format that has Vulkan's name in camel case.
fn named(vulkan_name: &str) -> Option<Format> {
    let name = vulkan_name.replace('_', "");
    Format::ALL.iter().copied().find(|format| format!("{format:?}").eq_ignore_ascii_case(&name))
}

fn is_color(format: Format) -> bool {
    format.aspects() == [Aspect::Color]
}

/// Reports whether components are integers that are read as floating point. Such formats are for vertex attributes
/// and copies.
fn is_scaled(format: Format) -> bool {
    matches!(format.numeric(), Numeric::Uscaled | Numeric::Sscaled)
}

/// Reports whether texels are stored in compressed blocks.
fn is_compressed(format: Format) -> bool {
    format.decompressed().is_some()
}

/// The features of formats whose texels can be filtered, or compared with each other.
const FILTERED: vk::FormatFeatureFlags = vk::FormatFeatureFlags::from_raw(
    vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR.as_raw()
        | vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_MINMAX.as_raw(),
);

/// The features of images of the format, of either tiling.
fn image_features(format: Format) -> vk::FormatFeatureFlags {
    if is_scaled(format) {
        return vk::FormatFeatureFlags::TRANSFER_SRC | vk::FormatFeatureFlags::TRANSFER_DST;
    }
    if is_compressed(format) {
        return vk::FormatFeatureFlags::TRANSFER_SRC
            | vk::FormatFeatureFlags::TRANSFER_DST
            | vk::FormatFeatureFlags::BLIT_SRC
            | vk::FormatFeatureFlags::SAMPLED_IMAGE
            | FILTERED;
    }
    let mut features = vk::FormatFeatureFlags::TRANSFER_SRC
        | vk::FormatFeatureFlags::TRANSFER_DST
        | vk::FormatFeatureFlags::BLIT_SRC
        | vk::FormatFeatureFlags::BLIT_DST
        | vk::FormatFeatureFlags::SAMPLED_IMAGE;
    if !format.is_integer() && format.aspects() != [Aspect::Stencil] {
        features |= FILTERED;
    }
    if !is_color(format) {
        return features | vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT;
    }
    if is_stored(format) {
        features |= vk::FormatFeatureFlags::STORAGE_IMAGE;
    }
    if is_atomic(format) {
        features |= vk::FormatFeatureFlags::STORAGE_IMAGE_ATOMIC;
    }
    if is_rendered(format) {
        features |= vk::FormatFeatureFlags::COLOR_ATTACHMENT;
        if !format.is_integer() {
            features |= vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND;
        }
    }
    features
}

/// Reports whether programs can write texels of a colour format. sRGB and shared exponents are only read.
fn is_stored(format: Format) -> bool {
    !matches!(format.numeric(), Numeric::Srgb | Numeric::SharedExponent)
        && format.texel_size().is_power_of_two()
        && !format.has(Channel::X)
}

/// Tells if programs update texels atomically: integers and floats of one word.
fn is_atomic(format: Format) -> bool {
    let is_one_word = format.texel_size() == 4 && format.components().len() == 1;
    is_one_word && (format.is_integer() || format.numeric() == Numeric::Sfloat)
}

/// Reports whether a colour format can be rendered to. Formats of three components of 8 or 16 bits can't, as on other
/// hardware; neither can a shared exponent, nor those of ten or twelve bits in words of sixteen.
fn is_rendered(format: Format) -> bool {
    let size = format.texel_size();
    format.numeric() != Numeric::SharedExponent && !format.has(Channel::X) && (size.is_power_of_two() || size == 12)
}

/// The number of components of a format whose components have 64 bits, which is for vertex attributes alone; 0 for other
/// formats.
pub(crate) fn wide_components(format: vk::Format) -> u32 {
    use vk::Format as F;
    match format {
        F::R64_UINT | F::R64_SINT | F::R64_SFLOAT => 1,
        F::R64G64_UINT | F::R64G64_SINT | F::R64G64_SFLOAT => 2,
        F::R64G64B64_UINT | F::R64G64B64_SINT | F::R64G64B64_SFLOAT => 3,
        F::R64G64B64A64_UINT | F::R64G64B64A64_SINT | F::R64G64B64A64_SFLOAT => 4,
        _ => 0,
    }
}

/// The features of buffers of the format. Any colour format can be a vertex attribute, except sRGB.
/// Programs can read texels of any format that isn't scaled or compressed, and has no unused bits.
fn buffer_features(format: Format) -> vk::FormatFeatureFlags {
    if !is_color(format) || is_compressed(format) || format.has(Channel::X) {
        return vk::FormatFeatureFlags::empty();
    }
    if is_scaled(format) {
        return vk::FormatFeatureFlags::VERTEX_BUFFER;
    }
    let mut features = vk::FormatFeatureFlags::UNIFORM_TEXEL_BUFFER;
    if format.numeric() != Numeric::Srgb {
        features |= vk::FormatFeatureFlags::VERTEX_BUFFER;
    }
    if is_stored(format) {
        features |= vk::FormatFeatureFlags::STORAGE_TEXEL_BUFFER;
    }
    if is_atomic(format) {
        features |= vk::FormatFeatureFlags::STORAGE_TEXEL_BUFFER_ATOMIC;
    }
    features
}

/// `VkFormatProperties`. Formats that the device lacks have no features.
pub(crate) fn properties(format: vk::Format) -> vk::FormatProperties {
    if let Some(planar) = ycbcr_format(format) {
        let features = planar.image_features();
        return vk::FormatProperties {
            linear_tiling_features: features,
            optimal_tiling_features: features,
            buffer_features: vk::FormatFeatureFlags::empty(),
        };
    }
    let Some(format) = device_format(format) else {
        let is_wide = wide_components(format) > 0;
        let vertices = if is_wide { vk::FormatFeatureFlags::VERTEX_BUFFER } else { vk::FormatFeatureFlags::empty() };
        return vk::FormatProperties { buffer_features: vertices, ..vk::FormatProperties::default() };
    };
    // Texels, or blocks of them, lie in rows with either tiling.
    let linear = if is_color(format) { image_features(format) } else { vk::FormatFeatureFlags::empty() };
    vk::FormatProperties {
        linear_tiling_features: linear,
        optimal_tiling_features: image_features(format),
        buffer_features: buffer_features(format),
    }
}

/// `VkFormatProperties3`: the 64-bit features that correspond to 32-bit ones.
pub(crate) fn features2(format: vk::Format, features: vk::FormatFeatureFlags) -> vk::FormatFeatureFlags2 {
    // The 64-bit features begin with the 32-bit ones.
    let mut wide = vk::FormatFeatureFlags2::from_raw(features.as_raw().into());
    if features.contains(vk::FormatFeatureFlags::TRANSFER_SRC) {
        wide |= vk::FormatFeatureFlags2::HOST_IMAGE_TRANSFER_EXT;
    }
    let stored = vk::FormatFeatureFlags::STORAGE_IMAGE | vk::FormatFeatureFlags::STORAGE_TEXEL_BUFFER;
    if features.intersects(stored) {
        wide |= vk::FormatFeatureFlags2::STORAGE_READ_WITHOUT_FORMAT
            | vk::FormatFeatureFlags2::STORAGE_WRITE_WITHOUT_FORMAT;
    }
    let has_depth = device_format(format).is_some_and(|format| format.has(Channel::D));
    if has_depth && features.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE) {
        wide |= vk::FormatFeatureFlags2::SAMPLED_IMAGE_DEPTH_COMPARISON;
    }
    wide
}

/// The flags with which images may be created.
const IMAGE_FLAGS: vk::ImageCreateFlags = vk::ImageCreateFlags::from_raw(
    vk::ImageCreateFlags::MUTABLE_FORMAT.as_raw()
        | vk::ImageCreateFlags::EXTENDED_USAGE.as_raw()
        | vk::ImageCreateFlags::BLOCK_TEXEL_VIEW_COMPATIBLE.as_raw()
        | vk::ImageCreateFlags::MULTISAMPLED_RENDER_TO_SINGLE_SAMPLED_EXT.as_raw()
        | vk::ImageCreateFlags::ALIAS.as_raw()
        | vk::ImageCreateFlags::DISJOINT.as_raw()
        | vk::ImageCreateFlags::CUBE_COMPATIBLE.as_raw()
        | vk::ImageCreateFlags::TYPE_2D_ARRAY_COMPATIBLE.as_raw()
        | vk::ImageCreateFlags::TYPE_2D_VIEW_COMPATIBLE_EXT.as_raw()
        | vk::ImageCreateFlags::SPLIT_INSTANCE_BIND_REGIONS.as_raw(),
);

/// The features that usages require; other usages are not supported.
const USAGES: &[(vk::ImageUsageFlags, vk::FormatFeatureFlags)] = &[
    (vk::ImageUsageFlags::TRANSFER_SRC, vk::FormatFeatureFlags::TRANSFER_SRC),
    (vk::ImageUsageFlags::TRANSFER_DST, vk::FormatFeatureFlags::TRANSFER_DST),
    // The host copies what a queue copies.
    (vk::ImageUsageFlags::HOST_TRANSFER_EXT, vk::FormatFeatureFlags::TRANSFER_SRC),
    (vk::ImageUsageFlags::SAMPLED, vk::FormatFeatureFlags::SAMPLED_IMAGE),
    (vk::ImageUsageFlags::STORAGE, vk::FormatFeatureFlags::STORAGE_IMAGE),
    (vk::ImageUsageFlags::COLOR_ATTACHMENT, vk::FormatFeatureFlags::COLOR_ATTACHMENT),
    (vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT, vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT),
    (vk::ImageUsageFlags::INPUT_ATTACHMENT, vk::FormatFeatureFlags::SAMPLED_IMAGE),
    (vk::ImageUsageFlags::ATTACHMENT_FEEDBACK_LOOP_EXT, vk::FormatFeatureFlags::SAMPLED_IMAGE),
    // A transient attachment's contents stay in the tile buffers; the flag is used with an attachment usage.
    (vk::ImageUsageFlags::TRANSIENT_ATTACHMENT, vk::FormatFeatureFlags::empty()),
];

/// The usages by which shaders read attachments.
const READ_ATTACHMENT: vk::ImageUsageFlags = vk::ImageUsageFlags::from_raw(
    vk::ImageUsageFlags::INPUT_ATTACHMENT.as_raw() | vk::ImageUsageFlags::ATTACHMENT_FEEDBACK_LOOP_EXT.as_raw(),
);

/// The features of which the format of such an attachment must have one: shaders read only what can be rendered to.
const ATTACHMENT: vk::FormatFeatureFlags = vk::FormatFeatureFlags::from_raw(
    vk::FormatFeatureFlags::COLOR_ATTACHMENT.as_raw() | vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT.as_raw(),
);

/// Reports whether an image of this usage may be an attachment.
fn is_rendered_to(usage: vk::ImageUsageFlags) -> bool {
    let attachments = vk::ImageUsageFlags::COLOR_ATTACHMENT
        | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
        | vk::ImageUsageFlags::TRANSIENT_ATTACHMENT
        | READ_ATTACHMENT;
    usage.intersects(attachments)
}

fn supports_usage(features: vk::FormatFeatureFlags, usage: vk::ImageUsageFlags) -> bool {
    if usage.intersects(READ_ATTACHMENT) && !features.intersects(ATTACHMENT) {
        return false;
    }
    let supported = USAGES
        .iter()
        .filter(|(_, needed)| features.contains(*needed))
        .fold(vk::ImageUsageFlags::empty(), |all, (usage, _)| all | *usage);
    supported.contains(usage)
}

/// The flags of images whose usage may be that of any format that their views may have.
const VIEWED_FORMATS: vk::ImageCreateFlags = vk::ImageCreateFlags::from_raw(
    vk::ImageCreateFlags::MUTABLE_FORMAT.as_raw() | vk::ImageCreateFlags::EXTENDED_USAGE.as_raw(),
);

/// The features of all formats that views of an image of the format may have. Uncompressed colours of one size are
/// compatible, and with blocks of that size if the image's flags say so.
fn features_of_views(format: Format, flags: vk::ImageCreateFlags) -> vk::FormatFeatureFlags {
    let is_plain = |format: Format| is_color(format) && !is_compressed(format);
    if !is_plain(format) && !flags.contains(vk::ImageCreateFlags::BLOCK_TEXEL_VIEW_COMPATIBLE) {
        return image_features(format);
    }
    let compatible = Format::ALL.iter().filter(|&&it| is_plain(it) && it.texel_size() == format.texel_size());
    compatible.fold(vk::FormatFeatureFlags::empty(), |features, &it| features | image_features(it))
}

/// The description of a queried image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImageQuery {
    /// Its format.
    pub(crate) format: vk::Format,
    /// Its dimensions.
    pub(crate) ty: vk::ImageType,
    /// Its tiling.
    pub(crate) tiling: vk::ImageTiling,
    /// Its usage.
    pub(crate) usage: vk::ImageUsageFlags,
    /// Its creation flags.
    pub(crate) flags: vk::ImageCreateFlags,
}

/// `VkImageFormatProperties`: the limits of such an image.
///
/// # Errors
/// [`Error::FormatNotSupported`] if no such image is supported.
pub(crate) fn image_properties(query: ImageQuery) -> Result<vk::ImageFormatProperties, Error> {
    let refuse = |what: String| Err(Error::FormatNotSupported(what));
    let ImageQuery { format, ty, tiling, usage, flags } = query;
    let properties = properties(format);
    let features = match tiling {
        vk::ImageTiling::OPTIMAL => properties.optimal_tiling_features,
        vk::ImageTiling::LINEAR => properties.linear_tiling_features,
        _ => return refuse(format!("image tiling {tiling:?} is not supported")),
    };
    let planar = ycbcr_format(format);
    let features = match (planar, device_format(format)) {
        _ if features.is_empty() || !flags.contains(VIEWED_FORMATS) => features,
        (Some(planar), _) => {
            planar.planes.iter().fold(features, |all, plane| all | features_of_views(plane.format, flags))
        }
        (None, Some(format)) => features | features_of_views(format, flags),
        (None, None) => features,
    };
    if features.is_empty() {
        return refuse(format!("{tiling:?} images of format {format:?} are not supported"));
    }
    if !supports_usage(features, usage) {
        return refuse(format!("images of format {format:?} do not support all of {usage:?}"));
    }
    // The memory of an image that is an alias of a plane of others is apart in any case.
    let may_be_disjoint =
        features.contains(vk::FormatFeatureFlags::DISJOINT) || flags.contains(vk::ImageCreateFlags::ALIAS);
    let is_compressed = device_format(format).is_some_and(is_compressed);
    let has_block_views = flags.contains(vk::ImageCreateFlags::BLOCK_TEXEL_VIEW_COMPATIBLE);
    if !IMAGE_FLAGS.contains(flags)
        || flags.contains(vk::ImageCreateFlags::DISJOINT) && !may_be_disjoint
        || has_block_views && !is_compressed
    {
        return refuse(format!("image flags {flags:?} are not supported"));
    }
    if planar.is_some() {
        let is_flat = ty == vk::ImageType::TYPE_2D && !flags.contains(vk::ImageCreateFlags::CUBE_COMPATIBLE);
        return match is_flat {
            true => Ok(limits_of_chroma()),
            false => refuse(format!("{ty:?} images of format {format:?} are not supported")),
        };
    }
    let (max_extent, layers) = match ty {
        vk::ImageType::TYPE_1D if !is_compressed => (extent(limits::MAX_IMAGE_DIMENSION, 1, 1), limits::MAX_LAYERS),
        vk::ImageType::TYPE_2D => {
            (extent(limits::MAX_IMAGE_DIMENSION, limits::MAX_IMAGE_DIMENSION, 1), limits::MAX_LAYERS)
        }
        vk::ImageType::TYPE_3D => {
            let side = limits::MAX_IMAGE_DIMENSION_3D;
            (extent(side, side, side), 1)
        }
        _ => {
            return refuse(format!("{ty:?} images of format {format:?} are not supported"));
        }
    };
    let is_linear = tiling == vk::ImageTiling::LINEAR;
    let is_split = flags.contains(vk::ImageCreateFlags::SPLIT_INSTANCE_BIND_REGIONS);
    if is_split && (is_linear || ty != vk::ImageType::TYPE_2D) {
        return refuse(format!("{tiling:?} images of {ty:?} are not split over devices"));
    }
    let is_attachment = features.intersects(ATTACHMENT);
    let has_samples = is_attachment
        && !is_linear
        && !is_compressed
        && ty == vk::ImageType::TYPE_2D
        && !flags.contains(vk::ImageCreateFlags::CUBE_COMPATIBLE);
    Ok(vk::ImageFormatProperties {
        max_extent,
        max_mip_levels: if is_split { 1 } else { max_extent.width.ilog2() + 1 },
        max_array_layers: if is_split { 1 } else { layers },
        sample_counts: match has_samples {
            true if is_rendered_to(usage) || device_format(format).is_none_or(|format| !is_color(format)) => {
                limits::SAMPLE_COUNTS
            }
            true => limits::STORED_SAMPLE_COUNTS,
            false => vk::SampleCountFlags::TYPE_1,
        },
        max_resource_size: memory::heap_size(),
    })
}

/// The limits of images whose luma and chroma are apart.
fn limits_of_chroma() -> vk::ImageFormatProperties {
    vk::ImageFormatProperties {
        max_extent: extent(limits::MAX_IMAGE_DIMENSION, limits::MAX_IMAGE_DIMENSION, 1),
        max_mip_levels: 1,
        max_array_layers: 1,
        sample_counts: vk::SampleCountFlags::TYPE_1,
        max_resource_size: memory::heap_size(),
    }
}

fn extent(width: u32, height: u32, depth: u32) -> vk::Extent3D {
    vk::Extent3D { width, height, depth }
}
