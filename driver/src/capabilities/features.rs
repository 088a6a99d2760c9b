//! Features: one list of those that work, and the structures in which Vulkan asks for them.

pub(crate) mod structures;

use crate::error::Error;
use crate::pnext;
use ash::vk::{self, TaggedStructure};
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST;
use std::ffi::{CStr, c_void};
use structures::{Features, fill_structure, requested_in};

/// The features that work, by the names of their fields. A feature has one name in all structures that hold it, so
/// this is the only place to state it.
const SUPPORTED: &[&str] = &[
    // Core 1.0.
    "alpha_to_one",
    "depth_bias_clamp",
    "depth_bounds",
    "depth_clamp",
    "draw_indirect_first_instance",
    "dual_src_blend",
    "fill_mode_non_solid",
    "fragment_stores_and_atomics",
    "full_draw_index_uint32",
    "image_cube_array",
    "independent_blend",
    "inherited_queries",
    "large_points",
    "logic_op",
    "multi_draw_indirect",
    "multi_viewport",
    "occlusion_query_precise",
    "pipeline_statistics_query",
    "robust_buffer_access",
    "sample_rate_shading",
    "shader_clip_distance",
    "shader_cull_distance",
    "shader_float64",
    "shader_image_gather_extended",
    "shader_int16",
    "shader_int64",
    "shader_resource_min_lod",
    "shader_sampled_image_array_dynamic_indexing",
    "shader_storage_buffer_array_dynamic_indexing",
    "shader_storage_image_array_dynamic_indexing",
    "shader_storage_image_extended_formats",
    "shader_storage_image_read_without_format",
    "shader_storage_image_write_without_format",
    "shader_uniform_buffer_array_dynamic_indexing",
    "texture_compression_bc",
    "vertex_pipeline_stores_and_atomics",
    "wide_lines",
    // Core 1.1.
    "shader_draw_parameters",
    "storage_buffer16_bit_access",
    "storage_push_constant16",
    "uniform_and_storage_buffer16_bit_access",
    // Core 1.2. Image layouts don't matter to the device, so that depth and stencil may differ in theirs.
    "descriptor_binding_partially_bound",
    "descriptor_binding_update_unused_while_pending",
    "draw_indirect_count",
    "host_query_reset",
    "imageless_framebuffer",
    "runtime_descriptor_array",
    "sampler_mirror_clamp_to_edge",
    "scalar_block_layout",
    "separate_depth_stencil_layouts",
    "shader_buffer_int64_atomics",
    "shader_float16",
    "shader_int8",
    "shader_output_layer",
    "shader_output_viewport_index",
    "shader_sampled_image_array_non_uniform_indexing",
    "shader_shared_int64_atomics",
    "shader_storage_buffer_array_non_uniform_indexing",
    "shader_storage_image_array_non_uniform_indexing",
    "shader_storage_texel_buffer_array_dynamic_indexing",
    "shader_storage_texel_buffer_array_non_uniform_indexing",
    "shader_subgroup_extended_types",
    "shader_uniform_buffer_array_non_uniform_indexing",
    "shader_uniform_texel_buffer_array_dynamic_indexing",
    "shader_uniform_texel_buffer_array_non_uniform_indexing",
    "storage_buffer8_bit_access",
    "storage_push_constant8",
    "subgroup_broadcast_dynamic_id",
    "timeline_semaphore",
    "uniform_and_storage_buffer8_bit_access",
    "uniform_buffer_standard_layout",
    "vulkan_memory_model",
    "vulkan_memory_model_device_scope",
    // Core 1.3.
    "compute_full_subgroups",
    "dynamic_rendering",
    "maintenance4",
    "private_data",
    "robust_image_access",
    "shader_demote_to_helper_invocation",
    "shader_terminate_invocation",
    "shader_zero_initialize_workgroup_memory",
    "subgroup_size_control",
    "synchronization2",
    // VK_EXT_index_type_uint8, VK_EXT_provoking_vertex, VK_EXT_vertex_attribute_divisor.
    "index_type_uint8",
    "provoking_vertex_last",
    "vertex_attribute_instance_rate_divisor",
    "vertex_attribute_instance_rate_zero_divisor",
    // VK_KHR_performance_query.
    "performance_counter_query_pools",
    // VK_GAURAST_gaussian_primitive_topology.
    "gaussian_primitive_topology",
    "equirectangular_camera",
    "fisheye_camera",
    "gaussian_2d",
    "gaussian_approximation",
    "gaussian_depth_stencil",
    "gaussian_instancing",
    "gaussian_multisample",
    "merged_draws",
    "opacity_compensation",
    "orthographic_camera",
    "per_pixel_order",
    "primitive_order",
    "radial_distance_order",
    "resolve_fragment_shader",
    "rasterization_float16",
    "uniform_buffer_camera",
    "vertex_shader_projection",
    "unscented_projection",
];

