//! Copies between images and the host's memory that the host makes itself, without a queue.

use super::transfer::{ImageRules, block_extent, block_offset, copy_image, layers};
use crate::abi::error::Error;
use crate::abi::valid;
use crate::resource::image::Image;
use ash::vk;
use simdevice::image::{self, SubresourceLayout};
use simdevice::{host, transfer};
use std::mem::MaybeUninit;

/// The rules on copies between an image and memory.
struct MemoryRules {
    image: ImageRules,
    /// A region must name one aspect.
    single_aspect: &'static str,
    /// A region must lie in the image.
    region: &'static str,
}

/// The rules on `vkCopyMemoryToImage`.
const TO_IMAGE: MemoryRules = MemoryRules {
    image: ImageRules {
        memory: "VUID-VkCopyMemoryToImageInfo-dstImage-07966",
        aspect: "VUID-VkCopyMemoryToImageInfo-imageSubresource-09105",
        level: "VUID-VkCopyMemoryToImageInfo-imageSubresource-07967",
        layers: "VUID-VkCopyMemoryToImageInfo-imageSubresource-07968",
    },
    single_aspect: "VUID-VkMemoryToImageCopy-aspectMask-09103",
    region: "VUID-VkCopyMemoryToImageInfo-imageSubresource-07971",
};

/// The rules on `vkCopyImageToMemory`.
const TO_MEMORY: MemoryRules = MemoryRules {
    image: ImageRules {
        memory: "VUID-VkCopyImageToMemoryInfo-srcImage-07966",
        aspect: "VUID-VkCopyImageToMemoryInfo-imageSubresource-09105",
        level: "VUID-VkCopyImageToMemoryInfo-imageSubresource-07967",
        layers: "VUID-VkCopyImageToMemoryInfo-imageSubresource-07968",
    },
    single_aspect: "VUID-VkImageToMemoryCopy-aspectMask-09103",
    region: "VUID-VkCopyImageToMemoryInfo-imageSubresource-07971",
};

/// The rules on the source of `vkCopyImageToImage`.
const SOURCE: ImageRules = ImageRules {
    memory: "VUID-VkCopyImageToImageInfo-srcImage-07966",
    aspect: "VUID-VkCopyImageToImageInfo-srcSubresource-09105",
    level: "VUID-VkCopyImageToImageInfo-srcSubresource-07967",
    layers: "VUID-VkCopyImageToImageInfo-srcSubresource-07968",
};

/// The rules on the target of `vkCopyImageToImage`.
const TARGET: ImageRules = ImageRules {
    memory: "VUID-VkCopyImageToImageInfo-dstImage-07966",
    aspect: "VUID-VkCopyImageToImageInfo-dstSubresource-09105",
    level: "VUID-VkCopyImageToImageInfo-dstSubresource-07967",
    layers: "VUID-VkCopyImageToImageInfo-dstSubresource-07968",
};

/// A row of texels of a region.
struct Row<'a> {
    image: &'a image::Image,
    layout: &'a SubresourceLayout,
    /// The first texel: x, y, z.
    at: [u32; 3],
    /// The row's first byte in the host's memory, from the region's on.
    place: usize,
    /// The row's bytes.
    size: usize,
}

