//! Debug messengers: the application's callbacks for messages (`VK_EXT_debug_utils`).

use crate::error::Error;
use ash::vk;
use std::ffi::{CString, c_void};

/// A callback with its filter.
pub(crate) struct DebugMessenger {
    severities: vk::DebugUtilsMessageSeverityFlagsEXT,
    types: vk::DebugUtilsMessageTypeFlagsEXT,
    callback: vk::PFN_vkDebugUtilsMessengerCallbackEXT,
    user_data: *mut c_void,
}

// SAFETY: `user_data` is the application's and only handed back to its callback, which Vulkan may call on any thread.
unsafe impl Send for DebugMessenger {}
// SAFETY: as for `Send`.
unsafe impl Sync for DebugMessenger {}

crate::objects! {
    vk::DebugUtilsMessengerEXT => DebugMessenger;
}

impl DebugMessenger {
    /// The messenger that the application describes.
    pub(crate) fn new(info: &vk::DebugUtilsMessengerCreateInfoEXT<'_>) -> Self {
        Self {
            severities: info.message_severity,
            types: info.message_type,
            callback: info.pfn_user_callback,
            user_data: info.p_user_data,
        }
    }

    /// Calls the application if it wants such messages.
    ///
    /// # Safety
    /// `data` and what it points at are valid; the application keeps its callback callable while it is registered.
    pub(crate) unsafe fn submit(
        &self,
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
        types: vk::DebugUtilsMessageTypeFlagsEXT,
        data: &vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    ) {
        let wanted = self.severities.contains(severity) && self.types.intersects(types);
        if let Some(callback) = self.callback.filter(|_| wanted) {
            // SAFETY: the caller's promise. The result asks to abort the call, which is for layers.
            unsafe { callback(severity, types, data, self.user_data) };
        }
    }

    /// Reports an error of the Vulkan command `command`.
    pub(crate) fn report_error(&self, command: &str, error: &Error) {
        let types = if error.is_usage() {
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
        } else {
            vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
        };
        self.report(
            vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            types,
            error.message_id(),
            &format!("{command}: {error}"),
        );
    }

    /// As [`DebugMessenger::submit`], of a message of the driver's own.
    pub(crate) fn report(
        &self,
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
        types: vk::DebugUtilsMessageTypeFlagsEXT,
        id: &str,
        message: &str,
    ) {
        let id = c_string(id);
        let message = c_string(message);
        let data = vk::DebugUtilsMessengerCallbackDataEXT::default()
            .message_id_name(&id)
            .message(&message);
        // SAFETY: the strings outlive the call; the messenger is registered, so its callback is callable.
        unsafe { self.submit(severity, types, &data) };
    }
}

/// The text up to its first zero byte.
fn c_string(text: &str) -> CString {
    let end = text.find('\0').unwrap_or(text.len());
    CString::new(&text[..end]).unwrap_or_default()
}
