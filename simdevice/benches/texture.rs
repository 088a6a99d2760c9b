//! The texture unit: `cargo bench -p gaurast-simdevice --bench texture [NAME]`, by the SIMD level in `GAURAST_SIMD`.
//!
//! Quads of a slightly turned surface sample all over a 1024x1024 image. An item is a sample; where an image is decoded, it is
//! a texel.

use std::hint::black_box;
use std::sync::Arc;

use divan::Bencher;
use divan::counter::ItemsCount;
use fearless_simd::Level;

use simdevice::image::{ImageDesc, ImageKind};
use simdevice::isa::ir::{Dimension, ImageShape};
use simdevice::isa::resources::{ImageUnit, LodRequest, SampleRequest};
use simdevice::runtime::SimdLevel;
use simdevice::state::CompareOp;
use simdevice::texture::{AddressMode, Filter, IDENTITY, ImageBinding, ImageTable, MipmapMode, SampledImage, Sampler};
use simdevice::{Allocation, Format, Image, ImageView};

const SIZE: u32 = 1024;
const LEVELS: u32 = 11;

fn image(format: Format) -> ImageBinding {
    let desc = ImageDesc {
        kind: ImageKind::D2,
        format,
        extent: [SIZE, SIZE, 1],
        mip_levels: LEVELS,
        array_layers: 1,
        samples: 1,
    };
    let size = desc.memory_size().expect("a valid image");
    let memory = Allocation::new_zeroed(size).expect("enough memory");
    let mut state = 1u32;
    for offset in (0..size).step_by(4) {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let word = if format == Format::D32Sfloat { ((state >> 8) as f32 / 16_777_216.0).to_bits() } else { state };
        memory.store_u32(offset, word);
    }
    let image = Image::new(desc, memory, 0).expect("it fits");
    ImageBinding::Sampled(SampledImage {
        view: ImageView {
            image: Arc::new(image),
            format,
            base_mip_level: 0,
            level_count: LEVELS,
            base_layer: 0,
            layer_count: 1,
        },
        aspect: format.aspects()[0],
        swizzle: IDENTITY,
        chroma: None,
    })
}

/// Texels along x and y of a way of (x, y) pixels on the surface, as fractions of the image.
fn texture_coordinate([x, y]: [f32; 2], texels_per_pixel: f32) -> [f32; 2] {
    let scale = texels_per_pixel / SIZE as f32;
    let (sin, cos) = 0.3f32.sin_cos();
    [(cos * x - sin * y) * scale, (sin * x + cos * y) * scale]
}

/// Sixteen lanes: four quads side by side.
fn request(texels_per_pixel: f32) -> SampleRequest {
    let at = |lane: usize| {
        let x = (2 * (lane / 4) + (lane & 1)) as f32 + 0.5;
        texture_coordinate([x, (lane >> 1 & 1) as f32 + 0.5], texels_per_pixel)
    };
    SampleRequest {
        mask: u16::MAX,
        shape: ImageShape { dimension: Dimension::D2, arrayed: false, multisampled: false },
        coordinate: [
            std::array::from_fn(|lane| at(lane)[0].to_bits()),
            std::array::from_fn(|lane| at(lane)[1].to_bits()),
            [0; 16],
            [0; 16],
        ],
        lod: LodRequest::Automatic,
        offset: [[0; 16]; 3],
        compare: None,
        gather: None,
    }
}

/// The first request of each block of 8x2 pixels, in tiles of 64x64 pixels all over the surface.
fn offsets(texels_per_pixel: f32) -> Vec<[f32; 2]> {
    let tiles = 16 * 16;
    (0..tiles * 8 * 32)
        .map(|block| {
            let (tile, inside) = (block / 256, block % 256);
            let x = tile % 16 * 64 + inside % 8 * 8;
            let y = tile / 16 * 64 + inside / 8 * 2;
            texture_coordinate([x as f32, y as f32], texels_per_pixel)
        })
        .collect()
}

/// A sampler and the image that it samples.
struct Sampling {
    name: &'static str,
    format: Format,
    sampler: Sampler,
    texels_per_pixel: f32,
}

