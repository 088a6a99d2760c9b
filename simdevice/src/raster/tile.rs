//! Tile buffer A: a macro-tile's piece of the attachments.
//!
//! A tile (16x16 pixels) of an attachment is loaded or cleared when a draw first touches it, and stored if it was;
//! what no draw touches is never loaded, and cleared only in memory. Texels are always exactly representable in
//! the attachment's format, so that a store and a load in the middle of a pass change nothing. Tiles rather than
//! macro-tiles are loaded and stored, so that the size of a macro-tile changes nothing either.

use crate::format::{Format, MAX_TEXEL_SIZE};
use crate::image::{Image, ImageKind, ImageView, SubresourceLayout};
use crate::packet::{Aspect, Rect, StoreOp};
use crate::raster::{MAX_MACRO_TILE_SIZE, TILE_SIZE};
use std::sync::Arc;

const SIDE: usize = TILE_SIZE as usize;
const AREA: usize = SIDE * SIDE;
// A plane keeps a bit per tile.
const _: () = assert!((MAX_MACRO_TILE_SIZE / TILE_SIZE).pow(2) <= u64::BITS);

/// An attachment's view cannot be rendered to.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AttachmentError {
    /// The view's format lacks the aspect, or its texels differ in size from the image's.
    #[error("a view of format {0:?} cannot be this attachment")]
    Format(Format),
    /// The image lacks the view's subresource.
    #[error("the image lacks mip level {level}, layer {layer}")]
    Subresource {
        /// The mip level.
        level: u32,
        /// The array layer.
        layer: u32,
    },
    /// More than one sample per texel.
    #[error("attachments of {0} samples cannot be rendered to")]
    Samples(u32),
    /// Wider or higher than [`MAX_FRAMEBUFFER_SIZE`].
    #[error("an attachment of {0}x{1} pixels is too large")]
    Extent(u32, u32),
}

/// The greatest width and height of an attachment in pixels.
pub const MAX_FRAMEBUFFER_SIZE: u32 = 1 << 16;

/// One aspect of an attachment: where its texels are, and what a tile begins with.
#[derive(Clone, Debug)]
pub struct Target {
    image: Arc<Image>,
    format: Format,
    /// Subresource and z of each layer.
    layers: Vec<(SubresourceLayout, u32)>,
    /// The bytes of the texel that it is cleared to, until that is done.
    pub clear: Option<[u8; MAX_TEXEL_SIZE]>,
    /// What becomes of it at the end of the pass.
    pub store: StoreOp,
}

impl Target {
    /// The first `layer_count` layers of `view`, or as many as the image has.
    ///
    /// # Errors
    /// [`AttachmentError`] if the view cannot be rendered to.
    pub fn new(
        view: &ImageView,
        aspect: Aspect,
        layer_count: u32,
        store: StoreOp,
    ) -> Result<Self, AttachmentError> {
        let (image, level) = (&view.image, view.base_mip_level);
        let format = view
            .format
            .plane(aspect)
            .ok_or(AttachmentError::Format(view.format))?;
        if image.desc.samples != 1 {
            return Err(AttachmentError::Samples(image.desc.samples));
        }
        let layer = |index: u32| {
            let layer = view.base_layer.checked_add(index)?;
            match image.desc.kind {
                ImageKind::D1 | ImageKind::D2 => {
                    Some((image.subresource(aspect, level, layer)?, 0))
                }
                // The layers of a view of a 3D image are its slices.
                ImageKind::D3 => {
                    let layout = image.subresource(aspect, level, 0)?;
                    (layer < layout.extent[2]).then_some((layout, layer))
                }
            }
        };
        let layers: Vec<_> = (0..layer_count.max(1)).map_while(layer).collect();
        let Some((layout, _)) = layers.first() else {
            return Err(AttachmentError::Subresource {
                level,
                layer: view.base_layer,
            });
        };
        if layout.format.texel_size() != format.texel_size() {
            return Err(AttachmentError::Format(view.format));
        }
        let [width, height, _] = layout.extent;
        if width.max(height) > MAX_FRAMEBUFFER_SIZE {
            return Err(AttachmentError::Extent(width, height));
        }
        Ok(Self {
            image: image.clone(),
            format,
            layers,
            clear: None,
            store,
        })
    }

    /// How its texels are read.
    pub fn format(&self) -> Format {
        self.format
    }

    /// How many layers are rendered to.
    pub fn layer_count(&self) -> u32 {
        self.layers.len() as u32
    }

