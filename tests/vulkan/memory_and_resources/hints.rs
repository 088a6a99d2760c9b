//! Zeroed memory, and priorities of memory.

use ash::vk;
use gaurast_testkit::devices::MAPPABLE;
use gaurast_testkit::newer::Flags;
use gaurast_testkit::{Buffer, Gpu};

/// `VK_MEMORY_ALLOCATE_ZERO_INITIALIZE_BIT_EXT`.
const ZERO_INITIALIZE: vk::MemoryAllocateFlags = vk::MemoryAllocateFlags::from_raw(8);

/// `VK_IMAGE_LAYOUT_ZERO_INITIALIZED_EXT`.
const ZERO_INITIALIZED: vk::ImageLayout = vk::ImageLayout::from_raw(1_000_620_000);

/// Memory that was written and freed is zero when it is allocated again, as bytes and as an image's texels.
#[gaurast_runner::test]
fn zeroed_memory_is_zero_again() {
    const SIDE: u32 = 32;
    const BYTES: u64 = 4 * (SIDE * SIDE) as u64;
    let mut features = Flags::<1_000_620_000, 1>::new([vk::TRUE]);
    let gpu = Gpu::extended(&[c"VK_EXT_zero_initialize_device_memory"], &mut features).expect("a device");
    let device = gpu.device();
    let allocate = || {
        let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(ZERO_INITIALIZE);
        let info =
            vk::MemoryAllocateInfo::default().allocation_size(BYTES).memory_type_index(MAPPABLE).push_next(&mut flags);
        // SAFETY: see the crate.
        unsafe { device.allocate_memory(&info, None) }.expect("memory")
    };
    for _ in 0..3 {
        let memory = allocate();
        // SAFETY: the memory has so many bytes; for the rest see the crate.
        unsafe {
            let mapped = device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()).expect("a mapping");
            let bytes = std::slice::from_raw_parts_mut(mapped.cast::<u8>(), BYTES as usize);
            assert!(bytes.iter().all(|byte| *byte == 0));
            bytes.fill(0xA5);
            device.free_memory(memory, None);
        }
    }
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(vk::Format::R8G8B8A8_UNORM)
        .extent(vk::Extent3D { width: SIDE, height: SIDE, depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::TRANSFER_SRC)
        .initial_layout(ZERO_INITIALIZED);
    let read = Buffer::of(&gpu, &[u32::MAX; (SIDE * SIDE) as usize]);
    let memory = allocate();
    // SAFETY: see the crate.
    unsafe {
        let image = device.create_image(&info, None).expect("an image");
        assert!(device.get_image_memory_requirements(image).size <= BYTES);
        device.bind_image_memory(image, memory, 0).expect("it is bound");
        let range =
            vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
        let barrier = vk::ImageMemoryBarrier::default()
            .old_layout(ZERO_INITIALIZED)
            .new_layout(vk::ImageLayout::GENERAL)
            .dst_access_mask(vk::AccessFlags::TRANSFER_READ)
            .image(image)
            .subresource_range(range);
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(info.extent);
        gpu.run(|commands| {
            let (_, raw) = commands.raw();
            let (before, after) = (vk::PipelineStageFlags::TOP_OF_PIPE, vk::PipelineStageFlags::TRANSFER);
            device.cmd_pipeline_barrier(raw, before, after, vk::DependencyFlags::empty(), &[], &[], &[barrier]);
            device.cmd_copy_image_to_buffer(raw, image, vk::ImageLayout::GENERAL, read.raw, &[region]);
            commands.barrier();
        });
        assert!(read.values::<u32>().iter().all(|texel| *texel == 0));
        device.destroy_image(image, None);
        device.free_memory(memory, None);
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
}

/// Priorities from 0 to 1 are taken; others are warned of.
#[gaurast_runner::test]
fn priorities_of_memory_are_taken() {
    let mut pageable =
        vk::PhysicalDevicePageableDeviceLocalMemoryFeaturesEXT::default().pageable_device_local_memory(true);
    let mut features = vk::PhysicalDeviceMemoryPriorityFeaturesEXT::default().memory_priority(true);
    features.p_next = (&raw mut pageable).cast();
    let names = [ash::ext::memory_priority::NAME, ash::ext::pageable_device_local_memory::NAME];
    let gpu = Gpu::extended(&names, &mut features).expect("a device");
    let device = gpu.device();
    let commands = ash::ext::pageable_device_local_memory::Device::new(gpu.instance(), device);
    let allocate = |priority| {
        let mut priority = vk::MemoryPriorityAllocateInfoEXT::default().priority(priority);
        let info =
            vk::MemoryAllocateInfo::default().allocation_size(64).memory_type_index(MAPPABLE).push_next(&mut priority);
        // SAFETY: see the crate.
        unsafe { device.allocate_memory(&info, None) }
    };
    for priority in [0.0, 0.5, 1.0] {
        let memory = allocate(priority).expect("memory");
        // SAFETY: see the crate.
        unsafe {
            (commands.fp().set_device_memory_priority_ext)(device.handle(), memory, 1.0 - priority);
            assert_eq!(gpu.message_texts(), [""; 0]);
            (commands.fp().set_device_memory_priority_ext)(device.handle(), memory, 2.0 + priority);
            device.free_memory(memory, None);
        }
        let ids: Vec<_> = gpu.messages().into_iter().map(|message| message.id).collect();
        assert_eq!(ids, ["VUID-vkSetDeviceMemoryPriorityEXT-priority-06258"]);
    }
    for priority in [-0.1, 1.5, f32::NAN] {
        let memory = allocate(priority).expect("memory all the same");
        // SAFETY: see the crate.
        unsafe { device.free_memory(memory, None) };
        let ids: Vec<_> = gpu.messages().into_iter().map(|message| message.id).collect();
        assert_eq!(ids, ["VUID-VkMemoryPriorityAllocateInfoEXT-priority-02602"], "{priority}");
    }
}
