//! Copies, blits and resolves between images: samples, aspects, layers and slices, and invalid uses that are refused.

use ash::vk;
use gaurast_testkit::devices::{COLOR, COLOR_LAYERS, image, open};
use gaurast_testkit::{Buffer, Image, ImageOptions};

const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const X4: vk::SampleCountFlags = vk::SampleCountFlags::TYPE_4;

/// Options of a 2D image that is only copied.
fn shape(format: vk::Format, width: u32, height: u32) -> ImageOptions {
    ImageOptions::new(format, [width, height], vk::ImageUsageFlags::empty())
}

fn sampled_four_times(width: u32, height: u32) -> ImageOptions {
    ImageOptions {
        samples: X4.as_raw(),
        usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_DST,
        ..shape(FORMAT, width, height)
    }
}

/// The create info of a square 2D image of four samples.
fn create_info(size: u32) -> vk::ImageCreateInfo<'static> {
    vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(FORMAT)
        .extent(extent(size, size, 1))
        .mip_levels(1)
        .array_layers(1)
        .samples(X4)
        .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
}

fn clear(device: &ash::Device, commands: vk::CommandBuffer, image: &Image, float32: [f32; 4]) {
    let value = vk::ClearColorValue { float32 };
    // SAFETY: see the crate.
    unsafe { device.cmd_clear_color_image(commands, image.raw, GENERAL, &value, &[COLOR]) };
}

fn extent(width: u32, height: u32, depth: u32) -> vk::Extent3D {
    vk::Extent3D { width, height, depth }
}

const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];

#[gaurast_runner::test]
fn samples_are_cleared_copied_and_resolved() {
    let gpu = open();
    let many = [(); 2].map(|()| Image::new(&gpu, &sampled_four_times(6, 4)));
    let one = image(&gpu, FORMAT, [6, 4]);
    let [first, second] = many;
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        clear(device, commands, &first, RED);
        clear(device, commands, &second, BLUE);
        clear(device, commands, &one, [0.0; 4]);
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
            device.cmd_copy_image(commands, first.raw, GENERAL, second.raw, GENERAL, &[copy]);
            device.cmd_resolve_image(commands, second.raw, GENERAL, one.raw, GENERAL, &[left]);
            let info = vk::ResolveImageInfo2::default()
                .src_image(second.raw)
                .src_image_layout(GENERAL)
                .dst_image(one.raw)
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
    assert_eq!(one.colors::<[u8; 4]>(), expected);
}

#[gaurast_runner::test]
fn memory_holds_every_sample() {
    let gpu = open();
    let size = |samples| {
        let info = create_info(64).samples(samples);
        // SAFETY: see the crate.
        unsafe {
            let image = gpu.device().create_image(&info, None).unwrap();
            let size = gpu.device().get_image_memory_requirements(image).size;
            gpu.device().destroy_image(image, None);
            size
        }
    };
    assert!(size(X4) >= 4 * size(vk::SampleCountFlags::TYPE_1));
    let refused = [
        create_info(8).samples(vk::SampleCountFlags::TYPE_2),
        create_info(8).flags(vk::ImageCreateFlags::CUBE_COMPATIBLE).array_layers(6),
        create_info(8).tiling(vk::ImageTiling::LINEAR),
    ];
    for info in refused {
        // SAFETY: see the crate.
        let image = unsafe { gpu.device().create_image(&info, None) };
        assert!(image.is_err(), "{info:?}");
    }
}

#[gaurast_runner::test]
fn blits_scale_through_both_entry_points() {
    let gpu = open();
    let source = image(&gpu, FORMAT, [2, 1]);
    let target = image(&gpu, FORMAT, [4, 2]);
    let texels = Buffer::of(&gpu, &[[0u8, 0, 0, 255], [200, 100, 40, 255]]);
    let corner = |x, y| vk::Offset3D { x, y, z: 1 };
    let zero = vk::Offset3D::default();
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let upload = [vk::BufferImageCopy::default().image_subresource(COLOR_LAYERS).image_extent(extent(2, 1, 1))];
        let top = vk::ImageBlit::default()
            .src_subresource(COLOR_LAYERS)
            .src_offsets([zero, corner(2, 1)])
            .dst_subresource(COLOR_LAYERS)
            .dst_offsets([zero, corner(4, 1)]);
        let bottom = [vk::ImageBlit2::default()
            .src_subresource(COLOR_LAYERS)
            .src_offsets([zero, corner(2, 1)])
            .dst_subresource(COLOR_LAYERS)
            .dst_offsets([vk::Offset3D { x: 4, y: 1, z: 0 }, vk::Offset3D { x: 0, y: 2, z: 1 }])];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_copy_buffer_to_image(commands, texels.raw, source.raw, GENERAL, &upload);
            device.cmd_blit_image(commands, source.raw, GENERAL, target.raw, GENERAL, &[top], vk::Filter::LINEAR);
            let info = vk::BlitImageInfo2::default()
                .src_image(source.raw)
                .src_image_layout(GENERAL)
                .dst_image(target.raw)
                .dst_image_layout(GENERAL)
                .regions(&bottom)
                .filter(vk::Filter::NEAREST);
            device.cmd_blit_image2(commands, &info);
        }
    });
    let (dark, light) = ([0u8, 0, 0, 255], [200, 100, 40, 255]);
    let expected = [dark, [50, 25, 10, 255], [150, 75, 30, 255], light, light, light, dark, dark];
    assert_eq!(target.colors::<[u8; 4]>(), expected);
}