    /// Its width and height in pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.layers
            .iter()
            .map(|(layout, _)| [layout.extent[0], layout.extent[1]])
            .next()
            .unwrap_or_default()
    }

    /// Marks its memory as changed.
    pub fn bump_generation(&self) {
        self.image.memory.bump_generation();
    }

    /// Reads the bytes of texels from pixel (x, y) on; they stay as they are where there are none.
    fn read(&self, layer: u32, x: u32, y: u32, bytes: &mut [u8]) {
        if let Some((layout, z)) = self.layers.get(layer as usize) {
            // Tiles are clipped to the attachments before they are rendered.
            let _ = self.image.read_row(layout, [x, y, *z], bytes);
        }
    }

    /// Writes the bytes of texels from pixel (x, y) on, where there are any.
    fn write(&self, layer: u32, x: u32, y: u32, bytes: &[u8]) {
        if let Some((layout, z)) = self.layers.get(layer as usize) {
            // As above.
            let _ = self.image.write_row(layout, [x, y, *z], bytes);
        }
    }
}

/// What a plane of a tile buffer holds per pixel.
pub trait Texel: Copy + Default {
    /// Reads consecutive texels.
    fn decode_row(format: Format, bytes: &[u8], out: &mut [Self]);
    /// Writes consecutive texels.
    fn encode_row(format: Format, texels: &[Self], out: &mut [u8]);
}

/// A colour.
impl Texel for [f32; 4] {
    fn decode_row(format: Format, bytes: &[u8], out: &mut [Self]) {
        format.decode_row(bytes, out);
    }

    fn encode_row(format: Format, texels: &[Self], out: &mut [u8]) {
        format.encode_row(texels, out);
    }
}

/// A depth.
impl Texel for f32 {
    fn decode_row(format: Format, bytes: &[u8], out: &mut [Self]) {
        for (bytes, out) in bytes.chunks_exact(format.texel_size()).zip(out) {
            [*out, ..] = format.decode(bytes);
        }
    }

    fn encode_row(format: Format, texels: &[Self], out: &mut [u8]) {
        for (out, &depth) in out.chunks_exact_mut(format.texel_size()).zip(texels) {
            let texel = format.encode([depth, 0.0, 0.0, 0.0]);
            out.copy_from_slice(&texel[..out.len()]);
        }
    }
}

/// A stencil value.
impl Texel for u8 {
    fn decode_row(_: Format, bytes: &[u8], out: &mut [Self]) {
        for (&byte, out) in bytes.iter().zip(out) {
            *out = byte;
        }
    }

    fn encode_row(_: Format, texels: &[Self], out: &mut [u8]) {
        for (&texel, out) in texels.iter().zip(out) {
            *out = texel;
        }
    }
}

/// A tile of a macro-tile: its index there, and the pixels of it that the pass may touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Row by row within the macro-tile.
    pub index: usize,
    /// Column and row in tiles from the framebuffer's corner.
    pub at: [u32; 2],
    /// The pixels that the pass may touch; never empty, never left of or above the framebuffer.
    pub pixels: Rect,
}

impl Tile {
    /// The tiles of macro-tile (`column`, `row`) of `size` pixels that have pixels of `area`.
    pub fn of_macro_tile(
        size: u32,
        [column, row]: [u32; 2],
        area: Rect,
    ) -> impl Iterator<Item = Self> {
        let side = size / TILE_SIZE;
        (0..side * side).filter_map(move |index| {
            let at = [column * side + index % side, row * side + index / side];
            let whole = Rect {
                x: (at[0] * TILE_SIZE) as i32,
                y: (at[1] * TILE_SIZE) as i32,
                width: TILE_SIZE,
                height: TILE_SIZE,
            };
            let pixels = whole.intersect(area);
            (!pixels.is_empty()).then_some(Self {
                index: index as usize,
                at,
                pixels,
            })
        })
    }

    /// Rows of `rect` within this tile's pixels: y, and the columns, both in pixels from the tile's corner.
    pub fn rows(&self, rect: Rect) -> impl Iterator<Item = (usize, std::ops::Range<usize>)> {
        let part = self.pixels.intersect(rect);
        let inside = |at: i32| (at as u32 % TILE_SIZE) as usize;
        let (x, y) = (inside(part.x), inside(part.y));
        let height = if part.is_empty() { 0 } else { part.height };
        (y..y + height as usize).map(move |y| (y, x..x + part.width as usize))
    }

