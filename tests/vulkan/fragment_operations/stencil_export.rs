//! `VK_EXT_shader_stencil_export`: references of the stencil test that programs write.

use ash::vk;
use gaurast_runner::{Case, Need, Variant};
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{
    Buffer, Driver, Gpu, Opening, Output, Pass, Pipeline, PipelineOptions, Target, TargetOptions, shapes,
};

const FORMAT: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;

/// A test that a reference passes by `compare`, and the operations.
fn face(compare: vk::CompareOp, masks: [u32; 2], [fail, pass]: [vk::StencilOp; 2]) -> vk::StencilOpState {
    vk::StencilOpState {
        fail_op: fail,
        pass_op: pass,
        depth_fail_op: vk::StencilOp::KEEP,
        compare_op: compare,
        compare_mask: masks[0],
        write_mask: masks[1],
        reference: 0x55,
    }
}

/// A device with the extension.
fn device(driver: Driver) -> Gpu {
    let extensions = &[ash::ext::shader_stencil_export::NAME];
    Gpu::open(&Opening { extensions, ..Opening::of(driver) }).expect("a device")
}

/// A fragment shader that writes a reference for each pixel, and discards some.
fn fragment(reference: &str, modes: &str) -> String {
    format!(
        "#extension GL_ARB_shader_stencil_export : require
         {modes}
         layout(location = 0) out vec4 color;
         void main() {{
             ivec2 at = ivec2(gl_FragCoord.xy);
             if (at.x % 7 == 3) discard;
             gl_FragStencilRefARB = {reference};
             color = vec4(at, 128, 255) / 255.0;
         }}"
    )
}

/// A draw of all pixels: its shader, the tests of both faces, and the order of front faces.
struct Draw {
    fragment: String,
    front: vk::StencilOpState,
    back: vk::StencilOpState,
    front_face: vk::FrontFace,
}

fn picture(gpu: &Gpu, samples: u32, draws: &[Draw]) -> Output {
    let target = Target::new(gpu, &TargetOptions { samples, size: [48, 32], ..TargetOptions::with_depth(FORMAT) });
    let pipeline = |draw: &Draw| {
        let options = PipelineOptions {
            fragment: Some(&draw.fragment),
            raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0).front_face(draw.front_face),
            depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
                .stencil_test_enable(true)
                .front(draw.front)
                .back(draw.back),
            ..PipelineOptions::default()
        };
        Pipeline::new(gpu, &target, &options)
    };
    let pipelines: Vec<_> = draws.iter().map(pipeline).collect();
    let vertices = shapes::whole(0.5, [1.0; 4]);
    let (count, buffer) = (vertices.len() as u32, Buffer::of(gpu, &vertices));
    target.draw(gpu, &Pass::zeros(), |commands| {
        commands.vertices(&buffer);
        for pipeline in &pipelines {
            commands.bind(pipeline);
            commands.draw(0..count);
        }
    })
}

/// A draw that replaces the stencil.
fn replacing(reference: &str, modes: &str) -> Draw {
    let replaced = face(vk::CompareOp::ALWAYS, [0xff, 0xff], [vk::StencilOp::KEEP, vk::StencilOp::REPLACE]);
    let front_face = vk::FrontFace::CLOCKWISE;
    Draw { fragment: fragment(reference, modes), front: replaced, back: replaced, front_face }
}

/// The stencils of a picture with one sample a pixel.
fn stencils(output: &Output) -> Vec<u8> {
    let picture = output.pictures.iter().find(|picture| picture.name == "stencil");
    picture.expect("a stencil").texels()
}

/// The low eight bits of what a program writes replace the stencil. With early tests, which precede the program, it is the
/// pipeline's reference, also where the program discards.
#[gaurast_runner::test(needs = [GLSLANG])]
fn a_reference_replaces_the_stencil() {
    let gpu = device(Driver::Embedded);
    let reference = "300 * at.x + at.y";
    let found = stencils(&picture(&gpu, 1, &[replacing(reference, "")]));
    for (at, found) in (0..).zip(found) {
        let (x, y) = (at % 48, at / 48);
        assert_eq!(found, if x % 7 == 3 { 0 } else { (300 * x + y) as u8 }, "{x}, {y}");
    }
    let early = stencils(&picture(&gpu, 1, &[replacing(reference, "layout(early_fragment_tests) in;")]));
    assert!(early.iter().all(|&stencil| stencil == 0x55));
}

/// Variants by the samples of a pixel.
fn samples() -> Vec<Variant> {
    ["1", "4"].map(Variant::new).into()
}

/// References are compared with those that were written before, by the tests of either face.
#[gaurast_runner::test(each = samples(), needs = [GLSLANG, Need::Lavapipe])]
fn references_are_compared(case: &Case) {
    let (keep, replace) = (vk::StencilOp::KEEP, vk::StencilOp::REPLACE);
    let compared = |front_face| Draw {
        fragment: fragment("(at.x ^ at.y) + 5", ""),
        front: face(vk::CompareOp::LESS, [0x3f, 0x0f], [vk::StencilOp::INVERT, replace]),
        back: face(vk::CompareOp::GREATER, [0x1c, 0xf0], [keep, vk::StencilOp::INCREMENT_AND_WRAP]),
        front_face,
    };
    let (clockwise, counter) = (vk::FrontFace::CLOCKWISE, vk::FrontFace::COUNTER_CLOCKWISE);
    let draws = [replacing("3 * at.x + at.y", ""), compared(clockwise), compared(counter)];
    let samples = case.variant().parse().expect("a number");
    let [ours, theirs] = [Driver::Embedded, Driver::Lavapipe].map(|driver| picture(&device(driver), samples, &draws));
    assert!(ours.shows_something());
    assert!(ours == theirs);
}
