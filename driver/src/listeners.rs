//! The application's callbacks that hear the driver's messages: messengers of `VK_EXT_debug_utils` and callbacks of
//! `VK_EXT_debug_report`.

use crate::abi::error::Error;
use crate::abi::sanitizer::observed;
use ash::vk;
use std::ffi::{CStr, CString, c_void};
use std::sync::{Arc, PoisonError, RwLock};

/// A message of the driver.
pub(crate) struct Message {
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    types: vk::DebugUtilsMessageTypeFlagsEXT,
    id: CString,
    text: CString,
}

impl Message {
    /// The message with an id and a text.
    pub(crate) fn new(
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
        types: vk::DebugUtilsMessageTypeFlagsEXT,
        id: &str,
        text: &str,
    ) -> Self {
        Self { severity, types, id: c_string(id), text: c_string(text) }
    }

    /// The message about an error of the Vulkan command `command`.
    pub(crate) fn of_error(command: &str, error: &Error) -> Self {
        let types = if error.is_usage() {
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
        } else {
            vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
        };
        Self::new(
            vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            types,
            error.message_id(),
            &format!("{command}: {error}"),
        )
    }

    /// The message about a use that breaks a rule, and that the device does all the same.
    pub(crate) fn of_warning(error: &Error) -> Self {
        Self::new(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION,
            error.message_id(),
            &format!("{error}: the device does it all the same"),
        )
    }

    /// Its kind for callbacks of `VK_EXT_debug_report`.
    fn flags(&self) -> vk::DebugReportFlagsEXT {
        use vk::DebugReportFlagsEXT as Flags;
        use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
        let is_of_performance = self.types.contains(vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE);
        match self.severity {
            Severity::ERROR => Flags::ERROR,
            Severity::WARNING if is_of_performance => Flags::PERFORMANCE_WARNING,
            Severity::WARNING => Flags::WARNING,
            Severity::INFO => Flags::INFORMATION,
            _ => Flags::DEBUG,
        }
    }
}

/// The text up to its first zero byte.
fn c_string(text: &str) -> CString {
    let end = text.find('\0').unwrap_or(text.len());
    CString::new(&text[..end]).unwrap_or_default()
}

/// The registered listeners of one kind.
pub(crate) struct Listeners<T>(RwLock<Vec<Arc<T>>>);

impl<T> Default for Listeners<T> {
    fn default() -> Self {
        Self(RwLock::default())
    }
}

impl<T> Listeners<T> {
    /// Registers a listener.
    pub(crate) fn add(&self, listener: Arc<T>) {
        let mut all = self.0.write().unwrap_or_else(PoisonError::into_inner);
        all.push(listener);
    }

    /// Removes a listener.
    pub(crate) fn remove(&self, listener: &Arc<T>) {
        let mut all = self.0.write().unwrap_or_else(PoisonError::into_inner);
        all.retain(|other| !Arc::ptr_eq(other, listener));
    }

    /// All listeners. A callback may use Vulkan, so no lock is held while it runs.
    pub(crate) fn all(&self) -> Vec<Arc<T>> {
        let all = self.0.read().unwrap_or_else(PoisonError::into_inner);
        all.clone()
    }
}

/// A callback of `VK_EXT_debug_utils` with its filter.
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

    /// Calls the application's callback if its filter accepts the message.
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
            // SAFETY: the caller's promise. The callback's result, which asks to abort the call, is meant for layers.
            observed(|| unsafe { callback(severity, types, data, self.user_data) });
        }
    }

    /// As [`DebugMessenger::submit`], with a message of the driver.
    pub(crate) fn report(&self, message: &Message) {
        let data =
            vk::DebugUtilsMessengerCallbackDataEXT::default().message_id_name(&message.id).message(&message.text);
        // SAFETY: the strings outlive the call; the messenger is registered, so its callback is callable.
        unsafe { self.submit(message.severity, message.types, &data) };
    }
}

/// A callback of `VK_EXT_debug_report` with its filter.
pub(crate) struct DebugReportCallback {
    flags: vk::DebugReportFlagsEXT,
    callback: vk::PFN_vkDebugReportCallbackEXT,
    user_data: *mut c_void,
}

// SAFETY: as for `DebugMessenger`.
unsafe impl Send for DebugReportCallback {}
// SAFETY: as for `Send`.
unsafe impl Sync for DebugReportCallback {}

/// The origin of a message, which a callback of `VK_EXT_debug_report` gets beside the text.
#[derive(Clone, Copy)]
pub(crate) struct ReportOrigin<'a> {
    pub(crate) object_type: vk::DebugReportObjectTypeEXT,
    pub(crate) object: u64,
    pub(crate) location: usize,
    pub(crate) message_code: i32,
    pub(crate) layer_prefix: &'a CStr,
}

impl DebugReportCallback {
    /// The callback that the application describes.
    pub(crate) fn new(info: &vk::DebugReportCallbackCreateInfoEXT<'_>) -> Self {
        Self { flags: info.flags, callback: info.pfn_callback, user_data: info.p_user_data }
    }

    /// Calls the application's callback if its filter accepts one of the flags.
    ///
    /// # Safety
    /// The application keeps its callback callable while it is registered.
    pub(crate) unsafe fn submit(&self, flags: vk::DebugReportFlagsEXT, origin: ReportOrigin<'_>, text: &CStr) {
        let wanted = self.flags.intersects(flags);
        if let Some(callback) = self.callback.filter(|_| wanted) {
            // SAFETY: the caller's promise; the strings outlive the call. The callback's result, which asks to abort the
            // call, is meant for layers.
            observed(|| unsafe {
                callback(
                    flags,
                    origin.object_type,
                    origin.object,
                    origin.location,
                    origin.message_code,
                    origin.layer_prefix.as_ptr(),
                    text.as_ptr(),
                    self.user_data,
                )
            });
        }
    }

    /// As [`DebugReportCallback::submit`], with a message of the driver, whose id takes the place of a layer's prefix.
    pub(crate) fn report(&self, message: &Message) {
        let origin = ReportOrigin {
            object_type: vk::DebugReportObjectTypeEXT::UNKNOWN,
            object: 0,
            location: 0,
            message_code: 0,
            layer_prefix: &message.id,
        };
        // SAFETY: the callback is registered, so it is callable.
        unsafe { self.submit(message.flags(), origin, &message.text) };
    }
}
