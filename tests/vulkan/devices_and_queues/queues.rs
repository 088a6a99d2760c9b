//! Queue families, and the memory budget of a process.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::{Buffer, Gpu};

/// There are three families: one for everything, one for compute and one for transfers. A queue of each does its work,
/// and a semaphore connects it with the next.
#[gaurast_runner::test]
fn families_of_compute_and_of_copies_work() {
    let entry = vulkan_gaurast::entry();
    let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let info = vk::InstanceCreateInfo::default().application_info(&app);
    // SAFETY: the create infos are valid, and everything is destroyed before the instance.
    unsafe {
        let instance = entry.create_instance(&info, None).expect("an instance");
        let physical_device = instance.enumerate_physical_devices().expect("a device")[0];
        let families = instance.get_physical_device_queue_family_properties(physical_device);
        let find = |flags: vk::QueueFlags| {
            let found = families.iter().position(|family| family.queue_flags == flags);
            found.expect("such a family") as u32
        };
        let copies = find(vk::QueueFlags::TRANSFER);
        let compute = find(vk::QueueFlags::COMPUTE | vk::QueueFlags::TRANSFER);
        let all = find(vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE | vk::QueueFlags::TRANSFER);
        let wanted = [copies, compute, all]
            .map(|family| vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0]));
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&wanted);
        let device = instance.create_device(physical_device, &info, None).expect("a device");
        let queues = [copies, compute, all].map(|family| device.get_device_queue(family, 0));
        assert!(queues.iter().all(|&queue| queue != vk::Queue::null()));
        assert!(queues[0] != queues[1] && queues[1] != queues[2] && queues[0] != queues[2]);

        let info = vk::BufferCreateInfo::default().size(12).usage(vk::BufferUsageFlags::TRANSFER_DST);
        let buffer = device.create_buffer(&info, None).expect("a buffer");
        let needed = device.get_buffer_memory_requirements(buffer);
        let info = vk::MemoryAllocateInfo::default().allocation_size(needed.size).memory_type_index(1);
        let memory = device.allocate_memory(&info, None).expect("memory");
        device.bind_buffer_memory(buffer, memory, 0).expect("it is bound");
        let mut semaphores = Vec::new();
        let mut pools = Vec::new();
        for (index, family) in [copies, compute, all].into_iter().enumerate() {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
            let pool = device.create_command_pool(&info, None).expect("a pool");
            pools.push(pool);
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info).expect("commands")[0];
            let begin = vk::CommandBufferBeginInfo::default();
            device.begin_command_buffer(commands, &begin).expect("it begins");
            // Each submission overwrites the results of the earlier ones on its left.
            let size = 4 * (index as u64 + 1);
            device.cmd_fill_buffer(commands, buffer, 12 - size, 4, 10 + index as u32);
            device.end_command_buffer(commands).expect("it ends");
            let info = vk::SemaphoreCreateInfo::default();
            let signals = [device.create_semaphore(&info, None).expect("a semaphore")];
            let waits: Vec<_> = semaphores.last().copied().into_iter().collect();
            let stages = vec![vk::PipelineStageFlags::TRANSFER; waits.len()];
            let buffers = [commands];
            let submit = [vk::SubmitInfo::default()
                .wait_semaphores(&waits)
                .wait_dst_stage_mask(&stages)
                .command_buffers(&buffers)
                .signal_semaphores(&signals)];
            device.queue_submit(queues[index], &submit, vk::Fence::null()).expect("it is submitted");
            semaphores.extend(signals);
        }
        device.device_wait_idle().expect("it finishes");
        let flags = vk::MemoryMapFlags::empty();
        let mapped = device.map_memory(memory, 0, 12, flags).expect("it is mapped");
        let found = mapped.cast::<[u32; 3]>().read_unaligned();
        assert_eq!(found, [12, 11, 10]);
        for semaphore in semaphores {
            device.destroy_semaphore(semaphore, None);
        }
        for pool in pools {
            device.destroy_command_pool(pool, None);
        }
        device.destroy_buffer(buffer, None);
        device.free_memory(memory, None);
        device.destroy_device(None);
        instance.destroy_instance(None);
    }
}

fn usage(gpu: &Gpu) -> (u64, u64) {
    let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
    let mut properties = vk::PhysicalDeviceMemoryProperties2::default().push_next(&mut budget);
    // SAFETY: the physical device is the instance's.
    unsafe {
        gpu.instance().get_physical_device_memory_properties2(gpu.physical_device(), &mut properties);
    }
    let size = properties.memory_properties.memory_heaps[0].size;
    assert!(budget.heap_budget[0] > 0 && budget.heap_budget[0] <= size);
    assert_eq!(budget.heap_budget[1..], [0; 15]);
    (budget.heap_usage[0], budget.heap_budget[0])
}

/// Allocated memory counts as used. (Other tests in the process allocate at the same time, but less than this.)
#[gaurast_runner::test]
fn budgets_tell_what_is_used() {
    let gpu = own();
    let (before, budget) = usage(gpu);
    let size = budget / 8;
    let info = vk::MemoryAllocateInfo::default().allocation_size(size).memory_type_index(0);
    // SAFETY: the create info is valid; nothing touches the memory.
    unsafe {
        let memory = gpu.device().allocate_memory(&info, None).expect("memory");
        let used = usage(gpu).0;
        assert!(used >= size && used.saturating_sub(before) > size / 2, "{before}, {used}");
        gpu.device().free_memory(memory, None);
    }
    let small = Buffer::new(gpu, 16);
    assert!(usage(gpu).0 < size + before);
    drop(small);
}
