//! Anisotropic filtering: samples a pixel's elongated footprint several times along its length, each time at the level
//! of detail of its width.
//!
//! Vulkan 1.3, "Texel Anisotropic Filtering". Only two-dimensional images are filtered this way. Others use an
//! isotropic sample, whose level of detail follows from the longer axis.

use super::lod;
use super::sampler::Sampler;
use super::surface::Surface;
use isa::ir::{Dimension, VECTOR_LANES};
use isa::resources::{LaneWords, LodRequest, SampleRequest};

/// The footprints of 16 lanes.
struct Footprints {
    /// The number of samples along each footprint.
    counts: [u32; VECTOR_LANES],
    /// The level of detail of each sample, before the sampler's bias.
    lod: LaneWords,
    /// The vector along each footprint, in normalized coordinates.
    length: [[f32; VECTOR_LANES]; 2],
}

/// Averages samples along the footprint. `once` takes one isotropic sample. `None` if the request does not use
/// anisotropic filtering.
pub(super) fn sample(
    surface: &Surface,
    sampler: &Sampler,
    request: &SampleRequest,
    once: impl Fn(&SampleRequest, &mut [LaneWords; 4]),
) -> Option<[LaneWords; 4]> {
    let applies = sampler.max_anisotropy > 1.0
        && request.shape.dimension == Dimension::D2
        && request.gather.is_none()
        && !sampler.unnormalized_coordinates
        && !surface.is_integer()
        && !matches!(request.lod, LodRequest::Explicit(_));
    if !applies {
        return None;
    }
    let footprints = footprints(surface, sampler, request);
    let most = footprints.counts.iter().copied().max().unwrap_or(1);
    if most <= 1 {
        return None;
    }
    let mut sums = [[0f32; VECTOR_LANES]; 4];
    let mut texel = [[0; VECTOR_LANES]; 4];
    for number in 1..=most {
        let mut part = *request;
        part.lod = LodRequest::Explicit(footprints.lod);
        part.mask = 0;
        for lane in 0..VECTOR_LANES {
            let count = footprints.counts[lane];
            if number > count {
                continue;
            }
            part.mask |= request.mask & 1 << lane;
            let place = number as f32 / (count as f32 + 1.0) - 0.5;
            for axis in 0..2 {
                let at = f32::from_bits(request.coordinate[axis][lane]);
                let moved = at + place * footprints.length[axis][lane];
                part.coordinate[axis][lane] = moved.to_bits();
            }
        }
        if part.mask == 0 {
            continue;
        }
        once(&part, &mut texel);
        for lane in (0..VECTOR_LANES).filter(|lane| part.mask >> lane & 1 != 0) {
            let weight = 1.0 / footprints.counts[lane] as f32;
            for (sum, component) in sums.iter_mut().zip(&texel) {
                sum[lane] += weight * f32::from_bits(component[lane]);
            }
        }
    }
    Some(sums.map(|lanes| lanes.map(f32::to_bits)))
}

/// The footprints of a request, computed from its derivatives.
fn footprints(surface: &Surface, sampler: &Sampler, request: &SampleRequest) -> Footprints {
    let mut footprints =
        Footprints { counts: [1; VECTOR_LANES], lod: [0; VECTOR_LANES], length: [[0.0; VECTOR_LANES]; 2] };
    let extent = surface.levels[0].extent;
    let size = [extent[0] as f32, extent[1] as f32];
    let value = |axis: usize, lane: usize| f32::from_bits(request.coordinate[axis][lane]);
    for lane in 0..VECTOR_LANES {
        let (dx, dy) = match &request.lod {
            LodRequest::Gradient { dx, dy, .. } => {
                let along = |d: &[LaneWords; 3]| [0, 1].map(|axis| f32::from_bits(d[axis][lane]));
                (along(dx), along(dy))
            }
            _ => {
                let first = lane & !3;
                let to = |other: usize| [0, 1].map(|axis| value(axis, first + other) - value(axis, first));
                (to(1), to(2))
            }
        };
        let texels = |change: [f32; 2]| {
            let [u, v] = [change[0] * size[0], change[1] * size[1]];
            (u * u + v * v).sqrt()
        };
        let (along_x, along_y) = (texels(dx), texels(dy));
        let (longest, shortest) = (along_x.max(along_y), along_x.min(along_y));
        // A footprint of width zero has the greatest ratio. A footprint that is not finite has ratio 1.
        let ratio = match longest.is_finite() && longest > 0.0 {
            true => (longest / shortest).min(sampler.max_anisotropy),
            false => 1.0,
        };
        // A ratio slightly above an integer takes no further sample.
        footprints.counts[lane] = (libm::ceilf(ratio - 1e-3) as u32).max(1);
        let width = longest / ratio;
        let (bias, least) = match &request.lod {
            LodRequest::Implicit { bias, minimum } => (bias[lane], minimum[lane]),
            LodRequest::Gradient { minimum, .. } => (0, minimum[lane]),
            _ => (0, f32::NEG_INFINITY.to_bits()),
        };
        let lod = lod::half_log2(width * width) + f32::from_bits(bias);
        // The sampler's bias is added later.
        let least = f32::from_bits(least) - sampler.mip_lod_bias;
        footprints.lod[lane] = lod.max(least).to_bits();
        let length = if along_x >= along_y { dx } else { dy };
        for (lengths, length) in footprints.length.iter_mut().zip(length) {
            lengths[lane] = length;
        }
    }
    footprints
}
