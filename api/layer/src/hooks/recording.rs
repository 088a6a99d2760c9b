//! Command buffers, and commands that are recorded in them.

use std::sync::Arc;

use ash::vk;
use gaurast::vk as gvk;

use crate::device::Device;
use crate::facts::{DecodingTables, Harmonics};
use crate::hooks::objects::{is_storage, written_buffers};
use crate::objects::{BufferDescriptor, Objects, Subpass};
use crate::recording::{
    BoundHarmonics, BoundSet, BoundTables, Call, IndexBuffer, Indirect, Operation, Recording, SubpassIndex,
    VertexBuffer,
};
use crate::report::Faults;
use crate::rules::{self, dynamic};
use gaurast_layer_interface::{find, slice};

const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;

pub(super) unsafe extern "system" fn allocate_command_buffers(
    device: vk::Device,
    info: *const vk::CommandBufferAllocateInfo<'_>,
    buffers: *mut vk::CommandBuffer,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        let Some(next) = own.next.allocate_command_buffers else {
            return FAILED;
        };
        let result = next(device, info, buffers);
        if result == vk::Result::SUCCESS {
            own.observe(|state, _| {
                for &commands in slice(buffers, (*info).command_buffer_count) {
                    let recording = Recording::new((*info).command_pool);
                    state.recordings.insert(commands, recording);
                }
            });
        }
        result
    }
}

pub(super) unsafe extern "system" fn free_command_buffers(
    device: vk::Device,
    pool: vk::CommandPool,
    count: u32,
    buffers: *const vk::CommandBuffer,
) {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return;
        };
        own.observe(|state, _| {
            for commands in slice(buffers, count) {
                state.recordings.remove(commands);
            }
        });
        if let Some(next) = own.next.free_command_buffers {
            next(device, pool, count, buffers);
        }
    }
}

pub(super) unsafe extern "system" fn begin_command_buffer(
    commands: vk::CommandBuffer,
    info: *const vk::CommandBufferBeginInfo<'_>,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(commands) else {
            return FAILED;
        };
        let Some(next) = own.next.begin_command_buffer else {
            return FAILED;
        };
        own.observe(|state, _| {
            let (recording, objects) = state.recording(commands);
            *recording = Recording::new(recording.pool);
            let continues = vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE;
            let inherited = (*info).p_inheritance_info.as_ref();
            let Some(inherited) = inherited.filter(|_| (*info).flags.contains(continues)) else {
                return;
            };
            let subpass = match objects.render_passes.get(&inherited.render_pass) {
                Some(pass) => pass.get(inherited.subpass as usize).cloned().unwrap_or_default(),
                None => Subpass {
                    view_mask: find::<vk::CommandBufferInheritanceRenderingInfo<'_>>(inherited.p_next)
                        .map_or(0, |rendering| rendering.view_mask),
                    ..Subpass::default()
                },
            };
            recording.begin_pass(subpass, None, None);
        });
        next(commands, info)
    }
}

pub(super) unsafe extern "system" fn end_command_buffer(commands: vk::CommandBuffer) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(commands) else {
            return FAILED;
        };
        let Some(next) = own.next.end_command_buffer else {
            return FAILED;
        };
        own.observe(|state, faults| {
            let (recording, _) = state.recording(commands);
            rules::set::require_ended(recording, "vkEndCommandBuffer", faults);
            rules::draw::check_sources(recording.sources, faults);
        });
        next(commands)
    }
}

