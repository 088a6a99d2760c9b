//! Planes of images with chroma: copies of parts of them, views of one, their limits, and what is refused.

use super::image::{ImagePlan, Picture, YcbcrImage, layers};
use ash::vk;
use gaurast_testkit::devices::{COLOR, open, own};
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::texels::Noise;
use gaurast_testkit::{Bindings, Buffer, Gpu, Image, ImageOptions, Kernel, Resource};
use vk::ImageUsageFlags as Usage;

const SIZE: [u32; 2] = [16, 8];

fn plan(format: vk::Format) -> ImagePlan {
    ImagePlan::new(format, SIZE).expect("a format with chroma")
}

/// The formats of the planes' texels, by which other images are compatible with them.
fn plane_format(plan: &ImagePlan, number: usize) -> vk::Format {
    match (plan.bits, plan.plane(number).1) {
        (8, 1) => vk::Format::R8_UNORM,
        (8, _) => vk::Format::R8G8_UNORM,
        (10, 1) => vk::Format::R10X6_UNORM_PACK16,
        (10, _) => vk::Format::R10X6G10X6_UNORM_2PACK16,
        (12, 1) => vk::Format::R12X4_UNORM_PACK16,
        (12, _) => vk::Format::R12X4G12X4_UNORM_2PACK16,
        (_, 1) => vk::Format::R16_UNORM,
        _ => vk::Format::R16G16_UNORM,
    }
}

/// A part of a plane goes to a buffer with longer rows, and from there to another part of another image's plane.
#[gaurast_runner::test]
fn parts_of_planes_are_copied_by_buffers() {
    let gpu = own();
    let mut noise = Noise::new(41);
    for plan in ImagePlan::all(SIZE) {
        let picture = Picture::random(plan, &mut noise);
        let (from, to) = (YcbcrImage::joint(gpu, plan), YcbcrImage::joint(gpu, plan));
        from.upload(&picture);
        to.upload(&Picture::random(plan, &mut noise));
        let mut expected = to.download();
        let buffer = Buffer::new(gpu, 4096);
        for (number, expected) in expected.iter_mut().enumerate() {
            let region = |x: i32, y: i32| {
                vk::BufferImageCopy::default()
                    .buffer_offset(1024 * number as u64)
                    .buffer_row_length(10)
                    .image_subresource(layers(plan.aspect(number)))
                    .image_offset(vk::Offset3D { x, y, z: 0 })
                    .image_extent(vk::Extent3D { width: 4, height: 2, depth: 1 })
            };
            gpu.run(|commands| commands.download(from.raw, &buffer, &[region(2, 1)]));
            gpu.run(|commands| commands.upload(&buffer, to.raw, &[region(4, 2)]));
            let ([width, _], components) = plan.plane(number);
            let texel = components * plan.component_size();
            let bytes = &picture.bytes()[number];
            for y in 0..2 {
                let at = |x: usize, y: usize| (y * width as usize + x) * texel;
                let row = &bytes[at(2, 1 + y)..][..4 * texel];
                expected[at(4, 2 + y)..][..4 * texel].copy_from_slice(row);
            }
        }
        assert_eq!(to.download(), expected, "{:?}", plan.format);
    }
}

/// A plane goes to an image of its texels' format, and from there to another image's plane; and from plane to plane, several
/// by one command.
#[gaurast_runner::test]
fn planes_are_copied_by_images() {
    let gpu = own();
    let mut noise = Noise::new(42);
    let general = vk::ImageLayout::GENERAL;
    for plan in ImagePlan::all(SIZE).into_iter().filter(|plan| plan.arrangement.planes() > 1) {
        let picture = Picture::random(plan, &mut noise);
        let from = YcbcrImage::disjoint(gpu, plan);
        from.upload(&picture);
        let (one_by_one, together) = (YcbcrImage::joint(gpu, plan), YcbcrImage::joint(gpu, plan));
        let mut regions = Vec::new();
        for number in 0..plan.arrangement.planes() {
            let (size, _) = plan.plane(number);
            let image = Image::new(gpu, &ImageOptions::new(plane_format(&plan, number), size, Usage::SAMPLED));
            let extent = vk::Extent3D { width: size[0], height: size[1], depth: 1 };
            let copy = |from, to| {
                vk::ImageCopy::default().src_subresource(layers(from)).dst_subresource(layers(to)).extent(extent)
            };
            let (color, plane) = (vk::ImageAspectFlags::COLOR, plan.aspect(number));
            gpu.run(|commands| {
                let device = commands.device();
                // SAFETY: see the crate.
                unsafe {
                    let there = [copy(plane, color)];
                    device.cmd_copy_image(commands.raw, from.raw, general, image.raw, general, &there);
                    commands.barrier();
                    let back = [copy(color, plane)];
                    device.cmd_copy_image(commands.raw, image.raw, general, one_by_one.raw, general, &back);
                    commands.barrier();
                }
            });
            regions.push(copy(plane, plane));
        }
        gpu.run(|commands| {
            // SAFETY: see the crate.
            unsafe {
                let device = commands.device();
                device.cmd_copy_image(commands.raw, from.raw, general, together.raw, general, &regions);
            }
            commands.barrier();
        });
        assert_eq!(one_by_one.download(), picture.bytes(), "{:?}", plan.format);
        assert_eq!(together.download(), picture.bytes(), "{:?}", plan.format);
    }
}

