//! Storage images of several samples and as cubes, and atomics on floats.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Bindings, Buffer, Gpu, Image, ImageOptions, Kernel, Resource, Sampler, device_format};
use simdevice::Format;
use simdevice::format::Numeric;
use vk::ImageUsageFlags as Usage;

/// Each sample is written, counted in, read as an image and as a texture, and resolved, for each number of samples that images have
/// which are no attachments. What no sample is changes nothing.
#[gaurast_runner::test(needs = [GLSLANG])]
fn samples_are_stored_and_read_one_by_one() {
    let counts = own().limits().storage_image_sample_counts;
    for samples in (1..7).map(|power| 1 << power) {
        assert!(counts.contains(vk::SampleCountFlags::from_raw(samples)), "{samples} samples");
        store_and_read_samples(samples);
    }
}

fn store_and_read_samples(samples: u32) {
    const SIDE: u32 = 8;
    let gpu = own();
    let image = |format, size: u32, layers, view| {
        let usage = Usage::STORAGE | Usage::SAMPLED;
        let options = ImageOptions { layers, samples, view, ..ImageOptions::new(format, [size; 2], usage) };
        Image::new(gpu, &options)
    };
    let flat = image(vk::Format::R8G8B8A8_UNORM, SIDE, 1, vk::ImageViewType::TYPE_2D);
    let array = vk::ImageViewType::TYPE_2D_ARRAY;
    let counts = image(vk::Format::R32_UINT, SIDE / 2, 2, array);
    let results = Buffer::new(gpu, 4 * 3 * u64::from(samples * SIDE * SIDE));
    let nearest = Sampler::new(gpu, &vk::SamplerCreateInfo::default());
    let bindings = Bindings::new(
        gpu,
        &[
            Resource::StorageImage(flat.view),
            Resource::StorageImage(counts.view),
            Resource::Storage(results.raw),
            Resource::Texture(flat.view, nearest.raw),
        ],
    );
    let declarations = format!(
        "const int SAMPLES = {samples};
        layout(local_size_x = 8, local_size_y = 8) in;
        layout(binding = 0, rgba8) uniform image2DMS flat_image;
        layout(binding = 1, r32ui) uniform uimage2DMSArray counts;
        layout(binding = 2) buffer Results {{ uint results[]; }};
        layout(binding = 3) uniform sampler2DMS flat_texture;"
    );
    let store = Kernel::new(
        gpu,
        &format!(
            "{declarations}
            void main() {{
                ivec2 at = ivec2(gl_GlobalInvocationID.xy);
                for (int s = 0; s < SAMPLES; s++) {{
                    for (int layer = 0; layer < 2; layer++)
                        if (at.x < 4 && at.y < 4)
                            imageStore(counts, ivec3(at, layer), s, uvec4(10 * layer));
                    imageStore(flat_image, at, s, vec4(at, 4 * s, 255) / 255.0);
                }}
                imageStore(flat_image, at, SAMPLES, vec4(1.0));
                imageStore(flat_image, at, -1, vec4(1.0));
                memoryBarrierImage();
                barrier();
                for (int s = 0; s < SAMPLES; s++)
                    imageAtomicAdd(counts, ivec3(at / 2, 1), s, 1 + s);
            }}"
        ),
        &bindings,
    );
    let load = Kernel::new(
        gpu,
        &format!(
            "{declarations}
            void main() {{
                ivec2 at = ivec2(gl_GlobalInvocationID.xy);
                for (int s = 0; s < imageSamples(flat_image); s++) {{
                    uint place = (at.y * 8 + at.x) * SAMPLES + s;
                    results[place] = packUnorm4x8(imageLoad(flat_image, at, s));
                    results[128 * SAMPLES + place] = packUnorm4x8(texelFetch(flat_texture, at, s));
                    uint low = imageLoad(counts, ivec3(at / 2, 0), s).x;
                    results[64 * SAMPLES + place] = low + 1000 * imageLoad(counts, ivec3(at / 2, 1), s).x;
                }}
            }}"
        ),
        &bindings,
    );
    store.run(&[bindings.set], &[], [1, 1, 1]);
    load.run(&[bindings.set], &[], [1, 1, 1]);
    let found = results.values::<u32>();
    let all = samples * SIDE * SIDE;
    for place in 0..all {
        let (x, y, sample) = (place / samples % SIDE, place / samples / SIDE, place % samples);
        let texel = u32::from_le_bytes([x as u8, y as u8, 4 * sample as u8, 255]);
        assert_eq!(found[place as usize], texel, "{x}, {y}, sample {sample} of {samples}");
        assert_eq!(found[(2 * all + place) as usize], texel, "{x}, {y}, sample {sample} of {samples} of the texture");
        // Four pixels add to each texel of the second layer.
        let counted = 1000 * (10 + 4 * (1 + sample));
        assert_eq!(found[(all + place) as usize], counted, "{x}, {y}, sample {sample} of {samples}");
    }

    let whole = Image::new(gpu, &ImageOptions::new(vk::Format::R8G8B8A8_UNORM, [SIDE; 2], Usage::SAMPLED));
    gpu.run(|commands| {
        let layers = vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            mip_level: 0,
            base_array_layer: 0,
            layer_count: 1,
        };
        let region = vk::ImageResolve::default().src_subresource(layers).dst_subresource(layers).extent(vk::Extent3D {
            width: SIDE,
            height: SIDE,
            depth: 1,
        });
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: both images are alive, and in that layout.
        unsafe {
            commands.device().cmd_resolve_image(commands.raw, flat.raw, layout, whole.raw, layout, &[region]);
        }
        commands.barrier();
    });
    for (place, texel) in whole.colors::<[u8; 4]>().into_iter().enumerate() {
        let (x, y) = (place as u8 % SIDE as u8, place as u8 / SIDE as u8);
        assert_eq!(texel, [x, y, 2 * (samples as u8 - 1), 255], "the mean of {samples} samples");
    }
}

