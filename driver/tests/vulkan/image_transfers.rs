//! Copies, blits and resolves between images: samples, aspects, layers and slices, and what is refused.

use crate::gpu::{COLOR, COLOR_LAYERS, Gpu, Image, MAPPABLE};
use ash::vk;

const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const X4: vk::SampleCountFlags = vk::SampleCountFlags::TYPE_4;

/// A 2D image that is only copied, with memory of its own and no view.
fn image_of(gpu: &Gpu, info: vk::ImageCreateInfo<'_>) -> Image {
    let usage = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
    let info = info.usage(info.usage | usage);
    // SAFETY: see the crate.
    unsafe {
        let image = gpu.device.create_image(&info, None).unwrap();
        let requirements = gpu.device.get_image_memory_requirements(image);
        let memory = gpu.allocate(requirements.size, MAPPABLE);
        gpu.device.bind_image_memory(image, memory, 0).unwrap();
        Image {
            image,
            memory,
            view: vk::ImageView::null(),
            extent: vk::Extent2D {
                width: info.extent.width,
                height: info.extent.height,
            },
        }
    }
}

fn shape(format: vk::Format, width: u32, height: u32) -> vk::ImageCreateInfo<'static> {
    let extent = vk::Extent3D {
        width,
        height,
        depth: 1,
    };
    vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format)
        .extent(extent)
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
}

fn sampled_four_times(width: u32, height: u32) -> vk::ImageCreateInfo<'static> {
    shape(FORMAT, width, height)
        .samples(X4)
        .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
}

fn clear(device: &ash::Device, commands: vk::CommandBuffer, image: Image, float32: [f32; 4]) {
    let value = vk::ClearColorValue { float32 };
    // SAFETY: see the crate.
    unsafe { device.cmd_clear_color_image(commands, image.image, GENERAL, &value, &[COLOR]) };
}

fn extent(width: u32, height: u32, depth: u32) -> vk::Extent3D {
    vk::Extent3D {
        width,
        height,
        depth,
    }
}

const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];

#[gaurast_runner::test]
fn samples_are_cleared_copied_and_resolved() {
    let gpu = Gpu::new();
    let many = [(); 2].map(|()| image_of(&gpu, sampled_four_times(6, 4)));
    let one = gpu.image(FORMAT, 6, 4);
    let [first, second] = many;
    gpu.run(|device, commands| {
        clear(device, commands, first, RED);
        clear(device, commands, second, BLUE);
        clear(device, commands, one, [0.0; 4]);
        let copy = vk::ImageCopy::default()
            .src_subresource(COLOR_LAYERS)
            .src_offset(vk::Offset3D { x: 1, y: 0, z: 0 })
            .dst_subresource(COLOR_LAYERS)
            .dst_offset(vk::Offset3D { x: 2, y: 1, z: 0 })
            .extent(extent(3, 2, 1));
        let left = vk::ImageResolve::default()
            .src_subresource(COLOR_LAYERS)
            .dst_subresource(COLOR_LAYERS)
            .extent(extent(3, 4, 1));
        let middle = [vk::ImageResolve2::default()
            .src_subresource(COLOR_LAYERS)
            .src_offset(vk::Offset3D { x: 3, y: 0, z: 0 })
            .dst_subresource(COLOR_LAYERS)
            .dst_offset(vk::Offset3D { x: 3, y: 0, z: 0 })
            .extent(extent(2, 4, 1))];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_copy_image(
                commands,
                first.image,
                GENERAL,
                second.image,
                GENERAL,
                &[copy],
            );
            device.cmd_resolve_image(commands, second.image, GENERAL, one.image, GENERAL, &[left]);
            let info = vk::ResolveImageInfo2::default()
                .src_image(second.image)
                .src_image_layout(GENERAL)
                .dst_image(one.image)
                .dst_image_layout(GENERAL)
                .regions(&middle);
            device.cmd_resolve_image2(commands, &info);
        }
    });
    let (red, blue) = ([255u8, 0, 0, 255], [0, 0, 255, 255]);
    let expected: Vec<_> = (0..24)
        .map(|i| match (i % 6, i / 6) {
            (5, _) => [0; 4],
            (2..5, 1..3) => red,
            _ => blue,
        })
        .collect();
    assert_eq!(gpu.read_image::<[u8; 4]>(one, 4), expected);
    for image in [first, second, one] {
        gpu.free_image(image);
    }
}

