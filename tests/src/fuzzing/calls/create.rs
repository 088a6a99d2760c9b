//! Calls that create objects and map memory. The safety of `unsafe` is explained in the parent module.

use ash::vk;
use gaurast::vk::{
    GaussianGeometryGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST, GaussianPrecisionGAURAST,
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PipelineGaussianStateCreateInfoGAURAST,
};

use super::run::{FORMATS, OBJECTS, Resource, Run, pick};
use crate::fuzzing::bytes::Bytes;
use gaurast_testkit::gaussians::{attribute_locations, attributes, scene_bindings};

fn memory(run: &mut Run, bytes: &mut Bytes<'_>, needed: vk::MemoryRequirements) -> Option<vk::DeviceMemory> {
    let count = run.types.memory_type_count;
    let allowed: Vec<_> = (0..count).filter(|index| needed.memory_type_bits >> index & 1 == 1).collect();
    let info = vk::MemoryAllocateInfo::default().allocation_size(needed.size).memory_type_index(bytes.one(&allowed));
    // SAFETY: see above.
    let memory = unsafe { run.device.allocate_memory(&info, None) };
    run.note(memory)
}

pub(super) fn create_buffer(run: &mut Run, bytes: &mut Bytes<'_>) {
    if run.buffers.len() >= OBJECTS {
        return;
    }
    let usage = vk::BufferUsageFlags::VERTEX_BUFFER
        | vk::BufferUsageFlags::INDEX_BUFFER
        | vk::BufferUsageFlags::INDIRECT_BUFFER
        | vk::BufferUsageFlags::TRANSFER_SRC
        | vk::BufferUsageFlags::TRANSFER_DST;
    let size = bytes.long(40_000);
    let info = vk::BufferCreateInfo::default().size(size).usage(usage);
    // SAFETY: see above.
    unsafe {
        let buffer = run.device.create_buffer(&info, None);
        let Some(handle) = run.note(buffer) else {
            return;
        };
        let needed = run.device.get_buffer_memory_requirements(handle);
        let memory = if needed.size <= 1 << 24 { memory(run, bytes, needed) } else { None };
        let Some(memory) = memory else {
            run.device.destroy_buffer(handle, None);
            return;
        };
        let bound = run.device.bind_buffer_memory(handle, memory, 0);
        run.note(bound);
        let (format, extent) = (vk::Format::UNDEFINED, [0; 2]);
        run.buffers.push(Resource { handle, memory, format, extent });
    }
}

pub(super) fn create_image(run: &mut Run, bytes: &mut Bytes<'_>) {
    if run.images.len() >= OBJECTS {
        return;
    }
    let format = bytes.one(&FORMATS);
    let depth = format == vk::Format::D32_SFLOAT || format == vk::Format::D24_UNORM_S8_UINT;
    let attachment =
        if depth { vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT } else { vk::ImageUsageFlags::COLOR_ATTACHMENT };
    let extent =
        [0; 2].map(|_| if bytes.rarely(12) { bytes.number(5000) % 20_000 } else { 1 + bytes.below(90) as u32 });
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format)
        .extent(vk::Extent3D { width: extent[0], height: extent[1], depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(bytes.one(&[vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_4]))
        .usage(attachment | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST);
    if extent.contains(&0) {
        return;
    }
    // SAFETY: see above.
    unsafe {
        let image = run.device.create_image(&info, None);
        let Some(handle) = run.note(image) else {
            return;
        };
        let needed = run.device.get_image_memory_requirements(handle);
        let memory = if needed.size <= 1 << 24 { memory(run, bytes, needed) } else { None };
        let Some(memory) = memory else {
            run.device.destroy_image(handle, None);
            return;
        };
        let bound = run.device.bind_image_memory(handle, memory, 0);
        run.note(bound);
        let aspect = match format {
            vk::Format::D32_SFLOAT => vk::ImageAspectFlags::DEPTH,
            vk::Format::D24_UNORM_S8_UINT => vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL,
            _ => vk::ImageAspectFlags::COLOR,
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: aspect,
                base_mip_level: 0,
                level_count: 1,
                base_array_layer: 0,
                layer_count: 1,
            });
        let view = run.device.create_image_view(&info, None);
        match run.note(view) {
            Some(view) => run.images.push((Resource { handle, memory, format, extent }, view)),
            None => {
                run.device.destroy_image(handle, None);
                run.device.free_memory(memory, None);
            }
        }
    }
}

