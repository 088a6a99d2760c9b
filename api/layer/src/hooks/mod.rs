//! The commands that the layer intercepts: each looks at its parameters and passes them on.
//!
//! `unsafe` has one reason throughout: these functions are called by applications, whose promise is Vulkan's valid
//! usage of handles and pointers, and they call the next layer's function of the same command with the same parameters.

mod instance;
mod objects;
mod recording;
mod submit;
mod table;
mod waits;

pub(crate) use table::{device_hook, instance_hook};
