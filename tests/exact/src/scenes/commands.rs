//! Scenes of dynamic state, secondary command buffers, clears, load and store operations.

use ash::vk;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::cases;
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Buffer, Commands, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex, blend, depth_test,
};

const D32: vk::Format = vk::Format::D32_SFLOAT;

/// Draws in two halves, with `set` before each.
fn dynamic(
    gpu: &Gpu,
    target: &TargetOptions,
    options: &PipelineOptions<'_>,
    vertices: &[Vertex],
    set: impl Fn(&Commands, usize),
) -> Drawn {
    let target = Target::new(gpu, target);
    let pipeline = Pipeline::new(gpu, &target, options);
    let buffer = Buffer::of(gpu, vertices);
    let half = vertices.len() as u32 / 6 * 3;
    Ok(target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.vertices(&buffer);
        set(commands, 0);
        commands.draw(0..half);
        set(commands, 1);
        commands.draw(half..vertices.len() as u32);
    }))
}

pub fn dynamic_culling(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        dynamic: vec![vk::DynamicState::CULL_MODE, vk::DynamicState::FRONT_FACE],
        ..PipelineOptions::default()
    };
    let target = TargetOptions::default();
    dynamic(gpu, &target, &options, &shapes::soup(120, 40), |commands, half| {
        let fronts = [vk::FrontFace::CLOCKWISE, vk::FrontFace::COUNTER_CLOCKWISE];
        let modes = [vk::CullModeFlags::BACK, vk::CullModeFlags::BACK];
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_set_cull_mode(commands.raw, modes[half]);
            device.cmd_set_front_face(commands.raw, fronts[half]);
        }
    })
}

pub fn dynamic_depth_test(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        dynamic: vec![
            vk::DynamicState::DEPTH_TEST_ENABLE,
            vk::DynamicState::DEPTH_WRITE_ENABLE,
            vk::DynamicState::DEPTH_COMPARE_OP,
        ],
        ..PipelineOptions::default()
    };
    let target = TargetOptions::with_depth(D32);
    dynamic(gpu, &target, &options, &shapes::soup(121, 40), |commands, half| {
        let ops = [vk::CompareOp::LESS, vk::CompareOp::GREATER];
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_set_depth_test_enable(commands.raw, true);
            device.cmd_set_depth_write_enable(commands.raw, half == 0);
            device.cmd_set_depth_compare_op(commands.raw, ops[half]);
        }
    })
}

pub fn dynamic_depth_bias(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        depth_stencil: depth_test(vk::CompareOp::LESS),
        dynamic: vec![vk::DynamicState::DEPTH_BIAS, vk::DynamicState::DEPTH_BIAS_ENABLE],
        ..PipelineOptions::default()
    };
    let target = TargetOptions::with_depth(D32);
    dynamic(gpu, &target, &options, &shapes::flat_soup(122, 40), |commands, half| {
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_set_depth_bias(commands.raw, 0.0, 0.0, 2.0);
            device.cmd_set_depth_bias_enable(commands.raw, half == 0);
        }
    })
}

pub fn dynamic_blend_constants(gpu: &Gpu) -> Drawn {
    use vk::BlendFactor as Factor;
    let (from, to) = (Factor::CONSTANT_COLOR, Factor::ONE_MINUS_CONSTANT_COLOR);
    let options = PipelineOptions {
        blend: vec![blend(from, to, vk::BlendOp::ADD)],
        dynamic: vec![vk::DynamicState::BLEND_CONSTANTS],
        ..PipelineOptions::default()
    };
    let target = TargetOptions::of(vk::Format::R16G16B16A16_SFLOAT);
    dynamic(gpu, &target, &options, &shapes::soup(123, 40), |commands, half| {
        let constants = [[0.1, 0.5, 0.9, 0.3], [0.7, 0.2, 0.4, 1.0]];
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_set_blend_constants(commands.raw, &constants[half]);
        }
    })
}

