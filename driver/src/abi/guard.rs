//! The guard around each command: it catches panics and errors, reports them and converts them to results, and sets the
//! rounding mode that Rust assumes.
//!
//! The functions that Vulkan calls are generated (`dispatch/commands.rs`, by `driver/gen`). Each is this guard around a
//! conversion of its parameters and a call of one function of the driver. The generator and readers find that function by
//! its alias, such as `#[doc(alias = "vkCreateBuffer")]`. Parameters and results are converted:
//! - handles become objects through [`handle`](crate::abi::handle), pointers and chains become references through
//!   [`valid`](crate::abi::valid);
//! - `Ok(())` is `VK_SUCCESS`, another success code is `Ok(vk::Result)` ([`Success`]), and an error is logged, sent to the
//!   instance's debug messengers and returned as [`Error::result`];
//! - output handles of a command that fails are unchanged, except if Vulkan requires null;
//! - allocation callbacks are accepted and ignored, as Vulkan allows.

use crate::abi::error::Error;
use crate::abi::handle::{self, Handle, Object, Reporter};
use crate::abi::sanitizer::Ignored;
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

/// For commands without a result, an error is only reported.
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

/// A value with which a command succeeds, as its result `R`.
pub(crate) trait Success<R> {
    /// The command's result.
    fn result(self) -> R;
}

impl<R> Success<R> for R {
    fn result(self) -> R {
        self
    }
}

impl Success<vk::Result> for () {
    fn result(self) -> vk::Result {
        vk::Result::SUCCESS
    }
}

/// Commands without a result can't say that their output is incomplete.
impl Success<()> for vk::Result {
    fn result(self) {}
}

/// Commands that destroy an object drop it.
impl<T> Success<()> for Option<Arc<T>> {
    fn result(self) {}
}

/// A command's first parameter, which leads to the listener for its errors.
pub(crate) trait Caller: Copy {
    /// The listener for errors, if there is one.
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

/// Runs a command. No panic leaves it, every error is reported, the rounding mode of the application's thread does not
/// matter, and ThreadSanitizer ignores what the command accesses.
pub(crate) fn guard<C: Caller, R: ReturnCode, S: Success<R>>(
    caller: C,
    command: &str,
    body: impl FnOnce() -> Result<S, Error>,
) -> R {
    let _environment = FloatEnvironment::set_default();
    let _ignored = Ignored::begin();
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(value)) => value.result(),
        Ok(Err(error)) => {
            // SAFETY: commands pass the application's own handle, which is valid or refused; those that destroy it
            // return an error only before they do.
            let reporter = unsafe { caller.reporter() };
            report(reporter.as_deref(), command, &error);
            R::failure(&error)
        }
        Err(panic) => {
            // The panic may come from the caller's own destruction, so its listener is not looked up.
            let error = match OutOfMemory::of_panic(panic.as_ref()) {
                Some(memory) => Error::OutOfHostMemory(memory.to_string()),
                None => Error::Panic(panic_message(panic.as_ref()).to_owned()),
            };
            report(None, command, &error);
            R::failure(&error)
        }
    }
}

/// Fails a command that isn't supported.
pub(crate) fn refuse<C: Caller, R: ReturnCode>(caller: C, command: &str) -> R {
    guard(caller, command, || Err::<R, _>(Error::Unsupported { command: command.to_owned() }))
}

/// Logs an error and reports it to the listener.
pub(crate) fn report(reporter: Option<&dyn Reporter>, command: &str, error: &Error) {
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

/// Sets the default floating-point environment of a thread until it is dropped. Applications may flush denormals to
/// zero or round upwards in their threads. Each command computes with the modes that Rust and Vulkan assume, and so do
/// the threads that it starts, which inherit the environment of the thread that starts them. On return the
/// application's own environment is restored.
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
    /// All bits except the flags of exceptions that have occurred.
    pub(super) const MODES: Bits = 0xffc0;
    /// The register with all exceptions masked.
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
    /// The register with no exception trapped.
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
        let result: vk::Result = guard(std::ptr::null::<u8>(), "test", || -> Result<(), Error> { panic!("caught") });
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
