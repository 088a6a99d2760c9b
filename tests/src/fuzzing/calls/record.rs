//! Commands that are recorded. The safety of `unsafe` is explained in the parent module.

use ash::vk;
use gaurast::vk::{
    GaussianCameraDistortionGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianDistortionModelGAURAST,
};

use super::run::{DEPTH_FORMATS, Run, pick};
use crate::fuzzing::bytes::Bytes;

pub(super) fn begin_rendering(run: &mut Run, bytes: &mut Bytes<'_>) {
    let Some((image, view)) = pick(bytes, &run.images) else {
        return;
    };
    let depth = pick(bytes, &run.images).filter(|(image, _)| DEPTH_FORMATS.contains(&image.format));
    let has_stencil = depth.is_some_and(|(image, _)| image.format == DEPTH_FORMATS[1]);
    let color = [vk::RenderingAttachmentInfo::default()
        .image_view(*view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(bytes.one(&[vk::AttachmentLoadOp::CLEAR, vk::AttachmentLoadOp::LOAD, vk::AttachmentLoadOp::DONT_CARE]))
        .store_op(vk::AttachmentStoreOp::STORE)];
    let depth = depth.map(|(_, view)| {
        vk::RenderingAttachmentInfo::default()
            .image_view(*view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
    });
    let extent = image.extent;
    let mut side = |usual: u32| {
        if bytes.rarely(8) { bytes.number(200) } else { usual }
    };
    let area = vk::Rect2D {
        offset: vk::Offset2D { x: side(0).cast_signed(), y: side(0).cast_signed() },
        extent: vk::Extent2D { width: side(extent[0]), height: side(extent[1]) },
    };
    let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&color);
    if let Some(depth) = &depth {
        info = info.depth_attachment(depth);
        if has_stencil {
            info = info.stencil_attachment(depth);
        }
    }
    // SAFETY: see above.
    unsafe { run.device.cmd_begin_rendering(run.commands, &info) };
}

pub(super) fn copy(run: &mut Run, bytes: &mut Bytes<'_>) {
    let (Some(from), Some(to)) = (pick(bytes, &run.buffers), pick(bytes, &run.buffers)) else {
        return;
    };
    let (from, to) = (from.handle, to.handle);
    let image = pick(bytes, &run.images).map(|(image, _)| image.handle);
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: bytes.one(&[vk::ImageAspectFlags::COLOR, vk::ImageAspectFlags::DEPTH]),
        mip_level: bytes.number(2),
        base_array_layer: bytes.number(2),
        layer_count: bytes.number(2),
    };
    let region =
        [vk::BufferCopy::default().src_offset(bytes.long(3000)).dst_offset(bytes.long(3000)).size(bytes.long(3000))];
    let texels = [vk::BufferImageCopy {
        buffer_offset: bytes.long(3000),
        buffer_row_length: bytes.number(60),
        buffer_image_height: bytes.number(60),
        image_subresource: layers,
        image_offset: vk::Offset3D { x: bytes.number(30).cast_signed(), y: bytes.number(30).cast_signed(), z: 0 },
        image_extent: vk::Extent3D { width: bytes.number(60), height: bytes.number(60), depth: 1 },
    }];
    let layout = vk::ImageLayout::GENERAL;
    let (device, commands) = (&run.device, run.commands);
    // SAFETY: see above.
    unsafe {
        match (bytes.below(6), image) {
            (0, _) => device.cmd_copy_buffer(commands, from, to, &region),
            (1, _) => {
                device.cmd_fill_buffer(commands, to, bytes.long(3000), bytes.long(3000), bytes.word());
            }
            (2, _) => {
                device.cmd_update_buffer(commands, to, bytes.long(3000), &[bytes.byte(); 64]);
            }
            (3, Some(image)) => {
                device.cmd_copy_buffer_to_image(commands, from, image, layout, &texels);
            }
            (4, Some(image)) => {
                device.cmd_copy_image_to_buffer(commands, image, layout, to, &texels);
            }
            (_, Some(image)) => {
                let range = vk::ImageSubresourceRange {
                    aspect_mask: layers.aspect_mask,
                    base_mip_level: layers.mip_level,
                    level_count: bytes.number(3),
                    base_array_layer: layers.base_array_layer,
                    layer_count: layers.layer_count,
                };
                let color = vk::ClearColorValue { float32: [0; 4].map(|_| bytes.float()) };
                device.cmd_clear_color_image(commands, image, layout, &color, &[range]);
            }
            (_, None) => {}
        }
    }
}

