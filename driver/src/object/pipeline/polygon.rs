//! Pipelines of points, lines and triangles: shader stages translated, checked and linked, and fixed-function state.

use super::compute::StageInfo;
use super::fixed::{self, Class, FixedState};
use super::layout::PipelineLayout;
use super::link::{self, Effects};
use super::reflect;
use super::vertex_input::{self, AttributeSource};
use super::{GraphicsPipelineInfo, blend};
use crate::capabilities::limits;
use crate::error::Error;
use crate::object::device::Device;
use ash::vk;
use gaurast_spirv::{Interface, Options, ScalarType, Shader, ShaderBinding, Stage};
use simdevice::format;
use simdevice::program::vertex::DrawPipeline;
use simdevice::state::{DrawState, PolygonMode};
use std::sync::Arc;

/// A pipeline of points, lines or triangles.
#[derive(Debug)]
pub(crate) struct PolygonPipeline {
    /// The programs.
    pub(crate) programs: Arc<DrawPipeline>,
    /// What the vertex program's attributes count in.
    pub(crate) attributes: Vec<AttributeSource>,
    /// What the vertex program is bound to.
    pub(crate) vertex_descriptors: Vec<ShaderBinding>,
    /// What the fragment program is bound to.
    pub(crate) fragment_descriptors: Vec<ShaderBinding>,
    /// The fixed-function state, as far as it is static.
    pub(crate) fixed: FixedState,
    /// The state for the device, if nothing of it is dynamic.
    pub(crate) state: Option<Arc<DrawState>>,
    /// What the command buffer sets, but for viewports and scissors.
    pub(crate) dynamic: Vec<vk::DynamicState>,
    /// Where viewports come from.
    pub(crate) viewports: Origin,
    /// Where scissors come from.
    pub(crate) scissors: Origin,
}

/// Where viewports or scissors come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// The pipeline.
    Static,
    /// The command buffer; this many.
    Dynamic(u32),
    /// The command buffer, which also says how many.
    DynamicWithCount,
}

impl PolygonPipeline {
    /// Translates and links the stages, and validates and converts the state.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(super) fn new(device: &Device, info: &GraphicsPipelineInfo) -> Result<Self, Error> {
        let fixed = FixedState::new(info)?;
        let (dynamic, viewports, scissors) = dynamic(info)?;
        let layout = info.layout.ok_or_else(|| {
            Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-layout-06602",
                "the pipeline has no layout",
            )
        })?;
        let stages = Stages::find(info)?;
        let samples = fixed.draw.samples;
        let vertex = translate(device, layout, stages.vertex, Stage::Vertex, samples)?;
        let fragment = stages
            .fragment
            .map(|stage| translate(device, layout, stage, Stage::Fragment, samples))
            .transpose()?;
        let locations = vertex.interface.locations_read();
        let attributes = attributes(info, &locations)?;
        check_attributes(&vertex.interface, &locations, &attributes)?;
        if let Some(fragment) = &fragment {
            warn_of_unwritten(device, &vertex.interface, &fragment.interface);
        }
        let vertex_descriptors = vertex.interface.descriptors.clone();
        let fragment_descriptors = fragment
            .as_ref()
            .map_or_else(Vec::new, |fragment| fragment.interface.descriptors.clone());
        let color = color_effects(info, &fixed);
        let effects = Effects {
            color: &color,
            second_source: info.blend.iter().any(blend::reads_second_source),
            points: fixed::class(fixed.draw.topology) == Class::Points
                || fixed.draw.polygon_mode == PolygonMode::Point,
        };
        let stream = |location| locations.iter().position(|(read, _)| *read == location);
        let programs = link::link(vertex, fragment, stream, effects)?;
        let programs = DrawPipeline::new(device.simulated().level(), &programs)
            .map_err(|error| Error::InvalidShader(error.to_string()))?;
        let is_static =
            dynamic.is_empty() && viewports == Origin::Static && scissors == Origin::Static;
        Ok(Self {
            programs: Arc::new(programs),
            attributes,
            vertex_descriptors,
            fragment_descriptors,
            state: is_static.then(|| Arc::new(fixed.lower())),
            fixed,
            dynamic,
            viewports,
            scissors,
        })
    }
}

/// The stages of a pipeline.
struct Stages<'a> {
    vertex: &'a StageInfo<'a>,
    /// Absent if nothing is rasterized.
    fragment: Option<&'a StageInfo<'a>>,
}

impl<'a> Stages<'a> {
    fn find(info: &'a GraphicsPipelineInfo) -> Result<Self, Error> {
        let known = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        if let Some((stage, _)) = info
            .stages
            .iter()
            .find(|(stage, _)| !known.contains(*stage))
        {
            return Err(Error::FeatureNotPresent(format!(
                "a shader stage {stage:?}"
            )));
        }
        let find = |wanted| {
            let mut found = info
                .stages
                .iter()
                .filter(move |(stage, _)| *stage == wanted);
            match (found.next(), found.next()) {
                (_, Some(_)) => Err(Error::usage(
                    "VUID-VkGraphicsPipelineCreateInfo-stage-06897",
                    format!("the pipeline has several {wanted:?} stages"),
                )),
                (first, None) => Ok(first.map(|(_, stage)| stage)),
            }
        };
        let vertex = find(vk::ShaderStageFlags::VERTEX)?.ok_or_else(|| {
            Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-stage-02096",
                format!(
                    "a pipeline of topology {:?} has no vertex stage",
                    info.topology
                ),
            )
        })?;
        let fragment = find(vk::ShaderStageFlags::FRAGMENT)?;
        Ok(Self {
            vertex,
            fragment: fragment.filter(|_| !info.discards()),
        })
    }
}

