//! Mistakes in depths: coefficients, comparison, clear value and viewport go together.

use ash::vk;
use gaurast::vk::GaussianCameraGAURAST;
use gaurast_testkit::{Buffer, Commands, Gpu, Graphics, Message, Pass, Pipeline, Target, TargetOptions, depth_test};

use crate::stage::{Mistake, SIZE, SPLAT, camera, mistake, splats};

type Camera = GaussianCameraGAURAST<'static>;

/// A draw with a depth test.
#[derive(Clone, Copy)]
pub struct Deep {
    pub op: vk::CompareOp,
    pub cleared: f32,
    pub range: [f32; 2],
    pub coefficients: [f32; 2],
    /// The comparison of a draw before it.
    pub before: Option<vk::CompareOp>,
}

/// Depths as Vulkan has them: 0 at the near plane.
pub const RIGHT: Deep =
    Deep { op: vk::CompareOp::LESS, cleared: 1.0, range: [0.0, 1.0], coefficients: [1.0, -0.2], before: None };

impl Deep {
    fn pipeline(gpu: &Gpu, op: vk::CompareOp) -> Pipeline {
        let request = Graphics { depth_stencil: depth_test(op), depth_format: vk::Format::D32_SFLOAT, ..splats() };
        request.create(gpu).expect("a pipeline")
    }

    fn record(self, commands: &Commands, pipeline: &Pipeline, camera: &Camera) {
        let [width, height] = SIZE.map(|side| side as f32);
        commands.bind(pipeline);
        commands.viewport([0.0, 0.0, width, height], self.range);
        commands.camera(camera);
        commands.draw(0..1);
    }

    /// The messages of the draw.
    pub fn messages(self, gpu: &Gpu) -> Vec<Message> {
        let options = TargetOptions {
            size: SIZE,
            colors: vec![vk::Format::R32G32B32A32_SFLOAT],
            ..TargetOptions::with_depth(vk::Format::D32_SFLOAT)
        };
        let target = Target::new(gpu, &options);
        let buffer = Buffer::of(gpu, &SPLAT);
        let pipeline = Self::pipeline(gpu, self.op);
        let before = self.before.map(|op| Self::pipeline(gpu, op));
        let camera = camera().depth_coefficients(self.coefficients);
        let cleared = vk::ClearDepthStencilValue { depth: self.cleared, stencil: 0 };
        gpu.messages();
        gpu.run(|commands| {
            commands.pass(&target, &Pass { depth: cleared, ..Pass::zeros() }, || {
                commands.vertices(&buffer);
                if let Some(before) = &before {
                    self.record(commands, before, &camera);
                }
                self.record(commands, &pipeline, &camera);
            });
        });
        gpu.messages()
    }
}

fn deep(name: &'static str, id: &'static str, deep: Deep) -> Mistake {
    mistake(name, id, move |stage| deep.messages(&stage.full))
}

pub fn mistakes() -> Vec<Mistake> {
    let coefficients = "GAURAST-Draw-depth-coefficients";
    let compare = "GAURAST-Draw-depth-compare";
    let clear = "GAURAST-Draw-depth-clear";
    vec![
        deep("depth coefficients of zeros", coefficients, Deep { coefficients: [0.0; 2], ..RIGHT }),
        deep(
            "depth coefficients of OpenGL's matrix",
            coefficients,
            Deep { coefficients: [100.2 / 99.8, -2.0 * 100.0 * 0.2 / 99.8], ..RIGHT },
        ),
        deep("reversed depths that compare by less", compare, Deep { coefficients: [0.0, 0.2], ..RIGHT }),
        deep("a range of depths from 1 to 0 that compares by less", compare, Deep { range: [1.0, 0.0], ..RIGHT }),
        deep(
            "depths that compare by greater as if they were reversed",
            compare,
            Deep { op: vk::CompareOp::GREATER, cleared: 0.0, ..RIGHT },
        ),
        deep(
            "Gaussians that compare the other way than what is before them",
            compare,
            Deep { op: vk::CompareOp::GREATER, before: Some(vk::CompareOp::LESS), ..RIGHT },
        ),
        deep("a depth that is cleared to 0", clear, Deep { cleared: 0.0, ..RIGHT }),
        deep(
            "a depth of reversed depths that is cleared to 1",
            clear,
            Deep { op: vk::CompareOp::GREATER, coefficients: [0.0, 0.2], ..RIGHT },
        ),
    ]
}
