//! Messages: what is wrong, and how the application hears of it.

use std::ffi::{CString, c_void};
use std::sync::{Mutex, PoisonError};

use ash::vk;

/// Begins each message, by which people and tests tell it from those of drivers and other layers.
const NAME: &str = "VK_LAYER_GAURAST_validation";

/// Something wrong.
#[derive(Clone, Debug)]
pub(crate) struct Fault {
    /// The rule's id in the specification, or `GAURAST-...` for what is valid and surely not meant.
    pub(crate) id: &'static str,
    /// It breaks a rule of valid usage.
    pub(crate) is_error: bool,
    /// The text: the fault with its values, and the valid usage.
    pub(crate) text: String,
}

/// The faults of a command.
#[derive(Debug, Default)]
pub(crate) struct Faults(pub(crate) Vec<Fault>);

impl Faults {
    /// A rule of valid usage is broken.
    pub(crate) fn error(&mut self, id: &'static str, text: impl Into<String>) {
        self.push(id, true, text.into());
    }

    /// Something is valid and surely not meant.
    pub(crate) fn warning(&mut self, id: &'static str, text: impl Into<String>) {
        self.push(id, false, text.into());
    }

    /// The rule is broken, unless it holds.
    pub(crate) fn require(&mut self, holds: bool, id: &'static str, text: impl FnOnce() -> String) {
        if !holds {
            self.error(id, text());
        }
    }

    /// Reports whether nothing is wrong.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn push(&mut self, id: &'static str, is_error: bool, text: String) {
        self.0.push(Fault { id, is_error, text });
    }
}

/// A messenger of the application's.
#[derive(Clone, Copy)]
struct Messenger {
    handle: vk::DebugUtilsMessengerEXT,
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    types: vk::DebugUtilsMessageTypeFlagsEXT,
    callback: vk::PFN_vkDebugUtilsMessengerCallbackEXT,
    /// The application's pointer, as a number.
    user_data: usize,
}

/// The messengers of an instance.
#[derive(Default)]
pub(crate) struct Messengers(Mutex<Vec<Messenger>>);

impl Messengers {
    /// Remembers a messenger.
    pub(crate) fn add(&self, handle: vk::DebugUtilsMessengerEXT, info: &vk::DebugUtilsMessengerCreateInfoEXT<'_>) {
        self.lock().push(Messenger {
            handle,
            severity: info.message_severity,
            types: info.message_type,
            callback: info.pfn_user_callback,
            user_data: info.p_user_data as usize,
        });
    }

    /// Forgets a messenger.
    pub(crate) fn remove(&self, handle: vk::DebugUtilsMessengerEXT) {
        self.lock().retain(|messenger| messenger.handle != handle);
    }

    /// Tells all that listen, or the standard error where there is no messenger at all.
    pub(crate) fn tell(&self, fault: &Fault) {
        use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
        let messengers = self.lock().clone();
        if messengers.is_empty() {
            let kind = if fault.is_error { "error" } else { "warning" };
            eprintln!("{NAME}: {kind}: {} [{}]", fault.text, fault.id);
            return;
        }
        let severity = if fault.is_error { Severity::ERROR } else { Severity::WARNING };
        let types = vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION;
        let id = CString::new(fault.id).unwrap_or_default();
        let text = CString::new(format!("{NAME}: {}", fault.text)).unwrap_or_default();
        let data = vk::DebugUtilsMessengerCallbackDataEXT::default().message_id_name(&id).message(&text);
        for messenger in messengers {
            let listens = messenger.severity.contains(severity) && messenger.types.intersects(types);
            if let Some(callback) = messenger.callback.filter(|_| listens) {
                let user_data = messenger.user_data as *mut c_void;
                // SAFETY: the application gave the function and its pointer for such calls, and destroys the messenger
                // before they go; the data are valid.
                unsafe { callback(severity, types, &raw const data, user_data) };
            }
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Messenger>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
