//! Commands that bind pipelines, buffers, descriptors and push constants.

use super::buffer::Recorder;
use super::{BindPoint, BindSets, BoundSet, Command, IndexBuffer, PushDescriptors, VertexBuffer};
use crate::abi::error::Error;
use crate::abi::handle::Handles;
use crate::descriptor::layout::DescriptorSetLayout;
use crate::descriptor::set::{self, UpdateTemplate};
use crate::physical_device::limits;
use crate::pipeline::Pipeline;
use crate::pipeline::layout::PipelineLayout;
use crate::pipeline::parts::VertexInput;
use crate::resource::buffer::{Buffer, BufferRules};
use ash::vk;
use simdevice::Allocation;
use simdevice::BufferRange;
use std::ffi::c_void;
use std::sync::Arc;

#[doc(alias = "vkCmdBindPipeline")]
pub(crate) fn cmd_bind_pipeline(
    recorder: &mut Recorder,
    pipeline_bind_point: vk::PipelineBindPoint,
    pipeline: &Pipeline,
) -> Result<(), Error> {
    let command = match (pipeline, pipeline_bind_point) {
        (Pipeline::Graphics(pipeline), vk::PipelineBindPoint::GRAPHICS) => Command::BindPipeline(Arc::clone(pipeline)),
        (Pipeline::Compute(pipeline), vk::PipelineBindPoint::COMPUTE) => {
            Command::BindComputePipeline(Arc::clone(pipeline))
        }
        (Pipeline::Library(_), _) => {
            return Err(Error::usage("VUID-vkCmdBindPipeline-pipeline-03382", "the pipeline is a library"));
        }
        (_, other) => {
            return Err(Error::usage(
                "VUID-vkCmdBindPipeline-pipelineBindPoint-00779",
                format!("a pipeline is bound at {other:?}, which is not its bind point"),
            ));
        }
    };
    recorder.push(command);
    Ok(())
}

#[doc(alias = "vkCmdBindVertexBuffers")]
pub(crate) fn cmd_bind_vertex_buffers(
    recorder: &mut Recorder,
    first_binding: u32,
    buffers: Handles<'_, vk::Buffer>,
    offsets: &[vk::DeviceSize],
) -> Result<(), Error> {
    bind_vertex_buffers(recorder, first_binding, buffers, offsets, &[], &[])
}

#[doc(alias = "vkCmdBindVertexBuffers2")]
pub(crate) fn cmd_bind_vertex_buffers2(
    recorder: &mut Recorder,
    first_binding: u32,
    buffers: Handles<'_, vk::Buffer>,
    offsets: &[vk::DeviceSize],
    sizes: Option<&[vk::DeviceSize]>,
    strides: Option<&[vk::DeviceSize]>,
) -> Result<(), Error> {
    let (sizes, strides) = (sizes.unwrap_or_default(), strides.unwrap_or_default());
    bind_vertex_buffers(recorder, first_binding, buffers, offsets, sizes, strides)
}

/// The empty range of a null buffer.
fn nothing() -> Result<BufferRange, Error> {
    let memory = Allocation::new_zeroed(1).map_err(|error| Error::OutOfDeviceMemory(error.to_string()))?;
    Ok(BufferRange { memory, offset: 0, size: 0 })
}

/// The rules on the buffer of `vkCmdBindIndexBuffer`.
const INDEX_BUFFER: BufferRules =
    BufferRules { memory: "VUID-vkCmdBindIndexBuffer-buffer-00434", range: "VUID-vkCmdBindIndexBuffer-offset-00431" };

/// The rules on the buffers of `vkCmdBindVertexBuffers`, and of its second version.
const VERTEX_BUFFERS: BufferRules = BufferRules {
    memory: "VUID-vkCmdBindVertexBuffers-pBuffers-00628",
    range: "VUID-vkCmdBindVertexBuffers-pOffsets-00626",
};