pub(super) fn create_pipeline(run: &mut Run, bytes: &mut Bytes<'_>) {
    if run.pipelines.len() >= OBJECTS {
        return;
    }
    let (bindings, attributes) = (scene_bindings(0, false), attributes(0));
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly =
        vk::PipelineInputAssemblyStateCreateInfo::default().topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples =
        bytes.one(&[vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_4]);
    let multisample = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(samples);
    let blend = [gaurast_testkit::over()];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let depth_test = bytes.rarely(2);
    let depth_stencil = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(depth_test)
        .depth_write_enable(bytes.rarely(2))
        .depth_compare_op(vk::CompareOp::from_raw(bytes.below(8) as i32));
    let formats = [bytes.one(&FORMATS[..3])];
    let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    if depth_test {
        rendering = rendering.depth_attachment_format(vk::Format::D32_SFLOAT);
    }
    let mut or = |usual: f32| {
        if bytes.rarely(5) { bytes.float() } else { usual }
    };
    let mut state = PipelineGaussianStateCreateInfoGAURAST::default()
        .alpha_floor(or(1.0 / 255.0))
        .alpha_ceiling(or(0.99))
        .transmittance_floor(or(1e-4))
        .low_pass_variance(or(0.3))
        .attribute_locations(attribute_locations())
        .order(bytes.one(&[
            GaussianOrderGAURAST::VIEW_DEPTH,
            GaussianOrderGAURAST::RADIAL_DISTANCE,
            GaussianOrderGAURAST::PRIMITIVE,
            GaussianOrderGAURAST::PER_PIXEL,
        ]))
        .geometry(bytes.one(&[
            GaussianGeometryGAURAST::GAUSSIAN_3D,
            GaussianGeometryGAURAST::GAUSSIAN_3D,
            GaussianGeometryGAURAST::GAUSSIAN_2D,
        ]))
        .precision(bytes.one(&[
            GaussianPrecisionGAURAST::FLOAT32,
            GaussianPrecisionGAURAST::FLOAT32,
            GaussianPrecisionGAURAST::FLOAT16,
        ]))
        .linearization(bytes.one(&[GaussianLinearizationGAURAST::JACOBIAN, GaussianLinearizationGAURAST::UNSCENTED]));
    let info = vk::GraphicsPipelineCreateInfo::default()
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&multisample)
        .depth_stencil_state(&depth_stencil)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(run.layout)
        .push_next(&mut rendering)
        .push_next(&mut state);
    // SAFETY: see above.
    let pipelines = unsafe { run.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
    let pipelines = run.note(pipelines.map_err(|(_, error)| error));
    run.pipelines.extend(pipelines.into_iter().flatten());
}

pub(super) fn map(run: &mut Run, bytes: &mut Bytes<'_>) {
    let Some(buffer) = pick(bytes, &run.buffers) else {
        return;
    };
    let (handle, memory) = (buffer.handle, buffer.memory);
    let (offset, size) = (bytes.long(5000), bytes.long(5000));
    // SAFETY: see above; the written bytes are in the mapped range.
    unsafe {
        let mapped = run.device.map_memory(memory, offset, size, vk::MemoryMapFlags::empty());
        if let Some(mapped) = run.note(mapped) {
            // The given size may be any; the size that the buffer requires is used.
            let whole = run.device.get_buffer_memory_requirements(handle).size;
            let count = size.min(4096).min(whole.saturating_sub(offset)) as usize;
            for at in 0..count {
                mapped.cast::<u8>().add(at).write(bytes.byte());
            }
            run.device.unmap_memory(memory);
        }
    }
}
