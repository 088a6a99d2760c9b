//! Scenes of depth and stencil tests.

use ash::vk;
use ash::vk::CompareOp as Compare;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{cases, need, need_format, simple};
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Buffer, Gpu, Output, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex, depth_test,
};

const D32: vk::Format = vk::Format::D32_SFLOAT;

const COMPARISONS: [Compare; 8] = [
    Compare::NEVER,
    Compare::LESS,
    Compare::EQUAL,
    Compare::LESS_OR_EQUAL,
    Compare::GREATER,
    Compare::NOT_EQUAL,
    Compare::GREATER_OR_EQUAL,
    Compare::ALWAYS,
];

fn tested(gpu: &Gpu, format: vk::Format, op: Compare, vertices: &[Vertex]) -> Output {
    let options = PipelineOptions { depth_stencil: depth_test(op), ..PipelineOptions::default() };
    simple(gpu, &TargetOptions::with_depth(format), &options, vertices)
}

/// Draws some triangles twice, so that equal depths occur.
pub fn depth_comparisons(gpu: &Gpu) -> Drawn {
    let mut vertices = shapes::whole(0.5, [0.3; 4]);
    vertices.extend(shapes::soup(40, 30));
    vertices.extend_from_within(6..);
    for vertex in &mut vertices[96..] {
        vertex.color = [1.0; 4];
    }
    let name = |op: &Compare| format!("{op:?}");
    Ok(cases(COMPARISONS, name, |&op| tested(gpu, D32, op, &vertices)))
}

fn depth_format(gpu: &Gpu, format: vk::Format) -> Drawn {
    let feature = vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT;
    need_format(gpu, format, feature)?;
    Ok(tested(gpu, format, Compare::LESS, &shapes::soup(41, 40)))
}

pub fn depth_of_16_bits(gpu: &Gpu) -> Drawn {
    depth_format(gpu, vk::Format::D16_UNORM)
}

pub fn depth_of_24_bits(gpu: &Gpu) -> Drawn {
    depth_format(gpu, vk::Format::X8_D24_UNORM_PACK32)
}

pub fn depth_of_24_bits_and_stencil(gpu: &Gpu) -> Drawn {
    depth_format(gpu, vk::Format::D24_UNORM_S8_UINT)
}

pub fn depth_of_32_bits_and_stencil(gpu: &Gpu) -> Drawn {
    depth_format(gpu, vk::Format::D32_SFLOAT_S8_UINT)
}

pub fn depth_without_writes(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        depth_stencil: depth_test(Compare::LESS).depth_write_enable(false),
        ..PipelineOptions::default()
    };
    let target = Target::new(gpu, &TargetOptions::with_depth(D32));
    let writing = PipelineOptions { depth_stencil: depth_test(Compare::LESS), ..PipelineOptions::default() };
    let writing = Pipeline::new(gpu, &target, &writing);
    let testing = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &shapes::soup(42, 30));
    Ok(target.draw(gpu, &Pass::default(), |commands| {
        commands.vertices(&vertices);
        commands.bind(&writing);
        commands.draw(0..45);
        commands.bind(&testing);
        commands.draw(45..90);
    }))
}

fn biased(gpu: &Gpu, format: vk::Format, constant: f32, slope: f32, clamp: f32) -> Output {
    let raster = PipelineOptions::default()
        .raster
        .depth_bias_enable(true)
        .depth_bias_constant_factor(constant)
        .depth_bias_slope_factor(slope)
        .depth_bias_clamp(clamp);
    let options = PipelineOptions { raster, depth_stencil: depth_test(Compare::LESS), ..PipelineOptions::default() };
    let vertices = shapes::flat_soup(43, 30);
    simple(gpu, &TargetOptions::with_depth(format), &options, &vertices)
}

pub fn constant_depth_bias(gpu: &Gpu) -> Drawn {
    Ok(biased(gpu, vk::Format::D16_UNORM, 500.0, 0.0, 0.0))
}

pub fn constant_depth_bias_of_floats(gpu: &Gpu) -> Drawn {
    Ok(biased(gpu, D32, 100_000.0, 0.0, 0.0))
}

pub fn slope_depth_bias(gpu: &Gpu) -> Drawn {
    Ok(biased(gpu, D32, 0.0, 1.5, 0.0))
}

