//! Destroying everything leaves no object. The test has a process of its own, because it counts the process's handles.

use ash::vk;
use gaurast_testkit::Messages;
use gaurast_testkit::context::{Context, everything};

#[gaurast_runner::test(alone)]
fn nothing_is_left_when_everything_is_destroyed() {
    assert_eq!(vulkan_gaurast::live_handles(), 0);
    let heard = Messages::default();
    let context = Context::embedded(&[ash::ext::debug_utils::NAME]);
    let debug = ash::ext::debug_utils::Instance::new(&context.entry, &context.instance);
    // SAFETY: `heard` outlives the messenger.
    let messenger = unsafe { debug.create_debug_utils_messenger(&everything(&heard), None) }.unwrap();
    let device = context.device(&[], &mut vk::PhysicalDeviceFeatures2::default()).unwrap();
    // Instance, physical device, messenger, device, queue.
    assert_eq!(vulkan_gaurast::live_handles(), 5);
    // SAFETY: each is live and not used again.
    unsafe {
        device.destroy_device(None);
        debug.destroy_debug_utils_messenger(messenger, None);
    }
    drop(context);
    assert_eq!(vulkan_gaurast::live_handles(), 0);
}
