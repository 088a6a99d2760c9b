//! ThreadSanitizer, if the application runs under it.
//!
//! The driver is not instrumented. ThreadSanitizer sees the driver's calls of functions such as `memcpy` and `free`, but not its
//! locks, and would report races that are none. Therefore it is asked to ignore what commands and the driver's threads access,
//! and is told where one thread waits for another, so that it follows the application's own data through fences,
//! semaphores, events and queues. The application's callbacks are observed.
//!
//! Without ThreadSanitizer a call is a test of a pointer.

use std::ffi::c_void;
use std::marker::PhantomData;
use std::sync::OnceLock;

/// Functions of ThreadSanitizer's runtime.
struct Runtime {
    acquire: unsafe extern "C" fn(*mut c_void),
    release: unsafe extern "C" fn(*mut c_void),
    ignore_thread_begin: unsafe extern "C" fn(),
    ignore_thread_end: unsafe extern "C" fn(),
}

/// The runtime's functions, which are looked up once; `None` without ThreadSanitizer.
fn runtime() -> Option<&'static Runtime> {
    static RUNTIME: OnceLock<Option<Runtime>> = OnceLock::new();
    RUNTIME.get_or_init(find).as_ref()
}

#[cfg(target_os = "linux")]
fn find() -> Option<Runtime> {
    let program = libloading::os::unix::Library::this();
    // SAFETY: the types are those of `sanitizer/tsan_interface.h`. The runtime is never unloaded.
    unsafe {
        Some(Runtime {
            acquire: *program.get(b"__tsan_acquire\0").ok()?,
            release: *program.get(b"__tsan_release\0").ok()?,
            ignore_thread_begin: *program.get(b"__tsan_ignore_thread_begin\0").ok()?,
            ignore_thread_end: *program.get(b"__tsan_ignore_thread_end\0").ok()?,
        })
    }
}

#[cfg(not(target_os = "linux"))]
fn find() -> Option<Runtime> {
    None
}

/// Reports whether the application runs under ThreadSanitizer.
pub(crate) fn is_present() -> bool {
    runtime().is_some()
}

/// The thread passes on what it did to each thread that afterwards [acquires](acquire) the same object.
pub(crate) fn release<T>(object: &T) {
    if let Some(runtime) = runtime() {
        // SAFETY: the runtime uses the address as a name.
        unsafe { (runtime.release)(std::ptr::from_ref(object).cast_mut().cast()) };
    }
}

/// The thread has seen what others [released](release) with the object.
pub(crate) fn acquire<T>(object: &T) {
    if let Some(runtime) = runtime() {
        // SAFETY: as for `release`.
        unsafe { (runtime.acquire)(std::ptr::from_ref(object).cast_mut().cast()) };
    }
}

/// ThreadSanitizer ignores what the thread accesses, until this is dropped.
pub(crate) struct Ignored {
    runtime: Option<&'static Runtime>,
    /// It belongs to one thread.
    _thread: PhantomData<*const ()>,
}

impl Ignored {
    /// Begins to ignore the thread. This nests.
    pub(crate) fn begin() -> Self {
        let runtime = runtime();
        if let Some(runtime) = runtime {
            // SAFETY: the runtime counts; the end follows.
            unsafe { (runtime.ignore_thread_begin)() };
        }
        Self { runtime, _thread: PhantomData }
    }
}

impl Drop for Ignored {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime {
            // SAFETY: it has begun in this thread.
            unsafe { (runtime.ignore_thread_end)() };
        }
    }
}

/// Ignores the thread, one of the driver's, until it ends.
pub(crate) fn ignore_thread() {
    thread_local!(static IGNORED: Ignored = Ignored::begin());
    IGNORED.with(|_| ());
}

/// Calls a function of the application, whose accesses ThreadSanitizer observes, from an ignored thread.
pub(crate) fn observed<R>(call: impl FnOnce() -> R) -> R {
    /// Ignores the thread again.
    struct Again(&'static Runtime);
    impl Drop for Again {
        fn drop(&mut self) {
            // SAFETY: it undoes the end below.
            unsafe { (self.0.ignore_thread_begin)() };
        }
    }
    let _again = runtime().map(|runtime| {
        // SAFETY: commands and the driver's threads are ignored, once.
        unsafe { (runtime.ignore_thread_end)() };
        Again(runtime)
    });
    call()
}
