//! The watchdog: a kernel with an infinite loop loses its device, and no other one.

use ash::vk;
use gaurast_testkit::devices::everything_of;
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Binding, Buffer, Compute, Driver, Gpu, Opening, Settings};
use std::time::{Duration, Instant};

const BINDINGS: &[Binding] = &[(0, vk::DescriptorType::STORAGE_BUFFER, 1)];

/// Opens this driver's device with a short time limit.
fn open() -> Gpu {
    let settings = Settings { timeout: Some(Duration::from_millis(200)), ..Settings::default() };
    Gpu::open(&Opening { settings, ..everything_of(Driver::Embedded) }).expect("a device")
}

#[gaurast_runner::test]
fn a_kernel_without_end_loses_its_device_alone() {
    let doomed = open();
    let survivor = open();
    let fence = lose(&doomed);

    // The device stays lost, and calls report that.
    // SAFETY: see the crate.
    unsafe {
        let lost = Err(vk::Result::ERROR_DEVICE_LOST);
        assert_eq!(doomed.device().queue_wait_idle(doomed.queue()), lost);
        assert_eq!(doomed.device().device_wait_idle(), lost);
        let submitted = doomed.device().queue_submit(doomed.queue(), &[], vk::Fence::null());
        assert_eq!(submitted, lost);
        doomed.device().destroy_fence(fence, None);
    }
    let messages = doomed.message_texts();
    let stopped = |message: &String| message.contains("200ms");
    assert!(messages.iter().any(stopped), "{messages:?}");
    drop(doomed);

    // Another device, and one that is created afterwards, work.
    shared_sums(&survivor);
    shared_sums(&open());

    // Many workgroups together may take longer than the limit of one.
    let words = spirv("shared.comp");
    let kernel = Compute::new(&survivor, &words, &[BINDINGS]);
    let data = Buffer::of(&survivor, &[0u32; 256 * 64]);
    let set = kernel.storage_set(&[&data]);
    let started = Instant::now();
    while started.elapsed() < Duration::from_millis(400) {
        survivor.run(|recording| {
            let (device, commands) = recording.raw();
            kernel.bind(commands, &[set]);
            for _ in 0..50 {
                // SAFETY: see the crate.
                unsafe { device.cmd_dispatch(commands, 64, 1, 1) };
            }
        });
    }
}

/// Submits a kernel with an infinite loop, and waits until its fence reports the lost device.
fn lose(gpu: &Gpu) -> vk::Fence {
    let kernel = Compute::new(gpu, &spirv("endless.comp"), &[BINDINGS]);
    let data = Buffer::of(gpu, &[0u32; 2]);
    let set = kernel.storage_set(&[&data]);
    let commands = gpu.try_record(|recording| {
        let (device, commands) = recording.raw();
        kernel.bind(commands, &[set]);
        // SAFETY: see the crate.
        unsafe { device.cmd_dispatch(commands, 8, 1, 1) };
    });
    let commands = commands.unwrap();
    let buffers = [commands.raw];
    let submits = [vk::SubmitInfo::default().command_buffers(&buffers)];
    let started = Instant::now();
    // SAFETY: see the crate.
    let fence = unsafe {
        let fence = gpu.device().create_fence(&vk::FenceCreateInfo::default(), None).unwrap();
        gpu.device().queue_submit(gpu.queue(), &submits, fence).unwrap();
        let waited = gpu.device().wait_for_fences(&[fence], true, u64::MAX);
        assert_eq!(waited, Err(vk::Result::ERROR_DEVICE_LOST));
        fence
    };
    assert!(started.elapsed() >= Duration::from_millis(200));
    assert_ne!(data.values::<u32>()[1], 0, "it ran");
    fence
}

/// Runs a kernel and checks its result.
fn shared_sums(gpu: &Gpu) {
    let kernel = Compute::new(gpu, &spirv("shared.comp"), &[BINDINGS]);
    let data = Buffer::of(gpu, &[1u32; 256]);
    kernel.run(&[kernel.storage_set(&[&data])], &[], [1, 1, 1]);
    assert!(data.values::<u32>().into_iter().eq(1..=256));
}
