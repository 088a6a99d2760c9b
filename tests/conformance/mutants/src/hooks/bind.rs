//! What is bound and set before draws: pipelines, buffers, descriptor sets, push constants, viewports, scissors.

use ash::vk;
use gaurast::vk::GaussianCameraGAURAST;

use crate::next::next;
use crate::recording::of;
use crate::table::*;
use gaurast_layer_interface::slice;

pub(super) unsafe extern "system" fn cmd_bind_pipeline(
    commands: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    pipeline: vk::Pipeline,
) {
    // SAFETY: see the crate.
    unsafe {
        (next().cmd_bind_pipeline)(commands, point, pipeline);
        let is_graphics = point == vk::PipelineBindPoint::GRAPHICS;
        let is_later = is_graphics && of(commands, |recording| recording.count("pipeline")) > 0;
        if CAMERA_LOST.strikes(is_later) {
            let elsewhere = GaussianCameraGAURAST::default().eye([1e6; 3]).focal_length([1.0; 2]);
            (next().cmd_set_gaussian_cameras)(commands, 1, &raw const elsewhere);
        }
    }
}

pub(super) unsafe extern "system" fn cmd_bind_vertex_buffers(
    commands: vk::CommandBuffer,
    first: u32,
    count: u32,
    buffers: *const vk::Buffer,
    offsets: *const vk::DeviceSize,
) {
    // SAFETY: see the crate.
    let (buffers, offsets) = unsafe { (slice(buffers, count), slice(offsets, count)) };
    for (binding, (&buffer, &offset)) in (first..).zip(buffers.iter().zip(offsets)) {
        if BUFFERS_FIRST_ONLY.strikes(binding > first) {
            continue;
        }
        let mut bound = (buffer, BUFFER_OFFSET.or(offset, 0));
        let is_lost = of(commands, |recording| {
            let earlier = recording.vertex_buffers.insert(binding, bound);
            if let Some(earlier) = earlier
                && BUFFER_REBOUND.strikes(earlier != bound)
            {
                recording.vertex_buffers.insert(binding, earlier);
                bound = earlier;
            }
            let is_late = recording.in_set && recording.draws_of_set > 0;
            is_late && SET_FIRST_BUFFERS.strikes(earlier != Some(bound))
        });
        if !is_lost {
            // SAFETY: see the crate.
            unsafe { (next().cmd_bind_vertex_buffers)(commands, binding, 1, &raw const bound.0, &raw const bound.1) };
        }
    }
}

pub(super) unsafe extern "system" fn cmd_bind_vertex_buffers2(
    commands: vk::CommandBuffer,
    first: u32,
    count: u32,
    buffers: *const vk::Buffer,
    offsets: *const vk::DeviceSize,
    sizes: *const vk::DeviceSize,
    strides: *const vk::DeviceSize,
) {
    if BUFFERS_2_DROPPED.strikes(count > 0) {
        return;
    }
    // SAFETY: see the crate.
    unsafe {
        let mut given = slice(offsets, count).to_vec();
        given.iter_mut().for_each(|offset| BUFFERS_2_OFFSET.replaces(offset, 0));
        // Strides of 64 bytes are no Gaussian's here.
        let mut apart = slice(strides, count).to_vec();
        apart.iter_mut().for_each(|stride| BUFFERS_2_STRIDE.replaces(stride, 64));
        let strides = if apart.is_empty() { strides } else { apart.as_ptr() };
        (next().cmd_bind_vertex_buffers2)(commands, first, count, buffers, given.as_ptr(), sizes, strides);
    }
}

pub(super) unsafe extern "system" fn cmd_bind_index_buffer(
    commands: vk::CommandBuffer,
    buffer: vk::Buffer,
    offset: vk::DeviceSize,
    index_type: vk::IndexType,
) {
    let offset = INDEX_BUFFER_OFFSET.or(offset, 0);
    let index_type = INDEX_TYPE.or(index_type, vk::IndexType::UINT32);
    let is_lost = of(commands, |recording| {
        let is_later = recording.count("index buffer") > 0;
        let is_late = recording.in_set && recording.draws_of_set > 0;
        INDEX_BUFFER_REBOUND.strikes(is_later) || SET_FIRST_INDICES.strikes(is_late)
    });
    if !is_lost {
        // SAFETY: see the crate.
        unsafe { (next().cmd_bind_index_buffer)(commands, buffer, offset, index_type) };
    }
}

pub(super) unsafe extern "system" fn cmd_bind_descriptor_sets(
    commands: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    layout: vk::PipelineLayout,
    first: u32,
    count: u32,
    sets: *const vk::DescriptorSet,
    dynamic_count: u32,
    dynamic: *const u32,
) {
    let is_later =
        point == vk::PipelineBindPoint::GRAPHICS && of(commands, |recording| recording.count("descriptor set")) > 0;
    if SET_REBOUND.strikes(is_later) || PROJECTED_DESCRIPTORS.strikes(is_later) {
        return;
    }
    // SAFETY: see the crate.
    unsafe {
        let mut offsets = slice(dynamic, dynamic_count).to_vec();
        offsets.iter_mut().for_each(|offset| DYNAMIC_OFFSET.replaces(offset, 0));
        (next().cmd_bind_descriptor_sets)(commands, point, layout, first, count, sets, dynamic_count, offsets.as_ptr());
    }
}

