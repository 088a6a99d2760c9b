//! Lowers Gaussian draws: pipeline, bound buffers, viewport and camera to the packets of a sorted set.

use super::bindings::{self, Unbound};
use super::camera;
use super::draw::{Undrawn, attribute_stream, indices};
use crate::command::record::Draw;
use crate::command::state::State;
use crate::object::pipeline::gaussian_stages::VertexProjection;
use crate::object::pipeline::{
    AttributeSource, CameraSource, GaussianAttributeSources, GaussianPipeline, GaussianSource,
    GraphicsPipeline,
};
use simdevice::Packet;
use simdevice::packet::{self, ResolveShader};
use simdevice::packet::{GaussianAppend, GaussianAttributes, GaussianBegin, ModelAttributes};
use simdevice::program::bindings::Bindings;
use simdevice::state::gaussian::{
    Camera, CameraModel, GaussianGeometry, GaussianPrecision, GaussianState,
};
use simdevice::state::{DrawState, Topology, Viewport};
use std::sync::Arc;

/// What begins a sorted set.
///
/// # Errors
/// [`Undrawn`] where bound state that the set needs is missing.
pub(crate) fn begin(state: &State, gaussian: &GaussianPipeline) -> Result<Vec<Packet>, Undrawn> {
    let mut packets = vec![Packet::GaussianBegin(Box::new(GaussianBegin {
        state: fixed_state(state, gaussian)?,
        camera: enabled_camera(state, gaussian)?,
        viewport: upright(state.viewport(gaussian).ok_or(Undrawn::Viewport)?),
        scissor: state.scissor(gaussian).ok_or(Undrawn::Scissor)?,
    }))];
    if let Some(stage) = &gaussian.resolve {
        let (sets, constants) = (&state.graphics_sets, &state.push_constants);
        packets.push(Packet::GaussianResolveShader(Box::new(ResolveShader {
            program: Arc::clone(&stage.program),
            bindings: bindings::bindings(&stage.descriptors, sets, constants)?,
            sample_shading: stage.sample_shading,
            alpha_to_coverage: stage.alpha_to_coverage,
            alpha_to_one: stage.alpha_to_one,
        })));
    }
    Ok(packets)
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
    draw_index: u32,
) -> Result<Packet, Undrawn> {
    let sources = match &gaussian.source {
        GaussianSource::Attributes(sources) => sources,
        GaussianSource::VertexShader(projection) => {
            return shaded(state, pipeline, gaussian, projection, draw, draw_index);
        }
    };
    Ok(Packet::GaussianAppend(Box::new(GaussianAppend {
        attributes: attributes(state, pipeline, sources)?,
        indices: indices(state, draw)?,
        first: draw.first,
        count: draw.count,
        first_instance: draw.first_instance,
        instance_count: draw.instance_count,
    })))
}

/// What adds a draw whose Gaussians a vertex shader projects.
fn shaded(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
    projection: &VertexProjection,
    numbers: &Draw,
    draw_index: u32,
) -> Result<Packet, Undrawn> {
    let attributes = projection
        .attributes
        .iter()
        .map(|source| attribute_stream(state, pipeline, source));
    let descriptors = &projection.descriptors;
    let bindings = bindings::bindings(descriptors, &state.graphics_sets, &state.push_constants)?;
    let viewport = state.viewport(gaussian).ok_or(Undrawn::Viewport)?;
    Ok(Packet::GaussianAppendDraw(Box::new(packet::Draw {
        pipeline: Arc::clone(&projection.programs),
        attributes: attributes.collect::<Result<_, _>>()?,
        vertex_bindings: bindings,
        fragment_bindings: Bindings::default(),
        indices: indices(state, numbers)?,
        first: numbers.first,
        count: numbers.count,
        first_instance: numbers.first_instance,
        instance_count: numbers.instance_count,
        draw_index,
        state: Arc::new(DrawState {
            viewports: vec![viewport],
            ..DrawState::new(Topology::PointList, [0; 2])
        }),
    })))
}

/// The camera that a draw sees with, if its model's feature is enabled.
fn enabled_camera(state: &State, gaussian: &GaussianPipeline) -> Result<Camera, Undrawn> {
    let camera = camera(state, gaussian.camera)?;
    if !gaussian.camera_models.have(camera.model) {
        return Err(Undrawn::CameraModel(camera.model));
    }
    let state = &gaussian.state;
    let is_seen = match camera.model {
        CameraModel::Pinhole | CameraModel::Orthographic => true,
        CameraModel::Fisheye => state.geometry == GaussianGeometry::Volume,
        CameraModel::Equirectangular => {
            state.geometry == GaussianGeometry::Volume
                && state.precision == GaussianPrecision::Float32
        }
    };
    if !is_seen {
        return Err(Undrawn::ModeOfCameraModel(camera.model));
    }
    Ok(camera)
}

/// The camera that a draw is given.
fn camera(state: &State, source: CameraSource) -> Result<Camera, Undrawn> {
    let (set, binding) = match source {
        CameraSource::None => return Ok(Camera::default()),
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
    sources: &GaussianAttributeSources,
) -> Result<GaussianAttributes, Undrawn> {
    let stream = |source: &AttributeSource| attribute_stream(state, pipeline, source);
    Ok(GaussianAttributes {
        position: stream(&sources.position)?,
        scale: stream(&sources.scale)?,
        rotation: stream(&sources.rotation)?,
        opacity: stream(&sources.opacity)?,
        spherical_harmonics: sources
            .spherical_harmonics
            .iter()
            .map(stream)
            .collect::<Result<_, _>>()?,
        model: ModelAttributes {
            matrix: match &sources.model_matrix {
                None => None,
                Some([x, y, z]) => Some(Box::new([stream(x)?, stream(y)?, stream(z)?])),
            },
            opacity: sources.model_opacity.as_ref().map(stream).transpose()?,
        },
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
