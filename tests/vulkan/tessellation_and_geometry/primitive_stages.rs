//! Tessellation and geometry stages: what is refused, what statistics count, and the numbers of primitives.

use ash::vk;
use gaurast_testkit::Pass;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::{
    Buffer, FRAGMENT, Gpu, Graphics, Pipeline, PipelineOptions, Settings, Shader, Target, TargetOptions, VERTEX,
    Vertex, attribute, binding,
};

/// A shader of GLSL that does nothing.
fn idle(stage: Stage, layout: &str) -> Shader {
    let source = format!("{layout} void main() {{}}");
    Shader::new(stage.flag(), compile(stage, &source))
}

fn geometry() -> Shader {
    let layout = "layout(triangles) in; layout(points, max_vertices = 1) out;";
    idle(Stage::Geometry, layout)
}

fn control() -> Shader {
    idle(Stage::TessellationControl, "layout(vertices = 3) out;")
}

fn evaluation(domain: &str) -> Shader {
    let layout = format!("layout({domain}) in;");
    idle(Stage::TessellationEvaluation, &layout)
}

/// A pipeline with these stages between a vertex and a fragment stage.
fn with(between: &[Shader], topology: vk::PrimitiveTopology, patch_vertices: u32) -> Graphics<'static> {
    let (vertex, fragment) = (compile(Stage::Vertex, VERTEX), compile(Stage::Fragment, FRAGMENT));
    let mut shaders = vec![Shader::vertex(vertex)];
    shaders.extend_from_slice(between);
    shaders.push(Shader::fragment(fragment));
    Graphics {
        shaders,
        topology,
        patch_vertices,
        bindings: vec![binding(0, size_of::<Vertex>() as u32)],
        attributes: [(0, 0), (1, 16)]
            .map(|(location, offset)| attribute(location, vk::Format::R32G32B32A32_SFLOAT, offset))
            .to_vec(),
        ..Graphics::default()
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn stages_that_do_not_fit_are_refused() {
    // A device of its own, whose messages no other test causes.
    let gpu = Gpu::embedded(&Settings::default()).expect("a device");
    let (triangles, patches) = (vk::PrimitiveTopology::TRIANGLE_LIST, vk::PrimitiveTopology::PATCH_LIST);
    let strips = vk::PrimitiveTopology::LINE_STRIP;
    let both = [control(), evaluation("triangles")];
    let lines = [control(), evaluation("isolines"), geometry()];
    let cases = [
        (with(&both[..1], patches, 3), "pStages-00729"),
        (with(&both[1..], patches, 3), "pStages-00730"),
        (with(&both, triangles, 3), "pStages-00736"),
        (with(&[], patches, 3), "topology-00737"),
        (with(&both, patches, 33), "patchControlPoints-01214"),
        (with(&lines, patches, 3), "pStages-00739"),
        (with(&lines[2..], strips, 0), "pStages-00738"),
    ];
    for (request, rule) in &cases {
        let refused = request.create(&gpu).map(drop);
        let message = gpu.message_texts().concat();
        assert!(refused.is_err(), "{rule}");
        assert!(message.contains(rule), "{rule}: {message}");
    }
    let quads = [control(), evaluation("quads")];
    for (shaders, topology, count) in
        [(&both[..], patches, 32), (&quads[..], patches, 1), (&[geometry()][..], triangles, 0)]
    {
        let created = with(shaders, topology, count).create(&gpu).map(drop);
        assert_eq!(created, Ok(()), "{:?}", gpu.message_texts());
    }
}

const CONTROL: &str = "
    layout(vertices = 4) out;
    void main() {
        gl_out[gl_InvocationID].gl_Position = gl_in[0].gl_Position;
        // The third of four patches is discarded.
        gl_TessLevelOuter[gl_InvocationID] = gl_PrimitiveID == 2 ? 0.0 : 2.0;
        gl_TessLevelInner[gl_InvocationID & 1] = 4.0;
    }";
const EVALUATION: &str = "
    layout(quads) in;
    void main() { gl_Position = vec4(gl_TessCoord.xy, 0.0, 1.0); }";
/// Every other primitive becomes two points, one of them beyond the view volume.
const GEOMETRY: &str = "
    layout(triangles) in;
    layout(points, max_vertices = 2) out;
    layout(location = 0) out vec4 v_color;
    void main() {
        for (int i = 0; i < 2 && gl_PrimitiveIDIn % 2 == 0; i++) {
            gl_Position = vec4(3.0 * float(i), 0.0, 0.0, 1.0);
            gl_PointSize = 1.0;
            v_color = vec4(float(gl_PrimitiveIDIn));
            EmitVertex();
        }
    }";

fn options() -> PipelineOptions<'static> {
    PipelineOptions {
        topology: vk::PrimitiveTopology::PATCH_LIST,
        patch_vertices: 3,
        between: vec![
            (Stage::TessellationControl, CONTROL),
            (Stage::TessellationEvaluation, EVALUATION),
            (Stage::Geometry, GEOMETRY),
        ],
        ..PipelineOptions::default()
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn statistics_count_patches_and_primitives() {
    use vk::QueryPipelineStatisticFlags as Flags;
    let gpu = own();
    let device = gpu.device();
    let counted = Flags::INPUT_ASSEMBLY_VERTICES
        | Flags::INPUT_ASSEMBLY_PRIMITIVES
        | Flags::VERTEX_SHADER_INVOCATIONS
        | Flags::GEOMETRY_SHADER_INVOCATIONS
        | Flags::GEOMETRY_SHADER_PRIMITIVES
        | Flags::CLIPPING_INVOCATIONS
        | Flags::CLIPPING_PRIMITIVES
        | Flags::TESSELLATION_CONTROL_SHADER_PATCHES
        | Flags::TESSELLATION_EVALUATION_SHADER_INVOCATIONS;
    let info = vk::QueryPoolCreateInfo::default()
        .query_type(vk::QueryType::PIPELINE_STATISTICS)
        .pipeline_statistics(counted)
        .query_count(1);
    let target = Target::new(gpu, &TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT));
    let pipeline = Pipeline::new(gpu, &target, &options());
    let vertices = Buffer::of(gpu, &[[0.0f32; 8]; 13]);
    // SAFETY: see the crate.
    let pool = unsafe { device.create_query_pool(&info, None).expect("a pool") };
    gpu.run(|commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_reset_query_pool(commands.raw, pool, 0, 1) };
        commands.pass(&target, &Pass::default(), || {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_begin_query(commands.raw, pool, 0, vk::QueryControlFlags::empty());
            };
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            // The last vertex makes no patch.
            commands.draw_instances(0..13, 0..2);
            // SAFETY: see the crate.
            unsafe { device.cmd_end_query(commands.raw, pool, 0) };
        });
    });
    let mut results = [[0u64; 9]];
    let flags = vk::QueryResultFlags::WAIT | vk::QueryResultFlags::TYPE_64;
    // SAFETY: see the crate.
    unsafe {
        let got = device.get_query_pool_results(pool, 0, &mut results, flags);
        got.expect("results");
        device.destroy_query_pool(pool, None);
    }
    // Inside each patch is a grid of 2x2 cells, and around it strips of 2 + 2 segments: 9 + 8 points, 8 + 16 triangles.
    let (patches, points, triangles) = (2 * 3, 9 + 8, 8 + 16);
    let shaded = results[0][2];
    assert!((24..=26).contains(&shaded), "{shaded} vertices are shaded");
    let geometry = patches * triangles;
    // Half of the points are beside the view volume, which clips none of them.
    let expected = [26, 8, shaded, geometry, geometry, geometry, geometry, 8, patches * points];
    assert_eq!(results[0], expected);
}

