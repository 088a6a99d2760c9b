//! Who writes what a draw reads, and when: the host, copies, fills, updates and dispatches, in one command buffer or
//! between submissions.

use ash::vk;
use gaurast::vk::{GaussianCameraDataGAURAST, GaussianCameraSourceGAURAST};
use gaurast_testkit::shader::words;
use gaurast_testkit::{Bindings, Buffer, Commands, Gpu, Graphics, Kernel, Pass, Pipeline, Resource};

use super::chapter::Chapter;
use super::input::vertices;
use super::passes::submit;
use super::scenes::{dense, front};
use crate::draw::{Camera, Draw};
use crate::program::Program;
use crate::stage::Stage;

/// Another camera than the front one.
fn aside() -> Camera {
    front().eye([0.6, -0.2, -0.5]).focal_length([70.0, 75.0])
}

/// A dispatch that copies words from a buffer to another.
struct Copying {
    kernel: Kernel,
    set: Bindings,
    groups: u32,
}

impl Copying {
    fn new(gpu: &Gpu, from: &Buffer, to: &Buffer) -> Self {
        let set = Bindings::new(gpu, &[Resource::Storage(from.raw), Resource::Storage(to.raw)]);
        let words = words(include_bytes!("../../shaders/copy.comp.spv"));
        Self { kernel: Kernel::over(gpu, &words, &[set.layout]), set, groups: (from.size / 4).div_ceil(64) as u32 }
    }

    fn record(&self, commands: &Commands) {
        self.kernel.dispatch(commands, &[self.set.set], &[], [self.groups, 1, 1]);
    }
}

/// Copies all of a buffer.
fn copy(commands: &Commands, from: &Buffer, to: &Buffer) {
    let (device, raw) = commands.raw();
    // SAFETY: the buffers are equally large.
    unsafe { device.cmd_copy_buffer(raw, from.raw, to.raw, &[vk::BufferCopy::default().size(from.size)]) };
}

/// A way of writing a buffer in a command buffer.
type Write = fn(&Commands, &Buffer, &Buffer, &Copying);

const WRITES: [(&str, Write); 3] = [
    ("copied", |commands, from, to, _| copy(commands, from, to)),
    ("dispatched", |commands, _, _, copying| copying.record(commands)),
    ("updated", |commands, from, to, _| {
        let bytes = from.read();
        let (device, raw) = commands.raw();
        // SAFETY: the buffer has as many bytes.
        unsafe { device.cmd_update_buffer(raw, to.raw, 0, &bytes) };
    }),
];

pub(super) fn updates(chapter: &mut Chapter<'_>) {
    for (name, write) in WRITES {
        chapter.program(format!("attributes.{name}"), move || attributes(write));
        chapter.program(format!("camera.{name}"), move || camera(write));
        chapter.program(format!("parameters.{name}"), move || parameters(write));
        chapter.program(format!("twice.{name}"), move || twice(write));
    }
    chapter.program("attributes.filled", || {
        let mut scene = dense(511, 0);
        scene.opacities.fill(0.5);
        Program::on_stage(Draw::new(scene), |stage| {
            let opacities = Buffer::of(stage.gpu, &[0.05_f32; 500]);
            stage.gpu.run(|commands| {
                let (device, raw) = commands.raw();
                // SAFETY: the buffer is whole.
                unsafe { device.cmd_fill_buffer(raw, opacities.raw, 0, vk::WHOLE_SIZE, 0.5_f32.to_bits()) };
                stage.pass(commands, || {
                    commands.vertex_buffer(3, &opacities, 0);
                    commands.draw(0..500);
                });
            });
        })
    });
    host(chapter);
    submissions(chapter);
}

/// Positions are written in the command buffer that draws them.
fn attributes(write: Write) -> Program {
    Program::on_stage(Draw::new(dense(512, 0)), move |stage| {
        let from = Buffer::of(stage.gpu, &stage.draw.scene.positions);
        let to = Buffer::of(stage.gpu, &dense(513, 0).positions);
        let copying = Copying::new(stage.gpu, &from, &to);
        stage.gpu.run(|commands| {
            write(commands, &from, &to, &copying);
            stage.pass(commands, || {
                commands.vertex_buffer(0, &to, 0);
                commands.draw(0..500);
            });
        });
    })
}

/// Cameras in a uniform buffer, and a pipeline that sees through them.
struct CameraBuffer {
    buffer: Buffer,
    set: Bindings,
    pipeline: Pipeline,
}

