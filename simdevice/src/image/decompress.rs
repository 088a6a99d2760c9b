//! The texels of compressed images. They are decoded all at once when something reads them, and kept until the memory
//! changes; mappable memory may change at any time, so that nothing is kept of it.

use super::{Image, ImageDesc, ImageView, SubresourceLayout};
use crate::format::MAX_TEXEL_SIZE;
use crate::packet::Aspect;
use devmem::{Allocation, host};
use std::sync::{Arc, Mutex, PoisonError};

/// What is kept of a compressed image: its texels, and the generation of its memory that they were decoded from.
#[derive(Debug, Default)]
pub(super) struct Decompressed(Mutex<Option<(u64, Arc<Image>)>>);

impl Image {
    /// An image of the same texels without compression; `None` if this one has none, or there is no memory for it.
    pub(crate) fn decompressed(&self) -> Option<Arc<Self>> {
        self.desc.format.decompressed()?;
        if self.memory.is_host_visible() {
            return self.decompress();
        }
        // Decoding twice is harmless, and so is what a panic left behind.
        let mut kept = self
            .decompressed
            .0
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let generation = self.memory.generation();
        if let Some((known, image)) = &*kept
            && *known == generation
        {
            return Some(Arc::clone(image));
        }
        let image = self.decompress()?;
        *kept = Some((generation, Arc::clone(&image)));
        Some(image)
    }

    fn decompress(&self) -> Option<Arc<Self>> {
        let desc = ImageDesc {
            format: self.desc.format.decompressed()?,
            ..self.desc
        };
        let memory = Allocation::new_zeroed(desc.memory_size()?).ok()?;
        let plain = Self::new(desc, memory, 0).ok()?;
        for layer in 0..desc.array_layers {
            for level in 0..desc.mip_levels {
                let blocks = self.subresource(Aspect::Color, level, layer)?;
                let texels = plain.subresource(Aspect::Color, level, layer)?;
                self.decompress_subresource(&blocks, &plain, &texels)?;
            }
        }
        Some(Arc::new(plain))
    }

    fn decompress_subresource(
        &self,
        blocks: &SubresourceLayout,
        plain: &Self,
        texels: &SubresourceLayout,
    ) -> Option<()> {
        let format = self.desc.format;
        let side = format.block_side();
        let [columns, rows, slices] = blocks.extent;
        let block_size = format.texel_size();
        let mut bytes: Vec<u8> = host::zeroed(columns as usize * block_size);
        let pitch = side as usize * texels.format.texel_size();
        let mut decoded: Vec<Vec<u8>> =
            host::collect((0..side).map(|_| host::zeroed(columns as usize * pitch)));
        let row_size = texels.extent[0] as usize * texels.format.texel_size();
        for z in 0..slices {
            for row in 0..rows {
                self.read_row(blocks, [0, row, z], &mut bytes)?;
                for (column, bytes) in bytes.chunks_exact(block_size).enumerate() {
                    let mut block = [0; MAX_TEXEL_SIZE];
                    block[..block_size].copy_from_slice(bytes);
                    let block = format.decode_block(&block)?;
                    for (line, out) in decoded.iter_mut().enumerate() {
                        out[column * pitch..][..pitch].copy_from_slice(block.row(line));
                    }
                }
                // Blocks at the edges reach beyond the image.
                let height = side.min(texels.extent[1] - side * row);
                for (line, texels_of_line) in (0..height).zip(&decoded) {
                    let at = [0, side * row + line, z];
                    plain.write_row(texels, at, &texels_of_line[..row_size])?;
                }
            }
        }
        Some(())
    }
}

impl ImageView {
    /// A view of the same texels without compression; itself if there is none.
    pub(crate) fn decompressed(&self) -> Option<Self> {
        match self.format.decompressed() {
            None => Some(self.clone()),
            Some(format) => Some(Self {
                image: self.image.decompressed()?,
                format,
                ..self.clone()
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ImageKind;
    use super::*;
    use crate::Format;

    fn image(host_visible: bool) -> Image {
        let desc = ImageDesc {
            kind: ImageKind::D2,
            format: Format::Bc1RgbUnormBlock,
            extent: [10, 6, 1],
            mip_levels: 3,
            array_layers: 2,
            samples: 1,
        };
        let memory = Allocation::new(desc.memory_size().unwrap(), host_visible).unwrap();
        Image::new(desc, memory, 0).unwrap()
    }

    fn texel(image: &Image, level: u32, at: [u32; 3]) -> [u8; 4] {
        let plain = image.decompressed().unwrap();
        let layout = plain.subresource(Aspect::Color, level, 1).unwrap();
        let mut out = [0; 4];
        plain.read_row(&layout, at, &mut out).unwrap();
        out
    }

    #[test]
    fn blocks_are_laid_out_like_texels() {
        let image = image(false);
        let extent = |level| image.subresource(Aspect::Color, level, 0).unwrap().extent;
        assert_eq!([0, 1, 2].map(extent), [[3, 2, 1], [2, 1, 1], [1, 1, 1]]);
    }

    #[test]
    fn texels_are_decoded_up_to_the_edges_and_again_when_they_change() {
        for host_visible in [false, true] {
            let image = image(host_visible);
            let black = [0, 0, 0, 255];
            assert_eq!(texel(&image, 0, [9, 5, 0]), black);
            // White in the last block of the largest level, and in the only one of the smallest.
            let white = [0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0];
            for (level, at) in [(0, [2, 1, 0]), (2, [0; 3])] {
                let layout = image.subresource(Aspect::Color, level, 1).unwrap();
                image.write_row(&layout, at, &white).unwrap();
            }
            image.memory.bump_generation();
            assert_eq!(texel(&image, 0, [9, 5, 0]), [255; 4]);
            assert_eq!(texel(&image, 0, [7, 5, 0]), black);
            assert_eq!(texel(&image, 0, [9, 3, 0]), black);
            assert_eq!(texel(&image, 2, [1, 0, 0]), [255; 4]);
        }
    }

    #[test]
    fn images_without_compression_stay_as_they_are() {
        let desc = ImageDesc {
            format: Format::R8Unorm,
            ..image(false).desc
        };
        let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
        let image = Image::new(desc, memory, 0).unwrap();
        assert!(image.decompressed().is_none());
    }
}
