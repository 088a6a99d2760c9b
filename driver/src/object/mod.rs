//! The objects behind the handles. Each is shared by [`Arc`](std::sync::Arc) and locks what changes.

pub(crate) mod command_buffer;
pub(crate) mod debug_messenger;
pub(crate) mod device;
pub(crate) mod instance;
pub(crate) mod physical_device;
pub(crate) mod queue;
