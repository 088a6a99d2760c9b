//! The shader stages of Gaussian pipelines.

use crate::abi::error::Error;
use crate::device::Device;
use crate::pipeline::layout::PipelineLayout;
use crate::pipeline::link;
use crate::pipeline::parts::GraphicsState;
use crate::pipeline::stages::{self, ProgramResources};
use crate::pipeline::state::{
    AttributeSource, FixedFunctionState, live_color_outputs, reads_second_source, uses_coverage_alpha,
};
use crate::pipeline::varyings::{InterfaceComponent, LiveOutputs, Varyings};
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast::vk::{GAUSSIAN_LOCATION_UNUSED_GAURAST, PipelineGaussianStateCreateInfoGAURAST};
use gaurast_spirv::{BuiltIn, InputSource, Interface, OutputTarget, ScalarType, Stage};
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Rate, Type};
use simdevice::program::fragment::GaussianFragmentProgram;
use simdevice::program::interface::{
    FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling, gaussian, resolve,
};
use simdevice::program::vertex::DrawPipeline;
use std::sync::Arc;

/// A vertex shader that projects Gaussians.
#[derive(Debug)]
pub(crate) struct VertexProjection {
    /// The program.
    pub(crate) programs: Arc<DrawPipeline>,
    /// The sources of its attributes.
    pub(crate) attributes: Vec<AttributeSource>,
    /// The resources that it is bound to.
    pub(crate) resources: ProgramResources,
}

impl VertexProjection {
    /// Translates the vertex stage, and checks its inputs and outputs.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(crate) fn new(
        device: &Device,
        graphics: &GraphicsState,
        state: &PipelineGaussianStateCreateInfoGAURAST,
    ) -> Result<Self, Error> {
        let stage = find(graphics, vk::ShaderStageFlags::VERTEX).ok_or_else(|| {
            Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-projectionMode-90008",
                "projectionMode is VERTEX_SHADER, and there is no vertex stage",
            )
        })?;
        // A vertex stage doesn't depend on samples.
        let vertex = stages::translate(device, layout(graphics)?, stage, Stage::Vertex, 1)?;
        let components = components(state, &vertex.interface)?;
        let locations = vertex.interface.locations_read();
        let attributes = stages::attributes(&graphics.vertex_input.input, &locations)?;
        let resources = ProgramResources::new(device, &vertex.interface);
        let stream = |location| locations.iter().position(|(read, _)| *read == location);
        let programs = link::link_projection(vertex, stream, &components);
        let programs = DrawPipeline::of_gaussians(device.simulated().level(), &programs)
            .map_err(|error| Error::InvalidShader(error.to_string()))?;
        Ok(Self { programs: Arc::new(programs), attributes, resources })
    }
}

/// A resolve shader.
#[derive(Debug)]
pub(crate) struct ResolveStage {
    /// The program.
    pub(crate) program: Arc<GaussianFragmentProgram>,
    /// The resources that it is bound to.
    pub(crate) resources: ProgramResources,
    /// True if every sample is shaded separately.
    pub(crate) sample_shading: bool,
    /// True if alpha determines coverage.
    pub(crate) alpha_to_coverage: bool,
    /// True if alpha is then replaced by 1.
    pub(crate) alpha_to_one: bool,
}

