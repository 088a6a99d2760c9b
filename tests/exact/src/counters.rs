//! Numbers that the pipeline counts, and what transform feedback captures.

use ash::vk;
use ash::vk::PrimitiveTopology as Topology;
use ash::vk::QueryPipelineStatisticFlags as Statistics;
use gaurast_testkit::shader::Stage;
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Buffer, Commands, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, TransformFeedback, Vertex,
    depth_test,
};

/// Triangles of a draw.
const TRIANGLES: usize = 300;

const CONTROL: &str = "
    layout(vertices = 3) out;
    layout(location = 0) in vec4 color[];
    layout(location = 0) out vec4 c_color[];
    void main() {
        gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
        c_color[gl_InvocationID] = color[gl_InvocationID];
        gl_TessLevelOuter[gl_InvocationID] = 1.0 + 5.0 * color[gl_InvocationID].x;
        gl_TessLevelInner[0] = 1.0 + 4.0 * color[0].y;
    }";
const EVALUATION: &str = "
    layout(triangles, fractional_odd_spacing) in;
    layout(location = 0) in vec4 c_color[];
    layout(xfb_buffer = 0, xfb_stride = 32, xfb_offset = 16, location = 0) out vec4 v_color;
    layout(xfb_buffer = 0, xfb_offset = 0) out gl_PerVertex { vec4 gl_Position; };
    void main() {
        vec3 t = gl_TessCoord;
        gl_Position = t.x * gl_in[0].gl_Position + t.y * gl_in[1].gl_Position + t.z * gl_in[2].gl_Position;
        v_color = t.x * c_color[0] + t.y * c_color[1] + t.z * c_color[2];
    }";
const GEOMETRY: &str = "
    layout(triangles) in;
    layout(triangle_strip, max_vertices = 4) out;
    layout(location = 0) in vec4 color[];
    layout(xfb_buffer = 0, xfb_stride = 32, xfb_offset = 16, location = 0) out vec4 v_color;
    layout(xfb_buffer = 0, xfb_offset = 0) out gl_PerVertex { vec4 gl_Position; };
    void main() {
        for (int i = 0; i < 3 + gl_PrimitiveIDIn % 2; i++) {
            gl_Position = gl_in[i % 3].gl_Position * (1.0 + 0.1 * sin(float(i)));
            v_color = pow(color[i % 3], vec4(1.7));
            EmitVertex();
        }
        EndPrimitive();
    }";
const CAPTURED: &str = "
    layout(location = 0) in vec4 position;
    layout(location = 1) in vec4 color;
    layout(xfb_buffer = 0, xfb_stride = 32, xfb_offset = 16, location = 0) out vec4 v_color;
    layout(xfb_buffer = 0, xfb_offset = 0) out gl_PerVertex { vec4 gl_Position; };
    void main() { gl_Position = position * exp(-position.w); v_color = sqrt(color) * sin(9.0 * color.x); }";
const PASSED: &str = "
    layout(location = 0) in vec4 position;
    layout(location = 1) in vec4 color;
    layout(location = 0) out vec4 v_color;
    void main() { gl_Position = position; v_color = color; }";

/// The stages between the vertex and the fragment shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Between {
    /// None.
    Nothing,
    /// Tessellation.
    Tessellation,
    /// A geometry shader.
    Geometry,
}

impl Between {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Nothing, Self::Tessellation, Self::Geometry];

    /// The name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Nothing => "vertices",
            Self::Tessellation => "tessellation",
            Self::Geometry => "geometry",
        }
    }

    fn options(self) -> PipelineOptions<'static> {
        let options = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
        match self {
            Self::Nothing => PipelineOptions { vertex: CAPTURED, ..options },
            Self::Tessellation => PipelineOptions {
                vertex: PASSED,
                between: vec![(Stage::TessellationControl, CONTROL), (Stage::TessellationEvaluation, EVALUATION)],
                topology: Topology::PATCH_LIST,
                patch_vertices: 3,
                ..options
            },
            Self::Geometry => PipelineOptions { vertex: PASSED, between: vec![(Stage::Geometry, GEOMETRY)], ..options },
        }
    }
}

