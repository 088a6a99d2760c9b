//! Descriptor update templates.

use ash::vk;

/// A descriptor update template.
#[derive(Debug)]
pub(crate) struct UpdateTemplate {
    /// What is updated, and where it lies in the application's data.
    pub(crate) entries: Vec<vk::DescriptorUpdateTemplateEntry>,
    /// For templates of pushed descriptors: the bind point that they are pushed to.
    pub(crate) push_bind_point: Option<vk::PipelineBindPoint>,
}

crate::objects! { vk::DescriptorUpdateTemplate => UpdateTemplate; }
