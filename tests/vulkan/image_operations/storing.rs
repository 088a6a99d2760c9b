//! Storage images and texel buffers, compared with lavapipe's, format by format.

use ash::vk;
use gaurast_runner::{Case, Need};
use gaurast_testkit::exact_lavapipe::{exactly, expect_lacking, formats};
use gaurast_testkit::shader::words;
use gaurast_testkit::texels::{Noise, distance};
use gaurast_testkit::{Bindings, Buffer, Gpu, Image, ImageOptions, Kernel, Resource, device_format};
use simdevice::Format;
use simdevice::format::Numeric;
use vk::FormatFeatureFlags as Feature;

/// The type of a format's components in shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Float,
    Uint,
    Sint,
}

impl Class {
    fn of(format: Format) -> Self {
        match format.numeric() {
            Numeric::Uint => Self::Uint,
            Numeric::Sint => Self::Sint,
            _ => Self::Float,
        }
    }

    fn spirv(self) -> &'static [u8] {
        match self {
            Self::Float => include_bytes!("storing.float.spv"),
            Self::Uint => include_bytes!("storing.uint.spv"),
            Self::Sint => include_bytes!("storing.int.spv"),
        }
    }

    /// A format of this class that every device supports. It replaces unsupported formats.
    fn always(self) -> vk::Format {
        match self {
            Self::Float => vk::Format::R32G32B32A32_SFLOAT,
            Self::Uint => vk::Format::R32G32B32A32_UINT,
            Self::Sint => vk::Format::R32G32B32A32_SINT,
        }
    }
}

const VALUES: usize = 64;

/// Values that a format can hold, and for formats that clamp also some that it cannot.
fn values(format: Format, noise: &mut Noise) -> Vec<[u32; 4]> {
    let narrowest = format.components().iter().map(|c| c.bits).min().unwrap();
    let value = |noise: &mut Noise| match Class::of(format) {
        Class::Float => noise.float().to_bits(),
        Class::Uint => noise.bits() >> (32 - narrowest),
        Class::Sint => (noise.bits().cast_signed() >> (32 - narrowest)).cast_unsigned(),
    };
    (0..VALUES).map(|_| [(); 4].map(|()| value(noise))).collect()
}

/// The bytes that were stored to the image and the texel buffer, and the values that were fetched.
struct Outcome {
    image: Vec<u8>,
    texels: Vec<u8>,
    fetched: Vec<f32>,
}

/// Formats of the storage image, the storage texel buffer and the uniform texel buffer.
type Formats = [vk::Format; 3];

fn outcome(gpu: &Gpu, class: Class, formats: Formats, values: &[[u32; 4]]) -> Outcome {
    let device = gpu.device();
    let [of_image, of_stored, of_fetched] = formats;
    let stored_to = vk::ImageUsageFlags::STORAGE;
    let image = Image::new(gpu, &ImageOptions::new(of_image, [16, 4], stored_to));
    let texel_buffer = |format: vk::Format| -> (Buffer, vk::BufferView) {
        let texel_size = device_format(format).texel_size();
        let buffer = Buffer::new(gpu, (VALUES * texel_size) as u64);
        let info = vk::BufferViewCreateInfo::default().buffer(buffer.raw).format(format).range(vk::WHOLE_SIZE);
        // SAFETY: see the crate.
        let view = unsafe { device.create_buffer_view(&info, None).unwrap() };
        (buffer, view)
    };
    let (stored, fetched) = (texel_buffer(of_stored), texel_buffer(of_fetched));
    let bytes = Noise::new(5).texels(device_format(of_fetched), VALUES);
    fetched.0.write(&bytes);
    let given = Buffer::of(gpu, values);
    let results = Buffer::new(gpu, 16 * VALUES as u64);
    let bindings = Bindings::new(
        gpu,
        &[
            Resource::StorageImage(image.view),
            Resource::StoredTexels(stored.1),
            Resource::Texels(fetched.1),
            Resource::Storage(given.raw),
            Resource::Storage(results.raw),
        ],
    );
    let kernel = Kernel::over(gpu, &words(class.spirv()), &[bindings.layout]);
    kernel.run(&[bindings.set], &[0; 2], [VALUES as u32 / 64, 1, 1]);
    let found = results.values::<f32>().into_iter();
    let fetched_values = match class {
        Class::Float => found.collect(),
        // Integers up to 2^24 are exact as floats, and a larger wrong one still differs.
        Class::Uint | Class::Sint => found.map(|word| word.to_bits() as f32).collect(),
    };
    let outcome = Outcome {
        image: image.download(vk::ImageAspectFlags::COLOR),
        texels: stored.0.read(),
        fetched: fetched_values,
    };
    // SAFETY: see the crate.
    unsafe {
        device.destroy_buffer_view(stored.1, None);
        device.destroy_buffer_view(fetched.1, None);
    }
    outcome
}