impl CameraBuffer {
    fn new(stage: &Stage<'_>, camera: &Camera) -> Self {
        let buffer = Buffer::of(stage.gpu, &GaussianCameraDataGAURAST::from(camera).to_bytes());
        let set = Bindings::new(stage.gpu, &[Resource::Uniform(buffer.raw)]);
        let pipeline = stage.pipeline(stage.draw, &|graphics: &mut Graphics<'_>| {
            let state = graphics.gaussian.expect("a Gaussian state");
            graphics.gaussian = Some(state.camera_source(GaussianCameraSourceGAURAST::UNIFORM_BUFFER));
            graphics.set_layouts = vec![set.layout];
        });
        Self { buffer, set, pipeline }
    }

    /// Binds everything of a stage, and this camera.
    fn bind(&self, stage: &Stage<'_>, commands: &Commands) {
        stage.bind_with(commands, &self.pipeline);
        commands.bind_set(&self.set, &[]);
    }

    fn write(&self, camera: &Camera) {
        self.buffer.write(&GaussianCameraDataGAURAST::from(camera).to_bytes());
    }
}

/// A camera is written in the command buffer whose draws see through it.
fn camera(write: Write) -> Program {
    let program = Program::on_stage(Draw::new(dense(514, 1)), move |stage| {
        let own = CameraBuffer::new(stage, &aside());
        let from = Buffer::of(stage.gpu, &GaussianCameraDataGAURAST::from(&stage.draw.camera).to_bytes());
        let copying = Copying::new(stage.gpu, &from, &own.buffer);
        stage.gpu.run(|commands| {
            write(commands, &from, &own.buffer, &copying);
            stage.pass(commands, || {
                own.bind(stage, commands);
                commands.draw(0..500);
            });
        });
    });
    program.needing("uniformBufferCamera")
}

/// The parameters of an indirect draw are written in its command buffer.
fn parameters(write: Write) -> Program {
    let draw = Draw { calls: vec![vertices(100, 300)], ..Draw::new(dense(515, 0)) };
    Program::on_stage(draw, move |stage| {
        let from = Buffer::of(stage.gpu, &[300, 1, 100, 0]);
        let to = Buffer::of(stage.gpu, &[20, 1, 7, 0]);
        let copying = Copying::new(stage.gpu, &from, &to);
        stage.gpu.run(|commands| {
            write(commands, &from, &to, &copying);
            stage.pass(commands, || commands.draw_indirect(&to, 1));
        });
    })
}

/// Positions are written, drawn, written again and drawn again in one command buffer.
fn twice(write: Write) -> Program {
    let scenes = [dense(516, 0), dense(517, 0)];
    let mut draw = Draw { calls: vec![vertices(0, 500), vertices(500, 500)], ..Draw::new(scenes[0].clone()) };
    let [first, second] = &scenes;
    for at in 0..500 {
        draw.scene.positions.push(second.positions[at]);
        draw.scene.scales.push(first.scales[at]);
        draw.scene.rotations.push(first.rotations[at]);
        draw.scene.opacities.push(first.opacities[at]);
        draw.scene.sh.push(first.sh[at]);
    }
    Program::on_stage(draw, move |stage| {
        let sources = scenes.each_ref().map(|scene| Buffer::of(stage.gpu, &scene.positions));
        let to = Buffer::of(stage.gpu, &dense(518, 0).positions);
        let copyings = sources.each_ref().map(|from| Copying::new(stage.gpu, from, &to));
        stage.gpu.run(|commands| {
            for (from, copying) in sources.iter().zip(&copyings) {
                write(commands, from, &to, copying);
                stage.pass(commands, || {
                    commands.vertex_buffer(0, &to, 0);
                    commands.draw(0..500);
                });
            }
        });
    })
}

/// What the host writes after commands are recorded, and before they are submitted.
fn host(chapter: &mut Chapter<'_>) {
    chapter.program("attributes.host_after_recording", || {
        Program::on_stage(Draw::new(dense(519, 0)), |stage| {
            let positions = Buffer::of(stage.gpu, &dense(520, 0).positions);
            let recorded = stage.gpu.record(|commands| {
                stage.pass(commands, || {
                    commands.vertex_buffer(0, &positions, 0);
                    commands.draw(0..500);
                });
            });
            positions.write(&stage.draw.scene.positions);
            recorded.submit();
        })
    });
    chapter.program("camera.host_after_recording", || {
        let program = Program::on_stage(Draw::new(dense(521, 1)), |stage| {
            let own = CameraBuffer::new(stage, &aside());
            let recorded = stage.gpu.record(|commands| {
                stage.pass(commands, || {
                    own.bind(stage, commands);
                    commands.draw(0..500);
                });
            });
            own.write(&stage.draw.camera);
            recorded.submit();
        });
        program.needing("uniformBufferCamera")
    });
    chapter.program("parameters.host_after_recording", || {
        let draw = Draw { calls: vec![vertices(50, 250)], ..Draw::new(dense(522, 0)) };
        Program::on_stage(draw, |stage| {
            let parameters = Buffer::of(stage.gpu, &[10, 1, 0, 0]);
            let recorded = stage.gpu.record(|commands| stage.pass(commands, || commands.draw_indirect(&parameters, 1)));
            parameters.write(&[250, 1, 50, 0]);
            recorded.submit();
        })
    });
}