impl ResolveStage {
    /// Translates the fragment stage, if there is one, and checks its inputs and outputs.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(crate) fn new(
        device: &Device,
        graphics: &GraphicsState,
        state: &PipelineGaussianStateCreateInfoGAURAST,
        fixed: &FixedFunctionState,
    ) -> Result<Option<Self>, Error> {
        let draw = &fixed.draw;
        let Some(stage) = find(graphics, vk::ShaderStageFlags::FRAGMENT) else {
            let is_needed = draw.alpha_to_coverage || draw.alpha_to_one;
            return is_needed.then(|| Self::passing(device, fixed)).transpose();
        };
        let mut fragment = stages::translate(device, layout(graphics)?, stage, Stage::Fragment, draw.samples)?;
        link::place_outputs(&mut fragment, &graphics.fragment_output.color_locations);
        let varyings = varyings(state)?;
        check_resolve(&fragment.interface, &varyings)?;
        let resources = ProgramResources::new(device, &fragment.interface);
        let color = live_color_outputs(graphics, fixed);
        let live_outputs = LiveOutputs {
            color: &color,
            coverage_alpha: uses_coverage_alpha(graphics, fixed),
            second_source: graphics.fragment_output.blend.iter().any(reads_second_source),
            points: false,
            views: graphics.pre_rasterization.view_mask != 0,
        };
        let programs = link::link_resolve(fragment, &varyings, live_outputs);
        let program = GaussianFragmentProgram::new(device.simulated().level(), &programs)
            .map_err(|error| Error::InvalidShader(error.to_string()))?;
        Ok(Some(Self {
            program: Arc::new(program),
            resources,
            sample_shading: draw.sample_shading,
            alpha_to_coverage: draw.alpha_to_coverage,
            alpha_to_one: draw.alpha_to_one,
        }))
    }
}

impl ResolveStage {
    /// A stage that leaves colours unchanged, so that alpha can determine coverage or be replaced by 1.
    fn passing(device: &Device, fixed: &FixedFunctionState) -> Result<Self, Error> {
        let mut builder = Builder::new();
        for slot in 0..4 {
            let input = builder.input(slot, Type::B32, Rate::Varying);
            let output = builder.output(slot, Type::B32);
            builder.assign(output, input);
        }
        let invalid = |error: &dyn std::fmt::Display| Error::InvalidShader(error.to_string());
        let input = |component| {
            Some(FragmentInput::Varying {
                index: resolve::ACCUMULATED + component,
                interpolation: Interpolation::Flat,
                sampling: Sampling::Center,
            })
        };
        let output = |component| Some(FragmentOutput::Color { attachment: 0, component, index: 0 });
        let programs = FragmentPrograms {
            program: builder.finish().map_err(|error| invalid(&error))?,
            inputs: (0..4).map(input).collect(),
            outputs: (0..4).map(output).collect(),
            early_tests: false,
            post_depth_coverage: false,
            discards: false,
            per_sample: false,
            has_side_effects: false,
        };
        let program = GaussianFragmentProgram::new(device.simulated().level(), &programs);
        Ok(Self {
            program: Arc::new(program.map_err(|error| invalid(&error))?),
            resources: ProgramResources::default(),
            sample_shading: false,
            alpha_to_coverage: fixed.draw.alpha_to_coverage,
            alpha_to_one: fixed.draw.alpha_to_one,
        })
    }
}

const RESOLVE_INPUTS: &str = "VUID-VkGaussianResolveInputLocationsGAURAST-None-90023";

/// The varyings that a resolve shader may read, by location and component.
fn varyings(state: &PipelineGaussianStateCreateInfoGAURAST) -> Result<Varyings, Error> {
    let locations = &state.resolve_input_locations;
    let inputs = [
        ("accumulatedColor", locations.accumulated_color, resolve::ACCUMULATED, 4),
        ("depth", locations.depth, resolve::EXPECTED_DEPTH, 2),
        ("linearDepth", locations.linear_depth, resolve::EXPECTED_LINEAR_DEPTH, 2),
        ("medianGaussian", locations.median_gaussian, resolve::MEDIAN_GAUSSIAN, 2),
        ("nearestGaussian", locations.nearest_gaussian, resolve::NEAREST_GAUSSIAN, 2),
        ("firstCamera", locations.first_camera, resolve::CAMERA, 4 * resolve::CAMERA_LOCATIONS),
    ];
    let mut varyings = Varyings::new();
    for (name, first, number, count) in inputs {
        if first == GAUSSIAN_LOCATION_UNUSED_GAURAST {
            continue;
        }
        for at in 0..count {
            let place = InterfaceComponent { location: first.saturating_add(at / 4), component: at % 4 };
            if varyings.insert(place, number + at).is_some() {
                return Err(Error::usage(
                    RESOLVE_INPUTS,
                    format!("{name} has location {}, as another input of the resolve shader has", place.location),
                ));
            }
        }
    }
    Ok(varyings)
}

