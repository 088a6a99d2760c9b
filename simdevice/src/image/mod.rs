//! Images: the memory layout of the texels of each subresource.
//!
//! Every aspect is a separate plane with all of its layers. A layer has its mip levels from the largest down. A level
//! has its samples one after another, a sample its slices, a slice its rows. Rows begin at multiples of
//! [`ROW_ALIGNMENT`]. Therefore a row of one sample is always contiguous.
//!
//! In a compressed image, blocks of texels take the place of texels in layouts and copies.

pub(crate) mod resolve;

use crate::format::block::MAX_DECODED_SIZE;
use crate::format::{Aspect, Format, MAX_TEXEL_SIZE};
use devmem::{Allocation, OutOfBounds, host};
use std::sync::Arc;
use std::sync::{Mutex, PoisonError};

/// The alignment of rows in bytes: a line of the host's cache.
pub const ROW_ALIGNMENT: u64 = 64;

/// The alignment of images in bytes.
pub const IMAGE_ALIGNMENT: u64 = 256;

/// The number of dimensions of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageKind {
    /// One.
    D1,
    /// Two.
    D2,
    /// Three.
    D3,
}

/// The description of an image, without its memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageDesc {
    /// The number of dimensions.
    pub kind: ImageKind,
    /// The format of its texels.
    pub format: Format,
    /// The number of texels of level 0 in x, y and z.
    pub extent: [u32; 3],
    /// The number of mip levels.
    pub mip_levels: u32,
    /// The number of array layers.
    pub array_layers: u32,
    /// The number of samples per texel.
    pub samples: u32,
}

/// The memory layout of one subresource (an aspect, a mip level, a layer).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SubresourceLayout {
    /// The format of its texels.
    pub format: Format,
    /// The number of texels, or blocks of texels, in x, y and z.
    pub extent: [u32; 3],
    /// The bytes from the image's beginning to the subresource.
    pub offset: u64,
    /// The bytes that it spans.
    pub size: u64,
    /// The bytes from one row to the next.
    pub row_pitch: u64,
    /// The bytes from one slice of a 3D image to the next.
    pub depth_pitch: u64,
    /// The bytes from one sample's texels to the next sample's.
    pub sample_pitch: u64,
    /// The bytes from this subresource to that of the next layer.
    pub array_pitch: u64,
}

/// The reasons why an image could not be created.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// A size, level, layer or sample count is zero, there are more than 32 levels, or the size in bytes overflows.
    #[error("an image of this shape has no layout")]
    Shape,
    /// The memory is too small.
    #[error("the image does not fit its memory: {0}")]
    Memory(OutOfBounds),
}

impl ImageDesc {
    /// The number of texels of a mip level in x, y and z.
    pub fn mip_extent(&self, level: u32) -> [u32; 3] {
        self.extent.map(|texels| texels.checked_shr(level).unwrap_or(0).max(1))
    }

    /// The bytes that the image takes, or `None` if it has no layout (see [`ImageError::Shape`]).
    pub fn memory_size(&self) -> Option<u64> {
        let shape = [self.mip_levels, self.array_layers, self.samples];
        if shape.contains(&0) || self.extent.contains(&0) || self.mip_levels > u32::BITS {
            return None;
        }
        self.plane_offset(self.format.aspects().len())
    }

    /// The layout of a subresource, or `None` if the image does not have it.
    pub fn subresource(&self, aspect: Aspect, level: u32, layer: u32) -> Option<SubresourceLayout> {
        self.memory_size()?;
        let plane = self.format.aspects().iter().position(|&a| a == aspect)?;
        if level >= self.mip_levels || layer >= self.array_layers {
            return None;
        }
        let array_pitch = self.level_offset(aspect, self.mip_levels)?;
        let offset = self.plane_offset(plane)? + array_pitch * u64::from(layer) + self.level_offset(aspect, level)?;
        let mut layout = self.level_layout(aspect, level)?;
        layout.offset = offset;
        layout.array_pitch = array_pitch;
        Some(layout)
    }

    /// The bytes of the first `planes` aspects.
    fn plane_offset(&self, planes: usize) -> Option<u64> {
        self.format.aspects()[..planes].iter().try_fold(0u64, |sum, &aspect| {
            let layer = self.level_offset(aspect, self.mip_levels)?;
            sum.checked_add(layer.checked_mul(self.array_layers.into())?)
        })
    }

