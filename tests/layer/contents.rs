//! Mistakes in what buffers hold, which the layer looks at when a draw is submitted.

use ash::vk;
use gaurast::vk::{
    GaussianCameraDataGAURAST, GaussianCameraGAURAST, GaussianCameraSourceGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST as Flags,
};
use gaurast_testkit::{Bindings, Buffer, Commands, Gpu, Graphics, Message, Pass, Resource, Target};

use crate::stage::{
    COLOR, IDENTITY, Mistake, OPACITY, ROTATION, SCALE, SIZE, SPLAT, Splat, Stage, camera, drawing, drawn, instanced,
    mistake, splat, splats, with,
};

/// A draw of Gaussians that are wrong.
fn holds(
    name: &'static str,
    id: &'static str,
    request: fn() -> Graphics<'static>,
    gaussians: fn() -> Vec<Splat>,
) -> Mistake {
    mistake(name, id, move |stage| drawn(&stage.full, &request(), &gaussians()))
}

/// A draw through another camera.
fn seen(name: &'static str, id: &'static str, through: fn() -> GaussianCameraGAURAST<'static>) -> Mistake {
    mistake(name, id, move |stage| {
        drawing(&stage.full, &splats(), &[SPLAT], |commands| {
            commands.camera(&through());
            commands.draw(0..1);
        })
    })
}

/// Logarithms as a trained file holds them.
fn logarithms() -> Vec<Splat> {
    vec![splat(SCALE, [-2.3; 3]); 3]
}

/// The messages of a draw of a buffer's first Gaussians, before which `upload` records how they get there.
fn from_a_buffer(gpu: &Gpu, buffer: &Buffer, count: u32, upload: impl FnOnce(&Commands)) -> Vec<Message> {
    let pipeline = splats().create(gpu).expect("a pipeline");
    let target = Target::floats(gpu, SIZE);
    gpu.messages();
    gpu.run(|commands| {
        upload(commands);
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(buffer);
            commands.camera(&camera());
            commands.draw(0..count);
        });
    });
    gpu.messages()
}

/// The messages of a draw from memory that the host can't map, to which `upload` records how Gaussians get there.
fn from_the_device(gpu: &Gpu, upload: impl FnOnce(&Commands, vk::Buffer)) -> Vec<Message> {
    let size = 3 * size_of::<Splat>() as u64;
    let buffer = Buffer::within(gpu, size, vk::MemoryPropertyFlags::DEVICE_LOCAL);
    from_a_buffer(gpu, &buffer, 3, |commands| upload(commands, buffer.raw))
}

/// The messages of a draw whose camera comes from a uniform buffer.
fn through_a_buffer(gpu: &Gpu, cameras: &[u8], count: u32) -> Vec<Message> {
    let buffer = Buffer::of(gpu, cameras);
    let set = Bindings::new(gpu, &[Resource::Uniform(buffer.raw)]);
    let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
    let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source).camera_count(count)) };
    drawing(gpu, &request, &[SPLAT], |commands| {
        commands.bind_set(&set, &[]);
        commands.draw(0..1);
    })
}

/// A camera's bytes in a uniform buffer.
pub fn bytes(camera: &GaussianCameraGAURAST<'_>) -> Vec<u8> {
    GaussianCameraDataGAURAST::from(camera).to_bytes().to_vec()
}

pub fn mistakes() -> Vec<Mistake> {
    let mut all = gaussians();
    all.extend(places());
    all.extend(uploads());
    all.extend(cameras());
    all
}

