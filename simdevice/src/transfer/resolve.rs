//! Resolves: copies that combine the samples of a texel.

#[cfg(test)]
mod tests;

use super::image_copy::{SlicePair, below, for_each_slice};
use crate::image::resolve::resolve_row;
use crate::packet::ResolveImage;
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
    let (source, target) = (&pair.source.layout, &pair.target.layout);
    let [width, height] = pair.extent.map(|texels| texels as usize);
    let mut bytes: Vec<u8> = host::zeroed(width * source.format.texel_size());
    let mut encoded: Vec<u8> = host::zeroed(width * target.format.texel_size());
    let samples = 0..resolve.source.desc.samples;
    let mut samples: Vec<Vec<[f32; 4]>> = host::collect(samples.map(|_| host::zeroed(width)));
    let mut resolved: Vec<[f32; 4]> = host::zeroed(width);
    for row in 0..height as u32 {
        for (sample, texels) in (0..).zip(&mut samples) {
            let layout = source.sample(sample);
            let read = resolve.source.read_row(&layout, below(pair.source.first, row), &mut bytes);
            if read.is_none() {
                return;
            }
            source.format.decode_row(&bytes, texels);
        }
        let rows = samples.iter().map(Vec::as_slice);
        resolve_row(source.format, resolve.mode, rows, &mut resolved);
        target.format.encode_row(&resolved, &mut encoded);
        let target = target.sample(0);
        if resolve.target.write_row(&target, below(pair.target.first, row), &encoded).is_none() {
            return;
        }
    }
}