pub(super) fn query(run: &mut Run, bytes: &mut Bytes<'_>) {
    let (first, count) = (bytes.number(4), bytes.number(4));
    let (device, commands, queries) = (&run.device, run.commands, run.queries);
    // SAFETY: see above; results are written to memory of their own.
    unsafe {
        match bytes.below(4) {
            0 => device.cmd_reset_query_pool(commands, queries, first, count),
            1 => {
                let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
                device.cmd_write_timestamp(commands, stage, queries, first);
            }
            2 => {
                let Some(buffer) = pick(bytes, &run.buffers) else {
                    return;
                };
                let (offset, stride) = (bytes.long(3000), bytes.long(64));
                let flags = vk::QueryResultFlags::from_raw(bytes.below(16) as u32 & 0b1101);
                device.cmd_copy_query_pool_results(
                    commands,
                    queries,
                    first,
                    count,
                    buffer.handle,
                    offset,
                    stride,
                    flags,
                );
            }
            _ => {
                let mut results = [0u64; 4];
                let count = count as usize % 5;
                let flags = vk::QueryResultFlags::TYPE_64;
                let got = device.get_query_pool_results(queries, first, &mut results[..count], flags);
                run.note(got);
            }
        }
    }
}

/// Sets a camera, viewport, scissor, push constants and pipeline, and returns the camera.
pub(super) fn set_state(run: &mut Run, bytes: &mut Bytes<'_>) -> GaussianCameraGAURAST<'static> {
    let mut or = |usual: f32| {
        if bytes.rarely(8) { bytes.float() } else { usual }
    };
    let camera = GaussianCameraGAURAST::default()
        .eye([or(0.0).into(), or(0.0).into(), or(-3.0).into()])
        .focal_length([or(30.0), or(30.0)])
        .principal_point([or(20.0), or(20.0)])
        .near_plane(or(0.2))
        .far_plane(or(f32::INFINITY));
    let viewport = vk::Viewport {
        x: or(0.0),
        y: or(0.0),
        width: or(60.0),
        height: or(50.0),
        min_depth: or(0.0),
        max_depth: or(1.0),
    };
    let camera = camera.model(bytes.one(&[
        GaussianCameraModelGAURAST::PINHOLE,
        GaussianCameraModelGAURAST::ORTHOGRAPHIC,
        GaussianCameraModelGAURAST::FISHEYE,
        GaussianCameraModelGAURAST::EQUIRECTANGULAR,
    ]));
    let scissor = vk::Rect2D {
        offset: vk::Offset2D { x: bytes.number(9).cast_signed(), y: bytes.number(9).cast_signed() },
        extent: vk::Extent2D { width: bytes.number(90), height: bytes.number(90) },
    };
    // SAFETY: see above.
    unsafe {
        run.gaussian.cmd_set_gaussian_cameras(run.commands, &[camera]);
        run.device.cmd_set_viewport(run.commands, bytes.number(1), &[viewport]);
        run.device.cmd_set_scissor(run.commands, 0, &[scissor]);
        if bytes.rarely(2) {
            let (offset, stage) = (bytes.number(1), vk::ShaderStageFlags::VERTEX);
            let constants = [0; 4].map(|_| bytes.float());
            let constants: &[u8] = bytemuck::cast_slice(&constants);
            run.device.cmd_push_constants(run.commands, run.layout, stage, offset, constants);
        }
        if let Some(pipeline) = pick(bytes, &run.pipelines) {
            let point = vk::PipelineBindPoint::GRAPHICS;
            run.device.cmd_bind_pipeline(run.commands, point, *pipeline);
        }
    }
    camera
}

/// Sets the state, with a lens that distorts.
pub(super) fn set_state_with_lens(run: &mut Run, bytes: &mut Bytes<'_>) {
    let camera = set_state(run, bytes);
    let model = bytes.one(&[
        GaussianDistortionModelGAURAST::RATIONAL,
        GaussianDistortionModelGAURAST::POLYNOMIAL,
        GaussianDistortionModelGAURAST::POLYNOMIAL_FIRST,
        GaussianDistortionModelGAURAST::FIELD_OF_VIEW,
        GaussianDistortionModelGAURAST::DIVISION,
    ]);
    let mut or_none = || if bytes.rarely(3) { bytes.float() } else { 0.0 };
    let mut lens = GaussianCameraDistortionGAURAST::default()
        .model(model)
        .radial([0; 6].map(|_| or_none()))
        .tangential([0; 2].map(|_| or_none()))
        .thin_prism([0; 4].map(|_| or_none()));
    let camera = camera.push_next(&mut lens);
    // SAFETY: see above.
    unsafe { run.gaussian.cmd_set_gaussian_cameras(run.commands, &[camera]) };
}

pub(super) fn bind_vertex_buffers(run: &mut Run, bytes: &mut Bytes<'_>) {
    if run.buffers.is_empty() {
        return;
    }
    let buffers = [0; 5].map(|_| run.buffers[bytes.below(run.buffers.len())].handle);
    let offsets = [0; 5].map(|_| bytes.long(2000));
    // SAFETY: see above.
    unsafe {
        run.device.cmd_bind_vertex_buffers(run.commands, 0, &buffers, &offsets);
        let (offset, ty) = (bytes.long(2000), bytes.one(&[vk::IndexType::UINT16, vk::IndexType::UINT32]));
        run.device.cmd_bind_index_buffer(run.commands, buffers[0], offset, ty);
    }
}

pub(super) fn clear(run: &mut Run, bytes: &mut Bytes<'_>) {
    let clear = [vk::ClearAttachment {
        aspect_mask: bytes.one(&[
            vk::ImageAspectFlags::COLOR,
            vk::ImageAspectFlags::DEPTH,
            vk::ImageAspectFlags::STENCIL,
        ]),
        color_attachment: bytes.number(3),
        clear_value: vk::ClearValue { color: vk::ClearColorValue { float32: [0; 4].map(|_| bytes.float()) } },
    }];
    let rect = [vk::ClearRect {
        rect: vk::Rect2D {
            offset: vk::Offset2D { x: bytes.number(30).cast_signed(), y: bytes.number(30).cast_signed() },
            extent: vk::Extent2D { width: bytes.number(60), height: bytes.number(60) },
        },
        base_array_layer: bytes.number(2),
        layer_count: bytes.number(2),
    }];
    // SAFETY: see above.
    unsafe {
        run.device.cmd_clear_attachments(run.commands, &clear, &rect);
    };
}

pub(super) fn draw(run: &mut Run, bytes: &mut Bytes<'_>) {
    // Larger counts take long and test nothing more.
    let (count, instances) = (bytes.number(400) % 4000, bytes.number(3) % 5);
    let (first, first_instance) = (bytes.number(30), bytes.number(3));
    let (device, commands) = (&run.device, run.commands);
    // SAFETY: see above.
    unsafe {
        if bytes.rarely(4) {
            let offset = bytes.number(9).cast_signed();
            device.cmd_draw_indexed(commands, count, instances, first, offset, first_instance);
        } else {
            device.cmd_draw(commands, count, instances, first, first_instance);
        }
    }
}
