//! Sorted sets of several draws: from several buffers, by every draw command, one after another.

use ash::vk;
use gaurast::vk::GaussianOrderGAURAST as Order;
use gaurast_testkit::{Buffer, Commands, GaussianScene, bind_instances};

use super::chapter::Chapter;
use super::input::{placed, placements, vertices};
use super::scenes::{dense, layered, part};
use crate::draw::{Call, Draw};
use crate::program::Program;
use crate::stage::{Stage, instance_buffer};

/// A set of all Gaussians of a scene, however it is drawn.
fn whole(seed: u64) -> Draw {
    Draw { merged: true, ..Draw::new(dense(seed, 0)) }
}

/// The Gaussians of a scene in several buffers of equally many.
fn split(stage: &Stage<'_>, parts: usize) -> Vec<GaussianScene> {
    let each = stage.draw.scene.positions.len() / parts;
    (0..parts).map(|at| stage.other(&part(&stage.draw.scene, at * each..(at + 1) * each))).collect()
}

/// Records draws of all buffers.
fn draw_all(commands: &Commands, parts: &[GaussianScene]) {
    for part in parts {
        part.bind_buffers(commands);
        commands.draw(0..part.count);
    }
}

pub(super) fn sets(chapter: &mut Chapter<'_>) {
    for (name, order) in
        [("view_depth", Order::VIEW_DEPTH), ("primitive", Order::PRIMITIVE), ("per_pixel", Order::PER_PIXEL)]
    {
        for parts in [2, 5, 50] {
            chapter.program(format!("buffers_{parts}.{name}"), move || {
                // Ties are broken by the order of the draws.
                let draw = Draw { merged: true, ..Draw::new(layered(411, 0)) }.in_state(|state| state.order(order));
                Program::on_stage(draw, move |stage| {
                    let parts = split(stage, parts);
                    stage.run(|commands| commands.gaussian_set(|| draw_all(commands, &parts)));
                })
            });
        }
    }
    commands(chapter);
    buffers(chapter);
    several(chapter);
    between(chapter);
    super::harmonics_buffer::in_a_set(chapter);
    super::decoding::in_a_set(chapter);
}

/// Sets whose draws are different commands.
fn commands(chapter: &mut Chapter<'_>) {
    chapter.program("first_draw_of_nothing", || {
        Program::on_stage(whole(412), |stage| {
            let parts = split(stage, 2);
            stage.run(|commands| {
                commands.gaussian_set(|| {
                    commands.draw(0..0);
                    draw_all(commands, &parts);
                    commands.draw(0..0);
                });
            });
        })
    });
    chapter.program("indirect", || {
        Program::on_stage(whole(413), |stage| {
            let parameters = Buffer::of(stage.gpu, &[[200, 1, 50, 0], [250, 1, 250, 0]]);
            stage.run(|commands| {
                commands.gaussian_set(|| {
                    commands.draw(0..50);
                    commands.draw_indirect(&parameters, 2);
                });
            });
        })
        .needing("multiDrawIndirect")
    });
    chapter.program("indexed", || {
        Program::on_stage(whole(414), |stage| {
            let [even, odd] = [0, 1].map(|first| (first..500).step_by(2).collect::<Vec<u32>>());
            let [even, odd] = [even, odd].map(|indices| Buffer::of(stage.gpu, &indices));
            stage.run(|commands| {
                commands.gaussian_set(|| {
                    for indices in [&even, &odd] {
                        commands.indices(indices, 0, vk::IndexType::UINT32);
                        commands.draw_indexed(0..250, 0);
                    }
                });
            });
        })
    });
    chapter.program("every_command", || {
        Program::on_stage(whole(415), |stage| {
            let indices = Buffer::of(stage.gpu, &(0..500).rev().collect::<Vec<u32>>());
            let indirect = Buffer::of(stage.gpu, &[100, 1, 100, 0]);
            let indexed = Buffer::of(stage.gpu, &[100, 1, 200, 0, 0]);
            stage.run(|commands| {
                let (device, raw) = commands.raw();
                commands.gaussian_set(|| {
                    commands.indices(&indices, 0, vk::IndexType::UINT32);
                    commands.draw(0..100);
                    commands.draw_indirect(&indirect, 1);
                    // SAFETY: the buffer has the parameters of a draw.
                    unsafe { device.cmd_draw_indexed_indirect(raw, indexed.raw, 0, 1, 0) };
                    commands.draw_indexed(0..200, 0);
                });
            });
        })
    });
    chapter.program("pipeline_bound_again", || {
        Program::pass(whole(416), |stage, commands| {
            commands.gaussian_set(|| {
                commands.draw(0..250);
                commands.bind(&stage.pipeline);
                commands.draw(250..500);
            });
        })
    });
}

