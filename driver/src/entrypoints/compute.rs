//! Commands that bind descriptors and push constants, and that dispatch.

use super::descriptor_update;
use crate::capabilities::limits;
use crate::command::bound::{BindPoint, BoundSet};
use crate::command::record::{BindSets, Command, PushDescriptors};
use crate::command::recorder::Recorder;
use crate::error::Error;
use crate::object::buffer::Buffer;
use crate::object::descriptor::layout::DescriptorSetLayout;
use crate::object::descriptor::set::DescriptorSet;
use crate::object::descriptor::template::UpdateTemplate;
use crate::object::pipeline::layout::PipelineLayout;
use ash::vk;
use std::ffi::c_void;
use std::sync::Arc;

#[doc(alias = "vkCmdBindDescriptorSets")]
pub(crate) fn cmd_bind_descriptor_sets(
    recorder: &mut Recorder,
    pipeline_bind_point: vk::PipelineBindPoint,
    layout: &PipelineLayout,
    first_set: u32,
    descriptor_sets: &[Arc<DescriptorSet>],
    dynamic_offsets: &[u32],
) -> Result<(), Error> {
    let mut rest = dynamic_offsets;
    let mut bound = simdevice::host::with_capacity(descriptor_sets.len());
    for (number, set) in (first_set..).zip(descriptor_sets) {
        layout.set_layout(number)?;
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
    if let Some(offset) = dynamic_offsets
        .iter()
        .find(|&&offset| u64::from(offset) % limits::MIN_BUFFER_OFFSET_ALIGNMENT != 0)
    {
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
}

#[doc(alias = "vkCmdPushConstants")]
pub(crate) fn cmd_push_constants(
    recorder: &mut Recorder,
    _layout: &PipelineLayout,
    offset: u32,
    values: &[u8],
) -> Result<(), Error> {
    let size = values.len() as u32;
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
    let bytes = values.into();
    recorder.push(Command::PushConstants { offset, bytes });
    Ok(())
}

/// # Safety
/// The writes, their chains and their handles are valid.
#[doc(alias = "vkCmdPushDescriptorSetKHR")]
pub(crate) unsafe fn cmd_push_descriptor_set_khr(
    recorder: &mut Recorder,
    pipeline_bind_point: vk::PipelineBindPoint,
    layout: &PipelineLayout,
    set: u32,
    descriptor_writes: &[vk::WriteDescriptorSet<'_>],
) -> Result<(), Error> {
    let layout = Arc::clone(layout.set_layout(set)?);
    let writes = descriptor_writes
        .iter()
        // SAFETY: the caller's promise.
        .map(|info| unsafe { descriptor_update::write(info, &layout) });
    recorder.push(Command::PushDescriptors(Box::new(PushDescriptors {
        bind_point: BindPoint::from_vk(pipeline_bind_point)?,
        set,
        writes: writes.collect::<Result<_, _>>()?,
        layout: pushed(layout)?,
    })));
    Ok(())
}

/// # Safety
/// The data is what the template describes, and its handles are live.
#[doc(alias = "vkCmdPushDescriptorSetWithTemplateKHR")]
pub(crate) unsafe fn cmd_push_descriptor_set_with_template_khr(
    recorder: &mut Recorder,
    descriptor_update_template: &UpdateTemplate,
    layout: &PipelineLayout,
    set: u32,
    data: *const c_void,
) -> Result<(), Error> {
    let Some(bind_point) = descriptor_update_template.push_bind_point else {
        return Err(Error::usage(
            "VUID-vkCmdPushDescriptorSetWithTemplateKHR-descriptorUpdateTemplate-07994",
            "the update template is not for pushed descriptors",
        ));
    };
    let layout = Arc::clone(layout.set_layout(set)?);
    // SAFETY: the caller's promise.
    let writes =
        unsafe { descriptor_update::template_writes(descriptor_update_template, &layout, data)? };
    recorder.push(Command::PushDescriptors(Box::new(PushDescriptors {
        bind_point: BindPoint::from_vk(bind_point)?,
        set,
        writes,
        layout: pushed(layout)?,
    })));
    Ok(())
}

#[doc(alias = "vkCmdDispatch")]
pub(crate) fn cmd_dispatch(
    recorder: &mut Recorder,
    group_count_x: u32,
    group_count_y: u32,
    group_count_z: u32,
) -> Result<(), Error> {
    dispatch(
        recorder,
        [0; 3],
        [group_count_x, group_count_y, group_count_z],
    )
}

#[doc(alias = "vkCmdDispatchBase")]
pub(crate) fn cmd_dispatch_base(
    recorder: &mut Recorder,
    base_group_x: u32,
    base_group_y: u32,
    base_group_z: u32,
    group_count_x: u32,
    group_count_y: u32,
    group_count_z: u32,
) -> Result<(), Error> {
    let base = [base_group_x, base_group_y, base_group_z];
    dispatch(
        recorder,
        base,
        [group_count_x, group_count_y, group_count_z],
    )
}

#[doc(alias = "vkCmdDispatchIndirect")]
pub(crate) fn cmd_dispatch_indirect(
    recorder: &mut Recorder,
    buffer: &Arc<Buffer>,
    offset: vk::DeviceSize,
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    let size = size_of::<vk::DispatchIndirectCommand>() as u64;
    let range = buffer.range(offset, Some(size))?;
    recorder.push(Command::DispatchIndirect(range));
    Ok(())
}

/// Records a dispatch.
fn dispatch(recorder: &mut Recorder, base: [u32; 3], count: [u32; 3]) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    recorder.push(Command::Dispatch { base, count });
    Ok(())
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
