//! `VK_EXT_debug_utils`. Names, tags and labels are accepted and dropped.

use crate::entry_points;
use crate::handle;
use crate::object::debug_messenger::DebugMessenger;
use crate::pointer;
use ash::vk;
use std::sync::Arc;

entry_points! {
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

    fn set_debug_utils_object_name_ext(
        _device: vk::Device,
        _info: *const vk::DebugUtilsObjectNameInfoEXT<'_>,
    ) -> vk::Result {
        Ok(())
    }

    fn set_debug_utils_object_tag_ext(
        _device: vk::Device,
        _info: *const vk::DebugUtilsObjectTagInfoEXT<'_>,
    ) -> vk::Result {
        Ok(())
    }

    fn queue_begin_debug_utils_label_ext(
        _queue: vk::Queue,
        _label: *const vk::DebugUtilsLabelEXT<'_>,
    ) {
        Ok(())
    }

    fn queue_end_debug_utils_label_ext(_queue: vk::Queue) {
        Ok(())
    }

    fn queue_insert_debug_utils_label_ext(
        _queue: vk::Queue,
        _label: *const vk::DebugUtilsLabelEXT<'_>,
    ) {
        Ok(())
    }

    fn cmd_begin_debug_utils_label_ext(
        _command_buffer: vk::CommandBuffer,
        _label: *const vk::DebugUtilsLabelEXT<'_>,
    ) {
        Ok(())
    }

    fn cmd_end_debug_utils_label_ext(_command_buffer: vk::CommandBuffer) {
        Ok(())
    }

    fn cmd_insert_debug_utils_label_ext(
        _command_buffer: vk::CommandBuffer,
        _label: *const vk::DebugUtilsLabelEXT<'_>,
    ) {
        Ok(())
    }
}
