//! Images whose usage is that of a format of their views, not of their own (`VK_IMAGE_CREATE_EXTENDED_USAGE_BIT`).

use ash::vk;
use gaurast_testkit::devices::{COLOR, own};
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Bindings, Image, ImageOptions, Kernel, Resource};
use vk::ImageUsageFlags as Usage;

const MUTABLE: vk::ImageCreateFlags = vk::ImageCreateFlags::MUTABLE_FORMAT;
const EXTENDED: vk::ImageCreateFlags = vk::ImageCreateFlags::from_raw(
    vk::ImageCreateFlags::MUTABLE_FORMAT.as_raw() | vk::ImageCreateFlags::EXTENDED_USAGE.as_raw(),
);

fn limits(
    format: vk::Format,
    tiling: vk::ImageTiling,
    usage: Usage,
    flags: vk::ImageCreateFlags,
) -> Result<vk::ImageFormatProperties, vk::Result> {
    let (gpu, ty) = (own(), vk::ImageType::TYPE_2D);
    // SAFETY: the physical device is the instance's.
    unsafe {
        let (instance, device) = (gpu.instance(), gpu.physical_device());
        instance.get_physical_device_image_format_properties(device, format, ty, tiling, usage, flags)
    }
}

#[gaurast_runner::test]
fn an_extended_usage_is_that_of_any_compatible_format() {
    let unsupported = Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED);
    let shared = vk::Format::E5B9G9R9_UFLOAT_PACK32;
    for (format, usage) in [
        (vk::Format::R8_SRGB, Usage::STORAGE),
        (vk::Format::R8G8_SRGB, Usage::STORAGE),
        (vk::Format::R8G8B8A8_SRGB, Usage::STORAGE),
        (vk::Format::B8G8R8A8_SRGB, Usage::STORAGE),
        (vk::Format::A8B8G8R8_SRGB_PACK32, Usage::STORAGE),
        (shared, Usage::STORAGE),
        (shared, Usage::COLOR_ATTACHMENT),
        (shared, Usage::INPUT_ATTACHMENT),
    ] {
        for tiling in [vk::ImageTiling::OPTIMAL, vk::ImageTiling::LINEAR] {
            assert!(limits(format, tiling, usage, EXTENDED).is_ok(), "{format:?} {usage:?} {tiling:?}");
            assert_eq!(limits(format, tiling, usage, MUTABLE).map(drop), unsupported, "{format:?} {usage:?}");
        }
    }
    // No format of three bytes, of compressed blocks or of depths can be stored to.
    for format in [vk::Format::R8G8B8_SRGB, vk::Format::BC7_SRGB_BLOCK, vk::Format::D32_SFLOAT] {
        let refused = limits(format, vk::ImageTiling::OPTIMAL, Usage::STORAGE, EXTENDED);
        assert_eq!(refused.map(drop), unsupported, "{format:?}");
    }
    let samples =
        limits(shared, vk::ImageTiling::OPTIMAL, Usage::COLOR_ATTACHMENT, EXTENDED).map(|it| it.sample_counts);
    assert!(samples.is_ok_and(|samples| samples.contains(vk::SampleCountFlags::TYPE_4)));
}

/// A view of another format of the image of these options.
fn view(image: &Image, format: vk::Format) -> vk::ImageView {
    let mut usage = vk::ImageViewUsageCreateInfo::default().usage(image.options.usage);
    let info = vk::ImageViewCreateInfo::default()
        .image(image.raw)
        .view_type(vk::ImageViewType::TYPE_2D)
        .format(format)
        .subresource_range(COLOR)
        .push_next(&mut usage);
    // SAFETY: see the crate.
    unsafe { own().device().create_image_view(&info, None) }.expect("a view")
}

const SIDE: u32 = 8;

/// Texels are stored through a view of a format that can be stored to, and are read as the image's own.
#[gaurast_runner::test(needs = [GLSLANG])]
fn texels_are_stored_through_a_view() {
    let gpu = own();
    for format in [vk::Format::R8G8B8A8_SRGB, vk::Format::E5B9G9R9_UFLOAT_PACK32] {
        let options =
            ImageOptions { flags: EXTENDED, ..ImageOptions::new(format, [SIDE; 2], Usage::STORAGE | Usage::SAMPLED) };
        let image = Image::new(gpu, &options);
        let view = view(&image, vk::Format::R32_UINT);
        let bindings = Bindings::new(gpu, &[Resource::StorageImage(view)]);
        let kernel = Kernel::new(
            gpu,
            "layout(local_size_x = 8, local_size_y = 8) in;
             layout(binding = 0, r32ui) uniform uimage2D image;
             void main() {
                 ivec2 at = ivec2(gl_GlobalInvocationID.xy);
                 imageStore(image, at, uvec4(0x01010101 * (8 * at.y + at.x)));
             }",
            &bindings,
        );
        kernel.run(&[bindings.set], &[], [1, 1, 1]);
        let expected: Vec<u8> = (0..SIDE * SIDE).flat_map(|texel| [texel as u8; 4]).collect();
        assert_eq!(image.read(vk::ImageAspectFlags::COLOR, 4), expected, "{format:?}");
        drop(kernel);
        // SAFETY: see the crate.
        unsafe { gpu.device().destroy_image_view(view, None) };
    }
}

/// An image of shared exponents is rendered to through a view of a format that can be.
#[gaurast_runner::test]
fn attachments_are_rendered_through_a_view() {
    let gpu = own();
    let options = ImageOptions {
        flags: EXTENDED,
        ..ImageOptions::new(vk::Format::E5B9G9R9_UFLOAT_PACK32, [SIDE; 2], Usage::COLOR_ATTACHMENT)
    };
    let image = Image::new(gpu, &options);
    let view = view(&image, vk::Format::R8G8B8A8_UNORM);
    gpu.run(|commands| {
        let clear = vk::ClearValue { color: vk::ClearColorValue { float32: [1.0, 0.0, 0.2, 0.4] } };
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(clear)];
        let extent = vk::Extent2D { width: SIDE, height: SIDE };
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
    let expected = [255, 0, 51, 102].repeat((SIDE * SIDE) as usize);
    assert_eq!(image.read(vk::ImageAspectFlags::COLOR, 4), expected);
    // SAFETY: see the crate.
    unsafe { gpu.device().destroy_image_view(view, None) };
}
