//! Pipelines: the parts of create infos that draws and dispatches use, converted and validated once.
//!
//! A graphics pipeline's create info is read into the parts that it has ([`GraphicsState`]), beside those of the libraries
//! that it links. A library keeps its parts, with its shaders translated; a pipeline is made of all of them, for which the
//! programs are compiled.
//!
//! `create_info` and [`ShaderStage`] follow the create infos' pointers.

pub(crate) mod compute;
mod create_info;
pub(crate) mod dynamic_state;
pub(crate) mod gaussian;
pub(crate) mod layout;
mod link;
mod link_primitives;
pub(crate) mod parts;
pub(crate) mod primitives;
pub(crate) mod stages;
pub(crate) mod state;
#[cfg(test)]
mod tests;
mod varyings;

use self::compute::ComputePipeline;
use self::gaussian::GaussianPipeline;
use self::parts::GraphicsState;
use self::primitives::PrimitivePipeline;
use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::device::Device;
use crate::physical_device::limits;
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast::vk::PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST;
use std::ffi::c_void;
use std::mem::MaybeUninit;
use std::sync::Arc;

/// A `VkPipeline`.
#[derive(Debug)]
pub(crate) enum Pipeline {
    /// A pipeline for draws.
    Graphics(Arc<GraphicsPipeline>),
    /// A pipeline for dispatches.
    Compute(Arc<ComputePipeline>),
    /// A library: parts of graphics pipelines.
    Library(Box<GraphicsState>),
}

/// A graphics pipeline.
#[derive(Debug)]
pub(crate) struct GraphicsPipeline {
    /// The kind of the primitives, with the kind's state.
    pub(crate) kind: PipelineKind,
    /// True if vertex strides come from `vkCmdBindVertexBuffers2`.
    pub(crate) dynamic_stride: bool,
}

/// The kind of a graphics pipeline, by its primitives.
#[derive(Debug)]
pub(crate) enum PipelineKind {
    /// Gaussians.
    Gaussian(Box<GaussianPipeline>),
    /// Points, lines or triangles.
    Primitive(Box<PrimitivePipeline>),
}

objects! {
    vk::Pipeline => Pipeline;
    vk::PipelineCache => PipelineCache;
}

impl GraphicsPipeline {
    /// Creates a pipeline.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(crate) fn new(device: &Device, graphics: &GraphicsState) -> Result<Self, Error> {
        let kind = if graphics.vertex_input.topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST {
            let gaussian = GaussianPipeline::new(device, graphics)?;
            PipelineKind::Gaussian(Box::new(gaussian))
        } else {
            PipelineKind::Primitive(Box::new(PrimitivePipeline::new(device, graphics)?))
        };
        Ok(Self {
            kind,
            dynamic_stride: graphics.is_dynamic(vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE)
                || graphics.is_dynamic(vk::DynamicState::VERTEX_INPUT_EXT),
        })
    }
}

/// A pipeline cache. Pipelines are cheap to create, so it stays empty.
#[derive(Debug)]
pub(crate) struct PipelineCache;

/// The libraries that a graphics pipeline links.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn libraries<'a>(info: &'a vk::GraphicsPipelineCreateInfo<'_>) -> Result<Vec<&'a GraphicsState>, Error> {
    // SAFETY: the caller's promise.
    let handles = unsafe {
        match valid::find_in_chain::<vk::PipelineLibraryCreateInfoKHR<'_>>(info.p_next) {
            Some(given) => valid::slice(given.p_libraries, given.library_count)?,
            None => &[],
        }
    };
    let library = |(index, &handle): (usize, &vk::Pipeline)| {
        // SAFETY: the caller's promise.
        match &**unsafe { handle::get(handle)? } {
            Pipeline::Library(library) => Ok(&**library),
            Pipeline::Graphics(_) | Pipeline::Compute(_) => Err(Error::usage(
                "VUID-VkPipelineLibraryCreateInfoKHR-pLibraries-03381",
                format!("pLibraries[{index}] was created without VK_PIPELINE_CREATE_LIBRARY_BIT_KHR"),
            )),
        }
    };
    handles.iter().enumerate().map(library).collect()
}

/// Creates one pipeline, or a library.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn new_graphics_pipeline(device: &Device, info: &vk::GraphicsPipelineCreateInfo<'_>) -> Result<Pipeline, Error> {
    // SAFETY: the caller's promise.
    let flags = unsafe { create_info::flags(info.flags, info.p_next) };
    let is_library = flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR);
    device.enabled().require(!is_library || device.features().graphics_pipeline_library, || {
        Error::FeatureNotEnabled {
            vuid: "VUID-VkGraphicsPipelineCreateInfo-graphicsPipelineLibrary-06606",
            message: "flags has VK_PIPELINE_CREATE_LIBRARY_BIT_KHR, and graphicsPipelineLibrary is not enabled".into(),
        }
    })?;
    // SAFETY: the caller's promise.
    let mut graphics = unsafe {
        write_empty_creation_feedback(info.p_next)?;
        create_info::read(device, info, &libraries(info)?)?
    };
    if is_library {
        stages::translate_library(device, &mut graphics)?;
        return Ok(Pipeline::Library(Box::new(graphics)));
    }
    graphics.require_complete()?;
    let pipeline = GraphicsPipeline::new(device, &graphics)?;
    Ok(Pipeline::Graphics(Arc::new(pipeline)))
}