#[doc(alias = "vkCmdSetVertexInputEXT")]
pub(crate) fn cmd_set_vertex_input(
    recorder: &mut Recorder,
    vertex_binding_descriptions: &[vk::VertexInputBindingDescription2EXT<'_>],
    vertex_attribute_descriptions: &[vk::VertexInputAttributeDescription2EXT<'_>],
) -> Result<(), Error> {
    let bindings = vertex_binding_descriptions.iter();
    let input = VertexInput {
        bindings: bindings
            .clone()
            .map(|given| vk::VertexInputBindingDescription {
                binding: given.binding,
                stride: given.stride,
                input_rate: given.input_rate,
            })
            .collect(),
        divisors: bindings
            .map(|given| vk::VertexInputBindingDivisorDescriptionKHR { binding: given.binding, divisor: given.divisor })
            .collect(),
        attributes: vertex_attribute_descriptions
            .iter()
            .map(|given| vk::VertexInputAttributeDescription {
                location: given.location,
                binding: given.binding,
                format: given.format,
                offset: given.offset,
            })
            .collect(),
    };
    recorder.push(Command::SetVertexInput(Arc::new(input)));
    Ok(())
}

/// Binds indices; those of a null buffer are zero.
#[doc(alias = "vkCmdBindIndexBuffer")]
pub(crate) fn cmd_bind_index_buffer(
    recorder: &mut Recorder,
    buffer: Option<&Arc<Buffer>>,
    offset: vk::DeviceSize,
    index_type: vk::IndexType,
) -> Result<(), Error> {
    cmd_bind_index_buffer2(recorder, buffer, offset, vk::WHOLE_SIZE, index_type)
}

#[doc(alias = "vkCmdBindIndexBuffer2KHR")]
pub(crate) fn cmd_bind_index_buffer2(
    recorder: &mut Recorder,
    buffer: Option<&Arc<Buffer>>,
    offset: vk::DeviceSize,
    size: vk::DeviceSize,
    index_type: vk::IndexType,
) -> Result<(), Error> {
    let index_size = match index_type {
        vk::IndexType::UINT8_KHR => 1,
        vk::IndexType::UINT16 => 2,
        vk::IndexType::UINT32 => 4,
        other => {
            return Err(Error::FeatureNotPresent(format!("index type {other:?}")));
        }
    };
    let range = match buffer {
        Some(buffer) => buffer.range(offset, (size != vk::WHOLE_SIZE).then_some(size), &INDEX_BUFFER)?,
        None => nothing()?,
    };
    recorder.push(Command::BindIndexBuffer(IndexBuffer { range, index_size, restart: None }));
    Ok(())
}

#[doc(alias = "vkCmdSetPrimitiveRestartIndexEXT")]
pub(crate) fn cmd_set_primitive_restart_index(
    recorder: &mut Recorder,
    primitive_restart_index: u32,
) -> Result<(), Error> {
    recorder.push(Command::SetPrimitiveRestartIndex(primitive_restart_index));
    Ok(())
}

/// Records vertex buffers; `sizes` and `strides` are empty or have one for each. Vertices read zero from a null buffer.
fn bind_vertex_buffers(
    recorder: &mut Recorder,
    first: u32,
    buffers: Handles<'_, vk::Buffer>,
    offsets: &[vk::DeviceSize],
    sizes: &[vk::DeviceSize],
    strides: &[vk::DeviceSize],
) -> Result<(), Error> {
    let bindings = limits::properties().max_vertex_input_bindings;
    if u64::from(first) + buffers.len() as u64 > u64::from(bindings) {
        return Err(Error::usage(
            "VUID-vkCmdBindVertexBuffers-firstBinding-00625",
            format!("there are {bindings} vertex input bindings"),
        ));
    }
    for (index, (buffer, &offset)) in buffers.objects().zip(offsets).enumerate() {
        let size = sizes.get(index).copied().unwrap_or(vk::WHOLE_SIZE);
        let range = match buffer? {
            Some(buffer) => {
                let size = (size != vk::WHOLE_SIZE).then_some(size);
                buffer.range(offset, size, &VERTEX_BUFFERS)?
            }
            None => nothing()?,
        };
        let stride = strides.get(index).map(|&stride| stride as u32);
        recorder
            .push(Command::BindVertexBuffer { binding: first + index as u32, buffer: VertexBuffer { range, stride } });
    }
    Ok(())
}

#[doc(alias = "vkCmdBindDescriptorSets")]
pub(crate) fn cmd_bind_descriptor_sets(
    recorder: &mut Recorder,
    pipeline_bind_point: vk::PipelineBindPoint,
    layout: &PipelineLayout,
    first_set: u32,
    descriptor_sets: Handles<'_, vk::DescriptorSet>,
    dynamic_offsets: &[u32],
) -> Result<(), Error> {
    let mut rest = dynamic_offsets;
    let mut bound = simdevice::host::with_capacity(descriptor_sets.len());
    for (number, set) in (first_set..).zip(descriptor_sets.objects()) {
        let Some(set) = set? else {
            bound.push(None);
            continue;
        };
        layout.set_layout(number)?;
        let count = set.layout().dynamic_count();
        let Some((own, others)) = rest.split_at_checked(count) else {
            return Err(dynamic_offset_count_error());
        };
        rest = others;
        bound.push(Some(BoundSet { set: Arc::clone(set), dynamic_offsets: own.to_vec() }));
    }
    if !rest.is_empty() {
        return Err(dynamic_offset_count_error());
    }
    if let Some(offset) =
        dynamic_offsets.iter().find(|&&offset| u64::from(offset) % limits::MIN_BUFFER_OFFSET_ALIGNMENT != 0)
    {
        return Err(Error::usage(
            "VUID-vkCmdBindDescriptorSets-pDynamicOffsets-01971",
            format!("the dynamic offset {offset} is not a multiple of {}", limits::MIN_BUFFER_OFFSET_ALIGNMENT),
        ));
    }
    recorder.push(Command::BindSets(Box::new(BindSets {
        bind_point: BindPoint::from_vk(pipeline_bind_point)?,
        first: first_set,
        sets: bound,
    })));
    Ok(())
}

/// Binds sets at each bind point that has one of the stages.
#[doc(alias = "vkCmdBindDescriptorSets2KHR")]
pub(crate) fn cmd_bind_descriptor_sets2(
    recorder: &mut Recorder,
    stage_flags: vk::ShaderStageFlags,
    layout: &PipelineLayout,
    first_set: u32,
    descriptor_sets: Handles<'_, vk::DescriptorSet>,
    dynamic_offsets: &[u32],
) -> Result<(), Error> {
    for bind_point in bind_points(stage_flags) {
        cmd_bind_descriptor_sets(recorder, bind_point, layout, first_set, descriptor_sets, dynamic_offsets)?;
    }
    Ok(())
}

/// The bind points of stages.
fn bind_points(stages: vk::ShaderStageFlags) -> impl Iterator<Item = vk::PipelineBindPoint> {
    let of_each = [
        (vk::ShaderStageFlags::ALL_GRAPHICS, vk::PipelineBindPoint::GRAPHICS),
        (vk::ShaderStageFlags::COMPUTE, vk::PipelineBindPoint::COMPUTE),
    ];
    of_each.into_iter().filter(move |(own, _)| stages.intersects(*own)).map(|(_, point)| point)
}

#[doc(alias = "vkCmdPushConstants")]
#[doc(alias = "vkCmdPushConstants2KHR")]
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
            format!("{size} bytes of push constants at offset {offset} of {}", limits::MAX_PUSH_CONSTANTS_SIZE),
        ));
    }
    let bytes = values.into();
    recorder.push(Command::PushConstants { offset, bytes });
    Ok(())
}