fn gaussians() -> Vec<Mistake> {
    let finite = "GAURAST-Draw-not-finite";
    vec![
        holds("logarithms for scales", "GAURAST-Draw-negative-scale", splats, logarithms),
        holds("logits for opacities", "GAURAST-Draw-opacity-outside", splats, || {
            vec![splat(OPACITY, [4.2]), splat(OPACITY, [-1.5]), SPLAT]
        }),
        holds("opacities of 0", "GAURAST-Draw-opacity-floor", splats, || vec![splat(OPACITY, [0.0]); 3]),
        holds("rotations of zeros", "GAURAST-Draw-zero-quaternion", splats, || vec![splat(ROTATION, [0.0; 4]); 3]),
        holds("rotations as x, y, z, w", "GAURAST-Draw-quaternion-order", splats, || {
            vec![splat(ROTATION, [0.0, 0.0, 0.0, 1.0]); 3]
        }),
        holds("rotations as x, y, z, w, of many directions", "GAURAST-Draw-quaternion-order", splats, || {
            let turned = |index: u8| {
                let angle = f32::from(index) * 0.05;
                splat(ROTATION, [angle.sin() * 0.5, 0.1, -0.2, angle.cos()])
            };
            (0..20).map(turned).collect()
        }),
        holds("a position that is NaN", finite, splats, || vec![SPLAT, splat(0, [f32::NAN])]),
        holds("an infinite coefficient", finite, splats, || vec![SPLAT, splat(12, [f32::INFINITY])]),
        holds(
            "scales with LOG_SCALE",
            "GAURAST-Draw-scale-twice",
            || with(|s| s.flags(Flags::LOG_SCALE)),
            || vec![SPLAT; 20],
        ),
        holds(
            "opacities with LOGIT_OPACITY",
            "GAURAST-Draw-opacity-twice",
            || with(|s| s.flags(Flags::LOGIT_OPACITY)),
            || vec![SPLAT; 20],
        ),
        holds("colours from 0 to 1 for coefficients", "GAURAST-Draw-colors", splats, || {
            (0..32u8).map(|index| splat(COLOR, [f32::from(index) / 31.0, 0.4, 0.6])).collect()
        }),
        holds("colours from 0 to 255 for coefficients", "GAURAST-Draw-colors", splats, || {
            vec![splat(COLOR, [220.0, 64.0, 12.0]); 3]
        }),
        holds("scales of 0", "GAURAST-Draw-zero-scale", splats, || vec![splat(SCALE, [0.0; 3]); 16]),
        holds("variances for standard deviations", "GAURAST-Draw-variances", splats, || grid(0.02 * 0.02)),
        mistake("instances whose opacity's factor is 0", "GAURAST-Draw-model-opacity", |stage| {
            let mut model = IDENTITY;
            model[12] = 0.0;
            let models = Buffer::of(&stage.full, &[model; 2]);
            drawing(&stage.full, &instanced(), &[SPLAT], |commands| {
                commands.camera(&camera());
                commands.vertex_buffer(1, &models, 0);
                commands.draw_instances(0..1, 0..2);
            })
        }),
    ]
}

/// A sheet of Gaussians 0.02 apart, of another size.
pub fn grid(scale: f32) -> Vec<Splat> {
    let at = |index: u16| {
        let [x, y] = [index % 24, index / 24].map(|place| (f32::from(place) - 11.5) * 0.02);
        let mut splat = splat(SCALE, [scale; 3]);
        splat[..3].copy_from_slice(&[x, y, 5.0]);
        splat
    };
    (0..24 * 24).map(at).collect()
}

/// The messages of a draw through a camera, of Gaussians from 4 to 6 in front of the origin.
fn row(stage: &Stage, through: &GaussianCameraGAURAST<'static>) -> Vec<Message> {
    let at = |index: u8| splat(0, [0.0, 0.0, 4.0 + f32::from(index) / 10.0]);
    let row: Vec<_> = (0..20).map(at).collect();
    drawing(&stage.full, &splats(), &row, |commands| {
        commands.camera(through);
        commands.draw(0..20);
    })
}