    /// The bytes of the first `levels` mip levels of one layer.
    fn level_offset(&self, aspect: Aspect, levels: u32) -> Option<u64> {
        (0..levels).try_fold(0u64, |sum, level| sum.checked_add(self.level_layout(aspect, level)?.size))
    }

    /// The layout of a mip level. `offset` and `array_pitch` are zero.
    fn level_layout(&self, aspect: Aspect, level: u32) -> Option<SubresourceLayout> {
        let format = self.format.plane(aspect)?;
        let [across, down] = format.block_extent();
        let [width, height, depth] = self.mip_extent(level);
        let extent = [width.div_ceil(across), height.div_ceil(down), depth];
        let [width, height, depth] = extent.map(u64::from);
        let row_pitch = (width * format.texel_size() as u64).next_multiple_of(ROW_ALIGNMENT);
        let depth_pitch = row_pitch.checked_mul(height)?;
        let sample_pitch = depth_pitch.checked_mul(depth)?;
        Some(SubresourceLayout {
            format,
            extent,
            offset: 0,
            size: sample_pitch.checked_mul(self.samples.into())?,
            row_pitch,
            depth_pitch,
            sample_pitch,
            array_pitch: 0,
        })
    }
}

impl SubresourceLayout {
    /// The layout of one sample: that of an image with a single sample.
    pub fn sample(&self, sample: u32) -> Self {
        Self {
            offset: self.offset.saturating_add(self.sample_pitch.saturating_mul(sample.into())),
            size: self.sample_pitch,
            ..*self
        }
    }

    /// The offset of texel (x, y, z) from the image's beginning, and the number of bytes from there to the end of its
    /// row; `None` outside the subresource.
    #[inline]
    fn texel(&self, [x, y, z]: [u32; 3]) -> Option<(u64, u64)> {
        let [width, height, depth] = self.extent;
        if x > width || y >= height || z >= depth {
            return None;
        }
        let texel_size = self.format.texel_size() as u64;
        // Offsets in the subresource did not overflow when it was laid out.
        let inside = u64::from(z) * self.depth_pitch + u64::from(y) * self.row_pitch + u64::from(x) * texel_size;
        Some((self.offset.checked_add(inside)?, u64::from(width - x) * texel_size))
    }
}

/// An image bound to memory.
#[derive(Clone, Debug)]
pub struct Image {
    /// The description.
    pub desc: ImageDesc,
    /// The memory that holds the texels.
    pub memory: Arc<Allocation>,
    /// The offset of the image in the memory, in bytes.
    pub offset: u64,
    /// The decoded texels of a compressed image, if they were needed.
    decompressed: Arc<Decompressed>,
}

impl Image {
    /// Binds an image to byte `offset` of `memory`.
    pub fn new(desc: ImageDesc, memory: Arc<Allocation>, offset: u64) -> Result<Self, ImageError> {
        let size = desc.memory_size().ok_or(ImageError::Shape)?;
        if offset.checked_add(size).is_none_or(|end| end > memory.len()) {
            return Err(ImageError::Memory(OutOfBounds { offset, size, len: memory.len() }));
        }
        Ok(Self { desc, memory, offset, decompressed: Arc::default() })
    }

    /// The layout of a subresource, or `None` if the image does not have it.
    pub fn subresource(&self, aspect: Aspect, level: u32, layer: u32) -> Option<SubresourceLayout> {
        self.desc.subresource(aspect, level, layer)
    }

    /// The offset in the memory of texel `at`; `None` if `size` bytes from there on do not lie in one row of the
    /// subresource.
    #[inline]
    pub(crate) fn row(&self, layout: &SubresourceLayout, at: [u32; 3], size: u64) -> Option<u64> {
        let (offset, rest) = layout.texel(at)?;
        (size <= rest).then(|| self.offset.checked_add(offset)).flatten()
    }

