//! Samples of images with chroma: each plane is sampled as an image, and the components found are converted to a colour.
//!
//! Vulkan 1.3, "Chroma Reconstruction": of the two ways there, the implicit one. The luma has the sampler's filter. Chroma
//! with fewer texels has the conversion's, at coordinates that the place of its texels moves.

use super::conversion::ChromaLocation;
use super::sampler::Sampler;
use super::surface::Surface;
use super::view::{Chroma, PlaneComponent, SampledImage, Swizzle};
use crate::format::Aspect;
use isa::ir::VECTOR_LANES;
use isa::resources::{LaneWords, SampleRequest};
use std::sync::Arc;

/// The chroma of a bound image, prepared for access.
#[derive(Clone, Debug)]
pub(super) struct ChromaSurfaces {
    /// The planes from number 1 on.
    planes: Vec<Surface>,
    chroma: Arc<Chroma>,
    /// The swizzle before the conversion.
    swizzle: Swizzle,
}

impl ChromaSurfaces {
    /// The chroma of an image that has some; `None` if a view has no texels.
    pub fn new(image: &SampledImage, chroma: &Arc<Chroma>) -> Option<Self> {
        let planes = chroma.planes.iter().map(|view| Surface::image(view, Aspect::Color)).collect::<Option<_>>()?;
        Some(Self { planes, chroma: Arc::clone(chroma), swizzle: image.swizzle })
    }

    /// Samples the image of which `luma` is the first plane. `once` samples a plane.
    pub fn sample(
        &self,
        luma: &Surface,
        sampler: &Sampler,
        request: &SampleRequest,
        once: impl Fn(&Surface, &Sampler, &SampleRequest, &mut [LaneWords; 4]),
    ) -> [LaneWords; 4] {
        let mut found = [[[0; VECTOR_LANES]; 4]; MAX_PLANES];
        let planes = [luma].into_iter().chain(&self.planes);
        for (plane, found) in planes.zip(&mut found) {
            match self.moved(luma, plane, request) {
                None => once(plane, sampler, request, found),
                Some(request) => {
                    let filter = self.chroma.conversion.chroma_filter;
                    let sampler = Sampler { mag_filter: filter, min_filter: filter, ..*sampler };
                    once(plane, &sampler, &request, found);
                }
            }
        }
        let (zero, one) = ([0; VECTOR_LANES], [1f32.to_bits(); VECTOR_LANES]);
        let [red, green, blue] = self.chroma.components.map(|PlaneComponent { plane, component }| {
            let texel = found.get(plane).and_then(|texel| texel.get(component));
            texel.copied().unwrap_or(zero)
        });
        let stored = [red, green, blue, one];
        let mut texel = self.swizzle.map(|from| from.pick(&stored, zero, one));
        self.chroma.conversion.convert(&mut texel);
        texel
    }

    /// The request of a plane with fewer texels than the luma; `None` if it has as many.
    fn moved(&self, luma: &Surface, plane: &Surface, request: &SampleRequest) -> Option<SampleRequest> {
        let (of_luma, of_plane) = (luma.levels.first()?.extent, plane.levels.first()?.extent);
        if of_luma == of_plane {
            return None;
        }
        let mut moved = *request;
        for (axis, location) in self.chroma.conversion.chroma_locations.into_iter().enumerate() {
            if of_plane[axis] < of_luma[axis] && location == ChromaLocation::CositedEven {
                // A texel of chroma lies half a texel of luma before the middle of the two that it is for.
                let half = 0.5 / of_luma[axis] as f32;
                for coordinate in &mut moved.coordinate[axis] {
                    *coordinate = (f32::from_bits(*coordinate) + half).to_bits();
                }
            }
        }
        Some(moved)
    }
}

/// The most planes of an image.
const MAX_PLANES: usize = 3;