/// # Safety
/// The writes, their chains and their handles are valid.
#[doc(alias = "vkCmdPushDescriptorSetKHR")]
pub(crate) unsafe fn cmd_push_descriptor_set(
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
        .map(|info| unsafe { set::write(info, &layout) });
    recorder.push(Command::PushDescriptors(Box::new(PushDescriptors {
        bind_point: BindPoint::from_vk(pipeline_bind_point)?,
        set,
        writes: writes.collect::<Result<_, _>>()?,
        layout: pushed(layout)?,
    })));
    Ok(())
}

/// Pushes descriptors at each bind point that has one of the stages.
///
/// # Safety
/// The writes, their chains and their handles are valid.
#[doc(alias = "vkCmdPushDescriptorSet2KHR")]
pub(crate) unsafe fn cmd_push_descriptor_set2(
    recorder: &mut Recorder,
    stage_flags: vk::ShaderStageFlags,
    layout: &PipelineLayout,
    set: u32,
    descriptor_writes: &[vk::WriteDescriptorSet<'_>],
) -> Result<(), Error> {
    bind_points(stage_flags).try_for_each(|bind_point| {
        // SAFETY: the caller's promise.
        unsafe { cmd_push_descriptor_set(recorder, bind_point, layout, set, descriptor_writes) }
    })
}

/// # Safety
/// The data is what the template describes, and its handles are live.
#[doc(alias = "vkCmdPushDescriptorSetWithTemplateKHR")]
#[doc(alias = "vkCmdPushDescriptorSetWithTemplate2KHR")]
pub(crate) unsafe fn cmd_push_descriptor_set_with_template(
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
    let writes = unsafe { set::template_writes(descriptor_update_template, &layout, data)? };
    recorder.push(Command::PushDescriptors(Box::new(PushDescriptors {
        bind_point: BindPoint::from_vk(bind_point)?,
        set,
        writes,
        layout: pushed(layout)?,
    })));
    Ok(())
}

fn dynamic_offset_count_error() -> Error {
    Error::usage(
        "VUID-vkCmdBindDescriptorSets-dynamicOffsetCount-00359",
        "the number of dynamic offsets is not that of the sets' dynamic descriptors",
    )
}

/// The layout. An error if its sets are not pushed.
fn pushed(layout: Arc<DescriptorSetLayout>) -> Result<Arc<DescriptorSetLayout>, Error> {
    if layout.is_push() {
        return Ok(layout);
    }
    Err(Error::usage(
        "VUID-vkCmdPushDescriptorSetKHR-set-00365",
        "descriptors are pushed to a set whose layout is not for that",
    ))
}
