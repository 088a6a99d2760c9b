//! Messages of a driver and of layers, received by a debug messenger.

use std::ffi::{CStr, c_void};
use std::sync::{Mutex, PoisonError};

use ash::vk;

/// A message that a debug messenger received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The message's id name, such as a VUID.
    pub id: String,
    /// Its text.
    pub text: String,
}

/// Messages that were received and not taken yet.
#[derive(Debug, Default)]
pub struct Messages(Mutex<Vec<Message>>);

impl Messages {
    /// Creation info of a messenger that stores warnings and errors here.
    pub fn messenger(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
        use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
        self.messenger_of(Severity::WARNING | Severity::ERROR)
    }

    /// Creation info of a messenger that stores messages of these severities here.
    pub fn messenger_of(
        &self,
        severities: vk::DebugUtilsMessageSeverityFlagsEXT,
    ) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
        use vk::DebugUtilsMessageTypeFlagsEXT as Type;
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(severities)
            .message_type(Type::GENERAL | Type::VALIDATION | Type::PERFORMANCE)
            .pfn_user_callback(Some(hear))
            .user_data(std::ptr::from_ref(self).cast_mut().cast())
    }

    /// Takes the messages received since the last call.
    pub fn take(&self) -> Vec<Message> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

unsafe extern "system" fn hear(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the caller passes valid data, and the user data of `Messages::messenger_of`.
    let (message, messages) = unsafe {
        let text = |text: Option<&CStr>| text.unwrap_or_default().to_string_lossy().into_owned();
        let message = Message { id: text((*data).message_id_name_as_c_str()), text: text((*data).message_as_c_str()) };
        (message, &*user_data.cast::<Messages>())
    };
    let mut heard = messages.0.lock().unwrap_or_else(PoisonError::into_inner);
    heard.push(message);
    vk::FALSE
}
