//! Images whose memory is split over the devices of a group, of which there is one.

use ash::vk;
use gaurast_testkit::Buffer;
use gaurast_testkit::devices::{COLOR, own};

const SIDE: u32 = 16;
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const SPLIT: vk::ImageCreateFlags = vk::ImageCreateFlags::SPLIT_INSTANCE_BIND_REGIONS;

fn answer(ty: vk::ImageType, tiling: vk::ImageTiling) -> Result<vk::ImageFormatProperties, vk::Result> {
    let gpu = own();
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    // SAFETY: the physical device is the instance's.
    unsafe {
        let (instance, device) = (gpu.instance(), gpu.physical_device());
        instance.get_physical_device_image_format_properties(device, FORMAT, ty, tiling, usage, SPLIT)
    }
}

#[gaurast_runner::test]
fn split_images_are_of_two_dimensions_one_level_and_one_layer() {
    let found = answer(vk::ImageType::TYPE_2D, vk::ImageTiling::OPTIMAL).expect("support");
    assert_eq!((found.max_mip_levels, found.max_array_layers), (1, 1));
    let unsupported = Some(vk::Result::ERROR_FORMAT_NOT_SUPPORTED);
    assert_eq!(answer(vk::ImageType::TYPE_3D, vk::ImageTiling::OPTIMAL).err(), unsupported);
    assert_eq!(answer(vk::ImageType::TYPE_2D, vk::ImageTiling::LINEAR).err(), unsupported);
}

/// Binds a new image by `group`, and clears it if that is done. Returns its first texel.
fn bound(group: &mut vk::BindImageMemoryDeviceGroupInfo<'_>) -> Result<[u8; 4], vk::Result> {
    let gpu = own();
    let device = gpu.device();
    let info = vk::ImageCreateInfo::default()
        .flags(SPLIT)
        .image_type(vk::ImageType::TYPE_2D)
        .format(FORMAT)
        .extent(vk::Extent3D { width: SIDE, height: SIDE, depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST);
    // SAFETY: see the crate.
    unsafe {
        let image = device.create_image(&info, None).expect("an image");
        let needed = device.get_image_memory_requirements(image);
        let info = vk::MemoryAllocateInfo::default().allocation_size(needed.size);
        let memory = device.allocate_memory(&info, None).expect("memory");
        let bind = vk::BindImageMemoryInfo::default().image(image).memory(memory).push_next(group);
        let result = device.bind_image_memory2(&[bind]);
        let found = result.map(|()| {
            let color = vk::ClearColorValue { float32: [0.2, 0.4, 0.6, 0.8] };
            let buffer = Buffer::new(gpu, u64::from(4 * SIDE * SIDE));
            gpu.run(|commands| {
                let (device, raw) = commands.raw();
                device.cmd_clear_color_image(raw, image, vk::ImageLayout::GENERAL, &color, &[COLOR]);
                commands.barrier();
                let region = vk::BufferImageCopy::default()
                    .image_subresource(
                        vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1),
                    )
                    .image_extent(vk::Extent3D { width: SIDE, height: SIDE, depth: 1 });
                commands.download(image, buffer.raw, &[region]);
            });
            buffer.values()[0]
        });
        device.destroy_image(image, None);
        device.free_memory(memory, None);
        found
    }
}

fn rect(x: i32, width: u32) -> vk::Rect2D {
    vk::Rect2D::default().offset(vk::Offset2D { x, y: 0 }).extent(vk::Extent2D { width, height: SIDE })
}

#[gaurast_runner::test]
fn the_only_device_has_all_of_an_image() {
    let texel = Ok([51, 102, 153, 204]);
    let group = vk::BindImageMemoryDeviceGroupInfo::default;
    assert_eq!(bound(&mut group()), texel);
    assert_eq!(bound(&mut group().device_indices(&[0])), texel);
    assert_eq!(bound(&mut group().split_instance_bind_regions(&[rect(0, SIDE)])), texel);
}

#[gaurast_runner::test]
fn parts_for_devices_that_are_not_there_are_refused() {
    let group = vk::BindImageMemoryDeviceGroupInfo::default;
    for mut refused in [
        group().device_indices(&[1]),
        group().device_indices(&[0, 0]),
        group().split_instance_bind_regions(&[rect(0, SIDE / 2)]),
        group().split_instance_bind_regions(&[rect(0, SIDE / 2), rect(8, SIDE / 2)]),
        group().split_instance_bind_regions(&[rect(1, SIDE)]),
    ] {
        assert!(bound(&mut refused).is_err(), "{refused:?}");
    }
}
