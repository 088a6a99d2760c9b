//! Scenes of geometry shaders.

use ash::vk;
use ash::vk::PrimitiveTopology as Topology;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{cases, need, simple, with};
use gaurast_testkit::shader::Stage;
use gaurast_testkit::shapes;
use gaurast_testkit::{Buffer, Gpu, Output, PipelineOptions, TargetOptions, Vertex, blend};

/// Draws with a geometry shader.
fn drawn(gpu: &Gpu, topology: Topology, geometry: &str, vertices: &[Vertex]) -> Output {
    let options = of(topology, geometry);
    simple(gpu, &TargetOptions::default(), &options, vertices)
}

fn of(topology: Topology, geometry: &str) -> PipelineOptions<'_> {
    PipelineOptions { topology, between: vec![(Stage::Geometry, geometry)], ..PipelineOptions::default() }
}

fn needed(gpu: &Gpu) -> Result<(), gaurast_testkit::drawn::Missing> {
    need("geometryShader", gpu.features().geometry_shader)
}

/// A shader that emits its primitive unchanged.
fn passing_on(input: &str, output: &str) -> String {
    format!(
        "layout({input}) in;
         layout({output}, max_vertices = 3) out;
         layout(location = 0) in vec4 color[];
         layout(location = 0) out vec4 v_color;
         void main() {{
             for (int i = 0; i < gl_in.length(); i++) {{
                 gl_Position = gl_in[i].gl_Position;
                 gl_PointSize = 1.0;
                 v_color = color[i];
                 EmitVertex();
             }}
         }}"
    )
}

/// Points, lines and triangles that the shader leaves as they are.
pub fn geometry_passes_on(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let kinds = [
        (Topology::POINT_LIST, "points", "points"),
        (Topology::LINE_LIST, "lines", "line_strip"),
        (Topology::LINE_STRIP, "lines", "line_strip"),
        (Topology::TRIANGLE_LIST, "triangles", "triangle_strip"),
        (Topology::TRIANGLE_STRIP, "triangles", "triangle_strip"),
        (Topology::TRIANGLE_FAN, "triangles", "triangle_strip"),
    ];
    let name = |&(topology, ..): &(Topology, &str, &str)| format!("{topology:?}");
    Ok(cases(kinds, name, |&(topology, input, output)| {
        let vertices = match topology {
            Topology::TRIANGLE_LIST => shapes::soup(200, 30),
            _ => shapes::zigzag(201, 13),
        };
        drawn(gpu, topology, &passing_on(input, output), &vertices)
    }))
}

/// A shader that marks each vertex of its primitive, beside the vertex, in an order and a colour by its number.
fn marking(input: &str) -> String {
    format!(
        "layout({input}) in;
         layout(triangle_strip, max_vertices = 24) out;
         layout(location = 0) in vec4 color[];
         layout(location = 0) out vec4 v_color;
         void main() {{
             for (int i = 0; i < gl_in.length(); i++) {{
                 vec2 at = gl_in[i].gl_Position.xy / gl_in[i].gl_Position.w;
                 at += 0.03 * vec2(gl_PrimitiveIDIn % 5, i);
                 for (int corner = 0; corner < 4; corner++) {{
                     vec2 offset = 0.02 * vec2(corner & 1, corner >> 1);
                     gl_Position = vec4(at + offset, 0.0, 1.0);
                     v_color = vec4(float(i) / 8.0, float(gl_PrimitiveIDIn) / 16.0, color[i].b, 1.0);
                     EmitVertex();
                 }}
                 EndPrimitive();
             }}
         }}"
    )
}

const ADJACENT: [(Topology, &str); 4] = [
    (Topology::LINE_LIST_WITH_ADJACENCY, "lines_adjacency"),
    (Topology::LINE_STRIP_WITH_ADJACENCY, "lines_adjacency"),
    (Topology::TRIANGLE_LIST_WITH_ADJACENCY, "triangles_adjacency"),
    (Topology::TRIANGLE_STRIP_WITH_ADJACENCY, "triangles_adjacency"),
];

/// The order of the vertices of primitives with adjacent ones, in runs of all lengths.
pub fn adjacent_vertices(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let all = ADJACENT.into_iter().flat_map(|kind| [4, 5, 6, 8, 13, 14].map(|count| (kind, count)));
    let name = |&((topology, _), count): &_| format!("{topology:?} {count}");
    Ok(cases(all, name, |&((topology, input), count)| {
        let vertices = shapes::zigzag(210, count);
        drawn(gpu, topology, &marking(input), &vertices)
    }))
}

