//! How a device of the embedded driver works: the environment variables that it reads when it is
//! created.

use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// What a device is told by the environment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Settings<'a> {
    /// The SIMD level by name, `GAURAST_SIMD`; as it is by default.
    pub simd: Option<&'a str>,
    /// Worker threads, `GAURAST_THREADS`; as it is by default.
    pub threads: Option<usize>,
    /// Where its work is written when it is gone, `GAURAST_TRACE`.
    pub trace: Option<&'a Path>,
}

/// Calls `create`, which creates devices, while the environment says `settings`.
///
/// Calls wait for each other, so that devices which are opened through this get no others' settings.
pub fn with_settings<R>(settings: &Settings, create: impl FnOnce() -> R) -> R {
    static LOCK: Mutex<()> = Mutex::new(());
    let _lock = LOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let _simd = settings
        .simd
        .map(|simd| Variable::set("GAURAST_SIMD", simd.as_ref()));
    let _threads = settings
        .threads
        .map(|threads| Variable::set("GAURAST_THREADS", threads.to_string().as_ref()));
    let _trace = settings
        .trace
        .map(|trace| Variable::set("GAURAST_TRACE", trace.as_os_str()));
    create()
}

/// An environment variable that gets its old value back.
struct Variable {
    name: &'static str,
    before: Option<OsString>,
}

impl Variable {
    fn set(name: &'static str, value: &OsStr) -> Self {
        let before = std::env::var_os(name);
        // SAFETY: the standard library guards the environment against its own readers and writers,
        // of which the embedded driver is one. The Vulkan loader and lavapipe, which aren't, read it
        // when they are opened, and that waits for `with_settings`.
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
