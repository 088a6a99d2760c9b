//! Vertex attributes of 64-bit components, of which a location has two, and of a shared exponent.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::{GLSLANG, Stage};
use gaurast_testkit::{Buffer, Graphics, Pass, Shader, Target, attribute, binding, shader};

/// A fragment shader that writes a flat value.
const FRAGMENT: &str = "
    layout(location = 0) flat in float right;
    layout(location = 0) out vec4 color;
    void main() { color = vec4(right); }";

/// Draws a pixel for each element, by points of a vertex shader that gives one where attributes are right.
fn draw(vertex: &str, attributes: &[vk::VertexInputAttributeDescription], stride: u32, bytes: &[u8]) -> Vec<[f32; 4]> {
    let gpu = own();
    let target = Target::floats(gpu, [8, 1]);
    let made = Graphics {
        shaders: vec![
            Shader::vertex(shader::compile(Stage::Vertex, vertex)),
            Shader::fragment(shader::compile(Stage::Fragment, FRAGMENT)),
        ],
        bindings: vec![binding(0, stride)],
        attributes: attributes.to_vec(),
        topology: vk::PrimitiveTopology::POINT_LIST,
        ..Graphics::default()
    };
    let pipeline = made.create(gpu).expect("a pipeline");
    let vertices = Buffer::of(gpu, bytes);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..8);
        });
    });
    target.read()
}

const PLACE: &str = "
    gl_Position = vec4((float(gl_VertexIndex) + 0.5) / 4.0 - 1.0, 0.0, 0.0, 1.0);
    gl_PointSize = 1.0;";

/// One, two, three and four components of each kind, the largest of which take two locations.
#[gaurast_runner::test(needs = [GLSLANG])]
fn components_of_64_bits_are_read() {
    use vk::Format as F;
    let gpu = own();
    let kinds = [
        (
            "double",
            "dvec",
            "packDouble2x32(uvec2",
            [F::R64_SFLOAT, F::R64G64_SFLOAT, F::R64G64B64_SFLOAT, F::R64G64B64A64_SFLOAT],
        ),
        (
            "uint64_t",
            "u64vec",
            "packUint2x32(uvec2",
            [F::R64_UINT, F::R64G64_UINT, F::R64G64B64_UINT, F::R64G64B64A64_UINT],
        ),
        (
            "int64_t",
            "i64vec",
            "packInt2x32(ivec2",
            [F::R64_SINT, F::R64G64_SINT, F::R64G64B64_SINT, F::R64G64B64A64_SINT],
        ),
    ];
    for (scalar, vector, pack, formats) in kinds {
        for (count, format) in (1u32..).zip(formats) {
            let features = gpu.format_properties(format).buffer_features;
            assert!(features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER), "{format:?}");
            let ty = if count == 1 { scalar.to_owned() } else { format!("{vector}{count}") };
            // Component `c` of vertex `v` has words that differ from all others.
            let wrong: String = (0..count)
                .map(|component| {
                    let found = if count == 1 { "wide".to_owned() } else { format!("wide[{component}]") };
                    let value = format!("{pack}(7 + {component} + 4 * gl_VertexIndex, 0x40123456 + {component}))");
                    format!("if ({found} != {value}) right = 0.0;\n")
                })
                .collect();
            let next = if count > 2 { 2 } else { 1 };
            let vertex = format!(
                "#extension GL_ARB_gpu_shader_int64 : require
                 layout(location = 3) in {ty} wide;
                 layout(location = {}) in float after;
                 layout(location = 0) flat out float right;
                 void main() {{
                     right = 1.0 + after;
                     {wrong}
                     {PLACE}
                 }}",
                3 + next
            );
            let mut bytes = Vec::new();
            for index in 0..8u32 {
                for component in 0..count {
                    bytes.extend((7 + component + 4 * index).to_le_bytes());
                    bytes.extend((0x4012_3456 + component).to_le_bytes());
                }
                bytes.extend((index as f32).to_le_bytes());
            }
            let stride = 8 * count + 4;
            let attributes = [attribute(3, format, 0), attribute(3 + next, F::R32_SFLOAT, 8 * count)];
            let found = draw(&vertex, &attributes, stride, &bytes);
            for (index, [right, ..]) in found.into_iter().enumerate() {
                assert_eq!(right, 1.0 + index as f32, "{format:?}, vertex {index}");
            }
        }
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn a_shared_exponent_is_read() {
    let format = vk::Format::E5B9G9R9_UFLOAT_PACK32;
    assert!(own().format_properties(format).buffer_features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER));
    let vertex = format!(
        "layout(location = 1) in vec4 shared_color;
         layout(location = 0) flat out float right;
         void main() {{
             float unit = exp2(float(gl_VertexIndex) - 9.0);
             vec4 wanted = vec4(vec3(3.0, 300.0, 511.0 - gl_VertexIndex) * unit, 1.0);
             right = shared_color == wanted ? 1.0 : 0.0;
             {PLACE}
         }}"
    );
    let element = |index: u32| 3 | 300 << 9 | (511 - index) << 18 | (index + 15) << 27;
    let bytes: Vec<u8> = (0..8).flat_map(|index| element(index).to_le_bytes()).collect();
    let found = draw(&vertex, &[attribute(1, format, 0)], 4, &bytes);
    assert!(found.iter().all(|[right, ..]| *right == 1.0), "{found:?}");
}
