//! Conversion of Gaussian draws to the packets of a sorted set.

use super::decoding::DrawDecodings;
use super::descriptors::{self, DescriptorSetNotBound};
use super::draw::{DrawError, attribute_stream, indices};
use super::state::State;
use crate::command::{DrawParameters, camera};
use crate::physical_device::limits::MAX_GAUSSIANS;
use crate::pipeline::GraphicsPipeline;
use crate::pipeline::gaussian::stages::{ResolveStage, VertexProjection};
use crate::pipeline::gaussian::{
    CameraSource, GaussianAttributeSources, GaussianPipeline, GaussianSource, HarmonicsSource,
};
use crate::pipeline::state::AttributeSource;
use simdevice::BufferRange;
use simdevice::Packet;
use simdevice::packet::{
    Activations, Decodings, GaussianAppend, GaussianAttributes, GaussianBegin, GaussianFragmentStage, ModelAttributes,
    PrimitiveBindings,
};
use simdevice::program::bindings::Bindings;
use simdevice::state::gaussian::{
    Camera, CameraModel, GaussianGeometry, GaussianOrder, GaussianPrecision, GaussianState,
};
use simdevice::state::{DrawState, Topology, Viewport};
use std::sync::Arc;

/// The beginning of a sorted set.
pub(crate) struct Begin {
    /// The state of the set.
    pub(crate) set: GaussianBegin,
    /// The fragment program that computes colours, if there is one.
    resolve: Option<GaussianFragmentStage>,
}

impl Begin {
    /// The packets that begin the set.
    pub(crate) fn packets(self) -> Vec<Packet> {
        let mut packets = vec![Packet::GaussianBegin(Box::new(self.set))];
        let resolve = self.resolve.map(Box::new);
        packets.extend(resolve.map(Packet::GaussianFragmentStage));
        packets
    }
}

/// The beginning of a sorted set.
///
/// # Errors
/// [`DrawError`] where bound state that the set needs is missing.
pub(crate) fn begin(state: &State, gaussian: &GaussianPipeline) -> Result<Begin, DrawError> {
    let cameras = enabled_cameras(state, gaussian)?;
    let [camera, further_cameras @ ..] = &*cameras else {
        return Err(DrawError::Camera);
    };
    let resolve = |stage: &ResolveStage| {
        let (sets, constants) = (&state.graphics_sets, &state.push_constants);
        Ok::<_, DrawError>(GaussianFragmentStage {
            program: Arc::clone(&stage.program),
            bindings: descriptors::bindings(&stage.resources, sets, constants)?,
            sample_shading: stage.sample_shading,
            alpha_to_coverage: stage.alpha_to_coverage,
            alpha_to_one: stage.alpha_to_one,
        })
    };
    let fixed = fixed_state(state, gaussian)?;
    if fixed.order == GaussianOrder::PerPixel && cameras.iter().any(|camera| camera.distortion.is_some()) {
        return Err(DrawError::ModeOfDistortion);
    }
    Ok(Begin {
        set: GaussianBegin {
            state: fixed,
            camera: *camera,
            further_cameras: further_cameras.to_vec(),
            viewport: upright(state.viewport(gaussian).ok_or(DrawError::Viewport)?),
            scissor: state.scissor(gaussian).ok_or(DrawError::Scissor)?,
        },
        resolve: gaussian.resolve.as_ref().map(resolve).transpose()?,
    })
}

/// The packet that adds a draw to a sorted set, whose beginning is `set`.
///
/// # Errors
/// [`DrawError`] where a buffer that the draw needs is not bound, or where it has too many Gaussians.
pub(crate) fn append(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
    set: &GaussianBegin,
    draw: &DrawParameters,
    draw_index: u32,
) -> Result<Packet, DrawError> {
    let check = |gaussians: u64| match gaussians {
        ..=MAX_GAUSSIANS => Ok(()),
        _ => Err(DrawError::TooManyGaussians(gaussians)),
    };
    let sources = match &gaussian.source {
        GaussianSource::Attributes(sources) => sources,
        GaussianSource::VertexShader(projection) => {
            check(u64::from(draw.count) * u64::from(draw.instance_count))?;
            return shaded(state, pipeline, gaussian, projection, draw, draw_index);
        }
    };
    let append = GaussianAppend {
        attributes: attributes(state, pipeline, sources, set.state.sh_degree)?,
        indices: indices(state, draw)?,
        first: draw.first,
        count: draw.count,
        first_instance: draw.first_instance,
        instance_count: draw.instance_count,
    };
    check(append.gaussians_within_buffers())?;
    Ok(Packet::GaussianAppend(Box::new(append)))
}

