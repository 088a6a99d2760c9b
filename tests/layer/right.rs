//! Right uses of the extension, about which nothing is said.

use ash::vk;
use gaurast::vk::{
    DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST, DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST, GaussianAntialiasingGAURAST,
    GaussianCameraModelGAURAST, GaussianCameraSourceGAURAST, GaussianGeometryGAURAST, GaussianLinearizationGAURAST,
    GaussianOrderGAURAST, GaussianPrecisionGAURAST, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};
use gaurast_testkit::{Bindings, Buffer, Gpu, Graphics, Message, Pass, PassObject, Resource, Target, opaque};

use crate::contents::{bytes, grid};
use crate::decoding;
use crate::depth::{Deep, RIGHT};
use crate::harmonics::Addressed;
use crate::indirect::{by_compute, strided};
use crate::pipelines::allowing;
use crate::stage::{
    COLOR, IDENTITY, OPACITY, SCALE, SIZE, SPLAT, State, camera, drawing, drawn, gaussian, instanced, laid_out,
    resolved, shaded, spirv, splat, splats, with,
};

/// A right use: what it is, and what is said of it.
type Use = (&'static str, Box<dyn Fn(&Gpu) -> Vec<Message>>);

fn right(name: &'static str, use_it: impl Fn(&Gpu) -> Vec<Message> + 'static) -> Use {
    (name, Box::new(use_it))
}

/// A draw with another Gaussian state.
fn state(name: &'static str, change: fn(State) -> State) -> Use {
    right(name, move |gpu| drawn(gpu, &with(change), &[SPLAT]))
}

pub fn uses() -> Vec<Use> {
    let mut all = states();
    all.extend(draws());
    all.extend(shaders());
    all.extend(sources());
    all.extend(depths());
    all.extend(near_mistakes());
    all.extend(passes());
    all
}

fn states() -> Vec<Use> {
    vec![
        state("the defaults", |s| s),
        state("opacity compensation", |s| s.antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED)),
        state("the order of distance", |s| s.order(GaussianOrderGAURAST::RADIAL_DISTANCE)),
        state("the order of each pixel", |s| s.order(GaussianOrderGAURAST::PER_PIXEL)),
        state("the order of the draw", |s| s.order(GaussianOrderGAURAST::PRIMITIVE)),
        state("binary16", |s| s.precision(GaussianPrecisionGAURAST::FLOAT16)),
        state("2D Gaussians", |s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)),
        state("the unscented transform", |s| s.linearization(GaussianLinearizationGAURAST::UNSCENTED)),
        state("no early end", |s| s.transmittance_floor(0.0).alpha_ceiling(1.0)),
        right("approximations", |gpu| drawn(gpu, &allowing(1e-3, 1e-3), &[SPLAT])),
        right("logarithms and logits", |gpu| {
            let mut trained = splat(SCALE, [-2.3, -2.0, -3.1]);
            trained[OPACITY] = 4.2;
            let flags = Flags::LOG_SCALE | Flags::LOGIT_OPACITY;
            drawn(gpu, &with(|s| s.flags(flags)), &[trained; 20])
        }),
        right("what is not drawn among what is", |gpu| {
            let mut gaussians = vec![SPLAT; 40];
            gaussians[3][SCALE] = -1.0;
            gaussians[7] = splat(0, [0.0, 0.0, -5.0]);
            gaussians[8] = splat(OPACITY, [0.0]);
            drawn(gpu, &splats(), &gaussians)
        }),
    ]
}