/// The name of images in GLSL, the prefix of their type and of vectors that are stored, and a value in terms of `at`.
fn class(format: Format) -> (&'static str, &'static str) {
    match format.numeric() {
        Numeric::Uint => ("u", "uvec4(at.x, 15 - at.y, at.z, at.x ^ at.y)"),
        Numeric::Sint => ("i", "ivec4(at.x - 8, 7 - at.y, at.z - 3, at.x - at.y)"),
        Numeric::Snorm => ("", "vec4(at.x - 8, 7 - at.y, at.z - 3, at.x - at.y) / 8.0"),
        _ => ("", "vec4(at.x, 15 - at.y, at.z, at.x ^ at.y) / 15.0"),
    }
}

/// The registers that [`class`]'s value is, of a texel.
fn stored(format: Format, [x, y, z]: [i32; 3]) -> [f32; 4] {
    let signed = [x - 8, 7 - y, z - 3, x - y];
    let unsigned = [x, 15 - y, z, x ^ y];
    match format.numeric() {
        Numeric::Uint => unsigned.map(|value| f32::from_bits(value.cast_unsigned())),
        Numeric::Sint => signed.map(|value| f32::from_bits(value.cast_unsigned())),
        Numeric::Snorm => signed.map(|value| value as f32 / 8.0),
        _ => unsigned.map(|value| value as f32 / 15.0),
    }
}

