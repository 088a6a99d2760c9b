//! Vertex shaders that project: what they write, and what they read.

use ash::vk;
use ash::vk::GraphicsPipelineLibraryFlagsEXT as Parts;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianOrderGAURAST as Order,
    GaussianProjectionModeGAURAST as ProjectionMode, GaussianVertexOutputLocationsGAURAST as Locations,
};
use gaurast_oracle::oracle::error_model::PrecisionClass;
use gaurast_oracle::oracle::shaded::{OracleOutputs, OracleViewport, render_shaded};
use gaurast_oracle::oracle::{OracleState, Rules};
use gaurast_testkit::shader::words;
use gaurast_testkit::{
    Attachments, Bindings, Buffer, Commands, GaussianOptions, Gpu, Graphics, Pass, Pipeline, Resource, Shader, Target,
    attribute, binding, over,
};

use super::chapter::Chapter;
use super::scenes::dense;
use crate::draw::{SIZE, State};
use crate::judge::{Expected, contract};
use crate::program::{Answer, Program, colors};
use crate::rendering::{Rendering, colors_by_layer, layers};

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
    Answer::Picture(Box::new(move |precision| Expected {
        color: render_shaded(&outputs, SIZE, &viewport, &oracle_state(&state, precision)),
        distance: contract(precision),
        depth: Vec::new(),
        stencil: Vec::new(),
    }))
}