pub fn clamped_depth_bias(gpu: &Gpu) -> Drawn {
    need("depthBiasClamp", gpu.features().depth_bias_clamp)?;
    Ok(biased(gpu, D32, 0.0, 3.0, 0.02))
}

/// Recolours the result of a first draw where its depths are within the bounds.
pub fn depth_bounds(gpu: &Gpu) -> Drawn {
    need("depthBounds", gpu.features().depth_bounds)?;
    let target = Target::new(gpu, &TargetOptions::with_depth(D32));
    let first = PipelineOptions { depth_stencil: depth_test(Compare::LESS), ..PipelineOptions::default() };
    let second = PipelineOptions {
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_bounds_test_enable(true)
            .min_depth_bounds(0.3)
            .max_depth_bounds(0.6),
        ..PipelineOptions::default()
    };
    let first = Pipeline::new(gpu, &target, &first);
    let second = Pipeline::new(gpu, &target, &second);
    let mut vertices = shapes::soup(44, 30);
    vertices.extend(shapes::whole(0.0, [1.0; 4]));
    let vertices = Buffer::of(gpu, &vertices);
    Ok(target.draw(gpu, &Pass::default(), |commands| {
        commands.vertices(&vertices);
        commands.bind(&first);
        commands.draw(0..90);
        commands.bind(&second);
        commands.draw(90..96);
    }))
}

/// Draws with a fragment shader that writes depth.
pub fn written_depth(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() {
                 color = v_color;
                 float step = fract(gl_FragCoord.x / 7.0) * 0.2;
                 gl_FragDepth = (gl_FrontFacing ? 0.25 : 0.5) + step;
             }",
        ),
        depth_stencil: depth_test(Compare::LESS),
        ..PipelineOptions::default()
    };
    let target = TargetOptions::with_depth(D32);
    Ok(simple(gpu, &target, &options, &shapes::soup(45, 30)))
}

/// Draws with a fragment shader that discards fragments, which must then not write depth either.
pub fn discarded_fragments(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() {
                 ivec2 cell = ivec2(gl_FragCoord.xy) / 3;
                 if ((cell.x + cell.y) % 2 == 0) discard;
                 color = v_color;
             }",
        ),
        depth_stencil: depth_test(Compare::LESS),
        ..PipelineOptions::default()
    };
    let target = TargetOptions::with_depth(D32);
    Ok(simple(gpu, &target, &options, &shapes::soup(46, 30)))
}

pub fn early_fragment_tests(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(early_fragment_tests) in;
             layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() {
                 if (v_color.r < 0.5) discard;
                 color = v_color;
             }",
        ),
        depth_stencil: depth_test(Compare::LESS),
        ..PipelineOptions::default()
    };
    let target = TargetOptions::with_depth(D32);
    Ok(simple(gpu, &target, &options, &shapes::soup(47, 30)))
}

const STENCIL: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;

fn stencil_format(gpu: &Gpu) -> Result<(), gaurast_testkit::drawn::Missing> {
    let feature = vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT;
    need_format(gpu, STENCIL, feature)
}

fn stencil(op: vk::StencilOpState) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    depth_test(Compare::LESS).stencil_test_enable(true).front(op).back(op)
}

