//! Copies between images and the host's memory that the host makes itself, without a queue.

use super::transfer::{ImageRules, block_extent, block_offset, copy_image, layers};
use crate::abi::error::Error;
use crate::abi::valid;
use crate::resource::image::Image;
use ash::vk;
use simdevice::image::{self, SubresourceLayout};
use simdevice::{host, transfer};
use std::mem::MaybeUninit;

/// The rules on the image of `vkCopyMemoryToImage`.
const TO_IMAGE: ImageRules = ImageRules {
    memory: "VUID-VkCopyMemoryToImageInfo-dstImage-07966",
    aspect: "VUID-VkCopyMemoryToImageInfo-imageSubresource-09105",
    level: "VUID-VkCopyMemoryToImageInfo-imageSubresource-07967",
    layers: "VUID-VkCopyMemoryToImageInfo-imageSubresource-07968",
};

/// The rules on the image of `vkCopyImageToMemory`.
const TO_MEMORY: ImageRules = ImageRules {
    memory: "VUID-VkCopyImageToMemoryInfo-srcImage-07966",
    aspect: "VUID-VkCopyImageToMemoryInfo-imageSubresource-09105",
    level: "VUID-VkCopyImageToMemoryInfo-imageSubresource-07967",
    layers: "VUID-VkCopyImageToMemoryInfo-imageSubresource-07968",
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

/// A part of an image, and where its texels are in the host's memory. A length of 0 is that of the part.
struct Region<'a> {
    image: &'a Image,
    subresource: vk::ImageSubresourceLayers,
    offset: vk::Offset3D,
    extent: vk::Extent3D,
    /// Texels from one row to the next in the host's memory.
    row_length: u32,
    /// Rows from one slice or layer to the next in the host's memory.
    image_height: u32,
}

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

impl Region<'_> {
    /// Copies row by row. A copy fails if the row isn't in the image.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`], of `outside` if a part isn't in the image or the host's memory.
    fn for_each_row(
        &self,
        rules: &ImageRules,
        single_aspect: &'static str,
        outside: &'static str,
        mut copy: impl FnMut(&Row<'_>) -> Result<Option<()>, Error>,
    ) -> Result<(), Error> {
        let outside = || {
            let Self { offset, extent, .. } = self;
            Error::usage(outside, format!("the image does not have all of {extent:?} from {offset:?} on"))
        };
        let (plane, layers) = layers(self.image, &self.subresource, rules, single_aspect)?;
        let image = &*self.image.blocks(plane, rules.memory)?;
        let [across, down] = self.image.block_extent();
        let [width, height, depth] = block_extent(self.image, self.extent);
        let or_tight = |length: u32, tight: u32| u64::from(if length == 0 { tight } else { length });
        let row_length = or_tight(self.row_length.div_ceil(across), width);
        let image_height = or_tight(self.image_height.div_ceil(down), height);
        let [Ok(x), Ok(y), Ok(z)] = block_offset(self.image, self.offset).map(u32::try_from) else {
            return Err(outside());
        };
        for index in 0..layers.layer_count {
            let layout = image.subresource(layers.aspect, layers.mip_level, layers.base_layer + index);
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
                    image,
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
        let rows = Region {
            image: dst_image,
            subresource: region.image_subresource,
            offset: region.image_offset,
            extent: region.image_extent,
            row_length: region.memory_row_length,
            image_height: region.memory_image_height,
        };
        let copy = |row: &Row<'_>| {
            // SAFETY: the caller's promise.
            let bytes = unsafe { valid::slice(start.wrapping_add(row.place), row.size as u32)? };
            Ok(row.image.write_row(row.layout, row.at, bytes))
        };
        rows.for_each_row(
            &TO_IMAGE,
            "VUID-VkMemoryToImageCopy-aspectMask-09103",
            "VUID-VkCopyMemoryToImageInfo-imageSubresource-07971",
            copy,
        )
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
        let rows = Region {
            image: src_image,
            subresource: region.image_subresource,
            offset: region.image_offset,
            extent: region.image_extent,
            row_length: region.memory_row_length,
            image_height: region.memory_image_height,
        };
        let copy = |row: &Row<'_>| {
            host::resize(&mut bytes, row.size, 0u8);
            if row.image.read_row(row.layout, row.at, &mut bytes).is_none() {
                return Ok(None);
            }
            // SAFETY: the caller's promise.
            let out: &mut [MaybeUninit<u8>] = unsafe { valid::output_slice(start.wrapping_add(row.place), row.size)? };
            out.write_copy_of_slice(&bytes);
            Ok(Some(()))
        };
        rows.for_each_row(
            &TO_MEMORY,
            "VUID-VkImageToMemoryCopy-aspectMask-09103",
            "VUID-VkCopyImageToMemoryInfo-imageSubresource-07971",
            copy,
        )?;
    }
    Ok(())
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
