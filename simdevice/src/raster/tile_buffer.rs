//! Tile buffers: a macro-tile's part of an attachment, the addresses of quads in it, and the loading and storing of
//! tiles.
//!
//! A tile (16x16 pixels) of an attachment is loaded or cleared when a draw first touches it, and is stored only then. A
//! tile that no draw touches is never loaded, and cleared only in memory. Texels have the same bytes as in memory, but
//! for depths, which are in their format's encoding (see [`DepthEncoding`]), so that a store and a load in the middle of
//! a pass change nothing. Tiles rather than macro-tiles are loaded and stored, so that the result is independent of
//! the size of macro-tiles.
//!
//! [`DepthEncoding`]: crate::format::depth::DepthEncoding

use super::tile::{AREA, SIDE, Tile, place};
use crate::format::depth::{ordered, unordered};
use crate::format::unorm8::{pack_unorm8, unorm8_fraction};
use crate::format::{Aspect, Format, MAX_TEXEL_SIZE};
use crate::image::resolve::resolve_row;
use crate::image::{Image, ImageDesc, ImageKind, ImageView, SubresourceLayout};
use crate::limits::{MAX_FRAMEBUFFER_SIZE, MAX_SAMPLES, TILE_SIZE};
use crate::packet::StoreOp;
use crate::state::{Rect, ResolveMode};
use devmem::Allocation;
use devmem::dispatch;
use devmem::host;
use fearless_simd::{Level, Simd, f32x16, prelude::*, u32x16};
use std::sync::Arc;

/// The most samples of a pixel.
const SAMPLES: usize = MAX_SAMPLES as usize;

/// The texels of one attachment in a macro-tile: by tile, then sample, then pixel (see [`place`]).
#[derive(Debug, Default)]
pub struct TileBuffer {
    /// The texels' bytes. They are stored as words for alignment.
    words: Vec<u32>,
    /// The bytes of a texel in the buffer.
    stride: usize,
    samples: usize,
    /// A bit for each tile: 1 if the tile was loaded or cleared here.
    touched: u64,
    /// A bit for each tile: 1 if its element of `ranges` is valid.
    ranged: u64,
    /// The least and the greatest word of each tile.
    ranges: Vec<[u32; 2]>,
}

/// The difference between a texel in the tile buffer and in memory.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// The bytes are the same.
    Same,
    /// A 16-bit depth, which has 32 bits in the buffer.
    Depth16,
    /// A 24-bit depth in 32 bits, of which the upper ones are unused in memory.
    Depth24,
    /// A floating-point depth, whose bits in the buffer are ordered as depths are.
    DepthFloat,
}

impl Kind {
    fn of(format: Format) -> Self {
        match format {
            Format::D16Unorm => Self::Depth16,
            Format::X8D24UnormPack32 => Self::Depth24,
            Format::D32Sfloat => Self::DepthFloat,
            _ => Self::Same,
        }
    }
}

/// The bytes of a texel of `format` in a tile buffer.
fn stride(format: Format) -> usize {
    match Kind::of(format) {
        Kind::Same => format.texel_size(),
        Kind::Depth16 | Kind::Depth24 | Kind::DepthFloat => 4,
    }
}

/// The bytes in a tile buffer of a texel whose bytes in memory are at the beginning of `bytes`.
fn unpack(format: Format, bytes: &[u8]) -> [u8; MAX_TEXEL_SIZE] {
    let mut texel = [0; MAX_TEXEL_SIZE];
    let size = match Kind::of(format) {
        Kind::Same => format.texel_size(),
        Kind::Depth16 => 2,
        Kind::Depth24 => 3,
        Kind::DepthFloat => 4,
    };
    texel[..size].copy_from_slice(&bytes[..size]);
    if matches!(Kind::of(format), Kind::DepthFloat) {
        change_words(&mut texel[..size], ordered);
    }
    texel
}

/// Applies a function to each word of a row of texels.
#[inline(always)]
fn change_words(bytes: &mut [u8], change: impl Fn(u32) -> u32) {
    for word in bytes.as_chunks_mut::<4>().0 {
        *word = change(u32::from_ne_bytes(*word)).to_ne_bytes();
    }
}