    /// Reads the bytes of consecutive texels of a row from texel `at` (x, y, z) on. Returns `None` and leaves `out`
    /// unchanged if they do not lie in that row.
    #[inline]
    pub fn read_row(&self, layout: &SubresourceLayout, at: [u32; 3], out: &mut [u8]) -> Option<()> {
        let offset = self.row(layout, at, out.len() as u64)?;
        self.memory.read(offset, out).ok()
    }

    /// Writes the bytes of consecutive texels of a row from texel `at` (x, y, z) on. Returns `None` and writes nothing
    /// if they do not lie in that row.
    #[inline]
    pub fn write_row(&self, layout: &SubresourceLayout, at: [u32; 3], bytes: &[u8]) -> Option<()> {
        let offset = self.row(layout, at, bytes.len() as u64)?;
        self.memory.write(offset, bytes).ok()
    }
}

/// A range of an image's subresources, interpreted in a format.
#[derive(Clone, Debug)]
pub struct ImageView {
    /// The image.
    pub image: Arc<Image>,
    /// The format of texels.
    pub format: Format,
    /// The first mip level.
    pub base_mip_level: u32,
    /// The number of levels.
    pub level_count: u32,
    /// The first array layer.
    pub base_layer: u32,
    /// The number of layers.
    pub layer_count: u32,
}

/// The texels of a compressed image as a format has them, with the generation of the memory from which they were
/// decoded.
#[derive(Debug)]
struct Decoded {
    format: Format,
    generation: u64,
    image: Arc<Image>,
}

/// The cache of a compressed image's texels, for each format of its views that has others.
#[derive(Debug, Default)]
struct Decompressed(Mutex<Vec<Decoded>>);

impl Image {
    /// An image of the same texels without compression; `None` if this one is not compressed, or memory is exhausted.
    pub(crate) fn decompressed(&self) -> Option<Arc<Self>> {
        self.decompressed_as(self.desc.format)
    }

    /// An image of the texels that the blocks of this one have in a format of a view, without compression; `None` if
    /// that format or this image is not compressed, their blocks differ in size, or memory is exhausted.
    fn decompressed_as(&self, format: Format) -> Option<Arc<Self>> {
        self.desc.format.decompressed()?;
        let shape = |format: Format| (format.block_extent(), format.texel_size());
        if shape(format) != shape(self.desc.format) {
            return None;
        }
        if self.memory.is_host_visible() {
            return self.decompress(format);
        }
        // A panic while the lock was held leaves a valid value. Decoding twice is harmless.
        let mut kept = self.decompressed.0.lock().unwrap_or_else(PoisonError::into_inner);
        let generation = self.memory.generation();
        kept.retain(|decoded| decoded.generation == generation);
        if let Some(decoded) = kept.iter().find(|decoded| decoded.format.decodes_like(format)) {
            return Some(Arc::clone(&decoded.image));
        }
        let image = self.decompress(format)?;
        host::push(&mut kept, Decoded { format, generation, image: Arc::clone(&image) });
        Some(image)
    }

