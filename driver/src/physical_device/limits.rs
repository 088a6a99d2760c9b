//! The physical device's properties and limits.
//!
//! Limits are at least Vulkan's required ones. [`Properties`] has a field for each property of the core version and of
//! the listed extensions: each is defined only here.

use super::{external, memory};
use crate::convert;
use crate::instance::API_VERSION;
use crate::registry::properties::Properties;
use ash::vk;
use simdevice::limits::{MAX_LINE_WIDTH, MAX_POINT_SIZE, MAX_TRANSFORM_FEEDBACK_BUFFERS, MAX_VERTEX_STREAMS};
use std::ffi::{CStr, c_char};
use std::sync::LazyLock;

const DEVICE_NAME: &CStr = c"GauRast simulated device";
const DRIVER_NAME: &CStr = c"GauRast";

/// The driver's version, in text.
const DRIVER_INFO: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
    Ok(text) => text,
    Err(_) => c"",
};

/// The vendor id; none is registered for this driver.
const VENDOR_ID: u32 = 0;

/// The device id, of the vendor's only device.
const DEVICE_ID: u32 = 1;

/// The most Gaussians of one draw or one sorted set. So many were drawn: `docs/testing.md` has their time and memory.
pub(crate) const MAX_GAUSSIANS: u64 = 1 << 26;

/// The greatest degree of spherical harmonics of a pipeline.
pub(crate) const MAX_SPHERICAL_HARMONICS_DEGREE: u32 = 4;

/// The greatest extent of an image in two dimensions, and of framebuffers and viewports.
pub(crate) const MAX_IMAGE_DIMENSION: u32 = 16384;

/// The greatest extent of an image in three dimensions.
pub(crate) const MAX_IMAGE_DIMENSION_3D: u32 = 4096;

/// The most array layers of an image or framebuffer.
pub(crate) const MAX_LAYERS: u32 = 2048;

/// The granularity of points' and lines' sizes, which is that of coordinates.
const SIZE_GRANULARITY: f32 = 1.0 / 256.0;

/// The most clip and cull distances, of each kind and together.
const MAX_CLIP_CULL_DISTANCES: u32 = simdevice::limits::MAX_CLIP_CULL_DISTANCES as u32;

/// The sample counts of attachments.
pub(crate) const SAMPLE_COUNTS: vk::SampleCountFlags =
    vk::SampleCountFlags::from_raw(vk::SampleCountFlags::TYPE_1.as_raw() | vk::SampleCountFlags::TYPE_4.as_raw());

/// The sample counts of images that only shaders and copies access: all that there are.
pub(crate) const STORED_SAMPLE_COUNTS: vk::SampleCountFlags = vk::SampleCountFlags::from_raw(0x7f);

/// The most colour attachments.
pub(crate) const MAX_COLOR_ATTACHMENTS: u32 = 8;

/// The greatest magnitude of a sampler's bias of the level of detail.
pub(crate) const MAX_SAMPLER_LOD_BIAS: f32 = simdevice::limits::MAX_LOD_BIAS;

/// The most samples along a pixel's footprint, for anisotropic filtering.
pub(crate) const MAX_SAMPLER_ANISOTROPY: f32 = 16.0;

/// The bytes of push constants.
pub(crate) const MAX_PUSH_CONSTANTS_SIZE: u32 = 256;

/// The most descriptors of a pushed set.
pub(crate) const MAX_PUSH_DESCRIPTORS: u32 = 32;

/// The most descriptors of a set, of any mix of kinds.
pub(crate) const MAX_PER_SET_DESCRIPTORS: u32 = DESCRIPTORS;

/// The most descriptors of a kind in a stage, or in a set. Only memory bounds them.
const DESCRIPTORS: u32 = 1 << 20;

/// The most bytes of an inline uniform block.
pub(crate) const MAX_INLINE_UNIFORM_BLOCK_SIZE: u32 = 4096;

/// The most inline uniform blocks of a stage, or of a set. Only memory bounds them.
const INLINE_UNIFORM_BLOCKS: u32 = 64;

/// The most descriptors with dynamic offsets.
const DYNAMIC_DESCRIPTORS: u32 = 256;

/// The alignment of offsets of uniform, storage and texel buffers.
pub(crate) const MIN_BUFFER_OFFSET_ALIGNMENT: u64 = 16;

