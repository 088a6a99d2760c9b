//! Render passes: load and store operations, clears, subpasses, framebuffers.

use ash::vk;
use gaurast_testkit::devices::{DEVICE_ONLY, allocate, image, open};
use gaurast_testkit::scene::{area, extent};
use gaurast_testkit::{Gpu, Image};

const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const GREEN: [u8; 4] = [0, 255, 0, 255];
const WHITE: [u8; 4] = [255; 4];

fn clear_value(float32: [f32; 4]) -> vk::ClearValue {
    vk::ClearValue { color: vk::ClearColorValue { float32 } }
}

fn attachment(load: vk::AttachmentLoadOp) -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(FORMAT)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(load)
        .store_op(vk::AttachmentStoreOp::STORE)
        .initial_layout(vk::ImageLayout::GENERAL)
        .final_layout(vk::ImageLayout::GENERAL)
}

fn reference(attachment: u32) -> vk::AttachmentReference {
    vk::AttachmentReference { attachment, layout: vk::ImageLayout::GENERAL }
}

/// A clear of colour attachment 0 inside a pass.
fn clear_attachment(device: &ash::Device, commands: vk::CommandBuffer, value: [f32; 4], rect: vk::Rect2D) {
    let attachments = [vk::ClearAttachment {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        color_attachment: 0,
        clear_value: clear_value(value),
    }];
    let rects = [vk::ClearRect { rect, base_array_layer: 0, layer_count: 1 }];
    // SAFETY: see the crate.
    unsafe { device.cmd_clear_attachments(commands, &attachments, &rects) };
}

fn corner() -> vk::Rect2D {
    vk::Rect2D { offset: vk::Offset2D { x: 1, y: 0 }, extent: vk::Extent2D { width: 2, height: 1 } }
}

fn framebuffer(gpu: &Gpu, pass: vk::RenderPass, images: &[&Image]) -> vk::Framebuffer {
    let views: Vec<_> = images.iter().map(|image| image.view).collect();
    let extent = extent(images[0]);
    let info = vk::FramebufferCreateInfo::default()
        .render_pass(pass)
        .attachments(&views)
        .width(extent.width)
        .height(extent.height)
        .layers(1);
    // SAFETY: see the crate.
    unsafe { gpu.device().create_framebuffer(&info, None).unwrap() }
}

#[gaurast_runner::test]
fn a_pass_clears_and_stores() {
    let gpu = open();
    let image = image(&gpu, FORMAT, [4, 2]);
    let attachments = [attachment(vk::AttachmentLoadOp::CLEAR)];
    let references = [reference(0)];
    let subpasses = [vk::SubpassDescription::default().color_attachments(&references)];
    let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
    // SAFETY: see the crate.
    unsafe {
        let pass = gpu.device().create_render_pass(&info, None).unwrap();
        let framebuffer = framebuffer(&gpu, pass, &[&image]);
        let values = [clear_value([0.0, 1.0, 0.0, 1.0])];
        let commands = gpu
            .try_record(|recording| {
                let (device, commands) = recording.raw();
                let begin = vk::RenderPassBeginInfo::default()
                    .render_pass(pass)
                    .framebuffer(framebuffer)
                    .render_area(area(&image))
                    .clear_values(&values);
                let inline = vk::SubpassContents::INLINE;
                device.cmd_begin_render_pass(commands, &begin, inline);
                clear_attachment(device, commands, [1.0; 4], corner());
                device.cmd_end_render_pass(commands);
            })
            .unwrap();
        commands.submit();
        gpu.device().destroy_render_pass(pass, None);
        gpu.device().destroy_framebuffer(framebuffer, None);
    }
    let mut expected = [GREEN; 8];
    expected[1..3].fill(WHITE);
    assert_eq!(image.colors::<[u8; 4]>(), expected);
}

