//! Pipelines of the Gaussian list topology.

pub(crate) mod decoding;
pub(crate) mod stages;
mod valid_usage;
pub(crate) mod values;

use self::decoding::{Decoded, DecodingState, Method};
use self::stages::{ResolveStage, VertexProjection};
use self::valid_usage::*;
use super::dynamic_state::{GaussianStates, is_taken_by_gaussians};
use super::parts::GraphicsState;
use super::state::{AttributeSource, FixedFunctionState, attribute};
use crate::abi::error::Error;
use crate::convert;
use crate::descriptor::layout::LayoutBinding;
use crate::device::Device;
use crate::enabled::Enabled;
use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST, GaussianCameraSourceGAURAST, GaussianGeometryGAURAST,
    GaussianLinearizationGAURAST, GaussianPrecisionGAURAST, PipelineGaussianStateCreateFlagsGAURAST as Flags,
    PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::packet::{Activations, Decodings};
use simdevice::state::gaussian::{
    GaussianApproximation, GaussianFootprint, GaussianGeometry, GaussianLinearization, GaussianPrecision,
    GaussianState, UnscentedTransform,
};
use simdevice::state::{DrawState, Rect, Viewport};
use std::sync::Arc;

/// The Gaussian part of a pipeline.
#[derive(Debug)]
pub(crate) struct GaussianPipeline {
    /// The state for the device; its dynamic parts are filled in for each draw.
    pub(crate) state: Arc<GaussianState>,
    /// The static state of fragment operations.
    pub(crate) fixed: FixedFunctionState,
    /// The dynamic states of fragment operations.
    pub(crate) dynamic: Vec<vk::DynamicState>,
    /// The limits and enabled features for the values of these states, and for cameras.
    pub(crate) dynamic_rules: DynamicRules,
    /// The viewport, unless it is dynamic.
    pub(crate) viewport: Option<Viewport>,
    /// The scissor, unless it is dynamic.
    pub(crate) scissor: Option<Rect>,
    /// The source of draws' cameras.
    pub(crate) camera: CameraSource,
    /// The views of the passes in which it draws, a bit each; 0 without views.
    pub(crate) view_mask: u32,
    /// The source of Gaussians.
    pub(crate) source: GaussianSource,
    /// The stage that computes colours from accumulated values.
    pub(crate) resolve: Option<ResolveStage>,
}

/// The source of a pipeline's Gaussians.
#[derive(Debug)]
pub(crate) enum GaussianSource {
    /// Vertex attributes, which the device projects.
    Attributes(Box<GaussianAttributeSources>),
    /// A vertex shader, which projects them itself.
    VertexShader(VertexProjection),
}

/// The attributes of fixed-function projection.
#[derive(Debug)]
pub(crate) struct GaussianAttributeSources {
    /// The source of means.
    pub(crate) position: AttributeSource,
    /// The source of standard deviations.
    pub(crate) scale: AttributeSource,
    /// The source of quaternions.
    pub(crate) rotation: AttributeSource,
    /// The source of opacities.
    pub(crate) opacity: AttributeSource,
    /// The sources of the spherical harmonics' coefficients.
    pub(crate) spherical_harmonics: HarmonicsSource,
    /// The activation functions of scales and opacities.
    pub(crate) activations: Activations,
    /// The decodings of attributes.
    pub(crate) decoding: DecodingState,
    /// The sources of the rows of model matrices, if it has them.
    pub(crate) model_matrix: Option<[AttributeSource; 3]>,
    /// The source of opacity factors, if it has one.
    pub(crate) model_opacity: Option<AttributeSource>,
}

/// The source of spherical harmonics.
#[derive(Debug)]
pub(crate) enum HarmonicsSource {
    /// Vertex attributes, one for each coefficient.
    Attributes(Vec<AttributeSource>),
    /// `vkCmdBindGaussianSphericalHarmonicsGAURAST`.
    Buffer,
}

/// The source of Gaussian draws' cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CameraSource {
    /// No camera: a vertex shader projects.
    None,
    /// `vkCmdSetGaussianCamerasGAURAST`.
    Command,
    /// A uniform buffer, read when the draw executes.
    UniformBuffer {
        /// The descriptor set.
        set: u32,
        /// The binding, of which the first descriptor is used.
        binding: u32,
        /// The number of cameras in the buffer.
        count: u32,
    },
}

