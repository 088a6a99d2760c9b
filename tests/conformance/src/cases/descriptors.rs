//! Descriptor sets of cameras in uniform buffers: offsets, places, rebinding.

use ash::vk;
use gaurast::vk::{GaussianCameraDataGAURAST, GaussianCameraSourceGAURAST};
use gaurast_testkit::{Bindings, Buffer, Gpu, Graphics, Resource};

use super::chapter::Chapter;
use super::input::vertices;
use super::scenes::{cameras, dense, front};
use crate::draw::{Camera, Draw};
use crate::program::Program;

/// A distance of cameras in a buffer that all devices allow.
const APART: usize = 256;

/// Cameras in a buffer, as far apart as every device allows.
fn buffer(gpu: &Gpu, cameras: &[Camera]) -> Buffer {
    let mut bytes = vec![0_u8; APART * cameras.len()];
    for (at, camera) in cameras.iter().enumerate() {
        bytes[at * APART..][..128].copy_from_slice(&GaussianCameraDataGAURAST::from(camera).to_bytes());
    }
    Buffer::of(gpu, &bytes)
}

/// Cameras that show something else than the front one.
fn others() -> [Camera; 2] {
    [front().eye([0.7, 0.1, -0.4]), front().focal_length([40.0, 90.0])]
}

/// Reads cameras from a uniform buffer at a set and a binding.
fn read_camera(graphics: &mut Graphics<'_>, [set, binding]: [u32; 2], layouts: Vec<vk::DescriptorSetLayout>) {
    let state = graphics.gaussian.expect("a Gaussian state");
    let state = state.camera_source(GaussianCameraSourceGAURAST::UNIFORM_BUFFER);
    graphics.gaussian = Some(state.camera_set(set).camera_binding(binding));
    graphics.set_layouts = layouts;
}