    /// The pixel of the framebuffer at (x, y) from the tile's corner.
    fn pixel(&self, x: usize, y: usize) -> [u32; 2] {
        [
            self.at[0] * TILE_SIZE + x as u32,
            self.at[1] * TILE_SIZE + y as u32,
        ]
    }
}

/// One attachment's texels of a macro-tile, tile by tile, each row by row.
#[derive(Debug, Default)]
pub struct Plane<T> {
    texels: Vec<T>,
    /// Bit `index` tells that the tile was loaded or cleared here.
    touched: u64,
}

impl<T: Texel> Plane<T> {
    /// A plane for macro-tiles of `size` pixels.
    pub fn new(size: u32) -> Self {
        Self {
            texels: vec![T::default(); (size * size) as usize],
            touched: 0,
        }
    }

    /// The texels of a tile, loaded or cleared if this is the first touch.
    pub fn touch(&mut self, target: &Target, layer: u32, tile: &Tile) -> &mut [T; AREA] {
        let first = self.touched >> tile.index & 1 == 0;
        self.touched |= 1 << tile.index;
        let texels = tile_of(&mut self.texels, tile.index);
        if first {
            let size = target.format.texel_size();
            let mut bytes = [0; SIDE * MAX_TEXEL_SIZE];
            if let Some(clear) = &target.clear {
                fill(&mut bytes, &clear[..size]);
            }
            for (y, columns) in tile.rows(tile.pixels) {
                let bytes = &mut bytes[..columns.len() * size];
                if target.clear.is_none() {
                    let [x, y] = tile.pixel(columns.start, y);
                    target.read(layer, x, y, bytes);
                }
                let row = &mut texels[y * SIDE..][columns];
                T::decode_row(target.format, bytes, row);
            }
        }
        texels
    }

    /// Stores a tile that was touched; clears in memory one that was not, if the pass is to clear it.
    /// Afterwards no tile of that index is touched.
    pub fn finish(&mut self, target: &Target, layer: u32, tile: &Tile, keep: bool) {
        let touched = self.touched >> tile.index & 1 == 1;
        self.touched &= !(1 << tile.index);
        if !keep || !touched && target.clear.is_none() {
            return;
        }
        let size = target.format.texel_size();
        let mut bytes = [0; SIDE * MAX_TEXEL_SIZE];
        if let Some(clear) = target.clear.as_ref().filter(|_| !touched) {
            fill(&mut bytes, &clear[..size]);
        }
        let texels = tile_of(&mut self.texels, tile.index);
        for (y, columns) in tile.rows(tile.pixels) {
            let [x, screen_y] = tile.pixel(columns.start, y);
            let bytes = &mut bytes[..columns.len() * size];
            if touched {
                T::encode_row(target.format, &texels[y * SIDE..][columns], bytes);
            }
            target.write(layer, x, screen_y, bytes);
        }
    }
}

fn tile_of<T>(texels: &mut [T], index: usize) -> &mut [T; AREA] {
    let (tiles, _) = texels.as_chunks_mut();
    &mut tiles[index]
}

/// Repeats `texel` over `bytes`.
fn fill(bytes: &mut [u8], texel: &[u8]) {
    for chunk in bytes.chunks_exact_mut(texel.len()) {
        chunk.copy_from_slice(texel);
    }
}

