//! Tests of the image unit with small images of known texels.

mod agreement;
mod filtering;
mod oracle;
mod texels;
mod ycbcr;

use std::sync::Arc;

use super::*;
use crate::format::Aspect;
use crate::image::{ImageDesc, ImageKind};
use crate::runtime::SimdLevel;
use crate::state::CompareOp;
use crate::{Allocation, Format, Image, ImageView};
use isa::ir::{Dimension, ImageShape, VECTOR_LANES};
use isa::resources::{ImageUnit, LaneWords, LodRequest, SampleRequest, TexelRequest};

/// A shape that is neither arrayed nor multisampled.
fn shape(dimension: Dimension) -> ImageShape {
    ImageShape { dimension, arrayed: false, multisampled: false }
}

fn desc(kind: ImageKind, format: Format, extent: [u32; 3]) -> ImageDesc {
    ImageDesc { kind, format, extent, mip_levels: 1, array_layers: 1, samples: 1 }
}

/// An image whose texel at `(level, layer, [x, y, z])` has these components.
fn image(desc: ImageDesc, texel: impl Fn(u32, u32, [u32; 3]) -> [f32; 4]) -> SampledImage {
    let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
    let image = Image::new(desc, memory, 0).unwrap();
    let aspect = desc.format.aspects()[0];
    for level in 0..desc.mip_levels {
        for layer in 0..desc.array_layers {
            let layout = image.subresource(aspect, level, layer).unwrap();
            let [width, height, depth] = layout.extent;
            for at in (0..width * height * depth).map(|i| [i % width, i / width % height, i / width / height]) {
                let bytes = layout.format.encode(texel(level, layer, at));
                let size = layout.format.texel_size();
                image.write_row(&layout, at, &bytes[..size]).unwrap();
            }
        }
    }
    SampledImage {
        view: ImageView {
            image: Arc::new(image),
            format: desc.format,
            base_mip_level: 0,
            level_count: desc.mip_levels,
            base_layer: 0,
            layer_count: desc.array_layers,
        },
        aspect,
        swizzle: IDENTITY,
        chroma: None,
    }
}

/// The answers of an image unit as values.
trait Answers: ImageUnit {
    fn sampled(&self, image: u32, sampler: u32, request: &SampleRequest) -> [LaneWords; 4] {
        // What was there before must not matter.
        let mut texel = [[0xDEAD_BEEF; VECTOR_LANES]; 4];
        self.sample(image, sampler, request, &mut texel);
        texel
    }

    fn texels(&self, image: u32, request: &TexelRequest) -> [LaneWords; 4] {
        let mut texel = [[0xDEAD_BEEF; VECTOR_LANES]; 4];
        self.read(image, request, &mut texel);
        texel
    }
}

impl Answers for ImageTable {}

/// A table of one sampled image and one sampler, at the best SIMD level.
fn table(image: SampledImage, sampler: Sampler) -> ImageTable {
    let level = SimdLevel::Best.resolve().unwrap();
    ImageTable::new(level, [ImageBinding::Sampled(image)], [Some(sampler)])
}

/// A sample at level 0 with these coordinates, lane by lane. The last one repeats.
fn request(dimension: Dimension, coordinates: &[[f32; 4]]) -> SampleRequest {
    let at = |lane: usize| coordinates[lane.min(coordinates.len() - 1)];
    SampleRequest {
        mask: u16::MAX,
        shape: shape(dimension),
        coordinate: [0, 1, 2, 3].map(|axis| std::array::from_fn(|lane| at(lane)[axis].to_bits())),
        lod: LodRequest::Explicit([0; 16]),
        offset: [[0; 16]; 3],
        compare: None,
        gather: None,
    }
}

/// The components of one lane of a result, as floats.
fn floats(answer: &[LaneWords; 4], lane: usize) -> [f32; 4] {
    answer.map(|lanes| f32::from_bits(lanes[lane]))
}

/// A sampler with this filter within levels.
fn filtered(filter: Filter) -> Sampler {
    Sampler { mag_filter: filter, min_filter: filter, ..Sampler::default() }
}

/// All address modes.
const MODES: [AddressMode; 5] = [
    AddressMode::Repeat,
    AddressMode::MirroredRepeat,
    AddressMode::ClampToEdge,
    AddressMode::ClampToBorder,
    AddressMode::MirrorClampToEdge,
];