#[gaurast_runner::test]
fn one_region_copies_depth_and_stencil() {
    let gpu = open();
    let make = || {
        let info = shape(vk::Format::D32_SFLOAT_S8_UINT, 4, 2);
        Image::new(&gpu, &info)
    };
    let (source, target) = (make(), make());
    let both = vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL;
    let layers = |aspect_mask| vk::ImageSubresourceLayers { aspect_mask, ..COLOR_LAYERS };
    let depths = Buffer::new(&gpu, 32);
    let stencils = Buffer::new(&gpu, 8);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let range = vk::ImageSubresourceRange { aspect_mask: both, ..COLOR };
        let clear = |image: &Image, depth, stencil| {
            let value = vk::ClearDepthStencilValue { depth, stencil };
            // SAFETY: see the crate.
            unsafe {
                device.cmd_clear_depth_stencil_image(commands, image.raw, GENERAL, &value, &[range]);
            }
        };
        clear(&source, 0.25, 7);
        clear(&target, 1.0, 0);
        let copy = vk::ImageCopy::default()
            .src_subresource(layers(both))
            .dst_subresource(layers(both))
            .dst_offset(vk::Offset3D { x: 2, y: 1, z: 0 })
            .extent(extent(2, 1, 1));
        let read = |aspect, buffer: &Buffer| {
            let region =
                [vk::BufferImageCopy::default().image_subresource(layers(aspect)).image_extent(extent(4, 2, 1))];
            // SAFETY: see the crate.
            unsafe {
                device.cmd_copy_image_to_buffer(commands, target.raw, GENERAL, buffer.raw, &region);
            }
        };
        // SAFETY: see the crate.
        unsafe {
            device.cmd_copy_image(commands, source.raw, GENERAL, target.raw, GENERAL, &[copy]);
        }
        read(vk::ImageAspectFlags::DEPTH, &depths);
        read(vk::ImageAspectFlags::STENCIL, &stencils);
    });
    let (far, near) = (1.0, 0.25);
    let expected = [far, far, far, far, far, far, near, near];
    assert_eq!(depths.values::<f32>(), expected);
    assert_eq!(stencils.values::<u8>(), [0, 0, 0, 0, 0, 0, 7, 7]);
}

#[gaurast_runner::test]
fn slices_become_layers_of_another_format() {
    let gpu = open();
    let solid = ImageOptions { view: vk::ImageViewType::TYPE_3D, size: [2, 1, 3], ..shape(FORMAT, 2, 1) };
    let stack = ImageOptions { layers: 4, ..shape(vk::Format::R32_UINT, 2, 1) };
    let (source, target) = (Image::new(&gpu, &solid), Image::new(&gpu, &stack));
    let texels: [u32; 6] = [0x0403_0201, 5, 6, 7, 8, u32::MAX];
    let data = Buffer::of(&gpu, &texels);
    let out = Buffer::new(&gpu, 32);
    let layers =
        |base_array_layer, layer_count| vk::ImageSubresourceLayers { base_array_layer, layer_count, ..COLOR_LAYERS };
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let upload = [vk::BufferImageCopy::default().image_subresource(COLOR_LAYERS).image_extent(extent(2, 1, 3))];
        let copy = [vk::ImageCopy::default()
            .src_subresource(COLOR_LAYERS)
            .src_offset(vk::Offset3D { x: 0, y: 0, z: 1 })
            .dst_subresource(layers(2, 2))
            .extent(extent(2, 1, 2))];
        let download = [vk::BufferImageCopy::default()
            .image_subresource(layers(0, vk::REMAINING_ARRAY_LAYERS))
            .image_extent(extent(2, 1, 1))];
        let zero = vk::ClearColorValue { uint32: [9; 4] };
        let all = vk::ImageSubresourceRange { layer_count: vk::REMAINING_ARRAY_LAYERS, ..COLOR };
        // SAFETY: see the crate.
        unsafe {
            device.cmd_clear_color_image(commands, target.raw, GENERAL, &zero, &[all]);
            device.cmd_copy_buffer_to_image(commands, data.raw, source.raw, GENERAL, &upload);
            let (from, to) = (source.raw, target.raw);
            device.cmd_copy_image(commands, from, GENERAL, to, GENERAL, &copy);
            device.cmd_copy_image_to_buffer(commands, to, GENERAL, out.raw, &download);
        }
    });
    assert_eq!(out.values::<u32>(), [9, 9, 9, 9, 6, 7, 8, u32::MAX]);
}

