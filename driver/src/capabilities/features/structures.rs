//! The structures in which Vulkan asks for features, and their fields.

use super::is_supported;
use crate::pnext;
use ash::vk;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST;

/// A structure whose fields are features.
pub(super) trait Features {
    /// Writes what is supported.
    fn fill(&mut self);
    /// The names of the fields that are true.
    fn requested(&self) -> Vec<&'static str>;
}

macro_rules! features {
    ($($type:ty { $($field:ident,)* })*) => {$(
        impl Features for $type {
            fn fill(&mut self) {
                $(self.$field = is_supported(stringify!($field)).into();)*
            }

            fn requested(&self) -> Vec<&'static str> {
                [$((self.$field, stringify!($field)),)*]
                    .into_iter()
                    .filter_map(|(value, name)| (value != vk::FALSE).then_some(name))
                    .collect()
            }
        }
    )*};
}

macro_rules! chained {
    ($($type:ty,)*) => {
        /// Writes what is supported, if the structure is one of features.
        pub(crate) fn fill_structure(mut structure: pnext::Output<'_>) {
            $(if let Some(features) = structure.cast::<$type>() {
                features.fill();
            })*
        }

        /// What is requested, if the structure is one of features.
        pub(crate) fn requested_in(structure: &vk::BaseInStructure<'_>) -> Option<Vec<&'static str>> {
            $(if let Some(features) = pnext::cast::<$type>(structure) {
                return Some(features.requested());
            })*
            None
        }
    };
}

chained! {
    vk::PhysicalDeviceVulkan11Features<'_>,
    vk::PhysicalDeviceVulkan12Features<'_>,
    vk::PhysicalDeviceVulkan13Features<'_>,
    vk::PhysicalDevicePrivateDataFeatures<'_>,
    vk::PhysicalDeviceVariablePointersFeatures<'_>,
    vk::PhysicalDeviceMultiviewFeatures<'_>,
    vk::PhysicalDevice16BitStorageFeatures<'_>,
    vk::PhysicalDeviceShaderSubgroupExtendedTypesFeatures<'_>,
    vk::PhysicalDeviceSamplerYcbcrConversionFeatures<'_>,
    vk::PhysicalDeviceProtectedMemoryFeatures<'_>,
    vk::PhysicalDeviceInlineUniformBlockFeatures<'_>,
    vk::PhysicalDeviceMaintenance4Features<'_>,
    vk::PhysicalDeviceShaderDrawParametersFeatures<'_>,
    vk::PhysicalDeviceShaderFloat16Int8Features<'_>,
    vk::PhysicalDeviceHostQueryResetFeatures<'_>,
    vk::PhysicalDeviceDescriptorIndexingFeatures<'_>,
    vk::PhysicalDeviceTimelineSemaphoreFeatures<'_>,
    vk::PhysicalDevice8BitStorageFeatures<'_>,
    vk::PhysicalDeviceVulkanMemoryModelFeatures<'_>,
    vk::PhysicalDeviceShaderAtomicInt64Features<'_>,
    vk::PhysicalDeviceScalarBlockLayoutFeatures<'_>,
    vk::PhysicalDeviceUniformBufferStandardLayoutFeatures<'_>,
    vk::PhysicalDeviceBufferDeviceAddressFeatures<'_>,
    vk::PhysicalDeviceImagelessFramebufferFeatures<'_>,
    vk::PhysicalDeviceTextureCompressionASTCHDRFeatures<'_>,
    vk::PhysicalDeviceSeparateDepthStencilLayoutsFeatures<'_>,
    vk::PhysicalDeviceShaderDemoteToHelperInvocationFeatures<'_>,
    vk::PhysicalDeviceSubgroupSizeControlFeatures<'_>,
    vk::PhysicalDevicePipelineCreationCacheControlFeatures<'_>,
    vk::PhysicalDeviceZeroInitializeWorkgroupMemoryFeatures<'_>,
    vk::PhysicalDeviceImageRobustnessFeatures<'_>,
    vk::PhysicalDeviceShaderTerminateInvocationFeatures<'_>,
    vk::PhysicalDeviceSynchronization2Features<'_>,
    vk::PhysicalDeviceShaderIntegerDotProductFeatures<'_>,
    vk::PhysicalDeviceDynamicRenderingFeatures<'_>,
    vk::PhysicalDevicePerformanceQueryFeaturesKHR<'_>,
    vk::PhysicalDeviceIndexTypeUint8FeaturesKHR<'_>,
    vk::PhysicalDeviceProvokingVertexFeaturesEXT<'_>,
    vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR<'_>,
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_>,
}

features! {
    vk::PhysicalDeviceFeatures {
        robust_buffer_access, full_draw_index_uint32, image_cube_array, independent_blend, geometry_shader,
        tessellation_shader, sample_rate_shading, dual_src_blend, logic_op, multi_draw_indirect,
        draw_indirect_first_instance, depth_clamp, depth_bias_clamp, fill_mode_non_solid, depth_bounds, wide_lines,
        large_points, alpha_to_one, multi_viewport, sampler_anisotropy, texture_compression_etc2,
        texture_compression_astc_ldr, texture_compression_bc, occlusion_query_precise, pipeline_statistics_query,
        vertex_pipeline_stores_and_atomics, fragment_stores_and_atomics,
        shader_tessellation_and_geometry_point_size, shader_image_gather_extended,
        shader_storage_image_extended_formats, shader_storage_image_multisample,
        shader_storage_image_read_without_format, shader_storage_image_write_without_format,
        shader_uniform_buffer_array_dynamic_indexing, shader_sampled_image_array_dynamic_indexing,
        shader_storage_buffer_array_dynamic_indexing, shader_storage_image_array_dynamic_indexing,
        shader_clip_distance, shader_cull_distance, shader_float64, shader_int64, shader_int16,
        shader_resource_residency, shader_resource_min_lod, sparse_binding, sparse_residency_buffer,
        sparse_residency_image2_d, sparse_residency_image3_d, sparse_residency2_samples, sparse_residency4_samples,
        sparse_residency8_samples, sparse_residency16_samples, sparse_residency_aliased, variable_multisample_rate,
        inherited_queries,
    }
    vk::PhysicalDeviceVulkan11Features<'_> {
        storage_buffer16_bit_access, uniform_and_storage_buffer16_bit_access, storage_push_constant16,
        storage_input_output16, multiview, multiview_geometry_shader, multiview_tessellation_shader,
        variable_pointers_storage_buffer, variable_pointers, protected_memory, sampler_ycbcr_conversion,
        shader_draw_parameters,
    }
    vk::PhysicalDeviceVulkan12Features<'_> {
        sampler_mirror_clamp_to_edge, draw_indirect_count, storage_buffer8_bit_access,
        uniform_and_storage_buffer8_bit_access, storage_push_constant8, shader_buffer_int64_atomics,
        shader_shared_int64_atomics, shader_float16, shader_int8, descriptor_indexing,
        shader_input_attachment_array_dynamic_indexing, shader_uniform_texel_buffer_array_dynamic_indexing,
        shader_storage_texel_buffer_array_dynamic_indexing, shader_uniform_buffer_array_non_uniform_indexing,
        shader_sampled_image_array_non_uniform_indexing, shader_storage_buffer_array_non_uniform_indexing,
        shader_storage_image_array_non_uniform_indexing, shader_input_attachment_array_non_uniform_indexing,
        shader_uniform_texel_buffer_array_non_uniform_indexing,
        shader_storage_texel_buffer_array_non_uniform_indexing, descriptor_binding_uniform_buffer_update_after_bind,
        descriptor_binding_sampled_image_update_after_bind, descriptor_binding_storage_image_update_after_bind,
        descriptor_binding_storage_buffer_update_after_bind,
        descriptor_binding_uniform_texel_buffer_update_after_bind,
        descriptor_binding_storage_texel_buffer_update_after_bind, descriptor_binding_update_unused_while_pending,
        descriptor_binding_partially_bound, descriptor_binding_variable_descriptor_count, runtime_descriptor_array,
        sampler_filter_minmax, scalar_block_layout, imageless_framebuffer, uniform_buffer_standard_layout,
        shader_subgroup_extended_types, separate_depth_stencil_layouts, host_query_reset, timeline_semaphore,
        buffer_device_address, buffer_device_address_capture_replay, buffer_device_address_multi_device,
        vulkan_memory_model, vulkan_memory_model_device_scope, vulkan_memory_model_availability_visibility_chains,
        shader_output_viewport_index, shader_output_layer, subgroup_broadcast_dynamic_id,
    }
    vk::PhysicalDeviceVulkan13Features<'_> {
        robust_image_access, inline_uniform_block, descriptor_binding_inline_uniform_block_update_after_bind,
        pipeline_creation_cache_control, private_data, shader_demote_to_helper_invocation,
        shader_terminate_invocation, subgroup_size_control, compute_full_subgroups, synchronization2,
        texture_compression_astc_hdr, shader_zero_initialize_workgroup_memory, dynamic_rendering,
        shader_integer_dot_product, maintenance4,
    }
    vk::PhysicalDevicePrivateDataFeatures<'_> {
        private_data,
    }
    vk::PhysicalDeviceVariablePointersFeatures<'_> {
        variable_pointers_storage_buffer, variable_pointers,
    }
    vk::PhysicalDeviceMultiviewFeatures<'_> {
        multiview, multiview_geometry_shader, multiview_tessellation_shader,
    }
    vk::PhysicalDevice16BitStorageFeatures<'_> {
        storage_buffer16_bit_access, uniform_and_storage_buffer16_bit_access, storage_push_constant16,
        storage_input_output16,
    }
    vk::PhysicalDeviceShaderSubgroupExtendedTypesFeatures<'_> {
        shader_subgroup_extended_types,
    }
    vk::PhysicalDeviceSamplerYcbcrConversionFeatures<'_> {
        sampler_ycbcr_conversion,
    }
    vk::PhysicalDeviceProtectedMemoryFeatures<'_> {
        protected_memory,
    }
    vk::PhysicalDeviceInlineUniformBlockFeatures<'_> {
        inline_uniform_block, descriptor_binding_inline_uniform_block_update_after_bind,
    }
    vk::PhysicalDeviceMaintenance4Features<'_> {
        maintenance4,
    }
    vk::PhysicalDeviceShaderDrawParametersFeatures<'_> {
        shader_draw_parameters,
    }
    vk::PhysicalDeviceShaderFloat16Int8Features<'_> {
        shader_float16, shader_int8,
    }
    vk::PhysicalDeviceHostQueryResetFeatures<'_> {
        host_query_reset,
    }
    vk::PhysicalDeviceDescriptorIndexingFeatures<'_> {
        shader_input_attachment_array_dynamic_indexing, shader_uniform_texel_buffer_array_dynamic_indexing,
        shader_storage_texel_buffer_array_dynamic_indexing, shader_uniform_buffer_array_non_uniform_indexing,
        shader_sampled_image_array_non_uniform_indexing, shader_storage_buffer_array_non_uniform_indexing,
        shader_storage_image_array_non_uniform_indexing, shader_input_attachment_array_non_uniform_indexing,
        shader_uniform_texel_buffer_array_non_uniform_indexing,
        shader_storage_texel_buffer_array_non_uniform_indexing, descriptor_binding_uniform_buffer_update_after_bind,
        descriptor_binding_sampled_image_update_after_bind, descriptor_binding_storage_image_update_after_bind,
        descriptor_binding_storage_buffer_update_after_bind,
        descriptor_binding_uniform_texel_buffer_update_after_bind,
        descriptor_binding_storage_texel_buffer_update_after_bind, descriptor_binding_update_unused_while_pending,
        descriptor_binding_partially_bound, descriptor_binding_variable_descriptor_count, runtime_descriptor_array,
    }
    vk::PhysicalDeviceTimelineSemaphoreFeatures<'_> {
        timeline_semaphore,
    }
    vk::PhysicalDevice8BitStorageFeatures<'_> {
        storage_buffer8_bit_access, uniform_and_storage_buffer8_bit_access, storage_push_constant8,
    }
    vk::PhysicalDeviceVulkanMemoryModelFeatures<'_> {
        vulkan_memory_model, vulkan_memory_model_device_scope, vulkan_memory_model_availability_visibility_chains,
    }
    vk::PhysicalDeviceShaderAtomicInt64Features<'_> {
        shader_buffer_int64_atomics, shader_shared_int64_atomics,
    }
    vk::PhysicalDeviceScalarBlockLayoutFeatures<'_> {
        scalar_block_layout,
    }
    vk::PhysicalDeviceUniformBufferStandardLayoutFeatures<'_> {
        uniform_buffer_standard_layout,
    }
    vk::PhysicalDeviceBufferDeviceAddressFeatures<'_> {
        buffer_device_address, buffer_device_address_capture_replay, buffer_device_address_multi_device,
    }
    vk::PhysicalDeviceImagelessFramebufferFeatures<'_> {
        imageless_framebuffer,
    }
    vk::PhysicalDeviceTextureCompressionASTCHDRFeatures<'_> {
        texture_compression_astc_hdr,
    }
    vk::PhysicalDeviceSeparateDepthStencilLayoutsFeatures<'_> {
        separate_depth_stencil_layouts,
    }
    vk::PhysicalDeviceShaderDemoteToHelperInvocationFeatures<'_> {
        shader_demote_to_helper_invocation,
    }
    vk::PhysicalDeviceSubgroupSizeControlFeatures<'_> {
        subgroup_size_control, compute_full_subgroups,
    }
    vk::PhysicalDevicePipelineCreationCacheControlFeatures<'_> {
        pipeline_creation_cache_control,
    }
    vk::PhysicalDeviceZeroInitializeWorkgroupMemoryFeatures<'_> {
        shader_zero_initialize_workgroup_memory,
    }
    vk::PhysicalDeviceImageRobustnessFeatures<'_> {
        robust_image_access,
    }
    vk::PhysicalDeviceShaderTerminateInvocationFeatures<'_> {
        shader_terminate_invocation,
    }
    vk::PhysicalDeviceSynchronization2Features<'_> {
        synchronization2,
    }
    vk::PhysicalDeviceShaderIntegerDotProductFeatures<'_> {
        shader_integer_dot_product,
    }
    vk::PhysicalDeviceDynamicRenderingFeatures<'_> {
        dynamic_rendering,
    }
    vk::PhysicalDevicePerformanceQueryFeaturesKHR<'_> {
        performance_counter_query_pools, performance_counter_multiple_query_pools,
    }
    vk::PhysicalDeviceIndexTypeUint8FeaturesKHR<'_> {
        index_type_uint8,
    }
    vk::PhysicalDeviceProvokingVertexFeaturesEXT<'_> {
        provoking_vertex_last, transform_feedback_preserves_provoking_vertex,
    }
    vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR<'_> {
        vertex_attribute_instance_rate_divisor, vertex_attribute_instance_rate_zero_divisor,
    }
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_> {
        gaussian_primitive_topology, vertex_shader_projection, resolve_fragment_shader, radial_distance_order,
        primitive_order, per_pixel_order, rasterization_float16, opacity_compensation, orthographic_camera,
        fisheye_camera, equirectangular_camera, unscented_projection, gaussian_2d, uniform_buffer_camera,
        merged_draws, gaussian_instancing, gaussian_depth_stencil, gaussian_multisample,
        gaussian_approximation,
    }
}
