//! Several colour attachments, and blend equations.

use ash::vk;
use gaurast::vk::GaussianResolveInputLocationsGAURAST as Inputs;
use gaurast_testkit::shader::words;
use gaurast_testkit::{
    Attachments, Bindings, Buffer, Commands, GaussianOptions, GaussianScene, Gpu, Graphics, Pass, Pipeline, Resource,
    Shader, Target, TargetOptions,
};

use super::chapter::Chapter;
use super::input::vertices;
use super::scenes::dense;
use crate::draw::{Blend, Draw, Equation};
use crate::program::{Program, colors};
use crate::rendering::FORMAT;
use crate::stage::color_blend;

/// What is behind the Gaussians.
const BEHIND: [f32; 4] = [0.5, 0.25, 0.75, 0.6];

fn over(seed: u64) -> Draw {
    Draw { behind: BEHIND, ..Draw::new(dense(seed, 0)) }
}

/// A shader that writes what accumulated to three attachments, what it is bound to, and the attachments.
struct Painted {
    target: Target,
    pipeline: Pipeline,
    scene: GaussianScene,
    tint: Bindings,
    _white: Buffer,
}

impl Painted {
    /// The stage of draws that differ in blending and write masks, one for each attachment.
    fn new(gpu: &Gpu, draws: &[Draw], tint: [f32; 4], change: &dyn Fn(&mut Graphics<'_>)) -> Self {
        let first = &draws[0];
        let options = TargetOptions { size: first.size, colors: vec![FORMAT; draws.len()], ..TargetOptions::default() };
        let target = Target::new(gpu, &options);
        gpu.run(|commands| commands.pass(&target, &Pass::clear(BEHIND), || {}));
        let white = Buffer::of(gpu, &tint);
        let tint = Bindings::new(gpu, &[Resource::Uniform(white.raw)]);
        let options = GaussianOptions {
            state: first.state.resolve_input_locations(Inputs::default().accumulated_color(0)),
            resolve: Some(Shader::fragment(words(include_bytes!("../../shaders/painted.frag.spv")))),
            set: Some(&tint),
            formats: target.attachment_formats(),
            blend: draws.iter().map(color_blend).collect(),
            ..GaussianOptions::new(first.degree)
        };
        let mut graphics = options.graphics();
        graphics.push =
            vec![vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::ALL_GRAPHICS).size(128)];
        change(&mut graphics);
        let pipeline = graphics.create(gpu).expect("a pipeline with a resolve shader");
        Self { target, pipeline, scene: GaussianScene::new(gpu, &first.scene), tint, _white: white }
    }

    /// Executes a pass in which everything is bound, the push constants included.
    fn run(&self, gpu: &Gpu, draw: &Draw, record: impl FnOnce(&Commands)) {
        gpu.run(|commands| {
            commands.pass(&self.target, &Pass::load(), || {
                self.scene.bind_buffers(commands);
                commands.bind(&self.pipeline);
                commands.camera(&draw.camera);
                commands.bind_set(&self.tint, &[]);
                commands.push(0, &[0.25_f32; 4]);
                commands.push(16, &[1.0_f32; 4]);
                record(commands);
            });
        });
    }
}

/// A program that draws to three attachments, one for each draw.
fn painted(draws: [Draw; 3]) -> Program {
    let program = Program::pictures(draws.to_vec(), move |gpu| {
        let stage = Painted::new(gpu, &draws, [1.0; 4], &|_| {});
        stage.run(gpu, &draws[0], |commands| commands.draw(0..stage.scene.count));
        Ok(stage.target.colors.iter().map(|image| colors(image.colors())).collect())
    });
    program.needing("resolveFragmentShader").needing("independentBlend")
}

