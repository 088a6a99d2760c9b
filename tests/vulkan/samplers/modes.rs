//! Samplers: anisotropic filtering, minimum and maximum reduction, custom border colours.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Bindings, Buffer, Gpu, Image, ImageOptions, Kernel, Resource, Sampler};

/// The result of a kernel that samples an image by `code`, which sets `found`.
fn sampled(gpu: &Gpu, image: &Image, sampler: &vk::SamplerCreateInfo<'_>, code: &str) -> [f32; 4] {
    let sampler = Sampler::new(gpu, sampler);
    let result = Buffer::new(gpu, 16);
    let resources = [Resource::Storage(result.raw), Resource::Texture(image.view, sampler.raw)];
    let bindings = Bindings::new(gpu, &resources);
    let kernel = Kernel::new(
        gpu,
        &format!(
            "layout(local_size_x = 1) in;
             layout(binding = 0) buffer Out {{ vec4 found; }};
             layout(binding = 1) uniform sampler2D image;
             void main() {{ {code} }}"
        ),
        &bindings,
    );
    kernel.run(&[bindings.set], &[], [1, 1, 1]);
    bytemuck::pod_read_unaligned(&result.read())
}

fn linear() -> vk::SamplerCreateInfo<'static> {
    vk::SamplerCreateInfo::default()
        .mag_filter(vk::Filter::LINEAR)
        .min_filter(vk::Filter::LINEAR)
        .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
        .max_lod(vk::LOD_CLAMP_NONE)
}

/// Stripes across a long and narrow footprint. An isotropic sample takes a coarse level, in which all stripes are gray.
/// An anisotropic sample takes several samples along the footprint, as many as the ratio of length to width, each of
/// the level of its width.
#[gaurast_runner::test(needs = [GLSLANG])]
fn long_footprints_are_sampled_along_their_length() {
    let gpu = own();
    assert!(gpu.limits().max_sampler_anisotropy >= 16.0);
    assert_eq!(gpu.features().sampler_anisotropy, vk::TRUE);
    let side = 64u32;
    // Level 0 has stripes along y that are 8 texels wide. Each level has its number in green.
    let levels: Vec<Vec<[f32; 4]>> = (0..7)
        .map(|level| {
            let size = side >> level;
            let texel = |at: u32| {
                let x = at % size;
                let stripe = if level < 3 { (x << level) / 8 % 2 } else { 0 };
                let red = if level < 3 { stripe as f32 } else { 0.5 };
                [red, level as f32, x as f32, 1.0]
            };
            (0..size * size).map(texel).collect()
        })
        .collect();
    let usage = vk::ImageUsageFlags::SAMPLED;
    let options = ImageOptions::new(vk::Format::R32G32B32A32_SFLOAT, [side; 2], usage);
    let image = Image::textured(gpu, &options, &levels);
    // The footprint is one texel wide along x and eight texels long along y, in the middle of a white stripe.
    let code = "found = textureGrad(image, vec2(12.0, 32.5) / 64.0, vec2(1.0, 0.0) / 64.0, vec2(0.0, 8.0) / 64.0);";
    let isotropic = sampled(gpu, &image, &linear(), code);
    assert_eq!(isotropic[..2], [0.5, 3.0], "log2(8) is level 3");
    let with = |most: f32| {
        let info = linear().anisotropy_enable(true).max_anisotropy(most);
        sampled(gpu, &image, &info, code)
    };
    let full = with(16.0);
    assert!((full[0] - 1.0).abs() < 1e-5, "{full:?}");
    assert!(full[1].abs() < 1e-5, "of the width of one texel: {full:?}");
    // With at most two samples, each footprint is half as long: four texels, level 2.
    let half = with(2.0);
    assert!((half[1] - 2.0).abs() < 1e-5, "{half:?}");
    assert_eq!(with(1.0), isotropic);
    // The longer axis is used: along x the samples are on both kinds of stripes.
    let across = "found = textureGrad(image, vec2(16.0, 32.5) / 64.0, vec2(16.0, 0.0) / 64.0, vec2(0.0, 1.0) / 64.0);";
    let info = linear().anisotropy_enable(true).max_anisotropy(16.0);
    let across = sampled(gpu, &image, &info, across);
    assert!((across[0] - 0.5).abs() < 0.05, "{across:?}");
    assert!(across[1].abs() < 1e-5, "{across:?}");
    assert!((across[2] - 15.5).abs() < 1e-3, "centred: {across:?}");
    // A footprint that is as wide as long is sampled once, with or without anisotropy.
    let round = "found = textureGrad(image, vec2(13.25, 30.0) / 64.0, vec2(2.0, 0.0) / 64.0, vec2(0.0, 2.0) / 64.0);";
    let info = linear().anisotropy_enable(true).max_anisotropy(16.0);
    assert_eq!(sampled(gpu, &image, &info, round), sampled(gpu, &image, &linear(), round));
}