#[gaurast_runner::test]
fn memory_holds_every_sample() {
    let gpu = Gpu::new();
    let size = |samples| {
        let info = sampled_four_times(64, 64).samples(samples);
        // SAFETY: see the crate.
        unsafe {
            let image = gpu.device.create_image(&info, None).unwrap();
            let size = gpu.device.get_image_memory_requirements(image).size;
            gpu.device.destroy_image(image, None);
            size
        }
    };
    assert!(size(X4) >= 4 * size(vk::SampleCountFlags::TYPE_1));
    let refused = [
        sampled_four_times(8, 8).samples(vk::SampleCountFlags::TYPE_2),
        sampled_four_times(8, 8).usage(vk::ImageUsageFlags::STORAGE),
        sampled_four_times(8, 8).tiling(vk::ImageTiling::LINEAR),
    ];
    for info in refused {
        // SAFETY: see the crate.
        let image = unsafe { gpu.device.create_image(&info, None) };
        assert!(image.is_err(), "{info:?}");
    }
}

#[gaurast_runner::test]
fn blits_scale_through_both_entry_points() {
    let gpu = Gpu::new();
    let source = gpu.image(FORMAT, 2, 1);
    let target = gpu.image(FORMAT, 4, 2);
    let texels = gpu.buffer_of(&[[0u8, 0, 0, 255], [200, 100, 40, 255]]);
    let corner = |x, y| vk::Offset3D { x, y, z: 1 };
    let zero = vk::Offset3D::default();
    gpu.run(|device, commands| {
        let upload = [vk::BufferImageCopy::default()
            .image_subresource(COLOR_LAYERS)
            .image_extent(extent(2, 1, 1))];
        let top = vk::ImageBlit::default()
            .src_subresource(COLOR_LAYERS)
            .src_offsets([zero, corner(2, 1)])
            .dst_subresource(COLOR_LAYERS)
            .dst_offsets([zero, corner(4, 1)]);
        let bottom = [vk::ImageBlit2::default()
            .src_subresource(COLOR_LAYERS)
            .src_offsets([zero, corner(2, 1)])
            .dst_subresource(COLOR_LAYERS)
            .dst_offsets([
                vk::Offset3D { x: 4, y: 1, z: 0 },
                vk::Offset3D { x: 0, y: 2, z: 1 },
            ])];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_copy_buffer_to_image(
                commands,
                texels.buffer,
                source.image,
                GENERAL,
                &upload,
            );
            device.cmd_blit_image(
                commands,
                source.image,
                GENERAL,
                target.image,
                GENERAL,
                &[top],
                vk::Filter::LINEAR,
            );
            let info = vk::BlitImageInfo2::default()
                .src_image(source.image)
                .src_image_layout(GENERAL)
                .dst_image(target.image)
                .dst_image_layout(GENERAL)
                .regions(&bottom)
                .filter(vk::Filter::NEAREST);
            device.cmd_blit_image2(commands, &info);
        }
    });
    let (dark, light) = ([0u8, 0, 0, 255], [200, 100, 40, 255]);
    let expected = [
        dark,
        [50, 25, 10, 255],
        [150, 75, 30, 255],
        light,
        light,
        light,
        dark,
        dark,
    ];
    assert_eq!(gpu.read_image::<[u8; 4]>(target, 4), expected);
    gpu.free_image(source);
    gpu.free_image(target);
    gpu.free_buffer(texels);
}

