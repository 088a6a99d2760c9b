//! Pipelines of points, lines and triangles: shader stages translated, checked and linked, and fixed-function state.

use super::dynamic_state;
use super::layout::PipelineLayout;
use super::link::{self, StageShaders};
use super::link_primitives::{self, TessellationShaders};
use super::parts::GraphicsState;
use super::stages::{self, ProgramResources};
use super::state::{
    self, AttributeSource, Class, FixedFunctionState, live_color_outputs, reads_second_source, uses_coverage_alpha,
};
use super::varyings::LiveOutputs;
use crate::abi::error::Error;
use crate::device::Device;
use crate::physical_device::limits;
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast_spirv::{ScalarType, Shader, Stage};
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
    /// The resources that the tessellation control program is bound to.
    pub(crate) control_resources: ProgramResources,
    /// The resources that the tessellation evaluation program is bound to.
    pub(crate) evaluation_resources: ProgramResources,
    /// The resources that the geometry program is bound to.
    pub(crate) geometry_resources: ProgramResources,
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
    pub(crate) fn new(device: &Device, graphics: &GraphicsState) -> Result<Self, Error> {
        if !device.features().primitive_topology_list_restart {
            graphics.require_no_list_restart().or_else(|error| device.enabled().tolerate(error))?;
        }
        let mut fixed = FixedFunctionState::new(graphics)?;
        fixed.draw.unrestricted_depth = device.has(ash::ext::depth_range_unrestricted::NAME);
        let (dynamic, viewports, scissors) = dynamic(graphics)?;
        let layout = graphics.layout.as_ref().ok_or_else(|| {
            Error::usage("VUID-VkGraphicsPipelineCreateInfo-layout-06602", "the pipeline has no layout")
        })?;
        let stages = Stages::find(device, graphics)?;
        let mut shaders = stages.translate(device, layout, fixed.draw.samples)?;
        if let Some(fragment) = &mut shaders.fragment {
            link::place_outputs(fragment, &graphics.fragment_output.color_locations);
        }
        link_primitives::check(
            shaders.tessellation.as_ref(),
            shaders.geometry.as_ref(),
            (!graphics.is_dynamic(vk::DynamicState::PRIMITIVE_TOPOLOGY)).then_some(fixed.draw.topology),
        )?;
        let locations = shaders.vertex.interface.locations_read();
        let is_dynamic = graphics.is_dynamic(vk::DynamicState::VERTEX_INPUT_EXT);
        let attributes =
            if is_dynamic { Vec::new() } else { stages::attributes(&graphics.vertex_input.input, &locations)? };
        if let Some(fragment) = &shaders.fragment {
            let last = &shaders.last().interface;
            stages::warn_of_unwritten(device, last, &fragment.interface);
        }
        let resources = |shader: Option<&Shader>| {
            shader.map_or_else(Default::default, |shader| ProgramResources::new(device, &shader.interface))
        };
        let tessellation = shaders.tessellation.as_ref();
        let vertex_resources = resources(Some(&shaders.vertex));
        let control_resources = resources(tessellation.map(|it| &it.control));
        let evaluation_resources = resources(tessellation.map(|it| &it.evaluation));
        let geometry_resources = resources(shaders.geometry.as_ref());
        let fragment_resources = resources(shaders.fragment.as_ref());
        let color = live_color_outputs(graphics, &fixed);
        let live_outputs = LiveOutputs {
            color: &color,
            coverage_alpha: uses_coverage_alpha(graphics, &fixed),
            second_source: graphics.fragment_output.blend.iter().any(reads_second_source)
                || graphics.is_dynamic(vk::DynamicState::COLOR_BLEND_EQUATION_EXT),
            points: state::class(fixed.draw.topology) == Class::Points
                || graphics.is_dynamic(vk::DynamicState::PRIMITIVE_TOPOLOGY)
                || shaders.geometry.is_some()
                || shaders.tessellation.is_some()
                || graphics.is_dynamic(vk::DynamicState::POLYGON_MODE_EXT)
                || fixed.draw.polygon_mode == PolygonMode::Point,
            views: graphics.pre_rasterization.view_mask != 0,
        };
        let stream = |location| locations.iter().position(|(read, _)| *read == location);
        let programs = link::link(shaders, stream, live_outputs);
        let programs = DrawPipeline::new(device.simulated().level(), &programs)
            .map_err(|error| Error::InvalidShader(error.to_string()))?;
        let is_static = dynamic.is_empty() && viewports == ViewportSource::Static && scissors == ViewportSource::Static;
        Ok(Self {
            programs: Arc::new(programs),
            attributes,
            dynamic_locations: is_dynamic.then_some(locations),
            vertex_resources,
            control_resources,
            evaluation_resources,
            geometry_resources,
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
    vertex: &'a ShaderStage,
    /// The tessellation control and evaluation stages.
    tessellation: Option<[&'a ShaderStage; 2]>,
    geometry: Option<&'a ShaderStage>,
    /// The fragment stage; None if nothing is rasterized.
    fragment: Option<&'a ShaderStage>,
}

impl<'a> Stages<'a> {
    fn find(device: &Device, graphics: &'a GraphicsState) -> Result<Self, Error> {
        use vk::ShaderStageFlags as F;
        let known = F::VERTEX | F::TESSELLATION_CONTROL | F::TESSELLATION_EVALUATION | F::GEOMETRY | F::FRAGMENT;
        if let Some((stage, _)) = graphics.stages().find(|(stage, _)| !known.contains(*stage)) {
            return Err(Error::FeatureNotPresent(format!("a shader stage {stage:?}")));
        }
        let find = |wanted| {
            let mut found = graphics.stages().filter(move |(stage, _)| *stage == wanted);
            match (found.next(), found.next()) {
                (_, Some(_)) => Err(Error::usage(
                    "VUID-VkGraphicsPipelineCreateInfo-stage-06897",
                    format!("the pipeline has several {wanted:?} stages"),
                )),
                (first, None) => Ok(first.map(|(_, stage)| stage)),
            }
        };
        let vertex = find(F::VERTEX)?.ok_or_else(|| {
            Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-stage-02096",
                format!("a pipeline of topology {:?} has no vertex stage", graphics.vertex_input.topology),
            )
        })?;
        let control = find(F::TESSELLATION_CONTROL)?;
        let evaluation = find(F::TESSELLATION_EVALUATION)?;
        let tessellation = match (control, evaluation) {
            (None, None) => None,
            (Some(control), Some(evaluation)) => Some([control, evaluation]),
            (Some(_), None) => {
                return Err(Error::usage(
                    "VUID-VkGraphicsPipelineCreateInfo-pStages-00729",
                    "there is a tessellation control stage without an evaluation stage",
                ));
            }
            (None, Some(_)) => {
                return Err(Error::usage(
                    "VUID-VkGraphicsPipelineCreateInfo-pStages-00730",
                    "there is a tessellation evaluation stage without a control stage",
                ));
            }
        };
        let geometry = find(F::GEOMETRY)?;
        let fragment = find(F::FRAGMENT)?;
        require_features(device, tessellation.is_some(), geometry.is_some())?;
        check_adjacency(device, graphics.vertex_input.topology)?;
        check_patches(graphics, tessellation.is_some())?;
        Ok(Self { vertex, tessellation, geometry, fragment: fragment.filter(|_| !graphics.discards()) })
    }

    /// Translates all stages.
    fn translate(&self, device: &Device, layout: &PipelineLayout, samples: u32) -> Result<StageShaders, Error> {
        let translate = |stage: &ShaderStage, kind| stages::translate(device, layout, stage, kind, samples);
        let optional = |stage: Option<&ShaderStage>, kind| stage.map(|stage| translate(stage, kind)).transpose();
        Ok(StageShaders {
            vertex: translate(self.vertex, Stage::Vertex)?,
            tessellation: match self.tessellation {
                Some([control, evaluation]) => Some(TessellationShaders {
                    control: translate(control, Stage::TessellationControl)?,
                    evaluation: translate(evaluation, Stage::TessellationEvaluation)?,
                }),
                None => None,
            },
            geometry: optional(self.geometry, Stage::Geometry)?,
            fragment: optional(self.fragment, Stage::Fragment)?,
        })
    }
}

/// Requires the features of stages.
fn require_features(device: &Device, tessellates: bool, has_geometry: bool) -> Result<(), Error> {
    let (enabled, features) = (device.enabled(), device.features());
    enabled.require(!tessellates || features.tessellation_shader, || {
        Error::usage(
            "VUID-VkPipelineShaderStageCreateInfo-stage-00705",
            "the pipeline has tessellation stages, and tessellationShader is not enabled",
        )
    })?;
    enabled.require(!has_geometry || features.geometry_shader, || {
        Error::usage(
            "VUID-VkPipelineShaderStageCreateInfo-stage-00704",
            "the pipeline has a geometry stage, and geometryShader is not enabled",
        )
    })
}

/// Requires the feature of a topology with adjacent vertices.
fn check_adjacency(device: &Device, topology: vk::PrimitiveTopology) -> Result<(), Error> {
    use vk::PrimitiveTopology as T;
    let is_adjacent = matches!(
        topology,
        T::LINE_LIST_WITH_ADJACENCY
            | T::LINE_STRIP_WITH_ADJACENCY
            | T::TRIANGLE_LIST_WITH_ADJACENCY
            | T::TRIANGLE_STRIP_WITH_ADJACENCY
    );
    device.enabled().require(!is_adjacent || device.features().geometry_shader, || {
        Error::usage(
            "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-00429",
            format!("the topology is {topology:?}, and geometryShader is not enabled"),
        )
    })
}

/// Refuses patches without tessellation, and tessellation of other primitives.
fn check_patches(graphics: &GraphicsState, tessellates: bool) -> Result<(), Error> {
    let topology = graphics.vertex_input.topology;
    let has_patches = topology == vk::PrimitiveTopology::PATCH_LIST;
    if has_patches && !tessellates {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-topology-00737",
            "the topology is PATCH_LIST, and there are no tessellation stages",
        ));
    }
    if tessellates && !has_patches && !graphics.is_dynamic(vk::DynamicState::PRIMITIVE_TOPOLOGY) {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-pStages-00736",
            format!("there are tessellation stages, and the topology is {topology:?}"),
        ));
    }
    let points = graphics.pre_rasterization.patch_control_points;
    let is_dynamic = graphics.is_dynamic(vk::DynamicState::PATCH_CONTROL_POINTS_EXT);
    if tessellates && !is_dynamic && !(1..=limits::MAX_PATCH_SIZE).contains(&points) {
        return Err(Error::usage(
            "VUID-VkPipelineTessellationStateCreateInfo-patchControlPoints-01214",
            format!("patchControlPoints is {points}, not 1 to maxTessellationPatchSize ({})", limits::MAX_PATCH_SIZE),
        ));
    }
    Ok(())
}

/// The dynamic states, and the sources of viewports and scissors.
fn dynamic(graphics: &GraphicsState) -> Result<(Vec<vk::DynamicState>, ViewportSource, ViewportSource), Error> {
    use vk::DynamicState as S;
    let (mut viewports, mut scissors) = (ViewportSource::Static, ViewportSource::Static);
    let mut dynamic = Vec::new();
    for &state in &graphics.dynamic {
        match state {
            S::VIEWPORT => {
                viewports = ViewportSource::Dynamic(graphics.pre_rasterization.viewport_count);
            }
            S::VIEWPORT_WITH_COUNT => viewports = ViewportSource::DynamicWithCount,
            S::SCISSOR => scissors = ViewportSource::Dynamic(graphics.pre_rasterization.scissor_count),
            S::SCISSOR_WITH_COUNT => scissors = ViewportSource::DynamicWithCount,
            state if dynamic_state::has_value(state) => dynamic.push(state),
            // Attribute streams are looked up for each draw.
            state if dynamic_state::is_supported(state) => {}
            other => {
                return Err(Error::FeatureNotPresent(format!("the dynamic state {other:?}")));
            }
        }
    }
    Ok((dynamic, viewports, scissors))
}
