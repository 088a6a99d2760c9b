//! Mistakes in sorted sets of several draws.

use ash::vk;
use gaurast::vk::DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST;
use gaurast_testkit::{Commands, Gpu, Message, Pass, Target};

use crate::stage::{Mistake, SIZE, SPLAT, camera, drawing, gaussian, mistake, recording, splats};

fn begin(commands: &Commands) {
    // SAFETY: see the crate.
    unsafe { gaussian(commands.gpu()).cmd_begin_gaussian_set(commands.raw) };
}

fn end(commands: &Commands) {
    // SAFETY: see the crate.
    unsafe { gaussian(commands.gpu()).cmd_end_gaussian_set(commands.raw) };
}

/// The messages of commands within a pass.
fn within(gpu: &Gpu, record: impl FnOnce(&Commands)) -> Vec<Message> {
    let target = Target::floats(gpu, SIZE);
    recording(gpu, |commands| {
        commands.pass(&target, &Pass::zeros(), || record(commands));
    })
}

/// The messages of a set of two draws with a change between them.
fn changed(gpu: &Gpu, dynamic: Option<vk::DynamicState>, change: impl FnOnce(&Commands)) -> Vec<Message> {
    let mut request = splats();
    request.dynamic.extend(dynamic);
    drawing(gpu, &request, &[SPLAT; 2], |commands| {
        commands.camera(&camera());
        if dynamic.is_some() {
            // SAFETY: see the crate.
            unsafe { gaussian(gpu).cmd_set_gaussian_alpha_floor(commands.raw, 0.01) };
        }
        begin(commands);
        commands.draw(0..1);
        change(commands);
        commands.draw(1..2);
        end(commands);
    })
}

pub fn mistakes() -> Vec<Mistake> {
    let not_ended = "VUID-vkCmdBeginGaussianSetGAURAST-None-90003";
    let other = "VUID-vkCmdDraw-None-90006";
    vec![
        mistake("a set without its feature", "VUID-vkCmdBeginGaussianSetGAURAST-mergedDraws-90001", |stage| {
            within(&stage.bare, begin)
        }),
        mistake("a set outside of a render pass", "VUID-vkCmdBeginGaussianSetGAURAST-renderpass", |stage| {
            recording(&stage.full, begin)
        }),
        mistake("a set within a set", "VUID-vkCmdBeginGaussianSetGAURAST-None-90002", |stage| {
            within(&stage.full, |commands| {
                begin(commands);
                begin(commands);
                end(commands);
            })
        }),
        mistake("a set that the pass ends before", not_ended, |stage| within(&stage.full, begin)),
        mistake("secondary command buffers within a set", not_ended, |stage| {
            let target = Target::floats(&stage.full, SIZE);
            let inheritance = vk::CommandBufferInheritanceInfo::default();
            let secondary = stage.full.record_as(
                vk::CommandBufferLevel::SECONDARY,
                &vk::CommandBufferBeginInfo::default().inheritance_info(&inheritance),
                |_| (),
            );
            let secondary = secondary.expect("a secondary command buffer");
            recording(&stage.full, |commands| {
                commands.pass(&target, &Pass::zeros(), || {
                    begin(commands);
                    // SAFETY: see the crate.
                    unsafe {
                        commands.device().cmd_execute_commands(commands.raw, &[secondary.raw]);
                    };
                });
            })
        }),
        mistake("the end of a set that has not begun", "VUID-vkCmdEndGaussianSetGAURAST-None-90004", |stage| {
            within(&stage.full, end)
        }),
        mistake("another pipeline within a set", "VUID-vkCmdDraw-None-90005", |stage| {
            let pipeline = splats().create(&stage.full).expect("a pipeline");
            changed(&stage.full, None, |commands| commands.bind(&pipeline))
        }),
        mistake("another camera within a set", other, |stage| {
            changed(&stage.full, None, |commands| {
                commands.camera(&camera().eye([0.1, 0.0, 0.0]));
            })
        }),
        mistake("another viewport within a set", other, |stage| {
            changed(&stage.full, None, |commands| {
                commands.viewport([0.0, 0.0, 60.0, 40.0], [0.0, 1.0]);
            })
        }),
        mistake("another dynamic alpha floor within a set", other, |stage| {
            let floor = DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST;
            changed(&stage.full, Some(floor), |commands| {
                // SAFETY: see the crate.
                unsafe { gaussian(&stage.full).cmd_set_gaussian_alpha_floor(commands.raw, 0.02) };
            })
        }),
    ]
}
