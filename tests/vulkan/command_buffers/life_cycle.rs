//! The life cycle of command buffers.

use ash::vk;
use gaurast_runner::Case;
use gaurast_testkit::devices::{image, open};
use gaurast_testkit::scene::{
    CENTER, FORMAT, Scene, area, assert_close, at, pass_with, premultiplied, set_viewport, splat, splats,
};
use gaurast_testkit::settings::strictly;
use gaurast_testkit::{Buffer, Gpu, Recorded};

fn fill(gpu: &Gpu, buffer: &Buffer, word: u32) -> Recorded {
    gpu.record(|recording| {
        let (device, commands) = recording.raw();
        // SAFETY: see the crate.
        unsafe { device.cmd_fill_buffer(commands, buffer.raw, 0, 4, word) };
    })
}

#[gaurast_runner::test]
fn a_recording_is_submitted_again_and_again() {
    let gpu = open();
    let buffer = Buffer::new(&gpu, 4);
    let (one, two) = (fill(&gpu, &buffer, 1), fill(&gpu, &buffer, 2));
    for _ in 0..3 {
        one.submit();
        assert_eq!(buffer.values::<u32>(), [1]);
        two.submit();
        assert_eq!(buffer.values::<u32>(), [2]);
    }
}

#[gaurast_runner::test]
fn command_buffers_are_reset_alone_or_with_their_pool() {
    let gpu = open();
    let device = gpu.device();
    let buffer = Buffer::new(&gpu, 4);
    let begin = vk::CommandBufferBeginInfo::default();
    // SAFETY: see the crate.
    unsafe {
        let info = vk::CommandPoolCreateInfo::default().flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        let pool = device.create_command_pool(&info, None).unwrap();
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let command_buffers = device.allocate_command_buffers(&info).unwrap();
        let commands = command_buffers[0];
        let submit = || {
            let submits = [vk::SubmitInfo::default().command_buffers(&command_buffers)];
            device.queue_submit(gpu.queue(), &submits, vk::Fence::null())?;
            device.queue_wait_idle(gpu.queue())
        };
        device.begin_command_buffer(commands, &begin).unwrap();
        device.cmd_fill_buffer(commands, buffer.raw, 0, 4, 1);
        device.end_command_buffer(commands).unwrap();
        let reset = vk::CommandBufferResetFlags::empty();
        device.reset_command_buffer(commands, reset).unwrap();
        assert!(submit().is_err(), "nothing is recorded");
        device.begin_command_buffer(commands, &begin).unwrap();
        device.cmd_fill_buffer(commands, buffer.raw, 0, 4, 9);
        device.end_command_buffer(commands).unwrap();
        submit().unwrap();
        assert_eq!(buffer.values::<u32>(), [9]);
        // Beginning a command buffer also resets it.
        device.begin_command_buffer(commands, &begin).unwrap();
        device.end_command_buffer(commands).unwrap();
        let flags = vk::CommandPoolResetFlags::empty();
        device.reset_command_pool(pool, flags).unwrap();
        device.begin_command_buffer(commands, &begin).unwrap();
        device.end_command_buffer(commands).unwrap();
        submit().unwrap();
        assert_eq!(buffer.values::<u32>(), [9]);
        device.destroy_command_pool(pool, None);
    }
}

/// Breaks VUID-vkBeginCommandBuffer-commandBuffer-00050 and VUID-vkResetCommandBuffer-commandBuffer-00046.
#[gaurast_runner::test]
fn a_pool_without_single_resets_refuses_them(case: &Case) {
    strictly(case, reset_where_the_pool_does_not_allow_it);
}

fn reset_where_the_pool_does_not_allow_it() {
    let gpu = open();
    let device = gpu.device();
    // SAFETY: see the crate.
    unsafe {
        let info = vk::CommandPoolCreateInfo::default();
        let pool = device.create_command_pool(&info, None).unwrap();
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(2);
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

/// Breaks VUID-vkCmdFillBuffer-commandBuffer-recording.
#[gaurast_runner::test]
fn commands_outside_of_recordings_are_refused() {
    let gpu = open();
    let buffer = Buffer::new(&gpu, 4);
    let ended = gpu.record(|_| ());
    // SAFETY: see the crate; the driver must survive a command outside of a recording.
    unsafe {
        gpu.device().cmd_fill_buffer(ended.raw, buffer.raw, 0, 4, 1);
    }
    assert!(gpu.message_texts().concat().contains("not recording"));
}

#[gaurast_runner::test]
fn commands_that_are_refused_fail_the_recording() {
    let gpu = open();
    let buffer = Buffer::new(&gpu, 4);
    let recorded = gpu.try_record(|recording| {
        let (device, commands) = recording.raw();
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_index_buffer(commands, buffer.raw, 0, vk::IndexType::NONE_KHR);
        }
    });
    assert_eq!(recorded.unwrap_err(), vk::Result::ERROR_FEATURE_NOT_PRESENT);
    let told = gpu.message_texts().concat();
    assert!(told.contains("vkCmdBindIndexBuffer") && told.contains("NONE"), "{told}");
}

/// Breaks VUID-vkEndCommandBuffer-commandBuffer-00060.
#[gaurast_runner::test]
fn a_pass_that_does_not_end_fails_the_recording() {
    let gpu = open();
    let image = image(&gpu, vk::Format::R8G8B8A8_UNORM, [4, 4]);
    let info = vk::RenderingInfo::default().render_area(area(&image)).layer_count(1);
    let recorded = gpu.try_record(|recording| {
        let (device, commands) = recording.raw();
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    });
    assert!(recorded.is_err());
    let recorded = gpu.try_record(|recording| {
        let (device, commands) = recording.raw();
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
    });
    assert!(recorded.is_err(), "a draw outside of a pass");
}

#[gaurast_runner::test]
fn secondaries_draw_inside_the_primarys_pass() {
    const RED: [f32; 3] = [0.9, 0.2, 0.1];
    let scene = Scene::new(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, RED)], &splats());
    let formats = [FORMAT];
    let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
        .color_attachment_formats(&formats)
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
    let secondary = scene.gpu.record_secondary(&inheritance, |recording| {
        let (device, commands) = recording.raw();
        scene.bind(device, commands);
        set_viewport(device, commands, &scene.image);
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
    });
    let flags = vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS;
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        pass_with(flags, device, commands, &scene.image, [0.5; 4], || {
            // SAFETY: see the crate.
            unsafe { device.cmd_execute_commands(commands, &[secondary.raw]) };
        });
    });
    let pixels = scene.pixels();
    assert_close(at(&pixels, CENTER), premultiplied(RED, 0.8));
    assert_eq!(at(&pixels, (0, 0)), [0.5; 4]);
}