    fn decompress(&self, format: Format) -> Option<Arc<Self>> {
        let desc = ImageDesc { format: format.decompressed()?, ..self.desc };
        let memory = Allocation::new_zeroed(desc.memory_size()?).ok()?;
        let plain = Self::new(desc, memory, 0).ok()?;
        for layer in 0..desc.array_layers {
            for level in 0..desc.mip_levels {
                let blocks = self.subresource(Aspect::Color, level, layer)?;
                let texels = plain.subresource(Aspect::Color, level, layer)?;
                self.decompress_subresource(&SubresourceLayout { format, ..blocks }, &plain, &texels)?;
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
        let format = blocks.format;
        let [across, down] = format.block_extent();
        let [columns, rows, slices] = blocks.extent;
        let block_size = format.texel_size();
        let mut bytes: Vec<u8> = host::zeroed(columns as usize * block_size);
        let pitch = across as usize * texels.format.texel_size();
        let mut decoded = [0; MAX_DECODED_SIZE];
        let decoded = &mut decoded[..down as usize * pitch];
        let mut lines: Vec<Vec<u8>> = host::collect((0..down).map(|_| host::zeroed(columns as usize * pitch)));
        let row_size = texels.extent[0] as usize * texels.format.texel_size();
        for z in 0..slices {
            for row in 0..rows {
                self.read_row(blocks, [0, row, z], &mut bytes)?;
                for (column, bytes) in bytes.chunks_exact(block_size).enumerate() {
                    let mut block = [0; MAX_TEXEL_SIZE];
                    block[..block_size].copy_from_slice(bytes);
                    format.decode_block(&block, decoded)?;
                    for (line, texels) in lines.iter_mut().zip(decoded.chunks_exact(pitch)) {
                        line[column * pitch..][..pitch].copy_from_slice(texels);
                    }
                }
                // Blocks at the edges may extend beyond the image.
                let height = down.min(texels.extent[1] - down * row);
                for (line, texels_of_line) in (0..height).zip(&lines) {
                    let at = [0, down * row + line, z];
                    plain.write_row(texels, at, &texels_of_line[..row_size])?;
                }
            }
        }
        Some(())
    }
}

impl ImageView {
    /// A view of the same texels without compression; the same view if its format is not compressed. `None` if memory
    /// is exhausted.
    pub(crate) fn decompressed(&self) -> Option<Self> {
        match self.format.decompressed() {
            None => Some(self.clone()),
            Some(format) => {
                let image = self.image.decompressed_as(self.format)?;
                Some(Self { image, format, ..self.clone() })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn desc() -> ImageDesc {
        ImageDesc {
            kind: ImageKind::D2,
            format: Format::R8G8B8A8Unorm,
            extent: [33, 7, 1],
            mip_levels: 3,
            array_layers: 2,
            samples: 1,
        }
    }

    #[gaurast_runner::test]
    fn subresources_tile_the_image_without_gaps() {
        for format in [Format::R8G8B8A8Unorm, Format::D24UnormS8Uint, Format::R32G32B32Sfloat] {
            for (kind, extent) in [(ImageKind::D2, [33, 7, 1]), (ImageKind::D3, [9, 5, 4])] {
                let desc = ImageDesc { kind, format, extent, samples: 4, ..desc() };
                let mut end = 0;
                for &aspect in format.aspects() {
                    for layer in 0..2 {
                        for level in 0..3 {
                            let layout = desc.subresource(aspect, level, layer).unwrap();
                            assert_eq!(layout.offset, end);
                            assert_eq!(layout.offset % ROW_ALIGNMENT, 0);
                            assert_eq!(layout.sample_pitch * 4, layout.size);
                            end += layout.size;
                        }
                    }
                }
                assert_eq!(desc.memory_size(), Some(end));
            }
        }
    }

    #[gaurast_runner::test]
    fn a_mip_chain_ends_in_single_texels() {
        let layout = desc().subresource(Aspect::Color, 2, 1).unwrap();
        assert_eq!(layout.extent, [8, 1, 1]);
        assert_eq!(layout.array_pitch, (192 * 7) + (64 * 3) + 64);
        assert_eq!(desc().mip_extent(40), [1, 1, 1]);
    }

    #[gaurast_runner::test]
    fn what_an_image_lacks_has_no_layout() {
        assert_eq!(desc().subresource(Aspect::Color, 3, 0), None);
        assert_eq!(desc().subresource(Aspect::Color, 0, 2), None);
        assert_eq!(desc().subresource(Aspect::Depth, 0, 0), None);
        let huge = ImageDesc { extent: [u32::MAX; 3], ..desc() };
        assert_eq!(huge.memory_size(), None);
        assert_eq!(huge.subresource(Aspect::Color, 0, 0), None);
        assert_eq!(ImageDesc { samples: 0, ..desc() }.memory_size(), None);
        assert_eq!(ImageDesc { mip_levels: u32::MAX, ..desc() }.memory_size(), None);
    }

    #[gaurast_runner::test]
    fn an_image_must_fit_its_memory() {
        let size = desc().memory_size().unwrap();
        let memory = Allocation::new_zeroed(size).unwrap();
        assert!(Image::new(desc(), memory.clone(), 0).is_ok());
        assert!(matches!(Image::new(desc(), memory.clone(), 1), Err(ImageError::Memory(_))));
        assert!(Image::new(desc(), memory, u64::MAX).is_err());
    }

    #[gaurast_runner::test]
    fn rows_are_read_and_written_within_the_subresource_only() {
        let memory = Allocation::new_zeroed(desc().memory_size().unwrap()).unwrap();
        let image = Image::new(desc(), memory, 0).unwrap();
        let layout = image.subresource(Aspect::Color, 0, 1).unwrap();
        image.write_row(&layout, [31, 6, 0], &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
        let mut out = [0; 4];
        image.read_row(&layout, [32, 6, 0], &mut out).unwrap();
        assert_eq!(out, [5, 6, 7, 8]);
        assert_eq!(image.write_row(&layout, [32, 6, 0], &[0; 8]), None);
        assert_eq!(image.read_row(&layout, [0, 7, 0], &mut out), None);
        assert_eq!(image.read_row(&layout, [0, 0, 1], &mut out), None);
        assert_eq!(image.read_row(&layout, [34, 0, 0], &mut out), None);
    }
}

#[cfg(test)]
mod decompression_tests {
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

    #[gaurast_runner::test]
    fn blocks_are_laid_out_like_texels() {
        let image = image(false);
        let extent = |level| image.subresource(Aspect::Color, level, 0).unwrap().extent;
        assert_eq!([0, 1, 2].map(extent), [[3, 2, 1], [2, 1, 1], [1, 1, 1]]);
    }

    #[gaurast_runner::test]
    fn texels_are_decoded_up_to_the_edges_and_again_when_they_change() {
        for host_visible in [false, true] {
            let image = image(host_visible);
            let black = [0, 0, 0, 255];
            assert_eq!(texel(&image, 0, [9, 5, 0]), black);
            // The last block of the largest level is white, and so is the only block of the smallest.
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

    #[gaurast_runner::test]
    fn a_view_has_the_texels_of_its_format() {
        let desc =
            ImageDesc { format: Format::Astc5x4SrgbBlock, extent: [6, 4, 1], mip_levels: 1, ..image(false).desc };
        let memory = Allocation::new(desc.memory_size().unwrap(), false).unwrap();
        let image = Arc::new(Image::new(desc, memory, 0).unwrap());
        // The second column of blocks is white; blocks of zeros are not valid, and magenta.
        let mut white = [0xFF; 16];
        white[..2].copy_from_slice(&[0xFC, 0xFD]);
        let layout = image.subresource(Aspect::Color, 0, 0).unwrap();
        assert_eq!(layout.extent, [2, 1, 1]);
        image.write_row(&layout, [1, 0, 0], &white).unwrap();
        image.memory.bump_generation();
        let view = |format: Format| {
            let image = Arc::clone(&image);
            ImageView { image, format, base_mip_level: 0, level_count: 1, base_layer: 0, layer_count: 1 }.decompressed()
        };
        let (magenta, white) = ([1.0, 0.0, 1.0, 1.0], [1.0; 4]);
        for format in [Format::Astc5x4SrgbBlock, Format::Astc5x4UnormBlock, Format::Astc5x4SrgbBlock] {
            let plain = view(format).unwrap();
            assert_eq!((Some(plain.format), plain.image.desc.format), (format.decompressed(), plain.format));
            let layout = plain.image.subresource(Aspect::Color, 0, 0).unwrap();
            let mut row = vec![0; 6 * plain.format.texel_size()];
            plain.image.read_row(&layout, [0, 3, 0], &mut row).unwrap();
            let texels = row.chunks_exact(plain.format.texel_size()).map(|texel| plain.format.decode(texel));
            assert!(texels.eq([magenta, magenta, magenta, magenta, magenta, white]), "{format:?}");
            // It is kept beside that of the other format.
            assert!(Arc::ptr_eq(&plain.image, &view(format).unwrap().image));
        }
        assert!(view(Format::Astc5x5SrgbBlock).is_none() && view(Format::Bc1RgbSrgbBlock).is_none());
        // A view of words has a texel for each block.
        let words = view(Format::R32G32B32A32Uint).unwrap();
        assert!(Arc::ptr_eq(&words.image, &image));
    }

    #[gaurast_runner::test]
    fn images_without_compression_stay_as_they_are() {
        let desc = ImageDesc { format: Format::R8Unorm, ..image(false).desc };
        let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
        let image = Image::new(desc, memory, 0).unwrap();
        assert!(image.decompressed().is_none());
    }
}
