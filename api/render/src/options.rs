//! The options of a renderer's device, and the driver's messages.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_void};
use std::fmt;
use std::sync::Arc;

use ash::vk::{self, DebugUtilsMessageSeverityFlagsEXT as Severity};
use gaurast::WorkTrace;
use gaurast::vk::{DriverOptionsGAURAST, SimdLevelGAURAST};

/// A function that receives messages, on any thread.
pub type MessageFunction = Arc<dyn Fn(&Message) + Send + Sync>;

/// The options of a device. Those of GauRast's driver (`VkDriverOptionsGAURAST`) are ignored by other drivers.
#[derive(Clone, Default)]
pub struct DeviceOptions {
    /// The number of GauRast's worker threads; 0 is one for each processor.
    pub threads: u32,
    /// GauRast's SIMD level.
    pub simd: SimdLevelGAURAST,
    /// The names of GauRast's optimizations, or `None` for all.
    pub optimizations: Option<CString>,
    /// The receiver of the device's work, which GauRast fills when the device is destroyed.
    pub work_trace: Option<Arc<WorkTrace>>,
    /// A part of the device's name; the first device that draws Gaussians if it is empty.
    pub device: String,
    /// The function that receives the driver's warnings and errors.
    pub on_message: Option<MessageFunction>,
}

impl fmt::Debug for DeviceOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeviceOptions")
            .field("threads", &self.threads)
            .field("simd", &self.simd)
            .field("optimizations", &self.optimizations)
            .field("device", &self.device)
            .finish_non_exhaustive()
    }
}

impl DeviceOptions {
    /// The options as GauRast's driver receives them; `None` if all are the default ones, so that a layer that does not
    /// know the structure has nothing to complain about.
    pub(crate) fn of_driver(&self) -> Option<DriverOptionsGAURAST<'_>> {
        let is_default = self.threads == 0
            && self.simd == SimdLevelGAURAST::BEST
            && self.optimizations.is_none()
            && self.work_trace.is_none();
        if is_default {
            return None;
        }
        let mut options = DriverOptionsGAURAST::default().thread_count(self.threads).simd_level(self.simd);
        if let Some(names) = &self.optimizations {
            options = options.p_optimizations(names.as_ptr());
        }
        if let Some(trace) = &self.work_trace {
            options = options.work_trace(trace);
        }
        Some(options)
    }

    /// The description of a debug messenger that receives the driver's warnings and errors. The options must outlive it.
    pub(crate) fn messenger(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
        use vk::DebugUtilsMessageTypeFlagsEXT as Type;
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(Severity::WARNING | Severity::ERROR)
            .message_type(Type::GENERAL | Type::VALIDATION | Type::PERFORMANCE)
            .pfn_user_callback(Some(receive))
            .user_data(std::ptr::from_ref(self).cast_mut().cast())
    }
}

/// A warning or an error of the driver, or of a layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// True for an error.
    pub is_error: bool,
    /// Its text.
    pub text: String,
}

thread_local! {
    /// The last error that the driver told this thread. A driver reports a command's failure before the command returns,
    /// on its thread.
    static LAST_ERROR: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Takes the last error that the driver told this thread.
pub(crate) fn take_error() -> Option<String> {
    LAST_ERROR.take()
}

/// Gives a message to the options that `user_data` points at.
unsafe extern "system" fn receive(
    severity: Severity,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the driver passes valid data with a string, and the user data of `DeviceOptions::messenger`.
    let (options, text) = unsafe { (&*user_data.cast::<DeviceOptions>(), CStr::from_ptr((*data).p_message)) };
    let message = Message { is_error: severity == Severity::ERROR, text: text.to_string_lossy().into_owned() };
    if let Some(on_message) = &options.on_message {
        on_message(&message);
    }
    if message.is_error {
        LAST_ERROR.set(Some(message.text));
    }
    vk::FALSE
}
