//! The embedded door: the driver linked into the application, without a loader.

use crate::entrypoints::instance::get_instance_proc_addr;

/// The driver as an [`ash::Entry`].
///
/// Nothing need be installed, and layers aren't loaded. The entry and what is created from it may be used on any
/// thread, as Vulkan allows.
pub fn entry() -> ash::Entry {
    // SAFETY: the function behaves as Vulkan says and is there as long as the program.
    unsafe {
        ash::Entry::from_static_fn(ash::StaticFn {
            get_instance_proc_addr,
        })
    }
}
