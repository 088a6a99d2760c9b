//! The guard around each command: panics and errors are caught, reported and become results, and threads round as Rust
//! assumes.
//!
//! The functions that Vulkan calls are generated (`dispatch/commands.rs`, by `driver/gen`). Each is this guard around a
//! conversion of its parameters and a call of one function of the driver, which has `#[doc(alias = "vkCreateBuffer")]`, by
//! which the generator and people find it, and takes its parameters in the forms that it wants:
//! - handles become objects through [`handle`](crate::abi::handle), pointers and chains references through
//!   [`valid`](crate::abi::valid);
//! - `Ok(())` is `VK_SUCCESS`, another success code is `Ok(vk::Result)`, and an error is logged, sent to the instance's debug
//!   messengers and returned as [`Error::result`];
//! - output handles of a command that fails are left as they were, except where Vulkan demands null;
//! - allocation callbacks are accepted and ignored, as Vulkan allows.

use crate::abi::error::Error;
use crate::abi::handle::{self, Handle, Object, Reporter};
use ash::vk;
use simdevice::host::OutOfMemory;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// A command's result, as the application receives it.
pub(crate) trait ReturnCode {
    /// The result of a command that fails.
    fn failure(error: &Error) -> Self;
}

impl ReturnCode for vk::Result {
    fn failure(error: &Error) -> Self {
        error.result()
    }
}

/// Commands without a result: the error is only reported.
impl ReturnCode for () {
    fn failure(_: &Error) {}
}

macro_rules! zero_on_failure {
    ($($type:ty),*) => {$(
        impl ReturnCode for $type {
            fn failure(_: &Error) -> Self {
                Self::default()
            }
        }
    )*};
}
zero_on_failure!(u32, u64, vk::PFN_vkVoidFunction);

/// A command's first parameter, by which the listener to its errors is found.
pub(crate) trait Caller: Copy {
    /// The listener that hears about errors.
    ///
    /// # Safety
    /// As [`handle::get`].
    unsafe fn reporter(self) -> Option<Arc<dyn Reporter>>;
}

impl<H: Handle> Caller for H {
    unsafe fn reporter(self) -> Option<Arc<dyn Reporter>> {
        // SAFETY: the caller's promise.
        unsafe { handle::get(self) }.ok()?.reporter()
    }
}

/// Global commands begin with a pointer and have no listener.
impl<T> Caller for *const T {
    unsafe fn reporter(self) -> Option<Arc<dyn Reporter>> {
        None
    }
}

impl<T> Caller for *mut T {
    unsafe fn reporter(self) -> Option<Arc<dyn Reporter>> {
        None
    }
}

/// Runs a command: no panic leaves it, no error leaves it unreported, and how the application's thread rounds does not
/// matter.
pub(crate) fn guard<C: Caller, R: ReturnCode>(
    caller: C,
    command: &str,
    body: impl FnOnce() -> Result<R, Error>,
) -> R {
    let _environment = FloatEnvironment::set_default();
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(value)) => value,
        Ok(Err(error)) => {
            // SAFETY: commands pass the application's own handle, which is valid or refused; those that destroy it
            // return an error only before they do.
            let reporter = unsafe { caller.reporter() };
            report(reporter.as_deref(), command, &error);
            R::failure(&error)
        }
        Err(panic) => {
            // The panic may have come from the caller's own destruction, so its listener is not looked for.
            let error = match OutOfMemory::of_panic(panic.as_ref()) {
                Some(memory) => Error::OutOfHostMemory(memory.to_string()),
                None => Error::Panic(panic_message(panic.as_ref()).to_owned()),
            };
            report(None, command, &error);
            R::failure(&error)
        }
    }
}

/// Logs an error and tells the listener.
fn report(reporter: Option<&dyn Reporter>, command: &str, error: &Error) {
    let (text, id) = (error.to_string(), error.message_id());
    if text.contains(id) {
        log::error!("{command}: {text}");
    } else {
        log::error!("{command}: {text} [{id}]");
    }
    if let Some(reporter) = reporter {
        reporter.report_error(command, error);
    }
}

/// A panic's message.
pub(crate) fn panic_message(panic: &(dyn Any + Send)) -> &str {
    panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("panic")
}

/// The default floating-point environment of a thread, until it is dropped. Applications may flush denormals to zero or
/// round upwards in their threads, which is no business of the driver. Each command computes as Rust and Vulkan assume,
/// and so do the threads that it starts, which begin with the environment of the thread that starts them; on return the
/// application finds its own.
pub(crate) struct FloatEnvironment(Option<register::Bits>);

impl FloatEnvironment {
    /// Makes the thread round to nearest and keep denormals.
    pub(crate) fn set_default() -> Self {
        let before = register::read();
        if before & register::MODES == register::DEFAULT {
            return Self(None);
        }
        register::write(register::DEFAULT);
        Self(Some(before))
    }
}

impl Drop for FloatEnvironment {
    fn drop(&mut self) {
        if let Some(before) = self.0 {
            register::write(before);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod register {
    use std::arch::asm;

    pub(super) type Bits = u32;
    /// All but the flags of what has happened.
    pub(super) const MODES: Bits = 0xffc0;
    /// All exceptions are masked.
    pub(super) const DEFAULT: Bits = 0x1f80;

    pub(super) fn read() -> Bits {
        let mut bits: Bits = 0;
        // SAFETY: it stores the register, which is as wide, to the variable.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut bits, options(nostack, preserves_flags)) };
        bits
    }

    pub(super) fn write(bits: Bits) {
        // SAFETY: it is what Rust expects, or what the application had set and gets back as the driver returns to it.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const bits, options(nostack, preserves_flags)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod register {
    use std::arch::asm;

    pub(super) type Bits = u64;
    pub(super) const MODES: Bits = !0;
    /// No exception is trapped.
    pub(super) const DEFAULT: Bits = 0;

    pub(super) fn read() -> Bits {
        let bits;
        // SAFETY: the register may be read by any program.
        unsafe { asm!("mrs {}, fpcr", out(reg) bits, options(nostack, preserves_flags)) };
        bits
    }

    pub(super) fn write(bits: Bits) {
        // SAFETY: it is what Rust expects, or what the application had set and gets back as the driver returns to it.
        unsafe { asm!("msr fpcr, {}", in(reg) bits, options(nostack, preserves_flags)) };
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod register {
    pub(super) type Bits = u32;
    pub(super) const MODES: Bits = 0;
    pub(super) const DEFAULT: Bits = 0;

    pub(super) fn read() -> Bits {
        DEFAULT
    }

    pub(super) fn write(_: Bits) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error() {
        let result: vk::Result = guard(std::ptr::null::<u8>(), "test", || panic!("caught"));
        assert_eq!(result, vk::Result::ERROR_UNKNOWN);
    }

    #[test]
    fn want_of_memory_is_an_error_of_its_own() {
        let result: vk::Result = guard(std::ptr::null::<u8>(), "test", || {
            drop(simdevice::host::with_capacity::<u64>(1 << 60));
            Ok(vk::Result::SUCCESS)
        });
        assert_eq!(result, vk::Result::ERROR_OUT_OF_HOST_MEMORY);
    }
}
