//! Copies and clears.

use ash::vk;
use gaurast_testkit::devices::{COLOR, COLOR_LAYERS, image, open};
use gaurast_testkit::scene::extent;
use gaurast_testkit::{Buffer, Image, ImageOptions};

const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;

#[gaurast_runner::test]
fn buffers_are_filled_updated_and_copied() {
    let gpu = open();
    let source = Buffer::new(&gpu, 32);
    let target = Buffer::new(&gpu, 32);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let regions =
            [vk::BufferCopy::default().dst_offset(16).size(8), vk::BufferCopy::default().src_offset(12).size(4)];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_fill_buffer(commands, source.raw, 0, vk::WHOLE_SIZE, 0x0101_0101);
            // The command copies the data when it is recorded.
            let mut data = [5u8, 6, 7, 8];
            device.cmd_update_buffer(commands, source.raw, 4, &data);
            data.fill(0);
            device.cmd_copy_buffer(commands, source.raw, target.raw, &regions);
            let region2 = [vk::BufferCopy2::default().src_offset(4).dst_offset(28).size(4)];
            let copy2 = vk::CopyBufferInfo2::default().src_buffer(source.raw).dst_buffer(target.raw).regions(&region2);
            device.cmd_copy_buffer2(commands, &copy2);
        }
    });
    let mut expected = [0u8; 32];
    expected[16..20].fill(1);
    expected[20..24].copy_from_slice(&[5, 6, 7, 8]);
    expected[..4].fill(1);
    expected[28..].copy_from_slice(&[5, 6, 7, 8]);
    assert_eq!(target.values::<u8>(), expected);
}

#[gaurast_runner::test]
fn images_are_cleared_and_copied_there_and_back() {
    let gpu = open();
    let first = image(&gpu, vk::Format::R8G8B8A8_UNORM, [7, 5]);
    let second = image(&gpu, vk::Format::R8G8B8A8_UNORM, [7, 5]);
    let texels = Buffer::of(&gpu, &[[9u8, 8, 7, 6], [1, 2, 3, 4]]);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let clear = vk::ClearColorValue { float32: [1.0, 0.0, 0.2, 1.0] };
        let to_image = [vk::BufferImageCopy::default()
            .image_subresource(COLOR_LAYERS)
            .image_offset(vk::Offset3D { x: 3, y: 4, z: 0 })
            .image_extent(vk::Extent3D { width: 2, height: 1, depth: 1 })];
        let between = [vk::ImageCopy::default()
            .src_subresource(COLOR_LAYERS)
            .src_offset(vk::Offset3D { x: 2, y: 3, z: 0 })
            .dst_subresource(COLOR_LAYERS)
            .extent(vk::Extent3D { width: 3, height: 2, depth: 1 })];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_clear_color_image(commands, first.raw, GENERAL, &clear, &[COLOR]);
            device.cmd_copy_buffer_to_image(commands, texels.raw, first.raw, GENERAL, &to_image);
            device.cmd_pipeline_barrier(
                commands,
                vk::PipelineStageFlags::TRANSFER,
                vk::PipelineStageFlags::TRANSFER,
                vk::DependencyFlags::empty(),
                &[],
                &[],
                &[],
            );
            device.cmd_copy_image(commands, first.raw, GENERAL, second.raw, GENERAL, &between);
        }
    });
    let cleared = [255u8, 0, 51, 255];
    let mut expected = [[0u8; 4]; 35];
    for y in 0..2 {
        expected[y * 7..y * 7 + 3].fill(cleared);
    }
    expected[7 + 1] = [9, 8, 7, 6];
    expected[7 + 2] = [1, 2, 3, 4];
    assert_eq!(second.colors::<[u8; 4]>(), expected);
}