/// The values that remain after draws with `state` over stripes of values 0 to 7.
fn over_stripes(gpu: &Gpu, state: &vk::PipelineDepthStencilStateCreateInfo<'static>, vertices: &[Vertex]) -> Output {
    let target = Target::new(gpu, &TargetOptions::with_depth(STENCIL));
    let replace = stencil(vk::StencilOpState {
        pass_op: vk::StencilOp::REPLACE,
        compare_op: Compare::ALWAYS,
        compare_mask: 255,
        write_mask: 255,
        ..Default::default()
    });
    let stripes = PipelineOptions {
        depth_stencil: replace.depth_test_enable(false).depth_write_enable(false),
        dynamic: vec![vk::DynamicState::STENCIL_REFERENCE],
        ..PipelineOptions::default()
    };
    let stripes = Pipeline::new(gpu, &target, &stripes);
    let pipeline = PipelineOptions { depth_stencil: *state, ..PipelineOptions::default() };
    let pipeline = Pipeline::new(gpu, &target, &pipeline);
    let mut all = shapes::whole(0.9, [0.5; 4]);
    all.extend(vertices);
    let buffer = Buffer::of(gpu, &all);
    target.draw(gpu, &Pass::default(), |commands| {
        commands.vertices(&buffer);
        commands.bind(&stripes);
        for (x, value) in (0..).step_by(16).zip([0, 1, 2, 3, 127, 128, 254, 255]) {
            commands.scissor([x, 0], [16, 128]);
            let faces = vk::StencilFaceFlags::FRONT_AND_BACK;
            // SAFETY: see the crate.
            unsafe {
                let device = commands.device();
                device.cmd_set_stencil_reference(commands.raw, faces, value);
            }
            commands.draw(0..6);
        }
        commands.scissor([0, 0], [128, 128]);
        commands.bind(&pipeline);
        commands.draw(6..all.len() as u32);
    })
}

pub fn stencil_comparisons(gpu: &Gpu) -> Drawn {
    stencil_format(gpu)?;
    let vertices = shapes::soup(48, 20);
    let name = |op: &Compare| format!("{op:?}");
    Ok(cases(COMPARISONS, name, |&compare_op| {
        let state = stencil(vk::StencilOpState {
            pass_op: vk::StencilOp::REPLACE,
            compare_op,
            compare_mask: 0x83,
            write_mask: 255,
            reference: 0x82,
            ..Default::default()
        });
        over_stripes(gpu, &state, &vertices)
    }))
}

/// Applies each operation if the stencil test fails, if the depth test fails, and if both pass.
pub fn stencil_operations(gpu: &Gpu) -> Drawn {
    stencil_format(gpu)?;
    let vertices = shapes::soup(49, 20);
    let operations = [
        vk::StencilOp::KEEP,
        vk::StencilOp::ZERO,
        vk::StencilOp::REPLACE,
        vk::StencilOp::INCREMENT_AND_CLAMP,
        vk::StencilOp::DECREMENT_AND_CLAMP,
        vk::StencilOp::INVERT,
        vk::StencilOp::INCREMENT_AND_WRAP,
        vk::StencilOp::DECREMENT_AND_WRAP,
    ];
    let all = (0..8).flat_map(|index| (0..3).map(move |place| (index, place)));
    let name = |&(index, place): &(usize, usize)| {
        let place = ["fail", "depth fail", "pass"][place];
        format!("{:?} on {place}", operations[index])
    };
    Ok(cases(all, name, |&(index, place)| {
        let op = |of| {
            if place == of { operations[index] } else { vk::StencilOp::KEEP }
        };
        let state = stencil(vk::StencilOpState {
            fail_op: op(0),
            depth_fail_op: op(1),
            pass_op: op(2),
            compare_op: Compare::GREATER,
            compare_mask: 255,
            write_mask: 255,
            reference: 100,
        });
        over_stripes(gpu, &state, &vertices)
    }))
}

pub fn stencil_write_mask(gpu: &Gpu) -> Drawn {
    stencil_format(gpu)?;
    let state = stencil(vk::StencilOpState {
        pass_op: vk::StencilOp::INVERT,
        depth_fail_op: vk::StencilOp::REPLACE,
        compare_op: Compare::ALWAYS,
        compare_mask: 255,
        write_mask: 0x5a,
        reference: 0x33,
        ..Default::default()
    });
    Ok(over_stripes(gpu, &state, &shapes::soup(50, 20)))
}

/// Draws front and back faces with separate stencil state.
pub fn two_sided_stencil(gpu: &Gpu) -> Drawn {
    stencil_format(gpu)?;
    let face = |pass_op| vk::StencilOpState {
        pass_op,
        compare_op: Compare::ALWAYS,
        compare_mask: 255,
        write_mask: 255,
        ..Default::default()
    };
    let state = stencil(face(vk::StencilOp::KEEP))
        .depth_test_enable(false)
        .front(face(vk::StencilOp::INCREMENT_AND_WRAP))
        .back(face(vk::StencilOp::DECREMENT_AND_WRAP));
    Ok(over_stripes(gpu, &state, &shapes::soup(51, 30)))
}
