//! Pipelines of the Gaussian list topology.

mod approximation;
mod feature;
mod validate;

use super::fixed::FixedState;
use super::gaussian_stages::{ResolveStage, VertexProjection};
use super::vertex_input::attribute;
use super::{
    CameraSource, GaussianAttributeSources, GaussianPipeline, GaussianSource, GraphicsPipelineInfo,
    viewport,
};
use crate::error::Error;
use crate::lower::camera::CameraModels;
use crate::lower::rendering;
use crate::object::descriptor::layout::Binding;
use crate::object::device::Device;
use crate::registry::features::Features;
use ash::vk;
use feature::*;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST, GaussianAntialiasingGAURAST, GaussianCameraSourceGAURAST,
    GaussianGeometryGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, GaussianProjectionModeGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::state::DrawState;
use simdevice::state::gaussian::{
    GaussianApproximation, GaussianGeometry, GaussianLinearization, GaussianOrder,
    GaussianPrecision, GaussianState,
};
use std::sync::Arc;

/// The greatest degree of spherical harmonics that a pipeline may ask for.
pub(crate) const MAX_SPHERICAL_HARMONICS_DEGREE: u32 = 4;

const STRUCTURE: &str = "VkPipelineGaussianStateCreateInfoGAURAST";

impl GaussianPipeline {
    /// Validates and converts the Gaussian part of a pipeline.
    pub(super) fn new(device: &Device, info: &GraphicsPipelineInfo) -> Result<Self, Error> {
        let features = device.features();
        require(features, TOPOLOGY, "the topology is the Gaussian list")?;
        let Some(gaussian) = &info.gaussian else {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-topology-GAURAST",
                format!(
                    "a pipeline of topology VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST must chain a \
                     {STRUCTURE}; if a validation layer is enabled, name the structure to it with \
                     VK_LAYER_CUSTOM_STYPE_LIST"
                ),
            ));
        };
        validate::combinations(info, gaussian)?;
        validate::stages(info, gaussian, features)?;
        validate::modes(gaussian, features)?;
        validate::values(gaussian)?;
        let approximation = approximation::of(info, features)?;
        validate::fixed_state(info, features)?;
        let fragments = FixedState::of_gaussians(info)?;

        Ok(Self {
            source: source(device, info, gaussian)?,
            resolve: ResolveStage::new(device, info, gaussian, &fragments)?,
            state: Arc::new(GaussianState {
                approximation,
                ..state(gaussian, features, fragments.lower())?
            }),
            dynamic: info.dynamic.iter().copied().filter(is_taken).collect(),
            fixed: fragments,
            viewport: fixed(
                "viewport",
                info.is_dynamic(vk::DynamicState::VIEWPORT)
                    || info.is_dynamic(vk::DynamicState::VIEWPORT_WITH_COUNT),
                info.viewports,
            )?
            .map(viewport),
            scissor: fixed(
                "scissor",
                info.is_dynamic(vk::DynamicState::SCISSOR)
                    || info.is_dynamic(vk::DynamicState::SCISSOR_WITH_COUNT),
                info.scissors,
            )?
            .map(rendering::rect),
            camera: camera_source(info, gaussian, features)?,
            camera_models: CameraModels::of(features),
            merges_draws: gaussian
                .flags
                .contains(PipelineGaussianStateCreateFlagsGAURAST::MERGE_DRAWS),
        })
    }
}

/// Where Gaussians come from.
fn source(
    device: &Device,
    info: &GraphicsPipelineInfo,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
) -> Result<GaussianSource, Error> {
    if is_shaded(gaussian) {
        let projection = VertexProjection::new(device, info, gaussian)?;
        return Ok(GaussianSource::VertexShader(projection));
    }
    let locations = &gaussian.attribute_locations;
    for (name, location) in [
        ("firstModelMatrix", locations.first_model_matrix),
        ("modelOpacity", locations.model_opacity),
    ] {
        if location != GAUSSIAN_LOCATION_UNUSED_GAURAST {
            require(device.features(), INSTANCING, &format!("{name} is used"))?;
        }
    }
    let degree = gaussian.spherical_harmonics_degree;
    let coefficients = (degree + 1) * (degree + 1);
    let first = locations.first_spherical_harmonics;
    let scales = match gaussian.geometry {
        GaussianGeometryGAURAST::GAUSSIAN_2D => 2,
        _ => 3,
    };
    Ok(GaussianSource::Attributes(GaussianAttributeSources {
        position: attribute(info, "position", locations.position, 3)?,
        scale: attribute(info, "scale", locations.scale, scales)?,
        rotation: attribute(info, "rotation", locations.rotation, 4)?,
        opacity: attribute(info, "opacity", locations.opacity, 1)?,
        spherical_harmonics: (0..coefficients)
            .map(|k| {
                let name = format!("spherical harmonics coefficient {k}");
                attribute(info, &name, first.saturating_add(k), 3)
            })
            .collect::<Result<_, _>>()?,
        model_matrix: match locations.first_model_matrix {
            GAUSSIAN_LOCATION_UNUSED_GAURAST => None,
            first => {
                let row = |k| attribute(info, "a model matrix's row", first.saturating_add(k), 4);
                Some([row(0)?, row(1)?, row(2)?])
            }
        },
        model_opacity: match locations.model_opacity {
            GAUSSIAN_LOCATION_UNUSED_GAURAST => None,
            location => Some(attribute(info, "modelOpacity", location, 1)?),
        },
    }))
}

