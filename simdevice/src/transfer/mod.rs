//! Copies, blits, resolves, fills and clears outside of render passes.
//!
//! Regions are expected to be valid. Rows that extend outside a buffer are left out, and regions that extend outside an
//! image are clipped, so that no packet can harm anything but its own result. Every function marks the memory that it
//! writes as changed.

mod blit;
mod image_copy;
mod region;
mod resolve;
#[cfg(test)]
mod tests;

use crate::format::MAX_TEXEL_SIZE;
use crate::image::{Image, SubresourceLayout};
use crate::packet::{BufferImageRegion, ClearImage, CopyBuffer, CopyBufferImage};
use crate::runtime::Runtime;
use crate::transfer::region::clip;
pub use blit::blit_image;
use devmem::BufferRange;
pub use image_copy::copy_image;
use rayon::prelude::*;
pub use resolve::resolve_image;
use std::sync::Arc;

/// The offset in the memory of bytes `offset..offset + size` of a range, if they lie in the range.
fn within(range: &BufferRange, offset: u64, size: u64) -> Option<u64> {
    let end = offset.checked_add(size)?;
    (end <= range.size).then(|| range.offset.checked_add(offset)).flatten()
}

/// Executes [`Packet::CopyBuffer`](crate::Packet::CopyBuffer).
pub fn copy_buffer(copy: &CopyBuffer) {
    for region in &copy.regions {
        let copied = within(&copy.source, region.source_offset, region.size)
            .zip(within(&copy.target, region.target_offset, region.size))
            .map(|(from, to)| {
                let (source, target) = (&copy.source.memory, &copy.target.memory);
                target.copy_from(to, source, from, region.size)
            });
        if !matches!(copied, Some(Ok(()))) {
            log::warn!("left out a buffer copy that lies outside: {region:?}");
        }
    }
    copy.target.memory.bump_generation();
}

/// Executes [`Packet::FillBuffer`](crate::Packet::FillBuffer).
pub fn fill_buffer(target: &BufferRange, word: u32) {
    const CHUNK: u64 = 1024;
    let chunk = [word; CHUNK as usize];
    let available = target.memory.len().saturating_sub(target.offset);
    let words = target.size.min(available) / 4;
    for first in (0..words).step_by(CHUNK as usize) {
        let count = CHUNK.min(words - first) as usize;
        let offset = target.offset + 4 * first;
        if target.memory.write(offset, &chunk[..count]).is_err() {
            return;
        }
    }
    target.memory.bump_generation();
}

/// Executes [`Packet::UpdateBuffer`](crate::Packet::UpdateBuffer).
pub fn update_buffer(target: &BufferRange, data: &[u8]) {
    let written = within(target, 0, data.len() as u64).map(|offset| target.memory.write(offset, data));
    if !matches!(written, Some(Ok(()))) {
        log::warn!("left out a buffer update that lies outside");
    }
    target.memory.bump_generation();
}

/// The direction of a copy between a buffer and an image.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// [`Packet::CopyBufferToImage`](crate::Packet::CopyBufferToImage).
    ToImage,
    /// [`Packet::CopyImageToBuffer`](crate::Packet::CopyImageToBuffer).
    ToBuffer,
}

/// The least number of bytes for which workers share a copy.
const LEAST_SHARED: u64 = 1 << 20;

/// Executes a copy between a buffer and an image.
pub fn copy_buffer_image(copy: &CopyBufferImage, direction: Direction, runtime: &Runtime) {
    for region in &copy.regions {
        let layers = &region.subresource;
        let end = copy.image.desc.array_layers;
        let first = layers.base_layer.min(end);
        for index in 0..layers.layer_count.min(end - first) {
            let layout = copy.image.subresource(layers.aspect, layers.mip_level, first + index);
            if let Some(layout) = layout {
                copy_layer(copy, direction, region, index, &layout, runtime);
            }
        }
    }
    match direction {
        Direction::ToImage => copy.image.memory.bump_generation(),
        Direction::ToBuffer => copy.buffer.memory.bump_generation(),
    }
}

