//! Linear images: the host reads what a copy wrote where the layouts of subresources say.

use ash::vk;
use gaurast_testkit::devices::{MAPPABLE, allocate, own};
use gaurast_testkit::{Buffer, Gpu};

/// A linear image.
struct Shape {
    format: vk::Format,
    ty: vk::ImageType,
    size: [u32; 3],
    levels: u32,
    layers: u32,
    /// The width and height of a block in texels, and its bytes.
    block: ([u32; 2], usize),
}

impl Shape {
    /// The blocks of a level, along each axis.
    fn blocks(&self, level: u32) -> [usize; 3] {
        let [width, height, depth] = self.size.map(|size| (size >> level).max(1));
        [width.div_ceil(self.block.0[0]), height.div_ceil(self.block.0[1]), depth].map(|count| count as usize)
    }
}

/// Copies bytes to each subresource, and compares them with those in the image's memory.
fn check(gpu: &Gpu, shape: &Shape) {
    let [width, height, depth] = shape.size;
    let info = vk::ImageCreateInfo::default()
        .image_type(shape.ty)
        .format(shape.format)
        .extent(vk::Extent3D { width, height, depth })
        .mip_levels(shape.levels)
        .array_layers(shape.layers)
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::LINEAR)
        .usage(vk::ImageUsageFlags::TRANSFER_DST);
    let device = gpu.device();
    // SAFETY: see the crate.
    unsafe {
        let image = device.create_image(&info, None).expect("an image");
        let needed = device.get_image_memory_requirements(image);
        let memory = allocate(gpu, needed.size, MAPPABLE);
        device.bind_image_memory(image, memory, 0).expect("memory");
        let mapped = device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()).expect("a mapping");
        for (level, layer) in (0..shape.levels).flat_map(|level| (0..shape.layers).map(move |layer| (level, layer))) {
            let [columns, rows, slices] = shape.blocks(level);
            let row = columns * shape.block.1;
            let bytes: Vec<u8> =
                (0..row * rows * slices).map(|byte| (byte as u32 * 7 + level + 31 * layer) as u8).collect();
            let buffer = Buffer::of(gpu, &bytes);
            let [width, height, depth] = shape.size.map(|size| (size >> level).max(1));
            let region = [vk::BufferImageCopy::default()
                .image_subresource(vk::ImageSubresourceLayers {
                    aspect_mask: vk::ImageAspectFlags::COLOR,
                    mip_level: level,
                    base_array_layer: layer,
                    layer_count: 1,
                })
                .image_extent(vk::Extent3D { width, height, depth })];
            gpu.run(|commands| {
                let general = vk::ImageLayout::GENERAL;
                device.cmd_copy_buffer_to_image(commands.raw, buffer.raw, image, general, &region);
                commands.barrier();
            });
            let subresource =
                vk::ImageSubresource { aspect_mask: vk::ImageAspectFlags::COLOR, mip_level: level, array_layer: layer };
            let layout = device.get_image_subresource_layout(image, subresource);
            for (number, expected) in bytes.chunks(row).enumerate() {
                let (slice, line) = ((number / rows) as u64, (number % rows) as u64);
                let at = layout.offset + slice * layout.depth_pitch + line * layout.row_pitch;
                assert!(at + row as u64 <= needed.size);
                let found = std::slice::from_raw_parts(mapped.cast::<u8>().add(at as usize), row);
                assert_eq!(found, expected, "{:?}, level {level}, layer {layer}, row {number}", shape.format);
            }
        }
        device.destroy_image(image, None);
        device.free_memory(memory, None);
    }
}

#[gaurast_runner::test]
fn subresources_lie_where_their_layouts_say() {
    let (one, two, three) = (vk::ImageType::TYPE_1D, vk::ImageType::TYPE_2D, vk::ImageType::TYPE_3D);
    let shape = |format, ty, size, levels, layers, block| Shape { format, ty, size, levels, layers, block };
    for shape in [
        shape(vk::Format::R8G8B8A8_UNORM, two, [13, 9, 1], 4, 3, ([1, 1], 4)),
        shape(vk::Format::R16_SFLOAT, one, [37, 1, 1], 6, 2, ([1, 1], 2)),
        shape(vk::Format::R32_UINT, three, [7, 6, 5], 3, 1, ([1, 1], 4)),
        shape(vk::Format::BC1_RGB_UNORM_BLOCK, two, [22, 17, 1], 1, 1, ([4, 4], 8)),
        shape(vk::Format::BC7_SRGB_BLOCK, two, [24, 24, 1], 5, 2, ([4, 4], 16)),
        shape(vk::Format::EAC_R11_SNORM_BLOCK, two, [22, 17, 1], 3, 1, ([4, 4], 8)),
        shape(vk::Format::ASTC_10X6_UNORM_BLOCK, two, [31, 40, 1], 4, 2, ([10, 6], 16)),
        shape(vk::Format::ASTC_5X4_SRGB_BLOCK, three, [12, 7, 4], 3, 1, ([5, 4], 16)),
        shape(vk::Format::R8G8_SSCALED, two, [11, 5, 1], 1, 1, ([1, 1], 2)),
    ] {
        check(own(), &shape);
    }
}
