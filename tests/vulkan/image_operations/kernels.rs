//! Images, samplers and texel buffers in kernels.

use ash::vk;
use gaurast_testkit::devices::{COLOR_LAYERS, image, open};
use gaurast_testkit::scene::extent;
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Binding, Buffer, Compute, Gpu, Image};

const BINDINGS: &[Binding] = &[
    (0, vk::DescriptorType::COMBINED_IMAGE_SAMPLER, 1),
    (1, vk::DescriptorType::SAMPLED_IMAGE, 2),
    (3, vk::DescriptorType::SAMPLER, 1),
    (4, vk::DescriptorType::STORAGE_IMAGE, 1),
    (5, vk::DescriptorType::UNIFORM_TEXEL_BUFFER, 1),
    (6, vk::DescriptorType::STORAGE_TEXEL_BUFFER, 1),
];

/// Red and green of the texel at (x, y).
fn texel(x: usize, y: usize) -> [u8; 2] {
    [(16 * x + 2 * y) as u8, (x + 8 * y) as u8]
}

fn picture(gpu: &Gpu) -> Image {
    let image = image(gpu, vk::Format::R8G8B8A8_UNORM, [8, 8]);
    let texels: Vec<[u8; 4]> = (0..64).map(|i| texel(i % 8, i / 8)).map(|[red, green]| [red, green, 0, 255]).collect();
    let data = Buffer::of(gpu, &texels);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let region =
            [vk::BufferImageCopy::default().image_subresource(COLOR_LAYERS).image_extent(extent(&image).into())];
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: see the crate.
        unsafe {
            device.cmd_copy_buffer_to_image(commands, data.raw, image.raw, layout, &region);
        }
    });
    image
}

#[gaurast_runner::test]
fn kernels_read_and_write_images() {
    let gpu = open();
    let kernel = Compute::new(&gpu, &spirv("image_bindings.comp"), &[BINDINGS]);
    let source = picture(&gpu);
    let target = image(&gpu, vk::Format::R8G8B8A8_UNORM, [8, 8]);
    let numbers = Buffer::of(&gpu, &[0u8, 10, 20, 30, 40, 50, 60, 70]);
    let counts = Buffer::new(&gpu, 64);
    let device = gpu.device();
    // SAFETY: see the crate.
    unsafe {
        let sampler = |filter| {
            let info = vk::SamplerCreateInfo::default().mag_filter(filter).min_filter(filter);
            device.create_sampler(&info, None).unwrap()
        };
        let (linear, nearest) = (sampler(vk::Filter::LINEAR), sampler(vk::Filter::NEAREST));
        let view = |buffer, format| {
            let info = vk::BufferViewCreateInfo::default().buffer(buffer).format(format).range(vk::WHOLE_SIZE);
            device.create_buffer_view(&info, None).unwrap()
        };
        let numbers_view = [view(numbers.raw, vk::Format::R8_UINT)];
        let counts_view = [view(counts.raw, vk::Format::R32_UINT)];
        // A view that swaps red and green.
        let swapped = vk::ImageViewCreateInfo::default()
            .image(source.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(vk::Format::R8G8B8A8_UNORM)
            .components(vk::ComponentMapping {
                r: vk::ComponentSwizzle::G,
                g: vk::ComponentSwizzle::R,
                ..Default::default()
            })
            .subresource_range(gaurast_testkit::devices::COLOR);
        let swapped = device.create_image_view(&swapped, None).unwrap();
        let image = |view| vk::DescriptorImageInfo::default().image_view(view).image_layout(vk::ImageLayout::GENERAL);
        let set = kernel.sets.allocate()[0];
        let write =
            |binding, ty| vk::WriteDescriptorSet::default().dst_set(set).dst_binding(binding).descriptor_type(ty);
        let combined = [image(source.view).sampler(linear)];
        let pictures = [image(source.view), image(swapped)];
        let plain = [vk::DescriptorImageInfo::default().sampler(nearest)];
        let stored = [image(target.view)];
        let writes = [
            write(0, vk::DescriptorType::COMBINED_IMAGE_SAMPLER).image_info(&combined),
            write(1, vk::DescriptorType::SAMPLED_IMAGE).image_info(&pictures),
            write(3, vk::DescriptorType::SAMPLER).image_info(&plain),
            write(4, vk::DescriptorType::STORAGE_IMAGE).image_info(&stored),
            write(5, vk::DescriptorType::UNIFORM_TEXEL_BUFFER).texel_buffer_view(&numbers_view),
            write(6, vk::DescriptorType::STORAGE_TEXEL_BUFFER).texel_buffer_view(&counts_view),
        ];
        device.update_descriptor_sets(&writes, &[]);
        kernel.run(&[set], &[], [1, 1, 1]);
        device.destroy_sampler(linear, None);
        device.destroy_sampler(nearest, None);
        device.destroy_image_view(swapped, None);
        device.destroy_buffer_view(numbers_view[0], None);
        device.destroy_buffer_view(counts_view[0], None);
    }
    let stored = target.colors::<[u8; 4]>();
    for (i, found) in stored.iter().enumerate() {
        let (x, y) = (i % 8, i / 8);
        // The centre is in one cell of the 7x7 cells between texels. The mean of red there is that of the cell's
        // corners.
        let cell = |at: usize| (at as f64 + 0.5) * 7.0 / 8.0;
        let (u, v) = (cell(x).floor(), cell(y).floor());
        let red = 16.0 * u + 8.0 + 2.0 * v + 1.0;
        let green = texel(x, y)[if x % 2 == 0 { 1 } else { 0 }];
        assert!((f64::from(found[0]) - red).abs() <= 1.0, "{x}, {y}: {found:?}, {red}");
        assert_eq!(found[1..], [green, 10 * x as u8, 255], "{x}, {y}");
    }
    assert_eq!(counts.values::<u32>()[..8], [28; 8]);
}
