//! Compares the texels of random compressed blocks with those of another driver: `VK_DRIVER_FILES=MANIFEST cargo run
//! --release -p gaurast-tests --example block_texels [BLOCKS]`.
//!
//! For each format of ETC2, EAC and ASTC that both drivers blit from, it prints the texels, how many differ, and the
//! greatest difference. Texels are blitted to 32-bit floats. Programs do not read them, since SwiftShader decodes a
//! compressed image for draws and for blits, but not for dispatches.

use ash::vk;
use gaurast_testkit::texels::Noise;
use gaurast_testkit::{Driver, Gpu, Image, ImageOptions, Opening, Settings, device_format};

/// The number of blocks in a row.
const COLUMNS: u32 = 64;

/// The greatest difference between floats of equal texels, after the conversion from sRGB.
const ROUNDING: f32 = 1e-6;

/// Random blocks. Of those of ASTC many are not valid, so that most have a block mode that is, and no partitions or few.
fn blocks(format: vk::Format, count: u32) -> Vec<u8> {
    let mut noise = Noise::new(u64::from(format.as_raw().unsigned_abs()));
    let mut bytes = noise.texels(device_format(format), count as usize);
    if format.as_raw() >= vk::Format::ASTC_4X4_UNORM_BLOCK.as_raw() {
        for (index, block) in bytes.as_chunks_mut::<16>().0.iter_mut().enumerate() {
            // Grids of 4x4 weights: of 4, 8, 5, 6 and 32 values, and of two planes of 4 values.
            let modes: [u16; 6] = [0x042, 0x053, 0x052, 0x043, 0x253, 0x442];
            let mode = match index % 8 {
                // One colour.
                0 => 0xDFC,
                1 => continue,
                mode => modes[mode - 2],
            };
            let keep = if mode == 0xDFC { 0xF000 } else { 0xF800 };
            let low = u16::from_le_bytes([block[0], block[1]]) & keep | mode;
            block[..2].copy_from_slice(&low.to_le_bytes());
            match index / 8 % 3 {
                _ if mode == 0xDFC => block[1..8].fill(0xFF),
                // One partition, and several of one endpoint mode.
                0 => block[1] &= 0xE7,
                1 => {
                    block[2] &= 0x7F;
                    block[3] &= 0xFE;
                }
                _ => {}
            }
            if mode == 0xDFC {
                block[1] = 0xFD;
            }
        }
    }
    bytes
}

/// The texels of an image as floats.
fn floats(gpu: &Gpu, source: &Image) -> Vec<[f32; 4]> {
    let [width, height, _] = source.options.size;
    let floats = vk::Format::R32G32B32A32_SFLOAT;
    let target = Image::new(gpu, &ImageOptions::new(floats, [width, height], vk::ImageUsageFlags::empty()));
    let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
    let corners = [vk::Offset3D::default(), vk::Offset3D { x: width as i32, y: height as i32, z: 1 }];
    let region = vk::ImageBlit::default()
        .src_subresource(layers)
        .src_offsets(corners)
        .dst_subresource(layers)
        .dst_offsets(corners);
    gpu.run(|commands| {
        let (device, raw) = commands.raw();
        let (general, nearest) = (vk::ImageLayout::GENERAL, vk::Filter::NEAREST);
        // SAFETY: both images live until the submission ends, and are in that layout.
        unsafe { device.cmd_blit_image(raw, source.raw, general, target.raw, general, &[region], nearest) };
        commands.barrier();
    });
    target.colors()
}

fn main() {
    let count: u32 = std::env::args().nth(1).map_or(4096, |text| text.parse().expect("a number of blocks"));
    let ours = Gpu::embedded(&Settings::default()).expect("this driver's device");
    let theirs = Gpu::open(&Opening::of(Driver::Any)).expect("a device of another driver");
    println!("beside {}", theirs.name());
    let formats = vk::Format::ETC2_R8G8B8_UNORM_BLOCK.as_raw()..=vk::Format::ASTC_12X12_SRGB_BLOCK.as_raw();
    for format in formats.map(vk::Format::from_raw) {
        let is_source = |gpu: &Gpu| gpu.format_features(format).contains(vk::FormatFeatureFlags::BLIT_SRC);
        if !is_source(&ours) || !is_source(&theirs) {
            println!("{format:?}: not a source of blits of both");
            continue;
        }
        let [across, down] = device_format(format).block_extent();
        let rows = count.div_ceil(COLUMNS);
        let options = ImageOptions::new(format, [across * COLUMNS, down * rows], vk::ImageUsageFlags::SAMPLED);
        let bytes = blocks(format, COLUMNS * rows);
        let [ours, theirs] = [&ours, &theirs].map(|gpu| {
            let image = Image::new(gpu, &options);
            image.upload(vk::ImageAspectFlags::COLOR, &bytes);
            floats(gpu, &image)
        });
        let apart = |(a, b): (&[f32; 4], &[f32; 4])| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        let distances: Vec<_> = ours.iter().zip(&theirs).map(apart).collect();
        let different = distances.iter().filter(|&&distance| distance > ROUNDING).count();
        let (worst, distance) =
            distances.iter().enumerate().fold((0, 0.0), |worst, (at, &it)| if it > worst.1 { (at, it) } else { worst });
        println!("{format:?}: {} texels, {different} differ, by {distance} at most", ours.len());
        if distance > ROUNDING {
            let width = (across * COLUMNS) as usize;
            let (x, y) = (worst % width, worst / width);
            let block = y / down as usize * COLUMNS as usize + x / across as usize;
            let size = device_format(format).texel_size();
            let block = &bytes[block * size..][..size];
            println!("    ({x}, {y}) of {block:02x?}: {:?}, not {:?}", ours[worst], theirs[worst]);
        }
    }
}
