//! The sample mask that fragments read: before early tests, or after them (`VK_EXT_post_depth_coverage`).

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{
    Buffer, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex, depth_test, fetch_sample,
};

const SIZE: [u32; 2] = [50, 40];

/// The mask that each fragment of a far triangle over everything reads, for each sample that passes; 0 for the others, which a near
/// triangle hides.
fn masks(layout: &str) -> Vec<Vec<u32>> {
    let gpu = own();
    let options = TargetOptions { size: SIZE, resolve: false, ..TargetOptions::of(vk::Format::R32_SFLOAT) };
    let depth = Some(vk::Format::D32_SFLOAT);
    let target = Target::new(gpu, &TargetOptions { depth, samples: 4, ..options });
    let fragment = format!(
        "#extension GL_ARB_post_depth_coverage : enable
         {layout}
         layout(location = 0) in vec4 v_color;
         layout(location = 0) out vec4 color;
         void main() {{ color = v_color * float(gl_SampleMaskIn[0]); }}"
    );
    let options = PipelineOptions {
        fragment: Some(&fragment),
        depth_stencil: depth_test(vk::CompareOp::LESS),
        ..PipelineOptions::default()
    };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let near =
        [[-0.9, -0.8], [0.8, -0.5], [-0.3, 0.9]].map(|[x, y]| Vertex { position: [x, y, 0.25, 1.0], color: [0.0; 4] });
    let far =
        [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| Vertex { position: [x, y, 0.5, 1.0], color: [1.0; 4] });
    let vertices = Buffer::of(gpu, &[near, far].concat());
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..6);
        });
    });
    let sample = |sample| fetch_sample(gpu, &target.colors[0], sample).texels::<f32>();
    (0..4).map(|index| sample(index).into_iter().map(|mask| mask as u32).collect()).collect()
}

/// Checks that all fragments read what `expected` gives for the samples that pass.
fn check(layout: &str, expected: impl Fn(u32) -> u32) {
    let masks = masks(layout);
    let mut partly = 0;
    for pixel in 0..(SIZE[0] * SIZE[1]) as usize {
        let passed = (0..4).filter(|&sample| masks[sample][pixel] != 0).fold(0, |all, sample| all | 1 << sample);
        for (sample, masks) in masks.iter().enumerate() {
            let read = if passed >> sample & 1 == 1 { expected(passed) } else { 0 };
            assert_eq!(masks[pixel], read, "{layout}: sample {sample} of pixel {pixel}, of which {passed:#b} pass");
        }
        partly += usize::from(passed != 0 && passed != 15);
    }
    assert!(partly > 20, "{partly}");
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn the_mask_is_that_after_the_tests() {
    check("layout(early_fragment_tests, post_depth_coverage) in;", |passed| passed);
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn the_mask_is_that_before_the_tests() {
    for layout in ["", "layout(early_fragment_tests) in;"] {
        check(layout, |_| 15);
    }
}
