//! Vertex shaders that project: what they write, and what they read.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianOrderGAURAST as Order,
    GaussianProjectionModeGAURAST as ProjectionMode, GaussianVertexOutputLocationsGAURAST as Locations,
};
use gaurast_oracle::oracle::OracleState;
use gaurast_oracle::oracle::shaded::{OracleOutputs, OracleViewport, render_shaded};
use gaurast_testkit::shader::words;
use gaurast_testkit::{
    Attachments, Bindings, Buffer, Commands, GaussianOptions, Gpu, Graphics, Pass, Pipeline, Resource, Shader, Target,
    attribute, binding, over,
};

use super::chapter::Chapter;
use super::scenes::dense;
use crate::draw::{SIZE, State};
use crate::judge::{CONTRACT, Expected};
use crate::program::{Answer, Program, colors};

/// The floats of a vertex: position, covariance and opacity, colour and key.
type Vertex = [[f32; 4]; 3];

/// What the shader writes for Gaussians of every shape, on the screen and outside it.
fn outputs(seed: u64) -> Vec<OracleOutputs> {
    let scene = dense(seed, 0);
    let all = scene.positions.iter().zip(&scene.scales).zip(&scene.rotations).enumerate();
    all.map(|(at, ((&[x, y, z], &[across, along, _]), &[w, turned, ..]))| {
        let [xx, yy] = [across, along].map(|side| (20.0 * side).powi(2) + 0.5);
        OracleOutputs {
            // Depths are between 0 and 1.
            position: [0.4 * x, 0.4 * y, (0.1 * z).clamp(0.0, 1.0) * z, z],
            covariance: [xx, 0.6 * (xx * yy).sqrt() * (turned - w).clamp(-1.0, 1.0), yy],
            opacity: scene.opacities[at],
            color: scene.sh[at].map(|c| (0.4 * c + 0.4).clamp(0.0, 1.0)),
            // Another order than that of depths.
            key: Some(((at * 37) % 101) as f32 / 8.0),
        }
    })
    .collect()
}

fn vertices(outputs: &[OracleOutputs]) -> Vec<Vertex> {
    let vertex = |one: &OracleOutputs| {
        let [xx, xy, yy] = one.covariance;
        let [red, green, blue] = one.color;
        [one.position, [xx, xy, yy, one.opacity], [red, green, blue, one.key.unwrap_or(0.0)]]
    };
    outputs.iter().map(vertex).collect()
}

/// What the pictures of outputs may be.
fn answer(outputs: Vec<OracleOutputs>, viewport: OracleViewport, state: State) -> Answer {
    Answer::Picture(Box::new(move || Expected {
        color: render_shaded(&outputs, SIZE, &viewport, &OracleState::from(&state)),
        distance: CONTRACT,
        depth: Vec::new(),
        stencil: Vec::new(),
    }))
}

/// The viewport that is the attachment.
const WHOLE: OracleViewport = OracleViewport { corner: [0.0, 0.0], size: [SIZE[0] as f32, SIZE[1] as f32] };

/// The stage of a projecting shader.
struct Projecting {
    target: Target,
    pipeline: Pipeline,
    tint: Bindings,
    _white: Buffer,
}

impl Projecting {
    fn new(gpu: &Gpu, state: State, has_key: bool) -> Self {
        let target = Target::floats(gpu, SIZE);
        let white = Buffer::of(gpu, &[1.0_f32; 4]);
        let tint = Bindings::new(gpu, &[Resource::Uniform(white.raw)]);
        let locations = Locations::default().covariance(0).opacity(1).color(2);
        let locations = if has_key { locations.depth_key(3) } else { locations };
        let graphics =
            GaussianOptions { formats: target.attachment_formats(), blend: vec![over()], ..GaussianOptions::new(0) };
        let graphics = Graphics {
            shaders: vec![Shader::vertex(words(include_bytes!("../../shaders/projecting.vert.spv")))],
            set_layouts: vec![tint.layout],
            push: vec![vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::ALL_GRAPHICS).size(128)],
            bindings: vec![binding(0, size_of::<Vertex>() as u32)],
            attributes: (0..3).map(|at| attribute(at, vk::Format::R32G32B32A32_SFLOAT, 16 * at)).collect(),
            gaussian: Some(state.projection_mode(ProjectionMode::VERTEX_SHADER).vertex_output_locations(locations)),
            ..graphics.graphics()
        };
        let pipeline = graphics.create(gpu).expect("a pipeline of a projecting shader");
        gpu.run(|commands| commands.pass(&target, &Pass::clear([0.0; 4]), || {}));
        Self { target, pipeline, tint, _white: white }
    }

    /// Executes a pass over the attachment, in which everything but vertices is bound.
    fn run(&self, gpu: &Gpu, viewport: OracleViewport, record: impl FnOnce(&Commands)) {
        gpu.run(|commands| {
            commands.pass(&self.target, &Pass::load(), || {
                let ([x, y], [width, height]) = (viewport.corner, viewport.size);
                commands.viewport([x, y, width, height], [0.0, 1.0]);
                commands.bind(&self.pipeline);
                commands.bind_set(&self.tint, &[]);
                commands.push(0, &[1.0_f32]);
                record(commands);
            });
        });
    }
}

