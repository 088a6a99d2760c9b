//! The clipping of regions to images.

/// The part of a region that lies in an image, along one axis.
#[derive(Clone, Copy)]
pub(super) struct Clipped {
    /// The number of texels of the region before the image.
    pub skipped: u32,
    /// The first texel in the image.
    pub first: u32,
    /// The number of texels in the image.
    pub count: u32,
}

/// Clips texels `offset..offset + extent` to an axis of `size` texels.
pub(super) fn clip(offset: i32, extent: u32, size: u32) -> Clipped {
    let offset = i64::from(offset);
    let first = offset.max(0);
    let end = (offset + i64::from(extent)).min(size.into());
    // Both values are in 0..=u32::MAX if the count is positive.
    Clipped { skipped: (first - offset) as u32, first: first as u32, count: (end - first).max(0) as u32 }
}
