//! Structures and commands of the registry that are newer than ash. The generator reads them as it reads ash.

use ash::vk::{
    self, Bool32, CommandBuffer, ImageLayout, PipelineRobustnessBufferBehaviorEXT, PipelineRobustnessImageBehaviorEXT,
    StructureType, TaggedStructure, UUID_SIZE,
};
use std::ffi::c_void;

/// Vulkan 1.4.
pub(crate) const API_VERSION_1_4: u32 = vk::make_api_version(0, 1, 4, 0);

/// The version of the registry that the generator reads.
pub(crate) const HEADER_VERSION_COMPLETE: u32 = vk::make_api_version(0, 1, 4, 366);

/// Gives a structure its type.
macro_rules! tagged {
    ($($structure:ident = $number:literal;)*) => {
        $(
            // SAFETY: the structure has the members of the registry's, in their order, and this is its type there.
            unsafe impl TaggedStructure for $structure {
                const STRUCTURE_TYPE: StructureType = StructureType::from_raw($number);
            }
        )*
    };
}

tagged! {
    PhysicalDeviceVulkan14Features = 55;
    PhysicalDeviceVulkan14Properties = 56;
    PhysicalDeviceUnifiedImageLayoutsFeaturesKHR = 1_000_527_000;
    PhysicalDeviceShaderRelaxedExtendedInstructionFeaturesKHR = 1_000_558_000;
    PhysicalDeviceShaderReplicatedCompositesFeaturesEXT = 1_000_564_000;
    PhysicalDeviceZeroInitializeDeviceMemoryFeaturesEXT = 1_000_620_000;
    PhysicalDevicePrimitiveRestartIndexFeaturesEXT = 1_000_678_000;
}

/// `VkPhysicalDeviceVulkan14Features`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceVulkan14Features {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) global_priority_query: Bool32,
    pub(crate) shader_subgroup_rotate: Bool32,
    pub(crate) shader_subgroup_rotate_clustered: Bool32,
    pub(crate) shader_float_controls2: Bool32,
    pub(crate) shader_expect_assume: Bool32,
    pub(crate) rectangular_lines: Bool32,
    pub(crate) bresenham_lines: Bool32,
    pub(crate) smooth_lines: Bool32,
    pub(crate) stippled_rectangular_lines: Bool32,
    pub(crate) stippled_bresenham_lines: Bool32,
    pub(crate) stippled_smooth_lines: Bool32,
    pub(crate) vertex_attribute_instance_rate_divisor: Bool32,
    pub(crate) vertex_attribute_instance_rate_zero_divisor: Bool32,
    pub(crate) index_type_uint8: Bool32,
    pub(crate) dynamic_rendering_local_read: Bool32,
    pub(crate) maintenance5: Bool32,
    pub(crate) maintenance6: Bool32,
    pub(crate) pipeline_protected_access: Bool32,
    pub(crate) pipeline_robustness: Bool32,
    pub(crate) host_image_copy: Bool32,
    pub(crate) push_descriptor: Bool32,
}

/// `VkPhysicalDeviceVulkan14Properties`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceVulkan14Properties {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) line_sub_pixel_precision_bits: u32,
    pub(crate) max_vertex_attrib_divisor: u32,
    pub(crate) supports_non_zero_first_instance: Bool32,
    pub(crate) max_push_descriptors: u32,
    pub(crate) dynamic_rendering_local_read_depth_stencil_attachments: Bool32,
    pub(crate) dynamic_rendering_local_read_multisampled_attachments: Bool32,
    pub(crate) early_fragment_multisample_coverage_after_sample_counting: Bool32,
    pub(crate) early_fragment_sample_mask_test_before_sample_counting: Bool32,
    pub(crate) depth_stencil_swizzle_one_support: Bool32,
    pub(crate) polygon_mode_point_size: Bool32,
    pub(crate) non_strict_single_pixel_wide_lines_use_parallelogram: Bool32,
    pub(crate) non_strict_wide_lines_use_parallelogram: Bool32,
    pub(crate) block_texel_view_compatible_multiple_layers: Bool32,
    pub(crate) max_combined_image_sampler_descriptor_count: u32,
    pub(crate) fragment_shading_rate_clamp_combiner_inputs: Bool32,
    pub(crate) default_robustness_storage_buffers: PipelineRobustnessBufferBehaviorEXT,
    pub(crate) default_robustness_uniform_buffers: PipelineRobustnessBufferBehaviorEXT,
    pub(crate) default_robustness_vertex_inputs: PipelineRobustnessBufferBehaviorEXT,
    pub(crate) default_robustness_images: PipelineRobustnessImageBehaviorEXT,
    pub(crate) copy_src_layout_count: u32,
    pub(crate) p_copy_src_layouts: *mut ImageLayout,
    pub(crate) copy_dst_layout_count: u32,
    pub(crate) p_copy_dst_layouts: *mut ImageLayout,
    pub(crate) optimal_tiling_layout_uuid: [u8; UUID_SIZE],
    pub(crate) identical_memory_type_requirements: Bool32,
}

/// `VkPhysicalDeviceUnifiedImageLayoutsFeaturesKHR`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceUnifiedImageLayoutsFeaturesKHR {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) unified_image_layouts: Bool32,
    pub(crate) unified_image_layouts_video: Bool32,
}

/// `VkPhysicalDeviceShaderRelaxedExtendedInstructionFeaturesKHR`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceShaderRelaxedExtendedInstructionFeaturesKHR {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) shader_relaxed_extended_instruction: Bool32,
}

/// `VkPhysicalDeviceShaderReplicatedCompositesFeaturesEXT`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceShaderReplicatedCompositesFeaturesEXT {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) shader_replicated_composites: Bool32,
}

/// `VkPhysicalDeviceZeroInitializeDeviceMemoryFeaturesEXT`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceZeroInitializeDeviceMemoryFeaturesEXT {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) zero_initialize_device_memory: Bool32,
}

/// `VkPhysicalDevicePrimitiveRestartIndexFeaturesEXT`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDevicePrimitiveRestartIndexFeaturesEXT {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) primitive_restart_index: Bool32,
}

/// `vkCmdSetPrimitiveRestartIndexEXT`.
#[allow(non_camel_case_types, reason = "Vulkan's name")]
pub(crate) type PFN_vkCmdSetPrimitiveRestartIndexEXT =
    unsafe extern "system" fn(command_buffer: CommandBuffer, primitive_restart_index: u32);