impl TileBuffer {
    /// A buffer for macro-tiles of `size` x `size` pixels of a target.
    pub fn new(size: u32, target: Option<&Target>) -> Self {
        let Some(target) = target else {
            return Self::default();
        };
        let (stride, samples) = (stride(target.format()), target.samples() as usize);
        let bytes = (size * size) as usize * samples * stride;
        Self {
            words: host::zeroed(bytes.div_ceil(4)),
            stride,
            samples,
            touched: 0,
            ranged: 0,
            ranges: host::zeroed((size / TILE_SIZE).pow(2) as usize),
        }
    }

    /// True if a tile was loaded or cleared.
    #[inline]
    pub fn is_touched(&self, tile: usize) -> bool {
        self.touched >> tile & 1 == 1
    }

    /// The number of samples of a pixel.
    #[inline(always)]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// The index of the first texel of a sample of a tile.
    #[inline(always)]
    pub fn start(&self, tile: usize, sample: usize) -> usize {
        (tile * self.samples + sample) * AREA
    }

    /// The bytes of all texels.
    #[inline(always)]
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(&mut self.words)
    }

    /// The words of all texels.
    #[inline(always)]
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The words of all texels, mutable.
    #[inline(always)]
    pub fn words_mut(&mut self) -> &mut [u32] {
        &mut self.words
    }

    /// The least and the greatest word of all samples of a tile.
    #[inline(always)]
    pub fn range<S: Simd>(&mut self, simd: S, tile: usize) -> [u32; 2] {
        if self.ranged >> tile & 1 == 0 {
            let count = self.samples * AREA;
            let words = &self.words[tile * count..][..count];
            let (mut least, mut greatest) = (u32x16::splat(simd, u32::MAX), u32x16::splat(simd, 0));
            for chunk in words.as_chunks::<16>().0 {
                let chunk = u32x16::simd_from(simd, *chunk);
                least = least.min(chunk);
                greatest = greatest.max(chunk);
            }
            self.ranges[tile] = [least.reduce_min(), greatest.reduce_max()];
            self.ranged |= 1 << tile;
        }
        self.ranges[tile]
    }

    /// Invalidates the range of a tile whose words have changed.
    #[inline(always)]
    pub fn changed(&mut self, tile: usize) {
        self.ranged &= !(1 << tile);
    }

    /// The bytes of one sample of a tile.
    pub fn sample_mut(&mut self, tile: usize, sample: usize) -> &mut [u8] {
        self.changed(tile);
        let (start, stride) = (self.start(tile, sample), self.stride);
        &mut self.bytes_mut()[start * stride..][..AREA * stride]
    }

    /// Loads or clears a tile if it was not touched yet.
    #[inline]
    pub fn load_or_clear(&mut self, target: &Target, layer: u32, tile: &Tile) {
        if !self.is_touched(tile.index) {
            self.load(target, layer, tile);
        }
    }

    /// Marks a tile as touched. All its texels must be overwritten before they are read.
    pub fn mark_overwritten(&mut self, tile: usize) {
        self.touched |= 1 << tile;
    }

    #[cold]
    fn load(&mut self, target: &Target, layer: u32, tile: &Tile) {
        self.touched |= 1 << tile.index;
        let (format, stride) = (target.format(), self.stride);
        for sample in 0..self.samples {
            let texels = self.sample_mut(tile.index, sample);
            if let Some(clear) = &target.clear {
                fill(texels, &unpack(format, clear)[..stride]);
                continue;
            }
            let rows = match &target.initial {
                Some(single) => single.sample(layer, 0),
                None => target.sample(layer, sample as u32),
            };
            let Some(rows) = rows else {
                continue;
            };
            let size = format.texel_size();
            let mut bytes = [0; SIDE * MAX_TEXEL_SIZE];
            for (y, columns) in tile.rows(tile.pixels) {
                let bytes = &mut bytes[..columns.len() * size];
                rows.read(tile.pixel(columns.start, y), bytes);
                if matches!(Kind::of(format), Kind::DepthFloat) {
                    change_words(bytes, ordered);
                }
                if matches!(Kind::of(format), Kind::Same | Kind::DepthFloat) {
                    set_row(texels, size, y, columns.start, bytes);
                    continue;
                }
                for (x, texel) in columns.zip(bytes.chunks_exact(size)) {
                    let at = place(x, y) * stride;
                    texels[at..at + stride].copy_from_slice(&unpack(format, texel)[..stride]);
                }
            }
        }
    }

    /// Stores a tile that is touched or cleared, and keeps it.
    pub fn write_through(&mut self, target: &Target, layer: u32, tile: &Tile) {
        if target.clear.is_some() || target.initial.is_some() {
            self.load_or_clear(target, layer, tile);
        }
        if self.is_touched(tile.index) {
            self.finish(target, layer, tile, true);
            self.touched |= 1 << tile.index;
        }
    }

    /// Stores a touched tile, if `keep`. Clears an untouched one in memory, if the pass clears it. Afterwards the tile
    /// is untouched.
    pub fn finish(&mut self, target: &Target, layer: u32, tile: &Tile, keep: bool) {
        if keep && target.initial.is_some() {
            self.load_or_clear(target, layer, tile);
        }
        let touched = self.is_touched(tile.index);
        self.touched &= !(1 << tile.index);
        self.changed(tile.index);
        if !keep || !touched && target.clear.is_none() {
            return;
        }
        let (size, stride) = (target.format().texel_size(), self.stride);
        let mut row = [0; SIDE * MAX_TEXEL_SIZE];
        if let Some(clear) = target.clear.as_ref().filter(|_| !touched) {
            fill(&mut row[..SIDE * size], &clear[..size]);
        }
        for sample in 0..self.samples {
            let Some(rows) = target.sample(layer, sample as u32) else {
                continue;
            };
            let texels = self.sample_mut(tile.index, sample);
            for (y, columns) in tile.rows(tile.pixels) {
                let at = tile.pixel(columns.start, y);
                let bytes = &mut row[..columns.len() * size];
                if touched && stride == size {
                    get_row(texels, size, y, columns.start, bytes);
                } else if touched {
                    for (x, out) in columns.zip(bytes.chunks_exact_mut(size)) {
                        // The bytes of a depth in memory are the lower ones.
                        out.copy_from_slice(&texels[place(x, y) * stride..][..size]);
                    }
                }
                if touched && matches!(Kind::of(target.format()), Kind::DepthFloat) {
                    change_words(bytes, unordered);
                }
                rows.write(at, bytes);
            }
        }
    }

    /// Resolves a touched tile: writes one sample for each of its pixels to `resolved`.
    pub fn resolve(
        &mut self,
        level: Level,
        target: &Target,
        resolved: &Target,
        mode: ResolveMode,
        layer: u32,
        tile: &Tile,
    ) {
        let (format, samples, stride) = (target.format(), self.samples, self.stride);
        let Some(resolved_rows) = resolved.sample(layer, 0) else {
            return;
        };
        if samples == SAMPLES && mode == ResolveMode::Average && is_unorm8(format) && resolved.format() == format {
            let words = &self.words[tile.index * SAMPLES * AREA..][..SAMPLES * AREA];
            let mut means = [0; AREA];
            dispatch!(level, simd => unorm8_means(simd, words, &mut means));
            let mut row = [0; 4 * SIDE];
            for (y, columns) in tile.rows(tile.pixels) {
                let bytes = &mut row[..4 * columns.len()];
                get_row(bytemuck::cast_slice(&means), 4, y, columns.start, bytes);
                resolved_rows.write(tile.pixel(columns.start, y), bytes);
            }
            return;
        }
        let (size, resolved_size) = (format.texel_size(), resolved.format().texel_size());
        let has_mean = mode != ResolveMode::Average || !format.is_integer();
        let copied = mode == ResolveMode::SampleZero || !has_mean || samples == 1;
        for (y, columns) in tile.rows(tile.pixels) {
            let count = columns.len();
            let mut decoded = [[[0f32; 4]; SIDE]; SAMPLES];
            let mut row = [0; SIDE * MAX_TEXEL_SIZE];
            let used = if copied { 1 } else { samples };
            for (sample, decoded) in decoded.iter_mut().enumerate().take(used) {
                let texels = self.sample_mut(tile.index, sample);
                let bytes = &mut row[..count * size];
                for (x, out) in columns.clone().zip(bytes.chunks_exact_mut(size)) {
                    out.copy_from_slice(&texels[place(x, y) * stride..][..size]);
                }
                if matches!(Kind::of(format), Kind::DepthFloat) {
                    change_words(bytes, unordered);
                }
                if !copied {
                    format.decode_row(bytes, &mut decoded[..count]);
                }
            }
            let bytes = &mut row[..count * resolved_size];
            if !copied {
                let mut row = [[0f32; 4]; SIDE];
                let rows = decoded[..used].iter().map(|row| &row[..count]);
                resolve_row(format, mode, rows, &mut row[..count]);
                resolved.format().encode_row(&row[..count], bytes);
            }
            resolved_rows.write(tile.pixel(columns.start, y), bytes);
        }
    }

    /// Sets all samples of the pixels of a tile that lie in `rect` to a texel, given as its bytes in memory.
    pub fn fill_rect(&mut self, format: Format, tile: &Tile, rect: Rect, texel: &[u8]) {
        let stride = self.stride;
        let texel = unpack(format, texel);
        for sample in 0..self.samples {
            let texels = self.sample_mut(tile.index, sample);
            for (y, columns) in tile.rows(rect) {
                for x in columns {
                    texels[place(x, y) * stride..][..stride].copy_from_slice(&texel[..stride]);
                }
            }
        }
    }
}