fn draws() -> Vec<Use> {
    vec![
        right("a fisheye", |gpu| {
            drawing(gpu, &splats(), &[SPLAT], |commands| {
                let fisheye = camera().model(GaussianCameraModelGAURAST::FISHEYE);
                commands.camera(&fisheye);
                commands.draw(0..1);
            })
        }),
        right("a camera that mirrors", |gpu| {
            drawing(gpu, &splats(), &[SPLAT], |commands| {
                let mirrored = [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
                commands.camera(&camera().rotation(mirrored));
                commands.draw(0..1);
            })
        }),
        right("indices", |gpu| {
            let indices = Buffer::of(gpu, &[2u32, 0, 0, 1]);
            drawing(gpu, &splats(), &[SPLAT; 3], |commands| {
                commands.camera(&camera());
                commands.indices(&indices, 4, vk::IndexType::UINT32);
                commands.draw_indexed(0..3, 0);
            })
        }),
        right("an indirect draw", |gpu| {
            let draws = Buffer::of(gpu, &[2u32, 1, 1, 0]);
            drawing(gpu, &splats(), &[SPLAT; 3], |commands| {
                commands.camera(&camera());
                commands.draw_indirect(&draws, 1);
            })
        }),
        right("indirect draws with a word between them", |gpu| {
            let draws = Buffer::of(gpu, &[1u32, 1, 0, 0, 7, 1, 1, 1, 0, 7]);
            drawing(gpu, &splats(), &[SPLAT; 3], |commands| {
                commands.camera(&camera());
                strided(commands, &draws, 20);
            })
        }),
        right("two draws that blend", |gpu| {
            drawing(gpu, &splats(), &[SPLAT; 3], |commands| {
                commands.camera(&camera());
                commands.draw(0..1);
                commands.draw(1..3);
            })
        }),
        right("a sorted set", |gpu| {
            drawing(gpu, &splats(), &[SPLAT; 3], |commands| {
                commands.camera(&camera());
                commands.gaussian_set(|| {
                    commands.draw(0..1);
                    commands.draw(1..3);
                });
            })
        }),
        right("a sorted set that replaces", |gpu| {
            let request = Graphics { blend: vec![opaque()], ..splats() };
            drawing(gpu, &request, &[SPLAT; 3], |commands| {
                commands.camera(&camera());
                commands.gaussian_set(|| {
                    commands.draw(0..1);
                    commands.draw(1..3);
                });
            })
        }),
        right("model matrices", |gpu| {
            let mut moved = IDENTITY;
            moved[3] = 0.5;
            let models = Buffer::of(gpu, &[IDENTITY, moved]);
            drawing(gpu, &instanced(), &[SPLAT], |commands| {
                commands.camera(&camera());
                commands.vertex_buffer(1, &models, 0);
                commands.draw_instances(0..1, 0..2);
            })
        }),
        right("dynamic states", |gpu| {
            let request = splats()
                .with_dynamic(DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST)
                .with_dynamic(DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST);
            drawing(gpu, &request, &[SPLAT], |commands| {
                // SAFETY: see the crate.
                unsafe {
                    let own = gaussian(gpu);
                    own.cmd_set_gaussian_order(commands.raw, GaussianOrderGAURAST::PER_PIXEL);
                    own.cmd_set_gaussian_alpha_floor(commands.raw, 0.01);
                }
                commands.camera(&camera());
                commands.draw(0..1);
            })
        }),
        right("an empty draw", |gpu| {
            drawing(gpu, &splats(), &[SPLAT], |commands| {
                commands.camera(&camera());
                commands.draw(0..0);
            })
        }),
    ]
}

fn shaders() -> Vec<Use> {
    let created = |gpu: &Gpu, request: Graphics<'static>| {
        let (request, _set, _buffer) = laid_out(gpu, request);
        gpu.messages();
        request.create(gpu).expect("a pipeline");
        gpu.messages()
    };
    vec![
        right("a vertex shader that projects", move |gpu| created(gpu, shaded(|s| s))),
        right("a resolve shader", move |gpu| created(gpu, resolved(spirv!("toned.frag"), [2, 5], |s| s))),
        right("a resolve shader that reads less", move |gpu| {
            created(gpu, resolved(spirv!("woven.frag"), [0, 1], |s| s))
        }),
    ]
}

fn sources() -> Vec<Use> {
    vec![
        right("a camera in a uniform buffer", |gpu| {
            let buffer = Buffer::of(gpu, &bytes(&camera()));
            let set = Bindings::new(gpu, &[Resource::Uniform(buffer.raw)]);
            let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
            let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source)) };
            drawing(gpu, &request, &[SPLAT], |commands| {
                commands.bind_set(&set, &[]);
                commands.draw(0..1);
            })
        }),
        right("a camera at a dynamic offset", |gpu| {
            let mut cameras = vec![0; 256];
            cameras.extend(bytes(&camera()));
            let buffer = Buffer::of(gpu, &cameras);
            let set = Bindings::new(gpu, &[Resource::DynamicUniform(buffer.raw, 128)]);
            let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
            let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source)) };
            drawing(gpu, &request, &[SPLAT], |commands| {
                commands.bind_set(&set, &[256]);
                commands.draw(0..1);
            })
        }),
        right("harmonics in a buffer", |gpu| {
            let buffer = Addressed::new(gpu, 256);
            let request = with(|s| s.flags(Flags::SPHERICAL_HARMONICS_BUFFER));
            drawing(gpu, &request, &[SPLAT], |commands| {
                // SAFETY: see the crate.
                unsafe {
                    gaussian(gpu).cmd_bind_gaussian_spherical_harmonics(commands.raw, &buffer.bound(256));
                }
                commands.camera(&camera());
                commands.draw(0..1);
            })
        }),
        right("positions that are decoded", |gpu| {
            let buffer = Addressed::new(gpu, 256);
            drawing(gpu, &decoding::words(), &[SPLAT], |commands| {
                decoding::bind(gpu, commands.raw, &decoding::tables(&buffer));
                commands.camera(&camera());
                commands.draw(0..1);
            })
        }),
        right("numbers that a compute shader writes", |gpu| {
            by_compute(gpu, &[SPLAT; 2], &[2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1], false)
        }),
        right("numbers that a compute shader writes, and clears afterwards", |gpu| {
            by_compute(gpu, &[SPLAT; 2], &[2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1], true)
        }),
        right("nothing that a compute shader leaves", |gpu| by_compute(gpu, &[SPLAT; 2], &[2, 0, 0, 0], false)),
    ]
}