pub(super) fn descriptors(chapter: &mut Chapter<'_>) {
    for (name, at) in [("first", 0), ("second", 1), ("third", 2)] {
        chapter.program(format!("dynamic_offset.{name}"), move || {
            let program = Program::on_stage(Draw::new(dense(531, 1)), move |stage| {
                let mut all = [others()[0], others()[1], others()[0]];
                all[at] = stage.draw.camera;
                let buffer = buffer(stage.gpu, &all);
                let set = Bindings::new(stage.gpu, &[Resource::DynamicUniform(buffer.raw, 128)]);
                let pipeline = stage.pipeline(stage.draw, &|graphics| read_camera(graphics, [0, 0], vec![set.layout]));
                stage.run(|commands| {
                    commands.bind(&pipeline);
                    commands.bind_set(&set, &[(at * APART) as u32]);
                    commands.draw(0..500);
                });
            });
            program.needing("uniformBufferCamera")
        });
    }
    // The descriptor is written again before it is bound.
    chapter.program("offset", || {
        let program = Program::on_stage(Draw::new(dense(532, 1)), |stage| {
            let buffer = buffer(stage.gpu, &[others()[0], stage.draw.camera]);
            let set = Bindings::new(stage.gpu, &[Resource::Uniform(buffer.raw)]);
            let info = [vk::DescriptorBufferInfo::default().buffer(buffer.raw).offset(APART as u64).range(128)];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set.set)
                .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER)
                .buffer_info(&info);
            // SAFETY: the set is not used yet.
            unsafe { stage.gpu.device().update_descriptor_sets(&[write], &[]) };
            let pipeline = stage.pipeline(stage.draw, &|graphics| read_camera(graphics, [0, 0], vec![set.layout]));
            stage.run(|commands| {
                commands.bind(&pipeline);
                commands.bind_set(&set, &[]);
                commands.draw(0..500);
            });
        });
        program.needing("uniformBufferCamera")
    });
    chapter.program("written_again", || {
        let program = Program::on_stage(Draw::new(dense(533, 1)), |stage| {
            let [wrong, right] = [others()[0], stage.draw.camera].map(|camera| buffer(stage.gpu, &[camera]));
            let set = Bindings::new(stage.gpu, &[Resource::Uniform(wrong.raw)]);
            let info = [vk::DescriptorBufferInfo::default().buffer(right.raw).range(vk::WHOLE_SIZE)];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set.set)
                .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER)
                .buffer_info(&info);
            // SAFETY: the set is not used yet.
            unsafe { stage.gpu.device().update_descriptor_sets(&[write], &[]) };
            let pipeline = stage.pipeline(stage.draw, &|graphics| read_camera(graphics, [0, 0], vec![set.layout]));
            stage.run(|commands| {
                commands.bind(&pipeline);
                commands.bind_set(&set, &[]);
                commands.draw(0..500);
            });
        });
        program.needing("uniformBufferCamera")
    });
    // The camera is at the third binding of the second set.
    chapter.program("second_set_third_binding", || {
        let program = Program::on_stage(Draw::new(dense(534, 1)), |stage| {
            let [wrong, right] = [others()[0], stage.draw.camera].map(|camera| buffer(stage.gpu, &[camera]));
            let [wrong, right] = [Resource::Uniform(wrong.raw), Resource::Uniform(right.raw)];
            let first = Bindings::new(stage.gpu, &[wrong, wrong, wrong]);
            let second = Bindings::new(stage.gpu, &[wrong, wrong, right]);
            let layouts = vec![first.layout, second.layout];
            let pipeline = stage.pipeline(stage.draw, &|graphics| read_camera(graphics, [1, 2], layouts.clone()));
            stage.run(|commands| {
                commands.bind(&pipeline);
                let (device, raw) = commands.raw();
                let (point, sets) = (vk::PipelineBindPoint::GRAPHICS, [first.set, second.set]);
                // SAFETY: the sets have the layouts of the pipeline's.
                unsafe { device.cmd_bind_descriptor_sets(raw, point, pipeline.layout, 0, &sets, &[]) };
                commands.draw(0..500);
            });
        });
        program.needing("uniformBufferCamera")
    });
    // Each draw sees through a camera of its own: the parts do not overlap in what they are compared with.
    chapter.program("rebound", || {
        let draw = Draw { calls: vec![vertices(0, 500)], ..Draw::new(dense(535, 1)) };
        let program = Program::on_stage(draw, |stage| {
            let [wrong, right] = [front().eye([1e5; 3]), stage.draw.camera].map(|camera| buffer(stage.gpu, &[camera]));
            let sets = [&wrong, &right].map(|buffer| Bindings::new(stage.gpu, &[Resource::Uniform(buffer.raw)]));
            let layout = sets[0].layout;
            let pipeline = stage.pipeline(stage.draw, &|graphics| read_camera(graphics, [0, 0], vec![layout]));
            stage.run(|commands| {
                commands.bind(&pipeline);
                for set in &sets {
                    commands.bind_set(set, &[]);
                    commands.draw(0..500);
                }
            });
        });
        program.needing("uniformBufferCamera")
    });
    for index in [5, 7, 9] {
        let (name, camera) = cameras()[index];
        chapter.program(format!("model.{name}"), move || {
            let program = Program::on_stage(Draw::new(dense(536, 1)).seen_by(camera), |stage| {
                let buffer = buffer(stage.gpu, &[others()[1], stage.draw.camera]);
                let set = Bindings::new(stage.gpu, &[Resource::DynamicUniform(buffer.raw, 128)]);
                let pipeline = stage.pipeline(stage.draw, &|graphics| read_camera(graphics, [0, 0], vec![set.layout]));
                stage.run(|commands| {
                    commands.bind(&pipeline);
                    commands.bind_set(&set, &[APART as u32]);
                    commands.draw(0..500);
                });
            });
            program.needing("uniformBufferCamera")
        });
    }
}
