//! ThreadSanitizer, and Valgrind's Helgrind and DRD, if the application runs under one of them.
//!
//! The driver is not instrumented. ThreadSanitizer sees the driver's calls of functions such as `memcpy` and `free`, but not its
//! locks, and would report races that are none. Therefore it is asked to ignore what commands and the driver's threads access,
//! and is told where one thread waits for another, so that it follows the application's own data through fences,
//! semaphores, events and queues. The application's callbacks are observed. Valgrind's tools are told of waits too, and a
//! file of suppressions (`driver/icd/helgrind.supp`) ignores the driver's accesses.
//!
//! Without them a call is a test of two pointers.

use std::ffi::c_void;
use std::marker::PhantomData;
use std::sync::OnceLock;

/// Functions of ThreadSanitizer's runtime.
struct ThreadSanitizer {
    acquire: unsafe extern "C" fn(*mut c_void),
    release: unsafe extern "C" fn(*mut c_void),
    ignore_thread_begin: unsafe extern "C" fn(),
    ignore_thread_end: unsafe extern "C" fn(),
}

impl ThreadSanitizer {
    /// The runtime's functions, which are looked up once; `None` without it.
    fn get() -> Option<&'static Self> {
        static FOUND: OnceLock<Option<ThreadSanitizer>> = OnceLock::new();
        FOUND.get_or_init(Self::find).as_ref()
    }

    #[cfg(target_os = "linux")]
    fn find() -> Option<Self> {
        let program = libloading::os::unix::Library::this();
        // SAFETY: the types are those of `sanitizer/tsan_interface.h`. The runtime is never unloaded.
        unsafe {
            Some(Self {
                acquire: *program.get(b"__tsan_acquire\0").ok()?,
                release: *program.get(b"__tsan_release\0").ok()?,
                ignore_thread_begin: *program.get(b"__tsan_ignore_thread_begin\0").ok()?,
                ignore_thread_end: *program.get(b"__tsan_ignore_thread_end\0").ok()?,
            })
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn find() -> Option<Self> {
        None
    }
}

/// Requests to Valgrind (`valgrind.h`, `helgrind.h`).
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod valgrind {
    use std::arch::asm;
    use std::sync::OnceLock;

    /// Asks for the number of emulators that run the program.
    const RUNNING_ON_VALGRIND: usize = 0x1001;
    /// The thread sends an object: all that it did precedes what a receiver does afterwards.
    const SEND_PRE: usize = 0x4847_0121;
    /// The thread receives an object.
    const RECV_POST: usize = 0x4847_0122;

    /// Makes a request with one argument. A processor executes it as an operation without an effect, with the result 0.
    fn request(number: usize, argument: usize) -> usize {
        let words = [number, argument, 0, 0, 0, 0];
        let mut result = 0_usize;
        // SAFETY: the rotations restore the register, and Valgrind reads the words.
        unsafe {
            asm!(
                "rol rdi, 3",
                "rol rdi, 13",
                "rol rdi, 61",
                "rol rdi, 51",
                "xchg rbx, rbx",
                in("rax") words.as_ptr(),
                inout("rdx") result,
                options(nostack)
            );
        }
        result
    }

    fn is_running() -> bool {
        static RUNNING: OnceLock<bool> = OnceLock::new();
        *RUNNING.get_or_init(|| request(RUNNING_ON_VALGRIND, 0) > 0)
    }

    pub(super) fn release(object: usize) {
        if is_running() {
            request(SEND_PRE, object);
        }
    }

    pub(super) fn acquire(object: usize) {
        if is_running() {
            request(RECV_POST, object);
        }
    }
}

#[cfg(not(all(target_os = "linux", target_arch = "x86_64")))]
mod valgrind {
    pub(super) fn release(_: usize) {}

    pub(super) fn acquire(_: usize) {}
}

/// Reports whether the application runs under ThreadSanitizer.
pub(crate) fn is_present() -> bool {
    ThreadSanitizer::get().is_some()
}

/// The thread passes on what it did to each thread that afterwards [acquires](acquire) the same object.
pub(crate) fn release<T: ?Sized>(object: &T) {
    let address = std::ptr::from_ref(object).cast::<()>();
    valgrind::release(address.addr());
    if let Some(sanitizer) = ThreadSanitizer::get() {
        // SAFETY: the runtime uses the address as a name.
        unsafe { (sanitizer.release)(address.cast_mut().cast()) };
    }
}

/// The thread has seen what others [released](release) with the object.
pub(crate) fn acquire<T: ?Sized>(object: &T) {
    let address = std::ptr::from_ref(object).cast::<()>();
    valgrind::acquire(address.addr());
    if let Some(sanitizer) = ThreadSanitizer::get() {
        // SAFETY: as for `release`.
        unsafe { (sanitizer.acquire)(address.cast_mut().cast()) };
    }
}

/// ThreadSanitizer ignores what the thread accesses, until this is dropped.
pub(crate) struct Ignored {
    sanitizer: Option<&'static ThreadSanitizer>,
    /// It belongs to one thread.
    _thread: PhantomData<*const ()>,
}

impl Ignored {
    /// Begins to ignore the thread. This nests.
    pub(crate) fn begin() -> Self {
        let sanitizer = ThreadSanitizer::get();
        if let Some(sanitizer) = sanitizer {
            // SAFETY: the runtime counts; the end follows.
            unsafe { (sanitizer.ignore_thread_begin)() };
        }
        Self { sanitizer, _thread: PhantomData }
    }
}

impl Drop for Ignored {
    fn drop(&mut self) {
        if let Some(sanitizer) = self.sanitizer {
            // SAFETY: it has begun in this thread.
            unsafe { (sanitizer.ignore_thread_end)() };
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
    struct Again(&'static ThreadSanitizer);
    impl Drop for Again {
        fn drop(&mut self) {
            // SAFETY: it undoes the end below.
            unsafe { (self.0.ignore_thread_begin)() };
        }
    }
    let _again = ThreadSanitizer::get().map(|sanitizer| {
        // SAFETY: commands and the driver's threads are ignored.
        unsafe { (sanitizer.ignore_thread_end)() };
        Again(sanitizer)
    });
    call()
}
