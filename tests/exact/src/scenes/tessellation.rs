//! Scenes of tessellation shaders. Values are linear over patches, or patches become points or lines, since the triangles of a
//! patch may differ between drivers.

use ash::vk;
use ash::vk::PrimitiveTopology as Topology;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{cases, need, simple};
use gaurast_testkit::shader::Stage;
use gaurast_testkit::shapes;
use gaurast_testkit::{Gpu, PipelineOptions, TargetOptions, Vertex, blend};

/// A control shader that passes on `count` vertices and sets the levels.
fn control(count: u32, levels: &str) -> String {
    format!(
        "layout(vertices = {count}) out;
         layout(location = 0) in vec4 color[];
         layout(location = 0) out vec4 c_color[];
         void main() {{
             gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
             c_color[gl_InvocationID] = color[gl_InvocationID];
             int patch_number = gl_PrimitiveID;
             {levels}
         }}"
    )
}

/// Levels that differ between edges and patches.
const LEVELS: &str = "
    gl_TessLevelOuter[0] = 1.0 + 0.7 * float(patch_number);
    gl_TessLevelOuter[1] = 3.3;
    gl_TessLevelOuter[2] = 8.0 - 0.4 * float(patch_number);
    gl_TessLevelOuter[3] = 2.5;
    gl_TessLevelInner[0] = 1.0 + float(patch_number);
    gl_TessLevelInner[1] = 4.5;";

/// Levels whose points have the same coordinates in any implementation.
const WHOLE_LEVELS: &str = "
    gl_TessLevelOuter[0] = patch_number % 2 == 0 ? 8.0 : 2.0;
    gl_TessLevelOuter[1] = 4.0;
    gl_TessLevelOuter[2] = 16.0;
    gl_TessLevelOuter[3] = 1.0;
    gl_TessLevelInner[0] = 2.0;
    gl_TessLevelInner[1] = 8.0;";

/// An evaluation shader with this layout.
fn evaluation(layout: &str) -> String {
    let (position, color) = if layout.starts_with("triangles") {
        (
            "gl_TessCoord.x * gl_in[0].gl_Position + gl_TessCoord.y * gl_in[1].gl_Position
                 + gl_TessCoord.z * gl_in[2].gl_Position",
            "gl_TessCoord.x * c_color[0] + gl_TessCoord.y * c_color[1] + gl_TessCoord.z * c_color[2]",
        )
    } else {
        (
            "mix(mix(gl_in[0].gl_Position, gl_in[1].gl_Position, gl_TessCoord.x),
                 mix(gl_in[2].gl_Position, gl_in[3].gl_Position, gl_TessCoord.x), gl_TessCoord.y)",
            "vec4(gl_TessCoord.xy, 0.25, 1.0)",
        )
    };
    format!(
        "layout({layout}) in;
         layout(location = 0) in vec4 c_color[];
         layout(location = 0) out vec4 v_color;
         void main() {{
             gl_Position = {position};
             gl_PointSize = 1.0;
             v_color = {color};
         }}"
    )
}

fn needed(gpu: &Gpu) -> Result<(), gaurast_testkit::drawn::Missing> {
    need("tessellationShader", gpu.features().tessellation_shader)
}

fn of<'a>(patch_vertices: u32, control: &'a str, evaluation: &'a str) -> PipelineOptions<'a> {
    PipelineOptions {
        topology: Topology::PATCH_LIST,
        patch_vertices,
        between: vec![(Stage::TessellationControl, control), (Stage::TessellationEvaluation, evaluation)],
        ..PipelineOptions::default()
    }
}