/// Copies layer number `index` of a region.
fn copy_layer(
    copy: &CopyBufferImage,
    direction: Direction,
    region: &BufferImageRegion,
    index: u32,
    layout: &SubresourceLayout,
    runtime: &Runtime,
) {
    let texel_size = layout.format.texel_size() as u64;
    let [width, height, depth] = region.image_extent;
    let or_tight = |length: u32, tight: u32| u64::from(if length == 0 { tight } else { length });
    let row_length = or_tight(region.buffer_row_length, width);
    let image_height = or_tight(region.buffer_image_height, height);
    let [x, y, z] =
        [0, 1, 2].map(|axis| clip(region.image_offset[axis], region.image_extent[axis], layout.extent[axis]));
    let size = u64::from(x.count) * texel_size;
    // The offset of `size` bytes from a row's first copied texel on, in the buffer's memory; `None` if that overflows
    // or lies outside the buffer.
    let buffer_offset = |row: u32, slice: u32, size: u64| {
        let slice = u64::from(index).checked_mul(depth.into())?.checked_add(u64::from(z.skipped) + u64::from(slice))?;
        let row = slice.checked_mul(image_height)?.checked_add(u64::from(y.skipped) + u64::from(row))?;
        let texel = row.checked_mul(row_length)?.checked_add(x.skipped.into())?;
        let offset = region.buffer_offset.checked_add(texel.checked_mul(texel_size)?)?;
        within(&copy.buffer, offset, size)
    };
    let (image, buffer) = (&copy.image, &copy.buffer.memory);
    // Copies `count` rows of a slice, which follow one another without a gap. Returns false if they do not fit the
    // buffer.
    let copy_rows = |row: u32, slice: u32, count: u32| {
        let all = size * u64::from(count);
        let at = [x.first, y.first + row, z.first + slice];
        let copied =
            buffer_offset(row, slice, all).zip(image.row(layout, at, size)).map(
                |(in_buffer, in_image)| match direction {
                    Direction::ToImage => image.memory.copy_from(in_image, buffer, in_buffer, all),
                    Direction::ToBuffer => buffer.copy_from(in_buffer, &image.memory, in_image, all),
                },
            );
        matches!(copied, Some(Ok(())))
    };
    // Rows that overlap in the buffer, or an image that does, keep their order.
    let are_apart = row_length >= width.into() && image_height >= height.into() && !Arc::ptr_eq(&image.memory, buffer);
    let threads = runtime.threads();
    let rows = y.count as usize * z.count as usize;
    let bytes = size.saturating_mul(rows as u64);
    let is_shared = are_apart && threads > 1 && bytes >= LEAST_SHARED;
    let least = if is_shared { rows.div_ceil(4 * threads) } else { rows };
    // Rows that follow one another without a gap, both in the image and in the buffer, are copied at once.
    let is_dense = are_apart && size == layout.row_pitch && u64::from(x.count) == row_length;
    let in_slice = y.count.max(1) as usize;
    let run = if is_dense { least.clamp(1, in_slice) } else { 1 };
    let runs = in_slice.div_ceil(run);
    let copy_run = |number: usize| {
        let (slice, row) = ((number / runs) as u32, number % runs * run);
        let (row, end) = (row as u32, (row + run).min(in_slice) as u32);
        copy_rows(row, slice, end - row) || (row..end).all(|row| copy_rows(row, slice, 1))
    };
    let count = if rows > 0 { runs * z.count as usize } else { 0 };
    let is_whole = if is_shared {
        runtime.install(|| {
            let numbers = (0..count).into_par_iter();
            numbers.with_min_len(least.div_ceil(run)).all(copy_run)
        })
    } else {
        (0..count).all(copy_run)
    };
    if !is_whole {
        log::warn!("left out rows that lie outside the buffer: {region:?}");
    }
}

/// Executes [`Packet::ClearImage`](crate::Packet::ClearImage).
pub fn clear_image(clear: &ClearImage) {
    let (image, desc) = (&clear.image, &clear.image.desc);
    for range in &clear.ranges {
        let texel = desc.format.encode_clear(range.aspect, clear.value);
        let levels = range.base_mip_level..range.base_mip_level.saturating_add(range.level_count).min(desc.mip_levels);
        let layers = range.base_layer..range.base_layer.saturating_add(range.layer_count).min(desc.array_layers);
        for level in levels {
            for layer in layers.clone() {
                if let Some(layout) = image.subresource(range.aspect, level, layer) {
                    clear_subresource(image, &layout, &texel);
                }
            }
        }
    }
    image.memory.bump_generation();
}

fn clear_subresource(image: &Image, layout: &SubresourceLayout, texel: &[u8; MAX_TEXEL_SIZE]) {
    let [width, height, depth] = layout.extent;
    let row = texel[..layout.format.texel_size()].repeat(width as usize);
    for sample in 0..image.desc.samples {
        let layout = layout.sample(sample);
        for z in 0..depth {
            for y in 0..height {
                if image.write_row(&layout, [0, y, z], &row).is_none() {
                    return;
                }
            }
        }
    }
}
