//! Entry points: the functions that the dispatch table names. Each is a panic guard around a conversion of its
//! parameters and one call into an object.
//!
//! Conventions:
//! - the function of a command has `#[doc(alias = "vkCreateBuffer")]`, by which `driver/gen` and people find it, and is named
//!   as ash names it (`create_buffer`);
//! - most take the command's own parameters, and are declared in [`entry_points!`](crate::entry_points); a plain function takes
//!   what it wants in the form that it wants, and `dispatch/commands.rs` converts, guards and, for `vkCmd*`, records;
//! - the body of a declared one is one unsafe block that yields `Result<T, Error>`: `Ok(())` is `VK_SUCCESS`, another success code is
//!   `Ok(vk::Result)`, and an error is logged, sent to the instance's debug messengers and returned as
//!   [`Error::result`];
//! - handles become references through [`handle`](crate::handle), pointers through [`pointer`](crate::pointer), and
//!   chains through [`pnext`](crate::pnext);
//! - output handles of a command that fails are left as they were, except where Vulkan demands null;
//! - allocation callbacks are accepted and ignored, as Vulkan allows.

pub(crate) mod buffer;
pub(crate) mod buffer_view;
pub(crate) mod command;
pub(crate) mod command_buffer;
pub(crate) mod compute;
pub(crate) mod compute_pipeline;
pub(crate) mod debug_utils;
pub(crate) mod descriptor;
pub(crate) mod descriptor_update;
pub(crate) mod device;
pub(crate) mod dynamic_state;
pub(crate) mod graphics_pipeline;
pub(crate) mod image;
pub(crate) mod instance;
pub(crate) mod memory;
pub(crate) mod physical_device;
pub(crate) mod pipeline;
pub(crate) mod private_data;
pub(crate) mod query;
pub(crate) mod queue;
pub(crate) mod render_pass;
pub(crate) mod rendering;
pub(crate) mod sampler;
pub(crate) mod sync;
pub(crate) mod transfer;

use crate::error::Error;
use crate::float_control::FloatControl;
use crate::handle::{self, Handle, Object};
use crate::object::instance::Instance;
use ash::vk;
use simdevice::host::OutOfMemory;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// Declares entry points. See the module for the conventions.
#[macro_export]
#[doc(hidden)]
macro_rules! entry_points {
    ($(
        $(#[$meta:meta])*
        fn $name:ident($first:ident: $first_type:ty $(, $argument:ident: $type:ty)* $(,)?) $(-> $return:ty)? $body:block
    )*) => {$(
        $(#[$meta])*
        #[allow(clippy::too_many_arguments, reason = "Vulkan's signature")]
        pub(crate) unsafe extern "system" fn $name(
            $first: $first_type,
            $($argument: $type),*
        ) $(-> $return)? {
            #[allow(unused_unsafe, reason = "not every body needs it")]
            $crate::entrypoints::guard($first, stringify!($name), || {
                // SAFETY: the application follows Vulkan's valid usage: handles are live and externally synchronised
                // as the command demands, and pointers are null or valid for the command's duration.
                unsafe { $body }
            })
        }
    )*};
}

/// What an entry point returns to the application.
pub(crate) trait Return {
    /// What it returns when the command fails.
    fn failure(error: &Error) -> Self;
}

impl Return for vk::Result {
    fn failure(error: &Error) -> Self {
        error.result()
    }
}

/// Commands without a result: the error is only reported.
impl Return for () {
    fn failure(_: &Error) {}
}

macro_rules! zero_on_failure {
    ($($type:ty),*) => {$(
        impl Return for $type {
            fn failure(_: &Error) -> Self {
                Self::default()
            }
        }
    )*};
}
zero_on_failure!(u32, u64, vk::PFN_vkVoidFunction);

/// What an entry point's body may yield for a return type.
pub(crate) trait Outcome<R> {
    /// The value to return.
    fn into_return(self) -> R;
}

impl<R: Return> Outcome<R> for R {
    fn into_return(self) -> R {
        self
    }
}

impl Outcome<vk::Result> for () {
    fn into_return(self) -> vk::Result {
        vk::Result::SUCCESS
    }
}

/// The first parameter of an entry point, by which its instance is found.
pub(crate) trait Caller: Copy {
    /// The instance whose messengers hear about errors.
    ///
    /// # Safety
    /// As [`handle::get`].
    unsafe fn instance(self) -> Option<Arc<Instance>>;
}

impl<H: Handle> Caller for H {
    unsafe fn instance(self) -> Option<Arc<Instance>> {
        // SAFETY: the caller's promise.
        unsafe { handle::get(self) }.ok()?.reporting_instance()
    }
}

/// Global commands begin with a pointer and have no instance.
impl<T> Caller for *const T {
    unsafe fn instance(self) -> Option<Arc<Instance>> {
        None
    }
}

impl<T> Caller for *mut T {
    unsafe fn instance(self) -> Option<Arc<Instance>> {
        None
    }
}

/// Runs an entry point's body: no panic leaves it, no error leaves it unreported, and how the application's thread rounds
/// does not matter.
pub(crate) fn guard<C: Caller, R: Return, T: Outcome<R>>(
    caller: C,
    function: &str,
    body: impl FnOnce() -> Result<T, Error>,
) -> R {
    let _control = FloatControl::usual();
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(value)) => value.into_return(),
        Ok(Err(error)) => {
            // SAFETY: entry points pass the application's own handle, which is valid or refused; commands that
            // destroy it return an error only before they do.
            let instance = unsafe { caller.instance() };
            report(instance.as_deref(), function, &error);
            R::failure(&error)
        }
        Err(panic) => {
            // The panic may have come from the caller's own destruction, so its instance is not looked for.
            let error = match OutOfMemory::of_panic(panic.as_ref()) {
                Some(memory) => Error::OutOfHostMemory(memory.to_string()),
                None => Error::Panic(panic_message(panic.as_ref()).to_owned()),
            };
            report(None, function, &error);
            R::failure(&error)
        }
    }
}

