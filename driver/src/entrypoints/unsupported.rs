//! Core commands that the driver does not execute yet. Their names must be there, because ash aborts the process
//! when an application calls a core command that wasn't found; calling one fails with a message. One that is recorded
//! makes `vkEndCommandBuffer` fail: it never draws something else.
//!
//! To implement a command, delete its line here and point its row of the dispatch table at the new function.

use crate::entrypoints::{Outcome, Return, guard, vulkan_name};
use crate::error::Error;
use crate::handle;
use ash::vk;

/// What refuses an unsupported command.
trait Refuse: Copy {
    /// Remembers that `command` was refused, where that matters later.
    ///
    /// # Safety
    /// As [`handle::get`].
    unsafe fn refuse(self, command: &str);
}

/// The command returns its error at once.
impl Refuse for vk::Device {
    unsafe fn refuse(self, _: &str) {}
}

/// The command returns its error at once.
impl Refuse for vk::Queue {
    unsafe fn refuse(self, _: &str) {}
}

/// The recording fails when it ends.
impl Refuse for vk::CommandBuffer {
    unsafe fn refuse(self, command: &str) {
        // SAFETY: the caller's promise.
        if let Ok(command_buffer) = unsafe { handle::get(self) } {
            command_buffer.fail(Error::Unsupported {
                command: command.to_owned(),
            });
        }
    }
}

/// What an unsupported command yields.
enum Never {}

impl<R: Return> Outcome<R> for Never {
    fn into_return(self) -> R {
        match self {}
    }
}

fn refuse<H: Refuse>(caller: H, function: &str) -> Result<Never, Error> {
    let command = vulkan_name(function);
    // SAFETY: entry points pass the application's own handle, which is valid or refused.
    unsafe { caller.refuse(&command) };
    Err(Error::Unsupported { command })
}

macro_rules! unsupported {
    ($(fn $name:ident($first:ident: $first_type:ty $(, $argument:ident: $type:ty)*) $(-> $return:ty)?;)*) => {$(
        #[allow(clippy::too_many_arguments, reason = "Vulkan's signature")]
        pub(crate) unsafe extern "system" fn $name($first: $first_type, $(_: $type),*) $(-> $return)? {
            guard($first, stringify!($name), || refuse($first, stringify!($name)))
        }
    )*};
}

unsupported! {
    fn queue_bind_sparse(queue: vk::Queue, bind_info_count: u32, bind_info: *const vk::BindSparseInfo<'_>, fence: vk::Fence) -> vk::Result;
    fn create_sampler_ycbcr_conversion(device: vk::Device, create_info: *const vk::SamplerYcbcrConversionCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, ycbcr_conversion: *mut vk::SamplerYcbcrConversion) -> vk::Result;
    fn destroy_sampler_ycbcr_conversion(device: vk::Device, ycbcr_conversion: vk::SamplerYcbcrConversion, allocator: *const vk::AllocationCallbacks<'_>);
    fn get_buffer_device_address(device: vk::Device, info: *const vk::BufferDeviceAddressInfo<'_>) -> vk::DeviceAddress;
    fn get_buffer_opaque_capture_address(device: vk::Device, info: *const vk::BufferDeviceAddressInfo<'_>) -> u64;
    fn get_device_memory_opaque_capture_address(device: vk::Device, info: *const vk::DeviceMemoryOpaqueCaptureAddressInfo<'_>) -> u64;
}
