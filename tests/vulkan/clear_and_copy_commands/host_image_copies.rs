//! Copies that the host makes: they are those of a queue.

use ash::vk;
use gaurast_testkit::resource::{aspect_format, aspects};
use gaurast_testkit::{Buffer, Gpu, Image, ImageOptions};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A device on which the host copies images, and the commands for it.
fn open() -> (Gpu, ash::ext::host_image_copy::Device) {
    let mut features = vk::PhysicalDeviceHostImageCopyFeaturesEXT::default().host_image_copy(true);
    let gpu = Gpu::extended(&[ash::ext::host_image_copy::NAME], &mut features).expect("a device");
    let commands = ash::ext::host_image_copy::Device::new(gpu.instance(), gpu.device());
    (gpu, commands)
}

/// The usage of images that the host copies.
const USAGE: vk::ImageUsageFlags = vk::ImageUsageFlags::HOST_TRANSFER_EXT;

const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;

/// A copy between an image and memory.
struct Copy {
    options: ImageOptions,
    aspect: vk::ImageAspectFlags,
    level: u32,
    offset: [i32; 3],
    extent: [u32; 3],
    /// The first layer and the number of layers.
    layers: [u32; 2],
    /// Texels of a row and rows of a slice in memory; 0 if they follow each other.
    pitches: [u32; 2],
}

impl Copy {
    fn subresource(&self) -> vk::ImageSubresourceLayers {
        let [base_array_layer, layer_count] = self.layers;
        vk::ImageSubresourceLayers { aspect_mask: self.aspect, mip_level: self.level, base_array_layer, layer_count }
    }

    fn image_offset(&self) -> vk::Offset3D {
        let [x, y, z] = self.offset;
        vk::Offset3D { x, y, z }
    }

    fn image_extent(&self) -> vk::Extent3D {
        let [width, height, depth] = self.extent;
        vk::Extent3D { width, height, depth }
    }

    /// The copy of a queue.
    fn region(&self) -> vk::BufferImageCopy {
        let [row, height] = self.pitches;
        vk::BufferImageCopy::default()
            .buffer_row_length(row)
            .buffer_image_height(height)
            .image_subresource(self.subresource())
            .image_offset(self.image_offset())
            .image_extent(self.image_extent())
    }

    /// An upper bound of the bytes in memory.
    fn bytes(&self) -> usize {
        let [width, height, depth] = self.extent;
        let texels = width.max(self.pitches[0]) * height.max(self.pitches[1]) * depth * self.layers[1];
        texels as usize * aspect_format(self.options.format, self.aspect).texel_size()
    }
}

fn copies() -> Vec<Copy> {
    let flat = |format, size| ImageOptions::new(format, size, USAGE);
    let color = vk::ImageAspectFlags::COLOR;
    let levels = ImageOptions { levels: 3, layers: 4, ..flat(vk::Format::R8G8B8A8_UNORM, [37, 21]) };
    let volume =
        ImageOptions { size: [11, 9, 7], view: vk::ImageViewType::TYPE_3D, ..flat(vk::Format::R16_SFLOAT, [11, 9]) };
    let blocks = flat(vk::Format::BC3_UNORM_BLOCK, [32, 24]);
    let depths = flat(vk::Format::D32_SFLOAT_S8_UINT, [16, 8]);
    let copy = |options, aspect, level, offset, extent, layers, pitches| Copy {
        options,
        aspect,
        level,
        offset,
        extent,
        layers,
        pitches,
    };
    vec![
        copy(levels, color, 0, [0, 0, 0], [37, 21, 1], [0, 4], [0, 0]),
        copy(levels, color, 1, [3, 2, 0], [9, 7, 1], [1, 2], [12, 9]),
        copy(levels, color, 2, [0, 0, 0], [9, 5, 1], [3, vk::REMAINING_ARRAY_LAYERS], [0, 0]),
        copy(volume, color, 0, [2, 1, 3], [5, 6, 4], [0, 1], [8, 7]),
        copy(blocks, color, 0, [4, 8, 0], [16, 12, 1], [0, 1], [24, 16]),
        copy(depths, vk::ImageAspectFlags::DEPTH, 0, [1, 1, 0], [14, 6, 1], [0, 1], [0, 0]),
        copy(depths, vk::ImageAspectFlags::STENCIL, 0, [0, 3, 0], [16, 5, 1], [0, 1], [20, 0]),
    ]
    .into_iter()
    .map(|copy| match copy.layers {
        [first, vk::REMAINING_ARRAY_LAYERS] => Copy { layers: [first, copy.options.layers - first], ..copy },
        _ => copy,
    })
    .collect()
}

