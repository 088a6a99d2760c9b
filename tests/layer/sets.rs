//! Mistakes in sorted sets of several draws.

use ash::vk;
use gaurast::vk::{DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST, GaussianCameraSourceGAURAST};
use gaurast_testkit::{Bindings, Buffer, Commands, Gpu, Graphics, Message, Pass, Resource, Target};

use crate::contents::bytes;
use crate::stage::{Mistake, SIZE, SPLAT, camera, drawing, gaussian, mistake, recording, splats, with};

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
        mistake("another camera in a uniform buffer within a set", other, |stage| {
            let gpu = &stage.full;
            let mut cameras = bytes(&camera());
            cameras.resize(256, 0);
            cameras.extend(bytes(&camera().eye([0.1, 0.0, 0.0])));
            let buffer = Buffer::of(gpu, &cameras);
            let set = Bindings::new(gpu, &[Resource::DynamicUniform(buffer.raw, 128)]);
            let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
            let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source)) };
            drawing(gpu, &request, &[SPLAT; 2], |commands| {
                begin(commands);
                commands.bind_set(&set, &[0]);
                commands.draw(0..1);
                commands.bind_set(&set, &[256]);
                commands.draw(1..2);
                end(commands);
            })
        }),
        mistake("a query that ends within a set", "GAURAST-Set-query", |stage| {
            let gpu = &stage.full;
            let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::OCCLUSION).query_count(1);
            // SAFETY: see the crate.
            let pool = unsafe { gpu.device().create_query_pool(&info, None) }.expect("a query pool");
            let pipeline = splats().create(gpu).expect("a pipeline");
            let buffer = Buffer::of(gpu, &SPLAT);
            let target = Target::floats(gpu, SIZE);
            let heard = recording(gpu, |commands| {
                let (device, raw) = commands.raw();
                // SAFETY: see the crate.
                unsafe { device.cmd_reset_query_pool(raw, pool, 0, 1) };
                commands.pass(&target, &Pass::zeros(), || {
                    commands.bind(&pipeline);
                    commands.vertices(&buffer);
                    commands.camera(&camera());
                    // SAFETY: see the crate.
                    unsafe { device.cmd_begin_query(raw, pool, 0, vk::QueryControlFlags::empty()) };
                    begin(commands);
                    commands.draw(0..1);
                    // SAFETY: see the crate.
                    unsafe { device.cmd_end_query(raw, pool, 0) };
                    end(commands);
                });
            });
            // SAFETY: see the crate.
            unsafe { gpu.device().destroy_query_pool(pool, None) };
            heard
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
