//! A receiver of the traces of work that [`DriverOptionsGAURAST`] asks for.

use core::ffi::c_void;
use std::sync::{Mutex, PoisonError};

use crate::vk::DriverOptionsGAURAST;

/// Receives the trace of work of each device of an instance as the device is destroyed, and keeps the last one.
///
/// ```no_run
/// # fn example(entry: ash::Entry) -> Result<(), Box<dyn std::error::Error>> {
/// let trace = gaurast::WorkTrace::default();
/// let mut options = gaurast::vk::DriverOptionsGAURAST::default().thread_count(2).work_trace(&trace);
/// let create_info = ash::vk::InstanceCreateInfo::default().push_next(&mut options);
/// # // SAFETY: never run.
/// let instance = unsafe { entry.create_instance(&create_info, None)? };
/// // A device draws, and is destroyed.
/// let bytes = trace.take().expect("the device's work");
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Default)]
pub struct WorkTrace(Mutex<Option<Vec<u8>>>);

impl WorkTrace {
    /// Takes the trace of the device that was destroyed last, as JSON in UTF-8, or binary if it is large; `None`
    /// if none was destroyed since the last call.
    pub fn take(&self) -> Option<Vec<u8>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl<'a> DriverOptionsGAURAST<'a> {
    /// Sets the receiver of traces of work, which must live until the instance's devices are destroyed.
    #[inline]
    pub fn work_trace(self, receiver: &'a WorkTrace) -> Self {
        self.pfn_work_trace(Some(receive)).p_user_data(core::ptr::from_ref(receiver).cast_mut().cast())
    }
}

/// Gives a trace to the [`WorkTrace`] that `user_data` points at.
unsafe extern "system" fn receive(user_data: *mut c_void, size: usize, data: *const c_void) {
    // SAFETY: the driver passes valid data, and the user data that `work_trace` sets.
    let (receiver, bytes) =
        unsafe { (&*user_data.cast::<WorkTrace>(), core::slice::from_raw_parts(data.cast(), size)) };
    *receiver.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(bytes.to_vec());
}