impl std::fmt::Display for Sampling {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

fn samplings() -> [Sampling; 8] {
    let linear = Sampler { mag_filter: Filter::Linear, min_filter: Filter::Linear, ..Sampler::default() };
    let trilinear = Sampler { mipmap_mode: MipmapMode::Linear, ..linear };
    let clamped = Sampler { address_modes: [AddressMode::ClampToEdge; 3], ..linear };
    let shadow =
        Sampler { address_modes: [AddressMode::ClampToBorder; 3], compare_op: Some(CompareOp::LessOrEqual), ..linear };
    let rgba = Format::R8G8B8A8Unorm;
    let of = |name, format, sampler, texels_per_pixel| Sampling { name, format, sampler, texels_per_pixel };
    [
        of("nearest RGBA8", rgba, Sampler::default(), 0.8),
        of("bilinear RGBA8 repeat", rgba, linear, 0.8),
        of("bilinear RGBA8 clamp", rgba, clamped, 0.8),
        of("bilinear sRGBA8 repeat", Format::R8G8B8A8Srgb, linear, 0.8),
        of("trilinear RGBA8", rgba, trilinear, 1.4),
        of("trilinear sRGBA8", Format::R8G8B8A8Srgb, trilinear, 1.4),
        of("bilinear RGBA16F", Format::R16G16B16A16Sfloat, linear, 0.8),
        of("shadow D32", Format::D32Sfloat, shadow, 0.8),
    ]
}

fn main() {
    divan::main();
}

/// The SIMD level in `GAURAST_SIMD`.
fn level() -> Level {
    let name = std::env::var("GAURAST_SIMD").unwrap_or_else(|_| "best".to_owned());
    SimdLevel::from_name(&name).and_then(SimdLevel::resolve).expect("a SIMD level in GAURAST_SIMD")
}

/// A table of one image and one sampler.
fn table(sampling: &Sampling) -> ImageTable {
    ImageTable::new(level(), [image(sampling.format)], [Some(sampling.sampler)])
}

/// Samples at all offsets.
fn measure(bencher: Bencher, sampling: &Sampling, table: &ImageTable) {
    let compare = sampling.sampler.compare_op.map(|_| [0.5f32.to_bits(); 16]);
    let first = SampleRequest { compare, ..request(sampling.texels_per_pixel) };
    let offsets = offsets(sampling.texels_per_pixel);
    bencher.counter(ItemsCount::new(16 * offsets.len())).bench_local(|| {
        let (mut request, mut texel) = (first, [[0; 16]; 4]);
        for offset in &offsets {
            for (axis, offset) in offset.iter().enumerate() {
                let from = first.coordinate[axis].map(f32::from_bits);
                request.coordinate[axis] = from.map(|at| (at + offset).to_bits());
            }
            table.sample(0, 0, black_box(&request), &mut texel);
            black_box(texel);
        }
    });
}

#[divan::bench(args = samplings())]
fn sample(bencher: Bencher, sampling: &Sampling) {
    measure(bencher, sampling, &table(sampling));
}

/// The same, lane by lane.
#[divan::bench(args = samplings())]
fn sample_lane_by_lane(bencher: Bencher, sampling: &Sampling) {
    measure(bencher, sampling, &table(sampling).lane_by_lane());
}

/// A compressed image whose blocks are random. Those of ASTC have endpoints of red, green and blue, and a grid of 4x4
/// weights.
fn blocks(format: Format) -> SampledImage {
    let ImageBinding::Sampled(sampled) = image(format) else { unreachable!("the image is sampled") };
    if format as usize >= Format::Astc4x4UnormBlock as usize {
        let memory = &sampled.view.image.memory;
        for offset in (0..memory.len()).step_by(16) {
            let noise = (offset as u32).wrapping_mul(0x9E37_79B1);
            memory.store_u32(offset, noise & !0x1_FFFF | 8 << 13 | 0x42);
        }
    }
    sampled
}

/// Decodes all levels of a compressed image.
#[divan::bench(args = [
    Format::Bc7UnormBlock,
    Format::Etc2R8G8B8UnormBlock,
    Format::Etc2R8G8B8A8UnormBlock,
    Format::EacR11G11UnormBlock,
    Format::Astc4x4UnormBlock,
    Format::Astc4x4SrgbBlock,
    Format::Astc8x8UnormBlock,
    Format::Astc8x8SrgbBlock,
    Format::Astc12x12UnormBlock,
])]
fn decode(bencher: Bencher, format: &Format) {
    let image = blocks(*format);
    let level = level();
    let texels: u32 = (0..LEVELS).map(|level| (SIZE >> level).pow(2)).sum();
    bencher.counter(ItemsCount::new(texels)).bench_local(|| {
        // What was decoded before is not used again.
        image.view.image.memory.bump_generation();
        let binding = ImageBinding::Sampled(image.clone());
        black_box(ImageTable::new(level, [binding], [Some(Sampler::default())]));
    });
}