/// An image whose texels are 0.
fn cleared(gpu: &Gpu, copy: &Copy) -> Image {
    let image = Image::new(gpu, &copy.options);
    for aspect in [vk::ImageAspectFlags::COLOR, vk::ImageAspectFlags::DEPTH, vk::ImageAspectFlags::STENCIL] {
        if aspects(copy.options.format).contains(aspect) {
            let len = image.download(aspect).len();
            image.upload(aspect, &vec![0; len]);
        }
    }
    image
}

/// Bytes that are numbers of each format.
fn bytes(rng: &mut ChaCha8Rng, len: usize) -> Vec<u8> {
    (0..len).map(|_| rng.random_range(0..0x3C)).collect()
}

#[gaurast_runner::test]
fn memory_is_copied_to_images_as_by_a_queue() {
    let (gpu, commands) = open();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for copy in copies() {
        let texels = bytes(&mut rng, copy.bytes());
        let (by_host, by_queue) = (cleared(&gpu, &copy), cleared(&gpu, &copy));
        let region = [vk::MemoryToImageCopyEXT {
            p_host_pointer: texels.as_ptr().cast(),
            ..vk::MemoryToImageCopyEXT::default()
        }
        .memory_row_length(copy.pitches[0])
        .memory_image_height(copy.pitches[1])
        .image_subresource(copy.subresource())
        .image_offset(copy.image_offset())
        .image_extent(copy.image_extent())];
        let info =
            vk::CopyMemoryToImageInfoEXT::default().dst_image(by_host.raw).dst_image_layout(GENERAL).regions(&region);
        // SAFETY: see the crate; the texels are those of the region.
        unsafe { commands.copy_memory_to_image(&info) }.expect("a copy");
        let buffer = Buffer::of(&gpu, &texels);
        gpu.run(|commands| commands.upload(&buffer, &by_queue, &[copy.region()]));
        let found = by_host.download(copy.aspect);
        assert!(found == by_queue.download(copy.aspect), "{:?}", copy.options);
        assert!(found.iter().any(|byte| *byte != 0));
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
}

#[gaurast_runner::test]
fn images_are_copied_to_memory_as_by_a_queue() {
    let (gpu, commands) = open();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for copy in copies() {
        let image = cleared(&gpu, &copy);
        let len = image.download(copy.aspect).len();
        image.upload(copy.aspect, &bytes(&mut rng, len));
        let mut found = vec![0xA5u8; copy.bytes()];
        let buffer = Buffer::of(&gpu, &found);
        let region = [vk::ImageToMemoryCopyEXT {
            p_host_pointer: found.as_mut_ptr().cast(),
            ..vk::ImageToMemoryCopyEXT::default()
        }
        .memory_row_length(copy.pitches[0])
        .memory_image_height(copy.pitches[1])
        .image_subresource(copy.subresource())
        .image_offset(copy.image_offset())
        .image_extent(copy.image_extent())];
        let info =
            vk::CopyImageToMemoryInfoEXT::default().src_image(image.raw).src_image_layout(GENERAL).regions(&region);
        // SAFETY: see the crate; there is room for the texels of the region.
        unsafe { commands.copy_image_to_memory(&info) }.expect("a copy");
        gpu.run(|commands| commands.download(&image, &buffer, &[copy.region()]));
        assert!(found == buffer.read()[..found.len()], "{:?}", copy.options);
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
}

/// Whole subresources go through memory of the size that the layout tells, and from image to image.
#[gaurast_runner::test]
fn whole_subresources_are_copied() {
    let (gpu, commands) = open();
    let options = ImageOptions { levels: 2, ..ImageOptions::new(vk::Format::R8G8_UNORM, [10, 6], USAGE) };
    let [first, second, third] = [(); 3].map(|()| Image::new(&gpu, &options));
    let color = vk::ImageAspectFlags::COLOR;
    let texels: Vec<u8> = (0..2 * (60 + 15)).collect();
    first.upload(color, &texels);
    let mut size = vk::SubresourceHostMemcpySizeEXT::default();
    let mut layout = vk::SubresourceLayout2EXT::default().push_next(&mut size);
    let subresource = vk::ImageSubresource2EXT::default()
        .image_subresource(vk::ImageSubresource::default().aspect_mask(color).mip_level(1));
    // SAFETY: see the crate.
    unsafe { commands.get_image_subresource_layout2(first.raw, &subresource, &mut layout) };
    assert_eq!(size.size, 30);
    let layers = vk::ImageSubresourceLayers::default().aspect_mask(color).mip_level(1).layer_count(1);
    let extent = vk::Extent3D { width: 5, height: 3, depth: 1 };
    let mut memory = [0u8; 30];
    let from = [vk::ImageToMemoryCopyEXT {
        p_host_pointer: memory.as_mut_ptr().cast(),
        ..vk::ImageToMemoryCopyEXT::default()
    }
    .image_subresource(layers)
    .image_extent(extent)];
    let from = vk::CopyImageToMemoryInfoEXT::default()
        .flags(vk::HostImageCopyFlagsEXT::MEMCPY)
        .src_image(first.raw)
        .src_image_layout(GENERAL)
        .regions(&from);
    // SAFETY: see the crate; the memory has the size that was told.
    unsafe { commands.copy_image_to_memory(&from) }.expect("a copy");
    let to =
        [vk::MemoryToImageCopyEXT { p_host_pointer: memory.as_ptr().cast(), ..vk::MemoryToImageCopyEXT::default() }
            .image_subresource(layers)
            .image_extent(extent)];
    let to = vk::CopyMemoryToImageInfoEXT::default()
        .flags(vk::HostImageCopyFlagsEXT::MEMCPY)
        .dst_image(second.raw)
        .dst_image_layout(GENERAL)
        .regions(&to);
    let across = [vk::ImageCopy2::default().src_subresource(layers).dst_subresource(layers).extent(extent)];
    let across = vk::CopyImageToImageInfoEXT::default()
        .src_image(second.raw)
        .src_image_layout(GENERAL)
        .dst_image(third.raw)
        .dst_image_layout(GENERAL)
        .regions(&across);
    let range = vk::ImageSubresourceRange::default().aspect_mask(color).level_count(2).layer_count(1);
    let transition = [vk::HostImageLayoutTransitionInfoEXT::default()
        .image(third.raw)
        .old_layout(vk::ImageLayout::UNDEFINED)
        .new_layout(GENERAL)
        .subresource_range(range)];
    // SAFETY: see the crate.
    unsafe {
        commands.copy_memory_to_image(&to).expect("a copy");
        commands.transition_image_layout(&transition).expect("a transition");
        commands.copy_image_to_image(&across).expect("a copy");
    }
    assert_eq!(third.download(color)[120..], texels[120..]);
}

/// Breaks VUID-VkCopyMemoryToImageInfo-imageSubresource-07971, VUID-VkCopyMemoryToImageInfo-imageSubresource-07967,
/// VUID-VkCopyMemoryToImageInfo-imageSubresource-07968, VUID-VkCopyMemoryToImageInfo-imageSubresource-09105 and
/// VUID-VkCopyImageToMemoryInfo-imageSubresource-07971.
#[gaurast_runner::test]
fn what_is_not_in_the_image_is_refused() {
    let (gpu, commands) = open();
    let image = Image::new(&gpu, &ImageOptions::new(vk::Format::R8G8B8A8_UNORM, [8, 8], USAGE));
    let color = vk::ImageAspectFlags::COLOR;
    let before = image.download(color);
    let mut texels = [0x11u8; 4 * 64];
    let whole = vk::ImageSubresourceLayers::default().aspect_mask(color).layer_count(1);
    let extent = |width, height, depth| vk::Extent3D { width, height, depth };
    for (layers, offset, extent) in [
        (whole, [1, 0, 0], extent(8, 8, 1)),
        (whole, [0, -1, 0], extent(8, 8, 1)),
        (whole, [0, 0, 1], extent(8, 8, 1)),
        (whole, [i32::MAX, 0, 0], extent(8, 8, 1)),
        (whole, [0, 0, 0], extent(8, u32::MAX, 1)),
        (whole.mip_level(1), [0, 0, 0], extent(4, 4, 1)),
        (whole.base_array_layer(1), [0, 0, 0], extent(8, 8, 1)),
        (whole.layer_count(2), [0, 0, 0], extent(4, 4, 1)),
        (whole.aspect_mask(vk::ImageAspectFlags::DEPTH), [0, 0, 0], extent(8, 8, 1)),
    ] {
        let offset = vk::Offset3D { x: offset[0], y: offset[1], z: offset[2] };
        let to = [vk::MemoryToImageCopyEXT {
            p_host_pointer: texels.as_ptr().cast(),
            ..vk::MemoryToImageCopyEXT::default()
        }
        .image_subresource(layers)
        .image_offset(offset)
        .image_extent(extent)];
        let to = vk::CopyMemoryToImageInfoEXT::default().dst_image(image.raw).dst_image_layout(GENERAL).regions(&to);
        let from = [vk::ImageToMemoryCopyEXT {
            p_host_pointer: texels.as_mut_ptr().cast(),
            ..vk::ImageToMemoryCopyEXT::default()
        }
        .image_subresource(layers)
        .image_offset(offset)
        .image_extent(extent)];
        let from =
            vk::CopyImageToMemoryInfoEXT::default().src_image(image.raw).src_image_layout(GENERAL).regions(&from);
        // SAFETY: see the crate; what the commands ask for is not in the image, and so they touch no memory.
        unsafe {
            assert!(commands.copy_memory_to_image(&to).is_err(), "{layers:?} {offset:?} {extent:?}");
            assert!(commands.copy_image_to_memory(&from).is_err(), "{layers:?} {offset:?} {extent:?}");
        }
    }
    assert!(image.download(color) == before && texels == [0x11; 4 * 64]);
}

/// The host copies from and to every layout that the lists of properties have; a shorter list gets what fits.
#[gaurast_runner::test]
fn properties_list_the_layouts() {
    let (gpu, _) = open();
    let read = |source: &mut [vk::ImageLayout], target: &mut [vk::ImageLayout]| {
        let mut found = vk::PhysicalDeviceHostImageCopyPropertiesEXT::default();
        if !source.is_empty() {
            found = found.copy_src_layouts(source).copy_dst_layouts(target);
        }
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut found);
        // SAFETY: see the crate.
        unsafe { gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut properties) };
        assert_eq!(found.identical_memory_type_requirements, vk::TRUE);
        [found.copy_src_layout_count as usize, found.copy_dst_layout_count as usize]
    };
    let [sources, targets] = read(&mut [], &mut []);
    let (mut source, mut target) =
        (vec![vk::ImageLayout::UNDEFINED; sources], vec![vk::ImageLayout::UNDEFINED; targets]);
    assert_eq!(read(&mut source, &mut target), [sources, targets]);
    for layouts in [&source, &target] {
        assert!(layouts.contains(&GENERAL) && layouts.contains(&vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL));
        assert!(!layouts.contains(&vk::ImageLayout::UNDEFINED));
    }
    let mut short = [vk::ImageLayout::UNDEFINED; 2];
    assert_eq!(read(&mut short, &mut target), [2, targets]);
    assert_eq!(short[..], source[..2]);
}