#[gaurast_runner::test]
fn subpasses_follow_each_other() {
    let gpu = open();
    let images = [image(&gpu, FORMAT, [4, 2]), image(&gpu, FORMAT, [4, 2])];
    let attachments = [attachment(vk::AttachmentLoadOp::CLEAR), attachment(vk::AttachmentLoadOp::CLEAR)];
    let references = [[reference(0)], [reference(1)], [reference(0)]];
    let subpasses =
        references.each_ref().map(|references| vk::SubpassDescription::default().color_attachments(references));
    let writes = vk::AccessFlags::COLOR_ATTACHMENT_WRITE;
    let stage = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT;
    let dependencies = [vk::SubpassDependency::default()
        .src_subpass(0)
        .dst_subpass(2)
        .src_stage_mask(stage)
        .dst_stage_mask(stage)
        .src_access_mask(writes)
        .dst_access_mask(writes)];
    let info =
        vk::RenderPassCreateInfo::default().dependencies(&dependencies).attachments(&attachments).subpasses(&subpasses);
    // SAFETY: see the crate.
    unsafe {
        let pass = gpu.device().create_render_pass(&info, None).unwrap();
        let framebuffer = framebuffer(&gpu, pass, &[&images[0], &images[1]]);
        let values = [clear_value([0.0, 1.0, 0.0, 1.0]), clear_value([1.0; 4])];
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(pass)
            .framebuffer(framebuffer)
            .render_area(area(&images[0]))
            .clear_values(&values);
        let inline = vk::SubpassContents::INLINE;
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            device.cmd_begin_render_pass(commands, &begin, inline);
            device.cmd_next_subpass(commands, inline);
            clear_attachment(device, commands, [0.0, 1.0, 0.0, 1.0], corner());
            device.cmd_next_subpass(commands, inline);
            clear_attachment(device, commands, [1.0; 4], corner());
            device.cmd_end_render_pass(commands);
        });
        let recorded = gpu.try_record(|recording| {
            let (device, commands) = recording.raw();
            device.cmd_begin_render_pass(commands, &begin, inline);
            for _ in 0..3 {
                device.cmd_next_subpass(commands, inline);
            }
        });
        assert!(recorded.is_err(), "there are three subpasses");
        gpu.device().destroy_framebuffer(framebuffer, None);
        gpu.device().destroy_render_pass(pass, None);
    }
    let mut expected = [GREEN; 8];
    expected[1..3].fill(WHITE);
    assert_eq!(images[0].colors::<[u8; 4]>(), expected);
    let mut expected = [WHITE; 8];
    expected[1..3].fill(GREEN);
    assert_eq!(images[1].colors::<[u8; 4]>(), expected);
}

#[gaurast_runner::test]
fn passes_load_what_is_there_within_their_area() {
    let gpu = open();
    let image = image(&gpu, FORMAT, [4, 2]);
    let begin = |device: &ash::Device, commands, load, rect, flags| {
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(image.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(load)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(clear_value([1.0; 4]))];
        let info =
            vk::RenderingInfo::default().flags(flags).render_area(rect).layer_count(1).color_attachments(&attachments);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    };
    let (clear, load) = (vk::AttachmentLoadOp::CLEAR, vk::AttachmentLoadOp::LOAD);
    let none = vk::RenderingFlags::empty();
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        // SAFETY: see the crate.
        let end = || unsafe { device.cmd_end_rendering(commands) };
        begin(device, commands, clear, area(&image), none);
        end();
        begin(device, commands, load, area(&image), none);
        clear_attachment(device, commands, [0.0, 1.0, 0.0, 1.0], corner());
        end();
        // Only the area is cleared; resuming the pass does not clear again.
        let left = vk::Rect2D { extent: vk::Extent2D { width: 2, height: 2 }, ..Default::default() };
        begin(device, commands, clear, left, vk::RenderingFlags::SUSPENDING);
        clear_attachment(device, commands, [0.0, 1.0, 0.0, 1.0], left);
        end();
        begin(device, commands, clear, left, vk::RenderingFlags::RESUMING);
        end();
    });
    let [g, w] = [GREEN, WHITE];
    let expected = [g, g, g, w, g, g, w, w];
    assert_eq!(image.colors::<[u8; 4]>(), expected);
}

