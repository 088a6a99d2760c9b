//! Fences, semaphores, events and queues.

use ash::vk;
use gaurast_testkit::Buffer;
use gaurast_testkit::devices::open;
use std::time::{Duration, Instant};

#[gaurast_runner::test]
fn fences_tell_when_a_submission_is_done() {
    let gpu = open();
    let device = gpu.device();
    let buffer = Buffer::new(&gpu, 1 << 16);
    let commands = gpu
        .try_record(|recording| {
            let (device, commands) = recording.raw();
            // SAFETY: see the crate.
            unsafe { device.cmd_fill_buffer(commands, buffer.raw, 0, vk::WHOLE_SIZE, 3) };
        })
        .unwrap();
    let command_buffers = [commands.raw];
    let submits = [vk::SubmitInfo::default().command_buffers(&command_buffers)];
    // SAFETY: see the crate.
    unsafe {
        let info = vk::FenceCreateInfo::default();
        let fence = device.create_fence(&info, None).unwrap();
        assert!(!device.get_fence_status(fence).unwrap());
        let waited = device.wait_for_fences(&[fence], true, 0);
        assert_eq!(waited.unwrap_err(), vk::Result::TIMEOUT);
        device.queue_submit(gpu.queue(), &submits, fence).unwrap();
        device.wait_for_fences(&[fence], true, u64::MAX).unwrap();
        assert!(device.get_fence_status(fence).unwrap());
        assert!(buffer.values::<u32>().iter().all(|&word| word == 3));
        device.reset_fences(&[fence]).unwrap();
        assert!(!device.get_fence_status(fence).unwrap());
        // An empty submission signals its fence too.
        device.queue_submit(gpu.queue(), &[], fence).unwrap();
        device.wait_for_fences(&[fence], true, u64::MAX).unwrap();
        device.destroy_fence(fence, None);
    }
}

#[gaurast_runner::test]
fn a_wait_is_for_any_fence_or_for_all() {
    let gpu = open();
    let device = gpu.device();
    // SAFETY: see the crate.
    unsafe {
        let unsignaled = vk::FenceCreateInfo::default();
        let signaled = unsignaled.flags(vk::FenceCreateFlags::SIGNALED);
        let fences = [device.create_fence(&unsignaled, None).unwrap(), device.create_fence(&signaled, None).unwrap()];
        device.wait_for_fences(&fences, false, 0).unwrap();
        let begin = Instant::now();
        let waited = device.wait_for_fences(&fences, true, 10_000_000);
        assert_eq!(waited.unwrap_err(), vk::Result::TIMEOUT);
        assert!(begin.elapsed() >= Duration::from_millis(10));
        for fence in fences {
            device.destroy_fence(fence, None);
        }
    }
}

#[gaurast_runner::test]
fn binary_semaphores_order_submissions() {
    let gpu = open();
    let device = gpu.device();
    let buffer = Buffer::new(&gpu, 4);
    let fill = |word| {
        gpu.try_record(|recording| {
            let (device, commands) = recording.raw();
            // SAFETY: see the crate.
            unsafe { device.cmd_fill_buffer(commands, buffer.raw, 0, 4, word) };
        })
        .unwrap()
    };
    // SAFETY: see the crate.
    unsafe {
        let info = vk::SemaphoreCreateInfo::default();
        let semaphores = [device.create_semaphore(&info, None).unwrap()];
        let (one, two) = (fill(1), fill(2));
        let (first, second) = ([one.raw], [two.raw]);
        let stages = [vk::PipelineStageFlags::ALL_COMMANDS];
        for _ in 0..3 {
            let submits = [
                vk::SubmitInfo::default().command_buffers(&first).signal_semaphores(&semaphores),
                vk::SubmitInfo::default()
                    .wait_semaphores(&semaphores)
                    .wait_dst_stage_mask(&stages)
                    .command_buffers(&second),
            ];
            device.queue_submit(gpu.queue(), &submits, vk::Fence::null()).unwrap();
            device.device_wait_idle().unwrap();
            assert_eq!(buffer.values::<u32>(), [2]);
        }
        device.destroy_semaphore(semaphores[0], None);
    }
}

#[gaurast_runner::test]
fn the_host_signals_a_timeline_that_a_queue_waits_for() {
    let gpu = open();
    let device = gpu.device();
    // SAFETY: see the crate.
    unsafe {
        let mut kind =
            vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE).initial_value(5);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        let semaphore = device.create_semaphore(&info, None).unwrap();
        assert_eq!(device.get_semaphore_counter_value(semaphore).unwrap(), 5);
        let waits = [vk::SemaphoreSubmitInfo::default()
            .semaphore(semaphore)
            .value(6)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(semaphore)
            .value(9)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submits = [vk::SubmitInfo2::default().wait_semaphore_infos(&waits).signal_semaphore_infos(&signals)];
        device.queue_submit2(gpu.queue(), &submits, vk::Fence::null()).unwrap();
        let (semaphores, values) = ([semaphore], [9]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        assert_eq!(device.wait_semaphores(&wait, 1_000_000).unwrap_err(), vk::Result::TIMEOUT);
        let signal = vk::SemaphoreSignalInfo::default().semaphore(semaphore).value(6);
        device.signal_semaphore(&signal).unwrap();
        device.wait_semaphores(&wait, u64::MAX).unwrap();
        assert_eq!(device.get_semaphore_counter_value(semaphore).unwrap(), 9);
        device.queue_wait_idle(gpu.queue()).unwrap();
        device.destroy_semaphore(semaphore, None);
    }
}

#[gaurast_runner::test]
fn queues_and_hosts_set_events() {
    let gpu = open();
    let device = gpu.device();
    // SAFETY: see the crate.
    unsafe {
        let info = vk::EventCreateInfo::default();
        let event = device.create_event(&info, None).unwrap();
        assert!(!device.get_event_status(event).unwrap());
        let stages = vk::PipelineStageFlags::TRANSFER;
        let buffer = Buffer::new(&gpu, 4);
        let commands = gpu
            .try_record(|recording| {
                let (device, commands) = recording.raw();
                let events = [event];
                let host = vk::PipelineStageFlags::HOST;
                device.cmd_wait_events(commands, &events, host, stages, &[], &[], &[]);
                device.cmd_fill_buffer(commands, buffer.raw, 0, 4, 4);
                device.cmd_reset_event(commands, event, stages);
            })
            .unwrap();
        let command_buffers = [commands.raw];
        let submits = [vk::SubmitInfo::default().command_buffers(&command_buffers)];
        device.queue_submit(gpu.queue(), &submits, vk::Fence::null()).unwrap();
        std::thread::sleep(Duration::from_millis(5));
        assert_eq!(buffer.values::<u32>(), [0], "the queue waits");
        device.set_event(event).unwrap();
        device.queue_wait_idle(gpu.queue()).unwrap();
        assert_eq!(buffer.values::<u32>(), [4]);
        assert!(!device.get_event_status(event).unwrap());
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            device.cmd_set_event(commands, event, stages);
        });
        assert!(device.get_event_status(event).unwrap());
        device.destroy_event(event, None);
    }
}