/// One command buffer several times, and several command buffers.
fn submissions(chapter: &mut Chapter<'_>) {
    chapter.program("submitted_twice", || {
        let draw = Draw { behind: [0.3, 0.2, 0.1, 0.5], ..Draw::new(dense(523, 1)) };
        let pictures = [front(), aside()].map(|camera| draw.clone().seen_by(camera)).to_vec();
        let program = Program::pictures(pictures, move |gpu| {
            let stage = Stage::changed(gpu, &draw, &|_| {});
            let own = CameraBuffer::new(&stage, &front());
            let recorded = gpu.record(|commands| {
                commands.pass(&stage.target, &Pass::clear(draw.behind), || {
                    own.bind(&stage, commands);
                    commands.draw(0..500);
                });
            });
            recorded.submit();
            let first = stage.picture();
            own.write(&aside());
            recorded.submit();
            Ok(vec![first, stage.picture()])
        });
        program.needing("uniformBufferCamera")
    });
    chapter.program("frames_in_flight", || {
        let draw = Draw::new(dense(524, 1));
        let cameras = [front(), aside()];
        let pictures = cameras.map(|camera| draw.clone().seen_by(camera)).to_vec();
        let program = Program::pictures(pictures, move |gpu| {
            let stages = [(); 2].map(|()| Stage::changed(gpu, &draw, &|_| {}));
            let own = stages.each_ref().map(|stage| CameraBuffer::new(stage, &front().eye([9.0; 3])));
            let frame = |at: usize| {
                gpu.record(|commands| {
                    let stage = &stages[at];
                    stage.pass(commands, || {
                        own[at].bind(stage, commands);
                        commands.draw(0..500);
                    });
                })
            };
            let frames = [frame(0), frame(1)];
            let device = gpu.device();
            // The second frame is written and submitted while the first may be drawn.
            // SAFETY: no other thread submits, and each fence is waited for before it is destroyed.
            unsafe {
                let fences = [(); 2].map(|()| device.create_fence(&vk::FenceCreateInfo::default(), None));
                let fences = fences.map(|fence| fence.expect("a fence"));
                for at in 0..2 {
                    own[at].write(&cameras[at]);
                    let buffers = [frames[at].raw];
                    let submits = [vk::SubmitInfo::default().command_buffers(&buffers)];
                    device.queue_submit(gpu.queue(), &submits, fences[at]).expect("it is submitted");
                }
                device.wait_for_fences(&fences, true, u64::MAX).expect("both frames end");
                for fence in fences {
                    device.destroy_fence(fence, None);
                }
            }
            Ok(stages.iter().map(Stage::picture).collect())
        });
        program.needing("uniformBufferCamera")
    });
    let halves = |seed| Draw { calls: vec![vertices(0, 250), vertices(250, 250)], ..Draw::new(dense(seed, 0)) };
    chapter.program("two_command_buffers", move || {
        Program::on_stage(halves(525), |stage| {
            let halves = both_halves(stage);
            submit(stage.gpu, &halves.each_ref().map(|recorded| recorded.raw));
        })
    });
    chapter.program("two_batches", move || {
        Program::on_stage(halves(526), |stage| {
            let halves = both_halves(stage);
            let buffers = halves.each_ref().map(|recorded| [recorded.raw]);
            let submits = buffers.each_ref().map(|own| vk::SubmitInfo::default().command_buffers(own));
            // SAFETY: no other thread submits.
            unsafe {
                let (device, queue) = (stage.gpu.device(), stage.gpu.queue());
                device.queue_submit(queue, &submits, vk::Fence::null()).expect("it is submitted");
                device.queue_wait_idle(queue).expect("it finishes");
            }
        })
    });
}

/// A command buffer for each half of the Gaussians.
fn both_halves(stage: &Stage<'_>) -> [gaurast_testkit::Recorded; 2] {
    [0..250, 250..500].map(|range| stage.gpu.record(|commands| stage.pass(commands, || commands.draw(range))))
}
