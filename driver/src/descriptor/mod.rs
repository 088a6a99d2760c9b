//! Descriptors: layouts, the pools from which sets are allocated, sets with their descriptors, and update templates.
//!
//! A set is a flat array: its layout gives each binding a range of it, in order of binding numbers. So an update that
//! continues in the next binding, as Vulkan allows, needs no special case.

pub(crate) mod layout;
pub(crate) mod pool;
pub(crate) mod set;