/// Sets the pixels of a tile that lie in `rect`.
pub fn fill_rect<T: Texel>(texels: &mut [T; AREA], tile: &Tile, rect: Rect, value: T) {
    for (y, columns) in tile.rows(rect) {
        texels[y * SIDE..][columns].fill(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::ImageDesc;
    use devmem::Allocation;

    fn view(format: Format, extent: [u32; 3], kind: ImageKind) -> ImageView {
        let desc = ImageDesc {
            kind,
            format,
            extent,
            mip_levels: 1,
            array_layers: 1,
            samples: 1,
        };
        let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
        ImageView {
            image: Arc::new(Image::new(desc, memory, 0).unwrap()),
            format,
            base_mip_level: 0,
            level_count: 1,
            base_layer: 0,
            layer_count: 1,
        }
    }

    const AREA_20X17: Rect = Rect {
        x: 3,
        y: 0,
        width: 17,
        height: 17,
    };

    #[test]
    fn tiles_are_clipped_to_the_area() {
        let tiles: Vec<_> = Tile::of_macro_tile(32, [0, 0], AREA_20X17).collect();
        let rects: Vec<_> = tiles
            .iter()
            .map(|tile| {
                let Rect {
                    x,
                    y,
                    width,
                    height,
                } = tile.pixels;
                (tile.index, x, y, width, height)
            })
            .collect();
        assert_eq!(
            rects,
            [
                (0, 3, 0, 13, 16),
                (1, 16, 0, 4, 16),
                (2, 3, 16, 13, 1),
                (3, 16, 16, 4, 1)
            ]
        );
        assert_eq!(tiles[3].rows(AREA_20X17).collect::<Vec<_>>(), [(0, 0..4)]);
        assert_eq!(Tile::of_macro_tile(32, [1, 0], AREA_20X17).count(), 0);
    }

    #[test]
    fn untouched_tiles_keep_their_bytes_and_touched_ones_are_stored() {
        let view = view(Format::R8G8B8A8Unorm, [20, 17, 1], ImageKind::D2);
        let memory = view.image.memory.clone();
        memory.fill(0, memory.len(), 7).unwrap();
        let target = Target::new(&view, Aspect::Color, 1, StoreOp::Store).unwrap();
        assert_eq!(target.extent(), [20, 17]);
        let mut plane = Plane::<[f32; 4]>::new(32);
        for tile in Tile::of_macro_tile(32, [0, 0], AREA_20X17) {
            if tile.index == 1 {
                let texels = plane.touch(&target, 0, &tile);
                assert_eq!(texels[0], [7.0 / 255.0; 4]);
                fill_rect(
                    texels,
                    &tile,
                    Rect {
                        x: 17,
                        y: 1,
                        width: 1,
                        height: 1,
                    },
                    [1.0; 4],
                );
            }
            plane.finish(&target, 0, &tile, true);
        }
        let mut bytes = vec![0u8; memory.len() as usize];
        memory.read(0, &mut bytes).unwrap();
        let changed: Vec<_> = (0..bytes.len()).filter(|&at| bytes[at] != 7).collect();
        let pitch = 128;
        assert_eq!(
            changed,
            (0..4).map(|at| pitch + 17 * 4 + at).collect::<Vec<_>>()
        );
    }

    #[test]
    fn depth_and_stencil_keep_their_precision() {
        let view = view(Format::D24UnormS8Uint, [16, 16, 1], ImageKind::D2);
        let mut depth = Target::new(&view, Aspect::Depth, 1, StoreOp::Store).unwrap();
        depth.clear = Some(Format::X8D24UnormPack32.encode([0.75, 0.0, 0.0, 0.0]));
        let mut stencil = Target::new(&view, Aspect::Stencil, 1, StoreOp::Store).unwrap();
        stencil.clear = Some([3; MAX_TEXEL_SIZE]);
        let area = Rect {
            x: 0,
            y: 0,
            width: 16,
            height: 16,
        };
        let [tile] = Tile::of_macro_tile(16, [0, 0], area).collect::<Vec<_>>()[..] else {
            panic!("one tile");
        };
        let (mut depths, mut stencils) = (Plane::<f32>::new(16), Plane::<u8>::new(16));
        depths.touch(&depth, 0, &tile)[5] = 1.0;
        depths.finish(&depth, 0, &tile, true);
        stencils.touch(&stencil, 0, &tile)[6] = 200;
        stencils.finish(&stencil, 0, &tile, true);
        (depth.clear, stencil.clear) = (None, None);
        let depths = depths.touch(&depth, 0, &tile);
        assert_eq!(depths[5], 1.0);
        assert!((depths[4] - 0.75).abs() < 1e-7);
        assert_eq!(stencils.touch(&stencil, 0, &tile)[5..8], [3, 200, 3]);
    }

    #[test]
    fn what_cannot_be_rendered_to_is_refused() {
        let color = view(Format::R8Unorm, [4, 4, 1], ImageKind::D2);
        let new = |view: &ImageView, aspect| Target::new(view, aspect, 1, StoreOp::Store).err();
        assert_eq!(
            new(&color, Aspect::Depth),
            Some(AttachmentError::Format(Format::R8Unorm))
        );
        let wider = ImageView {
            format: Format::R32Sfloat,
            ..color.clone()
        };
        assert_eq!(
            new(&wider, Aspect::Color),
            Some(AttachmentError::Format(Format::R32Sfloat))
        );
        let missing = ImageView {
            base_layer: u32::MAX,
            ..color
        };
        assert!(matches!(
            new(&missing, Aspect::Color),
            Some(AttachmentError::Subresource { .. })
        ));
        let solid = view(Format::R8Unorm, [4, 4, 3], ImageKind::D3);
        let target = Target::new(&solid, Aspect::Color, 9, StoreOp::Store).unwrap();
        assert_eq!(target.layer_count(), 3, "slices are layers");
    }
}
