//! Programs that are compiled for the device, and their bindings.
//!
//! [`interface`] defines the meanings of a program's slots, and [`bindings`] the memory that it uses. [`vertex`],
//! [`primitive`], [`fragment`] and [`compute`] hold the executables and the machines that run them.

pub mod bindings;
pub mod compute;
pub mod fragment;
pub mod interface;
pub(crate) mod outputs;
pub(crate) mod pool;
pub(crate) mod primitive;
pub mod vertex;