/// Hooks of commands without a result: each looks at its parameters, and at the device if it is named, and passes them
/// on.
macro_rules! records {
    ($($name:ident($($parameter:ident: $type:ty),*) $(with $own:ident)?
        |$state:ident, $faults:ident| $look:block)*) => {$(
        pub(super) unsafe extern "system" fn $name(commands: vk::CommandBuffer, $($parameter: $type),*) {
            // SAFETY: see the module above.
            unsafe {
                let Some(device) = Device::of(commands) else { return };
                $(let $own = &device;)?
                device.observe(|state, $faults| {
                    let $state = state.recording(commands);
                    $look
                });
                if let Some(next) = device.next.$name {
                    next(commands, $($parameter),*);
                }
            }
        }
    )*};
}
records! {
    cmd_bind_pipeline(point: vk::PipelineBindPoint, pipeline: vk::Pipeline) |state, _faults| {
        let (recording, objects) = state;
        if point == vk::PipelineBindPoint::GRAPHICS {
            recording.pipeline = objects.pipelines.get(&pipeline).cloned();
        }
    }
    cmd_bind_vertex_buffers(
        first: u32, count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize
    ) |state, _faults| {
        let pairs = slice(buffers, count).iter().zip(slice(offsets, count));
        for (binding, (&buffer, &offset)) in (first..).zip(pairs) {
            let bound = VertexBuffer { buffer, offset, size: None, stride: None };
            state.0.inputs.vertex_buffers.insert(binding, bound);
        }
    }
    cmd_bind_vertex_buffers2(
        first: u32, count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize,
        sizes: *const vk::DeviceSize, strides: *const vk::DeviceSize
    ) |state, _faults| {
        let (sizes, strides) = (slice(sizes, count), slice(strides, count));
        let pairs = slice(buffers, count).iter().zip(slice(offsets, count)).enumerate();
        for (index, (&buffer, &offset)) in pairs {
            let size = sizes.get(index).copied().filter(|&size| size != vk::WHOLE_SIZE);
            let stride = strides.get(index).and_then(|&stride| u32::try_from(stride).ok());
            let bound = VertexBuffer { buffer, offset, size, stride };
            state.0.inputs.vertex_buffers.insert(first + index as u32, bound);
        }
    }
    cmd_bind_index_buffer(buffer: vk::Buffer, offset: vk::DeviceSize, ty: vk::IndexType) |state, _faults| {
        state.0.inputs.index_buffer = Some(IndexBuffer { buffer, offset, ty });
    }
    cmd_bind_descriptor_sets(
        point: vk::PipelineBindPoint, layout: vk::PipelineLayout, first: u32, count: u32,
        sets: *const vk::DescriptorSet, offset_count: u32, offsets: *const u32
    ) |state, _faults| {
        let (recording, objects) = state;
        if point != vk::PipelineBindPoint::GRAPHICS {
            return;
        }
        let mut offsets = slice(offsets, offset_count);
        let layouts = objects.layouts.get(&layout);
        for (number, &set) in (first..).zip(slice(sets, count)) {
            let layout = layouts.and_then(|layouts| layouts.get(number as usize)?.clone());
            let dynamic = layout.iter().flat_map(|layout| layout.iter()).filter(|binding| is_dynamic(binding.ty));
            let dynamic: u32 = dynamic.map(|binding| binding.count).sum();
            let (own_offsets, rest) = offsets.split_at((dynamic as usize).min(offsets.len()));
            offsets = rest;
            let serial = objects.sets.get(&set).map_or(0, |set| set.serial);
            let bound = BoundSet { set, serial, dynamic_offsets: own_offsets.to_vec() };
            recording.sets.insert(number, bound);
            recording.pushed.retain(|(of, _), _| *of != number);
        }
    }
    cmd_push_descriptor_set(
        point: vk::PipelineBindPoint, layout: vk::PipelineLayout, set: u32, count: u32,
        writes: *const vk::WriteDescriptorSet<'_>
    ) |state, _faults| {
        let (recording, objects) = state;
        for write in slice(writes, count) {
            for (binding, info) in written_buffers(write) {
                if is_storage(write.descriptor_type)
                    && let Some(known) = objects.buffers.get_mut(&info.buffer)
                {
                    known.is_written = true;
                }
                if point == vk::PipelineBindPoint::GRAPHICS {
                    let serial = objects.serial_of(info.buffer);
                    let (buffer, offset, range) = (info.buffer, info.offset, info.range);
                    let pushed = BufferDescriptor { buffer, serial, offset, range };
                    recording.pushed.insert((set, binding), Some(pushed));
                }
            }
        }
    }
    cmd_set_viewport(first: u32, count: u32, viewports: *const vk::Viewport) |state, _faults| {
        let viewport = slice(viewports, count).first().filter(|_| first == 0);
        set_viewport(state.0, viewport, vk::DynamicState::VIEWPORT);
    }
    cmd_set_viewport_with_count(count: u32, viewports: *const vk::Viewport) |state, _faults| {
        let viewport = slice(viewports, count).first();
        set_viewport(state.0, viewport, vk::DynamicState::VIEWPORT_WITH_COUNT);
    }
    cmd_set_scissor(first: u32, count: u32, scissors: *const vk::Rect2D) |state, _faults| {
        let scissors = format!("{:?}", slice(scissors, count));
        state.0.set_dynamic(vk::DynamicState::SCISSOR, scissors);
    }
    cmd_set_scissor_with_count(count: u32, scissors: *const vk::Rect2D) |state, _faults| {
        let scissors = format!("{:?}", slice(scissors, count));
        state.0.set_dynamic(vk::DynamicState::SCISSOR_WITH_COUNT, scissors);
    }
    cmd_set_blend_constants(constants: *const [f32; 4]) |state, _faults| {
        let constants = format!("{:?}", *constants);
        state.0.set_dynamic(vk::DynamicState::BLEND_CONSTANTS, constants);
    }
    cmd_set_depth_bounds(least: f32, greatest: f32) |state, _faults| {
        state.0.set_dynamic(vk::DynamicState::DEPTH_BOUNDS, format!("{least} {greatest}"));
    }
    cmd_set_stencil_compare_mask(faces: vk::StencilFaceFlags, mask: u32) |state, _faults| {
        set_front(state.0, faces, vk::DynamicState::STENCIL_COMPARE_MASK, mask);
    }
    cmd_set_stencil_write_mask(faces: vk::StencilFaceFlags, mask: u32) |state, _faults| {
        set_front(state.0, faces, vk::DynamicState::STENCIL_WRITE_MASK, mask);
    }
    cmd_set_stencil_reference(faces: vk::StencilFaceFlags, reference: u32) |state, _faults| {
        set_front(state.0, faces, vk::DynamicState::STENCIL_REFERENCE, reference);
    }
    cmd_set_depth_test_enable(enable: vk::Bool32) |state, _faults| {
        state.0.set_dynamic(vk::DynamicState::DEPTH_TEST_ENABLE, enable.to_ne_bytes());
    }
    cmd_set_depth_write_enable(enable: vk::Bool32) |state, _faults| {
        state.0.set_dynamic(vk::DynamicState::DEPTH_WRITE_ENABLE, enable.to_ne_bytes());
    }
    cmd_set_depth_compare_op(op: vk::CompareOp) |state, _faults| {
        state.0.set_dynamic(vk::DynamicState::DEPTH_COMPARE_OP, op.as_raw().to_ne_bytes());
    }
    cmd_set_depth_bounds_test_enable(enable: vk::Bool32) |state, _faults| {
        state.0.set_dynamic(vk::DynamicState::DEPTH_BOUNDS_TEST_ENABLE, enable.to_ne_bytes());
    }
    cmd_set_stencil_test_enable(enable: vk::Bool32) |state, _faults| {
        state.0.set_dynamic(vk::DynamicState::STENCIL_TEST_ENABLE, enable.to_ne_bytes());
    }
    cmd_begin_render_pass(begin: *const vk::RenderPassBeginInfo<'_>, contents: vk::SubpassContents)
        |state, _faults| {
        begin_render_pass(state.0, state.1, &*begin);
    }
    cmd_begin_render_pass2(
        begin: *const vk::RenderPassBeginInfo<'_>, subpass: *const vk::SubpassBeginInfo<'_>
    ) |state, _faults| {
        begin_render_pass(state.0, state.1, &*begin);
    }
    cmd_next_subpass(contents: vk::SubpassContents) |state, faults| {
        rules::set::require_ended(state.0, "vkCmdNextSubpass", faults);
        state.0.next_subpass();
    }
    cmd_next_subpass2(begin: *const vk::SubpassBeginInfo<'_>, end: *const vk::SubpassEndInfo<'_>) |state, faults| {
        rules::set::require_ended(state.0, "vkCmdNextSubpass2", faults);
        state.0.next_subpass();
    }
    cmd_end_render_pass() |state, faults| {
        rules::set::require_ended(state.0, "vkCmdEndRenderPass", faults);
        state.0.pass = None;
    }
    cmd_end_render_pass2(end: *const vk::SubpassEndInfo<'_>) |state, faults| {
        rules::set::require_ended(state.0, "vkCmdEndRenderPass2", faults);
        state.0.pass = None;
    }
    cmd_begin_rendering(info: *const vk::RenderingInfo<'_>) |state, _faults| {
        let info = &*info;
        let colors = slice(info.p_color_attachments, info.color_attachment_count).iter();
        let resumes = info.flags.contains(vk::RenderingFlags::RESUMING);
        let subpass = Subpass {
            view_mask: info.view_mask,
            colors: colors
                .map(|color| (vk::Format::UNDEFINED, resumes || color.load_op == vk::AttachmentLoadOp::LOAD))
                .collect(),
            ..Subpass::default()
        };
        let depth = info.p_depth_attachment.as_ref().filter(|depth| depth.image_view != vk::ImageView::null());
        let depth = depth.filter(|depth| !resumes && depth.load_op == vk::AttachmentLoadOp::CLEAR);
        state.0.begin_pass(subpass, None, depth.map(|depth| depth.clear_value.depth_stencil.depth));
    }
    cmd_end_rendering() |state, faults| {
        rules::set::require_ended(state.0, "vkCmdEndRendering", faults);
        state.0.pass = None;
    }
    cmd_draw(count: u32, instances: u32, first: u32, first_instance: u32) with own |state, faults| {
        let call = Call::Vertices([first, count, first_instance, instances]);
        rules::draw::check(state.0, call, state.1, &own.facts, faults);
    }
    cmd_draw_indexed(count: u32, instances: u32, first: u32, offset: i32, first_instance: u32)
        with own |state, faults| {
        let call = Call::Indices([first, count, first_instance, instances], offset);
        rules::draw::check(state.0, call, state.1, &own.facts, faults);
    }
    cmd_draw_multi(
        count: u32, draws: *const vk::MultiDrawInfoEXT, instances: u32, first_instance: u32, stride: u32
    ) with own |state, faults| {
        for index in 0..count as usize {
            let draw = draws.byte_add(index * stride as usize).read_unaligned();
            let call = Call::Vertices([draw.first_vertex, draw.vertex_count, first_instance, instances]);
            rules::draw::check(state.0, call, state.1, &own.facts, faults);
        }
    }
    cmd_draw_multi_indexed(
        count: u32, draws: *const vk::MultiDrawIndexedInfoEXT, instances: u32, first_instance: u32, stride: u32,
        vertex_offset: *const i32
    ) with own |state, faults| {
        let common = vertex_offset.as_ref();
        for index in 0..count as usize {
            let draw = draws.byte_add(index * stride as usize).read_unaligned();
            let offset = common.copied().unwrap_or(draw.vertex_offset);
            let call = Call::Indices([draw.first_index, draw.index_count, first_instance, instances], offset);
            rules::draw::check(state.0, call, state.1, &own.facts, faults);
        }
    }
    cmd_draw_indirect(buffer: vk::Buffer, offset: vk::DeviceSize, count: u32, stride: u32) with own |state, faults| {
        if count > 0 {
            let call = Indirect { buffer, offset, is_indexed: false, count, stride, counted: None };
            rules::draw::check(state.0, Call::Indirect(call), state.1, &own.facts, faults);
        }
    }
    cmd_draw_indexed_indirect(buffer: vk::Buffer, offset: vk::DeviceSize, count: u32, stride: u32)
        with own |state, faults| {
        if count > 0 {
            let call = Indirect { buffer, offset, is_indexed: true, count, stride, counted: None };
            rules::draw::check(state.0, Call::Indirect(call), state.1, &own.facts, faults);
        }
    }
    cmd_draw_indirect_count(
        buffer: vk::Buffer, offset: vk::DeviceSize, counts: vk::Buffer, count_offset: vk::DeviceSize,
        most: u32, stride: u32
    ) with own |state, faults| {
        let counted = Some((counts, count_offset));
        let call = Indirect { buffer, offset, is_indexed: false, count: most, stride, counted };
        rules::draw::check(state.0, Call::Indirect(call), state.1, &own.facts, faults);
    }
    cmd_draw_indexed_indirect_count(
        buffer: vk::Buffer, offset: vk::DeviceSize, counts: vk::Buffer, count_offset: vk::DeviceSize,
        most: u32, stride: u32
    ) with own |state, faults| {
        let counted = Some((counts, count_offset));
        let call = Indirect { buffer, offset, is_indexed: true, count: most, stride, counted };
        rules::draw::check(state.0, Call::Indirect(call), state.1, &own.facts, faults);
    }
    cmd_push_constants(
        layout: vk::PipelineLayout, stages: vk::ShaderStageFlags, offset: u32, size: u32,
        values: *const std::ffi::c_void
    ) |state, _faults| {
        state.0.constants |= stages;
    }
    cmd_push_constants2(info: *const vk::PushConstantsInfoKHR<'_>) |state, _faults| {
        state.0.constants |= (*info).stage_flags;
    }
    cmd_dispatch(x: u32, y: u32, z: u32) |state, _faults| {
        state.0.operations.push(Operation::Dispatch);
    }
    cmd_dispatch_base(from_x: u32, from_y: u32, from_z: u32, x: u32, y: u32, z: u32) |state, _faults| {
        state.0.operations.push(Operation::Dispatch);
    }
    cmd_dispatch_indirect(buffer: vk::Buffer, offset: vk::DeviceSize) |state, _faults| {
        state.0.operations.push(Operation::Dispatch);
    }
    cmd_end_query(pool: vk::QueryPool, query: u32) |state, faults| {
        rules::set::check_query(state.0, faults);
    }
    cmd_clear_attachments(
        attachment_count: u32, attachments: *const vk::ClearAttachment, rect_count: u32, rects: *const vk::ClearRect
    ) |state, _faults| {
        let mut cleared = slice(attachments, attachment_count).iter();
        let clears_depth = cleared.any(|clear| clear.aspect_mask.contains(vk::ImageAspectFlags::DEPTH));
        if let Some(pass) = state.0.pass.as_mut().filter(|_| clears_depth) {
            pass.cleared_depth = None;
        }
    }
    cmd_copy_buffer(from: vk::Buffer, to: vk::Buffer, count: u32, regions: *const vk::BufferCopy)
        |state, _faults| {
        let regions = slice(regions, count).to_vec();
        state.0.operations.push(Operation::Copy(from, to, regions));
    }
    cmd_copy_buffer2(info: *const vk::CopyBufferInfo2<'_>) |state, _faults| {
        let info = &*info;
        let regions = slice(info.p_regions, info.region_count).iter();
        let regions = regions.map(|region| vk::BufferCopy {
            src_offset: region.src_offset,
            dst_offset: region.dst_offset,
            size: region.size,
        });
        let copy = Operation::Copy(info.src_buffer, info.dst_buffer, regions.collect());
        state.0.operations.push(copy);
    }
    cmd_update_buffer(
        buffer: vk::Buffer, offset: vk::DeviceSize, size: vk::DeviceSize, data: *const std::ffi::c_void
    ) |state, _faults| {
        let bytes = slice(data.cast::<u8>(), u32::try_from(size).unwrap_or(0)).to_vec();
        state.0.operations.push(Operation::Update(buffer, offset, Arc::new(bytes)));
    }
    cmd_fill_buffer(buffer: vk::Buffer, offset: vk::DeviceSize, size: vk::DeviceSize, word: u32) |state, _faults| {
        state.0.operations.push(Operation::Fill(buffer, offset, size, word));
    }
    cmd_copy_image_to_buffer(
        image: vk::Image, layout: vk::ImageLayout, buffer: vk::Buffer, count: u32, regions: *const vk::BufferImageCopy
    ) |state, _faults| {
        state.0.operations.push(Operation::Write(buffer));
    }
    cmd_copy_image_to_buffer2(info: *const vk::CopyImageToBufferInfo2<'_>) |state, _faults| {
        state.0.operations.push(Operation::Write((*info).dst_buffer));
    }
    cmd_set_gaussian_cameras(count: u32, cameras: *const gvk::GaussianCameraGAURAST<'_>) with own |state, faults| {
        // What is wrongly many is not looked at.
        let cameras = slice(cameras, if count > own.facts.max_views { 0 } else { count });
        let lenses: Vec<_> = cameras.iter().map(|camera| rules::camera::lens(camera)).collect();
        let right = rules::camera::check_command(cameras, &lenses, count, &own.facts, faults);
        state.0.cameras = right.map(Arc::new).or(state.0.cameras.take());
        state.0.sources.sets = true;
    }
    cmd_begin_gaussian_set() with own |state, faults| {
        rules::set::begin(state.0, &own.facts, faults);
    }
    cmd_end_gaussian_set() with own |state, faults| {
        rules::set::end(state.0, &own.facts, faults);
    }
    cmd_set_gaussian_order(order: gvk::GaussianOrderGAURAST) |state, faults| {
        dynamic::check_order(order, faults);
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST, order.as_raw().cast_unsigned(), faults);
    }
    cmd_set_gaussian_antialiasing(antialiasing: gvk::GaussianAntialiasingGAURAST) |state, faults| {
        dynamic::check_antialiasing(antialiasing, faults);
        let bits = antialiasing.as_raw().cast_unsigned();
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST, bits, faults);
    }
    cmd_set_gaussian_low_pass_variance(value: f32) |state, faults| {
        dynamic::check_low_pass_variance(value, faults);
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST, value.to_bits(), faults);
    }
    cmd_set_gaussian_alpha_floor(value: f32) |state, faults| {
        dynamic::check_alpha_floor(value, faults);
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST, value.to_bits(), faults);
    }
    cmd_set_gaussian_alpha_ceiling(value: f32) |state, faults| {
        dynamic::check_alpha_ceiling(value, faults);
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST, value.to_bits(), faults);
    }
    cmd_set_gaussian_transmittance_floor(value: f32) |state, faults| {
        dynamic::check_transmittance_floor(value, faults);
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST, value.to_bits(), faults);
    }
    cmd_set_gaussian_spherical_harmonics_degree(degree: u32) with own |state, faults| {
        dynamic::check_degree(degree, &own.facts, faults);
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST, degree, faults);
    }
    cmd_set_gaussian_exponential_error(value: f32) |state, faults| {
        dynamic::check_exponential_error(value, faults);
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST, value.to_bits(), faults);
    }
    cmd_set_gaussian_contribution_budget(value: f32) |state, faults| {
        dynamic::check_contribution_budget(value, faults);
        set_own(state.0, gvk::DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST, value.to_bits(), faults);
    }
    cmd_bind_gaussian_spherical_harmonics(
        buffer: *const gvk::GaussianSphericalHarmonicsBufferGAURAST<'_>
    ) with own |state, faults| {
        let (recording, objects) = state;
        let Some(bound) = buffer.as_ref() else { return };
        let fetches = |format| {
            let mut properties = vk::FormatProperties::default();
            let Some(get) = own.instance.next.format_properties else { return true };
            get(own.physical_device, format, &raw mut properties);
            properties.buffer_features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER)
        };
        rules::harmonics::check(bound, objects, fetches, faults);
        let buffer = objects.buffer_at(bound.device_address).map(|(handle, buffer)| (handle, buffer.serial));
        recording.inputs.harmonics = Some(BoundHarmonics { harmonics: Harmonics::of(bound), buffer });
    }
    cmd_bind_gaussian_decoding_tables(
        tables: *const gvk::GaussianDecodingTablesGAURAST<'_>
    ) |state, faults| {
        let (recording, objects) = state;
        let Some(bound) = tables.as_ref() else { return };
        rules::decoding::check_tables(bound, objects, faults);
        let ranges = rules::decoding::ranges(bound).into_iter();
        let buffers = ranges.filter_map(|(_, address, _)| objects.buffer_at(address));
        let buffers = buffers.map(|(handle, buffer)| (handle, buffer.serial)).collect();
        recording.inputs.decoding_tables = Some(BoundTables { tables: DecodingTables::of(bound), buffers });
    }
}