/// The same with indices and primitive restart.
pub fn adjacent_vertices_of_indices(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let strips = [ADJACENT[1], ADJACENT[3]];
    let name = |&(topology, _): &_| format!("{topology:?}");
    Ok(cases(strips, name, |&(topology, input)| {
        let shader = marking(input);
        let options = PipelineOptions { restart: true, ..of(topology, &shader) };
        let indices: Vec<u32> = [9, 2, 7, 0, 5, 1, 8, 3, u32::MAX, 4, 6, u32::MAX]
            .into_iter()
            .chain([0, 1, 2, 3, 4, 5, 6, 7, 8, 9])
            .collect();
        let buffer = Buffer::of(gpu, &indices);
        let vertices = shapes::zigzag(211, 10);
        with(gpu, &TargetOptions::default(), &options, &vertices, |commands| {
            commands.indices(&buffer, 0, vk::IndexType::UINT32);
            commands.draw_indexed(0..indices.len() as u32, 0);
        })
    }))
}

/// Strips of different lengths: some are too short, and the last is not ended.
pub fn strips_of_geometry(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let shader = |output: &str| {
        format!(
            "layout(points) in;
             layout({output}, max_vertices = 40) out;
             layout(location = 0) in vec4 color[];
             layout(location = 0) out vec4 v_color;
             void main() {{
                 vec2 center = gl_in[0].gl_Position.xy / gl_in[0].gl_Position.w;
                 int strips = gl_PrimitiveIDIn % 4;
                 for (int strip = 0; strip <= strips; strip++) {{
                     for (int i = 0; i < strip + gl_PrimitiveIDIn % 3; i++) {{
                         vec2 offset = vec2(0.05 * float(i), 0.04 * float(i & 1) + 0.06 * float(strip));
                         gl_Position = vec4(center + offset, 0.0, 1.0);
                         gl_PointSize = 1.0;
                         v_color = vec4(color[0].rgb, 1.0) * (1.0 - 0.1 * float(i));
                         EmitVertex();
                     }}
                     if (strip < strips) EndPrimitive();
                 }}
             }}"
        )
    };
    let outputs = ["points", "line_strip", "triangle_strip"];
    Ok(cases(
        outputs,
        |output| (*output).to_owned(),
        |output| drawn(gpu, Topology::POINT_LIST, &shader(output), &shapes::points(220, 40)),
    ))
}

/// Several invocations for each primitive, in order, and more vertices than are declared.
pub fn invocations_of_geometry(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let shader = "
        layout(points, invocations = 7) in;
        layout(triangle_strip, max_vertices = 4) out;
        layout(location = 0) in vec4 color[];
        layout(location = 0) out vec4 v_color;
        void main() {
            vec2 center = gl_in[0].gl_Position.xy / gl_in[0].gl_Position.w;
            for (int corner = 0; corner < 4 - (gl_InvocationID & 1); corner++) {
                vec2 offset = vec2(corner & 1, corner >> 1) * 0.1 + 0.03 * float(gl_InvocationID);
                gl_Position = vec4(center + offset, 0.0, 1.0);
                v_color = color[0] * float(gl_InvocationID + 1) / 7.0;
                EmitVertex();
            }
        }";
    Ok(drawn(gpu, Topology::POINT_LIST, shader, &shapes::points(230, 60)))
}

/// The numbers of primitives that the shader takes and gives.
pub fn numbers_from_geometry(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let shader = "
        layout(triangles) in;
        layout(triangle_strip, max_vertices = 3) out;
        void main() {
            for (int i = 0; i < 3; i++) {
                gl_Position = gl_in[i].gl_Position;
                gl_PrimitiveID = 1000 + 3 * gl_PrimitiveIDIn;
                EmitVertex();
            }
        }";
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) out uint number;
             void main() { number = gl_PrimitiveID; }",
        ),
        ..of(Topology::TRIANGLE_LIST, shader)
    };
    let target = TargetOptions::of(vk::Format::R32_UINT);
    Ok(simple(gpu, &target, &options, &shapes::soup(240, 40)))
}