/// Programs fetch texels through a view of a plane, and store them through another, of an image with an extended usage.
#[gaurast_runner::test(needs = [GLSLANG])]
fn planes_have_views() {
    let gpu = own();
    let mut noise = Noise::new(43);
    let flags = vk::ImageCreateFlags::MUTABLE_FORMAT | vk::ImageCreateFlags::EXTENDED_USAGE;
    for (format, disjoint) in [
        (vk::Format::G8_B8R8_2PLANE_420_UNORM, vk::ImageCreateFlags::empty()),
        (vk::Format::G8_B8R8_2PLANE_420_UNORM, vk::ImageCreateFlags::DISJOINT),
        (vk::Format::G8_B8_R8_3PLANE_422_UNORM, vk::ImageCreateFlags::DISJOINT),
    ] {
        let plan = plan(format);
        let usage = Usage::SAMPLED | Usage::STORAGE;
        let image = YcbcrImage::new(gpu, plan, vk::ImageTiling::OPTIMAL, flags | disjoint, usage);
        let picture = Picture::random(plan, &mut noise);
        image.upload(&picture);
        for number in 0..plan.arrangement.planes() {
            let mut used = vk::ImageViewUsageCreateInfo::default().usage(Usage::STORAGE);
            let info = image.view_info(plane_format(&plan, number), plan.aspect(number)).push_next(&mut used);
            // SAFETY: see the crate.
            let view = unsafe { gpu.device().create_image_view(&info, None) }.expect("a view of a plane");
            let bindings = Bindings::new(gpu, &[Resource::StorageImage(view)]);
            // Every texel's components become 1 less what they were.
            let kernel = Kernel::new(
                gpu,
                "#extension GL_EXT_shader_image_load_formatted : require
                 layout(local_size_x = 1, local_size_y = 1) in;
                 layout(binding = 0) uniform image2D image;
                 void main() {
                     ivec2 at = ivec2(gl_GlobalInvocationID.xy);
                     imageStore(image, at, 1.0 - imageLoad(image, at));
                 }",
                &bindings,
            );
            let ([width, height], _) = plan.plane(number);
            kernel.run(&[bindings.set], &[], [width, height, 1]);
            drop(kernel);
            // SAFETY: see the crate.
            unsafe { gpu.device().destroy_image_view(view, None) };
        }
        let expected: Vec<Vec<u8>> =
            picture.bytes().into_iter().map(|plane| plane.into_iter().map(|byte| 255 - byte).collect()).collect();
        assert_eq!(image.download(), expected, "{format:?}");
    }
}

/// A plane is rendered to through a view.
#[gaurast_runner::test]
fn planes_are_attachments() {
    let gpu = own();
    let plan = plan(vk::Format::G8_B8R8_2PLANE_420_UNORM);
    let flags = vk::ImageCreateFlags::MUTABLE_FORMAT | vk::ImageCreateFlags::EXTENDED_USAGE;
    let image = YcbcrImage::new(gpu, plan, vk::ImageTiling::OPTIMAL, flags, Usage::COLOR_ATTACHMENT);
    let picture = Picture::random(plan, &mut Noise::new(44));
    image.upload(&picture);
    let mut used = vk::ImageViewUsageCreateInfo::default().usage(Usage::COLOR_ATTACHMENT);
    let info = image.view_info(vk::Format::R8G8_UNORM, vk::ImageAspectFlags::PLANE_1).push_next(&mut used);
    // SAFETY: see the crate.
    let view = unsafe { gpu.device().create_image_view(&info, None) }.expect("a view of a plane");
    gpu.run(|commands| {
        let clear = vk::ClearValue { color: vk::ClearColorValue { float32: [0.2, 0.4, 0.0, 0.0] } };
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(clear)];
        let extent = vk::Extent2D { width: SIZE[0] / 2, height: SIZE[1] / 2 };
        let info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D { offset: vk::Offset2D::default(), extent })
            .layer_count(1)
            .color_attachments(&attachments);
        commands.barrier();
        // SAFETY: see the crate.
        unsafe {
            commands.device().cmd_begin_rendering(commands.raw, &info);
            commands.device().cmd_end_rendering(commands.raw);
        }
        commands.barrier();
    });
    let [luma, chroma] = image.download().try_into().expect("two planes");
    assert_eq!(luma, picture.bytes()[0]);
    assert_eq!(chroma, [51, 102].repeat((SIZE[0] * SIZE[1] / 4) as usize));
    // SAFETY: see the crate.
    unsafe { gpu.device().destroy_image_view(view, None) };
}