/// Creates one pipeline.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn new_compute_pipeline(device: &Device, info: &vk::ComputePipelineCreateInfo<'_>) -> Result<Pipeline, Error> {
    // SAFETY: the caller's promise.
    let flags = unsafe { create_info::flags(info.flags, info.p_next) };
    if flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR) {
        return Err(Error::FeatureNotPresent("a library of compute".into()));
    }
    if info.stage.stage != vk::ShaderStageFlags::COMPUTE {
        return Err(Error::usage(
            "VUID-VkComputePipelineCreateInfo-stage-00701",
            format!("a compute pipeline has stage {:?}", info.stage.stage),
        ));
    }
    // SAFETY: the caller's promise.
    let pipeline = unsafe {
        write_empty_creation_feedback(info.p_next)?;
        let layout = handle::get(info.layout)?;
        ComputePipeline::new(device, layout, &ShaderStage::from_create_info(device, &info.stage)?)?
    };
    Ok(Pipeline::Compute(Arc::new(pipeline)))
}

/// An empty cache's data: `VkPipelineCacheHeaderVersionOne` and nothing else.
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

/// Creates a pipeline for each create info. After a failure the rest is skipped, as Vulkan allows; their handles are
/// null. Every pipeline needs compilation, so one with `FAIL_ON_PIPELINE_COMPILE_REQUIRED` is not created.
fn create_each<T>(
    infos: &[T],
    pipelines: &mut [MaybeUninit<vk::Pipeline>],
    flags: impl Fn(&T) -> vk::PipelineCreateFlags,
    mut create: impl FnMut(&T) -> Result<Pipeline, Error>,
) -> Result<vk::Result, Error> {
    use vk::PipelineCreateFlags as Flags;
    pipelines.fill(MaybeUninit::new(vk::Pipeline::null()));
    let mut result = vk::Result::SUCCESS;
    for (place, info) in pipelines.iter_mut().zip(infos) {
        let flags = flags(info);
        if flags.contains(Flags::FAIL_ON_PIPELINE_COMPILE_REQUIRED) {
            result = vk::Result::PIPELINE_COMPILE_REQUIRED;
            if flags.contains(Flags::EARLY_RETURN_ON_FAILURE) {
                break;
            }
            continue;
        }
        place.write(handle::create(Arc::new(create(info)?)));
    }
    Ok(result)
}

/// Marks creation feedback as invalid, since times are not measured.
///
/// # Safety
/// The create info's chain is valid.
unsafe fn write_empty_creation_feedback(chain: *const c_void) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let Some(feedback) = valid::find_in_chain::<vk::PipelineCreationFeedbackCreateInfo>(chain) else {
            return Ok(());
        };
        let none = vk::PipelineCreationFeedback::default();
        valid::output(feedback.p_pipeline_creation_feedback, none)?;
        for index in 0..feedback.pipeline_stage_creation_feedback_count as usize {
            let place = feedback.p_pipeline_stage_creation_feedbacks.add(index);
            valid::output(place, none)?;
        }
        Ok(())
    }
}

/// # Safety
/// The create infos and their chains are valid.
#[doc(alias = "vkCreateGraphicsPipelines")]
pub(crate) unsafe fn create_graphics_pipelines(
    device: &Device,
    create_infos: &[vk::GraphicsPipelineCreateInfo<'_>],
    pipelines: &mut [MaybeUninit<vk::Pipeline>],
) -> Result<vk::Result, Error> {
    // SAFETY: the caller's promise.
    let create = |info: &_| unsafe { new_graphics_pipeline(device, info) };
    // SAFETY: the caller's promise.
    let flags = |info: &vk::GraphicsPipelineCreateInfo<'_>| unsafe { create_info::flags(info.flags, info.p_next) };
    create_each(create_infos, pipelines, flags, create)
}

/// # Safety
/// The create infos and their chains are valid.
#[doc(alias = "vkCreateComputePipelines")]
pub(crate) unsafe fn create_compute_pipelines(
    device: &Device,
    create_infos: &[vk::ComputePipelineCreateInfo<'_>],
    pipelines: &mut [MaybeUninit<vk::Pipeline>],
) -> Result<vk::Result, Error> {
    // SAFETY: the caller's promise.
    let create = |info: &_| unsafe { new_compute_pipeline(device, info) };
    // SAFETY: the caller's promise.
    let flags = |info: &vk::ComputePipelineCreateInfo<'_>| unsafe { create_info::flags(info.flags, info.p_next) };
    create_each(create_infos, pipelines, flags, create)
}

#[doc(alias = "vkCreatePipelineCache")]
pub(crate) fn create_pipeline_cache(
    _create_info: &vk::PipelineCacheCreateInfo<'_>,
) -> Result<Arc<PipelineCache>, Error> {
    Ok(Arc::new(PipelineCache))
}

/// # Safety
/// The data is null or as long as its size says.
#[doc(alias = "vkGetPipelineCacheData")]
pub(crate) unsafe fn get_pipeline_cache_data(data_size: &mut usize, data: *mut c_void) -> Result<vk::Result, Error> {
    let header = cache_header();
    if data.is_null() {
        *data_size = header.len();
        return Ok(vk::Result::SUCCESS);
    }
    if *data_size < header.len() {
        *data_size = 0;
        return Ok(vk::Result::INCOMPLETE);
    }
    *data_size = header.len();
    // SAFETY: the caller's promise; the data has space for the header.
    unsafe { std::ptr::copy_nonoverlapping(header.as_ptr(), data.cast::<u8>(), header.len()) };
    Ok(vk::Result::SUCCESS)
}
