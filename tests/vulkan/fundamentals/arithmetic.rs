//! Pictures are a function of commands and data alone: not of the SIMD level, the number of threads, the modes of the
//! application's threads, or the place where a constant is folded. `gaurast-bench exact` has the words of each operation.

use ash::vk;
use gaurast_testkit::for_levels::levels;
use gaurast_testkit::shader::{GLSLANG, Stage, compile};
use gaurast_testkit::{
    Bindings, Buffer, Gpu, Kernel, Pass, Pipeline, PipelineOptions, Resource, Settings, Target, TargetOptions, Vertex,
    blend,
};
use std::sync::LazyLock;

/// The corners of the triangles. They are computed once, so that a thread with other modes draws the same ones.
static VERTICES: LazyLock<Vec<Vertex>> = LazyLock::new(|| {
    let corner = |x: f32, y: f32, w: f32, color: [f32; 4]| Vertex { position: [x * w, y * w, 0.3 * w, w], color };
    (0..24)
        .flat_map(|number| {
            let (t, w) = (number as f32 / 24.0, 1.0 + 0.37 * (number % 5) as f32);
            let at = [1.7 * t - 0.9, 0.9 - 1.6 * t];
            [
                corner(at[0], at[1], w, [t, 0.1, 0.9 - t, 1.0]),
                corner(0.93 - at[0], at[1] + 0.31, 1.0, [0.7, t, 0.2, 0.4]),
                corner(at[1], -0.87, 2.0 * w, [0.1, 0.8, t, 0.0]),
            ]
        })
        .collect()
});

/// Blended triangles in perspective, whose colours are functions of interpolated values, and whose target holds
/// floats; and in a target of bytes.
fn pictures(gpu: &Gpu) -> Vec<u32> {
    const SHADER: &str = "
        layout(location = 0) in vec4 v_color;
        layout(location = 0) out vec4 color;
        void main() {
            float wave = 0.5 + 0.5 * sin(40.0 * v_color.x);
            color = vec4(exp2(-v_color.y), wave, pow(v_color.z, 2.2), 0.3 + 0.4 * v_color.w);
        }";
    let vertices = Buffer::of(gpu, &VERTICES);
    let over = blend(vk::BlendFactor::SRC_ALPHA, vk::BlendFactor::ONE_MINUS_SRC_ALPHA, vk::BlendOp::ADD);
    let mut found = Vec::new();
    for format in [vk::Format::R32G32B32A32_SFLOAT, vk::Format::R8G8B8A8_UNORM, vk::Format::R8G8B8A8_SRGB] {
        let options = TargetOptions { size: [97, 83], ..TargetOptions::of(format) };
        let target = Target::new(gpu, &options);
        let pipeline = Pipeline::new(
            gpu,
            &target,
            &PipelineOptions { fragment: Some(SHADER), blend: vec![over], ..PipelineOptions::default() },
        );
        target.draw(gpu, &Pass::clear([0.2, 1e-39, 0.7, 1.0]), |commands| {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..72);
        });
        found.extend(target.read::<u32>());
    }
    found
}

fn gpu(simd: &str, threads: usize) -> Gpu {
    let settings = Settings { simd: Some(simd), threads: Some(threads), ..Settings::default() };
    Gpu::embedded(&settings).expect("a device")
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn levels_and_threads_change_no_bit() {
    let least = gpu("sse2", 1);
    let expected = pictures(&least);
    for level in levels() {
        for threads in [1, 2, 7] {
            assert!(pictures(&gpu(level, threads)) == expected, "{level}, {threads} threads");
        }
    }
}

/// The modes of the threads that create devices and pipelines and that record and submit.
#[cfg(target_arch = "x86_64")]
#[gaurast_runner::test(needs = [GLSLANG])]
fn the_modes_of_the_applications_threads_change_no_bit() {
    use gaurast_testkit::control::{Control, FLUSH, ROUNDING};
    for level in levels() {
        let expected = {
            let gpu = gpu(level, 2);
            (pictures(&gpu), folded(&gpu))
        };
        for mode in ROUNDING {
            let _control = Control::with(mode | FLUSH);
            let gpu = gpu(level, 2);
            assert!((pictures(&gpu), folded(&gpu)) == expected, "{level}, {mode:#x}");
        }
    }
}

/// The constants of the folding test.
const CONSTANTS: [f32; 4] = [0.7, -3.9e-20, 1.9e19, 5.960_464e-8];

/// Results of operations on constants, which are folded when the pipeline is created, and of the same operations on
/// values of a buffer.
fn folded(gpu: &Gpu) -> [Vec<u32>; 2] {
    let operations = "
        put(0, a * b + c); put(1, c - a * b); put(2, exp(a)); put(3, log2(c)); put(4, sin(a)); put(5, pow(a, d));
        put(6, sqrt(c)); put(7, b / c); put(8, floor(a + 0.4)); put(9, b * d); put(10, fma(a, a, b));
        put(11, tanh(a)); put(12, atan(a, c)); put(13, mod(c, a)); put(14, 1.0 / d); put(15, inversesqrt(a));
        put(16, float(float16_t(d))); put(17, float(float16_t(double(a) + 1e-9LF)));
        found[18] = uint(c); found[19] = uint(int(b * c));";
    [true, false].map(|constant| {
        let declarations: String = ["a", "b", "c", "d"]
            .iter()
            .enumerate()
            .map(|(id, name)| {
                if constant {
                    format!("layout(constant_id = {id}) const float {name} = 0.0;\n")
                } else {
                    format!("float {name} = given[{id}];\n")
                }
            })
            .collect();
        let (global, local) = if constant { (declarations, String::new()) } else { (String::new(), declarations) };
        let source = format!(
            "#extension GL_EXT_shader_explicit_arithmetic_types : require
            layout(local_size_x = 1) in;
            layout(binding = 0) buffer Found {{ uint found[]; }};
            layout(binding = 1) buffer Given {{ float given[]; }};
            void put(uint at, float value) {{ found[at] = floatBitsToUint(value); }}
            {global}
            void main() {{ {local} {operations} }}"
        );
        let found = Buffer::new(gpu, 4 * 20);
        let given = Buffer::of(gpu, &CONSTANTS);
        let bindings = Bindings::new(gpu, &[Resource::Storage(found.raw), Resource::Storage(given.raw)]);
        let constants: Vec<(u32, u32)> = (0..).zip(CONSTANTS.map(f32::to_bits)).collect();
        let words = compile(Stage::Compute, &source);
        let kernel = Kernel::specialized(gpu, &words, &[bindings.layout], &constants).expect("a pipeline");
        kernel.run(&[bindings.set], &[], [1, 1, 1]);
        found.values()
    })
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn constants_are_folded_to_the_bits_of_running() {
    let [expected, _] = folded(&gpu("sse2", 1));
    for level in levels() {
        let [folded, run] = folded(&gpu(level, 1));
        assert_eq!(folded, run, "{level}");
        assert_eq!(folded, expected, "{level}");
    }
}
