//! Query pools: performance counters and timestamps.

use ash::vk;
use gaurast_testkit::devices::open;
use gaurast_testkit::scene::{Scene, splat, splats};
use gaurast_testkit::{Buffer, Graphics};
use simdevice::stats::counters::Counter;

#[gaurast_runner::test]
fn counters_are_read_in_the_order_that_the_pool_chose() {
    let gaussians = [
        splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.5; 3]),
        splat([0.0, 0.0, -5.0], 0.1, 0.8, [0.5; 3]),
        splat([0.0, 0.0, 6.0], 0.1, 0.001, [0.5; 3]),
    ];
    let scene = Scene::new(&gaussians, &splats());
    let device = scene.gpu.device();
    let counters = [Counter::GaussiansDrawn as u32, Counter::GaussiansRead as u32];
    let mut performance =
        vk::QueryPoolPerformanceCreateInfoKHR::default().queue_family_index(0).counter_indices(&counters);
    let info = vk::QueryPoolCreateInfo::default()
        .query_type(vk::QueryType::PERFORMANCE_QUERY_KHR)
        .query_count(1)
        .push_next(&mut performance);
    let (instance, device_functions) = (
        ash::khr::performance_query::Instance::new(scene.gpu.entry(), scene.gpu.instance()),
        ash::khr::performance_query::Device::new(scene.gpu.instance(), device),
    );
    // SAFETY: see the crate.
    unsafe {
        let available = instance
            .enumerate_physical_device_queue_family_performance_query_counters_len(scene.gpu.physical_device(), 0)
            .unwrap();
        assert_eq!(available, Counter::ALL.len());
        device_functions.acquire_profiling_lock(&vk::AcquireProfilingLockInfoKHR::default()).unwrap();
        let pool = device.create_query_pool(&info, None).unwrap();
        device.reset_query_pool(pool, 0, 1);
        let mut results = [[0u64; 2]];
        let read = |results: &mut [[u64; 2]], flags| device.get_query_pool_results(pool, 0, results, flags);
        let unavailable = read(&mut results, vk::QueryResultFlags::empty());
        assert_eq!(unavailable.unwrap_err(), vk::Result::NOT_READY);
        scene.gpu.run(|recording| {
            let (device, commands) = recording.raw();
            let flags = vk::QueryControlFlags::empty();
            device.cmd_begin_query(commands, pool, 0, flags);
            gaurast_testkit::scene::pass(device, commands, &scene.image, [0.0; 4], || {
                scene.bind(device, commands);
                device.cmd_draw(commands, 3, 1, 0, 0);
            });
            device.cmd_end_query(commands, pool, 0);
        });
        read(&mut results, vk::QueryResultFlags::WAIT).unwrap();
        assert_eq!(results, [[1, 3]]);
        device.destroy_query_pool(pool, None);
        device_functions.release_profiling_lock();
    }
}

#[gaurast_runner::test]
fn occlusion_queries_count_the_fragments_of_gaussian_draws() {
    let gaussians = [splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.5; 3]), splat([0.1, 0.0, 6.0], 0.1, 0.8, [0.5; 3])];
    let masked = Graphics {
        blend: vec![gaurast_testkit::scene::replace().color_write_mask(vk::ColorComponentFlags::empty())],
        ..splats()
    };
    // Fragments that write nothing are counted too.
    let [shown, hidden] = [splats(), masked].map(|request| {
        let scene = Scene::new(&gaussians, &request);
        let device = scene.gpu.device();
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::OCCLUSION).query_count(1);
        let mut samples = [0u32];
        // SAFETY: see the crate.
        unsafe {
            let pool = device.create_query_pool(&info, None).unwrap();
            device.reset_query_pool(pool, 0, 1);
            scene.gpu.run(|recording| {
                let (device, commands) = recording.raw();
                device.cmd_begin_query(commands, pool, 0, vk::QueryControlFlags::PRECISE);
                gaurast_testkit::scene::pass(device, commands, &scene.image, [0.0; 4], || {
                    scene.bind(device, commands);
                    device.cmd_draw(commands, 2, 1, 0, 0);
                });
                device.cmd_end_query(commands, pool, 0);
            });
            device.get_query_pool_results(pool, 0, &mut samples, vk::QueryResultFlags::WAIT).unwrap();
            device.destroy_query_pool(pool, None);
        }
        let pixels = scene.pixels();
        let drawn = pixels.iter().filter(|pixel| pixel[3] > 0.0).count();
        (samples[0] as usize, drawn)
    });
    assert!(shown.0 > 20 && shown.0 == shown.1, "{shown:?}");
    assert_eq!(hidden, (shown.0, 0));
}

