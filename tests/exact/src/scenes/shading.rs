//! Scenes of shader features: interpolation, derivatives, control flow, specialization.

use ash::vk;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::simple;
use gaurast_testkit::shapes;
use gaurast_testkit::{Gpu, Output, PipelineOptions, TargetOptions};

fn fragment(gpu: &Gpu, seed: u64, source: &str) -> Output {
    let options = PipelineOptions { fragment: Some(source), ..PipelineOptions::default() };
    let vertices = shapes::soup(seed, 30);
    simple(gpu, &TargetOptions::default(), &options, &vertices)
}

/// Passes on a colour with an interpolation qualifier.
fn qualified(gpu: &Gpu, seed: u64, qualifier: &str) -> Drawn {
    let vertex = format!(
        "layout(location = 0) in vec4 position;
         layout(location = 1) in vec4 color;
         layout(location = 0) {qualifier} out vec4 v_color;
         void main() {{ gl_Position = position; v_color = color; }}"
    );
    let fragment = format!(
        "layout(location = 0) {qualifier} in vec4 v_color;
         layout(location = 0) out vec4 color;
         void main() {{ color = v_color; }}"
    );
    let options = PipelineOptions { vertex: &vertex, fragment: Some(&fragment), ..PipelineOptions::default() };
    let target = TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT);
    Ok(simple(gpu, &target, &options, &shapes::soup(seed, 30)))
}

pub fn smooth_with_perspective(gpu: &Gpu) -> Drawn {
    qualified(gpu, 90, "smooth")
}

pub fn flat_values(gpu: &Gpu) -> Drawn {
    qualified(gpu, 91, "flat")
}

pub fn noperspective(gpu: &Gpu) -> Drawn {
    qualified(gpu, 92, "noperspective")
}

/// Passes many values of all types between the stages.
pub fn many_varyings(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        vertex: "
            layout(location = 0) in vec4 position;
            layout(location = 1) in vec4 color;
            layout(location = 0) out mat3 m;
            layout(location = 3) out float array[4];
            layout(location = 7) flat out ivec2 number;
            layout(location = 8) out Block { vec2 a; vec3 b; } block;
            layout(location = 10, component = 0) out vec2 low;
            layout(location = 10, component = 2) out vec2 high;
            void main() {
                gl_Position = position;
                m = mat3(color.rgb, color.gbr, color.brg);
                for (int i = 0; i < 4; ++i) array[i] = color[i];
                number = ivec2(gl_VertexIndex, -gl_VertexIndex);
                block.a = color.ar;
                block.b = color.bga;
                low = color.rg;
                high = color.ba;
            }",
        fragment: Some(
            "layout(location = 0) in mat3 m;
             layout(location = 3) in float array[4];
             layout(location = 7) flat in ivec2 number;
             layout(location = 8) in Block { vec2 a; vec3 b; } block;
             layout(location = 10, component = 0) in vec2 low;
             layout(location = 10, component = 2) in vec2 high;
             layout(location = 0) out vec4 color;
             void main() {
                 vec3 v = m * vec3(0.5, 0.25, 0.125);
                 float sum = array[0] + 2.0 * array[1] - array[2] + array[3];
                 color = vec4(v, sum) + vec4(number, block.a) * 0.01
                       + vec4(block.b, 0.0) * 0.1 + vec4(low, high) * 0.2;
             }",
        ),
        ..PipelineOptions::default()
    };
    let target = TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT);
    Ok(simple(gpu, &target, &options, &shapes::soup(93, 30)))
}

/// Computes derivatives of values that are linear on the screen, so that coarse and fine ones agree.
pub fn derivatives(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() {
                 color = 32.0 * vec4(dFdx(v_color.r), dFdy(v_color.r), fwidth(v_color.g), 0.0)
                       + 0.5;
             }",
        ),
        ..PipelineOptions::default()
    };
    // Without perspective the values are linear.
    let vertices = shapes::flat_soup(94, 20);
    let target = TargetOptions::default();
    Ok(simple(gpu, &target, &options, &vertices))
}