/// Thousands of points become blended quads, whose order shows.
pub fn points_become_quads(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let shader = "
        layout(points) in;
        layout(triangle_strip, max_vertices = 4) out;
        layout(location = 0) in vec4 color[];
        layout(location = 0) out vec4 v_color;
        void main() {
            vec4 center = gl_in[0].gl_Position;
            for (int corner = 0; corner < 4; corner++) {
                vec2 offset = (vec2(corner & 1, corner >> 1) - 0.5) * 0.06;
                gl_Position = vec4(center.xy / center.w + offset, 0.0, 1.0);
                v_color = vec4(color[0].rgb, 0.5);
                EmitVertex();
            }
        }";
    let (from, to) = (vk::BlendFactor::SRC_ALPHA, vk::BlendFactor::ONE_MINUS_SRC_ALPHA);
    let options =
        PipelineOptions { blend: vec![blend(from, to, vk::BlendOp::ADD)], ..of(Topology::POINT_LIST, shader) };
    let vertices = shapes::points(250, 4000);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

/// Blocks, arrays, integers and components of locations, into the shader and out of it.
pub fn interfaces_of_geometry(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let vertex = "
        layout(location = 0) in vec4 position;
        layout(location = 1) in vec4 color;
        layout(location = 0) out Block { vec4 color; mat2 turn; vec2 list[2]; } block;
        layout(location = 5) flat out ivec2 whole;
        layout(location = 6, component = 1) out float scalar;
        void main() {
            gl_Position = position;
            block.color = color;
            block.turn = mat2(color.r, color.g, -color.g, color.r);
            block.list[0] = color.rb;
            block.list[1] = color.gb;
            whole = ivec2(gl_VertexIndex, -gl_VertexIndex);
            scalar = color.b;
        }";
    let geometry = "
        layout(triangles) in;
        layout(triangle_strip, max_vertices = 3) out;
        layout(location = 0) in Block { vec4 color; mat2 turn; vec2 list[2]; } block[];
        layout(location = 5) flat in ivec2 whole[];
        layout(location = 6, component = 1) in float scalar[];
        layout(location = 2) out Out { vec3 values[2]; } given;
        layout(location = 7) flat out int number;
        void main() {
            for (int i = 0; i < 3; i++) {
                int other = (i + gl_PrimitiveIDIn) % 3;
                gl_Position = gl_in[i].gl_Position;
                given.values[0] = vec3(block[other].turn * block[other].list[i & 1], scalar[other]);
                given.values[1] = block[i].color.rgb;
                number = whole[other].x - whole[i].y;
                EmitVertex();
            }
        }";
    let options = PipelineOptions {
        vertex,
        fragment: Some(
            "layout(location = 2) in Out { vec3 values[2]; } given;
             layout(location = 7) flat in int number;
             layout(location = 0) out vec4 color;
             void main() {
                 color = vec4(0.5 * given.values[0] + 0.5 * given.values[1], float(number % 16) / 16.0);
             }",
        ),
        ..of(Topology::TRIANGLE_LIST, geometry)
    };
    let target = TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT);
    Ok(simple(gpu, &target, &options, &shapes::soup(260, 30)))
}

/// Point sizes and clip distances that the shader writes.
pub fn sizes_and_distances_of_geometry(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let size = gpu.features().shader_tessellation_and_geometry_point_size;
    need("shaderTessellationAndGeometryPointSize", size)?;
    need("shaderClipDistance", gpu.features().shader_clip_distance)?;
    let points = "
        layout(points) in;
        layout(points, max_vertices = 1) out;
        layout(location = 0) in vec4 color[];
        layout(location = 0) out vec4 v_color;
        void main() {
            gl_Position = gl_in[0].gl_Position;
            gl_PointSize = 1.0 + float(gl_PrimitiveIDIn % 9);
            v_color = color[0];
            EmitVertex();
        }";
    let clipped = "
        layout(triangles) in;
        layout(triangle_strip, max_vertices = 3) out;
        layout(location = 0) in vec4 color[];
        layout(location = 0) out vec4 v_color;
        out gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[2]; };
        void main() {
            for (int i = 0; i < 3; i++) {
                gl_Position = gl_in[i].gl_Position;
                gl_ClipDistance[0] = gl_Position.x + 0.7 * gl_Position.w;
                gl_ClipDistance[1] = 0.6 * gl_Position.w - gl_Position.y;
                v_color = color[i];
                EmitVertex();
            }
        }";
    let kinds = [("sizes", Topology::POINT_LIST, points), ("distances", Topology::TRIANGLE_LIST, clipped)];
    let name = |&(name, ..): &(&str, _, _)| name.to_owned();
    Ok(cases(kinds, name, |&(_, topology, shader)| {
        let vertices = match topology {
            Topology::POINT_LIST => shapes::points(270, 60),
            _ => shapes::soup(271, 40),
        };
        drawn(gpu, topology, shader, &vertices)
    }))
}

/// Flat values of strips, which are those of their triangles' first vertices.
pub fn flat_values_of_strips(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let shader = "
        layout(lines) in;
        layout(triangle_strip, max_vertices = 9) out;
        layout(location = 0) in vec4 color[];
        layout(location = 0) flat out vec4 v_color;
        void main() {
            vec2 from = gl_in[0].gl_Position.xy / gl_in[0].gl_Position.w;
            for (int i = 0; i < 9; i++) {
                vec2 offset = vec2(0.08 * float(i), 0.2 * float(i & 1));
                gl_Position = vec4(from + offset, 0.0, 1.0);
                v_color = mix(color[0], color[1], float(i) / 8.0);
                EmitVertex();
            }
        }";
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) flat in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() { color = v_color; }",
        ),
        ..of(Topology::LINE_LIST, shader)
    };
    let vertices = shapes::points(280, 12);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}
