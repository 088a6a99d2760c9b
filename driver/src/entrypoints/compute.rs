//! Commands that bind descriptors and push constants, and that dispatch.

use super::command::record;
use super::descriptor_update;
use crate::capabilities::limits;
use crate::command::bound::{BindPoint, BoundSet};
use crate::command::record::{BindSets, Command, PushDescriptors};
use crate::error::Error;
use crate::object::descriptor::layout::DescriptorSetLayout;
use crate::{handle, pointer};
use ash::vk;
use std::ffi::c_void;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCmdBindDescriptorSets")]
    fn cmd_bind_descriptor_sets(
        command_buffer: vk::CommandBuffer,
        pipeline_bind_point: vk::PipelineBindPoint,
        layout: vk::PipelineLayout,
        first_set: u32,
        descriptor_set_count: u32,
        descriptor_sets: *const vk::DescriptorSet,
        dynamic_offset_count: u32,
        dynamic_offsets: *const u32,
    ) {
        record(command_buffer, |recorder| {
            let layout = handle::get(layout)?;
            let sets = pointer::slice(descriptor_sets, descriptor_set_count)?;
            let offsets = pointer::slice(dynamic_offsets, dynamic_offset_count)?;
            let mut rest = offsets;
            let mut bound = simdevice::host::with_capacity(sets.len());
            for (number, &set) in (first_set..).zip(sets) {
                layout.set_layout(number)?;
                let set = handle::get(set)?;
                let count = set.layout().dynamic_count();
                let Some((own, others)) = rest.split_at_checked(count) else {
                    return Err(dynamic_offset_count_error());
                };
                rest = others;
                bound.push(BoundSet {
                    set: Arc::clone(set),
                    dynamic_offsets: own.to_vec(),
                });
            }
            if !rest.is_empty() {
                return Err(dynamic_offset_count_error());
            }
            if let Some(offset) = offsets.iter().find(|&&offset| u64::from(offset) % limits::MIN_BUFFER_OFFSET_ALIGNMENT != 0) {
                return Err(Error::usage(
                    "VUID-vkCmdBindDescriptorSets-pDynamicOffsets-01971",
                    format!(
                        "the dynamic offset {offset} is not a multiple of {}",
                        limits::MIN_BUFFER_OFFSET_ALIGNMENT
                    ),
                ));
            }
            recorder.push(Command::BindSets(Box::new(BindSets {
                bind_point: BindPoint::from_vk(pipeline_bind_point)?,
                first: first_set,
                sets: bound,
            })));
            Ok(())
        })
    }

    #[doc(alias = "vkCmdPushConstants")]
    fn cmd_push_constants(
        command_buffer: vk::CommandBuffer,
        layout: vk::PipelineLayout,
        _stage_flags: vk::ShaderStageFlags,
        offset: u32,
        size: u32,
        values: *const c_void,
    ) {
        record(command_buffer, |recorder| {
            handle::get(layout)?;
            let end = offset.checked_add(size);
            if end.is_none_or(|end| end > limits::MAX_PUSH_CONSTANTS_SIZE) {
                return Err(Error::usage(
                    "VUID-vkCmdPushConstants-offset-00370",
                    format!(
                        "{size} bytes of push constants at offset {offset} of {}",
                        limits::MAX_PUSH_CONSTANTS_SIZE
                    ),
                ));
            }
            let bytes = pointer::slice(values.cast::<u8>(), size)?.into();
            recorder.push(Command::PushConstants { offset, bytes });
            Ok(())
        })
    }

    #[doc(alias = "vkCmdPushDescriptorSetKHR")]
    fn cmd_push_descriptor_set_khr(
        command_buffer: vk::CommandBuffer,
        pipeline_bind_point: vk::PipelineBindPoint,
        layout: vk::PipelineLayout,
        set: u32,
        descriptor_write_count: u32,
        descriptor_writes: *const vk::WriteDescriptorSet<'_>,
    ) {
        record(command_buffer, |recorder| {
            let layout = Arc::clone(handle::get(layout)?.set_layout(set)?);
            let infos = pointer::slice(descriptor_writes, descriptor_write_count)?;
            let writes = infos.iter().map(|info| descriptor_update::write(info, &layout));
            recorder.push(Command::PushDescriptors(Box::new(PushDescriptors {
                bind_point: BindPoint::from_vk(pipeline_bind_point)?,
                set,
                writes: writes.collect::<Result<_, _>>()?,
                layout: pushed(layout)?,
            })));
            Ok(())
        })
    }

    #[doc(alias = "vkCmdPushDescriptorSetWithTemplateKHR")]
    fn cmd_push_descriptor_set_with_template_khr(
        command_buffer: vk::CommandBuffer,
        descriptor_update_template: vk::DescriptorUpdateTemplate,
        layout: vk::PipelineLayout,
        set: u32,
        data: *const c_void,
    ) {
        record(command_buffer, |recorder| {
            let template = handle::get(descriptor_update_template)?;
            let Some(bind_point) = template.push_bind_point else {
                return Err(Error::usage(
                    "VUID-vkCmdPushDescriptorSetWithTemplateKHR-descriptorUpdateTemplate-07994",
                    "the update template is not for pushed descriptors",
                ));
            };
            let layout = Arc::clone(handle::get(layout)?.set_layout(set)?);
            let writes = descriptor_update::template_writes(template, &layout, data)?;
            recorder.push(Command::PushDescriptors(Box::new(PushDescriptors {
                bind_point: BindPoint::from_vk(bind_point)?,
                set,
                writes,
                layout: pushed(layout)?,
            })));
            Ok(())
        })
    }

    #[doc(alias = "vkCmdDispatch")]
    fn cmd_dispatch(
        command_buffer: vk::CommandBuffer,
        group_count_x: u32,
        group_count_y: u32,
        group_count_z: u32,
    ) {
        dispatch(command_buffer, [0; 3], [group_count_x, group_count_y, group_count_z])
    }

    #[doc(alias = "vkCmdDispatchBase")]
    fn cmd_dispatch_base(
        command_buffer: vk::CommandBuffer,
        base_group_x: u32,
        base_group_y: u32,
        base_group_z: u32,
        group_count_x: u32,
        group_count_y: u32,
        group_count_z: u32,
    ) {
        let base = [base_group_x, base_group_y, base_group_z];
        dispatch(command_buffer, base, [group_count_x, group_count_y, group_count_z])
    }

    #[doc(alias = "vkCmdDispatchIndirect")]
    fn cmd_dispatch_indirect(
        command_buffer: vk::CommandBuffer,
        buffer: vk::Buffer,
        offset: vk::DeviceSize,
    ) {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let size = size_of::<vk::DispatchIndirectCommand>() as u64;
            let range = handle::get(buffer)?.range(offset, Some(size))?;
            recorder.push(Command::DispatchIndirect(range));
            Ok(())
        })
    }
}

/// Records a dispatch.
///
/// # Safety
/// The handle is live.
unsafe fn dispatch(
    command_buffer: vk::CommandBuffer,
    base: [u32; 3],
    count: [u32; 3],
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            recorder.push(Command::Dispatch { base, count });
            Ok(())
        })
    }
}

fn dynamic_offset_count_error() -> Error {
    Error::usage(
        "VUID-vkCmdBindDescriptorSets-dynamicOffsetCount-00359",
        "the number of dynamic offsets is not that of the sets' dynamic descriptors",
    )
}

/// The layout, if its sets are pushed.
fn pushed(layout: Arc<DescriptorSetLayout>) -> Result<Arc<DescriptorSetLayout>, Error> {
    if layout.is_push() {
        return Ok(layout);
    }
    Err(Error::usage(
        "VUID-vkCmdPushDescriptorSetKHR-set-00365",
        "descriptors are pushed to a set whose layout is not for that",
    ))
}
