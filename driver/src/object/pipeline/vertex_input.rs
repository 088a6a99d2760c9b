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
    /// `Some(1)` if it advances by instance, `None` if by vertex.
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
        Err(Error::usage(
            "VUID-VkGaussianAttributeLocationsGAURAST-location",
            format!("{name} is location {location}, {what}"),
        ))
    };
    let Some(attribute) = info.attributes.iter().find(|a| a.location == location) else {
        return refuse("which the vertex input state does not have".into());
    };
    let Some(binding) = info
        .bindings
        .iter()
        .find(|b| b.binding == attribute.binding)
    else {
        return refuse(format!(
            "whose binding {} the vertex input state does not have",
            attribute.binding
        ));
    };
    let features = formats::properties(attribute.format).buffer_features;
    // Integers mean nothing to Gaussians.
    let format = formats::device_format(attribute.format).filter(|format| {
        features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER) && !format.is_integer()
    });
    let Some(format) = format else {
        return refuse(format!(
            "whose format {:?} this device does not read as a vertex attribute",
            attribute.format
        ));
    };
    if (format.components().len() as u32) < components {
        return refuse(format!(
            "whose format {:?} has fewer than {components} components",
            attribute.format
        ));
    }
    let instance_divisor = match binding.input_rate {
        vk::VertexInputRate::VERTEX => None,
        vk::VertexInputRate::INSTANCE => Some(1),
        rate => return refuse(format!("whose binding has the unknown rate {rate:?}")),
    };
    Ok(AttributeSource {
        binding: binding.binding,
        stride: binding.stride,
        offset: attribute.offset,
        format,
        instance_divisor,
    })
}