fn has_fragment_stage(info: &GraphicsPipelineInfo) -> bool {
    let mut stages = info.stages.iter();
    stages.any(|(stage, _)| *stage == vk::ShaderStageFlags::FRAGMENT)
}

/// Whether a vertex shader projects, so that what fixed-function projection is told is ignored.
fn is_shaded(gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> bool {
    gaussian.projection_mode == GaussianProjectionModeGAURAST::VERTEX_SHADER
}

/// The state's first element, unless it is dynamic.
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

fn state(
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &Features,
    fragments: DrawState,
) -> Result<GaussianState, Error> {
    let opacity_compensated = match gaussian.antialiasing {
        GaussianAntialiasingGAURAST::DILATE => false,
        GaussianAntialiasingGAURAST::OPACITY_COMPENSATED => {
            require(
                features,
                OPACITY_COMPENSATION,
                "antialiasing is OPACITY_COMPENSATED",
            )?;
            true
        }
        other => return Err(unknown("antialiasing", &other)),
    };
    let order = match gaussian.order {
        GaussianOrderGAURAST::VIEW_DEPTH => GaussianOrder::ViewDepth,
        GaussianOrderGAURAST::RADIAL_DISTANCE => {
            require(features, RADIAL_DISTANCE_ORDER, "order is RADIAL_DISTANCE")?;
            GaussianOrder::RadialDistance
        }
        GaussianOrderGAURAST::PRIMITIVE => {
            require(features, PRIMITIVE_ORDER, "order is PRIMITIVE")?;
            GaussianOrder::Primitive
        }
        GaussianOrderGAURAST::PER_PIXEL => {
            require(features, PER_PIXEL_ORDER, "order is PER_PIXEL")?;
            GaussianOrder::PerPixel
        }
        other => return Err(unknown("order", &other)),
    };
    Ok(GaussianState {
        precision: match gaussian.precision {
            GaussianPrecisionGAURAST::FLOAT16 => GaussianPrecision::Float16,
            _ => GaussianPrecision::Float32,
        },
        // What a vertex shader projects has neither.
        geometry: match gaussian.geometry {
            GaussianGeometryGAURAST::GAUSSIAN_2D if !is_shaded(gaussian) => {
                GaussianGeometry::Surfel
            }
            _ => GaussianGeometry::Volume,
        },
        sh_degree: if is_shaded(gaussian) {
            0
        } else {
            gaussian.spherical_harmonics_degree
        },
        linearization: match gaussian.linearization {
            GaussianLinearizationGAURAST::UNSCENTED if !is_shaded(gaussian) => {
                GaussianLinearization::Unscented
            }
            _ => GaussianLinearization::Jacobian,
        },
        order,
        opacity_compensated,
        low_pass_variance: gaussian.low_pass_variance,
        alpha_floor: gaussian.alpha_floor,
        alpha_ceiling: gaussian.alpha_ceiling,
        transmittance_floor: gaussian.transmittance_floor,
        approximation: GaussianApproximation::default(),
        sample_mask: fragments.sample_mask,
        depth_stencil: fragments.depth_stencil,
        logic_op: fragments.logic_op,
        blend: fragments.blend,
        blend_constants: fragments.blend_constants,
    })
}

/// Where draws take their camera from.
fn camera_source(
    info: &GraphicsPipelineInfo,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &Features,
) -> Result<CameraSource, Error> {
    match gaussian.camera_source {
        _ if is_shaded(gaussian) => return Ok(CameraSource::None),
        GaussianCameraSourceGAURAST::COMMAND => return Ok(CameraSource::Command),
        GaussianCameraSourceGAURAST::UNIFORM_BUFFER => {}
        other => return Err(unknown("cameraSource", &other)),
    }
    require(
        features,
        UNIFORM_BUFFER_CAMERA,
        "cameraSource is UNIFORM_BUFFER",
    )?;
    let (set, binding) = (gaussian.camera_set, gaussian.camera_binding);
    let is_there = info.layout.is_some_and(|layout| {
        let found = layout.set_layout(set).ok();
        found
            .and_then(|set| set.binding(binding))
            .is_some_and(holds_camera)
    });
    if !is_there {
        return Err(Error::usage(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-layout",
            format!(
                "{STRUCTURE}: the pipeline layout has no uniform buffer visible to the vertex stage at set {set}, \
                 binding {binding}, where cameraSet and cameraBinding want one"
            ),
        ));
    }
    Ok(CameraSource::UniformBuffer { set, binding })
}

/// Whether a binding is a uniform buffer that the vertex stage sees.
fn holds_camera(binding: &Binding) -> bool {
    let is_uniform = matches!(
        binding.kind,
        vk::DescriptorType::UNIFORM_BUFFER | vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC
    );
    is_uniform && binding.count > 0 && binding.stages.contains(vk::ShaderStageFlags::VERTEX)
}

/// Whether the state says what becomes of a Gaussian draw's fragments.
fn is_taken(state: &vk::DynamicState) -> bool {
    use vk::DynamicState as S;
    matches!(
        *state,
        S::BLEND_CONSTANTS
            | S::DEPTH_BOUNDS
            | S::DEPTH_BOUNDS_TEST_ENABLE
            | S::DEPTH_TEST_ENABLE
            | S::DEPTH_WRITE_ENABLE
            | S::DEPTH_COMPARE_OP
            | S::STENCIL_TEST_ENABLE
            | S::STENCIL_COMPARE_MASK
            | S::STENCIL_WRITE_MASK
            | S::STENCIL_REFERENCE
            | S::STENCIL_OP
    )
}
