//! Colour attachments of three 32-bit components. What is drawn to them are the first three components of what the same
//! draws leave in four.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::pipeline::{blend, opaque};
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Buffer, Pass, Pipeline, PipelineOptions, Target, TargetOptions, shapes};
use vk::{BlendFactor as Factor, BlendOp as Op};

const THREE: [vk::Format; 3] = [vk::Format::R32G32B32_SFLOAT, vk::Format::R32G32B32_UINT, vk::Format::R32G32B32_SINT];
const FOUR: [vk::Format; 3] =
    [vk::Format::R32G32B32A32_SFLOAT, vk::Format::R32G32B32A32_UINT, vk::Format::R32G32B32A32_SINT];

/// A fragment shader that writes numbers of all 32 bits.
fn fragment(prefix: &str) -> String {
    let value = match prefix {
        "" => "v_color",
        "u" => "uvec4(v_color * 4294967040.0)",
        _ => "ivec4(v_color * 4294967040.0 - 2147483648.0)",
    };
    format!(
        "layout(location = 0) in vec4 v_color;
         layout(location = 0) out {prefix}vec4 color;
         void main() {{ color = {value}; }}"
    )
}

/// The pictures of two passes, of which the second loads a part of what the first leaves: the first three words of each
/// texel.
fn drawn(format: vk::Format, samples: u32, options: &PipelineOptions<'_>) -> Vec<(String, Vec<[u32; 3]>)> {
    let gpu = own();
    let target = Target::new(gpu, &TargetOptions { samples, size: [75, 50], ..TargetOptions::of(format) });
    let pipeline = Pipeline::new(gpu, &target, options);
    let vertices = Buffer::of(gpu, &shapes::soup(7, 60));
    gpu.run(|commands| {
        for pass in [
            Pass::default(),
            Pass {
                area: Some(vk::Rect2D {
                    offset: vk::Offset2D { x: 9, y: 3 },
                    extent: vk::Extent2D { width: 41, height: 30 },
                }),
                ..Pass::load()
            },
        ] {
            commands.pass(&target, &pass, || {
                commands.bind(&pipeline);
                commands.vertices(&vertices);
                commands.draw(0..180);
            });
        }
    });
    let output = target.output(gpu);
    let words = |bytes: &[u8]| -> Vec<u32> { bytemuck::pod_collect_to_vec(bytes) };
    let count = if THREE.contains(&format) { 3 } else { 4 };
    (output.pictures.into_iter())
        .map(|picture| {
            let texels =
                words(&picture.bytes).chunks_exact(count).map(|texel| [texel[0], texel[1], texel[2]]).collect();
            (picture.name, texels)
        })
        .collect()
}

/// Compares what is drawn to three components with what is drawn to four.
fn compare(number: usize, samples: u32, options: &PipelineOptions<'_>) {
    let found = drawn(THREE[number], samples, options);
    let expected = drawn(FOUR[number], samples, options);
    assert_eq!(found.len(), expected.len());
    for ((name, found), (_, expected)) in found.iter().zip(&expected) {
        assert!(found.iter().any(|texel| texel != &found[0]), "{name} is of one colour");
        assert!(found == expected, "{name} of {:?} with {samples} samples", THREE[number]);
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn floats_are_replaced_masked_and_blended() {
    let fragment = fragment("");
    let options = PipelineOptions { fragment: Some(&fragment), ..PipelineOptions::default() };
    let masked = opaque().color_write_mask(vk::ColorComponentFlags::R | vk::ColorComponentFlags::B);
    // The fourth component is one throughout, as it is where there are three.
    let with_alpha = blend(Factor::DST_ALPHA, Factor::ONE_MINUS_SRC_COLOR, Op::ADD)
        .src_alpha_blend_factor(Factor::ZERO)
        .dst_alpha_blend_factor(Factor::ONE);
    for state in [
        opaque(),
        masked,
        blend(Factor::ONE, Factor::ONE_MINUS_SRC_ALPHA, Op::ADD),
        blend(Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA, Op::ADD),
        blend(Factor::CONSTANT_COLOR, Factor::ONE, Op::REVERSE_SUBTRACT),
        blend(Factor::ONE, Factor::ONE, Op::MAX),
        with_alpha,
    ] {
        for samples in [1, 4] {
            let options =
                PipelineOptions { blend: vec![state], blend_constants: [0.5, 0.25, 2.0, 1.0], ..options.clone() };
            compare(0, samples, &options);
        }
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn integers_are_replaced_masked_and_combined() {
    for (number, prefix) in [(1, "u"), (2, "i")] {
        let fragment = fragment(prefix);
        let options = PipelineOptions { fragment: Some(&fragment), ..PipelineOptions::default() };
        for samples in [1, 4] {
            compare(number, samples, &options);
            let green = opaque().color_write_mask(vk::ColorComponentFlags::G);
            compare(number, samples, &PipelineOptions { blend: vec![green], ..options.clone() });
            compare(number, samples, &PipelineOptions { logic_op: Some(vk::LogicOp::XOR), ..options.clone() });
        }
    }
}

#[gaurast_runner::test]
fn the_features_are_those_of_four_components_but_stores() {
    let gpu = own();
    let stores = vk::FormatFeatureFlags::STORAGE_IMAGE;
    for (three, four) in THREE.into_iter().zip(FOUR) {
        assert_eq!(gpu.format_features(three), gpu.format_features(four) & !stores, "{three:?}");
    }
}
