//! The commands that are intercepted, by chapter of Vulkan.

mod attachments;
mod command_buffers;
mod commands;
mod draws;
mod gaussians;
mod instance;
mod objects;
mod site;
mod states;
mod table;

pub(crate) use table::{device_hook, instance_hook, is_own};