pub fn dynamic_topology_and_restart(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        dynamic: vec![vk::DynamicState::PRIMITIVE_TOPOLOGY, vk::DynamicState::PRIMITIVE_RESTART_ENABLE],
        ..PipelineOptions::default()
    };
    let target = TargetOptions::default();
    dynamic(gpu, &target, &options, &shapes::zigzag(124, 24), |commands, half| {
        let topologies = [vk::PrimitiveTopology::TRIANGLE_STRIP, vk::PrimitiveTopology::TRIANGLE_FAN];
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_set_primitive_topology(commands.raw, topologies[half]);
            device.cmd_set_primitive_restart_enable(commands.raw, false);
        }
    })
}

pub fn dynamic_stencil(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        dynamic: vec![
            vk::DynamicState::STENCIL_TEST_ENABLE,
            vk::DynamicState::STENCIL_OP,
            vk::DynamicState::STENCIL_COMPARE_MASK,
            vk::DynamicState::STENCIL_WRITE_MASK,
            vk::DynamicState::STENCIL_REFERENCE,
        ],
        ..PipelineOptions::default()
    };
    let target = TargetOptions::with_depth(vk::Format::D32_SFLOAT_S8_UINT);
    dynamic(gpu, &target, &options, &shapes::soup(125, 40), |commands, half| {
        let faces = vk::StencilFaceFlags::FRONT_AND_BACK;
        let compare = [vk::CompareOp::ALWAYS, vk::CompareOp::EQUAL][half];
        let pass = [vk::StencilOp::REPLACE, vk::StencilOp::INVERT][half];
        let keep = vk::StencilOp::KEEP;
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_set_stencil_test_enable(commands.raw, true);
            device.cmd_set_stencil_op(commands.raw, faces, keep, pass, keep, compare);
            device.cmd_set_stencil_compare_mask(commands.raw, faces, 0x0f);
            device.cmd_set_stencil_write_mask(commands.raw, faces, 0x3f);
            device.cmd_set_stencil_reference(commands.raw, faces, 0x15);
        }
    })
}

pub fn dynamic_vertex_strides(gpu: &Gpu) -> Drawn {
    let options =
        PipelineOptions { dynamic: vec![vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE], ..PipelineOptions::default() };
    let target = Target::new(gpu, &TargetOptions::default());
    let pipeline = Pipeline::new(gpu, &target, &options);
    let buffer = Buffer::of(gpu, &shapes::soup(126, 40));
    Ok(target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        let stride = size_of::<Vertex>() as u64;
        for times in [1, 3] {
            // SAFETY: see the crate.
            unsafe {
                commands.device().cmd_bind_vertex_buffers2(
                    commands.raw,
                    0,
                    &[buffer.raw],
                    &[0],
                    None,
                    Some(&[times * stride]),
                );
            }
            commands.draw(0..30);
        }
    }))
}

/// Executes secondary command buffers in dynamic rendering.
pub fn secondary_command_buffers(gpu: &Gpu) -> Drawn {
    let target = Target::new(gpu, &TargetOptions::with_depth(D32));
    let options = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let buffer = Buffer::of(gpu, &shapes::soup(127, 40));
    let (colors, depth, stencil) = target.formats();
    let secondary = |vertices: std::ops::Range<u32>| {
        let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
            .color_attachment_formats(colors)
            .depth_attachment_format(depth)
            .stencil_attachment_format(stencil)
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
        gpu.record_secondary(&inheritance, |commands| {
            commands.whole(&target);
            commands.bind(&pipeline);
            commands.vertices(&buffer);
            commands.draw(vertices);
        })
    };
    let buffers = [secondary(0..60), secondary(60..120)];
    let pass = Pass { flags: vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS, ..Pass::default() };
    Ok(target.draw(gpu, &pass, |commands| {
        let raw = [buffers[0].raw, buffers[1].raw];
        // SAFETY: see the crate.
        unsafe { commands.device().cmd_execute_commands(commands.raw, &raw) };
    }))
}

