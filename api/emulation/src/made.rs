//! Results of a set's kernels in memory: pixels, and the depths, Gaussians and cameras that resolve shaders read.

use std::sync::Arc;

use crate::scratch::Memory;

/// The part of the framebuffer that a set may reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) origin: [i32; 2],
    pub(crate) size: [u32; 2],
}

/// The sizes of a set's results.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MadeExtent {
    /// Samples that are told apart, of all views.
    pub(crate) samples: u64,
    pub(crate) has_medians: bool,
    /// Tiles of all views.
    pub(crate) tiles: u64,
    /// A resolve shader reads depths or Gaussians.
    pub(crate) has_inputs: bool,
    /// Views of which a resolve shader reads the camera.
    pub(crate) cameras: u64,
    /// Draws that name what was made by attributes.
    pub(crate) draws: u64,
}

/// Offsets into a set's results, which begin with the pixels, 16 bytes each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct MadePlaces {
    /// The median depth of each sample.
    pub(crate) medians: u64,
    /// A flag for each tile that has a contribution.
    pub(crate) shown: u64,
    /// Depths and Gaussians of each sample.
    pub(crate) inputs: u64,
    /// The camera of each view.
    pub(crate) cameras: u64,
    pub(crate) attributes: u64,
    pub(crate) end: u64,
}

impl MadePlaces {
    pub(crate) fn of(extent: &MadeExtent) -> Self {
        let mut end = 0_u64;
        let mut take = |size: u64| {
            let at = end;
            end += size.next_multiple_of(16);
            at
        };
        take(16 * extent.samples);
        let mut places = Self {
            medians: take(if extent.has_medians { 4 * extent.samples } else { 0 }),
            shown: take(4 * extent.tiles),
            inputs: take(if extent.has_inputs { 32 * extent.samples } else { 0 }),
            cameras: take(96 * extent.cameras),
            attributes: take(ATTRIBUTES * extent.draws),
            end: 0,
        };
        places.end = end;
        places
    }
}

/// The triangles by which draws with a resolve shader cover what a set has made, as `shaders/tiles.vert` has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Covering {
    /// Two for each tile.
    Quads = 0,
    /// Two for each pixel, so that the device counts no other pixels.
    Pixels = 1,
    /// One for each tile, twice as large, so that neither a quad of pixels is parted, whose derivatives are whole on devices whose helper
    /// invocations load nothing, nor a pixel of several samples, which has one invocation.
    Triangle = 2,
}

/// Bytes of the attributes of a draw.
pub(crate) const ATTRIBUTES: u64 = size_of::<Attributes>() as u64;

/// The attributes by which a draw with a resolve shader names what was made, as `shaders/tiles.vert` has them.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Attributes {
    image: u64,
    shown: u64,
    inputs: u64,
    cameras: u64,
    origin: [i32; 2],
    size: [u32; 2],
    samples: u32,
    /// The sample that the draw shows.
    sample: u32,
    covering: u32,
    /// Width and height << 16.
    viewport: u32,
}

impl Attributes {
    /// The attributes of a draw that shows the first sample of those that are told apart at each pixel.
    pub(crate) fn new(address: u64, places: &MadePlaces, area: Area, samples: u32) -> Self {
        Self {
            image: address,
            shown: address + places.shown,
            inputs: address + places.inputs,
            cameras: address + places.cameras,
            origin: area.origin,
            size: area.size,
            samples,
            sample: 0,
            covering: Covering::Quads as u32,
            viewport: area.size[0] | area.size[1] << 16,
        }
    }

    #[must_use]
    pub(crate) fn of_sample(self, sample: u32) -> Self {
        Self { sample, ..self }
    }

    #[must_use]
    pub(crate) fn covering(self, covering: Covering, viewport: [u32; 2]) -> Self {
        Self { covering: covering as u32, viewport: viewport[0] | viewport[1] << 16, ..self }
    }
}

/// The results of a set, in its memory.
#[derive(Clone)]
pub(crate) struct Made {
    pub(crate) memory: Arc<Memory>,
    pub(crate) place: u64,
}

impl Made {
    pub(crate) fn address(&self) -> u64 {
        self.memory.address + self.place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_do_not_overlap() {
        let extent = MadeExtent { samples: 7, has_medians: true, tiles: 3, has_inputs: true, cameras: 2, draws: 4 };
        let places = MadePlaces::of(&extent);
        let wanted =
            MadePlaces { medians: 112, shown: 144, inputs: 160, cameras: 384, attributes: 576, end: 576 + 4 * 64 };
        assert_eq!(places, wanted);
        let plain = MadeExtent { has_medians: false, has_inputs: false, cameras: 0, draws: 0, ..extent };
        assert_eq!(MadePlaces::of(&plain).end, 112 + 16);
    }
}