/// Every format is stored without its name to images of every kind, each texel where it belongs.
#[gaurast_runner::test(needs = [GLSLANG])]
fn every_kind_of_image_is_stored_to_without_a_format() {
    use vk::ImageViewType as View;
    let gpu = own();
    let all = (1..=vk::Format::B10G11R11_UFLOAT_PACK32.as_raw()).map(vk::Format::from_raw);
    let formats: Vec<_> = all
        .filter(|&format| {
            let features = gpu.format_properties(format).optimal_tiling_features;
            features.contains(vk::FormatFeatureFlags::STORAGE_IMAGE)
        })
        .collect();
    assert!(formats.contains(&vk::Format::A2B10G10R10_SINT_PACK32));
    for (view, kind, layers, depth) in [
        (View::TYPE_2D_ARRAY, "2DArray", 6, 1),
        (View::CUBE, "Cube", 6, 1),
        (View::CUBE_ARRAY, "CubeArray", 12, 1),
        (View::TYPE_3D, "3D", 1, 6),
    ] {
        for &format in &formats {
            let options = ImageOptions {
                size: [16, 16, depth],
                layers,
                view,
                ..ImageOptions::new(format, [16, 16], Usage::STORAGE)
            };
            let image = Image::new(gpu, &options);
            let bindings = Bindings::new(gpu, &[Resource::StorageImage(image.view)]);
            let plain = device_format(format);
            let (prefix, value) = class(plain);
            let source = format!(
                "layout(local_size_x = 8, local_size_y = 8) in;
                layout(binding = 0) writeonly uniform {prefix}image{kind} target;
                void main() {{
                    ivec3 at = ivec3(gl_GlobalInvocationID);
                    imageStore(target, at, {value});
                }}"
            );
            let kernel = Kernel::new(gpu, &source, &bindings);
            kernel.run(&[bindings.set], &[], [2, 2, layers * depth]);
            let size = plain.texel_size();
            let bytes = image.read(vk::ImageAspectFlags::COLOR, size as u32);
            for (place, texel) in bytes.chunks_exact(size).enumerate() {
                let place = place as i32;
                let at = [place % 16, place / 16 % 16, place / 256];
                let expected = plain.encode(stored(plain, at));
                assert_eq!(texel, &expected[..size], "{kind}, {format:?}, {at:?}");
            }
        }
    }
}

