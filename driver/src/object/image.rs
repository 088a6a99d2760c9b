//! Images.

use super::buffer;
use crate::error::Error;
use ash::vk;
use simdevice::Allocation;
use simdevice::format::Aspect;
use simdevice::image::{self, ImageDesc, ImageKind};
use simdevice::texture::{ComponentSwizzle, IDENTITY, Swizzle};
use std::sync::{Arc, OnceLock};

/// An image.
#[derive(Debug)]
pub(crate) struct Image {
    /// Its shape.
    pub(crate) desc: ImageDesc,
    size: u64,
    bound: OnceLock<Arc<image::Image>>,
}

crate::objects! {
    vk::Image => Image;
    vk::ImageView => ImageView;
}

impl Image {
    /// An image, not yet bound to memory.
    ///
    /// # Errors
    /// [`Error::OutOfDeviceMemory`] if no memory could hold it.
    pub(crate) fn new(desc: ImageDesc) -> Result<Self, Error> {
        let size = desc
            .memory_size()
            .ok_or_else(|| Error::OutOfDeviceMemory(format!("{desc:?} is too large")))?;
        Ok(Self {
            desc,
            size,
            bound: OnceLock::new(),
        })
    }

    /// What memory it needs; of any type.
    pub(crate) fn requirements(&self, memory_type_bits: u32) -> vk::MemoryRequirements {
        vk::MemoryRequirements {
            alignment: image::IMAGE_ALIGNMENT,
            ..buffer::requirements(self.size, memory_type_bits)
        }
    }

    /// Binds it to memory from byte `offset` on.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is bound already or does not fit.
    pub(crate) fn bind(&self, memory: Arc<Allocation>, offset: u64) -> Result<(), Error> {
        let vuid = "VUID-vkBindImageMemory-memoryOffset-01048";
        if !offset.is_multiple_of(image::IMAGE_ALIGNMENT) {
            return Err(Error::usage(
                vuid,
                format!(
                    "memoryOffset {offset} is not a multiple of {}",
                    image::IMAGE_ALIGNMENT
                ),
            ));
        }
        let bound = image::Image::new(self.desc, memory, offset)
            .map_err(|error| Error::usage(vuid, error.to_string()))?;
        self.bound.set(Arc::new(bound)).map_err(|_| {
            Error::usage(
                "VUID-vkBindImageMemory-image-07460",
                "the image is bound already",
            )
        })
    }

    /// The image in its memory.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is not bound.
    pub(crate) fn bound(&self) -> Result<&Arc<image::Image>, Error> {
        self.bound.get().ok_or_else(|| {
            Error::usage(
                "VUID-vkCmd-image-memory",
                "a command or view uses an image that is not bound to memory",
            )
        })
    }
}

/// An image view.
#[derive(Debug)]
pub(crate) struct ImageView {
    /// The device's half.
    pub(crate) view: image::ImageView,
    /// The aspect that shaders read.
    pub(crate) aspect: Aspect,
    /// How shaders see components rearranged.
    pub(crate) swizzle: Swizzle,
}

impl ImageView {
    /// A view of `range` of a bound image, read as `format`. A view of a 3D image as an array of 2D ones has its slices
    /// for layers; it is rendered to, and nothing else.
    ///
    /// # Errors
    /// [`Error::Usage`] if the image is not bound or does not have the range, or the formats are not compatible.
    pub(crate) fn new(
        image: &Image,
        view_type: vk::ImageViewType,
        view_format: vk::Format,
        format: simdevice::Format,
        components: vk::ComponentMapping,
        range: &vk::ImageSubresourceRange,
    ) -> Result<Self, Error> {
        let desc = &image.desc;
        if format.texel_size() != desc.format.texel_size() {
            return Err(Error::usage(
                "VUID-VkImageViewCreateInfo-image-01761",
                format!("{view_format:?} is not compatible with the image's format"),
            ));
        }
        let base_mip_level = range.base_mip_level;
        let level_count = count(
            base_mip_level,
            range.level_count,
            vk::REMAINING_MIP_LEVELS,
            desc.mip_levels,
        );
        let base_layer = range.base_array_layer;
        let are_slices = desc.kind == ImageKind::D3 && view_type != vk::ImageViewType::TYPE_3D;
        let layer_count = count(
            base_layer,
            range.layer_count,
            vk::REMAINING_ARRAY_LAYERS,
            if are_slices {
                desc.mip_extent(base_mip_level)[2]
            } else {
                desc.array_layers
            },
        );
        let (Some(level_count), Some(layer_count)) = (level_count, layer_count) else {
            return Err(Error::usage(
                "VUID-VkImageViewCreateInfo-subresourceRange-01478",
                format!("the image does not have {range:?}"),
            ));
        };
        Ok(Self {
            view: image::ImageView {
                image: Arc::clone(image.bound()?),
                format,
                base_mip_level,
                level_count,
                base_layer,
                layer_count,
            },
            aspect: aspect(range.aspect_mask),
            swizzle: swizzle(components),
        })
    }
}

/// The aspect that shaders read of a view.
fn aspect(mask: vk::ImageAspectFlags) -> Aspect {
    if mask.contains(vk::ImageAspectFlags::DEPTH) {
        Aspect::Depth
    } else if mask.contains(vk::ImageAspectFlags::STENCIL) {
        Aspect::Stencil
    } else {
        Aspect::Color
    }
}

/// A component mapping for the device.
fn swizzle(mapping: vk::ComponentMapping) -> Swizzle {
    let components = [mapping.r, mapping.g, mapping.b, mapping.a];
    std::array::from_fn(|index| match components[index] {
        vk::ComponentSwizzle::ZERO => ComponentSwizzle::Zero,
        vk::ComponentSwizzle::ONE => ComponentSwizzle::One,
        vk::ComponentSwizzle::R => ComponentSwizzle::Red,
        vk::ComponentSwizzle::G => ComponentSwizzle::Green,
        vk::ComponentSwizzle::B => ComponentSwizzle::Blue,
        vk::ComponentSwizzle::A => ComponentSwizzle::Alpha,
        _ => IDENTITY[index],
    })
}

/// How many of `available` things a range from `base` on has, if it has any and all exist.
pub(crate) fn count(base: u32, count: u32, remaining: u32, available: u32) -> Option<u32> {
    let rest = available.checked_sub(base)?;
    let count = if count == remaining { rest } else { count };
    (1..=rest).contains(&count).then_some(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_lie_inside_what_is_there() {
        assert_eq!(count(2, 3, u32::MAX, 5), Some(3));
        assert_eq!(count(2, 4, u32::MAX, 5), None);
        assert_eq!(count(2, u32::MAX, u32::MAX, 5), Some(3));
        assert_eq!(count(5, u32::MAX, u32::MAX, 5), None);
        assert_eq!(count(6, 0, u32::MAX, 5), None);
    }
}