/// The formats of storage images and storage texel buffers that lavapipe is known to lack (Mesa 22.3).
const NOT_STORED: &[vk::Format] = &[
    vk::Format::R4G4_UNORM_PACK8,
    vk::Format::R4G4B4A4_UNORM_PACK16,
    vk::Format::B4G4R4A4_UNORM_PACK16,
    vk::Format::R5G6B5_UNORM_PACK16,
    vk::Format::B5G6R5_UNORM_PACK16,
    vk::Format::R5G5B5A1_UNORM_PACK16,
    vk::Format::B5G5R5A1_UNORM_PACK16,
    vk::Format::A1R5G5B5_UNORM_PACK16,
    vk::Format::B8G8R8A8_SNORM,
    vk::Format::B8G8R8A8_UINT,
    vk::Format::B8G8R8A8_SINT,
    vk::Format::A2R10G10B10_UNORM_PACK32,
    vk::Format::A2R10G10B10_SNORM_PACK32,
    vk::Format::A2R10G10B10_UINT_PACK32,
    vk::Format::A2R10G10B10_SINT_PACK32,
    vk::Format::A2B10G10R10_SNORM_PACK32,
    vk::Format::A2B10G10R10_SINT_PACK32,
];

/// The formats of uniform texel buffers that lavapipe is known to lack (Mesa 22.3).
const NOT_FETCHED: &[vk::Format] = &[
    vk::Format::R4G4_UNORM_PACK8,
    vk::Format::R4G4B4A4_UNORM_PACK16,
    vk::Format::R8_SRGB,
    vk::Format::R8G8_SRGB,
    vk::Format::A2R10G10B10_SINT_PACK32,
    vk::Format::A2B10G10R10_SINT_PACK32,
];

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn every_format_is_stored_and_fetched(case: &Case) {
    exactly(case, |ours, theirs| {
        let mut findings = Vec::new();
        let last = vk::Format::E5B9G9R9_UFLOAT_PACK32;
        let images =
            formats(ours, theirs, last, |gpu, format| gpu.format_features(format).contains(Feature::STORAGE_IMAGE));
        let buffers = |feature| {
            formats(ours, theirs, last, |gpu, format| gpu.format_properties(format).buffer_features.contains(feature))
        };
        let stored = buffers(Feature::STORAGE_TEXEL_BUFFER);
        let fetched = buffers(Feature::UNIFORM_TEXEL_BUFFER);
        for format in (1..=last.as_raw()).map(vk::Format::from_raw) {
            let can = [&images, &stored, &fetched].map(|found| found.of_both.contains(&format));
            if can == [false; 3] {
                continue;
            }
            let plain = device_format(format);
            let class = Class::of(plain);
            let chosen = can.map(|can| if can { format } else { class.always() });
            let values = values(plain, &mut Noise::new(7));
            let [a, b] = [ours, theirs].map(|gpu| outcome(gpu, class, chosen, &values));
            let unit = match plain {
                Format::B10G11R11UfloatPack32 => 2.0 / 32.0,
                format if format.components()[0].bits == 32 => 1e-7,
                _ => 2.0 / 1024.0,
            };
            let size = plain.texel_size();
            for (what, can, a, b) in
                [("image", can[0], &a.image, &b.image), ("texel buffer", can[1], &a.texels, &b.texels)]
            {
                let texels = a.chunks_exact(size).zip(b.chunks_exact(size));
                let apart = texels.map(|(a, b)| distance(plain, a, b, unit));
                let apart = apart.fold(0.0, f64::max);
                if can && apart > 1.0 {
                    findings.push(format!("{format:?} stored to the {what}: {apart} apart"));
                }
            }
            let values = a.fetched.iter().zip(&b.fetched);
            let apart = values.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            // lavapipe decodes sRGB by a polynomial with an error of 1e-3.
            let limit = if plain.numeric() == Numeric::Srgb { 1.0 / 255.0 } else { 1e-6 };
            if can[2] && apart > limit {
                findings.push(format!("{format:?} fetched: {apart} apart"));
            }
        }
        assert!(findings.is_empty(), "{}", findings.join("\n"));
        // At least as many formats as Vulkan requires.
        let counts = [&images, &stored, &fetched].map(|found| found.of_both.len());
        assert!(counts[0] >= 16 && counts[1] >= 20 && counts[2] >= 36, "{counts:?}");
        expect_lacking("storage images", &images.of_ours_alone, NOT_STORED);
        expect_lacking("storage texel buffers", &stored.of_ours_alone, NOT_STORED);
        expect_lacking("uniform texel buffers", &fetched.of_ours_alone, NOT_FETCHED);
    });
}