/// The geometry stage sees the numbers of all tessellated primitives of the instance, whatever the number of threads is.
#[gaurast_runner::test(needs = [GLSLANG])]
fn primitives_after_tessellation_are_numbered() {
    let control = "
        layout(vertices = 1) out;
        void main() {
            gl_TessLevelOuter[0] = 1.0;
            gl_TessLevelOuter[1] = float(1 + gl_PrimitiveID % 3);
        }";
    let evaluation = "layout(isolines) in; void main() { gl_Position = vec4(0.0); }";
    // Primitive n becomes a point in column n.
    let geometry = "
        layout(lines) in;
        layout(points, max_vertices = 1) out;
        layout(location = 0) out vec4 v_color;
        void main() {
            int n = gl_PrimitiveIDIn;
            gl_Position = vec4((vec2(n % 128, n / 128) + 0.5) / 64.0 - 1.0, 0.0, 1.0);
            gl_PointSize = 1.0;
            v_color = vec4(1.0);
            EmitVertex();
        }";
    let options = PipelineOptions {
        patch_vertices: 1,
        between: vec![
            (Stage::TessellationControl, control),
            (Stage::TessellationEvaluation, evaluation),
            (Stage::Geometry, geometry),
        ],
        ..options()
    };
    let one = vk::BlendFactor::ONE;
    let options = PipelineOptions { blend: vec![gaurast_testkit::blend(one, one, vk::BlendOp::ADD)], ..options };
    let gpu = own();
    let options_of_target = TargetOptions { size: [128, 128], ..TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT) };
    let target = Target::new(gpu, &options_of_target);
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &[[0.0f32; 8]; 1000]);
    let drawn = target.draw(gpu, &Pass::zeros(), |commands| {
        commands.bind(&pipeline);
        commands.vertices(&vertices);
        commands.draw_instances(0..1000, 0..3);
    });
    let pixels: &[[f32; 4]] = bytemuck::cast_slice(&drawn.pictures[0].bytes);
    // Patches have 1, 2 or 3 lines.
    let count = (0..1000).map(|patch| 1 + patch % 3).sum::<usize>();
    for (number, pixel) in pixels.iter().enumerate() {
        let expected = if number < count { 3.0 } else { 0.0 };
        assert_eq!(pixel[0], expected, "primitive {number}");
    }
}
