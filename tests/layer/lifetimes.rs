//! Objects that are destroyed between recording and submission, which only the extension knows to be used.

use gaurast::vk::{GaussianCameraSourceGAURAST, PipelineGaussianStateCreateFlagsGAURAST as Flags};
use gaurast_testkit::{Bindings, Buffer, Commands, Gpu, Graphics, Message, Pass, Recorded, Resource, Target};

use crate::contents::bytes;
use crate::decoding;
use crate::harmonics::Addressed;
use crate::stage::{Mistake, SIZE, SPLAT, camera, gaussian, mistake, with};

/// A draw that is recorded, with all that it needs until it is submitted.
struct Held {
    recorded: Recorded,
    _target: Target,
    _vertices: Buffer,
}

fn record(gpu: &Gpu, request: &Graphics<'static>, bind: impl FnOnce(&Commands)) -> Held {
    // A pipeline that is destroyed before the submission would be Vulkan's own matter: this one lives as long as the device.
    let pipeline = Box::leak(Box::new(request.create(gpu).expect("a pipeline")));
    let target = Target::floats(gpu, SIZE);
    let vertices = Buffer::of(gpu, &SPLAT);
    let recorded = gpu.record(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(pipeline);
            commands.vertices(&vertices);
            bind(commands);
            commands.draw(0..1);
        });
    });
    gpu.messages();
    Held { recorded, _target: target, _vertices: vertices }
}

impl Held {
    fn submit(&self, gpu: &Gpu) -> Vec<Message> {
        // The driver may lose the device or leave the draw out.
        let _ = self.recorded.try_submit();
        gpu.messages()
    }
}

/// The messages of a draw whose camera's buffer or set `destroy` destroys before it is submitted.
fn without(gpu: &Gpu, destroy: impl FnOnce(Buffer, Bindings) -> (Option<Buffer>, Option<Bindings>)) -> Vec<Message> {
    let buffer = Buffer::of(gpu, &bytes(&camera()));
    let set = Bindings::new(gpu, &[Resource::Uniform(buffer.raw)]);
    let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
    let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source)) };
    let held = record(gpu, &request, |commands| commands.bind_set(&set, &[]));
    let _kept = destroy(buffer, set);
    held.submit(gpu)
}

pub fn mistakes() -> Vec<Mistake> {
    let binding = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025";
    vec![
        mistake("the camera's buffer is destroyed before the submission", binding, |stage| {
            without(&stage.full, |_buffer, set| (None, Some(set)))
        }),
        mistake("the camera's descriptor pool is destroyed before the submission", binding, |stage| {
            without(&stage.full, |buffer, _set| (Some(buffer), None))
        }),
        mistake(
            "the buffer of harmonics is destroyed before the submission",
            "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-deviceAddress-90016",
            |stage| {
                let gpu = &stage.full;
                let buffer = Addressed::new(gpu, 256);
                let request = with(|s| s.flags(Flags::SPHERICAL_HARMONICS_BUFFER));
                let held = record(gpu, &request, |commands| {
                    commands.camera(&camera());
                    // SAFETY: see the crate.
                    unsafe { gaussian(gpu).cmd_bind_gaussian_spherical_harmonics(commands.raw, &buffer.bound(256)) };
                });
                drop(buffer);
                held.submit(gpu)
            },
        ),
        mistake(
            "a buffer of tables is destroyed before the submission",
            "VUID-VkGaussianDecodingTableGAURAST-deviceAddress-90099",
            |stage| {
                let gpu = &stage.full;
                let buffer = Addressed::new(gpu, 256);
                let held = record(gpu, &decoding::words(), |commands| {
                    commands.camera(&camera());
                    decoding::bind(gpu, commands.raw, &decoding::tables(&buffer));
                });
                drop(buffer);
                held.submit(gpu)
            },
        ),
    ]
}