/// True if texels are four bytes from 0 to 1.
fn is_unorm8(format: Format) -> bool {
    matches!(format, Format::R8G8B8A8Unorm | Format::A8B8G8R8UnormPack32 | Format::B8G8R8A8Unorm)
}

/// The means of a tile's samples of four bytes, with the same bits as from [`resolve_row`] and the format.
#[inline(always)]
fn unorm8_means<S: Simd>(simd: S, words: &[u32], means: &mut [u32; AREA]) {
    for (block, mean) in means.as_chunks_mut::<16>().0.iter_mut().enumerate() {
        let mut sums = [f32x16::splat(simd, 0.0); 4];
        for (sample, words) in words.as_chunks::<AREA>().0.iter().enumerate() {
            let texels = u32x16::simd_from(simd, words.as_chunks::<16>().0[block]);
            for (byte, sum) in sums.iter_mut().enumerate() {
                let value = unorm8_fraction(texels, 8 * byte as u32);
                *sum = if sample == 0 { value } else { *sum + value };
            }
        }
        for sum in &mut sums {
            *sum *= 0.25;
        }
        *mean = pack_unorm8(simd, &sums, false).into();
    }
}

/// Repeats `texel` over `bytes`.
fn fill(bytes: &mut [u8], texel: &[u8]) {
    match texel.len() {
        1 => fill_each::<1>(bytes, texel),
        2 => fill_each::<2>(bytes, texel),
        4 => fill_each::<4>(bytes, texel),
        8 => fill_each::<8>(bytes, texel),
        12 => fill_each::<12>(bytes, texel),
        16 => fill_each::<16>(bytes, texel),
        size => bytes.chunks_exact_mut(size).for_each(|chunk| chunk.copy_from_slice(texel)),
    }
}