impl GaussianPipeline {
    /// Validates and converts the Gaussian part of a pipeline.
    pub(crate) fn new(device: &Device, graphics: &GraphicsState) -> Result<Self, Error> {
        let enabled = device.enabled();
        require(enabled, &TOPOLOGY, "the topology is the Gaussian list")?;
        let Some(gaussian) = &graphics.pre_rasterization.gaussian else {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-topology-90007",
                format!(
                    "a pipeline of topology VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST must chain a \
                     {STRUCTURE}; if a validation layer is enabled, name the structure to it with \
                     VK_LAYER_CUSTOM_STYPE_LIST"
                ),
            ));
        };
        let view_mask = graphics.pre_rasterization.view_mask;
        if view_mask != 0 {
            require(enabled, &MULTIVIEW, "the view mask is not 0")?;
        }
        let gaussian = &without_dynamic(graphics, gaussian);
        let allowed = Modes::new(graphics, gaussian);
        allowed.check()?;
        stages(graphics, gaussian, enabled)?;
        modes(gaussian, enabled)?;
        numbers(gaussian)?;
        let approximation = approximation(graphics)?;
        let footprint = footprint(graphics, gaussian, enabled)?;
        let unscented = unscented(graphics, gaussian, enabled)?;
        fixed_state(graphics, enabled)?;
        let mut fragments = FixedFunctionState::of_gaussians(graphics)?;
        let taken = graphics.dynamic.iter().copied();
        let taken = taken.filter(|&state| {
            // Gaussians that a vertex shader projects have no harmonics.
            let is_ignored = vk::DynamicState::GAUSSIAN_SPHERICAL_HARMONICS_DEGREE == state;
            is_taken_by_gaussians(state) && !(is_shaded(gaussian) && is_ignored)
        });
        let state = GaussianState { approximation, footprint, unscented, ..state(gaussian, fragments.draw_state())? };
        require_modes(enabled, &state)?;
        fragments.gaussian = Some(Box::new(state.clone()));
        Ok(Self {
            source: source(device, graphics, gaussian)?,
            resolve: ResolveStage::new(device, graphics, gaussian, &fragments)?,
            dynamic_rules: DynamicRules::new(allowed, enabled, state.sh_degree),
            state: Arc::new(state),
            dynamic: taken.collect(),
            fixed: fragments,
            viewport: fixed(
                "viewport",
                graphics.is_dynamic(vk::DynamicState::VIEWPORT)
                    || graphics.is_dynamic(vk::DynamicState::VIEWPORT_WITH_COUNT),
                &graphics.pre_rasterization.viewports,
            )?
            .map(convert::viewport),
            scissor: fixed(
                "scissor",
                graphics.is_dynamic(vk::DynamicState::SCISSOR)
                    || graphics.is_dynamic(vk::DynamicState::SCISSOR_WITH_COUNT),
                &graphics.pre_rasterization.scissors,
            )?
            .map(convert::rect),
            camera: camera_source(graphics, gaussian, enabled)?,
            view_mask,
        })
    }
}

/// The source of Gaussians.
fn source(
    device: &Device,
    graphics: &GraphicsState,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
) -> Result<GaussianSource, Error> {
    if is_shaded(gaussian) {
        let projection = VertexProjection::new(device, graphics, gaussian)?;
        return Ok(GaussianSource::VertexShader(projection));
    }
    let locations = &gaussian.attribute_locations;
    for (name, location) in
        [("firstModelMatrix", locations.first_model_matrix), ("modelOpacity", locations.model_opacity)]
    {
        if location != GAUSSIAN_LOCATION_UNUSED_GAURAST {
            require(device.enabled(), &INSTANCING, &format!("{name} is used"))?;
        }
    }
    let degree = gaussian.spherical_harmonics_degree;
    let coefficients = (degree + 1) * (degree + 1);
    let in_buffer = gaussian.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER);
    if in_buffer {
        let what = "flags has SPHERICAL_HARMONICS_BUFFER";
        require(device.enabled(), &HARMONICS_BUFFER, what)?;
    }
    let decoding = DecodingState::new(graphics, gaussian, device.enabled())?;
    let coefficients = if in_buffer { 0 } else { decoding.harmonics_attributes(coefficients) };
    distinct_locations(locations, coefficients)?;
    let first = locations.first_spherical_harmonics;
    let scales = match gaussian.geometry {
        GaussianGeometryGAURAST::GAUSSIAN_2D => 2,
        _ => 3,
    };
    let decoded = |name, method, components| Decoded {
        name,
        method,
        components,
        plain_components: components,
        may_be_word: method == Method::Chunk && components == 3,
    };
    let position = decoded("position", decoding.position, 3);
    let scale = Decoded { plain_components: scales, ..decoded("scale", decoding.scale, 3) };
    let opacity = decoded("opacity", decoding.opacity, 1);
    let color = Decoded { may_be_word: true, ..decoded("spherical harmonics coefficient 0", decoding.color, 3) };
    let sources = GaussianAttributeSources {
        position: position.source(graphics, locations.position)?,
        scale: scale.source(graphics, locations.scale)?,
        rotation: decoding.rotation_source(graphics, locations.rotation)?,
        opacity: opacity.source(graphics, locations.opacity)?,
        spherical_harmonics: if in_buffer {
            HarmonicsSource::Buffer
        } else {
            let all = (0..coefficients).map(|k| match k {
                0 => color.source(graphics, first),
                _ => {
                    let name = format!("spherical harmonics coefficient {k}");
                    attribute(graphics, &name, first.saturating_add(k), 3)
                }
            });
            HarmonicsSource::Attributes(all.collect::<Result<_, _>>()?)
        },
        activations: Activations {
            log_scale: gaussian.flags.contains(Flags::LOG_SCALE),
            logit_opacity: gaussian.flags.contains(Flags::LOGIT_OPACITY),
            decodings: Decodings::default(),
        },
        decoding,
        model_matrix: match locations.first_model_matrix {
            GAUSSIAN_LOCATION_UNUSED_GAURAST => None,
            first => {
                let row = |k| attribute(graphics, "a model matrix's row", first.saturating_add(k), 4);
                Some([row(0)?, row(1)?, row(2)?])
            }
        },
        model_opacity: match locations.model_opacity {
            GAUSSIAN_LOCATION_UNUSED_GAURAST => None,
            location => Some(attribute(graphics, "modelOpacity", location, 1)?),
        },
    };
    Ok(GaussianSource::Attributes(Box::new(sources)))
}