/// Triangles within, across and outside the borders of the view volume.
fn triangles() -> Vec<Vertex> {
    let mut vertices = shapes::soup(7, TRIANGLES);
    for (at, vertex) in vertices.iter_mut().enumerate() {
        let moved = (at / 3 % 5) as f32;
        vertex.position[0] += 0.6 * moved - 1.2;
    }
    vertices
}

/// Draws triangles on a target with depth, within `around`, which begins and ends a query or a capture.
fn draw(gpu: &Gpu, between: Between, samples: u32, around: impl FnOnce(&Commands, &dyn Fn())) {
    let options = TargetOptions { samples, size: [96, 72], ..TargetOptions::with_depth(vk::Format::D32_SFLOAT) };
    let target = Target::new(gpu, &options);
    let pipeline = Pipeline::new(gpu, &target, &between.options());
    let vertices = triangles();
    let buffer = Buffer::of(gpu, &vertices);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::default(), || {
            commands.bind(&pipeline);
            commands.vertices(&buffer);
            around(commands, &|| commands.draw(0..vertices.len() as u32));
        });
    });
}

/// The words of a query of these draws: `count` numbers.
fn queried(gpu: &Gpu, info: vk::QueryPoolCreateInfo<'_>, count: usize, between: Between, samples: u32) -> Vec<u64> {
    let device = gpu.device();
    // SAFETY: see the testkit.
    let pool = unsafe { device.create_query_pool(&info.query_count(1), None) }.expect("a pool");
    gpu.run(|commands| {
        // SAFETY: see the testkit.
        unsafe { device.cmd_reset_query_pool(commands.raw().1, pool, 0, 1) };
    });
    let flags = match info.query_type {
        vk::QueryType::OCCLUSION => vk::QueryControlFlags::PRECISE,
        _ => vk::QueryControlFlags::empty(),
    };
    draw(gpu, between, samples, |commands, draws| {
        let commands = commands.raw().1;
        // SAFETY: see the testkit.
        unsafe { device.cmd_begin_query(commands, pool, 0, flags) };
        draws();
        // SAFETY: see the testkit.
        unsafe { device.cmd_end_query(commands, pool, 0) };
    });
    let mut bytes = vec![0_u8; 8 * count];
    let flags = vk::QueryResultFlags::WAIT | vk::QueryResultFlags::TYPE_64;
    // SAFETY: see the testkit; the bytes are as many as the results.
    unsafe {
        let fetch = device.fp_v1_0().get_query_pool_results;
        let stride = bytes.len() as u64;
        let got = fetch(device.handle(), pool, 0, 1, bytes.len(), bytes.as_mut_ptr().cast(), stride, flags);
        got.result().expect("results");
        device.destroy_query_pool(pool, None);
    }
    bytemuck::pod_collect_to_vec(&bytes)
}

/// All pipeline statistics.
pub(crate) fn statistics(gpu: &Gpu, between: Between) -> Vec<u64> {
    let counted = Statistics::from_raw(0x7ff);
    let info =
        vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::PIPELINE_STATISTICS).pipeline_statistics(counted);
    queried(gpu, info, 11, between, 1)
}

/// The number of samples that pass the tests.
pub(crate) fn passing_samples(gpu: &Gpu, between: Between, samples: u32) -> Vec<u64> {
    queried(gpu, vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::OCCLUSION), 1, between, samples)
}

/// The vertices that transform feedback captures, and the number of bytes that it counts.
pub(crate) fn captured(gpu: &Gpu, between: Between) -> Vec<u32> {
    let feedback = TransformFeedback::new(gpu);
    let buffer = |words: usize| {
        let buffer = Buffer::with_usage(gpu, 4 * words as u64, TransformFeedback::usage());
        buffer.write(&vec![0_u32; words]);
        buffer
    };
    // A patch of the greatest level has fewer than 40 triangles.
    let (vertices, counter) = (buffer(TRIANGLES * 40 * 3 * 8), buffer(1));
    draw(gpu, between, 1, |commands, draws| {
        feedback.bind(commands, 0, &[(&vertices, 0)]);
        feedback.begin(commands, &[(&counter, 0)]);
        draws();
        feedback.end(commands, &[(&counter, 0)]);
    });
    let mut words: Vec<u32> = counter.values();
    words.extend(vertices.values::<u32>());
    words
}
