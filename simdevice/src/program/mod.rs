//! Programs made ready for the device, and what they are bound to.
//!
//! [`interface`] says what the slots of a program mean, and [`bindings`] what memory it reaches; [`vertex`],
//! [`fragment`] and [`compute`] hold the executables, and lend the machines that run them.

pub mod bindings;
pub mod compute;
pub mod fragment;
pub mod interface;
pub(crate) mod pool;
pub mod vertex;
