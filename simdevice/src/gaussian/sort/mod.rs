//! Sorting: the depth order of a set's splats.

pub(crate) mod depth_order;
pub mod radix;
