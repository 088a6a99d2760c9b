//! Mistakes in pipelines that are linked from libraries.

use ash::vk;
use gaurast::vk::GaussianOrderGAURAST;
use gaurast_testkit::{Buffer, Gpu, Graphics, Message, Pass, Pipeline, Target, blend};
use vk::GraphicsPipelineLibraryFlagsEXT as Parts;

use crate::stage::{Mistake, SCALE, SIZE, SPLAT, Splat, camera, mistake, splat, splats, with};

const ALL: [Parts; 4] = [
    Parts::VERTEX_INPUT_INTERFACE,
    Parts::PRE_RASTERIZATION_SHADERS,
    Parts::FRAGMENT_SHADER,
    Parts::FRAGMENT_OUTPUT_INTERFACE,
];

/// A pipeline that is linked from four libraries, if the driver makes all of them.
fn linked(gpu: &Gpu, whole: &Graphics<'static>) -> Option<Pipeline> {
    let library = |parts| Graphics {
        flags: whole.flags | vk::PipelineCreateFlags::LIBRARY_KHR,
        parts: Some(parts),
        ..whole.clone()
    };
    let libraries: Result<Vec<_>, _> = ALL.map(|part| library(part).create(gpu)).into_iter().collect();
    let libraries = libraries.ok()?;
    let link = Graphics {
        parts: Some(Parts::empty()),
        libraries: libraries.iter().map(|library| library.raw).collect(),
        gaussian: None,
        ..whole.clone()
    };
    link.create(gpu).ok()
}

/// The messages as libraries are made and linked.
fn linking(gpu: &Gpu, whole: &Graphics<'static>) -> Vec<Message> {
    gpu.messages();
    let _pipeline = linked(gpu, whole);
    gpu.messages()
}

/// The messages of a draw by a pipeline that is linked from libraries, without a camera if none is given.
pub fn drawn(gpu: &Gpu, whole: &Graphics<'static>, splats: &[Splat], has_camera: bool) -> Vec<Message> {
    gpu.messages();
    let pipeline = linked(gpu, whole).expect("a pipeline");
    let buffer = Buffer::of(gpu, splats.as_flattened());
    let target = Target::floats(gpu, SIZE);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&buffer);
            if has_camera {
                commands.camera(&camera());
            }
            commands.draw(0..splats.len() as u32);
        });
    });
    gpu.messages()
}

pub fn mistakes() -> Vec<Mistake> {
    use vk::BlendFactor as Factor;
    vec![
        mistake(
            "an order that is none, in a library",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-order-parameter",
            |stage| linking(&stage.linking, &with(|s| s.order(GaussianOrderGAURAST::from_raw(77)))),
        ),
        mistake(
            "no attribute of the rotation, in another library than the locations",
            "VUID-VkGaussianAttributeLocationsGAURAST-None-90015",
            |stage| {
                let mut request = splats();
                request.attributes.retain(|attribute| attribute.location != 2);
                linking(&stage.linking, &request)
            },
        ),
        mistake("blending that multiplies by alpha once more, in a library", "GAURAST-Pipeline-blending", |stage| {
            let blend = vec![blend(Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA, vk::BlendOp::ADD)];
            linking(&stage.linking, &Graphics { blend, ..splats() })
        }),
        mistake("a draw without a camera by a linked pipeline", "GAURAST-Draw-no-camera", |stage| {
            drawn(&stage.linking, &splats(), &[SPLAT], false)
        }),
        mistake("logarithms that a linked pipeline draws", "GAURAST-Draw-negative-scale", |stage| {
            drawn(&stage.linking, &splats(), &[splat(SCALE, [-2.3; 3]); 3], true)
        }),
    ]
}