#[gaurast_runner::test]
fn timestamps_ascend_and_are_copied_with_their_availability() {
    let gpu = open();
    let device = gpu.device();
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(3);
    let buffer = Buffer::new(&gpu, 48);
    let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
    // SAFETY: see the crate.
    unsafe {
        let pool = device.create_query_pool(&info, None).unwrap();
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            device.cmd_reset_query_pool(commands, pool, 0, 3);
            device.cmd_write_timestamp(commands, stage, pool, 0);
            device.cmd_write_timestamp(commands, stage, pool, 1);
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
            let target = buffer.raw;
            device.cmd_copy_query_pool_results(commands, pool, 0, 3, target, 0, 16, flags);
        });
        let copied = buffer.values::<[u64; 2]>();
        assert!(copied[0][0] > 0 && copied[1][0] >= copied[0][0]);
        assert_eq!(copied.iter().map(|c| c[1]).collect::<Vec<_>>(), [1, 1, 0]);
        let mut read = [0u64; 2];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        device.get_query_pool_results(pool, 0, &mut read, flags).unwrap();
        assert_eq!(read, [copied[0][0], copied[1][0]]);
        device.destroy_query_pool(pool, None);
    }
}

/// The device's clock is that of timestamps, and it runs as fast as the host's.
#[gaurast_runner::test]
fn clocks_are_read_together() {
    let gpu = open();
    let instance = ash::ext::calibrated_timestamps::Instance::new(gpu.entry(), gpu.instance());
    let clocks = ash::ext::calibrated_timestamps::Device::new(gpu.instance(), gpu.device());
    // SAFETY: see the crate.
    let domains = unsafe { instance.get_physical_device_calibrateable_time_domains(gpu.physical_device()).unwrap() };
    let host = [vk::TimeDomainKHR::CLOCK_MONOTONIC, vk::TimeDomainKHR::CLOCK_MONOTONIC_RAW];
    assert_eq!(domains, [vk::TimeDomainKHR::DEVICE, host[0], host[1]]);
    let read = || {
        let of = |domain| vk::CalibratedTimestampInfoKHR::default().time_domain(domain);
        let infos: Vec<_> = domains.iter().copied().map(of).collect();
        // SAFETY: see the crate.
        unsafe { clocks.get_calibrated_timestamps(&infos).unwrap() }
    };
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(1);
    let (before, deviation_before) = read();
    let mut written = [0u64; 1];
    // SAFETY: see the crate.
    unsafe {
        let device = gpu.device();
        let pool = device.create_query_pool(&info, None).unwrap();
        device.reset_query_pool(pool, 0, 1);
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
            device.cmd_write_timestamp(commands, stage, pool, 0);
        });
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        device.get_query_pool_results(pool, 0, &mut written, flags).unwrap();
        device.destroy_query_pool(pool, None);
    }
    let (after, deviation_after) = read();
    assert!((before[0]..=after[0]).contains(&written[0]));
    let passed = [0, 1].map(|clock: usize| after[clock] - before[clock]);
    assert!(passed[0].abs_diff(passed[1]) <= deviation_before + deviation_after);
    let windows = vk::CalibratedTimestampInfoKHR::default().time_domain(vk::TimeDomainKHR::QUERY_PERFORMANCE_COUNTER);
    // SAFETY: see the crate.
    unsafe { assert!(clocks.get_calibrated_timestamps(&[windows]).is_err()) };
}

/// Breaks VUID-VkQueryPoolCreateInfo-queryType-03222 and
/// VUID-VkQueryPoolPerformanceCreateInfoKHR-pCounterIndices-03321.
#[gaurast_runner::test]
fn what_cannot_be_measured_is_refused() {
    let gpu = open();
    let structures = vk::QueryPoolCreateInfo::default()
        .query_type(vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR)
        .query_count(1);
    let unchained = structures.query_type(vk::QueryType::PERFORMANCE_QUERY_KHR);
    let mut unknown = vk::QueryPoolPerformanceCreateInfoKHR::default().counter_indices(&[9999]);
    let unknown = unchained.push_next(&mut unknown);
    for info in [structures, unchained, unknown] {
        // SAFETY: see the crate.
        unsafe { assert!(gpu.device().create_query_pool(&info, None).is_err()) };
    }
}