/// A program that draws outputs as one set.
fn whole(seed: u64, viewport: OracleViewport, state: State, has_key: bool) -> Program {
    let mut all = outputs(seed);
    if !has_key {
        all.iter_mut().for_each(|one| one.key = None);
    }
    let given = vertices(&all);
    let program = Program::of(vec![answer(all, viewport, state)], move |gpu| {
        let stage = Projecting::new(gpu, state, has_key);
        let buffer = Buffer::of(gpu, given.as_flattened());
        stage.run(gpu, viewport, |commands| {
            commands.vertices(&buffer);
            commands.draw(0..given.len() as u32);
        });
        Ok(vec![colors(stage.target.read())])
    });
    needing(program, state)
}

fn needing(program: Program, state: State) -> Program {
    let program = program.needing("vertexShaderProjection");
    let program = match state.order {
        Order::RADIAL_DISTANCE => program.needing("radialDistanceOrder"),
        Order::PRIMITIVE => program.needing("primitiveOrder"),
        _ => program,
    };
    match state.antialiasing {
        Antialiasing::OPACITY_COMPENSATED => program.needing("opacityCompensation"),
        _ => program,
    }
}

pub(super) fn projection(chapter: &mut Chapter<'_>) {
    let plain = State::default();
    let states = [
        ("default", plain),
        ("radial_distance", plain.order(Order::RADIAL_DISTANCE)),
        ("primitive", plain.order(Order::PRIMITIVE)),
        ("low_pass_1.5", plain.low_pass_variance(1.5)),
        ("compensated", plain.antialiasing(Antialiasing::OPACITY_COMPENSATED)),
        ("floors", plain.alpha_floor(0.05).transmittance_floor(0.1).alpha_ceiling(0.8)),
    ];
    for (name, state) in states {
        chapter.program(format!("state.{name}"), move || whole(541, WHOLE, state, true));
    }
    chapter.program("no_key", || whole(542, WHOLE, State::default(), false));
    let [width, height] = WHOLE.size;
    for (name, corner, size) in
        [("upside_down", [0.0, height], [width, -height]), ("beyond", [-20.0, -9.0], [150.0, 120.0])]
    {
        chapter.program(format!("viewport.{name}"), move || {
            whole(543, OracleViewport { corner, size }, State::default(), true)
        });
    }
    inputs(chapter);
}

/// Push constants and descriptors, which may differ from draw to draw of a set.
fn inputs(chapter: &mut Chapter<'_>) {
    let faded = || {
        let mut all = outputs(544);
        all[250..].iter_mut().for_each(|one| one.opacity *= 0.25);
        all
    };
    let set = |answers: Vec<OracleOutputs>, record: fn(&Commands, &Buffer, &Bindings)| {
        let given = vertices(&outputs(544));
        let program = Program::of(vec![answer(answers, WHOLE, State::default())], move |gpu| {
            let stage = Projecting::new(gpu, State::default(), true);
            let buffer = Buffer::of(gpu, given.as_flattened());
            let red = Buffer::of(gpu, &[1.0_f32, 0.5, 0.25, 1.0]);
            let red = (Bindings::new(gpu, &[Resource::Uniform(red.raw)]), red);
            stage.run(gpu, WHOLE, |commands| {
                commands.vertices(&buffer);
                commands.gaussian_set(|| record(commands, &buffer, &red.0));
            });
            Ok(vec![colors(stage.target.read())])
        });
        program.needing("vertexShaderProjection").needing("mergedDraws")
    };
    chapter.program("push_constants", move || {
        set(faded(), |commands, _, _| {
            commands.draw(0..250);
            commands.push(0, &[0.25_f32]);
            commands.draw(250..500);
        })
    });
    chapter.program("descriptors", move || {
        let mut tinted = outputs(544);
        tinted[250..].iter_mut().for_each(|one| one.color = [one.color[0], one.color[1] * 0.5, one.color[2] * 0.25]);
        set(tinted, |commands, _, red| {
            commands.draw(0..250);
            commands.bind_set(red, &[]);
            commands.draw(250..500);
        })
    });
    chapter.program("set_of_parts", move || {
        set(outputs(544), |commands, buffer, _| {
            commands.draw(0..100);
            commands.vertex_buffer(0, buffer, 100 * size_of::<Vertex>() as u64);
            commands.draw(0..400);
        })
    });
}
