//! Surfaces: bound images with the memory layout of their texels and the way to decode them.

use devmem::Allocation;
use std::sync::Arc;

use super::texels::{PackedLevel, TexelCodec, VectorLayout, ZERO};
use super::view::{ComponentSwizzle, IDENTITY, SampledImage, StorageImage, Swizzle, TexelBuffer};
use crate::format::{Aspect, Channel, Format, MAX_TEXEL_SIZE};
use crate::image::{ImageKind, ImageView};

/// The largest extent that is read 16 lanes at a time: texel indices up to it are exact as floats.
const MAX_EXTENT: u32 = 1 << 16;

/// The alignment of images in bytes: the size of the largest texel.
const ALIGNMENT: u64 = 16;

/// A mip level of a view. Extents are in texels, offset and pitches in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Level {
    /// The width, height and depth. They are at least 1, except for empty buffers.
    pub extent: [u32; 3],
    /// The distance from the memory's beginning to the first texel of the first layer.
    pub offset: u64,
    pub row_pitch: u64,
    pub depth_pitch: u64,
    pub sample_pitch: u64,
    pub layer_pitch: u64,
}

/// The position of a texel: x, y, z, layer, sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Texel {
    pub at: [u32; 3],
    pub layer: u32,
    pub sample: u32,
}

/// A bound image, prepared for access.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    pub memory: Arc<Allocation>,
    /// The format of the texels, which is that of one aspect.
    pub format: Format,
    pub texel_size: usize,
    /// The view's levels, from the largest on. There is at least one.
    pub levels: Vec<Level>,
    pub layers: u32,
    pub samples: u32,
    pub swizzle: Swizzle,
    /// The layout for decoding 16 texels at once, if the format has one.
    pub layout: Option<VectorLayout>,
    /// True if texels may be written.
    pub writable: bool,
}

impl Surface {
    /// The surface of a sampled image; `None` if the view has no texels of this aspect and format. That of an image with
    /// chroma is its luma, not swizzled.
    pub fn sampled(image: &SampledImage) -> Option<Self> {
        let mut surface = Self::image(&image.view, image.aspect)?;
        if image.chroma.is_some() {
            return Some(surface);
        }
        surface.swizzle = image.swizzle;
        if let Some(layout) = &mut surface.layout {
            layout.set_swizzle(image.swizzle);
        }
        Some(surface)
    }

    /// The surface of a storage image; `None` if the view has no texels of this format.
    pub fn storage(image: &StorageImage) -> Option<Self> {
        let mut surface = Self::image(&image.view, Aspect::Color)?;
        surface.writable = true;
        surface.levels.truncate(1);
        Some(surface)
    }

    /// The surface of one aspect of a view, only read, with its components in their order; `None` if there are no texels.
    pub fn image(view: &ImageView, aspect: Aspect) -> Option<Self> {
        let view = &view.decompressed()?;
        let image = &view.image;
        let format = view.format.plane(aspect)?;
        // A view of one slice of a 3D image has the slice for a layer.
        let (layer, slice) = match image.desc.kind {
            ImageKind::D3 => (0, view.base_layer),
            ImageKind::D1 | ImageKind::D2 => (view.base_layer, 0),
        };
        let levels: Vec<Level> = (0..view.level_count.min(image.desc.mip_levels))
            .map_while(|level| {
                let level = view.base_mip_level.checked_add(level)?;
                let layout = image.subresource(aspect, level, layer)?;
                let [width, height, depth] = layout.extent;
                let is_there = layout.format.texel_size() == format.texel_size() && slice < depth;
                is_there.then_some(Level {
                    extent: [width, height, depth - slice],
                    offset: image.offset + layout.offset + u64::from(slice) * layout.depth_pitch,
                    row_pitch: layout.row_pitch,
                    depth_pitch: layout.depth_pitch,
                    sample_pitch: layout.sample_pitch,
                    layer_pitch: layout.array_pitch,
                })
            })
            .collect();
        if levels.is_empty() {
            return None;
        }
        let layers = image.desc.array_layers.saturating_sub(layer);
        let layers = layers.min(view.layer_count);
        if layers == 0 {
            return None;
        }
        let mut surface = Self {
            memory: image.memory.clone(),
            format,
            texel_size: format.texel_size(),
            levels,
            layers,
            samples: image.desc.samples,
            swizzle: IDENTITY,
            layout: None,
            writable: false,
        };
        surface.layout = surface.find_layout();
        Some(surface)
    }

    /// The layout for reading 16 texels at a time; `None` if they must be read one by one.
    fn find_layout(&self) -> Option<VectorLayout> {
        let codec = TexelCodec::of(self.format)?;
        let begin = self.levels.iter().map(|level| level.offset).min()?;
        let end = self
            .levels
            .iter()
            .map(|level| {
                let [_, height, depth] = level.extent.map(u64::from);
                level.offset
                    + level.layer_pitch * u64::from(self.layers - 1)
                    + level.depth_pitch * depth.max(1)
                    + level.row_pitch * height
            })
            .max()?;
        let size = self.texel_size as u64;
        let texels = |bytes: u64| u32::try_from(bytes / size).ok();
        let exact = |level: &Level| {
            level.offset.is_multiple_of(ALIGNMENT) && level.extent.iter().all(|texels| *texels <= MAX_EXTENT)
        };
        if self.samples != 1 || !self.levels.iter().all(exact) || texels(end - begin).is_none() {
            return None;
        }
        let levels = self.levels.iter().map(|level| {
            Some(PackedLevel {
                extent: level.extent,
                base: texels(level.offset - begin)?,
                row_pitch: texels(level.row_pitch)?,
                depth_pitch: texels(level.depth_pitch)?,
                layer_pitch: texels(level.layer_pitch)?,
            })
        });
        let mut layout = VectorLayout {
            codec,
            words: (begin / 4) as usize..(end.min(self.memory.len()) / 4) as usize,
            levels: levels.collect::<Option<_>>()?,
            order: self.stored_order(),
            sources: [ZERO; 4],
            is_filterable: !self.is_integer(),
        };
        layout.set_swizzle(IDENTITY);
        Some(layout)
    }