fn fill_each<const N: usize>(bytes: &mut [u8], texel: &[u8]) {
    if let (texels, Ok(texel)) = (bytes.as_chunks_mut::<N>().0, texel.try_into()) {
        texels.fill(texel);
    }
}

/// Copies a row of one sample of a tile, from column `first` on, to `row`.
fn get_row(texels: &[u8], size: usize, y: usize, first: usize, row: &mut [u8]) {
    match size {
        1 => get_each::<1>(texels, y, first, row),
        2 => get_each::<2>(texels, y, first, row),
        4 => get_each::<4>(texels, y, first, row),
        8 => get_each::<8>(texels, y, first, row),
        12 => get_each::<12>(texels, y, first, row),
        16 => get_each::<16>(texels, y, first, row),
        size => {
            for (x, texel) in row.chunks_exact_mut(size).enumerate() {
                texel.copy_from_slice(&texels[place(first + x, y) * size..][..size]);
            }
        }
    }
}

fn get_each<const N: usize>(texels: &[u8], y: usize, first: usize, row: &mut [u8]) {
    let (tiles, _) = texels.as_chunks::<N>().0.as_chunks::<AREA>();
    if let ([row], []) = row.as_chunks_mut::<N>().0.as_chunks_mut::<SIDE>() {
        let tile = &tiles[0];
        for x in (0..SIDE).step_by(2) {
            let at = place(x, y % SIDE);
            (row[x], row[x + 1]) = (tile[at], tile[at + 1]);
        }
        return;
    }
    for (x, texel) in row.as_chunks_mut::<N>().0.iter_mut().enumerate() {
        *texel = tiles[0][place(first + x, y)];
    }
}

