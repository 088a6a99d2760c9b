//! Pipelines of triangles, lines and points, with any state. The safety of `unsafe` is explained in the parent module.

use ash::vk;

use super::run::{DEPTH_FORMATS, FORMATS, OBJECTS, Run};
use crate::fuzzing::bytes::Bytes;

const VERTEX: &[u8] = include_bytes!("../../../../driver/spirv/tests/shaders/colored.vert.spv");
const FRAGMENTS: [&[u8]; 2] = [
    include_bytes!("../../../../driver/spirv/tests/shaders/colored.frag.spv"),
    include_bytes!("../../../../driver/spirv/tests/shaders/flat.frag.spv"),
];
const VERTEX_FORMATS: [vk::Format; 4] = [
    vk::Format::R32G32B32A32_SFLOAT,
    vk::Format::R16G16B16A16_SFLOAT,
    vk::Format::R8G8B8A8_UNORM,
    vk::Format::R32G32_SFLOAT,
];

fn stencil(bytes: &mut Bytes<'_>) -> vk::StencilOpState {
    let mut op = || vk::StencilOp::from_raw(bytes.below(8) as i32);
    vk::StencilOpState {
        fail_op: op(),
        pass_op: op(),
        depth_fail_op: op(),
        compare_op: vk::CompareOp::from_raw(bytes.below(8) as i32),
        compare_mask: bytes.byte().into(),
        write_mask: bytes.byte().into(),
        reference: bytes.byte().into(),
    }
}

fn blend(bytes: &mut Bytes<'_>) -> vk::PipelineColorBlendAttachmentState {
    let mut factor = || vk::BlendFactor::from_raw(bytes.below(15) as i32);
    let factors = [factor(), factor(), factor(), factor()];
    let mut op = || vk::BlendOp::from_raw(bytes.below(5) as i32);
    vk::PipelineColorBlendAttachmentState::default()
        .color_blend_op(op())
        .alpha_blend_op(op())
        .blend_enable(bytes.rarely(2))
        .src_color_blend_factor(factors[0])
        .dst_color_blend_factor(factors[1])
        .src_alpha_blend_factor(factors[2])
        .dst_alpha_blend_factor(factors[3])
        .color_write_mask(vk::ColorComponentFlags::from_raw(bytes.one(&[15, 15, 15, 5])))
}

fn raster(bytes: &mut Bytes<'_>) -> vk::PipelineRasterizationStateCreateInfo<'static> {
    let bias = [0; 3].map(|_| if bytes.rarely(3) { bytes.float() } else { 0.0 });
    vk::PipelineRasterizationStateCreateInfo::default()
        .depth_clamp_enable(bytes.rarely(4))
        .rasterizer_discard_enable(bytes.rarely(16))
        .polygon_mode(bytes.one(&[
            vk::PolygonMode::FILL,
            vk::PolygonMode::FILL,
            vk::PolygonMode::LINE,
            vk::PolygonMode::POINT,
        ]))
        .cull_mode(vk::CullModeFlags::from_raw(bytes.one(&[0, 0, 1, 2])))
        .front_face(bytes.one(&[vk::FrontFace::CLOCKWISE, vk::FrontFace::COUNTER_CLOCKWISE]))
        .depth_bias_enable(bytes.rarely(4))
        .depth_bias_constant_factor(bias[0])
        .depth_bias_slope_factor(bias[1])
        .depth_bias_clamp(bias[2])
        .line_width(if bytes.rarely(4) { bytes.float() } else { 1.0 })
}

pub(super) fn create_pipeline(run: &mut Run, bytes: &mut Bytes<'_>) {
    if run.pipelines.len() >= OBJECTS {
        return;
    }
    let bindings = [0, 1].map(|binding| vk::VertexInputBindingDescription {
        binding,
        stride: if bytes.rarely(8) { bytes.number(60) } else { bytes.one(&[16, 32, 0, 4]) },
        input_rate: vk::VertexInputRate::from_raw(bytes.rarely(4).into()),
    });
    let attributes = [0, 1].map(|location| vk::VertexInputAttributeDescription {
        location,
        binding: location,
        format: bytes.one(&VERTEX_FORMATS),
        offset: if bytes.rarely(4) { bytes.number(40) } else { 0 },
    });
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(vk::PrimitiveTopology::from_raw(bytes.one(&[3, 3, 0, 1, 2, 4, 5])))
        .primitive_restart_enable(bytes.rarely(4));
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let mut raster = raster(bytes);
    let mut lines = vk::PipelineRasterizationLineStateCreateInfoKHR::default()
        .line_rasterization_mode(vk::LineRasterizationModeKHR::from_raw(bytes.below(4) as i32))
        .stippled_line_enable(bytes.rarely(2))
        .line_stipple_factor(bytes.number(300))
        .line_stipple_pattern(bytes.number(0xFFFF) as u16);
    if bytes.rarely(3) {
        raster.p_next = (&raw mut lines).cast();
    }
    let samples = bytes.one(&[1, 1, 1, 4]);
    let multisample = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::from_raw(samples))
        .sample_shading_enable(bytes.rarely(6))
        .min_sample_shading(1.0)
        .alpha_to_coverage_enable(bytes.rarely(6));
    let blend = [blend(bytes)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let depth = bytes.rarely(2).then(|| bytes.one(&DEPTH_FORMATS));
    let depth_stencil = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(depth.is_some())
        .depth_write_enable(bytes.rarely(2))
        .depth_compare_op(vk::CompareOp::from_raw(bytes.below(8) as i32))
        .stencil_test_enable(depth == Some(DEPTH_FORMATS[1]))
        .front(stencil(bytes))
        .back(stencil(bytes));
    let formats = [bytes.one(&FORMATS[..3])];
    let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    if let Some(depth) = depth {
        rendering = rendering.depth_attachment_format(depth);
        if depth == DEPTH_FORMATS[1] {
            rendering = rendering.stencil_attachment_format(depth);
        }
    }
    let fragment = bytes.one(&FRAGMENTS);
    // SAFETY: see above.
    unsafe {
        let [vertex, fragment] = [VERTEX, fragment].map(|spirv| {
            let words = ash::util::read_spv(&mut std::io::Cursor::new(spirv)).expect("words");
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            run.device.create_shader_module(&info, None).expect("a module")
        });
        let stage =
            |stage, module| vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main");
        let stages = [stage(vk::ShaderStageFlags::VERTEX, vertex), stage(vk::ShaderStageFlags::FRAGMENT, fragment)];
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(run.layout)
            .push_next(&mut rendering);
        let cache = vk::PipelineCache::null();
        let pipelines = run.device.create_graphics_pipelines(cache, &[info], None);
        let pipelines = run.note(pipelines.map_err(|(_, error)| error));
        run.pipelines.extend(pipelines.into_iter().flatten());
        for module in [vertex, fragment] {
            run.device.destroy_shader_module(module, None);
        }
    }
}