/// The minimum and the maximum of the texels with a nonzero weight, of one level and of two.
#[gaurast_runner::test(needs = [GLSLANG])]
fn samplers_take_the_least_and_the_greatest() {
    let gpu = own();
    let levels = [vec![1f32, 5.0, 3.0, 9.0], vec![7.0]];
    let usage = vk::ImageUsageFlags::SAMPLED;
    let options = ImageOptions::new(vk::Format::R32_SFLOAT, [2, 2], usage);
    let image = Image::textured(gpu, &options, &levels);
    let found = |mode, at: [f32; 2], level: f32| {
        let mut reduction = vk::SamplerReductionModeCreateInfo::default().reduction_mode(mode);
        let info = linear()
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .push_next(&mut reduction);
        let [x, y] = at;
        let code = format!("found = textureLod(image, vec2({x:.3}, {y:.3}), {level:.3});");
        sampled(gpu, &image, &info, &code)[0]
    };
    let (least, greatest) = (vk::SamplerReductionMode::MIN, vk::SamplerReductionMode::MAX);
    assert_eq!(found(least, [0.5, 0.5], 0.0), 1.0);
    assert_eq!(found(greatest, [0.5, 0.5], 0.0), 9.0);
    // On the centres of a row of texels, the other row has no weight.
    assert_eq!(found(greatest, [0.5, 0.25], 0.0), 5.0);
    assert_eq!(found(least, [0.5, 0.75], 0.0), 3.0);
    // Between two levels, the texels of both count.
    assert_eq!(found(greatest, [0.25, 0.25], 0.5), 7.0);
    assert_eq!(found(least, [0.25, 0.25], 0.5), 1.0);
    let mean = vk::SamplerReductionMode::WEIGHTED_AVERAGE;
    assert_eq!(found(mean, [0.5, 0.5], 0.0), 4.5);
}

/// Outside an image is the sampler's border colour, with the view's swizzle.
#[gaurast_runner::test(needs = [GLSLANG])]
fn borders_have_any_colour() {
    let mut custom = vk::PhysicalDeviceCustomBorderColorFeaturesEXT::default()
        .custom_border_colors(true)
        .custom_border_color_without_format(true);
    let mut swizzle = vk::PhysicalDeviceBorderColorSwizzleFeaturesEXT::default()
        .border_color_swizzle(true)
        .border_color_swizzle_from_image(true);
    custom.p_next = std::ptr::from_mut(&mut swizzle).cast();
    let names = [ash::ext::custom_border_color::NAME, ash::ext::border_color_swizzle::NAME];
    let gpu = Gpu::extended(&names, &mut custom).expect("a device");
    let usage = vk::ImageUsageFlags::SAMPLED;
    let options = ImageOptions::new(vk::Format::R32G32B32A32_SFLOAT, [1, 1], usage);
    let image = Image::textured(&gpu, &options, &[vec![[0f32; 4]]]);
    for format in [vk::Format::UNDEFINED, vk::Format::R32G32B32A32_SFLOAT] {
        let mut color = vk::SamplerCustomBorderColorCreateInfoEXT::default()
            .custom_border_color(vk::ClearColorValue { float32: [0.125, -2.5, 1e6, 0.75] })
            .format(format);
        let info = vk::SamplerCreateInfo::default()
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_BORDER)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_BORDER)
            .border_color(vk::BorderColor::FLOAT_CUSTOM_EXT)
            .push_next(&mut color);
        let code = "found = textureLod(image, vec2(2.0, 0.5), 0.0);";
        assert_eq!(sampled(&gpu, &image, &info, code), [0.125, -2.5, 1e6, 0.75]);
        let inside = "found = textureLod(image, vec2(0.5), 0.0);";
        assert_eq!(sampled(&gpu, &image, &info, inside), [0.0; 4]);
    }
}

/// Formats of four bits per component are read in their own component order.
#[gaurast_runner::test(needs = [GLSLANG])]
fn components_of_four_bits_have_their_places() {
    let gpu = own();
    let nearest = vk::SamplerCreateInfo::default();
    let code = "found = textureLod(image, vec2(0.5), 0.0);";
    for (format, expected) in [
        (vk::Format::A4R4G4B4_UNORM_PACK16, [0x2, 0x3, 0x4, 0x1]),
        (vk::Format::A4B4G4R4_UNORM_PACK16, [0x4, 0x3, 0x2, 0x1]),
        (vk::Format::B4G4R4A4_UNORM_PACK16, [0x3, 0x2, 0x1, 0x4]),
    ] {
        let options = ImageOptions::new(format, [1, 1], vk::ImageUsageFlags::SAMPLED);
        let image = Image::textured(gpu, &options, &[vec![0x1234u16]]);
        let found = sampled(gpu, &image, &nearest, code);
        let expected = expected.map(|four: u8| f32::from(four) / 15.0);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{format:?}: {found}");
        }
    }
}

