//! The image unit: the images and samplers that are bound to a program's slots.

use devmem::dispatch;
use fearless_simd::Level;

use super::sampler::{Reduction, Sampler};
use super::surface::Surface;
use super::view::ImageBinding;
use super::ycbcr::ChromaSurfaces;
use super::{access, anisotropy, lod, scalar, vector};
use isa::ir::{AtomicOp, Dimension, ImageShape};
use isa::resources::{ImageUnit, LaneWords, SampleRequest, TexelRequest};

/// The images and samplers of a draw or a dispatch, by slot.
///
/// The layout and decoding of texels are determined once, when the table is made. The table does not mark memory that
/// it writes as changed: the code that executes the draw must do so (see [`devmem::Allocation::bump_generation`]).
#[derive(Clone, Debug)]
pub struct ImageTable {
    level: Level,
    surfaces: Vec<Option<Surface>>,
    /// The chroma of the surfaces that are the luma of an image, by slot in ascending order.
    chroma: Vec<(usize, ChromaSurfaces)>,
    samplers: Vec<Option<Sampler>>,
    batched: bool,
}

impl ImageTable {
    /// A table of the bindings of slots 0 and up. An image that does not fit into its memory counts as unbound.
    pub fn new(
        level: Level,
        images: impl IntoIterator<Item = ImageBinding>,
        samplers: impl IntoIterator<Item = Option<Sampler>>,
    ) -> Self {
        let mut chroma = Vec::new();
        let surface = |(slot, binding)| match binding {
            ImageBinding::Unbound => None,
            ImageBinding::Sampled(image) => {
                if let Some(planes) = &image.chroma {
                    chroma.push((slot, ChromaSurfaces::new(&image, planes)?));
                }
                Surface::sampled(&image)
            }
            ImageBinding::Storage(image) => Surface::storage(&image),
            ImageBinding::TexelBuffer(buffer) => Surface::buffer(&buffer),
        };
        let surfaces = images.into_iter().enumerate().map(surface).collect();
        Self { level, surfaces, chroma, samplers: samplers.into_iter().collect(), batched: true }
    }

    /// The same table, but every lane is filtered, read and written by itself: slower, with the same bits. For tests.
    #[must_use]
    pub fn lane_by_lane(mut self) -> Self {
        self.batched = false;
        self
    }

    fn surface(&self, image: u32) -> Option<&Surface> {
        self.surfaces.get(image as usize)?.as_ref()
    }

    /// Takes an isotropic sample. It has the kernels of all codecs, so there is one copy of it.
    #[inline(never)]
    fn sample_once(&self, surface: &Surface, sampler: &Sampler, request: &SampleRequest, texel: &mut [LaneWords; 4]) {
        let has_seams = sampler.has_seams && request.shape.dimension == Dimension::Cube;
        let is_batched = self.batched
            && !has_seams
            && dispatch!(self.level, simd => {
                vector::bilinear(simd, surface, sampler, request, texel)
                    || vector::general(simd, surface, sampler, request, texel)
            });
        if !is_batched {
            *texel = scalar::sample(surface, sampler, request);
        }
    }

    /// Reads texels. It has the kernels of all codecs, so there is one copy of it.
    #[inline(never)]
    fn read_texels(&self, surface: &Surface, request: &TexelRequest, texel: &mut [LaneWords; 4]) {
        let is_batched = self.batched && dispatch!(self.level, simd => access::read(simd, surface, request, texel));
        if !is_batched {
            *texel = scalar::read(surface, request);
        }
    }

    fn pair(&self, image: u32, sampler: u32) -> Option<(&Surface, &Sampler)> {
        let sampler = self.samplers.get(sampler as usize)?.as_ref()?;
        Some((self.surface(image)?, sampler))
    }
}

impl ImageUnit for ImageTable {
    fn sample(&self, image: u32, sampler: u32, request: &SampleRequest, texel: &mut [LaneWords; 4]) {
        let Some((surface, sampler)) = self.pair(image, sampler) else {
            *texel = Default::default();
            return;
        };
        if let Ok(place) = self.chroma.binary_search_by_key(&(image as usize), |(slot, _)| *slot) {
            let once = |plane: &Surface, sampler: &Sampler, request: &SampleRequest, texel: &mut [LaneWords; 4]| {
                self.sample_once(plane, sampler, request, texel);
            };
            *texel = self.chroma[place].1.sample(surface, sampler, request, once);
            return;
        }
        let once = |request: &SampleRequest, texel: &mut [LaneWords; 4]| {
            self.sample_once(surface, sampler, request, texel);
        };
        if sampler.max_anisotropy > 1.0
            && sampler.reduction == Reduction::WeightedAverage
            && let Some(found) = anisotropy::sample(surface, sampler, request, once)
        {
            *texel = found;
            return;
        }
        once(request, texel);
    }

    fn read(&self, image: u32, request: &TexelRequest, texel: &mut [LaneWords; 4]) {
        match self.surface(image) {
            Some(surface) => self.read_texels(surface, request, texel),
            None => *texel = Default::default(),
        }
    }

    fn write(&self, image: u32, request: &TexelRequest, texel: &[LaneWords; 4]) {
        if let Some(surface) = self.surface(image) {
            let written = self.batched && dispatch!(self.level, simd => access::write(simd, surface, request, texel));
            if !written {
                scalar::write(surface, request, texel);
            }
        }
    }

    fn atomic(
        &self,
        image: u32,
        request: &TexelRequest,
        op: AtomicOp,
        value: &LaneWords,
        comparator: &LaneWords,
    ) -> LaneWords {
        self.surface(image)
            .map_or_else(Default::default, |surface| scalar::atomic(surface, request, op, value, comparator))
    }

    fn size(&self, image: u32, shape: ImageShape, level: u32) -> [u32; 4] {
        let mut size = [0; 4];
        let Some(surface) = self.surface(image) else {
            return size;
        };
        let Some(level) = surface.levels.get(level as usize) else {
            return size;
        };
        let (axes, layers) = match shape.dimension {
            Dimension::Cube => (2, surface.layers / 6),
            dimension => (dimension.coordinates(), surface.layers),
        };
        size[..axes].copy_from_slice(&level.extent[..axes]);
        if shape.arrayed {
            size[axes] = layers;
        }
        size
    }

    fn levels(&self, image: u32) -> u32 {
        self.surface(image).map_or(0, |surface| surface.levels.len() as u32)
    }

    fn samples(&self, image: u32) -> u32 {
        self.surface(image).map_or(0, |surface| surface.samples)
    }

    fn lod(&self, image: u32, sampler: u32, request: &SampleRequest) -> [LaneWords; 2] {
        self.pair(image, sampler)
            .map_or_else(Default::default, |(surface, sampler)| lod::query(surface, sampler, request))
    }
}
