//! Pipelines that are linked from libraries of their parts.

use ash::vk;
use ash::vk::GraphicsPipelineLibraryFlagsEXT as Parts;
use gaurast::vk::{GaussianAntialiasingGAURAST as Antialiasing, GaussianCutOffGAURAST as CutOff};
use gaurast_testkit::{Graphics, Pipeline};

use super::chapter::Chapter;
use super::scenes::{cloud, dense};
use crate::draw::{Blend, Draw, Shown};
use crate::program::Program;
use crate::stage::Stage;

const ALL: [Parts; 4] = [
    Parts::VERTEX_INPUT_INTERFACE,
    Parts::PRE_RASTERIZATION_SHADERS,
    Parts::FRAGMENT_SHADER,
    Parts::FRAGMENT_OUTPUT_INTERFACE,
];

/// The splits of a pipeline into libraries.
fn splits() -> [(&'static str, Vec<Parts>); 3] {
    let [input, vertex, fragment, output] = ALL;
    [
        ("four", ALL.to_vec()),
        ("two", vec![output | input, fragment | vertex]),
        ("three", vec![fragment, input | vertex, output]),
    ]
}

/// A pipeline of a stage that is linked from libraries.
fn linked(stage: &Stage<'_>, draw: &Draw, split: &[Parts]) -> Pipeline {
    let of = |parts: Parts, libraries: Vec<vk::Pipeline>| {
        stage.pipeline(draw, &move |graphics: &mut Graphics<'_>| {
            graphics.parts = Some(parts);
            graphics.libraries.clone_from(&libraries);
            if libraries.is_empty() {
                graphics.flags |= vk::PipelineCreateFlags::LIBRARY_KHR;
            } else {
                graphics.shaders.clear();
            }
        })
    };
    let libraries: Vec<Pipeline> = split.iter().map(|&parts| of(parts, Vec::new())).collect();
    of(Parts::empty(), libraries.iter().map(|library| library.raw).collect())
}

pub(super) fn libraries(chapter: &mut Chapter<'_>) {
    let behind = [0.2, 0.4, 0.6, 0.8];
    type Make = fn() -> Draw;
    let draws: [(&str, Make); 4] = [
        ("state", || Draw::new(cloud(571, 800, 1)).in_state(|state| state.low_pass_variance(1.25).alpha_ceiling(0.5))),
        ("compensated", || {
            Draw::new(cloud(572, 800, 0)).in_state(|state| state.antialiasing(Antialiasing::OPACITY_COMPENSATED))
        }),
        ("footprint", || Draw::new(dense(573, 0)).within(CutOff::ELLIPSE, 1.5)),
        ("resolve", || Draw { shown: Some(Shown::Accumulated), blend: Blend::Replace, ..Draw::new(dense(574, 0)) }),
    ];
    for (name, draw) in draws {
        for (split_name, split) in splits() {
            chapter.program(format!("{name}.{split_name}"), move || {
                let split = split.clone();
                let draw = Draw { behind: if name == "resolve" { [0.0; 4] } else { behind }, ..draw() };
                // What a shader shows of what accumulated is the picture of the draw without it.
                let plain = Draw { shown: None, ..draw.clone() };
                let program = Program::on_stage(plain, move |stage| {
                    let pipeline = linked(stage, &draw, &split);
                    stage.run(|commands| {
                        commands.bind(&pipeline);
                        commands.draw(0..stage.scene.count);
                    });
                });
                let program = program.needing("VK_EXT_graphics_pipeline_library");
                if name == "resolve" { program.needing("resolveFragmentShader") } else { program }
            });
        }
    }
}