/// Scaled formats are cleared to integers, which are clamped.
#[gaurast_runner::test]
fn scaled_images_are_cleared_to_integers() {
    let gpu = open();
    let usage = vk::ImageUsageFlags::TRANSFER_SRC;
    for (format, clear, expected) in [
        (vk::Format::R8G8_USCALED, vk::ClearColorValue { uint32: [7, 300, 0, 0] }, vec![7u8, 255]),
        (vk::Format::R8G8_SSCALED, vk::ClearColorValue { int32: [-3, -200, 0, 0] }, vec![0xFD, 0x80]),
        (vk::Format::R16_USCALED, vk::ClearColorValue { uint32: [0xABCD, 0, 0, 0] }, vec![0xCD, 0xAB]),
    ] {
        let image = Image::new(&gpu, &ImageOptions::new(format, [1, 1], usage));
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            // SAFETY: see the crate.
            unsafe { device.cmd_clear_color_image(commands, image.raw, GENERAL, &clear, &[COLOR]) };
        });
        assert_eq!(image.download(vk::ImageAspectFlags::COLOR), expected, "{format:?}");
    }
}

#[gaurast_runner::test]
fn depth_images_are_cleared() {
    let gpu = open();
    let image = image(&gpu, vk::Format::D32_SFLOAT, [4, 4]);
    let buffer = Buffer::new(&gpu, 64);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let value = vk::ClearDepthStencilValue { depth: 0.625, stencil: 0 };
        let depth = vk::ImageAspectFlags::DEPTH;
        let range = vk::ImageSubresourceRange {
            aspect_mask: depth,
            level_count: vk::REMAINING_MIP_LEVELS,
            layer_count: vk::REMAINING_ARRAY_LAYERS,
            ..COLOR
        };
        let region = [vk::BufferImageCopy::default()
            .image_subresource(vk::ImageSubresourceLayers { aspect_mask: depth, ..COLOR_LAYERS })
            .image_extent(extent(&image).into())];
        // SAFETY: see the crate.
        unsafe {
            device.cmd_clear_depth_stencil_image(commands, image.raw, GENERAL, &value, &[range]);
            device.cmd_copy_image_to_buffer(commands, image.raw, GENERAL, buffer.raw, &region);
        }
    });
    assert_eq!(buffer.values::<f32>(), [0.625; 16]);
}

/// Breaks VUID-vkCmdCopyBuffer-srcOffset-00113, VUID-vkCmdCopyBuffer-dstOffset-00114,
/// VUID-vkCmdCopyBuffer-size-00115 and VUID-vkCmdCopyBuffer-size-00116.
#[gaurast_runner::test]
fn a_copy_outside_its_buffer_fails_the_recording() {
    let gpu = open();
    let source = Buffer::new(&gpu, 16);
    let target = Buffer::new(&gpu, 16);
    for region in [
        vk::BufferCopy::default().size(17),
        vk::BufferCopy::default().src_offset(u64::MAX).size(1),
        vk::BufferCopy::default().dst_offset(16).size(1),
    ] {
        let recorded = gpu.try_record(|recording| {
            let (device, commands) = recording.raw();
            // SAFETY: see the crate.
            unsafe { device.cmd_copy_buffer(commands, source.raw, target.raw, &[region]) };
        });
        assert_eq!(recorded.unwrap_err(), vk::Result::ERROR_VALIDATION_FAILED_EXT);
        let messages = gpu.message_texts().concat();
        assert!(messages.contains("vkCmdCopyBuffer"), "{messages}");
        assert!(messages.contains("vkEndCommandBuffer"), "{messages}");
    }
}

#[gaurast_runner::test]
fn subresources_that_an_image_lacks_fail_the_recording() {
    let gpu = open();
    let image = image(&gpu, vk::Format::R8G8B8A8_UNORM, [4, 4]);
    let ranges = [
        vk::ImageSubresourceRange { base_mip_level: 1, ..COLOR },
        vk::ImageSubresourceRange { layer_count: 2, ..COLOR },
        vk::ImageSubresourceRange { aspect_mask: vk::ImageAspectFlags::DEPTH, ..COLOR },
    ];
    for range in ranges {
        let recorded = gpu.try_record(|recording| {
            let (device, commands) = recording.raw();
            let clear = vk::ClearColorValue::default();
            // SAFETY: see the crate.
            unsafe {
                device.cmd_clear_color_image(commands, image.raw, GENERAL, &clear, &[range]);
            }
        });
        assert!(recorded.is_err(), "{range:?}");
    }
}
