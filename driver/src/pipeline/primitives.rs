//! Pipelines of points, lines and triangles: shader stages translated, checked and linked, and fixed-function state.

use super::dynamic_state;
use super::link::{self, LiveOutputs};
use super::stages::{self, ProgramResources};
use super::state::{
    self, AttributeSource, Class, FixedFunctionState, GraphicsState, live_color_outputs,
    reads_second_source,
};
use crate::abi::error::Error;
use crate::device::Device;
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast_spirv::{ScalarType, Stage};
use simdevice::program::vertex::DrawPipeline;
use simdevice::state::{DrawState, PolygonMode};
use std::sync::Arc;

/// A pipeline of points, lines or triangles.
#[derive(Debug)]
pub(crate) struct PrimitivePipeline {
    /// The programs.
    pub(crate) programs: Arc<DrawPipeline>,
    /// The sources of the vertex program's attributes, unless they are dynamic.
    pub(crate) attributes: Vec<AttributeSource>,
    /// The locations that the vertex program reads, if their sources are dynamic.
    pub(crate) dynamic_locations: Option<Vec<(u32, ScalarType)>>,
    /// The resources that the vertex program is bound to.
    pub(crate) vertex_resources: ProgramResources,
    /// The resources that the fragment program is bound to.
    pub(crate) fragment_resources: ProgramResources,
    /// The static fixed-function state.
    pub(crate) fixed: FixedFunctionState,
    /// The state for the device, if no state is dynamic.
    pub(crate) state: Option<Arc<DrawState>>,
    /// The dynamic states, except for viewports and scissors.
    pub(crate) dynamic: Vec<vk::DynamicState>,
    /// The source of viewports.
    pub(crate) viewports: ViewportSource,
    /// The source of scissors.
    pub(crate) scissors: ViewportSource,
}

/// The source of viewports or scissors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ViewportSource {
    /// The pipeline sets them.
    Static,
    /// The command buffer sets this number of them.
    Dynamic(u32),
    /// The command buffer sets them with their number.
    DynamicWithCount,
}

impl PrimitivePipeline {
    /// Translates and links the stages, and validates and converts the state.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(crate) fn new(device: &Device, info: &GraphicsState) -> Result<Self, Error> {
        if !device.features().primitive_topology_list_restart {
            info.require_no_list_restart()?;
        }
        let mut fixed = FixedFunctionState::new(info)?;
        fixed.draw.unrestricted_depth = device.has(ash::ext::depth_range_unrestricted::NAME);
        let (dynamic, viewports, scissors) = dynamic(info)?;
        let layout = info.layout.ok_or_else(|| {
            Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-layout-06602",
                "the pipeline has no layout",
            )
        })?;
        let stages = Stages::find(info)?;
        let samples = fixed.draw.samples;
        let vertex = stages::translate(device, layout, stages.vertex, Stage::Vertex, samples)?;
        let fragment = stages
            .fragment
            .map(|stage| stages::translate(device, layout, stage, Stage::Fragment, samples))
            .transpose()?;
        let locations = vertex.interface.locations_read();
        let is_dynamic = info.is_dynamic(vk::DynamicState::VERTEX_INPUT_EXT);
        let attributes = if is_dynamic {
            Vec::new()
        } else {
            stages::attributes(&info.vertex_input, &locations)?
        };
        if let Some(fragment) = &fragment {
            stages::warn_of_unwritten(device, &vertex.interface, &fragment.interface);
        }
        let vertex_resources = ProgramResources::new(device, &vertex.interface);
        let fragment_resources = fragment.as_ref().map_or_else(Default::default, |fragment| {
            ProgramResources::new(device, &fragment.interface)
        });
        let color = live_color_outputs(info, &fixed);
        let live_outputs = LiveOutputs {
            color: &color,
            second_source: info.fragment_output.blend.iter().any(reads_second_source)
                || info.is_dynamic(vk::DynamicState::COLOR_BLEND_EQUATION_EXT),
            points: state::class(fixed.draw.topology) == Class::Points
                || info.is_dynamic(vk::DynamicState::POLYGON_MODE_EXT)
                || fixed.draw.polygon_mode == PolygonMode::Point,
            views: info.fragment_output.view_mask != 0,
        };
        let stream = |location| locations.iter().position(|(read, _)| *read == location);
        let programs = link::link(vertex, fragment, stream, live_outputs)?;
        let programs = DrawPipeline::new(device.simulated().level(), &programs)
            .map_err(|error| Error::InvalidShader(error.to_string()))?;
        let is_static = dynamic.is_empty()
            && viewports == ViewportSource::Static
            && scissors == ViewportSource::Static;
        Ok(Self {
            programs: Arc::new(programs),
            attributes,
            dynamic_locations: is_dynamic.then_some(locations),
            vertex_resources,
            fragment_resources,
            state: is_static.then(|| Arc::new(fixed.draw_state())),
            fixed,
            dynamic,
            viewports,
            scissors,
        })
    }
}

/// The stages of a pipeline.
struct Stages<'a> {
    vertex: &'a ShaderStage<'a>,
    /// The fragment stage; None if nothing is rasterized.
    fragment: Option<&'a ShaderStage<'a>>,
}

impl<'a> Stages<'a> {
    fn find(info: &'a GraphicsState) -> Result<Self, Error> {
        let known = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        if let Some((stage, _)) = info.stages().find(|(stage, _)| !known.contains(*stage)) {
            return Err(Error::FeatureNotPresent(format!(
                "a shader stage {stage:?}"
            )));
        }
        let find = |wanted| {
            let mut found = info.stages().filter(move |(stage, _)| *stage == wanted);
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
                    info.vertex_input.topology
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

/// The dynamic states, and the sources of viewports and scissors.
fn dynamic(
    info: &GraphicsState,
) -> Result<(Vec<vk::DynamicState>, ViewportSource, ViewportSource), Error> {
    use vk::DynamicState as S;
    let (mut viewports, mut scissors) = (ViewportSource::Static, ViewportSource::Static);
    let mut dynamic = Vec::new();
    for &state in info.dynamic {
        match state {
            S::VIEWPORT => {
                viewports = ViewportSource::Dynamic(info.pre_rasterization.viewport_count);
            }
            S::VIEWPORT_WITH_COUNT => viewports = ViewportSource::DynamicWithCount,
            S::SCISSOR => scissors = ViewportSource::Dynamic(info.pre_rasterization.scissor_count),
            S::SCISSOR_WITH_COUNT => scissors = ViewportSource::DynamicWithCount,
            state if dynamic_state::has_value(state) => dynamic.push(state),
            // Attribute streams are looked up for each draw.
            state if dynamic_state::is_supported(state) => {}
            other => {
                return Err(Error::FeatureNotPresent(format!(
                    "the dynamic state {other:?}"
                )));
            }
        }
    }
    Ok((dynamic, viewports, scissors))
}
