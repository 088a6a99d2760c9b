//! Command buffers' lives.

use crate::gpu::{Gpu, MAPPABLE};
use crate::scene::{
    CENTER, PipelineRequest, Scene, area, assert_close, at, pass_with, premultiplied, set_viewport,
    splat,
};
use ash::vk;

fn fill(gpu: &Gpu, buffer: vk::Buffer, word: u32) -> vk::CommandBuffer {
    gpu.record(|device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_fill_buffer(commands, buffer, 0, 4, word) };
    })
    .unwrap()
}

#[gaurast_runner::test]
fn a_recording_is_submitted_again_and_again() {
    let gpu = Gpu::new();
    let buffer = gpu.buffer(4, MAPPABLE);
    let (one, two) = (fill(&gpu, buffer.buffer, 1), fill(&gpu, buffer.buffer, 2));
    for _ in 0..3 {
        gpu.submit(one);
        assert_eq!(gpu.read::<u32>(buffer), [1]);
        gpu.submit(two);
        assert_eq!(gpu.read::<u32>(buffer), [2]);
    }
    // SAFETY: see the crate.
    unsafe { gpu.device.free_command_buffers(gpu.pool, &[one, two]) };
    gpu.free_buffer(buffer);
}

#[gaurast_runner::test]
fn command_buffers_are_reset_alone_or_with_their_pool() {
    let gpu = Gpu::new();
    let device = &gpu.device;
    let buffer = gpu.buffer(4, MAPPABLE);
    let commands = fill(&gpu, buffer.buffer, 1);
    let begin = vk::CommandBufferBeginInfo::default();
    // SAFETY: see the crate.
    unsafe {
        let reset = vk::CommandBufferResetFlags::empty();
        device.reset_command_buffer(commands, reset).unwrap();
        let command_buffers = [commands];
        let submit = [vk::SubmitInfo::default().command_buffers(&command_buffers)];
        let submitted = device.queue_submit(gpu.queue, &submit, vk::Fence::null());
        assert!(submitted.is_err(), "nothing is recorded");
        device.begin_command_buffer(commands, &begin).unwrap();
        device.cmd_fill_buffer(commands, buffer.buffer, 0, 4, 9);
        device.end_command_buffer(commands).unwrap();
        gpu.submit(commands);
        assert_eq!(gpu.read::<u32>(buffer), [9]);
        // Beginning resets too.
        device.begin_command_buffer(commands, &begin).unwrap();
        device.end_command_buffer(commands).unwrap();
        let flags = vk::CommandPoolResetFlags::empty();
        device.reset_command_pool(gpu.pool, flags).unwrap();
        device.begin_command_buffer(commands, &begin).unwrap();
        device.end_command_buffer(commands).unwrap();
        gpu.submit(commands);
        assert_eq!(gpu.read::<u32>(buffer), [9]);
    }
    gpu.free_buffer(buffer);
}

#[gaurast_runner::test]
fn a_pool_without_single_resets_refuses_them() {
    let gpu = Gpu::new();
    let device = &gpu.device;
    // SAFETY: see the crate.
    unsafe {
        let info = vk::CommandPoolCreateInfo::default();
        let pool = device.create_command_pool(&info, None).unwrap();
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .command_buffer_count(2);
        let buffers = device.allocate_command_buffers(&info).unwrap();
        let begin = vk::CommandBufferBeginInfo::default();
        device.begin_command_buffer(buffers[0], &begin).unwrap();
        device.end_command_buffer(buffers[0]).unwrap();
        assert!(device.begin_command_buffer(buffers[0], &begin).is_err());
        let reset = vk::CommandBufferResetFlags::empty();
        assert!(device.reset_command_buffer(buffers[0], reset).is_err());
        // Destroying the pool frees its command buffers.
        device.destroy_command_pool(pool, None);
    }
}

#[gaurast_runner::test]
fn commands_outside_of_recordings_are_refused() {
    let gpu = Gpu::new();
    let buffer = gpu.buffer(4, MAPPABLE);
    let commands = gpu.command_buffer();
    // SAFETY: see the crate; the driver must survive a command outside of a recording.
    unsafe { gpu.device.cmd_fill_buffer(commands, buffer.buffer, 0, 4, 1) };
    assert!(gpu.take_messages().concat().contains("not recording"));
    gpu.free_buffer(buffer);
}

#[gaurast_runner::test]
fn commands_that_are_refused_fail_the_recording() {
    let gpu = Gpu::new();
    let buffer = gpu.buffer(4, MAPPABLE);
    let recorded = gpu.record(|device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_index_buffer(commands, buffer.buffer, 0, vk::IndexType::NONE_KHR);
        }
    });
    assert_eq!(recorded.unwrap_err(), vk::Result::ERROR_FEATURE_NOT_PRESENT);
    let told = gpu.take_messages().concat();
    assert!(
        told.contains("vkCmdBindIndexBuffer") && told.contains("NONE"),
        "{told}"
    );
    gpu.free_buffer(buffer);
}

#[gaurast_runner::test]
fn a_pass_that_does_not_end_fails_the_recording() {
    let gpu = Gpu::new();
    let image = gpu.image(vk::Format::R8G8B8A8_UNORM, 4, 4);
    let info = vk::RenderingInfo::default()
        .render_area(area(image))
        .layer_count(1);
    let recorded = gpu.record(|device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    });
    assert!(recorded.is_err());
    let recorded = gpu.record(|device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
    });
    assert!(recorded.is_err(), "a draw outside of a pass");
    gpu.free_image(image);
}

#[gaurast_runner::test]
fn secondaries_draw_inside_the_primarys_pass() {
    const RED: [f32; 3] = [0.9, 0.2, 0.1];
    let scene = Scene::new(
        &[splat([0.0, 0.0, 5.0], 0.1, 0.8, RED)],
        &PipelineRequest::default(),
    );
    let device = &scene.gpu.device;
    let secondary = scene
        .gpu
        .command_buffer_of(vk::CommandBufferLevel::SECONDARY);
    let formats = [crate::scene::FORMAT];
    let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
        .color_attachment_formats(&formats)
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
    let begin = vk::CommandBufferBeginInfo::default()
        .flags(vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
        .inheritance_info(&inheritance);
    // SAFETY: see the crate.
    unsafe {
        device.begin_command_buffer(secondary, &begin).unwrap();
        scene.bind(device, secondary);
        set_viewport(device, secondary, scene.image);
        device.cmd_draw(secondary, 1, 1, 0, 0);
        device.end_command_buffer(secondary).unwrap();
    }
    let flags = vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS;
    scene.gpu.run(|device, commands| {
        pass_with(flags, device, commands, scene.image, [0.5; 4], || {
            // SAFETY: see the crate.
            unsafe { device.cmd_execute_commands(commands, &[secondary]) };
        });
    });
    let pixels = scene.pixels();
    assert_close(at(&pixels, CENTER), premultiplied(RED, 0.8));
    assert_eq!(at(&pixels, (0, 0)), [0.5; 4]);
}
