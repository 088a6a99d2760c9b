//! Scenes that any driver draws: their results, and helpers for most of them, which draw a target, a pipeline and vertices
//! once.

use ash::vk;

use crate::{Buffer, Commands, Gpu, Output, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex};

/// The pictures of a scene, or the optional feature that it needs and the device lacks.
pub type Drawn = Result<Output, Missing>;

/// An optional feature that a device does not have.
#[derive(Clone, Debug, thiserror::Error)]
#[error("the device does not have {0}")]
pub struct Missing(pub String);

/// Fails with the name of a feature if it is missing.
pub fn need(name: &str, has: vk::Bool32) -> Result<(), Missing> {
    if has == vk::TRUE { Ok(()) } else { Err(Missing(name.to_owned())) }
}

/// Fails if images of `format` lack a use.
pub fn need_format(gpu: &Gpu, format: vk::Format, features: vk::FormatFeatureFlags) -> Result<(), Missing> {
    if gpu.format_features(format).contains(features) {
        Ok(())
    } else {
        Err(Missing(format!("{features:?} of {format:?}")))
    }
}

/// Draws `vertices` once.
pub fn simple(gpu: &Gpu, target: &TargetOptions, options: &PipelineOptions<'_>, vertices: &[Vertex]) -> Output {
    with(gpu, target, options, vertices, |commands| {
        commands.draw(0..vertices.len() as u32);
    })
}

/// Binds `vertices` and calls `draws`, which draws them.
pub fn with(
    gpu: &Gpu,
    target: &TargetOptions,
    options: &PipelineOptions<'_>,
    vertices: &[Vertex],
    draws: impl FnOnce(&Commands),
) -> Output {
    let target = Target::new(gpu, target);
    let pipeline = Pipeline::new(gpu, &target, options);
    let buffer = Buffer::of(gpu, vertices);
    target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.vertices(&buffer);
        draws(commands);
    })
}

/// Merges the outputs of several cases into one, under their names.
pub fn cases<T>(
    cases: impl IntoIterator<Item = T>,
    name: impl Fn(&T) -> String,
    draw: impl Fn(&T) -> Output,
) -> Output {
    let mut output = Output::default();
    for case in cases {
        output.add(&name(&case), draw(&case));
    }
    output
}