/// The most texels of a texel buffer.
pub(crate) const MAX_TEXEL_BUFFER_ELEMENTS: u32 = 1 << 27;

/// The most scalars of a vertex that a stage passes to the next: 32 vectors of four.
const MAX_VARYING_COMPONENTS: u32 = 128;

/// The greatest level to which an edge of a patch is divided.
const MAX_TESSELLATION_LEVEL: u32 = simdevice::tessellation::MAX_LEVEL;

/// The most vertices of a patch.
pub(crate) const MAX_PATCH_SIZE: u32 = 32;

/// The most scalars of a whole patch.
const MAX_PATCH_COMPONENTS: u32 = 128;

/// The most invocations of a geometry shader for a primitive.
const MAX_GEOMETRY_INVOCATIONS: u32 = 127;

/// The most vertices that an invocation of a geometry shader emits.
const MAX_GEOMETRY_VERTICES: u32 = 1024;

/// The most scalars of all vertices that an invocation of a geometry shader emits: a position for each.
const MAX_GEOMETRY_COMPONENTS: u32 = 4 * MAX_GEOMETRY_VERTICES;

/// The most bytes of a vertex that transform feedback writes: those of all varyings.
const MAX_CAPTURED_BYTES: u32 = 4 * MAX_VARYING_COMPONENTS;

/// The offsets in texels that an instruction may have.
const TEXEL_OFFSETS: std::ops::RangeInclusive<i32> = -32..=31;

/// The most workgroups of a dispatch in x, y and z. The device supports any number, but some applications read the
/// limit as signed, so that a greater one would be -1 to them.
const MAX_WORKGROUP_COUNT: u32 = 65535;

/// The most invocations of a workgroup in x, y and z.
pub(crate) const MAX_WORKGROUP_SIZE: [u32; 3] = [MAX_WORKGROUP_INVOCATIONS; 3];

/// The most invocations of a workgroup.
pub(crate) const MAX_WORKGROUP_INVOCATIONS: u32 = simdevice::limits::MAX_WORKGROUP_INVOCATIONS;

/// The most bytes of a workgroup's shared memory.
pub(crate) const MAX_SHARED_BYTES: u32 = simdevice::limits::MAX_SHARED_BYTES;

/// Invocations of a subgroup, unless a pipeline requires another size.
pub(crate) const SUBGROUP_SIZE: u32 = simdevice::limits::DRAW_SUBGROUP_SIZE;

/// The subgroup sizes that a pipeline may require.
pub(crate) const SUBGROUP_SIZES: std::ops::RangeInclusive<u32> = 4..=128;

/// The most vertex attributes and vertex bindings. Gaussians of degree 3 take 20 attributes.
pub(crate) const MAX_VERTEX_INPUTS: u32 = 32;

fn driver_version() -> [u8; 3] {
    let part = |text: &str| text.parse().unwrap_or(0);
    [
        part(env!("CARGO_PKG_VERSION_MAJOR")),
        part(env!("CARGO_PKG_VERSION_MINOR")),
        part(env!("CARGO_PKG_VERSION_PATCH")),
    ]
}

/// A UUID of 13 bytes of name and three of version.
fn uuid(name: &[u8; 13], version: [u8; 3]) -> [u8; vk::UUID_SIZE] {
    let mut uuid = [0; vk::UUID_SIZE];
    uuid[..13].copy_from_slice(name);
    uuid[13..].copy_from_slice(&version);
    uuid
}

/// `driverUUID` and `deviceUUID`: devices share memory if they have the same.
pub(crate) fn identity() -> [[u8; vk::UUID_SIZE]; 2] {
    [uuid(b"GauRastDriver", driver_version()), uuid(b"GauRastDevice", [0; 3])]
}

/// The device's properties and limits.
pub(crate) fn properties() -> &'static Properties {
    static PROPERTIES: LazyLock<Properties> = LazyLock::new(find_properties);
    &PROPERTIES
}

