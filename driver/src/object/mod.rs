//! The objects behind the handles. Each is shared by [`Arc`](std::sync::Arc) and locks what changes.

pub(crate) mod buffer;
pub(crate) mod buffer_view;
pub(crate) mod command_buffer;
pub(crate) mod debug_messenger;
pub(crate) mod descriptor;
pub(crate) mod device;
pub(crate) mod event;
pub(crate) mod fence;
pub(crate) mod image;
pub(crate) mod instance;
pub(crate) mod memory;
pub(crate) mod physical_device;
pub(crate) mod pipeline;
pub(crate) mod private_data;
pub(crate) mod query_pool;
pub(crate) mod queue;
pub(crate) mod render_pass;
pub(crate) mod sampler;
pub(crate) mod semaphore;
pub(crate) mod shader_module;
pub(crate) mod signals;
pub(crate) mod submission;
