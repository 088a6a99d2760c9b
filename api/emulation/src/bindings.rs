//! Descriptor sets and push constants as commands have bound them.

use std::collections::BTreeMap;

use ash::vk;

/// A descriptor set that is bound.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BoundSet {
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) set: vk::DescriptorSet,
    pub(crate) offsets: Vec<u32>,
}

/// Push constants as a command has set them.
#[derive(Clone, Debug)]
pub(crate) struct PushConstants {
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) stages: vk::ShaderStageFlags,
    pub(crate) offset: u32,
    pub(crate) bytes: Vec<u8>,
}

/// Descriptor sets and push constants of graphics pipelines.
#[derive(Clone, Debug)]
pub(crate) struct Bindings {
    /// The sets, by number.
    pub(crate) sets: BTreeMap<u32, BoundSet>,
    pub(crate) constants: Vec<PushConstants>,
}