/// Refuses inputs and outputs that a resolve shader can't have.
fn check_resolve(interface: &Interface, varyings: &Varyings) -> Result<(), Error> {
    for input in &interface.inputs {
        let InputSource::Location { location, component, .. } = input.source else {
            continue;
        };
        let wanted = varyings.get(&InterfaceComponent { location, component }).map(|number| {
            if (resolve::MEDIAN_GAUSSIAN..resolve::CAMERA).contains(number) {
                ScalarType::Uint { width: 32 }
            } else {
                ScalarType::Float { width: 32 }
            }
        });
        if wanted != Some(input.numeric) {
            return Err(Error::usage(
                RESOLVE_INPUTS,
                format!(
                    "the fragment shader reads component {component} of location {location} as {:?}, where \
                     resolveInputLocations has {}",
                    input.numeric,
                    wanted.map_or("nothing".to_owned(), |wanted| format!("{wanted:?}")),
                ),
            ));
        }
    }
    let writes = |wanted| {
        let mut outputs = interface.outputs.iter();
        outputs.any(|output| matches!(output.target, OutputTarget::BuiltIn { built_in, .. } if built_in == wanted))
    };
    if writes(BuiltIn::FragDepth) {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-FragDepth-90024",
            "the fragment shader writes FragDepth, but the depth of Gaussians is the median's",
        ));
    }
    if writes(BuiltIn::FragStencilRef) {
        return Err(Error::FeatureNotPresent("a stencil reference from the fragment shader of Gaussians".into()));
    }
    Ok(())
}

fn layout(graphics: &GraphicsState) -> Result<&Arc<PipelineLayout>, Error> {
    graphics
        .layout
        .as_ref()
        .ok_or_else(|| Error::usage("VUID-VkGraphicsPipelineCreateInfo-layout-06602", "the pipeline has no layout"))
}

/// A pipeline's stage of a kind.
fn find(graphics: &GraphicsState, wanted: vk::ShaderStageFlags) -> Option<&ShaderStage> {
    let mut stages = graphics.stages();
    let (_, stage) = stages.find(|(stage, _)| *stage == wanted)?;
    Some(stage)
}

/// The locations to which the vertex shader writes the device's inputs, in the order of the numbers of [`gaussian`].
fn components(
    state: &PipelineGaussianStateCreateInfoGAURAST,
    interface: &Interface,
) -> Result<Vec<InterfaceComponent>, Error> {
    let refuse = |what: String| {
        let vuid = "VUID-VkGaussianVertexOutputLocationsGAURAST-None-90020";
        Err(Error::usage(vuid, what))
    };
    let locations = &state.vertex_output_locations;
    let wanted = [
        ("covariance", locations.covariance, gaussian::COVARIANCE),
        ("opacity", locations.opacity, gaussian::OPACITY),
        ("color", locations.color, gaussian::COLOR),
        ("depthKey", locations.depth_key, gaussian::DEPTH_KEY),
    ];
    let mut components: Vec<InterfaceComponent> = Vec::new();
    for (name, location, first) in wanted {
        let is_key = first == gaussian::DEPTH_KEY;
        if is_key && location == GAUSSIAN_LOCATION_UNUSED_GAURAST {
            continue;
        }
        if location == GAUSSIAN_LOCATION_UNUSED_GAURAST {
            return refuse(format!("{name} is unused, but the pipeline reads it"));
        }
        if components.iter().any(|taken| taken.location == location) {
            return refuse(format!("{name} is location {location}, as another output is"));
        }
        let count = if first == gaussian::OPACITY || is_key { 1 } else { 3 };
        for component in 0..count {
            let place = InterfaceComponent { location, component };
            if !writes_float(interface, place) {
                return refuse(format!(
                    "{name} is location {location}, where the vertex shader writes no component \
                     {component} of 32-bit floating point"
                ));
            }
            components.push(place);
        }
    }
    Ok(components)
}

fn writes_float(interface: &Interface, place: InterfaceComponent) -> bool {
    interface.outputs.iter().any(|output| {
        let is_there = matches!(output.target, OutputTarget::Location { location, component, .. }
            if InterfaceComponent { location, component } == place);
        is_there && output.numeric == ScalarType::Float { width: 32 }
    })
}
