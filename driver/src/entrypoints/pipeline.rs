//! What pipelines are made of, and what the creation of both kinds has in common.

use crate::capabilities::limits;
use crate::error::Error;
use crate::object::pipeline::PipelineCache;
use crate::object::pipeline::layout::PipelineLayout;
use crate::object::shader_module::ShaderModule;
use crate::{handle, pnext, pointer};
use ash::vk;
use std::ffi::c_void;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreatePipelineLayout")]
    fn create_pipeline_layout(
        _device: vk::Device,
        create_info: *const vk::PipelineLayoutCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        pipeline_layout: *mut vk::PipelineLayout,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        let set_layouts = pointer::slice(info.p_set_layouts, info.set_layout_count)?
            .iter()
            .map(|&layout| Ok(handle::get_optional(layout)?.cloned()));
        let layout = PipelineLayout::new(
            set_layouts.collect::<Result<_, Error>>()?,
            pointer::slice(info.p_push_constant_ranges, info.push_constant_range_count)?,
            limits::MAX_PUSH_CONSTANTS_SIZE,
        )?;
        pointer::output(pipeline_layout, handle::create(Arc::new(layout)))
    }

    #[doc(alias = "vkCreateShaderModule")]
    fn create_shader_module(
        device: vk::Device,
        create_info: *const vk::ShaderModuleCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        shader_module: *mut vk::ShaderModule,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        let words = u32::try_from(info.code_size / 4).unwrap_or(0);
        let object = ShaderModule::new(pointer::slice(info.p_code, words)?, handle::get(device)?.features())?;
        pointer::output(shader_module, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkCreatePipelineCache")]
    fn create_pipeline_cache(
        _device: vk::Device,
        create_info: *const vk::PipelineCacheCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        pipeline_cache: *mut vk::PipelineCache,
    ) -> vk::Result {
        pointer::input(create_info)?;
        pointer::output(pipeline_cache, handle::create(Arc::new(PipelineCache)))
    }

    #[doc(alias = "vkGetPipelineCacheData")]
    fn get_pipeline_cache_data(
        _device: vk::Device,
        _pipeline_cache: vk::PipelineCache,
        data_size: *mut usize,
        data: *mut c_void,
    ) -> vk::Result {
        let header = cache_header();
        let size = pointer::output_structure(data_size)?;
        if data.is_null() {
            *size = header.len();
            return Ok(vk::Result::SUCCESS);
        }
        if *size < header.len() {
            *size = 0;
            return Ok(vk::Result::INCOMPLETE);
        }
        *size = header.len();
        std::ptr::copy_nonoverlapping(header.as_ptr(), data.cast::<u8>(), header.len());
        Ok(vk::Result::SUCCESS)
    }

    #[doc(alias = "vkMergePipelineCaches")]
    fn merge_pipeline_caches(
        _device: vk::Device,
        _dst_cache: vk::PipelineCache,
        _src_cache_count: u32,
        _src_caches: *const vk::PipelineCache,
    ) -> vk::Result {
        Ok(())
    }
}

/// An empty cache's data: `VkPipelineCacheHeaderVersionOne` and nothing more.
fn cache_header() -> Vec<u8> {
    let properties = limits::properties();
    let mut header = Vec::with_capacity(32);
    header.extend(32u32.to_le_bytes());
    header.extend(vk::PipelineCacheHeaderVersion::ONE.as_raw().to_le_bytes());
    header.extend(properties.vendor_id.to_le_bytes());
    header.extend(properties.device_id.to_le_bytes());
    header.extend(properties.pipeline_cache_uuid);
    header
}

/// Makes a pipeline of each create info. Vulkan lets the rest be skipped once one fails; their handles are null.
///
/// # Safety
/// There is room for as many pipelines as create infos.
pub(super) unsafe fn create_each<T>(
    infos: &[T],
    pipelines: *mut vk::Pipeline,
    mut create: impl FnMut(&T) -> Result<vk::Pipeline, Error>,
) -> Result<(), Error> {
    let mut first_error = None;
    for (index, info) in infos.iter().enumerate() {
        let created = match first_error {
            None => create(info).unwrap_or_else(|error| {
                first_error = Some(error);
                vk::Pipeline::null()
            }),
            Some(_) => vk::Pipeline::null(),
        };
        // SAFETY: the caller's promise.
        unsafe { pointer::output(pipelines.add(index), created)? };
    }
    first_error.map_or(Ok(()), Err)
}

/// Says of creation feedback that there is none: it takes no time that anybody would want to know.
///
/// # Safety
/// The create info's chain is valid.
pub(super) unsafe fn withhold_feedback(chain: *const c_void) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let Some(feedback) = pnext::find::<vk::PipelineCreationFeedbackCreateInfo>(chain) else {
            return Ok(());
        };
        let none = vk::PipelineCreationFeedback::default();
        pointer::output(feedback.p_pipeline_creation_feedback, none)?;
        for index in 0..feedback.pipeline_stage_creation_feedback_count as usize {
            let place = feedback.p_pipeline_stage_creation_feedbacks.add(index);
            pointer::output(place, none)?;
        }
        Ok(())
    }
}