/// The state that a device of a class of precision follows.
fn oracle_state(state: &State, precision: PrecisionClass) -> OracleState {
    let state = OracleState::from(state);
    OracleState { rules: Rules { precision, ..state.rules }, ..state }
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

/// Makes a pipeline of its state.
type Create = fn(&Gpu, Graphics<'_>) -> Pipeline;

/// A whole pipeline.
fn whole_pipeline(gpu: &Gpu, graphics: Graphics<'_>) -> Pipeline {
    graphics.create(gpu).expect("a pipeline of a projecting shader")
}

/// A pipeline whose vertices are instances.
fn by_instance(gpu: &Gpu, mut graphics: Graphics<'_>) -> Pipeline {
    graphics.bindings[0].input_rate = vk::VertexInputRate::INSTANCE;
    whole_pipeline(gpu, graphics)
}

/// The views that a shader tells apart.
const VIEW_MASK: u32 = 0b101;

/// A pipeline for views, with a shader that tells them apart.
fn of_views(gpu: &Gpu, mut graphics: Graphics<'_>) -> Pipeline {
    graphics.view_mask = VIEW_MASK;
    graphics.shaders = vec![Shader::vertex(words(include_bytes!("../../shaders/projecting_views.vert.spv")))];
    whole_pipeline(gpu, graphics)
}

/// A pipeline that is linked from libraries of its four parts.
fn linked(gpu: &Gpu, graphics: Graphics<'_>) -> Pipeline {
    let parts = [
        Parts::VERTEX_INPUT_INTERFACE,
        Parts::PRE_RASTERIZATION_SHADERS,
        Parts::FRAGMENT_SHADER,
        Parts::FRAGMENT_OUTPUT_INTERFACE,
    ];
    let libraries = parts.map(|part| {
        let flags = graphics.flags | vk::PipelineCreateFlags::LIBRARY_KHR;
        let has_shader = part == Parts::PRE_RASTERIZATION_SHADERS;
        let shaders = if has_shader { graphics.shaders.clone() } else { Vec::new() };
        whole_pipeline(gpu, Graphics { parts: Some(part), flags, shaders, ..graphics.clone() })
    });
    let libraries = libraries.each_ref().map(|library| library.raw).to_vec();
    whole_pipeline(gpu, Graphics { parts: Some(Parts::empty()), libraries, shaders: Vec::new(), ..graphics })
}

impl Projecting {
    fn new(gpu: &Gpu, state: State, has_key: bool) -> Self {
        Self::with(gpu, state, has_key, whole_pipeline)
    }

    fn with(gpu: &Gpu, state: State, has_key: bool, create: Create) -> Self {
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
        let pipeline = create(gpu, graphics);
        gpu.run(|commands| commands.pass(&target, &Pass::clear([0.0; 4]), || {}));
        Self { target, pipeline, tint, _white: white }
    }

    /// Binds everything but vertices, with the viewport of the whole attachment.
    fn bind(&self, commands: &Commands) {
        commands.whole(&self.target);
        commands.bind(&self.pipeline);
        commands.bind_set(&self.tint, &[]);
        commands.push(0, &[1.0_f32]);
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
    draws(chapter);
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

/// The vertices that a draw names, and how it names them.
struct Named {
    /// Vertices, in the order of the Gaussians.
    vertices: Vec<u32>,
    indices: Vec<u32>,
    /// Words of the parameters of indirect commands.
    parameters: Vec<u32>,
    create: Create,
    record: fn(&Commands, &Buffer),
}

/// A program that draws named vertices as one set.
fn naming(named: impl Fn() -> Named + Send + Sync + 'static) -> Program {
    let all = outputs(545);
    let answers = named().vertices.iter().map(|&vertex| all[vertex as usize]).collect();
    let given = vertices(&all);
    let program = Program::of(vec![answer(answers, WHOLE, State::default())], move |gpu| {
        let Named { indices, parameters, create, record, .. } = named();
        let stage = Projecting::with(gpu, State::default(), true, create);
        let buffer = Buffer::of(gpu, given.as_flattened());
        let padded = |words: &[u32]| if words.is_empty() { vec![0; 4] } else { words.to_vec() };
        let (indices, parameters) = (Buffer::of(gpu, &padded(&indices)), Buffer::of(gpu, &padded(&parameters)));
        stage.run(gpu, WHOLE, |commands| {
            commands.vertices(&buffer);
            commands.indices(&indices, 0, vk::IndexType::UINT32);
            commands.gaussian_set(|| record(commands, &parameters));
        });
        Ok(vec![colors(stage.target.read())])
    });
    program.needing("vertexShaderProjection").needing("mergedDraws")
}

/// Every vertex, drawn by one command.
fn direct() -> Named {
    Named {
        vertices: (0..500).collect(),
        indices: Vec::new(),
        parameters: Vec::new(),
        create: whole_pipeline,
        record: |commands, _| commands.draw(0..500),
    }
}

/// Vertices in another order than theirs, some of them twice.
fn indexed() -> Named {
    Named {
        vertices: (0..300).map(|at| 50 + at * 7 % 200).collect(),
        indices: (0..300).map(|at| at * 7 % 200).collect(),
        record: |commands, _| commands.draw_indexed(0..300, 50),
        ..direct()
    }
}

/// Draw commands, secondary command buffers and libraries.
fn draws(chapter: &mut Chapter<'_>) {
    chapter.program("indexed", || naming(indexed));
    chapter.program("instances", move || {
        let record: fn(&Commands, &Buffer) = |commands, _| commands.draw_instances(0..2, 30..400);
        let vertices = (30..400).flat_map(|vertex| [vertex; 2]).collect();
        naming(move || Named { vertices: Vec::clone(&vertices), create: by_instance, record, ..direct() })
    });
    chapter.program("indirect", move || {
        naming(move || Named {
            vertices: (300..450).chain(20..220).collect(),
            parameters: vec![150, 1, 300, 0, 0, 1, 7, 0, 200, 1, 20, 0],
            record: |commands, parameters| commands.draw_indirect(parameters, 3),
            ..direct()
        })
    });
    chapter.program("indexed_indirect", move || {
        naming(move || Named {
            vertices: [110..300, 0..60].into_iter().flatten().map(|at| 50 + at * 7 % 200).collect(),
            parameters: vec![190, 1, 110, 50, 0, 60, 1, 0, 50, 0],
            record: |commands, parameters| {
                let (device, raw) = commands.raw();
                // SAFETY: the buffer has the parameters of two draws.
                unsafe { device.cmd_draw_indexed_indirect(raw, parameters.raw, 0, 2, 20) };
            },
            ..indexed()
        })
    });
    chapter.program("libraries", move || {
        naming(move || Named { create: linked, ..direct() }).needing("VK_EXT_graphics_pipeline_library")
    });
    chapter.program("secondary", || {
        let all = outputs(546);
        let given = vertices(&all);
        let program = Program::of(vec![answer(all, WHOLE, State::default())], move |gpu| {
            let stage = Projecting::new(gpu, State::default(), true);
            let buffer = Buffer::of(gpu, given.as_flattened());
            let formats = stage.target.attachment_formats().colors;
            let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
                .color_attachment_formats(&formats)
                .rasterization_samples(vk::SampleCountFlags::TYPE_1);
            let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
            let secondary = gpu.record_secondary(&inheritance, |commands| {
                stage.bind(commands);
                commands.vertices(&buffer);
                commands.draw(0..500);
            });
            gpu.run(|commands| {
                let flags = vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS;
                commands.pass(&stage.target, &Pass { flags, ..Pass::load() }, || {
                    let (device, raw) = commands.raw();
                    // SAFETY: the secondary command buffer is for this pass.
                    unsafe { device.cmd_execute_commands(raw, &[secondary.raw]) };
                });
            });
            Ok(vec![colors(stage.target.read())])
        });
        program.needing("vertexShaderProjection")
    });
    chapter.program("views", || {
        let all = outputs(547);
        let given = vertices(&all);
        let seen = |view: u32| {
            let seen = |one: &OracleOutputs| {
                let [x, y, z, w] = one.position;
                let color = if view == 2 { one.color.map(|c| 0.5 * c) } else { one.color };
                OracleOutputs { position: [x + 0.25 * view as f32 * w, y, z, w], color, ..*one }
            };
            if VIEW_MASK >> view & 1 == 0 { Vec::new() } else { all.iter().map(seen).collect() }
        };
        let answers = (0..3).map(|view| answer(seen(view), WHOLE, State::default())).collect();
        let program = Program::of(answers, move |gpu| {
            let stage = Projecting::with(gpu, State::default(), true, of_views);
            let buffer = Buffer::of(gpu, given.as_flattened());
            let image = layers(gpu, SIZE, 3, [0.0; 4]);
            let views = [image.view];
            let rendering = Rendering { view_mask: VIEW_MASK, ..Rendering::over(&views, SIZE) };
            gpu.run(|commands| {
                rendering.record(commands, || {
                    stage.bind(commands);
                    commands.vertices(&buffer);
                    commands.draw(0..500);
                });
            });
            Ok(colors_by_layer(&image).into_iter().map(colors).collect())
        });
        program.needing("vertexShaderProjection").needing("gaussianMultiview")
    });
}
