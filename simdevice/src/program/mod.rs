//! Programs made ready for the device, and what they are bound to.

pub mod interface;