/// The extensions whose features can't be enabled without them. (Features of core need none.)
const EXTENSIONS: &[(vk::StructureType, &CStr)] = &[
    (
        vk::PhysicalDeviceIndexTypeUint8FeaturesKHR::STRUCTURE_TYPE,
        ash::ext::index_type_uint8::NAME,
    ),
    (
        vk::PhysicalDeviceProvokingVertexFeaturesEXT::STRUCTURE_TYPE,
        ash::ext::provoking_vertex::NAME,
    ),
    (
        vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR::STRUCTURE_TYPE,
        ash::ext::vertex_attribute_divisor::NAME,
    ),
    (
        vk::PhysicalDevicePerformanceQueryFeaturesKHR::STRUCTURE_TYPE,
        ash::khr::performance_query::NAME,
    ),
    (
        PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::STRUCTURE_TYPE,
        gaussian_primitive_topology::NAME,
    ),
];

/// Whether the feature, named as ash names its field, works.
pub(crate) fn is_supported(feature: &str) -> bool {
    SUPPORTED.contains(&feature)
}

/// The features that an application enabled.
#[derive(Clone, Debug, Default)]
pub(crate) struct EnabledFeatures(Vec<&'static str>);

impl EnabledFeatures {
    /// What `vkCreateDevice` was asked to enable, together with `extensions`.
    ///
    /// # Errors
    /// [`Error::FeatureNotPresent`] names the first feature that isn't supported, [`Error::Usage`] one whose extension
    /// isn't enabled.
    ///
    /// # Safety
    /// The creation info is valid.
    pub(crate) unsafe fn requested(
        info: &vk::DeviceCreateInfo<'_>,
        extensions: &[&CStr],
    ) -> Result<Self, Error> {
        let mut enabled = Self::default();
        // SAFETY: the pointer is null or valid in a valid creation info.
        if let Some(features) = unsafe { info.p_enabled_features.as_ref() } {
            enabled.enable(features.requested())?;
        }
        // SAFETY: the chain of a valid creation info is valid.
        for structure in unsafe { pnext::iter(info.p_next) } {
            if let Some(features) = pnext::cast::<vk::PhysicalDeviceFeatures2<'_>>(structure) {
                enabled.enable(features.features.requested())?;
            } else if let Some(requested) = requested_in(structure) {
                if let Some(feature) = requested.first() {
                    require_extension(structure.s_type, feature, extensions)?;
                }
                enabled.enable(requested)?;
            }
        }
        Ok(enabled)
    }

    fn enable(&mut self, requested: Vec<&'static str>) -> Result<(), Error> {
        if let Some(missing) = requested.iter().find(|feature| !is_supported(feature)) {
            return Err(Error::FeatureNotPresent(format!("the feature {missing}")));
        }
        self.0.extend(requested);
        Ok(())
    }

    /// These, for tests.
    #[cfg(test)]
    pub(super) fn of(names: &[&'static str]) -> Self {
        Self(names.to_vec())
    }

    /// Whether the feature, named as ash names its field, was enabled.
    pub(crate) fn has(&self, feature: &str) -> bool {
        self.0.contains(&feature)
    }
}

/// Refuses a feature of an extension that isn't enabled.
fn require_extension(
    structure: vk::StructureType,
    feature: &str,
    extensions: &[&CStr],
) -> Result<(), Error> {
    let needed = EXTENSIONS.iter().find(|(s_type, _)| *s_type == structure);
    match needed {
        Some((_, name)) if !extensions.contains(name) => Err(Error::usage(
            "VUID-VkDeviceCreateInfo-pNext-extension",
            format!("the feature {feature} needs {name:?}, which is not enabled"),
        )),
        _ => Ok(()),
    }
}

/// The extension without which a structure's features can't be enabled.
#[cfg(test)]
pub(crate) fn extension_of(structure: vk::StructureType) -> Option<&'static CStr> {
    EXTENSIONS
        .iter()
        .find_map(|(s_type, name)| (*s_type == structure).then_some(*name))
}