/// Copies `row` to a row of one sample of a tile, from column `first` on.
fn set_row(texels: &mut [u8], size: usize, y: usize, first: usize, row: &[u8]) {
    match size {
        1 => set_each::<1>(texels, y, first, row),
        2 => set_each::<2>(texels, y, first, row),
        4 => set_each::<4>(texels, y, first, row),
        8 => set_each::<8>(texels, y, first, row),
        12 => set_each::<12>(texels, y, first, row),
        16 => set_each::<16>(texels, y, first, row),
        size => {
            for (x, texel) in row.chunks_exact(size).enumerate() {
                texels[place(first + x, y) * size..][..size].copy_from_slice(texel);
            }
        }
    }
}

fn set_each<const N: usize>(texels: &mut [u8], y: usize, first: usize, row: &[u8]) {
    let (tiles, _) = texels.as_chunks_mut::<N>().0.as_chunks_mut::<AREA>();
    if let ([row], []) = row.as_chunks::<N>().0.as_chunks::<SIDE>() {
        let tile = &mut tiles[0];
        for x in (0..SIDE).step_by(2) {
            let at = place(x, y % SIDE);
            (tile[at], tile[at + 1]) = (row[x], row[x + 1]);
        }
        return;
    }
    for (x, texel) in row.as_chunks::<N>().0.iter().enumerate() {
        tiles[0][place(first + x, y)] = *texel;
    }
}

/// The addresses of the four quads of 16 lanes in a tile buffer, in texels from its beginning.
#[derive(Clone, Copy, Debug)]
pub struct QuadAddresses {
    /// The first texel of each quad, a multiple of 4.
    pub first: [usize; 4],
    /// True if the quads are consecutive.
    pub consecutive: bool,
    /// True if it is known that no two quads have the same address.
    pub distinct: bool,
}

impl QuadAddresses {
    /// The addresses of a block whose first texel is `first`.
    #[inline(always)]
    pub fn block(first: usize) -> Self {
        Self { first: [first, first + 4, first + 8, first + 12], consecutive: true, distinct: true }
    }

    /// The texel of a lane.
    #[inline(always)]
    pub fn texel(&self, lane: usize) -> usize {
        self.first[lane / 4] + lane % 4
    }

    /// The tiles of the quads, in a tile buffer of `samples` samples per pixel.
    #[inline(always)]
    pub fn tiles(&self, samples: usize) -> [usize; 4] {
        // This is a power of two.
        let shift = (samples * AREA).trailing_zeros();
        let [a, b, c, d] = self.first;
        [a >> shift, b >> shift, c >> shift, d >> shift]
    }