fn find_properties() -> Properties {
    let [major, minor, patch] = driver_version().map(u32::from);
    Properties {
        api_version: API_VERSION,
        driver_version: vk::make_api_version(0, major, minor, patch),
        vendor_id: VENDOR_ID,
        device_id: DEVICE_ID,
        device_type: vk::PhysicalDeviceType::CPU,
        device_name: fixed_string(DEVICE_NAME),
        pipeline_cache_uuid: uuid(b"GauRast cache", driver_version()),
        max_image_dimension1_d: MAX_IMAGE_DIMENSION,
        max_image_dimension2_d: MAX_IMAGE_DIMENSION,
        max_image_dimension3_d: MAX_IMAGE_DIMENSION_3D,
        max_image_dimension_cube: MAX_IMAGE_DIMENSION,
        max_image_array_layers: MAX_LAYERS,
        max_texel_buffer_elements: MAX_TEXEL_BUFFER_ELEMENTS,
        max_uniform_buffer_range: 1 << 16,
        max_storage_buffer_range: u32::MAX,
        max_push_constants_size: MAX_PUSH_CONSTANTS_SIZE,
        max_memory_allocation_count: u32::MAX,
        max_sampler_allocation_count: 1 << 16,
        buffer_image_granularity: 1,
        sparse_address_space_size: 0,
        max_bound_descriptor_sets: 8,
        max_per_stage_descriptor_samplers: DESCRIPTORS,
        max_per_stage_descriptor_uniform_buffers: DESCRIPTORS,
        max_per_stage_descriptor_storage_buffers: DESCRIPTORS,
        max_per_stage_descriptor_sampled_images: DESCRIPTORS,
        max_per_stage_descriptor_storage_images: DESCRIPTORS,
        max_per_stage_descriptor_input_attachments: DESCRIPTORS,
        max_per_stage_resources: DESCRIPTORS,
        max_descriptor_set_samplers: DESCRIPTORS,
        max_descriptor_set_uniform_buffers: DESCRIPTORS,
        max_descriptor_set_uniform_buffers_dynamic: DYNAMIC_DESCRIPTORS,
        max_descriptor_set_storage_buffers: DESCRIPTORS,
        max_descriptor_set_storage_buffers_dynamic: DYNAMIC_DESCRIPTORS,
        max_descriptor_set_sampled_images: DESCRIPTORS,
        max_descriptor_set_storage_images: DESCRIPTORS,
        max_descriptor_set_input_attachments: DESCRIPTORS,
        max_vertex_input_attributes: MAX_VERTEX_INPUTS,
        max_vertex_input_bindings: MAX_VERTEX_INPUTS,
        max_vertex_input_attribute_offset: 65535,
        max_vertex_input_binding_stride: 65536,
        max_vertex_output_components: MAX_VARYING_COMPONENTS,
        max_tessellation_generation_level: MAX_TESSELLATION_LEVEL,
        max_tessellation_patch_size: MAX_PATCH_SIZE,
        max_tessellation_control_per_vertex_input_components: MAX_VARYING_COMPONENTS,
        max_tessellation_control_per_vertex_output_components: MAX_VARYING_COMPONENTS,
        max_tessellation_control_per_patch_output_components: MAX_PATCH_COMPONENTS,
        max_tessellation_control_total_output_components: MAX_PATCH_SIZE * MAX_VARYING_COMPONENTS
            + MAX_PATCH_COMPONENTS,
        max_tessellation_evaluation_input_components: MAX_VARYING_COMPONENTS,
        max_tessellation_evaluation_output_components: MAX_VARYING_COMPONENTS,
        max_geometry_shader_invocations: MAX_GEOMETRY_INVOCATIONS,
        max_geometry_input_components: MAX_VARYING_COMPONENTS,
        max_geometry_output_components: MAX_VARYING_COMPONENTS,
        max_geometry_output_vertices: MAX_GEOMETRY_VERTICES,
        max_geometry_total_output_components: MAX_GEOMETRY_COMPONENTS,
        max_fragment_input_components: MAX_VARYING_COMPONENTS,
        max_fragment_output_attachments: MAX_COLOR_ATTACHMENTS,
        max_fragment_dual_src_attachments: MAX_COLOR_ATTACHMENTS,
        max_fragment_combined_output_resources: DESCRIPTORS,
        max_compute_shared_memory_size: MAX_SHARED_BYTES,
        max_compute_work_group_count: [MAX_WORKGROUP_COUNT; 3],
        max_compute_work_group_invocations: MAX_WORKGROUP_INVOCATIONS,
        max_compute_work_group_size: MAX_WORKGROUP_SIZE,
        sub_pixel_precision_bits: 8,
        sub_texel_precision_bits: 8,
        mipmap_precision_bits: 8,
        max_draw_indexed_index_value: u32::MAX,
        max_draw_indirect_count: u32::MAX,
        max_sampler_lod_bias: MAX_SAMPLER_LOD_BIAS,
        max_sampler_anisotropy: MAX_SAMPLER_ANISOTROPY,
        max_viewports: simdevice::limits::MAX_VIEWPORTS as u32,
        max_viewport_dimensions: [MAX_IMAGE_DIMENSION; 2],
        viewport_bounds_range: [-2.0 * MAX_IMAGE_DIMENSION as f32, 2.0 * MAX_IMAGE_DIMENSION as f32 - 1.0],
        viewport_sub_pixel_bits: 8,
        min_memory_map_alignment: memory::ALIGNMENT as usize,
        min_texel_buffer_offset_alignment: MIN_BUFFER_OFFSET_ALIGNMENT,
        min_uniform_buffer_offset_alignment: MIN_BUFFER_OFFSET_ALIGNMENT,
        min_storage_buffer_offset_alignment: MIN_BUFFER_OFFSET_ALIGNMENT,
        min_texel_offset: *TEXEL_OFFSETS.start(),
        max_texel_offset: *TEXEL_OFFSETS.end() as u32,
        min_texel_gather_offset: *TEXEL_OFFSETS.start(),
        max_texel_gather_offset: *TEXEL_OFFSETS.end() as u32,
        // Offsets are binary32 and not limited; inputs are extrapolated by their derivatives.
        min_interpolation_offset: -2.0,
        max_interpolation_offset: 2.0,
        sub_pixel_interpolation_offset_bits: 8,
        max_framebuffer_width: MAX_IMAGE_DIMENSION,
        max_framebuffer_height: MAX_IMAGE_DIMENSION,
        max_framebuffer_layers: MAX_LAYERS,
        framebuffer_color_sample_counts: SAMPLE_COUNTS,
        framebuffer_depth_sample_counts: SAMPLE_COUNTS,
        framebuffer_stencil_sample_counts: SAMPLE_COUNTS,
        framebuffer_no_attachments_sample_counts: SAMPLE_COUNTS,
        max_color_attachments: MAX_COLOR_ATTACHMENTS,
        sampled_image_color_sample_counts: STORED_SAMPLE_COUNTS,
        sampled_image_integer_sample_counts: STORED_SAMPLE_COUNTS,
        sampled_image_depth_sample_counts: SAMPLE_COUNTS,
        sampled_image_stencil_sample_counts: SAMPLE_COUNTS,
        storage_image_sample_counts: STORED_SAMPLE_COUNTS,
        max_sample_mask_words: 1,
        timestamp_compute_and_graphics: true,
        timestamp_period: 1.0,
        max_clip_distances: MAX_CLIP_CULL_DISTANCES,
        max_cull_distances: MAX_CLIP_CULL_DISTANCES,
        max_combined_clip_and_cull_distances: MAX_CLIP_CULL_DISTANCES,
        discrete_queue_priorities: 2,
        point_size_range: [0.0, MAX_POINT_SIZE],
        line_width_range: [1.0, MAX_LINE_WIDTH],
        point_size_granularity: SIZE_GRANULARITY,
        line_width_granularity: SIZE_GRANULARITY,
        strict_lines: true,
        standard_sample_locations: true,
        optimal_buffer_copy_offset_alignment: 1,
        optimal_buffer_copy_row_pitch_alignment: 1,
        non_coherent_atom_size: 1,
        residency_standard2_d_block_shape: false,
        residency_standard2_d_multisample_block_shape: false,
        residency_standard3_d_block_shape: false,
        residency_aligned_mip_size: false,
        residency_non_resident_strict: false,
        device_uuid: identity()[1],
        driver_uuid: identity()[0],
        device_luid: [0; vk::LUID_SIZE],
        device_node_mask: 0,
        device_luid_valid: false,
        subgroup_size: SUBGROUP_SIZE,
        subgroup_supported_stages: vk::ShaderStageFlags::from_raw(
            vk::ShaderStageFlags::VERTEX.as_raw()
                | vk::ShaderStageFlags::TESSELLATION_CONTROL.as_raw()
                | vk::ShaderStageFlags::TESSELLATION_EVALUATION.as_raw()
                | vk::ShaderStageFlags::GEOMETRY.as_raw()
                | vk::ShaderStageFlags::FRAGMENT.as_raw()
                | vk::ShaderStageFlags::COMPUTE.as_raw(),
        ),
        subgroup_supported_operations: vk::SubgroupFeatureFlags::BASIC
            | vk::SubgroupFeatureFlags::VOTE
            | vk::SubgroupFeatureFlags::ARITHMETIC
            | vk::SubgroupFeatureFlags::BALLOT
            | vk::SubgroupFeatureFlags::SHUFFLE
            | vk::SubgroupFeatureFlags::SHUFFLE_RELATIVE
            | vk::SubgroupFeatureFlags::CLUSTERED
            | vk::SubgroupFeatureFlags::QUAD
            | vk::SubgroupFeatureFlags::ROTATE_KHR
            | vk::SubgroupFeatureFlags::ROTATE_CLUSTERED_KHR,
        subgroup_quad_operations_in_all_stages: true,
        point_clipping_behavior: vk::PointClippingBehavior::USER_CLIP_PLANES_ONLY,
        max_multiview_view_count: u32::BITS,
        max_multiview_instance_index: u32::MAX >> 1,
        protected_no_fault: false,
        max_per_set_descriptors: MAX_PER_SET_DESCRIPTORS,
        max_memory_allocation_size: memory::heap_size(),
        // No driver id is registered for this driver, and it claims no conformance.
        driver_id: vk::DriverId::from_raw(0),
        driver_name: fixed_string(DRIVER_NAME),
        driver_info: fixed_string(DRIVER_INFO),
        conformance_version: vk::ConformanceVersion::default(),
        denorm_behavior_independence: vk::ShaderFloatControlsIndependence::ALL,
        rounding_mode_independence: vk::ShaderFloatControlsIndependence::ALL,
        shader_signed_zero_inf_nan_preserve_float16: true,
        shader_signed_zero_inf_nan_preserve_float32: true,
        shader_signed_zero_inf_nan_preserve_float64: true,
        shader_denorm_preserve_float16: true,
        shader_denorm_preserve_float32: true,
        shader_denorm_preserve_float64: true,
        shader_denorm_flush_to_zero_float16: false,
        shader_denorm_flush_to_zero_float32: false,
        shader_denorm_flush_to_zero_float64: false,
        shader_rounding_mode_rte_float16: true,
        shader_rounding_mode_rte_float32: true,
        shader_rounding_mode_rte_float64: true,
        shader_rounding_mode_rtz_float16: false,
        shader_rounding_mode_rtz_float32: false,
        shader_rounding_mode_rtz_float64: false,
        // Sets are read when commands execute, so the time of an update makes no difference.
        max_update_after_bind_descriptors_in_all_pools: u32::MAX,
        shader_uniform_buffer_array_non_uniform_indexing_native: true,
        shader_sampled_image_array_non_uniform_indexing_native: true,
        shader_storage_buffer_array_non_uniform_indexing_native: true,
        shader_storage_image_array_non_uniform_indexing_native: true,
        shader_input_attachment_array_non_uniform_indexing_native: false,
        robust_buffer_access_update_after_bind: true,
        quad_divergent_implicit_lod: false,
        max_per_stage_descriptor_update_after_bind_samplers: DESCRIPTORS,
        max_per_stage_descriptor_update_after_bind_uniform_buffers: DESCRIPTORS,
        max_per_stage_descriptor_update_after_bind_storage_buffers: DESCRIPTORS,
        max_per_stage_descriptor_update_after_bind_sampled_images: DESCRIPTORS,
        max_per_stage_descriptor_update_after_bind_storage_images: DESCRIPTORS,
        max_per_stage_descriptor_update_after_bind_input_attachments: DESCRIPTORS,
        max_per_stage_update_after_bind_resources: DESCRIPTORS,
        max_descriptor_set_update_after_bind_samplers: DESCRIPTORS,
        max_descriptor_set_update_after_bind_uniform_buffers: DESCRIPTORS,
        max_descriptor_set_update_after_bind_uniform_buffers_dynamic: DYNAMIC_DESCRIPTORS,
        max_descriptor_set_update_after_bind_storage_buffers: DESCRIPTORS,
        max_descriptor_set_update_after_bind_storage_buffers_dynamic: DYNAMIC_DESCRIPTORS,
        max_descriptor_set_update_after_bind_sampled_images: DESCRIPTORS,
        max_descriptor_set_update_after_bind_storage_images: DESCRIPTORS,
        max_descriptor_set_update_after_bind_input_attachments: DESCRIPTORS,
        supported_depth_resolve_modes: vk::ResolveModeFlags::SAMPLE_ZERO
            | vk::ResolveModeFlags::AVERAGE
            | vk::ResolveModeFlags::MIN
            | vk::ResolveModeFlags::MAX,
        supported_stencil_resolve_modes: vk::ResolveModeFlags::SAMPLE_ZERO
            | vk::ResolveModeFlags::MIN
            | vk::ResolveModeFlags::MAX,
        independent_resolve_none: true,
        independent_resolve: true,
        filter_minmax_single_component_formats: true,
        filter_minmax_image_component_mapping: true,
        max_timeline_semaphore_value_difference: u64::MAX,
        max_custom_border_color_samplers: 1 << 16,
        max_multi_draw_count: 1 << 16,
        line_sub_pixel_precision_bits: 8,
        dynamic_primitive_topology_unrestricted: true,
        // Every access is checked against the range itself, scalar by scalar.
        robust_storage_buffer_access_size_alignment: 1,
        robust_uniform_buffer_access_size_alignment: 1,
        framebuffer_integer_color_sample_counts: SAMPLE_COUNTS,
        min_subgroup_size: *SUBGROUP_SIZES.start(),
        max_subgroup_size: *SUBGROUP_SIZES.end(),
        max_compute_workgroup_subgroups: MAX_WORKGROUP_INVOCATIONS / *SUBGROUP_SIZES.start(),
        required_subgroup_size_stages: vk::ShaderStageFlags::COMPUTE,
        max_inline_uniform_block_size: MAX_INLINE_UNIFORM_BLOCK_SIZE,
        max_per_stage_descriptor_inline_uniform_blocks: INLINE_UNIFORM_BLOCKS,
        max_per_stage_descriptor_update_after_bind_inline_uniform_blocks: INLINE_UNIFORM_BLOCKS,
        max_descriptor_set_inline_uniform_blocks: INLINE_UNIFORM_BLOCKS,
        max_descriptor_set_update_after_bind_inline_uniform_blocks: INLINE_UNIFORM_BLOCKS,
        max_inline_uniform_total_size: MAX_INLINE_UNIFORM_BLOCK_SIZE * INLINE_UNIFORM_BLOCKS,
        // No instruction computes a dot product of integers.
        integer_dot_product8_bit_unsigned_accelerated: false,
        integer_dot_product8_bit_signed_accelerated: false,
        integer_dot_product8_bit_mixed_signedness_accelerated: false,
        integer_dot_product4x8_bit_packed_unsigned_accelerated: false,
        integer_dot_product4x8_bit_packed_signed_accelerated: false,
        integer_dot_product4x8_bit_packed_mixed_signedness_accelerated: false,
        integer_dot_product16_bit_unsigned_accelerated: false,
        integer_dot_product16_bit_signed_accelerated: false,
        integer_dot_product16_bit_mixed_signedness_accelerated: false,
        integer_dot_product32_bit_unsigned_accelerated: false,
        integer_dot_product32_bit_signed_accelerated: false,
        integer_dot_product32_bit_mixed_signedness_accelerated: false,
        integer_dot_product64_bit_unsigned_accelerated: false,
        integer_dot_product64_bit_signed_accelerated: false,
        integer_dot_product64_bit_mixed_signedness_accelerated: false,
        integer_dot_product_accumulating_saturating8_bit_unsigned_accelerated: false,
        integer_dot_product_accumulating_saturating8_bit_signed_accelerated: false,
        integer_dot_product_accumulating_saturating8_bit_mixed_signedness_accelerated: false,
        integer_dot_product_accumulating_saturating4x8_bit_packed_unsigned_accelerated: false,
        integer_dot_product_accumulating_saturating4x8_bit_packed_signed_accelerated: false,
        integer_dot_product_accumulating_saturating4x8_bit_packed_mixed_signedness_accelerated: false,
        integer_dot_product_accumulating_saturating16_bit_unsigned_accelerated: false,
        integer_dot_product_accumulating_saturating16_bit_signed_accelerated: false,
        integer_dot_product_accumulating_saturating16_bit_mixed_signedness_accelerated: false,
        integer_dot_product_accumulating_saturating32_bit_unsigned_accelerated: false,
        integer_dot_product_accumulating_saturating32_bit_signed_accelerated: false,
        integer_dot_product_accumulating_saturating32_bit_mixed_signedness_accelerated: false,
        integer_dot_product_accumulating_saturating64_bit_unsigned_accelerated: false,
        integer_dot_product_accumulating_saturating64_bit_signed_accelerated: false,
        integer_dot_product_accumulating_saturating64_bit_mixed_signedness_accelerated: false,
        storage_texel_buffer_offset_alignment_bytes: MIN_BUFFER_OFFSET_ALIGNMENT,
        storage_texel_buffer_offset_single_texel_alignment: true,
        uniform_texel_buffer_offset_alignment_bytes: MIN_BUFFER_OFFSET_ALIGNMENT,
        uniform_texel_buffer_offset_single_texel_alignment: true,
        max_buffer_size: memory::heap_size(),
        provoking_vertex_mode_per_pipeline: true,
        transform_feedback_preserves_triangle_fan_provoking_vertex: true,
        max_transform_feedback_streams: MAX_VERTEX_STREAMS as u32,
        max_transform_feedback_buffers: MAX_TRANSFORM_FEEDBACK_BUFFERS as u32,
        max_transform_feedback_buffer_size: u32::MAX.into(),
        max_transform_feedback_stream_data_size: MAX_CAPTURED_BYTES,
        max_transform_feedback_buffer_data_size: MAX_CAPTURED_BYTES,
        max_transform_feedback_buffer_data_stride: 2048,
        transform_feedback_queries: true,
        transform_feedback_streams_lines_triangles: true,
        transform_feedback_rasterization_stream_select: true,
        transform_feedback_draw: true,
        // Programs are compiled when libraries are linked.
        graphics_pipeline_library_fast_linking: false,
        // The fragment stage alone says how its inputs are interpolated.
        graphics_pipeline_library_independent_interpolation_decoration: true,
        optimal_tiling_layout_uuid: identity()[0],
        identical_memory_type_requirements: true,
        max_vertex_attrib_divisor: u32::MAX,
        supports_non_zero_first_instance: true,
        early_fragment_multisample_coverage_after_sample_counting: true,
        early_fragment_sample_mask_test_before_sample_counting: true,
        depth_stencil_swizzle_one_support: true,
        polygon_mode_point_size: true,
        // Lines are strict.
        non_strict_single_pixel_wide_lines_use_parallelogram: false,
        non_strict_wide_lines_use_parallelogram: false,
        block_texel_view_compatible_multiple_layers: false,
        max_combined_image_sampler_descriptor_count: 1,
        dynamic_rendering_local_read_depth_stencil_attachments: true,
        dynamic_rendering_local_read_multisampled_attachments: true,
        fragment_shading_rate_clamp_combiner_inputs: false,
        // The device knows no less robust access.
        default_robustness_storage_buffers: vk::PipelineRobustnessBufferBehaviorEXT::ROBUST_BUFFER_ACCESS_2,
        default_robustness_uniform_buffers: vk::PipelineRobustnessBufferBehaviorEXT::ROBUST_BUFFER_ACCESS_2,
        default_robustness_vertex_inputs: vk::PipelineRobustnessBufferBehaviorEXT::ROBUST_BUFFER_ACCESS_2,
        default_robustness_images: vk::PipelineRobustnessImageBehaviorEXT::ROBUST_IMAGE_ACCESS_2,
        tile_size: vk::Extent2D { width: 16, height: 16 },
        max_spherical_harmonics_degree: MAX_SPHERICAL_HARMONICS_DEGREE,
        gaussian_sample_counts: SAMPLE_COUNTS,
        max_gaussians_per_draw: MAX_GAUSSIANS,
        max_gaussians_per_set: MAX_GAUSSIANS,
        precision_class: gaurast::vk::GaussianPrecisionClassGAURAST::FULL,
        allow_command_buffer_query_copies: false,
        max_push_descriptors: MAX_PUSH_DESCRIPTORS,
        min_imported_host_pointer_alignment: external::HOST_ALIGNMENT,
    }
}

/// A string in a fixed array of a Vulkan structure, truncated if necessary.
fn fixed_string<const N: usize>(text: &CStr) -> [c_char; N] {
    let mut array = [0; N];
    convert::write_string(&mut array, text);
    array
}