#[gaurast_runner::test]
fn one_region_copies_depth_and_stencil() {
    let gpu = Gpu::new();
    let make = || {
        let info = shape(vk::Format::D32_SFLOAT_S8_UINT, 4, 2);
        image_of(&gpu, info)
    };
    let (source, target) = (make(), make());
    let both = vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL;
    let layers = |aspect_mask| vk::ImageSubresourceLayers {
        aspect_mask,
        ..COLOR_LAYERS
    };
    let depths = gpu.buffer(32, MAPPABLE);
    let stencils = gpu.buffer(8, MAPPABLE);
    gpu.run(|device, commands| {
        let range = vk::ImageSubresourceRange {
            aspect_mask: both,
            ..COLOR
        };
        let clear = |image: Image, depth, stencil| {
            let value = vk::ClearDepthStencilValue { depth, stencil };
            // SAFETY: see the crate.
            unsafe {
                device.cmd_clear_depth_stencil_image(
                    commands,
                    image.image,
                    GENERAL,
                    &value,
                    &[range],
                );
            }
        };
        clear(source, 0.25, 7);
        clear(target, 1.0, 0);
        let copy = vk::ImageCopy::default()
            .src_subresource(layers(both))
            .dst_subresource(layers(both))
            .dst_offset(vk::Offset3D { x: 2, y: 1, z: 0 })
            .extent(extent(2, 1, 1));
        let read = |aspect, buffer: crate::gpu::Buffer| {
            let region = [vk::BufferImageCopy::default()
                .image_subresource(layers(aspect))
                .image_extent(extent(4, 2, 1))];
            // SAFETY: see the crate.
            unsafe {
                device.cmd_copy_image_to_buffer(
                    commands,
                    target.image,
                    GENERAL,
                    buffer.buffer,
                    &region,
                );
            }
        };
        // SAFETY: see the crate.
        unsafe {
            device.cmd_copy_image(
                commands,
                source.image,
                GENERAL,
                target.image,
                GENERAL,
                &[copy],
            );
        }
        read(vk::ImageAspectFlags::DEPTH, depths);
        read(vk::ImageAspectFlags::STENCIL, stencils);
    });
    let (far, near) = (1.0, 0.25);
    let expected = [far, far, far, far, far, far, near, near];
    assert_eq!(gpu.read::<f32>(depths), expected);
    assert_eq!(gpu.read::<u8>(stencils), [0, 0, 0, 0, 0, 0, 7, 7]);
    for image in [source, target] {
        gpu.free_image(image);
    }
    for buffer in [depths, stencils] {
        gpu.free_buffer(buffer);
    }
}

#[gaurast_runner::test]
fn slices_become_layers_of_another_format() {
    let gpu = Gpu::new();
    let solid = vk::ImageCreateInfo {
        image_type: vk::ImageType::TYPE_3D,
        extent: extent(2, 1, 3),
        ..shape(FORMAT, 2, 1)
    };
    let stack = vk::ImageCreateInfo {
        array_layers: 4,
        ..shape(vk::Format::R32_UINT, 2, 1)
    };
    let (source, target) = (image_of(&gpu, solid), image_of(&gpu, stack));
    let texels: [u32; 6] = [0x0403_0201, 5, 6, 7, 8, u32::MAX];
    let data = gpu.buffer_of(&texels);
    let out = gpu.buffer(32, MAPPABLE);
    let layers = |base_array_layer, layer_count| vk::ImageSubresourceLayers {
        base_array_layer,
        layer_count,
        ..COLOR_LAYERS
    };
    gpu.run(|device, commands| {
        let upload = [vk::BufferImageCopy::default()
            .image_subresource(COLOR_LAYERS)
            .image_extent(extent(2, 1, 3))];
        let copy = [vk::ImageCopy::default()
            .src_subresource(COLOR_LAYERS)
            .src_offset(vk::Offset3D { x: 0, y: 0, z: 1 })
            .dst_subresource(layers(2, 2))
            .extent(extent(2, 1, 2))];
        let download = [vk::BufferImageCopy::default()
            .image_subresource(layers(0, vk::REMAINING_ARRAY_LAYERS))
            .image_extent(extent(2, 1, 1))];
        let zero = vk::ClearColorValue { uint32: [9; 4] };
        let all = vk::ImageSubresourceRange {
            layer_count: vk::REMAINING_ARRAY_LAYERS,
            ..COLOR
        };
        // SAFETY: see the crate.
        unsafe {
            device.cmd_clear_color_image(commands, target.image, GENERAL, &zero, &[all]);
            device.cmd_copy_buffer_to_image(commands, data.buffer, source.image, GENERAL, &upload);
            let (from, to) = (source.image, target.image);
            device.cmd_copy_image(commands, from, GENERAL, to, GENERAL, &copy);
            device.cmd_copy_image_to_buffer(commands, to, GENERAL, out.buffer, &download);
        }
    });
    assert_eq!(gpu.read::<u32>(out), [9, 9, 9, 9, 6, 7, 8, u32::MAX]);
    for image in [source, target] {
        gpu.free_image(image);
    }
    for buffer in [data, out] {
        gpu.free_buffer(buffer);
    }
}