    /// The texels of 16 lanes, in a tile buffer whose texels are words.
    #[inline(always)]
    pub fn load(&self, words: &[u32]) -> [u32; 16] {
        let mut out = [0; 16];
        if self.consecutive {
            out.copy_from_slice(&words[self.first[0]..][..16]);
        } else {
            for (quad, out) in self.first.iter().zip(out.chunks_exact_mut(4)) {
                out.copy_from_slice(&words[*quad..][..4]);
            }
        }
        out
    }

    /// Stores the texels of all lanes of those quads that have some of `lanes`.
    #[inline(always)]
    pub fn store_whole(&self, words: &mut [u32], lanes: u16, values: &[u32; 16]) {
        let words = words.as_chunks_mut::<4>().0;
        for (quad, (first, values)) in self.first.iter().zip(values.as_chunks::<4>().0).enumerate() {
            if lanes >> (4 * quad) & 15 != 0 {
                words[first / 4] = *values;
            }
        }
    }

    /// Stores the texels of some lanes.
    #[inline(always)]
    pub fn store(&self, words: &mut [u32], lanes: u16, values: &[u32; 16]) {
        if self.consecutive && lanes == u16::MAX {
            words[self.first[0]..][..16].copy_from_slice(values);
            return;
        }
        for (quad, first) in self.first.iter().enumerate() {
            let values = &values[4 * quad..][..4];
            match lanes >> (4 * quad) & 15 {
                0 => {}
                15 => words[*first..][..4].copy_from_slice(values),
                some => {
                    // Another quad of the vector may have the same address and other lanes.
                    let texels = &mut words[*first..][..4];
                    let mask = &QUAD_MASKS[usize::from(some)];
                    for lane in 0..4 {
                        texels[lane] = values[lane] & mask[lane] | texels[lane] & !mask[lane];
                    }
                }
            }
        }
    }
}

/// A mask of words for each set of lanes of a quad: all ones in those lanes.
const QUAD_MASKS: [[u32; 4]; 16] = {
    let mut masks = [[0; 4]; 16];
    let mut set = 0;
    while set < 16 {
        let mut lane = 0;
        while lane < 4 {
            if set >> lane & 1 == 1 {
                masks[set][lane] = u32::MAX;
            }
            lane += 1;
        }
        set += 1;
    }
    masks
};

/// The reasons why a view cannot be rendered to as an attachment.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AttachmentError {
    /// The view's format lacks the aspect, or its texels differ in size from the image's texels.
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
    /// The number of samples is neither 1 nor [`MAX_SAMPLES`].
    #[error("attachments of {0} samples cannot be rendered to")]
    Samples(u32),
    /// The host cannot back this many bytes of samples that last as long as the pass.
    #[error("the host cannot back {0} bytes of an attachment's samples")]
    Memory(u64),
    /// The image is wider or higher than [`MAX_FRAMEBUFFER_SIZE`].
    #[error("an attachment of {0}x{1} pixels is too large")]
    Extent(u32, u32),
}

/// One aspect of an attachment: the image with its texels, and the load and store operations.
#[derive(Clone, Debug)]
pub struct Target {
    image: Arc<Image>,
    format: Format,
    /// The subresource and the z coordinate of each layer.
    layers: Vec<(SubresourceLayout, u32)>,
    /// The bytes of the texel to which the attachment is still to be cleared.
    pub clear: Option<[u8; MAX_TEXEL_SIZE]>,
    /// The target of one sample per texel whose texels all samples are still to begin as.
    pub initial: Option<Box<Target>>,
    /// The operation at the end of the pass.
    pub store: StoreOp,
}