/// A pair of columns that share chroma in one plane is a texel of twice the size.
#[gaurast_runner::test]
fn pairs_of_columns_are_copied_as_texels() {
    let gpu = open();
    let usage = vk::ImageUsageFlags::TRANSFER_SRC;
    let [first, second] =
        [(); 2].map(|()| Image::new(&gpu, &ImageOptions::new(vk::Format::R8G8B8A8_UNORM, [4, 3], usage)));
    let pairs = Image::new(&gpu, &ImageOptions::new(vk::Format::G8B8G8R8_422_UNORM, [8, 3], usage));
    let texels: Vec<u8> = (1..=48).collect();
    first.upload(vk::ImageAspectFlags::COLOR, &texels);
    second.upload(vk::ImageAspectFlags::COLOR, &[0; 48]);
    let copy = |source: &Image, target: &Image, from: i32, to: i32, width: u32| {
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            let region = [vk::ImageCopy::default()
                .src_subresource(COLOR_LAYERS)
                .src_offset(vk::Offset3D { x: from, y: 0, z: 0 })
                .dst_subresource(COLOR_LAYERS)
                .dst_offset(vk::Offset3D { x: to, y: 0, z: 0 })
                .extent(vk::Extent3D { width, height: 3, depth: 1 })];
            // SAFETY: see the crate.
            unsafe { device.cmd_copy_image(commands, source.raw, GENERAL, target.raw, GENERAL, &region) };
        });
    };
    copy(&first, &pairs, 0, 0, 4);
    // Three of four pairs, one further to the right.
    copy(&pairs, &second, 0, 1, 6);
    let found = second.download(vk::ImageAspectFlags::COLOR);
    for (row, (found, expected)) in found.chunks(16).zip(texels.chunks(16)).enumerate() {
        assert!(found[..4] == [0; 4] && found[4..] == expected[..12], "{row}: {found:?}");
    }
    // A buffer has the columns one after the other.
    let buffer = Buffer::new(&gpu, 48);
    gpu.run(|recording| recording.download(&pairs, &buffer, &[pairs.region(vk::ImageAspectFlags::COLOR, 0)]));
    assert_eq!(buffer.read()[..48], texels);
}

/// Breaks VUID-vkCmdBlitImage-srcImage-00230, VUID-vkCmdBlitImage-srcImage-00233,
/// VUID-vkCmdBlitImage-dstImage-00234, VUID-vkCmdResolveImage-srcImage-00257,
/// VUID-vkCmdResolveImage-dstImage-00259, VUID-vkCmdResolveImage-srcImage-01386 and
/// VUID-vkCmdCopyImage-srcImage-00136.
#[gaurast_runner::test]
fn images_that_do_not_fit_each_other_fail_the_recording() {
    let gpu = open();
    let one = image(&gpu, FORMAT, [4, 4]);
    let integers = image(&gpu, vk::Format::R8G8B8A8_UINT, [4, 4]);
    let many = Image::new(&gpu, &sampled_four_times(4, 4));
    let refused = |what: &dyn Fn(&ash::Device, vk::CommandBuffer)| {
        let recorded = gpu.try_record(|recording| {
            let (device, commands) = recording.raw();
            what(device, commands);
        });
        recorded.unwrap_err() == vk::Result::ERROR_VALIDATION_FAILED_EXT
    };
    let whole = [vk::Offset3D::default(), vk::Offset3D { x: 4, y: 4, z: 1 }];
    let blit = |from: vk::Image, to: vk::Image| {
        move |device: &ash::Device, commands| {
            let region = vk::ImageBlit::default()
                .src_subresource(COLOR_LAYERS)
                .src_offsets(whole)
                .dst_subresource(COLOR_LAYERS)
                .dst_offsets(whole);
            let filter = vk::Filter::NEAREST;
            // SAFETY: see the crate.
            unsafe {
                device.cmd_blit_image(commands, from, GENERAL, to, GENERAL, &[region], filter);
            }
        }
    };
    let resolve = |from: vk::Image, to: vk::Image| {
        move |device: &ash::Device, commands| {
            let region = vk::ImageResolve::default()
                .src_subresource(COLOR_LAYERS)
                .dst_subresource(COLOR_LAYERS)
                .extent(extent(4, 4, 1));
            // SAFETY: see the crate.
            unsafe { device.cmd_resolve_image(commands, from, GENERAL, to, GENERAL, &[region]) };
        }
    };
    let copy = |from: vk::Image, to: vk::Image| {
        move |device: &ash::Device, commands| {
            let region = vk::ImageCopy::default()
                .src_subresource(COLOR_LAYERS)
                .dst_subresource(COLOR_LAYERS)
                .extent(extent(4, 4, 1));
            // SAFETY: see the crate.
            unsafe { device.cmd_copy_image(commands, from, GENERAL, to, GENERAL, &[region]) };
        }
    };
    assert!(refused(&blit(one.raw, integers.raw)));
    assert!(refused(&blit(many.raw, one.raw)));
    assert!(refused(&blit(one.raw, many.raw)));
    assert!(refused(&resolve(one.raw, many.raw)));
    assert!(refused(&resolve(many.raw, integers.raw)));
    assert!(refused(&copy(one.raw, many.raw)));
}