pub(super) unsafe extern "system" fn cmd_execute_commands(
    commands: vk::CommandBuffer,
    count: u32,
    buffers: *const vk::CommandBuffer,
) {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(commands) else {
            return;
        };
        own.observe(|state, faults| {
            let executed = slice(buffers, count).iter();
            let executed = executed.filter_map(|commands| state.recordings.get(commands));
            let operations: Vec<_> = executed.flat_map(|other| other.operations.clone()).collect();
            let (recording, _) = state.recording(commands);
            rules::set::require_ended(recording, "vkCmdExecuteCommands", faults);
            recording.operations.extend(operations);
            recording.forget_state();
        });
        if let Some(next) = own.next.cmd_execute_commands {
            next(commands, count, buffers);
        }
    }
}

fn is_dynamic(ty: vk::DescriptorType) -> bool {
    ty == vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC || ty == vk::DescriptorType::STORAGE_BUFFER_DYNAMIC
}

fn set_viewport(recording: &mut Recording, viewport: Option<&vk::Viewport>, state: vk::DynamicState) {
    let Some(v) = viewport else { return };
    recording.viewport = Some([v.x, v.y, v.width, v.height]);
    recording.depth_range = Some([v.min_depth, v.max_depth]);
    recording.set_dynamic(state, format!("{v:?}"));
}

