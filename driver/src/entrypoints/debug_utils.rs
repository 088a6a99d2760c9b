//! `VK_EXT_debug_utils`. Names, tags and labels are accepted and dropped.

use crate::entry_points;
use crate::handle;
use crate::object::debug_messenger::DebugMessenger;
use crate::pointer;
use ash::vk;
use std::sync::Arc;

entry_points! {
    #[doc(alias = "vkCreateDebugUtilsMessengerEXT")]
    fn create_debug_utils_messenger_ext(
        instance: vk::Instance,
        info: *const vk::DebugUtilsMessengerCreateInfoEXT<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        messenger: *mut vk::DebugUtilsMessengerEXT,
    ) -> vk::Result {
        let instance = handle::get(instance)?;
        let created = Arc::new(DebugMessenger::new(pointer::input(info)?));
        instance.add_messenger(Arc::clone(&created));
        pointer::output(messenger, handle::create(created))
    }

    #[doc(alias = "vkDestroyDebugUtilsMessengerEXT")]
    fn destroy_debug_utils_messenger_ext(
        instance: vk::Instance,
        messenger: vk::DebugUtilsMessengerEXT,
        _allocator: *const vk::AllocationCallbacks<'_>,
    ) {
        let instance = handle::get(instance)?;
        if let Some(messenger) = handle::destroy(messenger)? {
            instance.remove_messenger(&messenger);
        }
        Ok(())
    }

    #[doc(alias = "vkSubmitDebugUtilsMessageEXT")]
    fn submit_debug_utils_message_ext(
        instance: vk::Instance,
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
        types: vk::DebugUtilsMessageTypeFlagsEXT,
        data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    ) {
        let data = pointer::input(data)?;
        for messenger in handle::get(instance)?.messengers() {
            messenger.submit(severity, types, data);
        }
        Ok(())
    }
}
