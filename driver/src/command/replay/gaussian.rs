//! Gaussian draws as the packets of a sorted set.

use super::descriptors::{self, DescriptorSetNotBound};
use super::draw::{DrawError, attribute_stream, indices};
use super::state::State;
use crate::command::{DrawParameters, camera};
use crate::pipeline::GraphicsPipeline;
use crate::pipeline::gaussian::stages::VertexProjection;
use crate::pipeline::gaussian::{
    CameraSource, GaussianAttributeSources, GaussianPipeline, GaussianSource,
};
use crate::pipeline::state::AttributeSource;
use simdevice::Packet;
use simdevice::packet::{
    BufferRange, GaussianAppend, GaussianAttributes, GaussianBegin, GaussianFragmentStage,
    ModelAttributes,
};
use simdevice::program::bindings::Bindings;
use simdevice::state::gaussian::{
    Camera, CameraModel, GaussianGeometry, GaussianPrecision, GaussianState,
};
use simdevice::state::{DrawState, Topology, Viewport};
use std::sync::Arc;

/// The packets that begin a sorted set.
///
/// # Errors
/// [`DrawError`] where bound state that the set needs is missing.
pub(crate) fn begin(state: &State, gaussian: &GaussianPipeline) -> Result<Vec<Packet>, DrawError> {
    let [camera, further_cameras @ ..] = &*enabled_cameras(state, gaussian)? else {
        return Err(DrawError::Camera);
    };
    let mut packets = vec![Packet::GaussianBegin(Box::new(GaussianBegin {
        state: fixed_state(state, gaussian)?,
        camera: *camera,
        further_cameras: further_cameras.to_vec(),
        viewport: upright(state.viewport(gaussian).ok_or(DrawError::Viewport)?),
        scissor: state.scissor(gaussian).ok_or(DrawError::Scissor)?,
    }))];
    if let Some(stage) = &gaussian.resolve {
        let (sets, constants) = (&state.graphics_sets, &state.push_constants);
        packets.push(Packet::GaussianFragmentStage(Box::new(
            GaussianFragmentStage {
                program: Arc::clone(&stage.program),
                bindings: descriptors::bindings(&stage.resources, sets, constants)?,
                sample_shading: stage.sample_shading,
                alpha_to_coverage: stage.alpha_to_coverage,
                alpha_to_one: stage.alpha_to_one,
            },
        )));
    }
    Ok(packets)
}

/// The packet that adds a draw to a sorted set.
///
/// # Errors
/// [`DrawError`] where a buffer that the draw needs is not bound.
pub(crate) fn append(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
    draw: &DrawParameters,
    draw_index: u32,
) -> Result<Packet, DrawError> {
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

/// The packet that adds a draw whose Gaussians a vertex shader projects.
fn shaded(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
    projection: &VertexProjection,
    parameters: &DrawParameters,
    draw_index: u32,
) -> Result<Packet, DrawError> {
    let attributes = projection
        .attributes
        .iter()
        .map(|source| attribute_stream(state, pipeline, source));
    let bindings = descriptors::bindings(
        &projection.resources,
        &state.graphics_sets,
        &state.push_constants,
    )?;
    let viewport = state.viewport(gaussian).ok_or(DrawError::Viewport)?;
    Ok(Packet::GaussianAppendDraw(Box::new(
        simdevice::packet::Draw {
            pipeline: Arc::clone(&projection.programs),
            attributes: attributes.collect::<Result<_, _>>()?,
            vertex_bindings: bindings,
            fragment_bindings: Bindings::default(),
            indices: indices(state, parameters)?,
            first: parameters.first,
            count: parameters.count,
            first_instance: parameters.first_instance,
            instance_count: parameters.instance_count,
            draw_index,
            state: Arc::new(DrawState {
                viewports: vec![viewport],
                ..DrawState::new(Topology::PointList, [0; 2])
            }),
        },
    )))
}

/// The cameras that the views of a draw are seen with, in the order of views, if their models' features are enabled: one for
/// all of them, or one for each.
fn enabled_cameras(state: &State, gaussian: &GaussianPipeline) -> Result<Vec<Camera>, DrawError> {
    let source = Cameras::new(state, gaussian.camera)?;
    let views = (0..u32::BITS).filter(|view| gaussian.view_mask >> view & 1 == 1);
    let cameras = match source.len() {
        0 => return Err(DrawError::Camera),
        count if count > 1 && gaussian.view_mask != 0 => views
            .map(|view| source.get(view, count))
            .collect::<Result<Vec<_>, _>>()?,
        count => vec![source.get(0, count)?],
    };
    for camera in &cameras {
        check_camera(camera, gaussian)?;
    }
    Ok(cameras)
}

/// Refuses a camera whose model is not enabled, or does not see Gaussians of the pipeline's modes.
fn check_camera(camera: &Camera, gaussian: &GaussianPipeline) -> Result<(), DrawError> {
    if !gaussian.camera_models.have(camera.model) {
        return Err(DrawError::CameraModel(camera.model));
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
    match is_seen {
        true => Ok(()),
        false => Err(DrawError::ModeOfCameraModel(camera.model)),
    }
}

/// The cameras that a draw is given.
enum Cameras<'a> {
    /// One that means nothing.
    None,
    /// Those that a command has set.
    Set(&'a [Camera]),
    /// Those of a uniform buffer.
    Buffer { range: BufferRange, count: usize },
}

impl<'a> Cameras<'a> {
    fn new(state: &'a State, source: CameraSource) -> Result<Self, DrawError> {
        let (set, binding, count) = match source {
            CameraSource::None => return Ok(Self::None),
            CameraSource::Command => return Ok(Self::Set(&state.cameras)),
            CameraSource::UniformBuffer {
                set,
                binding,
                count,
            } => (set, binding, count),
        };
        let bound = state
            .graphics_sets
            .get(set)
            .ok_or(DescriptorSetNotBound(set))?;
        let range = bound
            .buffer(binding)
            .ok_or(DrawError::CameraBuffer { set, binding })?;
        Ok(Self::Buffer {
            range,
            count: count as usize,
        })
    }

    fn len(&self) -> usize {
        match self {
            Self::None => 1,
            Self::Set(cameras) => cameras.len(),
            Self::Buffer { count, .. } => *count,
        }
    }

    /// The camera of a view, of `cameras` that there are.
    fn get(&self, view: u32, cameras: usize) -> Result<Camera, DrawError> {
        let none = DrawError::CameraOfView { view, cameras };
        let number = view as usize;
        match self {
            Self::None => Ok(Camera::default()),
            Self::Set(cameras) => cameras.get(number).copied().ok_or(none),
            Self::Buffer { count, .. } if number >= *count => Err(none),
            Self::Buffer { range, .. } => camera::read(range, number)
                .map_err(|error| DrawError::CameraData(error.to_string())),
        }
    }
}

/// The state of the pipeline, with the dynamic part filled in.
fn fixed_state(
    state: &State,
    gaussian: &GaussianPipeline,
) -> Result<Arc<GaussianState>, DrawError> {
    if gaussian.dynamic.is_empty() {
        return Ok(Arc::clone(&gaussian.state));
    }
    let mut fixed = gaussian.fixed.clone();
    state
        .dynamic_states
        .apply(&gaussian.dynamic, &mut fixed)
        .map_err(DrawError::Dynamic)?;
    let converted = fixed.draw_state();
    Ok(Arc::new(GaussianState {
        depth_stencil: converted.depth_stencil,
        blend_constants: converted.blend_constants,
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
) -> Result<GaussianAttributes, DrawError> {
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
