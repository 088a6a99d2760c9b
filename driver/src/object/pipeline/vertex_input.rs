//! Vertex input: which binding, offset and format an attribute location stands for.

use super::GraphicsPipelineInfo;
use crate::capabilities::formats;
use crate::error::Error;
use ash::vk;
use simdevice::Format;

/// Where a pipeline reads an attribute from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AttributeSource {
    /// The vertex buffer binding.
    pub(crate) binding: u32,
    /// Bytes from one vertex to the next.
    pub(crate) stride: u32,
    /// Bytes from the vertex's start to the attribute.
    pub(crate) offset: u32,
    /// How it is stored.
    pub(crate) format: Format,
    /// After how many instances it advances (0: never), `None` if it advances by vertex.
    pub(crate) instance_divisor: Option<u32>,
}

/// Finds the attribute at `location`, which the extension calls `name` and needs `components` of.
///
/// # Errors
/// An [`Error`] if the location, its binding or its format won't do.
pub(crate) fn attribute(
    info: &GraphicsPipelineInfo,
    name: &str,
    location: u32,
    components: u32,
) -> Result<AttributeSource, Error> {
    let refuse = |what: String| {
        Error::usage(
            "VUID-VkGaussianAttributeLocationsGAURAST-location",
            format!("{name} is location {location}, {what}"),
        )
    };
    let source = source(info, location).map_err(refuse)?;
    let format = source.format;
    if format.is_integer() {
        return Err(refuse(format!(
            "whose format {format:?} does not convert to floating point"
        )));
    }
    if (format.components().len() as u32) < components {
        return Err(refuse(format!(
            "whose format {format:?} has fewer than {components} components"
        )));
    }
    Ok(source)
}

/// Finds the attribute at `location`.
///
/// # Errors
/// What is missing or won't do, as the end of a sentence about the location.
pub(super) fn source(
    info: &GraphicsPipelineInfo,
    location: u32,
) -> Result<AttributeSource, String> {
    let attribute = info.attributes.iter().find(|a| a.location == location);
    let attribute = attribute.ok_or("which the vertex input state does not have")?;
    let number = attribute.binding;
    let binding = info.bindings.iter().find(|b| b.binding == number);
    let binding = binding
        .ok_or_else(|| format!("whose binding {number} the vertex input state does not have"))?;
    let features = formats::properties(attribute.format).buffer_features;
    let format = formats::device_format(attribute.format)
        .filter(|_| features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER));
    let format = format.ok_or_else(|| {
        format!(
            "whose format {:?} this device does not read as a vertex attribute",
            attribute.format
        )
    })?;
    let instance_divisor = match binding.input_rate {
        vk::VertexInputRate::VERTEX => None,
        vk::VertexInputRate::INSTANCE => {
            let given = info.divisors.iter().find(|it| it.binding == number);
            Some(given.map_or(1, |it| it.divisor))
        }
        rate => return Err(format!("whose binding has the unknown rate {rate:?}")),
    };
    Ok(AttributeSource {
        binding: number,
        stride: binding.stride,
        offset: attribute.offset,
        format,
        instance_divisor,
    })
}