/// A slice of a 3D image is stored to and sampled as an image of two dimensions.
#[gaurast_runner::test(needs = [GLSLANG])]
fn slices_are_images_of_two_dimensions() {
    let mut features =
        vk::PhysicalDeviceImage2DViewOf3DFeaturesEXT::default().image2_d_view_of3_d(true).sampler2_d_view_of3_d(true);
    let gpu = &Gpu::extended(&[ash::ext::image_2d_view_of_3d::NAME], &mut features).expect("a device");
    let options = ImageOptions {
        size: [8, 4, 5],
        view: vk::ImageViewType::TYPE_3D,
        flags: vk::ImageCreateFlags::TYPE_2D_VIEW_COMPATIBLE_EXT,
        ..ImageOptions::new(vk::Format::R32_SFLOAT, [8, 4], Usage::STORAGE | Usage::SAMPLED)
    };
    let image = Image::new(gpu, &options);
    let before: Vec<f32> = (0..160).map(|texel| texel as f32).collect();
    image.upload(vk::ImageAspectFlags::COLOR, bytemuck::cast_slice(&before));
    let view = |slice| {
        let info = vk::ImageViewCreateInfo::default()
            .image(image.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(vk::Format::R32_SFLOAT)
            .subresource_range(vk::ImageSubresourceRange {
                base_array_layer: slice,
                layer_count: 1,
                ..gaurast_testkit::range(vk::ImageAspectFlags::COLOR)
            });
        // SAFETY: the image is alive.
        unsafe { gpu.device().create_image_view(&info, None) }.expect("a view")
    };
    let (written, sampled) = (view(2), view(3));
    let sampler = Sampler::new(
        gpu,
        &vk::SamplerCreateInfo::default().mag_filter(vk::Filter::LINEAR).min_filter(vk::Filter::LINEAR),
    );
    let results = Buffer::new(gpu, 4 * 32);
    let bindings = Bindings::new(
        gpu,
        &[Resource::StorageImage(written), Resource::Texture(sampled, sampler.raw), Resource::Storage(results.raw)],
    );
    let kernel = Kernel::new(
        gpu,
        "layout(local_size_x = 8, local_size_y = 4) in;
        layout(binding = 0, r32f) uniform image2D written;
        layout(binding = 1) uniform sampler2D sampled;
        layout(binding = 2) buffer Results { float results[]; };
        void main() {
            ivec2 at = ivec2(gl_GlobalInvocationID.xy);
            imageStore(written, at, imageLoad(written, at) + 1000.0 * imageSize(written).y);
            results[at.y * 8 + at.x] = textureLod(sampled, (vec2(at) + 0.5) / vec2(8.0, 4.0), 0.0).x;
        }",
        &bindings,
    );
    kernel.run(&[bindings.set], &[], [1, 1, 1]);
    let after = image.colors::<f32>();
    for (texel, value) in after.into_iter().enumerate() {
        let expected = match texel {
            64..96 => before[texel] + 4000.0,
            _ => before[texel],
        };
        assert_eq!(value, expected, "texel {texel}");
    }
    assert_eq!(results.values::<f32>(), before[96..128]);
    // SAFETY: nothing uses the views any more.
    unsafe {
        gpu.device().destroy_image_view(written, None);
        gpu.device().destroy_image_view(sampled, None);
    }
}

/// A texel buffer may begin at any of its texels.
#[gaurast_runner::test(needs = [GLSLANG])]
fn texel_buffers_begin_at_any_texel() {
    let gpu = own();
    let numbers: Vec<u8> = (0..64).collect();
    let (source, results) = (Buffer::of(gpu, &numbers), Buffer::new(gpu, 4 * 8));
    let info = vk::BufferViewCreateInfo::default()
        .buffer(source.raw)
        .format(vk::Format::R8_UINT)
        .offset(13)
        .range(vk::WHOLE_SIZE);
    // SAFETY: the buffer is alive.
    let view = unsafe { gpu.device().create_buffer_view(&info, None) }.expect("a view");
    let resources = [Resource::Texels(view), Resource::Storage(results.raw)];
    let bindings = Bindings::new(gpu, &resources);
    let kernel = Kernel::new(
        gpu,
        "layout(local_size_x = 8) in;
        layout(binding = 0) uniform usamplerBuffer numbers;
        layout(binding = 1) buffer Results { uint results[]; };
        void main() {
            uint at = gl_GlobalInvocationID.x;
            results[at] = texelFetch(numbers, int(at)).x + 100 * textureSize(numbers);
        }",
        &bindings,
    );
    kernel.run(&[bindings.set], &[], [1, 1, 1]);
    let expected: Vec<u32> = (0..8).map(|at| 13 + at + 100 * (64 - 13)).collect();
    assert_eq!(results.values::<u32>(), expected);
    let half = info.format(vk::Format::R16_UINT);
    // SAFETY: the buffer is alive; nothing uses the view any more.
    unsafe {
        gpu.device().destroy_buffer_view(view, None);
        let refused = gpu.device().create_buffer_view(&half, None);
        assert!(refused.is_err(), "half a texel");
    }
}

/// Sums, minima, maxima and exchanges of floats, in buffers, workgroup memory, images and texel buffers.
#[gaurast_runner::test(needs = [GLSLANG])]
fn floats_are_changed_atomically() {
    let mut minima = vk::PhysicalDeviceShaderAtomicFloat2FeaturesEXT::default()
        .shader_buffer_float32_atomic_min_max(true)
        .shader_shared_float32_atomic_min_max(true)
        .shader_image_float32_atomic_min_max(true);
    let mut sums = vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT::default()
        .shader_buffer_float32_atomics(true)
        .shader_buffer_float32_atomic_add(true)
        .shader_shared_float32_atomics(true)
        .shader_shared_float32_atomic_add(true)
        .shader_image_float32_atomics(true)
        .shader_image_float32_atomic_add(true);
    sums.p_next = (&raw mut minima).cast();
    let names = [ash::ext::shader_atomic_float::NAME, ash::ext::shader_atomic_float2::NAME];
    let gpu = &Gpu::extended(&names, &mut sums).expect("a device");
    let format = vk::Format::R32_SFLOAT;
    let properties = gpu.format_properties(format);
    let (image_atomic, buffer_atomic) =
        (vk::FormatFeatureFlags::STORAGE_IMAGE_ATOMIC, vk::FormatFeatureFlags::STORAGE_TEXEL_BUFFER_ATOMIC);
    assert!(properties.optimal_tiling_features.contains(image_atomic));
    assert!(properties.buffer_features.contains(buffer_atomic));
    // Sum, minimum, maximum, and what is exchanged.
    let before = [0.5f32, 1e9, -1e9, -1.0];
    let words = Buffer::of(gpu, &before);
    let info = vk::BufferViewCreateInfo::default().buffer(words.raw).format(format).range(vk::WHOLE_SIZE);
    // SAFETY: the buffer is alive.
    let view = unsafe { gpu.device().create_buffer_view(&info, None) }.expect("a view");
    let image = Image::new(gpu, &ImageOptions::new(format, [4, 1], Usage::STORAGE));
    let numbers = Buffer::of(gpu, &before);
    let results = Buffer::new(gpu, 4 * (8 + 4 * 64));
    let bindings = Bindings::new(
        gpu,
        &[
            Resource::StorageImage(image.view),
            Resource::StoredTexels(view),
            Resource::Storage(numbers.raw),
            Resource::Storage(results.raw),
        ],
    );
    let kernel = Kernel::new(
        gpu,
        "#extension GL_EXT_shader_atomic_float : require
        #extension GL_EXT_shader_atomic_float2 : require
        layout(local_size_x = 64) in;
        layout(binding = 0, r32f) uniform image2D texels;
        layout(binding = 1, r32f) uniform imageBuffer words;
        layout(binding = 2) buffer Numbers { float numbers[4]; };
        layout(binding = 3) buffer Results { float of_shared[4]; float of_texels[4]; float old[]; };
        shared float own[4];
        void main() {
            int at = int(gl_LocalInvocationIndex);
            float x = float(at);
            if (at < 4) {
                own[at] = vec4(0.5, 1e9, -1e9, -1.0)[at];
                imageStore(texels, ivec2(at, 0), vec4(own[at]));
            }
            memoryBarrierShared();
            memoryBarrierImage();
            barrier();
            atomicAdd(own[0], x);
            atomicMin(own[1], 7.5 - x);
            atomicMax(own[2], x - 7.5);
            old[at] = atomicExchange(own[3], x);
            atomicAdd(numbers[0], x);
            atomicMin(numbers[1], 7.5 - x);
            atomicMax(numbers[2], x - 7.5);
            old[64 + at] = atomicExchange(numbers[3], x);
            imageAtomicAdd(texels, ivec2(0, 0), x);
            imageAtomicMin(texels, ivec2(1, 0), 7.5 - x);
            imageAtomicMax(texels, ivec2(2, 0), x - 7.5);
            old[128 + at] = imageAtomicExchange(texels, ivec2(3, 0), x);
            imageAtomicAdd(words, 0, x);
            imageAtomicMin(words, 1, 7.5 - x);
            imageAtomicMax(words, 2, x - 7.5);
            old[192 + at] = imageAtomicExchange(words, 3, x);
            memoryBarrierShared();
            memoryBarrierImage();
            barrier();
            if (at < 4) {
                of_shared[at] = own[at];
                of_texels[at] = imageLoad(texels, ivec2(at, 0)).x;
            }
        }",
        &bindings,
    );
    kernel.run(&[bindings.set], &[], [1, 1, 1]);
    // SAFETY: nothing uses the view any more.
    unsafe { gpu.device().destroy_buffer_view(view, None) };
    let results = results.values::<f32>();
    let (after, old) = results.split_at(8);
    let (numbers, words) = (numbers.values::<f32>(), words.values::<f32>());
    for (what, after, old) in [
        ("workgroup memory", &after[..4], &old[..64]),
        ("a buffer", &numbers, &old[64..128]),
        ("an image", &after[4..8], &old[128..192]),
        ("a texel buffer", &words, &old[192..256]),
    ] {
        assert_eq!(after[..3], [0.5 + 2016.0, -55.5, 55.5], "{what}");
        // Each number was put there once, and taken out by the next, or is there still.
        let mut seen: Vec<f32> = old.iter().chain(&after[3..]).copied().collect();
        seen.sort_by(f32::total_cmp);
        let expected: Vec<f32> = (-1..64).map(|number| number as f32).collect();
        assert_eq!(seen, expected, "{what}");
    }
}
