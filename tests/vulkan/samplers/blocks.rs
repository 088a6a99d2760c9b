//! Blocks of ETC2, EAC and ASTC of all sizes, in images with levels and partial blocks, and viewed in other formats.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Bindings, Image, ImageOptions, Kernel, Resource, fetch, range};
use vk::ImageUsageFlags as Usage;

const COLOR: vk::ImageAspectFlags = vk::ImageAspectFlags::COLOR;

/// A format, and the width and height of its blocks.
type Blocks = (vk::Format, [u32; 2]);

/// The ASTC formats: that of 4x4 texels, and at steps of two those of the other sizes. sRGB formats lie between them.
fn astc() -> impl Iterator<Item = Blocks> {
    let sizes = [
        [4, 4],
        [5, 4],
        [5, 5],
        [6, 5],
        [6, 6],
        [8, 5],
        [8, 6],
        [8, 8],
        [10, 5],
        [10, 6],
        [10, 8],
        [10, 10],
        [12, 10],
        [12, 12],
    ];
    let first = vk::Format::ASTC_4X4_UNORM_BLOCK.as_raw();
    (first..).step_by(2).map(vk::Format::from_raw).zip(sizes)
}

/// A block of one colour, of a byte: in ASTC a void extent, in EAC a base without modifier (with the red and the green of
/// `number`), and in ETC2 a plane.
fn one_color(format: vk::Format, number: u8) -> Vec<u8> {
    let name = format!("{format:?}");
    // Table 13 has the modifier 0 for index 4.
    let component = |base: u8| (u64::from(base) << 56 | 1 << 52 | 13 << 48 | 0x9249_2492_4924).to_be_bytes();
    let plane = || {
        // Bits without a meaning make the sum of blue leave the range, and keep those of red and green in it.
        let (red, green) = (u64::from(number >> 2 & 31), u64::from(number & 31));
        let corner = 1 << 63 | 1 << 55 | red << 57 | green << 49 | 1 << 48 | 7 << 45 | 3 << 43 | 7 << 39;
        let right = red >> 1 << 34 | 1 << 33 | (red & 1) << 32 | green << 25 | 63 << 19;
        (corner | right | red << 13 | green << 6 | 63).to_be_bytes()
    };
    if name.starts_with("ASTC") {
        let color = u128::from(number) << 72 | 0xFF << 80 | 0xFF00 << 96 | 0x4000 << 112;
        (color | 0xFFFF_FFFF_FFFF_FDFC).to_le_bytes().to_vec()
    } else if name.starts_with("EAC_R11G11") {
        [component(number / 2), component(number / 3)].concat()
    } else if name.starts_with("EAC") {
        component(number / 2).to_vec()
    } else if name.starts_with("ETC2_R8G8B8A8") {
        [component(number), plane()].concat()
    } else {
        plane().to_vec()
    }
}

/// The texel of such a block.
fn texel(format: vk::Format, number: u8) -> [f32; 4] {
    let name = format!("{format:?}");
    let byte = |byte: u8| f32::from(byte) / 255.0;
    let eac = |base: u8| {
        if name.contains("SNORM") { f32::from(base) * 8.0 / 1023.0 } else { (f32::from(base) * 8.0 + 4.0) / 2047.0 }
    };
    if name.starts_with("ASTC") {
        // Components are divided by 2^16, and rounded towards zero to eleven bits.
        let fraction = |bits: u32| bits as f32 / 65536.0;
        [fraction(u32::from(number) << 8), fraction(0xFF), fraction(0xFF00), fraction(0x4000)]
    } else if name.starts_with("EAC_R11G11") {
        [eac(number / 2), eac(number / 3), 0.0, 1.0]
    } else if name.starts_with("EAC") {
        [eac(number / 2), 0.0, 0.0, 1.0]
    } else {
        let (red, green) = (number >> 2 & 31, number & 31);
        let alpha = if name.starts_with("ETC2_R8G8B8A8") { byte(number) } else { 1.0 };
        [byte(red << 2 | red >> 4), byte(green << 1), 1.0, alpha]
    }
}

/// Each block of an image has a colour of its own; sides are not multiples of blocks.
#[gaurast_runner::test(needs = [GLSLANG])]
fn every_texel_is_of_its_block() {
    let etc = [
        vk::Format::ETC2_R8G8B8_UNORM_BLOCK,
        vk::Format::ETC2_R8G8B8A1_UNORM_BLOCK,
        vk::Format::ETC2_R8G8B8A8_UNORM_BLOCK,
        vk::Format::EAC_R11_UNORM_BLOCK,
        vk::Format::EAC_R11_SNORM_BLOCK,
        vk::Format::EAC_R11G11_UNORM_BLOCK,
        vk::Format::EAC_R11G11_SNORM_BLOCK,
    ];
    for (format, [across, down]) in etc.map(|format| (format, [4, 4])).into_iter().chain(astc()) {
        let options = ImageOptions { levels: 4, ..ImageOptions::new(format, [47, 39], Usage::SAMPLED) };
        let image = Image::new(own(), &options);
        let numbers = |level: u32| {
            let [width, height, _] = options.level_size(level);
            let columns = width.div_ceil(across);
            (columns, columns * height.div_ceil(down))
        };
        let number = |level: u32, block: u32| (40 * level + 3 * block) as u8;
        let blocks: Vec<u8> = (0..options.levels)
            .flat_map(|level| (0..numbers(level).1).flat_map(move |block| one_color(format, number(level, block))))
            .collect();
        image.upload(COLOR, &blocks);
        assert_eq!(image.download(COLOR), blocks, "{format:?}");
        for level in 0..options.levels {
            let (columns, _) = numbers(level);
            let [width, ..] = options.level_size(level);
            for (index, found) in (0..).zip(fetch::texels(&image, image.view, level)) {
                let (x, y) = (index % width, index / width);
                let expected = texel(format, number(level, y / down * columns + x / across));
                assert_eq!(found, expected, "{format:?}, level {level}, texel {x}, {y}");
            }
        }
    }
}