#[gaurast_runner::test]
fn limits_are_those_of_images_with_chroma() {
    let gpu = own();
    let query = |format, ty, flags| {
        let info = vk::PhysicalDeviceImageFormatInfo2::default()
            .format(format)
            .ty(ty)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(Usage::SAMPLED | Usage::TRANSFER_DST)
            .flags(flags);
        let mut descriptors = vk::SamplerYcbcrConversionImageFormatProperties::default();
        let mut found = vk::ImageFormatProperties2::default().push_next(&mut descriptors);
        // SAFETY: the physical device is the instance's.
        let result = unsafe {
            gpu.instance().get_physical_device_image_format_properties2(gpu.physical_device(), &info, &mut found)
        };
        let found = found.image_format_properties;
        result.map(|()| (found, descriptors.combined_image_sampler_descriptor_count))
    };
    let (none, disjoint) = (vk::ImageCreateFlags::empty(), vk::ImageCreateFlags::DISJOINT);
    let flat = vk::ImageType::TYPE_2D;
    let unsupported = Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED);
    for plan in ImagePlan::all(SIZE) {
        let (found, descriptors) = query(plan.format, flat, none).expect("such images");
        assert_eq!(descriptors, 1);
        assert_eq!((found.max_mip_levels, found.max_array_layers), (1, 1));
        assert_eq!(found.sample_counts, vk::SampleCountFlags::TYPE_1);
        let has_planes = plan.arrangement.planes() > 1;
        assert_eq!(query(plan.format, flat, disjoint).is_ok(), has_planes, "{:?}", plan.format);
        assert_eq!(query(plan.format, vk::ImageType::TYPE_3D, none).map(drop), unsupported);
        let features = gpu.format_features(plan.format);
        assert_eq!(features.contains(vk::FormatFeatureFlags::DISJOINT), has_planes);
        assert!(!features.intersects(vk::FormatFeatureFlags::BLIT_SRC | vk::FormatFeatureFlags::COLOR_ATTACHMENT));
    }
    assert_eq!(query(vk::Format::R8_UNORM, flat, disjoint).map(drop), unsupported);
}

/// The ids of the messages of `call`.
fn refusal(gpu: &Gpu, call: impl FnOnce()) -> String {
    drop(gpu.messages());
    call();
    let messages = gpu.messages();
    messages.into_iter().map(|message| message.id).collect::<Vec<_>>().join(" ")
}

#[gaurast_runner::test]
fn what_cannot_be_is_refused() {
    let gpu = &open();
    let device = gpu.device();
    let format = vk::Format::G8_B8R8_2PLANE_420_UNORM;
    let image = YcbcrImage::joint(gpu, plan(format));
    let odd = |[width, height]: [u32; 2]| {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(Usage::SAMPLED);
        // SAFETY: nothing is created.
        let made = unsafe { device.create_image(&info, None) };
        assert!(made.is_err());
    };
    assert_eq!(refusal(gpu, || odd([5, 4])), "VUID-VkImageCreateInfo-format-04712");
    assert_eq!(refusal(gpu, || odd([4, 5])), "VUID-VkImageCreateInfo-format-04713");
    let view = |format, aspect| {
        // SAFETY: nothing is created.
        let made = unsafe { device.create_image_view(&image.view_info(format, aspect), None) };
        assert!(made.is_err());
    };
    let (color, second) = (vk::ImageAspectFlags::COLOR, vk::ImageAspectFlags::PLANE_1);
    assert_eq!(refusal(gpu, || view(format, color)), "VUID-VkImageViewCreateInfo-format-06415");
    assert_eq!(refusal(gpu, || view(vk::Format::R8_UNORM, color)), "VUID-VkImageViewCreateInfo-image-01762");
    assert_eq!(refusal(gpu, || view(vk::Format::R8_UNORM, second)), "VUID-VkImageViewCreateInfo-image-01586");
    let conversion = |format| vk::SamplerYcbcrConversionCreateInfo::default().format(format);
    let refused = || {
        // SAFETY: nothing is created.
        let made = unsafe { device.create_sampler_ycbcr_conversion(&conversion(vk::Format::R8G8B8A8_UNORM), None) };
        assert!(made.is_err());
    };
    assert_eq!(refusal(gpu, refused), "VUID-VkSamplerYcbcrConversionCreateInfo-format-01650");
    // SAFETY: what is created is destroyed after its last use.
    unsafe {
        let made = device.create_sampler_ycbcr_conversion(&conversion(format), None).expect("a conversion");
        let mut chained = vk::SamplerYcbcrConversionInfo::default().conversion(made);
        let info = vk::SamplerCreateInfo::default().unnormalized_coordinates(true).push_next(&mut chained);
        let refused = || assert!(device.create_sampler(&info, None).is_err());
        assert_eq!(refusal(gpu, refused), "VUID-VkSamplerCreateInfo-addressModeU-01646");
        device.destroy_sampler_ycbcr_conversion(made, None);
    }
    let commands = || {
        let recorded = gpu.try_record(|commands| {
            // SAFETY: see the crate.
            unsafe {
                let black = vk::ClearColorValue::default();
                device.cmd_clear_color_image(commands.raw, image.raw, vk::ImageLayout::GENERAL, &black, &[COLOR]);
            }
        });
        assert!(recorded.is_err());
    };
    // The recording says it, and its end.
    assert_eq!(refusal(gpu, commands), ["VUID-vkCmdClearColorImage-image-01545"; 2].join(" "));
}