/// Sets whose draws read from different places.
fn buffers(chapter: &mut Chapter<'_>) {
    chapter.program("offsets", || {
        Program::on_stage(whole(417), |stage| {
            let scene = &stage.draw.scene;
            let buffers = [
                (Buffer::of(stage.gpu, &scene.positions), 12),
                (Buffer::of(stage.gpu, &scene.scales), 12),
                (Buffer::of(stage.gpu, &scene.rotations), 16),
                (Buffer::of(stage.gpu, &scene.opacities), 4),
                (Buffer::of(stage.gpu, &scene.sh), 12),
            ];
            stage.run(|commands| {
                commands.gaussian_set(|| {
                    for first in [0, 100, 400] {
                        for (binding, (buffer, stride)) in (0..).zip(&buffers) {
                            commands.vertex_buffer(binding, buffer, first * stride);
                        }
                        commands.draw(0..if first == 100 { 300 } else { 100 });
                    }
                });
            });
        })
    });
    // Only positions are others.
    chapter.program("positions", || {
        let mut scene = dense(418, 0);
        for at in 250..500 {
            let from = at - 250;
            (scene.scales[at], scene.rotations[at]) = (scene.scales[from], scene.rotations[from]);
            (scene.opacities[at], scene.sh[at]) = (scene.opacities[from], scene.sh[from]);
        }
        Program::on_stage(Draw { merged: true, ..Draw::new(scene) }, |stage| {
            let later = Buffer::of(stage.gpu, &stage.draw.scene.positions[250..]);
            stage.run(|commands| {
                commands.gaussian_set(|| {
                    commands.draw(0..250);
                    commands.vertex_buffer(0, &later, 0);
                    commands.draw(0..250);
                });
            });
        })
    });
    // Each draw has a model matrix of its own.
    chapter.program("instances", || {
        let draw = Draw { merged: true, ..placed(vk::VertexInputRate::INSTANCE, placements(), 0) };
        Program::on_stage(draw, |stage| {
            let (_, all) = stage.draw.instances.as_ref().expect("instances");
            let buffers: Vec<Buffer> = all.iter().map(|one| instance_buffer(stage.gpu, &[*one])).collect();
            stage.run(|commands| {
                commands.gaussian_set(|| {
                    for buffer in &buffers {
                        bind_instances(commands, buffer);
                        commands.draw(0..90);
                    }
                });
            });
        })
    });
}

/// Several sets in a pass, and draws outside of them.
fn several(chapter: &mut Chapter<'_>) {
    let thirds = || Draw {
        merged: true,
        calls: vec![vertices(0, 100), vertices(100, 100), Call::EndSet, vertices(200, 150), vertices(350, 150)],
        ..Draw::new(dense(419, 0))
    };
    chapter.program("two", move || {
        Program::pass(thirds(), |_, commands| {
            commands.gaussian_set(|| {
                commands.draw(0..100);
                commands.draw(100..200);
            });
            commands.gaussian_set(|| {
                commands.draw(200..350);
                commands.draw(350..500);
            });
        })
    });
    chapter.program("empty_between", move || {
        Program::pass(thirds(), |_, commands| {
            commands.gaussian_set(|| commands.draw(0..200));
            commands.gaussian_set(|| {});
            commands.gaussian_set(|| commands.draw(200..500));
        })
    });
    chapter.program("draws_before_and_after", || {
        let draw = Draw {
            calls: vec![vertices(0, 100), vertices(100, 300), vertices(400, 50), vertices(450, 50)],
            ..Draw::new(dense(420, 0))
        };
        let program = Program::pass(draw, |_, commands| {
            commands.draw(0..100);
            commands.gaussian_set(|| {
                commands.draw(100..250);
                commands.draw(250..400);
            });
            commands.draw(400..450);
            commands.draw(450..500);
        });
        program.needing("mergedDraws")
    });
    chapter.program("two_passes", move || {
        Program::on_stage(thirds(), |stage| {
            stage.run(|commands| commands.gaussian_set(|| commands.draw(0..200)));
            stage.run(|commands| {
                commands.gaussian_set(|| {
                    commands.draw(200..350);
                    commands.draw(350..500);
                });
            });
        })
    });
}

/// Other commands between the draws of a set.
fn between(chapter: &mut Chapter<'_>) {
    // The set is drawn where it ends: over what is cleared within it.
    chapter.program("cleared_within", || {
        let behind = [0.25, 0.5, 0.75, 1.0];
        Program::pass(Draw { behind, ..whole(421) }, move |stage, commands| {
            commands.gaussian_set(|| {
                commands.draw(0..250);
                let clear = vk::ClearAttachment::default()
                    .aspect_mask(vk::ImageAspectFlags::COLOR)
                    .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: behind } });
                let [width, height] = stage.draw.size;
                let whole = vk::Rect2D::default().extent(vk::Extent2D { width, height });
                let rectangle = vk::ClearRect::default().rect(whole).layer_count(1);
                let (device, raw) = commands.raw();
                // SAFETY: the rectangle is the attachment.
                unsafe { device.cmd_clear_attachments(raw, &[clear], &[rectangle]) };
                commands.draw(250..500);
            });
        })
    });
    chapter.program("viewport_and_scissor_between", || {
        Program::pass(whole(422), |stage, commands| {
            commands.gaussian_set(|| {
                commands.draw(0..250);
                commands.viewport([3.0, 4.0, 20.0, 30.0], [0.0, 0.5]);
                commands.scissor([5, 5], [9, 9]);
                stage.place(commands);
                commands.draw(250..500);
            });
        })
    });
    chapter.program("camera_between", || {
        Program::pass(whole(423), |stage, commands| {
            commands.gaussian_set(|| {
                commands.draw(0..250);
                commands.camera(&stage.draw.camera.eye([5.0, 0.0, 0.0]));
                commands.camera(&stage.draw.camera);
                commands.draw(250..500);
            });
        })
    });
}