/// What is supported, as the core structure.
pub(crate) fn core() -> vk::PhysicalDeviceFeatures {
    let mut features = vk::PhysicalDeviceFeatures::default();
    features.fill();
    features
}

/// Fills in every structure of an output chain that holds features known here.
///
/// # Safety
/// As [`pnext::for_each_output`].
pub(crate) unsafe fn fill_chain(first: *mut c_void) {
    // SAFETY: the caller's promise.
    unsafe { pnext::for_each_output(first, fill_structure) };
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Features that Vulkan 1.3 requires of an implementation and that don't work yet. A feature leaves this list when
    /// it enters [`SUPPORTED`]; when the list is empty, 1.3's features are complete.
    const REQUIRED_BUT_MISSING: &[&str] = &[
        "buffer_device_address",
        "descriptor_binding_inline_uniform_block_update_after_bind",
        "inline_uniform_block",
        "multiview",
        "pipeline_creation_cache_control",
        "shader_integer_dot_product",
    ];

    fn all_true<T: Default + Features>(count: usize) -> Vec<&'static str> {
        let mut features = T::default();
        features.fill();
        let names = features.requested();
        assert_eq!(names.len(), count);
        names
    }

    #[test]
    fn supported_features_are_those_of_the_structures() {
        let mut names = all_true::<vk::PhysicalDeviceFeatures>(37);
        names.extend(all_true::<vk::PhysicalDeviceVulkan11Features<'_>>(4));
        names.extend(all_true::<vk::PhysicalDeviceVulkan12Features<'_>>(32));
        names.extend(all_true::<vk::PhysicalDeviceVulkan13Features<'_>>(10));
        names.extend(all_true::<vk::PhysicalDevicePerformanceQueryFeaturesKHR<'_>>(1));
        names.extend(all_true::<vk::PhysicalDeviceIndexTypeUint8FeaturesKHR<'_>>(
            1,
        ));
        names.extend(all_true::<vk::PhysicalDeviceProvokingVertexFeaturesEXT<'_>>(1));
        names.extend(all_true::<
            vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR<'_>,
        >(2));
        names.extend(all_true::<
            PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_>,
        >(19));
        let names: HashSet<_> = names.into_iter().collect();
        assert_eq!(names, SUPPORTED.iter().copied().collect());
    }

    #[test]
    fn missing_features_are_listed_truly() {
        for feature in REQUIRED_BUT_MISSING {
            assert!(
                !is_supported(feature),
                "{feature} works now; take it off the list"
            );
        }
    }

    #[test]
    fn requests_are_checked_wherever_they_stand() {
        let requested = |info: &vk::DeviceCreateInfo<'_>| {
            // SAFETY: ash built the creation info.
            unsafe { EnabledFeatures::requested(info, &[gaussian_primitive_topology::NAME]) }
        };
        let mut works = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        let core = vk::PhysicalDeviceFeatures::default().robust_buffer_access(true);
        let info = vk::DeviceCreateInfo::default()
            .enabled_features(&core)
            .push_next(&mut works);
        let enabled = requested(&info).unwrap();
        assert!(enabled.has("dynamic_rendering") && enabled.has("robust_buffer_access"));
        assert!(!enabled.has("synchronization2"));

        let refused = |result: Result<EnabledFeatures, Error>, name: &str| {
            let error = result.unwrap_err();
            assert_eq!(error.result(), vk::Result::ERROR_FEATURE_NOT_PRESENT);
            assert!(error.to_string().contains(name), "{error}");
        };
        let core = vk::PhysicalDeviceFeatures::default().geometry_shader(true);
        refused(
            requested(&vk::DeviceCreateInfo::default().enabled_features(&core)),
            "geometry_shader",
        );
        let mut core = vk::PhysicalDeviceFeatures2::default();
        core.features.sparse_binding = vk::TRUE;
        refused(
            requested(&vk::DeviceCreateInfo::default().push_next(&mut core)),
            "sparse_binding",
        );
        let mut missing = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .inline_uniform_block(true);
        refused(
            requested(&vk::DeviceCreateInfo::default().push_next(&mut missing)),
            "inline_uniform_block",
        );

        let mut other = vk::PhysicalDevicePerformanceQueryFeaturesKHR::default()
            .performance_counter_query_pools(true);
        let error = requested(&vk::DeviceCreateInfo::default().push_next(&mut other)).unwrap_err();
        assert!(error.is_usage(), "{error}");
    }
}
