//! Blits: copies that scale, mirror, filter and convert.
//!
//! Vulkan 1.3, "Image Copies With Scaling". The position of a texel's centre in the source is computed exactly, in
//! integers, separately along each axis. Outside the source, the texels at its edge are read.

#[cfg(test)]
mod tests;

use crate::format::{Aspect, Format};
use crate::image::{Image, SubresourceLayout};
use crate::packet::{BlitImage, ImageBlitRegion};
use crate::texture::Filter;
use devmem::host;
use std::ops::Range;

/// Executes [`Packet::BlitImage`](crate::Packet::BlitImage).
pub fn blit_image(blit: &BlitImage) {
    if let Some(source) = blit.source.decompressed() {
        return blit_image(&BlitImage { source, ..blit.clone() });
    }
    for region in &blit.regions {
        let (source, target) = (&region.source, &region.target);
        let layers = |image: &Image, base: u32| image.desc.array_layers.saturating_sub(base);
        let count = source.layer_count.min(target.layer_count);
        let count = count.min(layers(&blit.source, source.base_layer)).min(layers(&blit.target, target.base_layer));
        for layer in 0..count {
            let from = blit.source.subresource(source.aspect, source.mip_level, source.base_layer + layer);
            let to = blit.target.subresource(target.aspect, target.mip_level, target.base_layer + layer);
            if let (Some(from), Some(to)) = (from, to) {
                blit_layer(blit, region, from, to);
            }
        }
    }
    blit.target.memory.bump_generation();
}

/// The texels that one texel of the target reads along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tap {
    /// The indices in the source. Nearest filtering reads only the first.
    index: [u32; 2],
    /// The weight of the second texel.
    weight: f32,
}

impl Tap {
    /// The weighted mean of two texels of a row that begins with a column.
    #[inline(always)]
    fn sample(&self, row: &[[f32; 4]], first_column: u32) -> [f32; 4] {
        let [a, b] = self.index.map(|index| row[(index - first_column) as usize]);
        if self.weight > 0.0 { mix(a, b, self.weight) } else { a }
    }
}

/// The texels of the target along an axis, and the taps of each.
#[derive(Debug)]
struct Axis {
    target: Range<u32>,
    taps: Vec<Tap>,
}

impl Axis {
    /// Maps the corners `to` of the target to the corners `from` of the source. The sizes are those of the images.
    fn new(filter: Filter, from: [i32; 2], source_size: u32, to: [i32; 2], target_size: u32) -> Self {
        let clamped = |corner: i32| corner.max(0).cast_unsigned().min(target_size);
        let target = clamped(to[0].min(to[1]))..clamped(to[0].max(to[1]));
        let [from, to] = [from, to].map(|corners| corners.map(i128::from));
        let (source_length, target_length) = (from[1] - from[0], to[1] - to[0]);
        let tap = |i: u32| {
            // The centre's position in the source is `numerator / denominator` texels from its beginning.
            let mut denominator = 2 * target_length;
            let mut numerator = (2 * (i128::from(i) - to[0]) + 1) * source_length + from[0] * denominator;
            if filter == Filter::Linear {
                // The centres of texels are half a texel from their edges.
                numerator -= target_length;
            }
            if denominator < 0 {
                (numerator, denominator) = (-numerator, -denominator);
            }
            let whole = numerator.div_euclid(denominator);
            let rest = numerator.rem_euclid(denominator);
            let index =
                [whole, whole + 1].map(|index| index.clamp(0, i128::from(source_size.saturating_sub(1))) as u32);
            let weight = match filter {
                Filter::Nearest => 0.0,
                Filter::Linear => (rest as f64 / denominator as f64) as f32,
            };
            Tap { index, weight }
        };
        // An empty box has no texels, so that there is no division by zero.
        let taps = host::collect(target.clone().map(tap));
        Self { target, taps }
    }

    /// The range of texels of the source that are read.
    fn source(&self) -> Range<u32> {
        let indices = || self.taps.iter().flat_map(|tap| tap.index);
        let first = indices().min().unwrap_or(0);
        first..indices().max().map_or(first, |last| last + 1)
    }

    fn is_empty(&self) -> bool {
        self.taps.is_empty()
    }
}

