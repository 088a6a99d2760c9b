//! The GauRast driver: a software Vulkan driver that draws with a simulated device.
//!
//! There are two ways to use it. [`entry`] gives an [`ash::Entry`] over the driver linked into this process;
//! `driver/icd` exports [`loader`] as a shared library for the Vulkan loader. Both use the same table of commands.
//!
//! The driver has Vulkan's objects, a file for each chapter of the specification, and replays recorded commands as
//! [`simdevice`] packets. It never computes a pixel.
//!
//! ```
//! # fn main() -> Result<(), ash::vk::Result> {
//! let entry = vulkan_gaurast::entry();
//! // SAFETY: the entry lives as long as the program, and the instance is destroyed once.
//! unsafe {
//!     let instance = entry.create_instance(&ash::vk::InstanceCreateInfo::default(), None)?;
//!     let device = instance.enumerate_physical_devices()?[0];
//!     let properties = instance.get_physical_device_properties(device);
//!     assert!(properties.device_name_as_c_str().is_ok_and(|name| name.to_string_lossy().contains("GauRast")));
//!     instance.destroy_instance(None);
//! }
//! # Ok(())
//! # }
//! ```

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod abi;
mod calibrated_timestamps;
mod command;
mod convert;
mod descriptor;
mod device;
mod device_addresses;
mod device_sync;
mod dispatch;
mod enabled;
mod external;
mod instance;
mod listeners;
pub mod loader;
mod options;
mod payload;
mod physical_device;
mod pipeline;
mod query_pool;
mod queue;
mod registry;
mod render_pass;
mod resource;
mod shader_module;
mod surface;
mod swapchain;
mod sync;
pub mod window;

pub use abi::handle::live_handles;

/// The driver as an [`ash::Entry`].
///
/// Nothing needs to be installed, and layers aren't loaded. The entry and the objects created from it may be used on
/// any thread, as Vulkan allows.
pub fn entry() -> ash::Entry {
    // SAFETY: the function behaves as Vulkan specifies and exists as long as the program.
    unsafe { ash::Entry::from_static_fn(ash::StaticFn { get_instance_proc_addr: dispatch::vkGetInstanceProcAddr }) }
}
