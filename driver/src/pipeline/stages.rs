//! Shader stages, translated and compared with the pipeline's layout and vertex input, and the resources that their
//! programs use.

use super::layout::PipelineLayout;
use super::link;
use super::parts::{GraphicsState, VertexInput};
use super::state::{AttributeSource, source};
use super::varyings::InterfaceComponent;
use crate::abi::error::Error;
use crate::device::Device;
use crate::device_addresses::Addresses;
use crate::physical_device::limits;
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast_spirv::{Interface, Options, ScalarType, Shader, ShaderBinding, Stage};
use simdevice::Format;
use simdevice::format::Numeric;
use std::sync::Arc;

/// The resources that a program uses.
#[derive(Debug, Default)]
pub(crate) struct ProgramResources {
    /// Its descriptors.
    pub(crate) descriptors: Vec<ShaderBinding>,
    /// The buffers that it may access by address; None if it uses no addresses.
    pub(crate) addresses: Option<Arc<Addresses>>,
    /// True if it writes to memory, and therefore may write through an address.
    pub(crate) writes: bool,
}

impl ProgramResources {
    /// The resources that a shader uses.
    pub(crate) fn new(device: &Device, interface: &Interface) -> Self {
        Self {
            descriptors: interface.descriptors.clone(),
            addresses: interface.uses_addresses.then(|| Arc::clone(device.addresses())),
            writes: interface.has_side_effects,
        }
    }
}

/// Translates a stage and compares it with the layout.
///
/// # Errors
/// [`Error::InvalidShader`], or [`Error::InvalidUsage`] if the stage does not fit the layout.
pub(crate) fn translate(
    device: &Device,
    layout: &PipelineLayout,
    stage: &ShaderStage,
    kind: Stage,
    samples: u32,
) -> Result<Shader, Error> {
    if stage.required_subgroup_size.is_some() {
        return Err(Error::usage(
            "VUID-VkPipelineShaderStageCreateInfo-pNext-02755",
            format!("the {kind} stage is not in requiredSubgroupSizeStages"),
        ));
    }
    let options = Options {
        subgroup_size: limits::SUBGROUP_SIZE,
        samples: if kind == Stage::Fragment { samples } else { 1 },
        unsized_descriptors: layout.longest_binding(),
        view_is_device: stage.view_is_device,
    };
    let shader = stage.translate(kind, &options)?;
    layout.check(&shader.interface)?;
    if device.dumps_ir() {
        eprintln!("{kind} shader {}:\n{}", stage.name, shader.program);
    }
    Ok(shader)
}

/// Translates the stages of a library for pipelines with one sample, and compares them with the layout. What needs other
/// options is translated again when it is linked.
///
/// # Errors
/// As [`translate`].
pub(crate) fn translate_library(device: &Device, graphics: &mut GraphicsState) -> Result<(), Error> {
    let Some(layout) = graphics.layout.clone() else {
        return Ok(());
    };
    let kind = |stage| match stage {
        vk::ShaderStageFlags::VERTEX => Some(Stage::Vertex),
        vk::ShaderStageFlags::TESSELLATION_CONTROL => Some(Stage::TessellationControl),
        vk::ShaderStageFlags::TESSELLATION_EVALUATION => Some(Stage::TessellationEvaluation),
        vk::ShaderStageFlags::GEOMETRY => Some(Stage::Geometry),
        vk::ShaderStageFlags::FRAGMENT => Some(Stage::Fragment),
        _ => None,
    };
    for (stage, shader) in graphics.stages_mut() {
        if let Some(kind) = kind(*stage)
            && shader.keep_translations()
        {
            translate(device, &layout, shader, kind, 1)?;
        }
    }
    Ok(())
}

/// The sources of the attributes at locations.
///
/// # Errors
/// [`Error::InvalidUsage`] for a location without an attribute, or with an attribute of another numeric type.
pub(crate) fn attributes(input: &VertexInput, locations: &[(u32, ScalarType)]) -> Result<Vec<AttributeSource>, Error> {
    let source = |&(location, _): &(u32, ScalarType)| {
        source(input, location).map_err(|what| {
            Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-Input-07904",
                format!("the vertex shader reads location {location}, {what}"),
            )
        })
    };
    let sources: Vec<_> = locations.iter().map(source).collect::<Result<_, _>>()?;
    let mismatches: Vec<String> = std::iter::zip(locations, &sources)
        .filter_map(|(&(location, wanted), source)| type_mismatch(location, wanted, source.format))
        .collect();
    if mismatches.is_empty() {
        return Ok(sources);
    }
    Err(Error::usage("VUID-VkGraphicsPipelineCreateInfo-Input-08733", mismatches.join("; ")))
}

/// The difference between the type that a shader reads at a location and the attribute's format, if there is one.
pub(super) fn type_mismatch(location: u32, wanted: ScalarType, format: Format) -> Option<String> {
    // Normalised and scaled formats are read as floats.
    let given = match format.numeric() {
        Numeric::Uint => ScalarType::Uint { width: 32 },
        Numeric::Sint => ScalarType::Int { width: 32 },
        _ => ScalarType::Float { width: 32 },
    };
    (class(given) != class(wanted)).then(|| {
        format!("the vertex shader reads location {location} as {wanted:?}, but the attribute's format is {given:?}")
    })
}

/// The class of a type, which a format and an input must have in common: the kind of number, and true if it has 64
/// bits.
fn class(ty: ScalarType) -> (u8, bool) {
    match ty {
        ScalarType::Float { width } => (0, width == 64),
        ScalarType::Int { width } => (1, width == 64),
        ScalarType::Uint { width } => (2, width == 64),
        ScalarType::Bool => (2, false),
    }
}

/// Reports inputs that the stage before doesn't write. They read as zero.
pub(crate) fn warn_of_unwritten(device: &Device, vertex: &Interface, fragment: &Interface) {
    for InterfaceComponent { location, component } in link::unwritten(vertex, fragment) {
        let message = format!(
            "the fragment shader reads location {location}, component {component}, which the vertex shader doesn't \
             write; it reads as 0"
        );
        log::warn!("{message}");
        device.instance().report(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION,
            "VUID-RuntimeSpirv-OpEntryPoint-08743",
            &message,
        );
    }
}
