//! Shader stages, translated and compared with the pipeline's layout and vertex input.

use super::layout::PipelineLayout;
use super::state::{AttributeSource, GraphicsState, source};
use crate::abi::error::Error;
use crate::device::Device;
use crate::physical_device::limits;
use crate::pipeline::reflect;
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast_spirv::{Interface, Options, ScalarType, Shader, Stage};
use simdevice::format;

/// Translates a stage and compares it with the layout.
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
        samples,
        unsized_descriptors: layout.longest_binding(),
    };
    let shader = stage
        .module
        .translate(stage.name, kind, &stage.specialization, &options)?;
    layout.check(&shader.interface)?;
    if device.dumps_ir() {
        eprintln!("{kind} shader {}:\n{}", stage.name, shader.program);
    }
    Ok(shader)
}

/// The sources that locations are read from.
pub(crate) fn attributes(
    info: &GraphicsState,
    locations: &[(u32, ScalarType)],
) -> Result<Vec<AttributeSource>, Error> {
    let source = |&(location, _): &(u32, ScalarType)| {
        source(info, location).map_err(|what| {
            Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-Input-07904",
                format!("the vertex shader reads location {location}, {what}"),
            )
        })
    };
    locations.iter().map(source).collect()
}

/// Compares the types of attributes with what the shader reads.
pub(crate) fn check_attributes(
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
pub(crate) fn warn_of_unwritten(device: &Device, vertex: &Interface, fragment: &Interface) {
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
