//! Command pools and command buffers, but for what is recorded.

use crate::capabilities::formats;
use crate::command::recorder::Usage;
use crate::error::Error;
use crate::object::command_buffer::CommandPool;
use crate::{handle, pnext, pointer};
use ash::vk;
use simdevice::Format;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateCommandPool")]
    fn create_command_pool(
        device: vk::Device,
        create_info: *const vk::CommandPoolCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        command_pool: *mut vk::CommandPool,
    ) -> vk::Result {
        let device = Arc::clone(handle::get(device)?);
        let object = CommandPool::new(device, pointer::input(create_info)?.flags);
        pointer::output(command_pool, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkDestroyCommandPool")]
    fn destroy_command_pool(
        _device: vk::Device,
        command_pool: vk::CommandPool,
        _allocator: *const vk::AllocationCallbacks<'_>,
    ) {
        match handle::destroy(command_pool)? {
            Some(pool) => pool.free_all(),
            None => Ok(()),
        }
    }

    #[doc(alias = "vkResetCommandPool")]
    fn reset_command_pool(
        _device: vk::Device,
        command_pool: vk::CommandPool,
        _flags: vk::CommandPoolResetFlags,
    ) -> vk::Result {
        handle::get(command_pool)?.reset()
    }

    /// There is no memory to give back.
    #[doc(alias = "vkAllocateCommandBuffers")]
    fn allocate_command_buffers(
        _device: vk::Device,
        allocate_info: *const vk::CommandBufferAllocateInfo<'_>,
        command_buffers: *mut vk::CommandBuffer,
    ) -> vk::Result {
        let info = pointer::input(allocate_info)?;
        let pool = handle::get(info.command_pool)?;
        for index in 0..info.command_buffer_count as usize {
            pointer::output(command_buffers.add(index), pool.allocate(info.level))?;
        }
        Ok(())
    }

    #[doc(alias = "vkFreeCommandBuffers")]
    fn free_command_buffers(
        _device: vk::Device,
        command_pool: vk::CommandPool,
        command_buffer_count: u32,
        command_buffers: *const vk::CommandBuffer,
    ) {
        let buffers = pointer::slice(command_buffers, command_buffer_count)?;
        handle::get(command_pool)?.free(buffers)
    }

    #[doc(alias = "vkBeginCommandBuffer")]
    fn begin_command_buffer(
        command_buffer: vk::CommandBuffer,
        begin_info: *const vk::CommandBufferBeginInfo<'_>,
    ) -> vk::Result {
        let command_buffer = handle::get(command_buffer)?;
        let info = pointer::input(begin_info)?;
        let inherits = command_buffer.is_secondary()
            && info.flags.contains(vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE);
        let usage = Usage {
            one_time: info.flags.contains(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT),
            simultaneous: info.flags.contains(vk::CommandBufferUsageFlags::SIMULTANEOUS_USE),
            inherited_pass: if inherits {
                Some(inherited_formats(pointer::input(info.p_inheritance_info)?)?)
            } else {
                None
            },
        };
        let mut recorder = command_buffer.recorder();
        if !recorder.is_initial() && !command_buffer.resets_single() {
            return Err(Error::usage(
                "VUID-vkBeginCommandBuffer-commandBuffer-00050",
                "the command buffer's pool lacks VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT",
            ));
        }
        recorder.begin(usage)
    }

    #[doc(alias = "vkEndCommandBuffer")]
    fn end_command_buffer(command_buffer: vk::CommandBuffer) -> vk::Result {
        handle::get(command_buffer)?.end()
    }

    #[doc(alias = "vkResetCommandBuffer")]
    fn reset_command_buffer(
        command_buffer: vk::CommandBuffer,
        _flags: vk::CommandBufferResetFlags,
    ) -> vk::Result {
        let command_buffer = handle::get(command_buffer)?;
        if !command_buffer.resets_single() {
            return Err(Error::usage(
                "VUID-vkResetCommandBuffer-commandBuffer-00046",
                "the command buffer's pool lacks VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT",
            ));
        }
        command_buffer.recorder().reset()
    }
}

/// The colour formats of the pass that a secondary command buffer continues.
///
/// # Safety
/// The inheritance info and its chain are valid.
unsafe fn inherited_formats(
    info: &vk::CommandBufferInheritanceInfo<'_>,
) -> Result<Vec<Option<Format>>, Error> {
    // SAFETY: the caller's promise.
    let formats = unsafe {
        if let Some(render_pass) = handle::get_optional(info.render_pass)? {
            render_pass
                .color_formats(info.subpass as usize)
                .ok_or_else(|| {
                    Error::usage(
                        "VUID-VkCommandBufferBeginInfo-flags-06001",
                        format!("the render pass has no subpass {}", info.subpass),
                    )
                })?
        } else {
            let rendering = pnext::find::<vk::CommandBufferInheritanceRenderingInfo>(info.p_next);
            match rendering {
                None => Vec::new(),
                Some(rendering) => pointer::slice(
                    rendering.p_color_attachment_formats,
                    rendering.color_attachment_count,
                )?
                .to_vec(),
            }
        }
    };
    Ok(formats.into_iter().map(formats::device_format).collect())
}