#[gaurast_runner::test]
fn images_that_do_not_fit_each_other_fail_the_recording() {
    let gpu = Gpu::new();
    let one = gpu.image(FORMAT, 4, 4);
    let integers = gpu.image(vk::Format::R8G8B8A8_UINT, 4, 4);
    let many = image_of(&gpu, sampled_four_times(4, 4));
    let refused = |what: &dyn Fn(&ash::Device, vk::CommandBuffer)| {
        let recorded = gpu.record(|device, commands| what(device, commands));
        recorded.unwrap_err() == vk::Result::ERROR_VALIDATION_FAILED_EXT
    };
    let whole = [vk::Offset3D::default(), vk::Offset3D { x: 4, y: 4, z: 1 }];
    let blit = |from: Image, to: Image| {
        move |device: &ash::Device, commands| {
            let region = vk::ImageBlit::default()
                .src_subresource(COLOR_LAYERS)
                .src_offsets(whole)
                .dst_subresource(COLOR_LAYERS)
                .dst_offsets(whole);
            let (from, to, filter) = (from.image, to.image, vk::Filter::NEAREST);
            // SAFETY: see the crate.
            unsafe {
                device.cmd_blit_image(commands, from, GENERAL, to, GENERAL, &[region], filter);
            }
        }
    };
    let resolve = |from: Image, to: Image| {
        move |device: &ash::Device, commands| {
            let region = vk::ImageResolve::default()
                .src_subresource(COLOR_LAYERS)
                .dst_subresource(COLOR_LAYERS)
                .extent(extent(4, 4, 1));
            let (from, to) = (from.image, to.image);
            // SAFETY: see the crate.
            unsafe { device.cmd_resolve_image(commands, from, GENERAL, to, GENERAL, &[region]) };
        }
    };
    let copy = |from: Image, to: Image| {
        move |device: &ash::Device, commands| {
            let region = vk::ImageCopy::default()
                .src_subresource(COLOR_LAYERS)
                .dst_subresource(COLOR_LAYERS)
                .extent(extent(4, 4, 1));
            let (from, to) = (from.image, to.image);
            // SAFETY: see the crate.
            unsafe { device.cmd_copy_image(commands, from, GENERAL, to, GENERAL, &[region]) };
        }
    };
    assert!(refused(&blit(one, integers)));
    assert!(refused(&blit(many, one)));
    assert!(refused(&blit(one, many)));
    assert!(refused(&resolve(one, many)));
    assert!(refused(&resolve(many, integers)));
    assert!(refused(&copy(one, many)));
    for image in [one, integers, many] {
        gpu.free_image(image);
    }
}