pub(super) fn targets(chapter: &mut Chapter<'_>) {
    chapter.program("blending_of_each", || {
        painted([Blend::Over, Blend::Add, Blend::Replace].map(|blend| Draw { blend, ..over(551) }))
    });
    use vk::ColorComponentFlags as C;
    chapter.program("write_mask_of_each", || {
        painted([C::RGBA, C::R | C::B, C::A].map(|write_mask| Draw { write_mask, ..over(552) }))
    });
    chapter.program("without_a_shader", || {
        let draw = over(553);
        let untouched = Draw { calls: vec![vertices(0, 0)], ..draw.clone() };
        Program::pictures(vec![draw.clone(), untouched], move |gpu| {
            let options = TargetOptions { size: draw.size, colors: vec![FORMAT; 2], ..TargetOptions::default() };
            let target = Target::new(gpu, &options);
            let options = GaussianOptions::over(0, &target);
            let pipeline = options.graphics().create(gpu).expect("a pipeline");
            let scene = GaussianScene::new(gpu, &draw.scene);
            gpu.run(|commands| {
                commands.pass(&target, &Pass::clear(BEHIND), || {
                    commands.bind(&pipeline);
                    scene.bind_buffers(commands);
                    commands.camera(&draw.camera);
                    commands.draw(0..scene.count);
                });
            });
            Ok(target.colors.iter().map(|image| colors(image.colors())).collect())
        })
    });
    equations(chapter);
}

/// Blend equations of one attachment.
fn equations(chapter: &mut Chapter<'_>) {
    use vk::BlendFactor as F;
    use vk::BlendOp as Op;
    let over_alpha = ([F::ONE, F::ONE_MINUS_SRC_ALPHA], Op::ADD);
    let constants = [0.25, 0.5, 0.75, 0.375];
    let equation = |color, alpha| Equation { color, alpha, constants };
    let all = [
        ("subtract", equation(([F::ONE, F::ONE], Op::SUBTRACT), over_alpha)),
        ("reverse_subtract", equation(([F::ONE, F::ONE], Op::REVERSE_SUBTRACT), over_alpha)),
        ("min", equation(([F::ONE, F::ONE], Op::MIN), ([F::ONE, F::ONE], Op::MIN))),
        ("max", equation(([F::ONE, F::ONE], Op::MAX), ([F::ONE, F::ONE], Op::MAX))),
        ("alpha_apart", equation(([F::ONE, F::ONE_MINUS_SRC_ALPHA], Op::ADD), ([F::ZERO, F::ONE], Op::ADD))),
        ("colours", equation(([F::DST_COLOR, F::SRC_COLOR], Op::ADD), ([F::DST_ALPHA, F::ONE], Op::ADD))),
        ("constants", equation(([F::CONSTANT_COLOR, F::ONE_MINUS_CONSTANT_COLOR], Op::ADD), over_alpha)),
        ("constant_alpha", equation(([F::CONSTANT_ALPHA, F::ONE_MINUS_CONSTANT_ALPHA], Op::ADD), over_alpha)),
    ];
    for (name, equation) in all {
        chapter.add(format!("equation.{name}"), move || Draw { equation: Some(equation), ..over(554) });
    }
    chapter.program("dynamic_constants", move || {
        let draw = Draw { equation: Some(all[6].1), ..over(555) };
        let change = |graphics: &mut Graphics<'_>| {
            graphics.blend_constants = [0.9, 0.1, 0.0, 1.0];
            graphics.dynamic.push(vk::DynamicState::BLEND_CONSTANTS);
        };
        Program::changed(draw, change, move |stage| {
            stage.run(|commands| {
                let (device, raw) = commands.raw();
                // SAFETY: the commands are being recorded.
                unsafe { device.cmd_set_blend_constants(raw, &constants) };
                commands.draw(0..stage.scene.count);
            });
        })
    });
}

/// Push constants and descriptors of a resolve shader, for the chapter of resolve shaders.
pub(super) fn inputs(chapter: &mut Chapter<'_>) {
    // The push constants at the beginning are other ones.
    chapter.program("push_constants", || painted([(); 3].map(|()| over(556))));
    chapter.program("descriptors", || {
        // The third attachment is tinted, by powers of two: black where it is added.
        let draw = Draw { blend: Blend::Add, ..over(557) };
        let draws = [draw.clone(), draw.clone(), Draw { calls: vec![vertices(0, 0)], ..draw }];
        let program = Program::pictures(draws.to_vec(), move |gpu| {
            let stage = Painted::new(gpu, &draws, [0.0; 4], &|_| {});
            stage.run(gpu, &draws[0], |commands| commands.draw(0..stage.scene.count));
            Ok(stage.target.colors.iter().map(|image| colors(image.colors())).collect())
        });
        program.needing("resolveFragmentShader").needing("independentBlend")
    });
}