/// Gives `use_it` a view of another format than the image's.
fn with_view<R>(image: &Image, format: vk::Format, usage: Usage, use_it: impl FnOnce(vk::ImageView) -> R) -> R {
    let device = image.gpu().device();
    let mut usage = vk::ImageViewUsageCreateInfo::default().usage(usage);
    let info = vk::ImageViewCreateInfo::default()
        .image(image.raw)
        .view_type(vk::ImageViewType::TYPE_2D)
        .format(format)
        .subresource_range(range(COLOR))
        .push_next(&mut usage);
    // SAFETY: see the crate.
    let view = unsafe { device.create_image_view(&info, None) }.expect("a view");
    let result = use_it(view);
    // SAFETY: nothing uses the view any more.
    unsafe { device.destroy_image_view(view, None) };
    result
}

/// Views decode an image by their own format, of which results differ in precision and in sign.
#[gaurast_runner::test(needs = [GLSLANG])]
fn a_view_decodes_by_its_format() {
    let flags = vk::ImageCreateFlags::MUTABLE_FORMAT;
    let first = |image: &Image, format: vk::Format| {
        with_view(image, format, Usage::SAMPLED, |view| fetch::texels(image, view, 0)[0])
    };
    let image = |format: vk::Format, block: &[u8]| {
        let image = Image::new(own(), &ImageOptions { flags, ..ImageOptions::new(format, [4, 4], Usage::SAMPLED) });
        image.upload(COLOR, block);
        image
    };
    // A component of 0x1280 has eight bits in sRGB, and all of its bits otherwise.
    let block = (0x1280_1280_1280_1280u128 << 64 | 0xFFFF_FFFF_FFFF_FDFC).to_le_bytes();
    let astc = image(vk::Format::ASTC_4X4_SRGB_BLOCK, &block);
    for _ in 0..2 {
        let [red, .., alpha] = first(&astc, vk::Format::ASTC_4X4_SRGB_BLOCK);
        let encoded = f32::from(0x12u8) / 255.0;
        assert_eq!(alpha, encoded);
        assert!((red - ((encoded + 0.055) / 1.055).powf(2.4)).abs() < 1e-6, "{red}");
        assert_eq!(first(&astc, vk::Format::ASTC_4X4_UNORM_BLOCK), [f32::from(0x1280u16) / 65536.0; 4]);
    }
    // A base of -1, or of 255.
    let eac = image(vk::Format::EAC_R11_UNORM_BLOCK, &[0xFF, 0x1D, 0x92, 0x49, 0x24, 0x92, 0x49, 0x24]);
    assert_eq!(first(&eac, vk::Format::EAC_R11_UNORM_BLOCK)[0], 2044.0 / 2047.0);
    assert_eq!(first(&eac, vk::Format::EAC_R11_SNORM_BLOCK)[0], -8.0 / 1023.0);
    let bc = image(vk::Format::BC4_SNORM_BLOCK, &[0x81, 0x81, 0, 0, 0, 0, 0, 0]);
    assert_eq!(first(&bc, vk::Format::BC4_SNORM_BLOCK)[0], -1.0);
    assert!((first(&bc, vk::Format::BC4_UNORM_BLOCK)[0] - 129.0 / 255.0).abs() < 1e-6);
}

/// A program writes blocks through a view whose texels are words.
#[gaurast_runner::test(needs = [GLSLANG])]
fn blocks_are_written_as_words() {
    let flags = vk::ImageCreateFlags::MUTABLE_FORMAT
        | vk::ImageCreateFlags::EXTENDED_USAGE
        | vk::ImageCreateFlags::BLOCK_TEXEL_VIEW_COMPATIBLE;
    let format = vk::Format::ASTC_8X5_UNORM_BLOCK;
    let usage = Usage::SAMPLED | Usage::STORAGE;
    let image = Image::new(own(), &ImageOptions { flags, ..ImageOptions::new(format, [20, 12], usage) });
    with_view(&image, vk::Format::R32G32B32A32_UINT, Usage::STORAGE, |words| {
        let bindings = Bindings::new(own(), &[Resource::StorageImage(words)]);
        let source = "
            layout(local_size_x = 1) in;
            layout(binding = 0, rgba32ui) uniform writeonly uimage2D words;
            layout(push_constant) uniform Constants { uint level; };
            void main() {
                uvec2 at = gl_WorkGroupID.xy;
                uvec2 color = uvec2(level << 12 | at.x << 28, at.y << 12);
                imageStore(words, ivec2(at), uvec4(0xFFFFFDFCu, 0xFFFFFFFFu, color));
            }";
        let kernel = Kernel::new(own(), source, &bindings);
        for level in [1, 2] {
            kernel.run(&[bindings.set], &[level], [3, 3, 1]);
            for (index, found) in (0..).zip(fetch::texels(&image, image.view, 0)) {
                let sixteenths = [level, index % 20 / 8, index / 20 / 5, 0];
                assert_eq!(found, sixteenths.map(|count| count as f32 / 16.0), "texel {index}");
            }
        }
    });
}
