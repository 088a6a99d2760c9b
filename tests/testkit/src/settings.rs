//! Settings of a device of the embedded driver: the environment variables that it reads when it is created.

use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The settings of a device.
#[derive(Clone, Copy, Debug, Default)]
pub struct Settings<'a> {
    /// The name of the SIMD level, `GAURAST_SIMD`, or `None` for the default.
    pub simd: Option<&'a str>,
    /// The number of worker threads, `GAURAST_THREADS`, or `None` for the default.
    pub threads: Option<usize>,
    /// The file to which the device's work is written when the device is destroyed, `GAURAST_TRACE`.
    pub trace: Option<&'a Path>,
}

/// Calls `create`, which creates devices, with `settings` in the environment.
///
/// Calls wait for each other, so that no device gets the settings of another call.
pub fn with_settings<R>(settings: &Settings, create: impl FnOnce() -> R) -> R {
    static LOCK: Mutex<()> = Mutex::new(());
    let _lock = LOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let _simd = settings.simd.map(|simd| Variable::set("GAURAST_SIMD", simd.as_ref()));
    let _threads = settings.threads.map(|threads| Variable::set("GAURAST_THREADS", threads.to_string().as_ref()));
    let _trace = settings.trace.map(|trace| Variable::set("GAURAST_TRACE", trace.as_os_str()));
    create()
}

/// An environment variable whose old value is restored on drop.
struct Variable {
    name: &'static str,
    before: Option<OsString>,
}

impl Variable {
    fn set(name: &'static str, value: &OsStr) -> Self {
        let before = std::env::var_os(name);
        // SAFETY: the standard library guards the environment against its own readers and writers, of which the
        // embedded driver is one. The Vulkan loader and lavapipe are not; they read it when they are opened, and that
        // waits for `with_settings`.
        unsafe { std::env::set_var(name, value) };
        Self { name, before }
    }
}

impl Drop for Variable {
    fn drop(&mut self) {
        // SAFETY: as above.
        unsafe {
            match &self.before {
                Some(value) => std::env::set_var(self.name, value),
                None => std::env::remove_var(self.name),
            }
        }
    }
}