/// Translates a stage and compares it with the layout.
pub(super) fn translate(
    device: &Device,
    layout: &PipelineLayout,
    stage: &StageInfo,
    kind: Stage,
    samples: u32,
) -> Result<Shader, Error> {
    if stage.required_subgroup_size.is_some() {
        return Err(Error::usage(
            "VUID-VkPipelineShaderStageRequiredSubgroupSizeCreateInfo-pNext-02755",
            format!("the {kind} stage is not in requiredSubgroupSizeStages"),
        ));
    }
    let options = Options {
        subgroup_size: limits::SUBGROUP_SIZE,
        samples,
        unsized_descriptors: layout.longest_binding(),
    };
    let shader = stage
        .module
        .translate(stage.name, kind, &stage.specialization, &options)?;
    if shader.interface.uses_subgroups {
        return Err(Error::FeatureNotPresent(format!(
            "a subgroup operation in the {kind} shader (subgroupSupportedStages)"
        )));
    }
    layout.check(&shader.interface)?;
    if device.dumps_ir() {
        eprintln!("{kind} shader {}:\n{}", stage.name, shader.program);
    }
    Ok(shader)
}

/// Where each location is read from.
pub(super) fn attributes(
    info: &GraphicsPipelineInfo,
    locations: &[(u32, ScalarType)],
) -> Result<Vec<AttributeSource>, Error> {
    let source = |&(location, _): &(u32, ScalarType)| {
        vertex_input::source(info, location).map_err(|what| {
            Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-Input-07904",
                format!("the vertex shader reads location {location}, {what}"),
            )
        })
    };
    locations.iter().map(source).collect()
}

/// Compares the types of attributes with what the shader reads.
pub(super) fn check_attributes(
    interface: &Interface,
    locations: &[(u32, ScalarType)],
    attributes: &[AttributeSource],
) -> Result<(), Error> {
    let given = |format: simdevice::Format| match format.numeric() {
        format::Numeric::Uint => ScalarType::Uint { width: 32 },
        format::Numeric::Sint => ScalarType::Int { width: 32 },
        _ => ScalarType::Float { width: 32 },
    };
    let described: Vec<_> = std::iter::zip(locations, attributes)
        .map(|(&(location, _), source)| reflect::Attribute {
            location,
            numeric: given(source.format),
        })
        .collect();
    let mismatches = reflect::check_attributes(interface, &described);
    if mismatches.is_empty() {
        return Ok(());
    }
    let messages: Vec<_> = mismatches.iter().map(ToString::to_string).collect();
    Err(Error::usage(
        "VUID-VkGraphicsPipelineCreateInfo-Input-08733",
        messages.join("; "),
    ))
}

/// Tells of inputs that the stage before doesn't write. They read as zero.
fn warn_of_unwritten(device: &Device, vertex: &Interface, fragment: &Interface) {
    for mismatch in reflect::check_stages(vertex, fragment) {
        let message = format!("{mismatch}; it reads as 0");
        log::warn!("{message}");
        device.instance().report(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION,
            "VUID-RuntimeSpirv-OpEntryPoint-08743",
            &message,
        );
    }
}

/// For each colour attachment, whether anything comes of its source.
pub(super) fn color_effects(info: &GraphicsPipelineInfo, fixed: &FixedState) -> Vec<bool> {
    let mut effects: Vec<_> = std::iter::zip(&fixed.draw.blend, &info.color_formats)
        .map(|(blend, format)| blend.write_mask != 0 && *format != vk::Format::UNDEFINED)
        .collect();
    if fixed.draw.alpha_to_coverage {
        match effects.first_mut() {
            Some(first) => *first = true,
            None => effects.push(true),
        }
    }
    effects
}

/// What is dynamic, and where viewports and scissors come from.
fn dynamic(info: &GraphicsPipelineInfo) -> Result<(Vec<vk::DynamicState>, Origin, Origin), Error> {
    use vk::DynamicState as S;
    let (mut viewports, mut scissors) = (Origin::Static, Origin::Static);
    let mut dynamic = Vec::new();
    for &state in info.dynamic {
        match state {
            S::VIEWPORT => viewports = Origin::Dynamic(info.viewport_count),
            S::VIEWPORT_WITH_COUNT => viewports = Origin::DynamicWithCount,
            S::SCISSOR => scissors = Origin::Dynamic(info.scissor_count),
            S::SCISSOR_WITH_COUNT => scissors = Origin::DynamicWithCount,
            // Attribute streams are looked up for each draw.
            S::VERTEX_INPUT_BINDING_STRIDE => {}
            S::LINE_WIDTH
            | S::DEPTH_BIAS
            | S::BLEND_CONSTANTS
            | S::DEPTH_BOUNDS
            | S::STENCIL_COMPARE_MASK
            | S::STENCIL_WRITE_MASK
            | S::STENCIL_REFERENCE
            | S::CULL_MODE
            | S::FRONT_FACE
            | S::PRIMITIVE_TOPOLOGY
            | S::DEPTH_TEST_ENABLE
            | S::DEPTH_WRITE_ENABLE
            | S::DEPTH_COMPARE_OP
            | S::DEPTH_BOUNDS_TEST_ENABLE
            | S::STENCIL_TEST_ENABLE
            | S::STENCIL_OP
            | S::RASTERIZER_DISCARD_ENABLE
            | S::DEPTH_BIAS_ENABLE
            | S::PRIMITIVE_RESTART_ENABLE => dynamic.push(state),
            other => {
                return Err(Error::FeatureNotPresent(format!(
                    "the dynamic state {other:?}"
                )));
            }
        }
    }
    Ok((dynamic, viewports, scissors))
}