    /// The index of the stored component for red, green, blue and alpha.
    fn stored_order(&self) -> [usize; 4] {
        let components = self.format.components();
        let position = |channel: Channel, otherwise: usize| {
            let found = components.iter().position(|c| c.channel == channel);
            found.unwrap_or(otherwise)
        };
        [position(Channel::R, 0), position(Channel::G, 1), position(Channel::B, 2), position(Channel::A, 3)]
    }

    /// The layout of a buffer for reading 16 texels at a time; `None` if they must be read one by one.
    fn find_buffer_layout(&self) -> Option<VectorLayout> {
        let codec = TexelCodec::of(self.format)?;
        let [level] = self.levels.as_slice() else {
            return None;
        };
        let [texels, ..] = level.extent;
        let words = (u64::from(texels) * self.texel_size as u64).div_ceil(4);
        let begin = level.offset / 4;
        // An incomplete word at the end of the memory is not among its words.
        let are_words = level.offset.is_multiple_of(4) && begin + words <= self.memory.len() / 4;
        if !are_words || u32::try_from(words).is_err() {
            return None;
        }
        let size = PackedLevel { extent: level.extent, base: 0, row_pitch: 0, depth_pitch: 0, layer_pitch: 0 };
        let mut layout = VectorLayout {
            codec,
            words: begin as usize..(begin + words) as usize,
            levels: vec![size],
            order: self.stored_order(),
            sources: [ZERO; 4],
            is_filterable: false,
        };
        layout.set_swizzle(IDENTITY);
        Some(layout)
    }

    /// The surface of a texel buffer: one row. `None` if the range does not lie within its memory.
    pub fn buffer(buffer: &TexelBuffer) -> Option<Self> {
        let range = &buffer.range;
        let end = range.offset.checked_add(range.size)?;
        let texel_size = buffer.format.texel_size();
        if end > range.memory.len() || texel_size == 0 {
            return None;
        }
        let texels = u32::try_from(range.size / texel_size as u64).unwrap_or(u32::MAX);
        let mut surface = Self {
            memory: range.memory.clone(),
            format: buffer.format,
            texel_size,
            levels: vec![Level {
                extent: [texels, 1, 1],
                offset: range.offset,
                row_pitch: range.size,
                depth_pitch: range.size,
                sample_pitch: range.size,
                layer_pitch: range.size,
            }],
            layers: 1,
            samples: 1,
            swizzle: IDENTITY,
            layout: None,
            writable: true,
        };
        surface.layout = surface.find_buffer_layout();
        Some(surface)
    }

    /// The byte offset of a texel; `None` if there is no such texel.
    #[inline]
    pub fn offset(&self, level: usize, texel: Texel) -> Option<u64> {
        let level = self.levels.get(level)?;
        let [x, y, z] = texel.at;
        let inside = x < level.extent[0]
            && y < level.extent[1]
            && z < level.extent[2]
            && texel.layer < self.layers
            && texel.sample < self.samples;
        inside.then(|| {
            level.offset
                + u64::from(texel.layer) * level.layer_pitch
                + u64::from(texel.sample) * level.sample_pitch
                + u64::from(z) * level.depth_pitch
                + u64::from(y) * level.row_pitch
                + u64::from(x) * self.texel_size as u64
        })
    }

    /// The components of a texel, not swizzled; `None` if there is no such texel.
    pub fn texel(&self, level: usize, texel: Texel) -> Option<[u32; 4]> {
        let mut bytes = [0; MAX_TEXEL_SIZE];
        let bytes = &mut bytes[..self.texel_size];
        let offset = self.offset(level, texel)?;
        self.memory.read(offset, bytes).ok()?;
        Some(self.format.decode(bytes).map(f32::to_bits))
    }

    /// The texel that is read outside the image: zeros, with the default for an alpha that the format lacks.
    pub fn outside(&self) -> [u32; 4] {
        let bytes = [0; MAX_TEXEL_SIZE];
        let zeros = &bytes[..self.texel_size];
        match self.format.has(Channel::A) || !self.format.aspects().contains(&Aspect::Color) {
            true => [0; 4],
            false => self.format.decode(zeros).map(f32::to_bits),
        }
    }

    /// The value 1 of a component: that of a missing alpha, or of a swizzle's one.
    pub fn one(&self) -> u32 {
        if self.is_integer() { 1 } else { 1f32.to_bits() }
    }

    /// True if components are integers, which are never averaged.
    pub fn is_integer(&self) -> bool {
        self.format.is_integer()
    }

    /// The components of a texel after swizzling.
    pub fn swizzled(&self, texel: [u32; 4]) -> [u32; 4] {
        let one = self.one();
        self.swizzle.map(|from| from.pick(&texel, 0, one))
    }

    /// One component of a texel after swizzling.
    pub fn component(&self, texel: &[u32; 4], component: u8) -> u32 {
        let from = self.swizzle.get(usize::from(component));
        from.unwrap_or(&ComponentSwizzle::Zero).pick(texel, 0, self.one())
    }
}