/// A value of the front faces' stencil state, which Gaussians have.
fn set_front(recording: &mut Recording, faces: vk::StencilFaceFlags, state: vk::DynamicState, value: u32) {
    if faces.contains(vk::StencilFaceFlags::FRONT) {
        recording.set_dynamic(state, value.to_ne_bytes());
    }
}

/// A value of a dynamic state of the extension, unless something is wrong with it.
fn set_own(recording: &mut Recording, state: vk::DynamicState, bits: u32, faults: &Faults) {
    if faults.is_empty() {
        recording.set_dynamic(state, bits.to_ne_bytes());
    }
}

/// # Safety
/// The parameters are valid.
unsafe fn begin_render_pass(recording: &mut Recording, objects: &Objects, begin: &vk::RenderPassBeginInfo<'_>) {
    let render_pass = objects.render_passes.get(&begin.render_pass).cloned();
    let subpass = render_pass.as_ref().and_then(|render_pass| render_pass.first().cloned()).unwrap_or_default();
    let index = render_pass.map(|render_pass| SubpassIndex { render_pass, index: 0 });
    // SAFETY: the caller's promise; what is cleared has a value, and that of depth is of depth and stencil.
    let cleared_depth = unsafe {
        let values = slice(begin.p_clear_values, begin.clear_value_count);
        let value = subpass.cleared_depth.and_then(|number| values.get(number as usize));
        value.map(|value| value.depth_stencil.depth)
    };
    recording.begin_pass(subpass, index, cleared_depth);
}
