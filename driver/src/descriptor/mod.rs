//! Descriptors: layouts, the pools that sets come from, sets with their descriptors, and update templates.
//!
//! A set is a flat array: its layout gives each binding a run of it, in order of binding numbers. So an update that
//! spills over into the next binding, as Vulkan allows, just goes on.

pub(crate) mod layout;
pub(crate) mod pool;
pub(crate) mod set;
