//! Device memory, and the resources bound to it.

use ash::vk;
use gaurast_testkit::Buffer;
use gaurast_testkit::devices::{DEVICE_ONLY, MAPPABLE, allocate, open};

const NO_FLAGS: vk::MemoryMapFlags = vk::MemoryMapFlags::empty();

#[gaurast_runner::test]
fn mapped_memory_keeps_what_is_written() {
    let gpu = open();
    let memory = allocate(&gpu, 1000, MAPPABLE);
    // SAFETY: see the crate.
    unsafe {
        let device = gpu.device();
        let mapped = device.map_memory(memory, 0, vk::WHOLE_SIZE, NO_FLAGS).unwrap();
        let bytes = mapped.cast::<u8>();
        assert_eq!(bytes.add(999).read(), 0, "memory begins zeroed");
        bytes.add(500).write(7);
        let range = [vk::MappedMemoryRange::default().memory(memory).size(vk::WHOLE_SIZE)];
        device.flush_mapped_memory_ranges(&range).unwrap();
        device.invalidate_mapped_memory_ranges(&range).unwrap();
        device.unmap_memory(memory);
        let mapped = device.map_memory(memory, 500, 10, NO_FLAGS).unwrap();
        assert_eq!(mapped.cast::<u8>().read(), 7);
        assert!(device.map_memory(memory, 0, 10, NO_FLAGS).is_err(), "mapped");
        // Freeing memory also unmaps it.
        device.free_memory(memory, None);
    }
}

#[gaurast_runner::test]
fn memory_is_mapped_by_a_structure_too() {
    let gpu = open();
    let memory = allocate(&gpu, 1000, MAPPABLE);
    let device = gpu.device().handle();
    let commands = ash::khr::map_memory2::Device::new(gpu.instance(), gpu.device());
    let map_info = vk::MemoryMapInfoKHR::default().memory(memory).offset(500).size(vk::WHOLE_SIZE);
    let unmap_info = vk::MemoryUnmapInfoKHR::default().memory(memory);
    let mut mapped = std::ptr::null_mut();
    // SAFETY: see the crate.
    unsafe {
        let (map, unmap) = (commands.fp().map_memory2_khr, commands.fp().unmap_memory2_khr);
        map(device, &raw const map_info, &raw mut mapped).result().unwrap();
        mapped.cast::<u8>().write(7);
        let again = map(device, &raw const map_info, &raw mut mapped).result();
        assert!(again.is_err(), "mapped");
        unmap(device, &raw const unmap_info).result().unwrap();
        let mapped = gpu.device().map_memory(memory, 500, 1, NO_FLAGS).unwrap();
        assert_eq!(mapped.cast::<u8>().read(), 7);
        gpu.device().free_memory(memory, None);
    }
    assert_eq!(gpu.message_texts().len(), 1, "of the memory mapped twice");
}

/// Breaks VUID-vkMapMemory-memory-00682.
#[gaurast_runner::test]
fn device_only_memory_is_not_mapped() {
    let gpu = open();
    let memory = allocate(&gpu, 1000, DEVICE_ONLY);
    // SAFETY: see the crate.
    unsafe {
        let error = gpu.device().map_memory(memory, 0, 10, NO_FLAGS).unwrap_err();
        assert_eq!(error, vk::Result::ERROR_MEMORY_MAP_FAILED);
        assert_eq!(gpu.device().get_device_memory_commitment(memory), 1000);
        gpu.device().free_memory(memory, None);
    }
    assert!(gpu.message_texts().concat().contains("not host-visible"));
}

#[gaurast_runner::test]
fn the_heap_is_finite() {
    let gpu = open();
    let allocate = |size| {
        let info = vk::MemoryAllocateInfo::default().allocation_size(size).memory_type_index(DEVICE_ONLY);
        // SAFETY: see the crate.
        unsafe { gpu.device().allocate_memory(&info, None) }
    };
    for size in [u64::MAX, 1 << 60] {
        assert_eq!(allocate(size).unwrap_err(), vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
    }
    let memory = allocate(1 << 20).unwrap();
    // SAFETY: see the crate.
    unsafe { gpu.device().free_memory(memory, None) };
}

#[gaurast_runner::test]
fn resources_outlive_the_memory_object_that_they_are_bound_to() {
    let gpu = open();
    let source = Buffer::of(&gpu, &[1u32, 2, 3, 4]);
    let target = Buffer::new(&gpu, 16);
    // SAFETY: see the crate; the driver must survive the use of a buffer whose memory was freed.
    unsafe { gpu.device().free_memory(source.memory, None) };
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let region = [vk::BufferCopy::default().size(16)];
        // SAFETY: see the crate.
        unsafe { device.cmd_copy_buffer(commands, source.raw, target.raw, &region) };
    });
    assert_eq!(target.values::<u32>(), [1, 2, 3, 4]);
    // SAFETY: see the crate.
    unsafe { gpu.device().destroy_buffer(source.raw, None) };
}

