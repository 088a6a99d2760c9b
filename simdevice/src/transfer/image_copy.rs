//! Copies between images whose texels have the same size.

use crate::image::{Image, ImageKind, SubresourceLayout};
use crate::packet::{CopyImage, ImageCopyRegion, SubresourceLayers};
use crate::transfer::region::clip;

/// Executes [`Packet::CopyImage`](crate::Packet::CopyImage).
pub fn copy_image(copy: &CopyImage) {
    for region in &copy.regions {
        for_each_slice(&copy.source, &copy.target, region, |pair| {
            copy_slice(copy, pair);
        });
    }
    copy.target.memory.bump_generation();
}

/// The part of a slice or layer of a region that both images have.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlicePair {
    pub source: SlicePart,
    pub target: SlicePart,
    /// The number of texels in x and y.
    pub extent: [u32; 2],
}

/// A part of a slice or layer of an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlicePart {
    pub layout: SubresourceLayout,
    /// The first texel in the subresource.
    pub first: [u32; 3],
}

/// A slice or layer of an image.
struct Slice {
    layout: SubresourceLayout,
    z: u32,
}

/// One side of a region.
struct Side<'a> {
    image: &'a Image,
    layers: &'a SubresourceLayers,
    offset: [i32; 3],
}

impl Side<'_> {
    /// Slice number `index`. A 3D image has slices, other images have layers.
    fn slice(&self, index: u32) -> Option<Slice> {
        let z = i64::from(self.offset[2]);
        let (layer, z) = match self.image.desc.kind {
            ImageKind::D3 => (self.layers.base_layer, z + i64::from(index)),
            ImageKind::D1 | ImageKind::D2 => (self.layers.base_layer.checked_add(index)?, z),
        };
        let layout = self.image.subresource(self.layers.aspect, self.layers.mip_level, layer)?;
        let z = u32::try_from(z).ok().filter(|&z| z < layout.extent[2])?;
        Some(Slice { layout, z })
    }

    /// An upper bound of the number of slices or layers.
    fn slices(&self) -> u32 {
        self.image.desc.array_layers.max(self.image.desc.extent[2])
    }
}

/// Calls `f` for every slice or layer of a region that both images have.
pub(super) fn for_each_slice(source: &Image, target: &Image, region: &ImageCopyRegion, mut f: impl FnMut(&SlicePair)) {
    let source = Side { image: source, layers: &region.source, offset: region.source_offset };
    let target = Side { image: target, layers: &region.target, offset: region.target_offset };
    let slices = region.extent[2].max(region.source.layer_count);
    // Offsets before the first slice are outside by at most this number of slices.
    for index in 0..slices.min(source.slices().max(target.slices())) {
        if let (Some(from), Some(to)) = (source.slice(index), target.slice(index)) {
            f(&overlap(region, &from, &to));
        }
    }
}

/// The region in x and y, clipped to the source, and the rest of it clipped to the target.
fn overlap(region: &ImageCopyRegion, source: &Slice, target: &Slice) -> SlicePair {
    let [(from_x, to_x, width), (from_y, to_y, height)] = [0, 1].map(|axis| {
        let from = clip(region.source_offset[axis], region.extent[axis], source.layout.extent[axis]);
        let offset = i64::from(region.target_offset[axis]) + i64::from(from.skipped);
        let to = clip(i32::try_from(offset).unwrap_or(i32::MAX), from.count, target.layout.extent[axis]);
        (from.first.saturating_add(to.skipped), to.first, to.count)
    });
    SlicePair {
        source: SlicePart { layout: source.layout, first: [from_x, from_y, source.z] },
        target: SlicePart { layout: target.layout, first: [to_x, to_y, target.z] },
        extent: [width, height],
    }
}

/// The position `row` rows below `at`.
pub(super) fn below([x, y, z]: [u32; 3], row: u32) -> [u32; 3] {
    [x, y + row, z]
}

fn copy_slice(copy: &CopyImage, pair: &SlicePair) {
    let (source, target) = (&pair.source.layout, &pair.target.layout);
    if source.format.texel_size() != target.format.texel_size() {
        log::warn!("left out an image copy between texels of different sizes");
        return;
    }
    let [width, height] = pair.extent;
    let size = u64::from(width) * source.format.texel_size() as u64;
    for sample in 0..copy.source.desc.samples.min(copy.target.desc.samples) {
        let (source, target) = (source.sample(sample), target.sample(sample));
        // Rows that follow one another without a gap in both images are copied at once.
        let is_dense = size == source.row_pitch && size == target.row_pitch;
        let rows = if is_dense { height.max(1) } else { 1 };
        for row in (0..height).step_by(rows as usize) {
            let from = copy.source.row(&source, below(pair.source.first, row), size);
            let to = copy.target.row(&target, below(pair.target.first, row), size);
            let copied = from.zip(to).map(|(from, to)| {
                let memory = &copy.target.memory;
                memory.copy_from(to, &copy.source.memory, from, size * u64::from(rows))
            });
            if !matches!(copied, Some(Ok(()))) {
                return;
            }
        }
    }
}