/// Depths of all conventions.
fn depths() -> Vec<Use> {
    use vk::CompareOp as Op;
    let deep = |name, deep: Deep| right(name, move |gpu: &Gpu| deep.messages(gpu));
    vec![
        deep("depths from 0 to 1", RIGHT),
        deep("depths behind others", Deep { before: Some(Op::LESS), ..RIGHT }),
        deep("depths of a finite far plane", Deep { coefficients: [100.0 / 99.8, -20.0 / 99.8], ..RIGHT }),
        deep("reversed depths", Deep { op: Op::GREATER, cleared: 0.0, coefficients: [0.0, 0.2], ..RIGHT }),
        deep("depths that a viewport turns", Deep { op: Op::GREATER, cleared: 0.0, range: [1.0, 0.0], ..RIGHT }),
        deep("depths that are not compared", Deep { op: Op::ALWAYS, coefficients: [0.0; 2], ..RIGHT }),
        deep("depths that equal", Deep { op: Op::LESS_OR_EQUAL, before: Some(Op::ALWAYS), ..RIGHT }),
    ]
}

/// Contents that are near to mistakes.
fn near_mistakes() -> Vec<Use> {
    vec![
        right("a sheet of Gaussians that touch", |gpu| drawn(gpu, &splats(), &grid(0.02))),
        right("a sheet of small Gaussians", |gpu| drawn(gpu, &splats(), &grid(0.003))),
        right("coefficients of both signs", |gpu| {
            let at = |index: u8| splat(COLOR, [f32::from(index) / 20.0 - 0.7, 0.4, -0.6]);
            drawn(gpu, &splats(), &(0..32).map(at).collect::<Vec<_>>())
        }),
        right("parts of one picture", |gpu| {
            let pipeline = splats().create(gpu).expect("a pipeline");
            let buffer = Buffer::of(gpu, &SPLAT);
            let target = Target::floats(gpu, SIZE.map(|side| 2 * side));
            gpu.messages();
            gpu.run(|commands| {
                commands.pass(&target, &Pass::zeros(), || {
                    commands.bind(&pipeline);
                    commands.vertices(&buffer);
                    for part in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                        let [x, y] = [part[0] * SIZE[0] as f32, part[1] * SIZE[1] as f32];
                        commands.viewport([x, y, SIZE[0] as f32, SIZE[1] as f32], [0.0, 1.0]);
                        let middle = [SIZE[0] as f32 - x + 0.5, SIZE[1] as f32 - y + 0.5];
                        commands.camera(&camera().principal_point(middle));
                        commands.draw(0..1);
                    }
                });
            });
            gpu.messages()
        }),
        right("Gaussians that are instances", |gpu| {
            let mut request = splats();
            request.bindings[0].input_rate = vk::VertexInputRate::INSTANCE;
            drawing(gpu, &request, &[SPLAT; 2], |commands| {
                commands.camera(&camera());
                commands.draw_instances(0..1, 0..2);
            })
        }),
        right("positions from 0 to 1 that a matrix places", |gpu| {
            let mut request = instanced();
            request.attributes[0].format = vk::Format::R16G16B16A16_UNORM;
            request.attributes[0].offset = 0;
            gpu.messages();
            request.create(gpu).expect("a pipeline");
            gpu.messages()
        }),
        right("an opacity in the fourth component of positions", |gpu| {
            let mut request = splats();
            request.attributes[0].format = vk::Format::R32G32B32A32_SFLOAT;
            request.attributes[3].offset = 12;
            request.attributes[1].offset = 16;
            request.attributes[2].offset = 28;
            gpu.messages();
            request.create(gpu).expect("a pipeline");
            gpu.messages()
        }),
    ]
}

fn passes() -> Vec<Use> {
    vec![
        right("a render pass object", |gpu| {
            let target = Target::floats(gpu, SIZE);
            let object = PassObject::new(&target);
            let request = Graphics { subpass: Some((object.render_pass, 0)), ..splats() };
            let pipeline = request.create(gpu).expect("a pipeline");
            let buffer = Buffer::of(gpu, &SPLAT);
            gpu.messages();
            gpu.run(|commands| {
                commands.pass(&object, &Pass::zeros(), || {
                    commands.bind(&pipeline);
                    commands.vertices(&buffer);
                    commands.camera(&camera());
                    commands.draw(0..1);
                });
            });
            gpu.messages()
        }),
        right("a staging copy", |gpu| {
            let pipeline = splats().create(gpu).expect("a pipeline");
            let staging = Buffer::of(gpu, &SPLAT);
            let buffer = Buffer::within(gpu, staging.size, vk::MemoryPropertyFlags::DEVICE_LOCAL);
            let target = Target::floats(gpu, SIZE);
            gpu.messages();
            gpu.run(|commands| {
                let region = vk::BufferCopy::default().size(staging.size);
                let (device, raw) = commands.raw();
                // SAFETY: see the crate.
                unsafe { device.cmd_copy_buffer(raw, staging.raw, buffer.raw, &[region]) };
                commands.pass(&target, &Pass::zeros(), || {
                    commands.bind(&pipeline);
                    commands.vertices(&buffer);
                    commands.camera(&camera());
                    commands.draw(0..1);
                });
            });
            gpu.messages()
        }),
    ]
}