/// The formats of the fifth maintenance: five bits from red on, and alpha alone, whose other components are 0.
#[gaurast_runner::test(needs = [GLSLANG])]
fn components_of_the_fifth_maintenance_have_their_places() {
    let mut features = vk::PhysicalDeviceMaintenance5FeaturesKHR::default().maintenance5(true);
    let gpu = &Gpu::extended(&[ash::khr::maintenance5::NAME], &mut features).expect("a device");
    let nearest = vk::SamplerCreateInfo::default();
    let code = "found = textureLod(image, vec2(0.5), 0.0);";
    let usage = vk::ImageUsageFlags::SAMPLED;
    let fives = ImageOptions::new(vk::Format::A1B5G5R5_UNORM_PACK16_KHR, [1, 1], usage);
    let image = Image::textured(gpu, &fives, &[vec![0b1_00011_00010_00001u16]]);
    let expected = [1.0 / 31.0, 2.0 / 31.0, 3.0 / 31.0, 1.0];
    for (found, expected) in sampled(gpu, &image, &nearest, code).iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{found}");
    }
    let alpha = ImageOptions::new(vk::Format::A8_UNORM_KHR, [1, 1], usage);
    let image = Image::textured(gpu, &alpha, &[vec![51u8]]);
    assert_eq!(sampled(gpu, &image, &nearest, code), [0.0, 0.0, 0.0, 0.2]);
}

/// Across a cube's edge lies the next face, or, with seams, what the address mode says of the face alone.
#[gaurast_runner::test(needs = [GLSLANG])]
fn cubes_may_have_seams() {
    let mut features = vk::PhysicalDeviceNonSeamlessCubeMapFeaturesEXT::default().non_seamless_cube_map(true);
    let gpu = &Gpu::extended(&[ash::ext::non_seamless_cube_map::NAME], &mut features).expect("a device");
    let options = ImageOptions {
        layers: 6,
        view: vk::ImageViewType::CUBE,
        ..ImageOptions::new(vk::Format::R32_SFLOAT, [2; 2], vk::ImageUsageFlags::SAMPLED)
    };
    // Columns of each face differ: 10 times its number, and one more.
    let texels: Vec<f32> = (0..24).map(|texel| (10 * (texel / 4) + texel % 2) as f32).collect();
    let image = Image::textured(gpu, &options, &[texels]);
    let found = |flags, mode, code: &str| {
        let info = linear()
            .flags(flags)
            .address_mode_u(mode)
            .address_mode_v(mode)
            .border_color(vk::BorderColor::FLOAT_OPAQUE_WHITE);
        let sampler = Sampler::new(gpu, &info);
        let result = Buffer::new(gpu, 16);
        let resources = [Resource::Storage(result.raw), Resource::Texture(image.view, sampler.raw)];
        let bindings = Bindings::new(gpu, &resources);
        let kernel = Kernel::new(
            gpu,
            &format!(
                "layout(local_size_x = 1) in;
                 layout(binding = 0) buffer Out {{ vec4 found; }};
                 layout(binding = 1) uniform samplerCube image;
                 void main() {{ found = {code}; }}"
            ),
            &bindings,
        );
        kernel.run(&[bindings.set], &[], [1, 1, 1]);
        let [x, ..]: [f32; 4] = bytemuck::pod_read_unaligned(&result.read());
        x
    };
    use vk::SamplerAddressMode as Mode;
    let (seamless, seams) = (vk::SamplerCreateFlags::empty(), vk::SamplerCreateFlags::NON_SEAMLESS_CUBE_MAP_EXT);
    // At the left edge of +X, whose neighbour is +Z, in the middle of the edge.
    let edge = "textureLod(image, vec3(1.0, 0.0, 1.0 - 1e-6), 0.0)";
    let across = found(seamless, Mode::CLAMP_TO_EDGE, edge);
    assert!((across - 0.5 * (0.0 + 41.0)).abs() < 1e-3, "{across}");
    assert_eq!(found(seamless, Mode::REPEAT, edge), across);
    assert!(found(seams, Mode::CLAMP_TO_EDGE, edge).abs() < 1e-3);
    let repeated = found(seams, Mode::REPEAT, edge);
    assert!((repeated - 0.5).abs() < 1e-3, "both columns: {repeated}");
    let bordered = found(seams, Mode::CLAMP_TO_BORDER, edge);
    assert!((bordered - 0.5).abs() < 1e-3, "half the border: {bordered}");
    // In the middle of a face there is no difference.
    let middle = "textureLod(image, vec3(0.0, 0.0, -1.0), 0.0)";
    assert_eq!(found(seams, Mode::REPEAT, middle), 50.5);
    assert_eq!(found(seamless, Mode::REPEAT, middle), 50.5);
}