/// Runs loops whose length varies from pixel to pixel.
pub fn divergent_loops(gpu: &Gpu) -> Drawn {
    Ok(fragment(
        gpu,
        95,
        "layout(location = 0) in vec4 v_color;
         layout(location = 0) out vec4 color;
         void main() {
             ivec2 p = ivec2(gl_FragCoord.xy);
             int x = p.x * 7 + p.y * 13;
             int steps = 0;
             while (x != 1 && steps < 90) {
                 if (x % 2 == 0) { x /= 2; } else { x = 3 * x + 1; if (x > 5000) break; }
                 if (x == 0) break;
                 ++steps;
             }
             color = vec4(float(steps) / 90.0, v_color.gb, 1.0);
         }",
    ))
}

pub fn functions_and_switches(gpu: &Gpu) -> Drawn {
    Ok(fragment(
        gpu,
        96,
        "layout(location = 0) in vec4 v_color;
         layout(location = 0) out vec4 color;
         vec3 pick(int i, vec3 c) {
             switch (i) {
                 case 0: return c;
                 case 1: return c.gbr;
                 case 2: c = c * c; // Falls through.
                 case 3: return sqrt(c);
                 default: return vec3(dot(c, vec3(0.3)));
             }
         }
         void main() {
             int cell = (int(gl_FragCoord.x) / 5 + int(gl_FragCoord.y) / 7) % 6;
             color = vec4(pick(cell, v_color.rgb), 1.0);
         }",
    ))
}

pub fn built_in_functions(gpu: &Gpu) -> Drawn {
    Ok(fragment(
        gpu,
        97,
        "layout(location = 0) in vec4 v_color;
         layout(location = 0) out vec4 color;
         void main() {
             vec3 n = normalize(v_color.rgb - 0.4);
             vec3 r = reflect(n, vec3(0.6, 0.0, 0.8));
             float s = smoothstep(0.2, 0.8, v_color.r) + mix(0.1, 0.3, v_color.g);
             color = vec4(0.5 + 0.5 * sin(6.0 * v_color.b), pow(v_color.r, 2.2),
                          exp2(-3.0 * v_color.g), clamp(s, 0.0, 1.0));
             color.rgb += 0.1 * max(r, vec3(0.0)) * inversesqrt(1.0 + v_color.a);
         }",
    ))
}

/// Sets specialization constants of both stages.
pub fn specialization_constants(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        vertex: "
            layout(constant_id = 0) const float SCALE = 1.0;
            layout(location = 0) in vec4 position;
            layout(location = 1) in vec4 color;
            layout(location = 0) out vec4 v_color;
            void main() { gl_Position = vec4(SCALE * position.xy, position.zw); v_color = color; }",
        fragment: Some(
            "layout(constant_id = 1) const int MODE = 0;
             layout(constant_id = 2) const bool SWAP = false;
             layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() {
                 color = MODE == 3 ? v_color.gbra : v_color;
                 if (SWAP) color = color.bgra;
             }",
        ),
        specialization: vec![(0, 0.5f32.to_bits()), (1, 3), (2, 1)],
        ..PipelineOptions::default()
    };
    let vertices = shapes::soup(98, 30);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

/// Computes values in the vertex shader.
pub fn vertex_arithmetic(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        vertex: "
            layout(location = 0) in vec4 position;
            layout(location = 1) in vec4 color;
            layout(location = 0) out vec4 v_color;
            vec2 table[3] = vec2[](vec2(0.25, 0.0), vec2(-0.25, 0.125), vec2(0.0, -0.25));
            void main() {
                gl_Position = position;
                gl_Position.xy += 0.5 * table[gl_VertexIndex % 3] * position.w;
                v_color = vec4(0.0);
                for (int i = 0; i < 4; ++i) v_color[i] = fract(color[i] * float(i + 2));
            }",
        ..PipelineOptions::default()
    };
    let vertices = shapes::soup(99, 30);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}