/// Clears part of the target between draws.
pub fn clears_within_a_pass(gpu: &Gpu) -> Drawn {
    let target = Target::new(gpu, &TargetOptions::with_depth(D32));
    let options = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let buffer = Buffer::of(gpu, &shapes::soup(128, 40));
    Ok(target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.vertices(&buffer);
        commands.draw(0..60);
        let rect = |x, y, width, height| vk::ClearRect {
            rect: vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } },
            base_array_layer: 0,
            layer_count: 1,
        };
        let color = vk::ClearAttachment {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            color_attachment: 0,
            clear_value: vk::ClearValue { color: vk::ClearColorValue { float32: [0.9, 0.8, 0.1, 0.5] } },
        };
        let depth = vk::ClearAttachment {
            aspect_mask: vk::ImageAspectFlags::DEPTH,
            color_attachment: 0,
            clear_value: vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.4, stencil: 0 } },
        };
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            let rects = [rect(10, 20, 31, 47), rect(70, 3, 9, 100)];
            device.cmd_clear_attachments(commands.raw, &[color], &rects);
            device.cmd_clear_attachments(commands.raw, &[depth], &[rect(30, 30, 70, 70)]);
        }
        commands.draw(60..120);
    }))
}

/// Loads the contents of earlier passes.
pub fn load_and_store(gpu: &Gpu) -> Drawn {
    let areas = [None, Some([13, 17, 60, 71])];
    let name = |area: &Option<[u32; 4]>| format!("area {area:?}");
    Ok(cases(areas, name, |&area| {
        let target = Target::new(gpu, &TargetOptions::with_depth(D32));
        let options = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
        let pipeline = Pipeline::new(gpu, &target, &options);
        let buffer = Buffer::of(gpu, &shapes::soup(129, 40));
        let rect = area.map(|[x, y, width, height]| vk::Rect2D {
            offset: vk::Offset2D { x: x.cast_signed(), y: y.cast_signed() },
            extent: vk::Extent2D { width, height },
        });
        gpu.run(|commands| {
            let draw = |vertices| {
                commands.bind(&pipeline);
                commands.vertices(&buffer);
                if let Some([x, y, width, height]) = area {
                    commands.scissor([x.cast_signed(), y.cast_signed()], [width, height]);
                }
                commands.draw(vertices);
            };
            commands.pass(&target, &Pass::default(), || {
                commands.bind(&pipeline);
                commands.vertices(&buffer);
                commands.draw(0..30);
            });
            let area = Pass { area: rect, ..Pass::load() };
            commands.pass(&target, &area, || draw(30..60));
            let clearing = Pass { area: rect, ..Pass::default() };
            commands.pass(&target, &clearing, || draw(60..90));
        });
        target.output(gpu)
    }))
}

/// Changes pipelines and vertex buffers between draws.
pub fn several_pipelines(gpu: &Gpu) -> Drawn {
    use vk::BlendFactor as Factor;
    let target = Target::new(gpu, &TargetOptions::with_depth(D32));
    let (from, to) = (Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA);
    let first = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
    let second = PipelineOptions { blend: vec![blend(from, to, vk::BlendOp::ADD)], ..PipelineOptions::default() };
    let third = PipelineOptions {
        fragment: Some(
            "layout(location = 0) out vec4 color;
             void main() { color = vec4(gl_FragCoord.xy / 128.0, 0.5, 1.0); }",
        ),
        topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
        ..first.clone()
    };
    let pipelines = [first, second, third].map(|options| Pipeline::new(gpu, &target, &options));
    let buffers = [130, 131, 132].map(|seed| Buffer::of(gpu, &shapes::soup(seed, 8)));
    Ok(target.draw(gpu, &Pass::default(), |commands| {
        for index in [0, 1, 2, 0, 1] {
            commands.bind(&pipelines[index]);
            for buffer in &buffers {
                commands.vertices(buffer);
                let first = 3 * index as u32;
                commands.draw(first..first + 6);
            }
        }
    }))
}
