//! Values of 64 bits that one stage gives to the next. Each test runs on this driver and on lavapipe.

use ash::vk;
use gaurast_runner::Case;
use gaurast_testkit::PipelineOptions;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::Stage;
use gaurast_testkit::stage_program::{Program, drivers, need, options, with_geometry};

/// The values of a vertex: a scalar, a vector of two locations, and a matrix in an array.
const VALUES: &str = "
    layout(location = 0) flat PUT double ninth BRACKETS;
    layout(location = 1) flat PUT dvec3 wide BRACKETS;
    layout(location = 3) flat PUT dmat2 columns[2] BRACKETS;
    layout(location = 7) flat PUT i64vec2 numbers BRACKETS;";

/// The declaration of the values as inputs or outputs, with a suffix of the names; per vertex if they are in brackets.
fn values(put: &str, suffix: &str, brackets: &str) -> String {
    let names = ["ninth", "wide", "columns", "numbers"];
    let mut text = VALUES.replace("PUT", put);
    for name in names {
        text = text.replace(&format!(" {name}"), &format!(" {name}{suffix}"));
    }
    // An array of arrays names the vertex first.
    text = text.replace("[2] BRACKETS", &format!("{brackets}[2]"));
    text.replace("BRACKETS", brackets)
}

const EXTENSION: &str = "#extension GL_ARB_gpu_shader_int64 : require\n";

/// Copies of all values, from one name to another.
fn copies(to: &str, from: &str) -> String {
    let names = ["ninth", "wide", "columns", "numbers"];
    let copy = |name: &&str| {
        let (to, from) = (to.replace('#', name), from.replace('#', name));
        format!("{to} = {from};")
    };
    names.iter().map(copy).collect()
}

fn vertex() -> String {
    format!(
        "{EXTENSION}
         {}
         void main() {{
             gl_Position = vec4(4.0 * (gl_VertexIndex & 1) - 1.0, 4.0 * (gl_VertexIndex >> 1) - 1.0, 0.0, 1.0);
             double third = double(gl_InstanceIndex + 1) / 3.0lf;
             ninth = third / 3.0lf;
             wide = dvec3(third, -third, third * third);
             columns[0] = dmat2(third, 0.25lf, 1e300lf, -third);
             columns[1] = dmat2(1.0lf);
             numbers = i64vec2(0x123456789ABCDEFl, -5l);
         }}",
        values("out", "", "")
    )
}

/// Writes one where each value is right.
fn fragment() -> String {
    format!(
        "{EXTENSION}
         {}
         layout(location = 0) out vec4 color;
         void main() {{
             double third = 1.0lf / 3.0lf;
             bool right = ninth == third / 3.0lf && wide == dvec3(third, -third, third * third)
                 && columns[0] == dmat2(third, 0.25lf, 1e300lf, -third) && columns[1] == dmat2(1.0lf)
                 && numbers == i64vec2(0x123456789ABCDEFl, -5l);
             color = vec4(right);
         }}",
        values("in", "", "")
    )
}

/// A geometry shader that passes triangles on.
fn geometry() -> String {
    format!(
        "{EXTENSION}
         layout(triangles) in;
         layout(triangle_strip, max_vertices = 3) out;
         {} {}
         void main() {{
             for (int i = 0; i < 3; i++) {{
                 gl_Position = gl_in[i].gl_Position;
                 {}
                 EmitVertex();
             }}
         }}",
        values("in", "_in", "[]"),
        values("out", "", ""),
        copies("#", "#_in[i]")
    )
}

fn control() -> String {
    format!(
        "{EXTENSION}
         layout(vertices = 3) out;
         {} {}
         void main() {{
             gl_TessLevelOuter = float[](1.0, 1.0, 1.0, 1.0);
             gl_TessLevelInner = float[](1.0, 1.0);
             gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
             {}
         }}",
        values("in", "_in", "[]"),
        values("out", "_out", "[]"),
        copies("#_out[gl_InvocationID]", "#_in[gl_InvocationID]")
    )
}

fn evaluation() -> String {
    format!(
        "{EXTENSION}
         layout(triangles) in;
         {} {}
         void main() {{
             gl_Position = gl_TessCoord.x * gl_in[0].gl_Position + gl_TessCoord.y * gl_in[1].gl_Position
                 + gl_TessCoord.z * gl_in[2].gl_Position;
             {}
         }}",
        values("in", "_in", "[]"),
        values("out", "", ""),
        copies("#", "#_in[2]")
    )
}

#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn values_of_64_bits_pass_between_stages(case: &Case) {
    let gpu = with_geometry(case);
    need("shaderFloat64", gpu.features().shader_float64);
    need("shaderInt64", gpu.features().shader_int64);
    need("tessellationShader", gpu.features().tessellation_shader);
    let (vertex, fragment) = (vertex(), fragment());
    let (geometry, control, evaluation) = (geometry(), control(), evaluation());
    let tessellation = [(Stage::TessellationControl, &*control), (Stage::TessellationEvaluation, &*evaluation)];
    let geometry = [(Stage::Geometry, &*geometry)];
    for (between, patch_vertices) in [
        (vec![], 0),
        (geometry.to_vec(), 0),
        (tessellation.to_vec(), 3),
        ([&tessellation[..], &geometry[..]].concat(), 3),
    ] {
        let stages = between.len();
        let pipeline = PipelineOptions {
            vertex: &vertex,
            between,
            fragment: Some(&fragment),
            topology: match patch_vertices {
                0 => vk::PrimitiveTopology::TRIANGLE_LIST,
                _ => vk::PrimitiveTopology::PATCH_LIST,
            },
            patch_vertices,
            ..options()
        };
        let drawn = Program::new(pipeline, 1).draw(gpu, |commands| commands.draw(0..3));
        // The triangle covers what is left of and above its diagonal.
        for (x, y) in [(0, 0), (100, 5), (5, 100), (63, 63)] {
            assert_eq!(drawn.texel(x, y), [1.0; 4], "{stages} further stages, {x}, {y}");
        }
    }
}
