//! The creation of compute pipelines, and shader stages.

use super::pipeline::{create_each, withhold_feedback};
use crate::capabilities::limits;
use crate::error::Error;
use crate::object::device::Device;
use crate::object::pipeline::Pipeline;
use crate::object::pipeline::compute::{ComputePipeline, StageInfo};
use crate::{handle, pnext, pointer};
use ash::vk;
use gaurast_spirv::Specialization;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateComputePipelines")]
    fn create_compute_pipelines(
        device: vk::Device,
        _pipeline_cache: vk::PipelineCache,
        create_info_count: u32,
        create_infos: *const vk::ComputePipelineCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        pipelines: *mut vk::Pipeline,
    ) -> vk::Result {
        let device = handle::get(device)?;
        let infos = pointer::slice(create_infos, create_info_count)?;
        create_each(infos, pipelines, |info| new_compute_pipeline(device, info))
    }
}

/// Makes one pipeline.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn new_compute_pipeline(
    device: &Device,
    info: &vk::ComputePipelineCreateInfo<'_>,
) -> Result<vk::Pipeline, Error> {
    if info.stage.stage != vk::ShaderStageFlags::COMPUTE {
        return Err(Error::usage(
            "VUID-VkComputePipelineCreateInfo-stage-00701",
            format!("a compute pipeline has stage {:?}", info.stage.stage),
        ));
    }
    // SAFETY: the caller's promise.
    let pipeline = unsafe {
        withhold_feedback(info.p_next)?;
        let layout = handle::get(info.layout)?;
        ComputePipeline::new(device, layout, &stage(&info.stage)?)?
    };
    let pipeline = Pipeline::Compute(Arc::new(pipeline));
    Ok(handle::create(Arc::new(pipeline)))
}

/// A shader stage with its pointers followed.
///
/// # Safety
/// The stage and its chain are valid.
pub(super) unsafe fn stage<'a>(
    info: &'a vk::PipelineShaderStageCreateInfo<'a>,
) -> Result<StageInfo<'a>, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let name = pointer::string(info.p_name).ok_or(Error::NullPointer {
            what: "an entry point's name",
        })?;
        let name = name.to_str().map_err(|_| {
            Error::usage(
                "VUID-VkPipelineShaderStageCreateInfo-pName-parameter",
                "the entry point's name is not UTF-8",
            )
        })?;
        let required =
            pnext::find::<vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo<'_>>(info.p_next);
        Ok(StageInfo {
            module: handle::get(info.module)?,
            name,
            specialization: specialization(pointer::optional(info.p_specialization_info))?,
            required_subgroup_size: required.map(subgroup_size).transpose()?,
        })
    }
}

fn subgroup_size(
    required: &vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo<'_>,
) -> Result<u32, Error> {
    let size = required.required_subgroup_size;
    if size.is_power_of_two() && limits::SUBGROUP_SIZES.contains(&size) {
        return Ok(size);
    }
    Err(Error::usage(
        "VUID-VkPipelineShaderStageRequiredSubgroupSizeCreateInfo-requiredSubgroupSize-02760",
        format!(
            "the subgroup size {size} is not a power of two in {:?}",
            limits::SUBGROUP_SIZES
        ),
    ))
}

/// The values of specialization constants.
///
/// # Safety
/// The specialization info is valid.
unsafe fn specialization(
    info: Option<&vk::SpecializationInfo<'_>>,
) -> Result<Specialization, Error> {
    let mut specialization = Specialization::default();
    let Some(info) = info else {
        return Ok(specialization);
    };
    let size = u32::try_from(info.data_size).unwrap_or(u32::MAX);
    // SAFETY: the caller's promise.
    let (data, entries) = unsafe {
        (
            pointer::slice(info.p_data.cast::<u8>(), size)?,
            pointer::slice(info.p_map_entries, info.map_entry_count)?,
        )
    };
    for entry in entries {
        let offset = entry.offset as usize;
        let end = offset.checked_add(entry.size);
        let bytes = end.and_then(|end| data.get(offset..end)).ok_or_else(|| {
            Error::usage(
                "VUID-VkSpecializationInfo-pMapEntries-00774",
                format!(
                    "the value of specialization constant {} lies outside the {size} bytes given",
                    entry.constant_id
                ),
            )
        })?;
        specialization.set(entry.constant_id, bytes);
    }
    Ok(specialization)
}