fn blit_layer(blit: &BlitImage, region: &ImageBlitRegion, from: SubresourceLayout, to: SubresourceLayout) {
    let is_color = region.source.aspect == Aspect::Color;
    let filter = if is_color && !from.format.is_integer() { blit.filter } else { Filter::Nearest };
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let corners = |corners: &[[i32; 3]; 2]| corners.map(|corner| corner[axis]);
        Axis::new(
            filter,
            corners(&region.source_corners),
            from.extent[axis],
            corners(&region.target_corners),
            to.extent[axis],
        )
    });
    if x.is_empty() || y.is_empty() || z.is_empty() {
        return;
    }
    let mut rows = Rows::new(&blit.source, from, &x);
    let same = from.format == to.format && filter == Filter::Nearest;
    let mut bytes: Vec<u8> = host::zeroed(x.taps.len() * to.format.texel_size());
    let mut texels: Vec<[f32; 4]> = host::zeroed(x.taps.len());
    for (target_z, tap_z) in z.target.clone().zip(&z.taps) {
        for (target_y, tap_y) in y.target.clone().zip(&y.taps) {
            let row = if same {
                // Unused bits are kept, and so is precision that registers do not have.
                rows.copy(&x, tap_y.index[0], tap_z.index[0], &mut bytes)
            } else {
                let row = rows.filter(&x, tap_y, tap_z, &mut texels);
                to.format.encode_row(&texels, &mut bytes);
                row
            };
            let at = [x.target.start, target_y, target_z];
            let written = row.and_then(|()| blit.target.write_row(&to.sample(0), at, &bytes));
            if written.is_none() {
                return;
            }
        }
    }
}

/// Reads rows of the source, and caches those decoded last.
struct Rows<'a> {
    image: &'a Image,
    layout: SubresourceLayout,
    /// The range of columns that are read.
    columns: Range<u32>,
    bytes: Vec<u8>,
    /// The decoded rows with their y and z, the last used first. There are as many as one row of the target needs.
    decoded: Vec<([u32; 2], Vec<[f32; 4]>)>,
}

/// The number of cached rows: two rows of two slices.
const KEPT_ROWS: usize = 4;

impl<'a> Rows<'a> {
    fn new(image: &'a Image, layout: SubresourceLayout, x: &Axis) -> Self {
        let columns = x.source();
        let bytes = host::zeroed(columns.len() * layout.format.texel_size());
        Self { image, layout: layout.sample(0), columns, bytes, decoded: Vec::new() }
    }

    fn format(&self) -> Format {
        self.layout.format
    }

    fn read(&mut self, y: u32, z: u32) -> Option<()> {
        let at = [self.columns.start, y, z];
        self.image.read_row(&self.layout, at, &mut self.bytes)
    }

    /// Copies the bytes of a row's nearest texels to `out`.
    fn copy(&mut self, x: &Axis, y: u32, z: u32, out: &mut [u8]) -> Option<()> {
        self.read(y, z)?;
        let size = self.format().texel_size();
        for (tap, out) in x.taps.iter().zip(out.chunks_exact_mut(size)) {
            let column = (tap.index[0] - self.columns.start) as usize;
            out.copy_from_slice(&self.bytes[column * size..][..size]);
        }
        Some(())
    }

    /// Decodes a row, unless it is cached.
    fn decode(&mut self, place: [u32; 2]) -> Option<&[[f32; 4]]> {
        let known = self.decoded.iter().position(|(known, _)| *known == place);
        let (_, row) = match known {
            Some(index) => self.decoded.remove(index),
            None => {
                self.read(place[0], place[1])?;
                let mut row = if self.decoded.len() < KEPT_ROWS {
                    host::zeroed(self.columns.len())
                } else {
                    self.decoded.pop()?.1
                };
                self.format().decode_row(&self.bytes, &mut row);
                (place, row)
            }
        };
        self.decoded.insert(0, (place, row));
        self.decoded.first().map(|(_, row)| row.as_slice())
    }

    /// Computes a row of the target by linear filtering.
    fn filter(&mut self, x: &Axis, y: &Tap, z: &Tap, out: &mut [[f32; 4]]) -> Option<()> {
        // A texel of weight zero is not read, because it might be infinite.
        let taps = |tap: &Tap| {
            let second = (tap.weight > 0.0).then_some((tap.index[1], tap.weight));
            [Some((tap.index[0], 1.0 - tap.weight)), second]
        };
        out.fill([0.0; 4]);
        let mut is_first = true;
        let first_column = self.columns.start;
        for (z, z_weight) in taps(z).into_iter().flatten() {
            for (y, y_weight) in taps(y).into_iter().flatten() {
                let weight = z_weight * y_weight;
                let row = self.decode([y, z])?;
                if is_first && weight == 1.0 {
                    // Integers must stay unchanged.
                    for (tap, out) in x.taps.iter().zip(&mut *out) {
                        *out = tap.sample(row, first_column);
                    }
                } else {
                    for (tap, out) in x.taps.iter().zip(&mut *out) {
                        let texel = tap.sample(row, first_column);
                        for (out, component) in out.iter_mut().zip(texel) {
                            *out += weight * component;
                        }
                    }
                }
                is_first = false;
            }
        }
        Some(())
    }
}

fn mix(a: [f32; 4], b: [f32; 4], weight: f32) -> [f32; 4] {
    std::array::from_fn(|component| a[component] + weight * (b[component] - a[component]))
}
