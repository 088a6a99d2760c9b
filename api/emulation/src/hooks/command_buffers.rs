//! Command pools and command buffers.

use std::sync::PoisonError;

use ash::vk;
use gaurast_layer_interface::{find, slice};

use crate::emulation::Pool;
use crate::hooks::site::call;
use crate::pass::Pass;
use crate::recording::Recording;

pub(super) unsafe extern "system" fn create_command_pool(
    device: vk::Device,
    info: *const vk::CommandPoolCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    pool: *mut vk::CommandPool,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let result = (own.next.fp_v1_0().create_command_pool)(device, info, allocator, pool);
            if let (Some(emulation), vk::Result::SUCCESS) = (&own.emulation, result) {
                let known = Pool { family: (*info).queue_family_index, buffers: Vec::new() };
                emulation.objects_mut().pools.insert(*pool, known);
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn destroy_command_pool(
    device: vk::Device,
    pool: vk::CommandPool,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                let known = emulation.objects_mut().pools.remove(&pool).unwrap_or_default();
                for commands in known.buffers {
                    own.remove_recording(commands);
                }
            }
            own.next.destroy_command_pool(pool, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}

pub(super) unsafe extern "system" fn reset_command_pool(
    device: vk::Device,
    pool: vk::CommandPool,
    flags: vk::CommandPoolResetFlags,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let result = (own.next.fp_v1_0().reset_command_pool)(device, pool, flags);
            if let (Some(emulation), vk::Result::SUCCESS) = (&own.emulation, result) {
                let buffers = emulation.objects().pools.get(&pool).map(|known| known.buffers.clone());
                for commands in buffers.unwrap_or_default() {
                    if let Some(recording) = own.recording(commands) {
                        recording.lock().unwrap_or_else(PoisonError::into_inner).reset();
                    }
                }
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn allocate_command_buffers(
    device: vk::Device,
    info: *const vk::CommandBufferAllocateInfo<'_>,
    buffers: *mut vk::CommandBuffer,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let result = (own.next.fp_v1_0().allocate_command_buffers)(device, info, buffers);
            if let (Some(emulation), vk::Result::SUCCESS) = (&own.emulation, result) {
                let new = slice(buffers, (*info).command_buffer_count);
                let mut objects = emulation.objects_mut();
                let pool = objects.pools.entry((*info).command_pool).or_default();
                pool.buffers.extend_from_slice(new);
                let family = pool.family;
                drop(objects);
                for &commands in new {
                    own.add_recording(Recording::new(commands, family));
                }
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn free_command_buffers(
    device: vk::Device,
    pool: vk::CommandPool,
    count: u32,
    buffers: *const vk::CommandBuffer,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            let freed = slice(buffers, count);
            if let Some(emulation) = &own.emulation {
                if let Some(known) = emulation.objects_mut().pools.get_mut(&pool) {
                    known.buffers.retain(|commands| !freed.contains(commands));
                }
                for &commands in freed {
                    own.remove_recording(commands);
                }
            }
            (own.next.fp_v1_0().free_command_buffers)(device, pool, count, buffers);
            vk::Result::SUCCESS
        });
    }
}

pub(super) unsafe extern "system" fn begin_command_buffer(
    commands: vk::CommandBuffer,
    info: *const vk::CommandBufferBeginInfo<'_>,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(commands, |own| {
            if let Some(recording) = own.recording(commands) {
                let mut recording = recording.lock().unwrap_or_else(PoisonError::into_inner);
                recording.reset();
                let continues = (*info).flags.contains(vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE);
                if continues && !(*info).p_inheritance_info.is_null() {
                    recording.pass = Some(Pass::Inherited);
                }
            }
            begin(own, commands, &*info)
        })
    }
}

/// Begins a command buffer. Rendering that is inherited is never suspended: see [`crate::pass`].
///
/// # Safety
/// See the crate.
unsafe fn begin(
    own: &crate::device::Device,
    commands: vk::CommandBuffer,
    info: &vk::CommandBufferBeginInfo<'_>,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        let next = own.next.fp_v1_0().begin_command_buffer;
        let inheritance = info.p_inheritance_info.as_ref().filter(|_| own.emulation.is_some());
        let rendering = inheritance.and_then(|info| find::<vk::CommandBufferInheritanceRenderingInfo<'_>>(info.p_next));
        let (Some(inheritance), Some(rendering)) = (inheritance, rendering) else {
            return next(commands, info);
        };
        let parts = vk::RenderingFlags::SUSPENDING | vk::RenderingFlags::RESUMING;
        if !rendering.flags.intersects(parts) || inheritance.p_next != std::ptr::from_ref(rendering).cast() {
            return next(commands, info);
        }
        let mut rendering = *rendering;
        rendering.flags &= !parts;
        let mut inheritance = *inheritance;
        inheritance.p_next = (&raw const rendering).cast();
        let mut info = *info;
        info.p_inheritance_info = &raw const inheritance;
        next(commands, &raw const info)
    }
}

pub(super) unsafe extern "system" fn end_command_buffer(commands: vk::CommandBuffer) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(commands, |own| {
            let result = (own.next.fp_v1_0().end_command_buffer)(commands);
            let recording = own.recording(commands);
            let failure =
                recording.and_then(|recording| recording.lock().unwrap_or_else(PoisonError::into_inner).failure);
            match failure {
                Some(error) if result == vk::Result::SUCCESS => error,
                _ => result,
            }
        })
    }
}

pub(super) unsafe extern "system" fn reset_command_buffer(
    commands: vk::CommandBuffer,
    flags: vk::CommandBufferResetFlags,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(commands, |own| {
            let result = (own.next.fp_v1_0().reset_command_buffer)(commands, flags);
            if let Some(recording) = own.recording(commands) {
                recording.lock().unwrap_or_else(PoisonError::into_inner).reset();
            }
            result
        })
    }
}