/// Copies a region row by row. A copy gives None if the row isn't in the image.
///
/// # Errors
/// [`Error::InvalidUsage`] if a part isn't in the image or the host's memory, and the errors of copies.
fn for_each_row(
    image: &Image,
    region: &vk::MemoryToImageCopyEXT<'_>,
    rules: &MemoryRules,
    mut copy: impl FnMut(&Row<'_>) -> Result<Option<()>, Error>,
) -> Result<(), Error> {
    let (offset, extent) = (region.image_offset, region.image_extent);
    let outside =
        || Error::usage(rules.region, format!("the image does not have all of {extent:?} from {offset:?} on"));
    let (plane, layers) = layers(image, &region.image_subresource, &rules.image, rules.single_aspect)?;
    let blocks = image.blocks(plane, rules.image.memory)?;
    let [across, down] = image.block_extent();
    let [width, height, depth] = block_extent(image, extent);
    let or_tight = |length: u32, tight: u32| u64::from(if length == 0 { tight } else { length });
    let row_length = or_tight(region.memory_row_length.div_ceil(across), width);
    let image_height = or_tight(region.memory_image_height.div_ceil(down), height);
    let [Ok(x), Ok(y), Ok(z)] = block_offset(image, offset).map(u32::try_from) else {
        return Err(outside());
    };
    for index in 0..layers.layer_count {
        let layout = blocks.subresource(layers.aspect, layers.mip_level, layers.base_layer + index);
        let layout = layout.ok_or_else(outside)?;
        let texel_size = layout.format.texel_size() as u64;
        let place = |slice: u32, row: u32| {
            let slice = u64::from(index).checked_mul(depth.into())?.checked_add(slice.into())?;
            let row = slice.checked_mul(image_height)?.checked_add(row.into())?;
            usize::try_from(row.checked_mul(row_length)?.checked_mul(texel_size)?).ok()
        };
        let is_inside = [(x, width, 0), (y, height, 1), (z, depth, 2)]
            .into_iter()
            .all(|(first, count, axis)| first.checked_add(count).is_some_and(|end| end <= layout.extent[axis]));
        if !is_inside {
            return Err(outside());
        }
        for (slice, row) in (0..depth).flat_map(|slice| (0..height).map(move |row| (slice, row))) {
            let row = Row {
                image: &blocks,
                layout: &layout,
                at: [x, y + row, z + slice],
                place: place(slice, row).ok_or_else(outside)?,
                size: width as usize * texel_size as usize,
            };
            copy(&row)?.ok_or_else(outside)?;
        }
    }
    Ok(())
}

/// # Safety
/// The regions' pointers are to the bytes that Vulkan says they are to.
#[doc(alias = "vkCopyMemoryToImageEXT")]
pub(crate) unsafe fn copy_memory_to_image(
    dst_image: &Image,
    regions: &[vk::MemoryToImageCopyEXT<'_>],
) -> Result<(), Error> {
    let copied = regions.iter().try_for_each(|region| {
        let start = region.p_host_pointer.cast::<u8>();
        for_each_row(dst_image, region, &TO_IMAGE, |row| {
            // SAFETY: the caller's promise.
            let bytes = unsafe { valid::slice(start.wrapping_add(row.place), row.size as u32)? };
            Ok(row.image.write_row(row.layout, row.at, bytes))
        })
    });
    dst_image.mark_changed();
    copied
}

/// # Safety
/// The regions' pointers are to the bytes that Vulkan says they are to.
#[doc(alias = "vkCopyImageToMemoryEXT")]
pub(crate) unsafe fn copy_image_to_memory(
    src_image: &Image,
    regions: &[vk::ImageToMemoryCopyEXT<'_>],
) -> Result<(), Error> {
    let mut bytes = Vec::new();
    for region in regions {
        let start = region.p_host_pointer.cast::<u8>();
        for_each_row(src_image, &reversed(region), &TO_MEMORY, |row| {
            host::resize(&mut bytes, row.size, 0u8);
            if row.image.read_row(row.layout, row.at, &mut bytes).is_none() {
                return Ok(None);
            }
            // SAFETY: the caller's promise.
            let out: &mut [MaybeUninit<u8>] = unsafe { valid::output_slice(start.wrapping_add(row.place), row.size)? };
            out.write_copy_of_slice(&bytes);
            Ok(Some(()))
        })?;
    }
    Ok(())
}

/// The same region of a copy in the other direction.
fn reversed<'a>(region: &vk::ImageToMemoryCopyEXT<'a>) -> vk::MemoryToImageCopyEXT<'a> {
    let mut reversed = vk::MemoryToImageCopyEXT::default()
        .memory_row_length(region.memory_row_length)
        .memory_image_height(region.memory_image_height)
        .image_subresource(region.image_subresource)
        .image_offset(region.image_offset)
        .image_extent(region.image_extent);
    reversed.p_host_pointer = region.p_host_pointer;
    reversed
}

#[doc(alias = "vkCopyImageToImageEXT")]
pub(crate) fn copy_image_to_image(
    src_image: &Image,
    dst_image: &Image,
    regions: &[vk::ImageCopy2<'_>],
) -> Result<(), Error> {
    for copy in copy_image([src_image, dst_image], [&SOURCE, &TARGET], regions)? {
        transfer::copy_image(&copy);
    }
    Ok(())
}
