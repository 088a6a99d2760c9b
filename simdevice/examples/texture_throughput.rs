//! Throughput of the texture unit at every SIMD level of this processor: quads of a slightly turned surface
//! all over a 1024x1024 image. Processor time, so that other programs don't count.
//!
//! `cargo run --release -p simdevice --example texture_throughput`

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use simdevice::format::Aspect;
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

/// Seconds of processor time that this thread has had, where the system tells; other programs' share doesn't count.
fn processor_seconds() -> Option<f64> {
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = times.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

/// Million samples a second, of requests like `first` in tiles of 64x64 pixels all over the surface.
fn measure(table: &ImageTable, first: &SampleRequest, texels_per_pixel: f32) -> f64 {
    let tiles = 16 * 16;
    let offsets: Vec<[f32; 2]> = (0..tiles * 8 * 32)
        .map(|block| {
            let (tile, inside) = (block / 256, block % 256);
            let x = tile % 16 * 64 + inside % 8 * 8;
            let y = tile / 16 * 64 + inside / 8 * 2;
            texture_coordinate([x as f32, y as f32], texels_per_pixel)
        })
        .collect();
    let (begin, processor_begin, mut done) = (Instant::now(), processor_seconds(), 0);
    let mut request = *first;
    while begin.elapsed() < Duration::from_millis(300) {
        for offset in &offsets {
            for (axis, offset) in offset.iter().enumerate() {
                let from = first.coordinate[axis].map(f32::from_bits);
                request.coordinate[axis] = from.map(|at| (at + offset).to_bits());
            }
            black_box(table.sample(0, 0, black_box(&request)));
        }
        done += 16 * offsets.len();
    }
    let seconds = match (processor_begin, processor_seconds()) {
        (Some(begin), Some(end)) if end > begin => end - begin,
        _ => begin.elapsed().as_secs_f64(),
    };
    done as f64 / seconds / 1e6
}

fn main() {
    assert_eq!(Format::R8G8B8A8Unorm.aspects(), [Aspect::Color]);
    let linear = Sampler { mag_filter: Filter::Linear, min_filter: Filter::Linear, ..Sampler::default() };
    let trilinear = Sampler { mipmap_mode: MipmapMode::Linear, ..linear };
    let clamped = Sampler { address_modes: [AddressMode::ClampToEdge; 3], ..linear };
    let shadow =
        Sampler { address_modes: [AddressMode::ClampToBorder; 3], compare_op: Some(CompareOp::LessOrEqual), ..linear };
    let rgba = Format::R8G8B8A8Unorm;
    let cases = [
        ("nearest RGBA8", rgba, Sampler::default(), 0.8),
        ("bilinear RGBA8 repeat", rgba, linear, 0.8),
        ("bilinear RGBA8 clamp", rgba, clamped, 0.8),
        ("bilinear sRGBA8 repeat", Format::R8G8B8A8Srgb, linear, 0.8),
        ("trilinear RGBA8", rgba, trilinear, 1.4),
        ("trilinear sRGBA8", Format::R8G8B8A8Srgb, trilinear, 1.4),
        ("bilinear RGBA16F", Format::R16G16B16A16Sfloat, linear, 0.8),
        ("shadow D32", Format::D32Sfloat, shadow, 0.8),
    ];
    // Only the lines that contain this, if it is given, and only that level.
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let skipped = |place: usize, name: &str| wanted.get(place).is_some_and(|wanted| !name.contains(wanted.as_str()));
    for (name, format, sampler, texels_per_pixel) in cases {
        if skipped(0, name) {
            continue;
        }
        let compare = sampler.compare_op.map(|_| [0.5f32.to_bits(); 16]);
        let first = SampleRequest { compare, ..request(texels_per_pixel) };
        let mut line = format!("{name:24}");
        for (level_name, level) in SimdLevel::supported() {
            let Some(level) = level.resolve().filter(|_| !skipped(1, level_name)) else {
                continue;
            };
            let table = ImageTable::new(level, [image(format)], [Some(sampler)]);
            let rate = measure(&table, &first, texels_per_pixel);
            line += &format!("  {level_name} {rate:6.1}");
            if level_name == "sse2" && wanted.is_empty() {
                let rate = measure(&table.lane_by_lane(), &first, texels_per_pixel);
                line += &format!("  lane by lane {rate:6.1}");
            }
        }
        println!("{line}  M samples/s");
    }
}