/// The same with colours that are added, so that the order of a patch's points makes no difference.
fn adding(options: PipelineOptions<'_>) -> PipelineOptions<'_> {
    let one = vk::BlendFactor::ONE;
    PipelineOptions { blend: vec![blend(one, one, vk::BlendOp::ADD)], ..options }
}

/// Parallelograms, as patches of four vertices.
fn parallelograms(seed: u64, count: usize) -> Vec<Vertex> {
    let at_w_of_1 = |vertex: &Vertex| {
        let [x, y, z, w] = vertex.position;
        [x / w, y / w, z / w, 1.0]
    };
    let points = shapes::points(seed, 3 * count);
    let patch = |corners: &[Vertex]| {
        let [a, b, c] = [0, 1, 2].map(|corner: usize| at_w_of_1(&corners[corner]));
        let d = [0, 1, 2, 3].map(|axis: usize| b[axis] + c[axis] - a[axis]);
        let color = corners[0].color;
        [a, b, c, d].map(|position| Vertex { position, color })
    };
    points.chunks_exact(3).flat_map(patch).collect()
}

const SPACINGS: [&str; 3] = ["equal_spacing", "fractional_even_spacing", "fractional_odd_spacing"];

fn of_each_spacing(gpu: &Gpu, domain: &str, count: u32, vertices: &[Vertex]) -> Drawn {
    needed(gpu)?;
    let control = control(count, LEVELS);
    Ok(cases(
        SPACINGS,
        |it| (*it).to_owned(),
        |spacing| {
            let evaluation = evaluation(&format!("{domain}, {spacing}"));
            let options = of(count, &control, &evaluation);
            simple(gpu, &TargetOptions::default(), &options, vertices)
        },
    ))
}

pub fn tessellated_triangles(gpu: &Gpu) -> Drawn {
    of_each_spacing(gpu, "triangles", 3, &shapes::flat_soup(300, 12))
}

pub fn tessellated_quads(gpu: &Gpu) -> Drawn {
    of_each_spacing(gpu, "quads", 4, &parallelograms(301, 8))
}

pub fn isolines(gpu: &Gpu) -> Drawn {
    of_each_spacing(gpu, "isolines", 4, &parallelograms(302, 6))
}

/// The vertices of patches as points.
pub fn tessellated_points(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let kinds = [("triangles", 3), ("quads", 4), ("isolines", 4)];
    let name = |&(domain, _): &(&str, _)| domain.to_owned();
    Ok(cases(kinds, name, |&(domain, count)| {
        let control = control(count, WHOLE_LEVELS);
        let evaluation = evaluation(&format!("{domain}, equal_spacing, point_mode"));
        let options = adding(of(count, &control, &evaluation));
        let vertices = match count {
            3 => shapes::flat_soup(310, 10),
            _ => parallelograms(311, 8),
        };
        simple(gpu, &TargetOptions::default(), &options, &vertices)
    }))
}

/// Each order of vertices with each face culled.
pub fn windings_of_patches(gpu: &Gpu) -> Drawn {
    wound(gpu, vk::TessellationDomainOrigin::UPPER_LEFT)
}

/// The same with the other origin.
pub fn domain_origins(gpu: &Gpu) -> Drawn {
    wound(gpu, vk::TessellationDomainOrigin::LOWER_LEFT)
}

fn wound(gpu: &Gpu, domain_origin: vk::TessellationDomainOrigin) -> Drawn {
    needed(gpu)?;
    let orders = ["triangles, cw", "triangles, ccw", "quads, cw", "quads, ccw"];
    let modes = [vk::CullModeFlags::FRONT, vk::CullModeFlags::BACK];
    let all = orders.into_iter().flat_map(|order| modes.map(|mode| (order, mode)));
    let name = |&(order, mode): &(&str, _)| format!("{order} {mode:?}");
    Ok(cases(all, name, |&(order, mode)| {
        let count = if order.starts_with("triangles") { 3 } else { 4 };
        let control = control(count, LEVELS);
        let evaluation = evaluation(order);
        let options = PipelineOptions {
            domain_origin,
            raster: PipelineOptions::default().raster.cull_mode(mode),
            ..of(count, &control, &evaluation)
        };
        let vertices = match count {
            3 => shapes::flat_soup(320, 12),
            _ => parallelograms(321, 8),
        };
        simple(gpu, &TargetOptions::default(), &options, &vertices)
    }))
}

/// Bicubic patches of 16 vertices, which the evaluation shader visits in a loop. They become points.
pub fn curved_patches(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let control = control(
        16,
        "for (int i = 0; i < 4; i++) gl_TessLevelOuter[i] = 16.0;
         for (int i = 0; i < 2; i++) gl_TessLevelInner[i] = 16.0;",
    );
    let evaluation = "
        layout(quads, point_mode) in;
        layout(location = 0) in vec4 c_color[];
        layout(location = 0) out vec4 v_color;
        vec4 weights(float t) {
            float s = 1.0 - t;
            return vec4(s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t);
        }
        void main() {
            vec4 across = weights(gl_TessCoord.x), up = weights(gl_TessCoord.y);
            vec4 position = vec4(0.0), color = vec4(0.0);
            for (int i = 0; i < gl_PatchVerticesIn; i++) {
                float weight = across[i & 3] * up[i >> 2];
                position += weight * gl_in[i].gl_Position / gl_in[i].gl_Position.w;
                color += weight * c_color[i];
            }
            gl_Position = vec4(position.xy, 0.0, 1.0);
            gl_PointSize = 1.0;
            v_color = 0.2 * color;
        }";
    let options = adding(of(16, &control, evaluation));
    let vertices = shapes::points(330, 16 * 6);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

/// Control points of a pot: a lathed body with a lid, and a bent tube for its handle, in patches of 16.
fn pot() -> Vec<Vertex> {
    // Bezier curves of radius and height.
    let profile = [
        [[0.0, -0.6], [0.35, -0.6], [0.6, -0.5], [0.62, -0.2]],
        [[0.62, -0.2], [0.64, 0.1], [0.45, 0.3], [0.4, 0.36]],
        [[0.4, 0.36], [0.3, 0.5], [0.02, 0.4], [0.08, 0.62]],
    ];
    let handle = [[0.55, 0.2], [1.0, 0.4], [0.95, -0.4], [0.58, -0.3]];
    // A quarter of a circle, and half of one.
    let quarter = [[1.0, 0.0], [1.0, 0.5523], [0.5523, 1.0], [0.0, 1.0]];
    let half = [[1.0, 0.0], [1.0, 1.3333], [-1.0, 1.3333], [-1.0, 0.0]];
    let mut points = Vec::new();
    for curve in profile {
        for turn in 0..4 {
            for [radius, height] in curve {
                points.extend(quarter.map(|[x, z]| {
                    let [x, z] = [[x, z], [-z, x], [-x, -z], [z, -x]][turn];
                    [radius * x, height, radius * z]
                }));
            }
        }
    }
    for side in [1.0, -1.0] {
        for [x, y] in handle {
            points.extend(half.map(|[out, depth]| [x + 0.08 * out * side, y, 0.08 * depth * side]));
        }
    }
    // Seen from above and from the side.
    let (sin, cos) = libm::sincosf(0.45);
    let seen = |[x, y, z]: [f32; 3]| {
        let (x, z) = (0.9 * x + 0.435 * z, 0.9 * z - 0.435 * x);
        let (y, z) = (cos * y + sin * z, cos * z - sin * y);
        let w = 1.0 + 0.2 * z;
        [0.8 * x, -0.9 * y, (0.5 + 0.3 * z) * w, w]
    };
    let vertex = |point| Vertex { position: seen(point), color: [1.0; 4] };
    points.into_iter().map(vertex).collect()
}

/// A pot of bicubic patches, coloured by the direction of its surface. Triangles are so small that the pot looks the same
/// however patches are divided.
pub fn pot_of_patches(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let kinds = [("equal_spacing", "32.0"), ("fractional_even_spacing", "31.3")];
    let name = |&(spacing, _): &(&str, _)| spacing.to_owned();
    Ok(cases(kinds, name, |&(spacing, level)| {
        let levels = format!(
            "for (int i = 0; i < 4; i++) gl_TessLevelOuter[i] = {level};
             for (int i = 0; i < 2; i++) gl_TessLevelInner[i] = {level};"
        );
        let control = control(16, &levels);
        let evaluation = format!(
            "layout(quads, {spacing}) in;
             layout(location = 0) out vec4 v_color;
             vec4 weights(float t) {{
                 float s = 1.0 - t;
                 return vec4(s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t);
             }}
             vec4 slopes(float t) {{
                 float s = 1.0 - t;
                 return vec4(-s * s, s * s - 2.0 * t * s, 2.0 * t * s - t * t, t * t);
             }}
             vec4 surface(vec4 across, vec4 up) {{
                 vec4 sum = vec4(0.0);
                 for (int i = 0; i < 16; i++) sum += across[i & 3] * up[i >> 2] * gl_in[i].gl_Position;
                 return sum;
             }}
             void main() {{
                 // A little inside, where no edge is a point.
                 vec2 at = 0.02 + 0.96 * gl_TessCoord.xy;
                 vec3 normal = cross(
                     surface(slopes(at.x), weights(at.y)).xyz,
                     surface(weights(at.x), slopes(at.y)).xyz);
                 gl_Position = surface(weights(gl_TessCoord.x), weights(gl_TessCoord.y));
                 v_color = vec4(0.5 + 0.45 * normalize(normal), 1.0);
             }}"
        );
        let options = PipelineOptions {
            depth_stencil: gaurast_testkit::depth_test(vk::CompareOp::LESS),
            ..of(16, &control, &evaluation)
        };
        let target = TargetOptions::with_depth(vk::Format::D32_SFLOAT);
        let mut drawn = simple(gpu, &target, &options, &pot());
        // Depths are those of the triangles.
        drawn.pictures.retain(|picture| picture.name != "depth");
        drawn
    }))
}

/// Values of the whole patch, outputs that other invocations read after a barrier, and more output vertices than input
/// vertices.
pub fn values_of_patches(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let control = "
        layout(vertices = 5) out;
        layout(location = 0) in vec4 color[];
        layout(location = 0) out vec4 c_color[];
        layout(location = 1) patch out vec4 mean;
        layout(location = 2) patch out Whole { float list[3]; ivec2 number; } whole;
        void main() {
            int from = gl_InvocationID % gl_PatchVerticesIn;
            gl_out[gl_InvocationID].gl_Position = gl_in[from].gl_Position;
            c_color[gl_InvocationID] = color[from] * float(gl_InvocationID + 1) * 0.2;
            barrier();
            if (gl_InvocationID == 1) {
                mean = vec4(0.0);
                for (int i = 0; i < 5; i++) mean += 0.2 * c_color[i];
                whole.number = ivec2(gl_PrimitiveID, gl_PatchVerticesIn);
            }
            if (gl_InvocationID < 3) whole.list[gl_InvocationID] = c_color[4 - gl_InvocationID].g;
            barrier();
            gl_TessLevelOuter[gl_InvocationID & 3] = 2.0 + whole.list[gl_InvocationID % 3];
            gl_TessLevelInner[0] = 3.0;
        }";
    let evaluation = "
        layout(triangles) in;
        layout(location = 0) in vec4 c_color[];
        layout(location = 1) patch in vec4 mean;
        layout(location = 2) patch in Whole { float list[3]; ivec2 number; } whole;
        layout(location = 0) out vec4 v_color;
        void main() {
            gl_Position = gl_TessCoord.x * gl_in[0].gl_Position + gl_TessCoord.y * gl_in[1].gl_Position
                + gl_TessCoord.z * gl_in[2].gl_Position;
            float list = whole.list[0] + whole.list[1] * 0.5 + whole.list[2] * 0.25;
            v_color = vec4(mean.rg, 0.5 * list, 1.0)
                + vec4(0.0, 0.0, 0.05 * float(whole.number.x % 5 + whole.number.y + gl_PrimitiveID % 2), 0.0);
        }";
    let options = of(3, control, evaluation);
    let vertices = shapes::flat_soup(340, 12);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

/// Patches of which some have a level that discards them.
pub fn discarded_patches(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    let control = control(
        3,
        "float zero = float(gl_PatchVerticesIn - 3);
         for (int i = 0; i < 3; i++) gl_TessLevelOuter[i] = 3.0;
         gl_TessLevelInner[0] = patch_number == 4 ? zero : 2.0;
         if (patch_number % 3 == 1) gl_TessLevelOuter[patch_number % 2] = zero;
         if (patch_number % 7 == 2) gl_TessLevelOuter[2] = zero / zero;
         if (patch_number % 7 == 3) gl_TessLevelOuter[2] = -1.0;",
    );
    let evaluation = evaluation("triangles");
    let options = of(3, &control, &evaluation);
    let vertices = shapes::flat_soup(350, 20);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

/// A geometry shader that takes tessellated lines.
pub fn tessellation_and_geometry(gpu: &Gpu) -> Drawn {
    needed(gpu)?;
    need("geometryShader", gpu.features().geometry_shader)?;
    let control = control(4, LEVELS);
    let evaluation = evaluation("isolines");
    let geometry = "
        layout(lines) in;
        layout(triangle_strip, max_vertices = 4) out;
        layout(location = 0) in vec4 v_color[];
        layout(location = 0) out vec4 g_color;
        void main() {
            for (int corner = 0; corner < 4; corner++) {
                vec4 position = gl_in[corner & 1].gl_Position;
                gl_Position = position + vec4(0.0, 0.04 * float(corner >> 1), 0.0, 0.0) * position.w;
                g_color = v_color[corner & 1] * float(1 + gl_PrimitiveIDIn % 6) / 6.0;
                EmitVertex();
            }
        }";
    let mut options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 g_color;
             layout(location = 0) out vec4 color;
             void main() { color = g_color; }",
        ),
        ..of(4, &control, &evaluation)
    };
    options.between.push((Stage::Geometry, geometry));
    let vertices = parallelograms(360, 6);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}
