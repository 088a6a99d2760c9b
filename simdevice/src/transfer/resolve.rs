//! Resolves: many samples of a texel become one.

#[cfg(test)]
mod tests;

use super::image_copy::{SlicePair, below, for_each_slice};
use crate::format::{Format, Numeric};
use crate::packet::{ResolveImage, ResolveMode};
use devmem::host;

/// Executes [`Packet::ResolveImage`](crate::Packet::ResolveImage).
pub fn resolve_image(resolve: &ResolveImage) {
    for region in &resolve.regions {
        for_each_slice(&resolve.source, &resolve.target, region, |pair| {
            resolve_slice(resolve, pair);
        });
    }
    resolve.target.memory.bump_generation();
}

fn resolve_slice(resolve: &ResolveImage, pair: &SlicePair) {
    let ((source, from), (target, to)) = (&pair.source, &pair.target);
    let [width, height] = pair.extent.map(|texels| texels as usize);
    let mut bytes: Vec<u8> = host::zeroed(width * source.format.texel_size());
    let mut encoded: Vec<u8> = host::zeroed(width * target.format.texel_size());
    let samples = 0..resolve.source.desc.samples;
    let mut samples: Vec<Vec<[f32; 4]>> = host::collect(samples.map(|_| host::zeroed(width)));
    let mut resolved: Vec<[f32; 4]> = host::zeroed(width);
    for row in 0..height as u32 {
        for (sample, texels) in (0..).zip(&mut samples) {
            let layout = source.sample(sample);
            let read = resolve
                .source
                .read_row(&layout, below(*from, row), &mut bytes);
            if read.is_none() {
                return;
            }
            source.format.decode_row(&bytes, texels);
        }
        let rows = samples.iter().map(Vec::as_slice);
        resolve_row(source.format, resolve.mode, rows, &mut resolved);
        target.format.encode_row(&resolved, &mut encoded);
        let target = target.sample(0);
        if resolve
            .target
            .write_row(&target, below(*to, row), &encoded)
            .is_none()
        {
            return;
        }
    }
}

/// Resolves a row: `samples` are the registers of each sample's texels, of an aspect of this format, and as many as
/// `resolved`. Integers have no mean; their first sample stands for it.
pub fn resolve_row<'a>(
    format: Format,
    mode: ResolveMode,
    samples: impl IntoIterator<Item = &'a [[f32; 4]]>,
    resolved: &mut [[f32; 4]],
) {
    let mut samples = samples.into_iter();
    let Some(first) = samples.next() else {
        return;
    };
    resolved.copy_from_slice(first);
    let mut count = 1.0f32;
    let mut each = |combine: fn(f32, f32) -> f32| {
        for sample in &mut samples {
            count += 1.0;
            for (all, one) in resolved.iter_mut().zip(sample) {
                for (all, one) in all.iter_mut().zip(one) {
                    *all = combine(*all, *one);
                }
            }
        }
    };
    match (mode, format.numeric()) {
        (ResolveMode::SampleZero, _) => {}
        (ResolveMode::Average, Numeric::Uint | Numeric::Sint) => {}
        (ResolveMode::Average, _) => {
            each(|a, b| a + b);
            for component in resolved.as_flattened_mut() {
                *component /= count;
            }
        }
        (ResolveMode::Min, Numeric::Uint) => each(|a, b| unsigned(a, b, u32::min)),
        (ResolveMode::Max, Numeric::Uint) => each(|a, b| unsigned(a, b, u32::max)),
        (ResolveMode::Min, Numeric::Sint) => each(|a, b| signed(a, b, i32::min)),
        (ResolveMode::Max, Numeric::Sint) => each(|a, b| signed(a, b, i32::max)),
        (ResolveMode::Min, _) => each(f32::min),
        (ResolveMode::Max, _) => each(f32::max),
    }
}

fn unsigned(a: f32, b: f32, choose: fn(u32, u32) -> u32) -> f32 {
    f32::from_bits(choose(a.to_bits(), b.to_bits()))
}

fn signed(a: f32, b: f32, choose: fn(i32, i32) -> i32) -> f32 {
    let [a, b] = [a, b].map(|bits| bits.to_bits().cast_signed());
    f32::from_bits(choose(a, b).cast_unsigned())
}