pub(super) unsafe extern "system" fn cmd_push_constants(
    commands: vk::CommandBuffer,
    layout: vk::PipelineLayout,
    stages: vk::ShaderStageFlags,
    offset: u32,
    size: u32,
    values: *const std::ffi::c_void,
) {
    let is_graphics = stages != vk::ShaderStageFlags::COMPUTE;
    let is_later = is_graphics && of(commands, |recording| recording.count("push constants")) > 0;
    if PROJECTED_PUSH_CONSTANTS.strikes(is_later) {
        return;
    }
    let offset = RESOLVE_PUSH_CONSTANTS.or(offset, 0);
    // SAFETY: see the crate.
    unsafe { (next().cmd_push_constants)(commands, layout, stages, offset, size, values) };
}

/// Makes the active mutant's change to a viewport.
fn changed(mut viewport: vk::Viewport) -> vk::Viewport {
    if VIEWPORT_ORIGIN.strikes(viewport.x != 0.0 || viewport.y != viewport.height.min(0.0).abs()) {
        (viewport.x, viewport.y) = (0.0, viewport.height.min(0.0).abs());
    }
    if VIEWPORT_FLIPPED.strikes(viewport.height < 0.0) {
        viewport.y += viewport.height;
        viewport.height = -viewport.height;
    }
    if VIEWPORT_DEPTHS.strikes((viewport.min_depth, viewport.max_depth) != (0.0, 1.0)) {
        (viewport.min_depth, viewport.max_depth) = (0.0, 1.0);
    }
    viewport
}

/// Makes the active mutant's change to a scissor.
fn changed_scissor(mut scissor: vk::Rect2D) -> vk::Rect2D {
    let whole = vk::Extent2D { width: 1 << 14, height: 1 << 14 };
    SCISSOR_DROPPED.replaces(&mut scissor, vk::Rect2D { offset: vk::Offset2D::default(), extent: whole });
    SCISSOR_ORIGIN.replaces(&mut scissor.offset, vk::Offset2D::default());
    let least = vk::Extent2D { width: scissor.extent.width.min(2048), height: scissor.extent.height.min(2048) };
    PIXELS_BEYOND_2048.replaces(&mut scissor.extent, least);
    scissor
}

pub(super) unsafe extern "system" fn cmd_set_viewport(
    commands: vk::CommandBuffer,
    first: u32,
    count: u32,
    viewports: *const vk::Viewport,
) {
    // The test kit sets the whole attachment as a pass begins.
    let is_later = of(commands, |recording| recording.count("viewport")) > 0;
    if VIEWPORT_SET_ONCE.strikes(is_later) {
        return;
    }
    // SAFETY: see the crate.
    unsafe {
        let viewports: Vec<_> = slice(viewports, count).iter().copied().map(changed).collect();
        (next().cmd_set_viewport)(commands, first, count, viewports.as_ptr());
    }
}

pub(super) unsafe extern "system" fn cmd_set_viewport_with_count(
    commands: vk::CommandBuffer,
    count: u32,
    viewports: *const vk::Viewport,
) {
    // SAFETY: see the crate.
    unsafe {
        let mut viewports: Vec<_> = slice(viewports, count).iter().copied().map(changed).collect();
        let elsewhere = vk::Viewport { x: -4096.0, ..vk::Viewport::default().width(1.0).height(1.0).max_depth(1.0) };
        if DYNAMIC_VIEWPORT_COUNT.strikes(true) {
            viewports.fill(elsewhere);
        }
        (next().cmd_set_viewport_with_count)(commands, count, viewports.as_ptr());
    }
}

pub(super) unsafe extern "system" fn cmd_set_scissor(
    commands: vk::CommandBuffer,
    first: u32,
    count: u32,
    scissors: *const vk::Rect2D,
) {
    // SAFETY: see the crate.
    unsafe {
        let scissors: Vec<_> = slice(scissors, count).iter().copied().map(changed_scissor).collect();
        (next().cmd_set_scissor)(commands, first, count, scissors.as_ptr());
    }
}

pub(super) unsafe extern "system" fn cmd_set_scissor_with_count(
    commands: vk::CommandBuffer,
    count: u32,
    scissors: *const vk::Rect2D,
) {
    // SAFETY: see the crate.
    unsafe {
        let mut scissors: Vec<_> = slice(scissors, count).iter().copied().map(changed_scissor).collect();
        let whole = vk::Rect2D { extent: vk::Extent2D { width: 1 << 14, height: 1 << 14 }, ..vk::Rect2D::default() };
        scissors.iter_mut().for_each(|scissor| DYNAMIC_SCISSOR_COUNT.replaces(scissor, whole));
        (next().cmd_set_scissor_with_count)(commands, count, scissors.as_ptr());
    }
}