/// A camera that looks along another axis.
fn along_x() -> GaussianCameraGAURAST<'static> {
    // Right is +y, down is +z, and forward is +x.
    camera().rotation([0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
}

fn places() -> Vec<Mistake> {
    let behind = "GAURAST-Draw-behind-camera";
    vec![
        mistake("a transposed rotation", "GAURAST-Draw-transposed-rotation", |stage| {
            let right = along_x();
            let [a, b, c, d, e, f, g, h, i] = right.rotation;
            let ahead: Vec<_> = (0..3).map(|_| splat(0, [5.0, 0.0, 0.0])).collect();
            drawing(&stage.full, &splats(), &ahead, |commands| {
                commands.camera(&right.rotation([a, d, g, b, e, h, c, f, i]));
                commands.draw(0..3);
            })
        }),
        mistake("a near plane that is too far", "GAURAST-Draw-near-plane", |stage| {
            row(stage, &camera().near_plane(5.55))
        }),
        mistake("intrinsics of another resolution", "GAURAST-Draw-picture-size", |stage| {
            row(stage, &camera().focal_length([200.0; 2]).principal_point([64.0, 48.0]))
        }),
        seen("a camera that looks along -z", behind, || {
            camera().rotation([1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0])
        }),
        seen("a camera that stands behind", behind, || camera().eye([0.0, 0.0, 9.0])),
        seen("a far plane that is too near", "GAURAST-Draw-beyond-camera", || camera().far_plane(1.0)),
        seen("a camera that looks aside", "GAURAST-Draw-outside-picture", || {
            let (sin, cos) = 1.2f32.sin_cos();
            camera().rotation([cos, 0.0, -sin, 0.0, 1.0, 0.0, sin, 0.0, cos])
        }),
    ]
}

fn uploads() -> Vec<Mistake> {
    let id = "GAURAST-Draw-negative-scale";
    vec![
        mistake("logarithms that were copied from a staging buffer", id, |stage| {
            let staging = Buffer::of(&stage.full, logarithms().as_flattened());
            from_the_device(&stage.full, |commands, buffer| {
                let region = vk::BufferCopy::default().size(staging.size);
                // SAFETY: see the crate.
                unsafe {
                    (commands.device()).cmd_copy_buffer(commands.raw, staging.raw, buffer, &[region]);
                }
            })
        }),
        mistake("logarithms that a command wrote", id, |stage| {
            from_the_device(&stage.full, |commands, buffer| {
                let gaussians = logarithms();
                let bytes = bytemuck::cast_slice(gaussians.as_flattened());
                // SAFETY: see the crate.
                unsafe {
                    commands.device().cmd_update_buffer(commands.raw, buffer, 0, bytes);
                };
            })
        }),
        mistake("a buffer that was only cleared", "GAURAST-Draw-zero-quaternion", |stage| {
            from_the_device(&stage.full, |commands, buffer| {
                let (device, raw) = commands.raw();
                // SAFETY: see the crate.
                unsafe { device.cmd_fill_buffer(raw, buffer, 0, vk::WHOLE_SIZE, 0) };
            })
        }),
        mistake("logarithms of an indirect draw", id, |stage| {
            let draws = Buffer::of(&stage.full, &[3u32, 1, 0, 0]);
            drawing(&stage.full, &splats(), &logarithms(), |commands| {
                commands.camera(&camera());
                commands.draw_indirect(&draws, 1);
            })
        }),
        mistake("logarithms in a buffer that shaders may write", id, |stage| {
            let gpu = &stage.full;
            let buffer = Buffer::of(gpu, &splat(SCALE, [-1.0; 3]));
            let _set = Bindings::new(gpu, &[Resource::Storage(buffer.raw)]);
            from_a_buffer(gpu, &buffer, 1, |_| {})
        }),
        mistake("logarithms in memory that stays mapped", id, |stage| {
            let gpu = &stage.full;
            let buffer = Buffer::of(gpu, logarithms().as_flattened());
            let device = gpu.device();
            let flags = vk::MemoryMapFlags::empty();
            // SAFETY: see the crate.
            unsafe { device.map_memory(buffer.memory, 0, vk::WHOLE_SIZE, flags) }.expect("mapped");
            let messages = from_a_buffer(gpu, &buffer, 3, |_| {});
            // SAFETY: see the crate.
            unsafe { device.unmap_memory(buffer.memory) };
            messages
        }),
    ]
}

fn cameras() -> Vec<Mistake> {
    let binding = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025";
    vec![
        mistake("a uniform buffer that is too short for its cameras", binding, |stage| {
            through_a_buffer(&stage.full, &bytes(&camera()), 2)
        }),
        mistake("no set with the camera's uniform buffer", binding, |stage| {
            let buffer = Buffer::new(&stage.full, 128);
            let set = Bindings::new(&stage.full, &[Resource::Uniform(buffer.raw)]);
            let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
            let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source)) };
            drawing(&stage.full, &request, &[SPLAT], |commands| {
                commands.draw(0..1);
            })
        }),
        mistake(
            "a camera in a uniform buffer whose far plane is 0",
            "VUID-VkGaussianCameraGAURAST-farPlane-90070",
            |stage| through_a_buffer(&stage.full, &bytes(&camera().far_plane(0.0)), 1),
        ),
        mistake("a camera in a uniform buffer whose rotation's rows are packed", "GAURAST-Camera-rotation", |stage| {
            // Rows of three floats where four are.
            let mut wrong = bytes(&camera());
            let rows: Vec<u8> = (camera().rotation.iter()).flat_map(|value| value.to_le_bytes()).collect();
            wrong[32..32 + rows.len()].copy_from_slice(&rows);
            wrong[32 + rows.len()..80].fill(0);
            through_a_buffer(&stage.full, &wrong, 1)
        }),
        mistake("a camera in a uniform buffer whose eye is floats", "GAURAST-Camera-eye", |stage| {
            let mut wrong = bytes(&camera());
            let eye: Vec<u8> = [0.5f32, 0.25, -1.0].iter().flat_map(|value| value.to_le_bytes()).collect();
            wrong[..12].copy_from_slice(&eye);
            wrong[12..24].fill(0);
            through_a_buffer(&stage.full, &wrong, 1)
        }),
        mistake("a camera by a command that the pipeline does not take", "GAURAST-Draw-camera-source", |stage| {
            let buffer = Buffer::of(&stage.full, &bytes(&camera()));
            let set = Bindings::new(&stage.full, &[Resource::Uniform(buffer.raw)]);
            let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
            let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source)) };
            drawing(&stage.full, &request, &[SPLAT], |commands| {
                commands.bind_set(&set, &[]);
                commands.camera(&camera());
                commands.draw(0..1);
            })
        }),
    ]
}