/// The sentence on the Gaussians of a draw's packets that lie beyond its buffers; `None` if there are none.
pub(crate) fn beyond_buffers(packets: &[Packet]) -> Option<String> {
    let append = packets.iter().find_map(|packet| match packet {
        Packet::GaussianAppend(append) => Some(&**append),
        _ => None,
    })?;
    let all = append.gaussians();
    let beyond = all - append.gaussians_within_buffers();
    (beyond > 0).then(|| {
        format!("a draw of {all} Gaussians leaves out {beyond} of them, which lie beyond the buffer of their rotations")
    })
}

/// The packet that adds a draw whose Gaussians are projected by a vertex shader.
fn shaded(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
    projection: &VertexProjection,
    parameters: &DrawParameters,
    draw_index: u32,
) -> Result<Packet, DrawError> {
    let attributes = projection.attributes.iter().map(|source| attribute_stream(state, pipeline, source));
    let bindings = descriptors::bindings(&projection.resources, &state.graphics_sets, &state.push_constants)?;
    let viewport = state.viewport(gaussian).ok_or(DrawError::Viewport)?;
    Ok(Packet::GaussianAppendDraw(Box::new(simdevice::packet::Draw {
        pipeline: Arc::clone(&projection.programs),
        attributes: attributes.collect::<Result<_, _>>()?,
        vertex_bindings: bindings,
        primitive_bindings: PrimitiveBindings::default(),
        fragment_bindings: Bindings::default(),
        indices: indices(state, parameters)?,
        first: parameters.first,
        count: parameters.count,
        first_instance: parameters.first_instance,
        instance_count: parameters.instance_count,
        draw_index,
        transform_feedback: None,
        state: Arc::new(DrawState { viewports: vec![viewport], ..DrawState::new(Topology::PointList, [0; 2]) }),
    })))
}

/// The cameras of a draw's views, in the order of views, after a check that their models' features are enabled: one for
/// all views, or one for each.
fn enabled_cameras(state: &State, gaussian: &GaussianPipeline) -> Result<Vec<Camera>, DrawError> {
    let source = Cameras::new(state, gaussian.camera)?;
    let views = (0..u32::BITS).filter(|view| gaussian.view_mask >> view & 1 == 1);
    let cameras = match source.len() {
        0 => return Err(DrawError::Camera),
        count if count > 1 && gaussian.view_mask != 0 => {
            views.map(|view| source.get(view, count)).collect::<Result<Vec<_>, _>>()?
        }
        count => vec![source.get(0, count)?],
    };
    for camera in &cameras {
        check_camera(camera, gaussian)?;
    }
    Ok(cameras)
}

/// Refuses a camera whose model is not enabled, or doesn't support the pipeline's modes.
fn check_camera(camera: &Camera, gaussian: &GaussianPipeline) -> Result<(), DrawError> {
    let required = gaussian.dynamic_rules.require_camera_model(camera.model);
    required.map_err(|error| DrawError::CameraModel(error.to_string()))?;
    let state = &gaussian.state;
    let is_supported = match camera.model {
        CameraModel::Pinhole | CameraModel::Orthographic => true,
        CameraModel::Fisheye => state.geometry == GaussianGeometry::Volume,
        CameraModel::Equirectangular => {
            state.geometry == GaussianGeometry::Volume && state.precision == GaussianPrecision::Float32
        }
    };
    if !is_supported {
        return Err(DrawError::ModeOfCameraModel(camera.model));
    }
    if camera.distortion.is_some() {
        let required = gaussian.dynamic_rules.require_distortion();
        required.map_err(|error| DrawError::CameraModel(error.to_string()))?;
        if state.geometry != GaussianGeometry::Volume {
            return Err(DrawError::ModeOfDistortion);
        }
    }
    Ok(())
}

/// The cameras that a draw is given.
enum Cameras<'a> {
    /// A camera that is not used.
    None,
    /// Cameras that a command has set.
    Set(&'a [Camera]),
    /// Cameras in a uniform buffer.
    Buffer { range: BufferRange, count: usize },
}