/// The first element of a static state; None if the state is dynamic.
fn fixed<T: Copy>(name: &str, dynamic: bool, values: &[T]) -> Result<Option<T>, Error> {
    match (dynamic, values.first()) {
        (true, _) => Ok(None),
        (false, Some(&value)) => Ok(Some(value)),
        (false, None) => Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-04130",
            format!("the pipeline has no {name}, and its {name} is not dynamic"),
        )),
    }
}

fn state(gaussian: &PipelineGaussianStateCreateInfoGAURAST, fragments: DrawState) -> Result<GaussianState, Error> {
    let opacity_compensated =
        values::is_compensated(gaussian.antialiasing).ok_or_else(|| unknown("antialiasing", &gaussian.antialiasing))?;
    let order = values::order(gaussian.order).ok_or_else(|| unknown("order", &gaussian.order))?;
    Ok(GaussianState {
        precision: match gaussian.precision {
            GaussianPrecisionGAURAST::FLOAT16 => GaussianPrecision::Float16,
            _ => GaussianPrecision::Float32,
        },
        // Gaussians that a vertex shader projects have neither.
        geometry: match gaussian.geometry {
            GaussianGeometryGAURAST::GAUSSIAN_2D if !is_shaded(gaussian) => GaussianGeometry::Surfel,
            _ => GaussianGeometry::Volume,
        },
        sh_degree: if is_shaded(gaussian) { 0 } else { gaussian.spherical_harmonics_degree },
        linearization: match gaussian.linearization {
            GaussianLinearizationGAURAST::UNSCENTED if !is_shaded(gaussian) => GaussianLinearization::Unscented,
            _ => GaussianLinearization::Jacobian,
        },
        order,
        opacity_compensated,
        low_pass_variance: gaussian.low_pass_variance,
        alpha_floor: gaussian.alpha_floor,
        alpha_ceiling: gaussian.alpha_ceiling,
        transmittance_floor: gaussian.transmittance_floor,
        approximation: GaussianApproximation::default(),
        footprint: GaussianFootprint::default(),
        unscented: UnscentedTransform::default(),
        sample_mask: fragments.sample_mask,
        depth_stencil: fragments.depth_stencil,
        negative_one_to_one: fragments.negative_one_to_one,
        logic_op: fragments.logic_op,
        blend: fragments.blend,
        blend_constants: fragments.blend_constants,
    })
}

/// The source of draws' camera.
fn camera_source(
    graphics: &GraphicsState,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    enabled: &Enabled,
) -> Result<CameraSource, Error> {
    match gaussian.camera_source {
        _ if is_shaded(gaussian) => return Ok(CameraSource::None),
        GaussianCameraSourceGAURAST::COMMAND => return Ok(CameraSource::Command),
        GaussianCameraSourceGAURAST::UNIFORM_BUFFER => {}
        other => return Err(unknown("cameraSource", &other)),
    }
    require(enabled, &UNIFORM_BUFFER_CAMERA, "cameraSource is UNIFORM_BUFFER")?;
    let (set, binding) = (gaussian.camera_set, gaussian.camera_binding);
    let is_there = graphics.layout.as_ref().is_some_and(|layout| {
        let found = layout.set_layout(set).ok();
        found.and_then(|set| set.binding(binding)).is_some_and(holds_camera)
    });
    if !is_there {
        return Err(Error::usage(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025",
            format!(
                "{STRUCTURE}: the pipeline layout has no uniform buffer visible to the vertex stage at set {set}, \
                 binding {binding}, where cameraSet and cameraBinding want one"
            ),
        ));
    }
    let count = gaussian.camera_count;
    let views = u32::BITS - graphics.pre_rasterization.view_mask.leading_zeros();
    if count == 0 || count > 1 && count < views {
        return Err(Error::usage(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraCount-90026",
            format!(
                "{STRUCTURE}: cameraCount is {count}, but must be 1, for all views, or greater than the greatest view \
                 index of view mask {:#b}",
                graphics.pre_rasterization.view_mask
            ),
        ));
    }
    Ok(CameraSource::UniformBuffer { set, binding, count })
}

/// Reports whether a binding is a uniform buffer that the vertex stage can access.
fn holds_camera(binding: &LayoutBinding) -> bool {
    let is_uniform =
        matches!(binding.kind, vk::DescriptorType::UNIFORM_BUFFER | vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC);
    is_uniform && binding.count > 0 && binding.stages.contains(vk::ShaderStageFlags::VERTEX)
}