#[gaurast_runner::test]
fn what_a_subpass_only_reads_is_cleared_for_it() {
    let gpu = open();
    let images = [image(&gpu, FORMAT, [4, 2]), image(&gpu, FORMAT, [4, 2])];
    let attachments = [attachment(vk::AttachmentLoadOp::CLEAR); 2];
    let (written, read) = ([reference(0)], [reference(1)]);
    let subpasses = [vk::SubpassDescription::default().color_attachments(&written).input_attachments(&read)];
    let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
    // SAFETY: see the crate.
    unsafe {
        let pass = gpu.device().create_render_pass(&info, None).unwrap();
        let framebuffer = framebuffer(&gpu, pass, &[&images[0], &images[1]]);
        let values = [clear_value([0.0, 1.0, 0.0, 1.0]), clear_value([1.0; 4])];
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            let begin = vk::RenderPassBeginInfo::default()
                .render_pass(pass)
                .framebuffer(framebuffer)
                .render_area(area(&images[0]))
                .clear_values(&values);
            device.cmd_begin_render_pass(commands, &begin, vk::SubpassContents::INLINE);
            device.cmd_end_render_pass(commands);
        });
        gpu.device().destroy_framebuffer(framebuffer, None);
        gpu.device().destroy_render_pass(pass, None);
    }
    for (image, expected) in images.into_iter().zip([GREEN, WHITE]) {
        assert_eq!(image.colors::<[u8; 4]>(), [expected; 8]);
    }
}

#[gaurast_runner::test]
fn slices_of_solid_images_are_rendered_to() {
    let gpu = open();
    let out = image(&gpu, FORMAT, [4, 2]);
    let info = vk::ImageCreateInfo::default()
        .flags(vk::ImageCreateFlags::TYPE_2D_ARRAY_COMPATIBLE)
        .image_type(vk::ImageType::TYPE_3D)
        .format(FORMAT)
        .extent(vk::Extent3D { width: 4, height: 2, depth: 3 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC);
    let general = vk::ImageLayout::GENERAL;
    // SAFETY: see the crate.
    unsafe {
        let device = gpu.device();
        let solid = device.create_image(&info, None).unwrap();
        let requirements = device.get_image_memory_requirements(solid);
        let memory = allocate(&gpu, requirements.size, DEVICE_ONLY);
        device.bind_image_memory(solid, memory, 0).unwrap();
        let slices = |first, count| {
            let info = vk::ImageViewCreateInfo::default()
                .image(solid)
                .view_type(vk::ImageViewType::TYPE_2D_ARRAY)
                .format(FORMAT)
                .subresource_range(vk::ImageSubresourceRange {
                    base_array_layer: first,
                    layer_count: count,
                    ..gaurast_testkit::devices::COLOR
                });
            device.create_image_view(&info, None)
        };
        assert!(slices(2, 2).is_err(), "there are three slices");
        let view = slices(1, 2).unwrap();
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            let attachments = [vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(general)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(clear_value([0.0, 1.0, 0.0, 1.0]))];
            let info =
                vk::RenderingInfo::default().render_area(area(&out)).layer_count(2).color_attachments(&attachments);
            device.cmd_begin_rendering(commands, &info);
            device.cmd_end_rendering(commands);
        });
        for (slice, expected) in [[0; 4], GREEN, GREEN].into_iter().enumerate() {
            gpu.run(|recording| {
                let (device, commands) = recording.raw();
                let copy = vk::ImageCopy::default()
                    .src_subresource(gaurast_testkit::devices::COLOR_LAYERS)
                    .src_offset(vk::Offset3D { z: slice as i32, ..Default::default() })
                    .dst_subresource(gaurast_testkit::devices::COLOR_LAYERS)
                    .extent(extent(&out).into());
                device.cmd_copy_image(commands, solid, general, out.raw, general, &[copy]);
            });
            assert_eq!(out.colors::<[u8; 4]>(), [expected; 8], "{slice}");
        }
        device.destroy_image_view(view, None);
        device.destroy_image(solid, None);
        device.free_memory(memory, None);
    }
}