impl<'a> Cameras<'a> {
    fn new(state: &'a State, source: CameraSource) -> Result<Self, DrawError> {
        let (set, binding, count) = match source {
            CameraSource::None => return Ok(Self::None),
            CameraSource::Command => return Ok(Self::Set(&state.cameras)),
            CameraSource::UniformBuffer { set, binding, count } => (set, binding, count),
        };
        let bound = state.graphics_sets.get(set).ok_or(DescriptorSetNotBound(set))?;
        let range = bound.buffer(binding).ok_or(DrawError::CameraBuffer { set, binding })?;
        Ok(Self::Buffer { range, count: count as usize })
    }

    fn len(&self) -> usize {
        match self {
            Self::None => 1,
            Self::Set(cameras) => cameras.len(),
            Self::Buffer { count, .. } => *count,
        }
    }

    /// The camera of a view, given the number of cameras.
    fn get(&self, view: u32, cameras: usize) -> Result<Camera, DrawError> {
        let none = DrawError::CameraOfView { view, cameras };
        let number = view as usize;
        match self {
            Self::None => Ok(Camera::default()),
            Self::Set(cameras) => cameras.get(number).copied().ok_or(none),
            Self::Buffer { count, .. } if number >= *count => Err(none),
            Self::Buffer { range, .. } => {
                camera::read(range, number).map_err(|error| DrawError::CameraData(error.to_string()))
            }
        }
    }
}

/// The state of the pipeline, with its dynamic parts filled in.
fn fixed_state(state: &State, gaussian: &GaussianPipeline) -> Result<Arc<GaussianState>, DrawError> {
    if gaussian.dynamic.is_empty() {
        return Ok(Arc::clone(&gaussian.state));
    }
    let mut fixed = gaussian.fixed.clone();
    state.dynamic_states.apply(&gaussian.dynamic, &mut fixed).map_err(DrawError::Dynamic)?;
    let set = fixed.gaussian_state();
    gaussian.dynamic_rules.check(&set).map_err(|error| DrawError::DynamicValue(error.to_string()))?;
    Ok(Arc::new(set))
}

/// The viewport with a positive height. A Gaussian's pixels are relative to the upper left corner of the viewport's
/// area, so a negative height changes only the position of that corner.
fn upright(viewport: Viewport) -> Viewport {
    if viewport.height >= 0.0 {
        return viewport;
    }
    Viewport { y: viewport.y + viewport.height, height: -viewport.height, ..viewport }
}

/// The streams that fixed-function projection reads, with the harmonics of a degree.
fn attributes(
    state: &State,
    pipeline: &GraphicsPipeline,
    sources: &GaussianAttributeSources,
    degree: u32,
) -> Result<GaussianAttributes, DrawError> {
    let count = (degree as usize + 1).pow(2);
    let stream = |source: &AttributeSource| attribute_stream(state, pipeline, source);
    let position = stream(&sources.position)?;
    let decodings = DrawDecodings::new(&sources.decoding, state.decoding_tables.as_deref(), &position.buffer)?;
    Ok(GaussianAttributes {
        position,
        scale: stream(&sources.scale)?,
        rotation: stream(&sources.rotation)?,
        opacity: stream(&sources.opacity)?,
        spherical_harmonics: match &sources.spherical_harmonics {
            HarmonicsSource::Attributes(sources) => {
                let mut streams = sources.iter().take(count).map(stream).collect::<Result<Vec<_>, _>>()?;
                streams.extend(decodings.iter().flat_map(|decodings| decodings.codes(count)));
                streams
            }
            HarmonicsSource::Buffer => {
                let bound = state.harmonics.as_ref().ok_or(DrawError::Harmonics)?;
                (0..count as u64).map(|k| bound.coefficient(k)).collect()
            }
        },
        activations: Activations {
            decodings: decodings.as_ref().map_or_else(
                || Decodings { rotation: sources.decoding.rotation, ..Decodings::default() },
                DrawDecodings::decodings,
            ),
            ..sources.activations
        },
        tables: decodings.map(|decodings| Box::new(decodings.tables())),
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
        let viewport = Viewport { x: 3.0, y: 90.0, width: 50.0, height: -80.0, min_depth: 0.0, max_depth: 1.0 };
        let upright = upright(viewport);
        assert_eq!((upright.y, upright.height), (10.0, 80.0));
        assert_eq!((upright.x, upright.width), (3.0, 50.0));
    }
}