/// Logs an error and tells the instance's messengers.
fn report(instance: Option<&Instance>, function: &str, error: &Error) {
    let function = if function.starts_with("vk") {
        function.to_owned()
    } else {
        vulkan_name(function)
    };
    log::error!("{function}: {error} [{}]", error.message_id());
    if let Some(instance) = instance {
        instance.report_error(&function, error);
    }
}

/// What a panic said.
pub(crate) fn panic_message(panic: &(dyn Any + Send)) -> &str {
    panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("panic")
}

/// Vulkan's name of an entry point: `vkCmdSetEvent2` for `cmd_set_event2`.
pub(crate) fn vulkan_name(function: &str) -> String {
    let mut name = String::from("vk");
    for word in function.split('_') {
        if matches!(word, "khr" | "ext" | "gaurast") {
            name.push_str(&word.to_ascii_uppercase());
        } else {
            let (initial, rest) = word.split_at(usize::from(!word.is_empty()));
            name.push_str(&initial.to_ascii_uppercase());
            name.push_str(rest);
        }
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entry_points_have_vulkan_names() {
        assert_eq!(vulkan_name("create_buffer"), "vkCreateBuffer");
        assert_eq!(vulkan_name("cmd_set_event2"), "vkCmdSetEvent2");
        assert_eq!(
            vulkan_name("create_debug_utils_messenger_ext"),
            "vkCreateDebugUtilsMessengerEXT"
        );
    }

    #[test]
    fn a_panic_becomes_an_error() {
        let result: vk::Result = guard(std::ptr::null::<u8>(), "test", || -> Result<(), Error> {
            panic!("caught")
        });
        assert_eq!(result, vk::Result::ERROR_UNKNOWN);
    }

    #[test]
    fn want_of_memory_is_an_error_of_its_own() {
        let result: vk::Result = guard(std::ptr::null::<u8>(), "test", || {
            drop(simdevice::host::with_capacity::<u64>(1 << 60));
            Ok(())
        });
        assert_eq!(result, vk::Result::ERROR_OUT_OF_HOST_MEMORY);
    }
}
