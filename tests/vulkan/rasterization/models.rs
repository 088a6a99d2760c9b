//! Scenes of textured and lit models from files.

use ash::vk;
use glam::Vec3;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::{Gpu, Output, Pass, Target, TargetOptions};
use gaurast_workloads::models::{Model, Ready};

fn drawn(gpu: &Gpu, model: &Model, direction: Vec3, samples: u32) -> Output {
    let options = TargetOptions { size: [640, 480], samples, ..TargetOptions::with_depth(vk::Format::D32_SFLOAT) };
    let target = Target::new(gpu, &options);
    let ready = Ready::new(gpu, &target, model, direction);
    target.draw(gpu, &Pass::default(), |commands| ready.draw(commands))
}

pub fn african_head(gpu: &Gpu) -> Drawn {
    let model = Model::african_head()?;
    Ok(drawn(gpu, &model, Vec3::new(0.5, 0.1, 1.0), 1))
}

pub fn african_head_of_four_samples(gpu: &Gpu) -> Drawn {
    let model = Model::african_head()?;
    Ok(drawn(gpu, &model, Vec3::new(-0.6, 0.3, 1.0), 4))
}

pub fn duck(gpu: &Gpu) -> Drawn {
    let model = Model::duck()?;
    Ok(drawn(gpu, &model, Vec3::new(0.4, 0.5, 1.0), 1))
}

pub fn bunny(gpu: &Gpu) -> Drawn {
    let model = Model::bunny()?;
    Ok(drawn(gpu, &model, Vec3::new(0.2, 0.3, 1.0), 1))
}
