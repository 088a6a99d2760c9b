//! Lowers Gaussian draws: pipeline, bound buffers, viewport and camera to the packets of a sorted set.

use super::bindings::Unbound;
use super::camera;
use super::draw::{Undrawn, attribute_stream, indices};
use crate::command::record::Draw;
use crate::command::state::State;
use crate::object::pipeline::{AttributeSource, CameraSource, GaussianPipeline, GraphicsPipeline};
use simdevice::Packet;
use simdevice::packet::{
    Camera, CameraModel, GaussianAppend, GaussianAttributes, GaussianBegin, GaussianGeometry,
    GaussianState, Viewport,
};
use std::sync::Arc;

/// What begins a sorted set.
///
/// # Errors
/// [`Undrawn`] where bound state that the set needs is missing.
pub(crate) fn begin(state: &State, gaussian: &GaussianPipeline) -> Result<Packet, Undrawn> {
    Ok(Packet::GaussianBegin(Box::new(GaussianBegin {
        state: fixed_state(state, gaussian)?,
        camera: enabled_camera(state, gaussian)?,
        viewport: upright(state.viewport(gaussian).ok_or(Undrawn::Viewport)?),
        scissor: state.scissor(gaussian).ok_or(Undrawn::Scissor)?,
    })))
}

/// What adds a draw to a sorted set.
///
/// # Errors
/// [`Undrawn`] where a buffer that the draw needs is not bound.
pub(crate) fn append(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
    draw: &Draw,
) -> Result<Packet, Undrawn> {
    Ok(Packet::GaussianAppend(Box::new(GaussianAppend {
        attributes: attributes(state, pipeline, gaussian)?,
        indices: indices(state, draw)?,
        first: draw.first,
        count: draw.count,
        first_instance: draw.first_instance,
        instance_count: draw.instance_count,
    })))
}

/// The camera that a draw sees with, if its model's feature is enabled.
fn enabled_camera(state: &State, gaussian: &GaussianPipeline) -> Result<Camera, Undrawn> {
    let camera = camera(state, gaussian.camera)?;
    if !gaussian.camera_models.have(camera.model) {
        return Err(Undrawn::CameraModel(camera.model));
    }
    let is_flat = gaussian.state.geometry == GaussianGeometry::Surfel;
    if is_flat
        && !matches!(
            camera.model,
            CameraModel::Pinhole | CameraModel::Orthographic
        )
    {
        return Err(Undrawn::FlatCameraModel(camera.model));
    }
    Ok(camera)
}

/// The camera that a draw is given.
fn camera(state: &State, source: CameraSource) -> Result<Camera, Undrawn> {
    let (set, binding) = match source {
        CameraSource::Command => return state.camera.ok_or(Undrawn::Camera),
        CameraSource::UniformBuffer { set, binding } => (set, binding),
    };
    let bound = state.graphics_sets.get(set).ok_or(Unbound(set))?;
    let range = bound
        .buffer(binding)
        .ok_or(Undrawn::CameraBuffer { set, binding })?;
    camera::read(&range).map_err(|error| Undrawn::CameraData(error.to_string()))
}

/// What the pipeline fixes, with the dynamic part filled in.
fn fixed_state(state: &State, gaussian: &GaussianPipeline) -> Result<Arc<GaussianState>, Undrawn> {
    if gaussian.dynamic.is_empty() {
        return Ok(Arc::clone(&gaussian.state));
    }
    let mut fixed = gaussian.fixed.clone();
    fixed
        .set_dynamic(&gaussian.dynamic, &state.settings)
        .map_err(Undrawn::Dynamic)?;
    let lowered = fixed.lower();
    Ok(Arc::new(GaussianState {
        depth_stencil: lowered.depth_stencil,
        blend_constants: lowered.blend_constants,
        ..GaussianState::clone(&gaussian.state)
    }))
}

/// A Gaussian's pixels count from the upper left corner of the area that the viewport covers, so a negative
/// height changes nothing but where that corner is.
fn upright(viewport: Viewport) -> Viewport {
    if viewport.height >= 0.0 {
        return viewport;
    }
    Viewport {
        y: viewport.y + viewport.height,
        height: -viewport.height,
        ..viewport
    }
}

fn attributes(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
) -> Result<GaussianAttributes, Undrawn> {
    let stream = |source: &AttributeSource| attribute_stream(state, pipeline, source);
    Ok(GaussianAttributes {
        position: stream(&gaussian.position)?,
        scale: stream(&gaussian.scale)?,
        rotation: stream(&gaussian.rotation)?,
        opacity: stream(&gaussian.opacity)?,
        spherical_harmonics: gaussian
            .spherical_harmonics
            .iter()
            .map(stream)
            .collect::<Result<_, _>>()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_negative_height_moves_the_corner() {
        let viewport = Viewport {
            x: 3.0,
            y: 90.0,
            width: 50.0,
            height: -80.0,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let upright = upright(viewport);
        assert_eq!((upright.y, upright.height), (10.0, 80.0));
        assert_eq!((upright.x, upright.width), (3.0, 50.0));
    }
}