/// Breaks VUID-vkBindBufferMemory-memoryOffset-01031, VUID-vkBindBufferMemory-memoryOffset-01036 and
/// VUID-vkBindBufferMemory-buffer-07459.
#[gaurast_runner::test]
fn binding_is_checked() {
    let gpu = open();
    let info = vk::BufferCreateInfo::default().size(1000).usage(vk::BufferUsageFlags::TRANSFER_SRC);
    let memory = allocate(&gpu, 1024, MAPPABLE);
    // SAFETY: see the crate.
    unsafe {
        let device = gpu.device();
        let buffer = device.create_buffer(&info, None).unwrap();
        assert!(device.bind_buffer_memory(buffer, memory, 1024).is_err());
        assert!(device.bind_buffer_memory(buffer, memory, 1).is_err());
        let binds = [vk::BindBufferMemoryInfo::default().buffer(buffer).memory(memory)];
        device.bind_buffer_memory2(&binds).unwrap();
        assert!(device.bind_buffer_memory(buffer, memory, 0).is_err());
        device.destroy_buffer(buffer, None);
        device.free_memory(memory, None);
    }
    assert_eq!(gpu.message_texts().len(), 3);
}

#[gaurast_runner::test]
fn requirements_are_the_same_however_they_are_asked_for() {
    let gpu = open();
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(vk::Format::R8G8B8A8_UNORM)
        .extent(vk::Extent3D { width: 100, height: 50, depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::LINEAR)
        .usage(vk::ImageUsageFlags::TRANSFER_DST);
    // SAFETY: see the crate.
    unsafe {
        let image = gpu.device().create_image(&info, None).unwrap();
        let first = gpu.device().get_image_memory_requirements(image);
        let mut dedicated = vk::MemoryDedicatedRequirements::default();
        let mut second = vk::MemoryRequirements2::default().push_next(&mut dedicated);
        let query = vk::ImageMemoryRequirementsInfo2::default().image(image);
        gpu.device().get_image_memory_requirements2(&query, &mut second);
        let second = second.memory_requirements;
        assert_eq!(first.size, second.size);
        assert_eq!(first.alignment, second.alignment);
        let subresource =
            vk::ImageSubresource { aspect_mask: vk::ImageAspectFlags::COLOR, mip_level: 0, array_layer: 0 };
        let layout = gpu.device().get_image_subresource_layout(image, subresource);
        assert!(layout.row_pitch >= 100 * 4);
        assert_eq!(layout.size, layout.row_pitch * 50);
        assert!(layout.offset + layout.size <= first.size);
        gpu.device().destroy_image(image, None);
    }
    assert_eq!(dedicated_is_not_asked_for(), (vk::FALSE, vk::FALSE));
}

/// The values of `VkMemoryDedicatedRequirements` for a buffer.
fn dedicated_is_not_asked_for() -> (vk::Bool32, vk::Bool32) {
    let gpu = open();
    let buffer = Buffer::new(&gpu, 64);
    let mut dedicated = vk::MemoryDedicatedRequirements {
        prefers_dedicated_allocation: 7,
        requires_dedicated_allocation: 7,
        ..Default::default()
    };
    let mut requirements = vk::MemoryRequirements2::default().push_next(&mut dedicated);
    let query = vk::BufferMemoryRequirementsInfo2::default().buffer(buffer.raw);
    // SAFETY: see the crate.
    unsafe {
        gpu.device().get_buffer_memory_requirements2(&query, &mut requirements);
    }
    (dedicated.prefers_dedicated_allocation, dedicated.requires_dedicated_allocation)
}

/// Breaks VUID-VkImageCreateInfo-extent-02252, VUID-VkImageCreateInfo-mipLevels-00958,
/// VUID-VkImageCreateInfo-arrayLayers-02256, VUID-VkImageCreateInfo-samples-02258 and
/// VUID-VkImageCreateInfo-flags-00969.
#[gaurast_runner::test]
fn images_beyond_the_limits_are_refused() {
    let gpu = open();
    let good = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(vk::Format::R8G8B8A8_UNORM)
        .extent(vk::Extent3D { width: 4, height: 4, depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::TRANSFER_DST);
    let mut wide = good;
    wide.extent.width = u32::MAX;
    let bad = [
        wide,
        good.mip_levels(40),
        good.array_layers(u32::MAX),
        good.samples(vk::SampleCountFlags::TYPE_2).usage(vk::ImageUsageFlags::COLOR_ATTACHMENT),
        good.format(vk::Format::ASTC_4X4_SFLOAT_BLOCK),
        good.format(vk::Format::R8G8B8A8_SRGB).usage(vk::ImageUsageFlags::STORAGE),
        good.flags(vk::ImageCreateFlags::SPARSE_BINDING),
    ];
    for info in bad {
        // SAFETY: see the crate.
        unsafe { assert!(gpu.device().create_image(&info, None).is_err(), "{info:?}") };
    }
}
