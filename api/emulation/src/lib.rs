//! `VK_GAURAST_gaussian_primitive_topology` on Vulkan devices that lack it.
//!
//! Compute kernels project, sort and accumulate the Gaussians of a set, and a fragment shader hands the result to the
//! application's blending. Numbers that decide a picture are pairs of binary32, so that pictures keep the precision of the
//! extension's text without 64-bit floating point. `docs/gpu.md` says what runs and on which devices it was seen.
//!
//! There are two doors. [`entry`] puts the extension over an [`ash::Entry`] within a process. `layer_functions` are those of a
//! layer, which `api/emulation/layer` makes a library for the Vulkan loader of. Where a driver has the extension itself, both
//! step aside, unless the environment's `GAURAST_EMULATION_FORCE` is 1.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // SAFETY: the system's Vulkan loader is sound.
//! let entry = gaurast_emulation::entry(unsafe { ash::Entry::load()? });
//! // From here on, devices of `entry` have the extension.
//! # Ok(())
//! # }
//! ```
//!
//! | module | has |
//! |---|---|
//! | `proc_addr`, `entry` | the lookup of commands by name; the two doors |
//! | `hooks` | the commands that are intercepted |
//! | `instance`, `device` | what lives, by the loader's key |
//! | `support` | the features and properties that devices get |
//! | `formats`, `pipeline`, `library`, `render_pass` | objects that are created for the extension's sake, or otherwise than the application says |
//! | `attachments`, `depth_stencil` | what is known of depth and stencil attachments, and the tests of Gaussians against them |
//! | `bindings`, `cameras` | what shaders are bound to; cameras |
//! | `recording`, `pass` | what is known of a command buffer, and of the render pass instance that it is in |
//! | `resolve` | the application's fragment shaders, rewritten so that they load what a set has made |
//! | `lens` | lenses that distort |
//! | `set`, `work`, `made` | a sorted set that is recorded, its dispatches, and what they make |
//! | `kernels`, `scratch` | the kernels, and the memory that they work in |
//! | `times` | the times of a set's stages |
//! | `precision` | the class of precision: pairs, or binary32 alone |
//! | `self_test`, `pair` | the test of a device's arithmetic |
//!
//! The reason for all `unsafe` in `hooks` is the same. These are Vulkan's commands: the application keeps their valid usage, so
//! that what pointers name is there, and what is changed keeps it where it is passed on.

mod attachments;
mod below;
mod bindings;
mod cameras;
mod decoding;
mod depth_stencil;
mod device;
mod draw_call;
mod emulation;
mod entry;
mod formats;
mod hooks;
mod instance;
mod kernels;
mod lens;
mod library;
mod made;
mod module;
mod next;
mod pair;
mod pass;
mod pipeline;
mod precision;
mod proc_addr;
mod projecting;
mod recording;
mod render_pass;
mod report;
mod resolve;
mod scratch;
mod self_test;
mod set;
mod support;
mod times;
mod unlinked;
mod work;

pub use entry::entry;
pub use proc_addr::layer_functions;