impl Target {
    /// The target of the first `layer_count` layers of `view`, or of as many as the image has.
    pub fn new(view: &ImageView, aspect: Aspect, layer_count: u32, store: StoreOp) -> Result<Self, AttachmentError> {
        let (image, level) = (&view.image, view.base_mip_level);
        let format = view.format.plane(aspect).ok_or(AttachmentError::Format(view.format))?;
        if ![1, MAX_SAMPLES].contains(&image.desc.samples) {
            return Err(AttachmentError::Samples(image.desc.samples));
        }
        let layer = |index: u32| {
            let layer = view.base_layer.checked_add(index)?;
            match image.desc.kind {
                ImageKind::D1 | ImageKind::D2 => Some((image.subresource(aspect, level, layer)?, 0)),
                // The layers of a view of a 3D image are its slices.
                ImageKind::D3 => {
                    let layout = image.subresource(aspect, level, 0)?;
                    (layer < layout.extent[2]).then_some((layout, layer))
                }
            }
        };
        let layers: Vec<_> = (0..layer_count.max(1)).map_while(layer).collect();
        let Some((layout, _)) = layers.first() else {
            return Err(AttachmentError::Subresource { level, layer: view.base_layer });
        };
        if layout.format.texel_size() != format.texel_size() {
            return Err(AttachmentError::Format(view.format));
        }
        let [width, height, _] = layout.extent;
        if width.max(height) > MAX_FRAMEBUFFER_SIZE {
            return Err(AttachmentError::Extent(width, height));
        }
        Ok(Self { image: image.clone(), format, layers, clear: None, initial: None, store })
    }

    /// A target of its format, extent and layers with several samples per texel, in memory of its own that is not stored
    /// when a pass ends.
    pub fn with_samples(&self, samples: u32) -> Result<Self, AttachmentError> {
        let [width, height] = self.extent();
        let desc = ImageDesc {
            kind: ImageKind::D2,
            format: self.format,
            extent: [width, height, 1],
            mip_levels: 1,
            array_layers: self.layer_count(),
            samples,
        };
        let size = desc.memory_size().ok_or(AttachmentError::Samples(samples))?;
        let memory = Allocation::new_zeroed(size).map_err(|_| AttachmentError::Memory(size))?;
        let image = Image::new(desc, memory, 0).map_err(|_| AttachmentError::Samples(samples))?;
        let view = ImageView {
            image: Arc::new(image),
            format: self.format,
            base_mip_level: 0,
            level_count: 1,
            base_layer: 0,
            layer_count: self.layer_count(),
        };
        let aspect = self.format.aspects()[0];
        Self::new(&view, aspect, self.layer_count(), StoreOp::DontCare)
    }

    /// The format of its texels.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The number of layers that are rendered to.
    pub fn layer_count(&self) -> u32 {
        self.layers.len() as u32
    }

    /// The width and height of the attachment in pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.layers.iter().map(|(layout, _)| [layout.extent[0], layout.extent[1]]).next().unwrap_or_default()
    }

    /// Marks the attachment's memory as changed.
    pub fn bump_generation(&self) {
        self.image.memory.bump_generation();
    }

    /// The number of samples per pixel.
    pub fn samples(&self) -> u32 {
        self.image.desc.samples
    }

    /// One sample of all texels of a layer, if the attachment has it.
    pub(super) fn sample(&self, layer: u32, sample: u32) -> Option<SampleRows<'_>> {
        let (layout, z) = self.layers.get(layer as usize)?;
        Some(SampleRows { image: &self.image, layout: layout.sample(sample), z: *z })
    }
}

/// One sample of all texels of an attachment's layer.
pub(super) struct SampleRows<'a> {
    image: &'a Image,
    layout: SubresourceLayout,
    z: u32,
}

impl SampleRows<'_> {
    /// Reads the bytes of texels from pixel (x, y) on. Bytes outside of the image stay unchanged.
    #[inline]
    pub fn read(&self, [x, y]: [u32; 2], bytes: &mut [u8]) {
        // Tiles are clipped to the attachments before they are rendered.
        let _ = self.image.read_row(&self.layout, [x, y, self.z], bytes);
    }

    /// Writes the bytes of texels from pixel (x, y) on. Those outside of the image are not written.
    #[inline]
    pub fn write(&self, [x, y]: [u32; 2], bytes: &[u8]) {
        // Tiles are clipped here, too.
        let _ = self.image.write_row(&self.layout, [x, y, self.z], bytes);
    }
}

#[cfg(test)]
mod tests;
