//! The definitions that the extensions add to [`ash::vk`]: structures, enums, flags, constants and function types.
//!
//! Names are those of the C header without the `Vk` prefix, as in ash.

mod defaults;
mod definitions;

pub use definitions::*;
