//! The features and properties that devices get.

use ash::vk;
use gaurast::gaussian_primitive_topology::NAME;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties;

/// The most Gaussians of a set, which is the least that the extension allows.
pub(crate) const MAX_GAUSSIANS: u32 = (1 << 24) - 1;

/// Reports whether a physical device lacks the extension and has what its emulation needs.
///
/// # Safety
/// The physical device is the instance's.
pub(crate) unsafe fn can_be_emulated(
    next: &ash::Instance,
    api_version: u32,
    physical_device: vk::PhysicalDevice,
) -> bool {
    // SAFETY: the caller's promise.
    let (properties, extensions) = unsafe {
        let properties = next.get_physical_device_properties(physical_device);
        (properties, next.enumerate_device_extension_properties(physical_device).unwrap_or_default())
    };
    if api_version < vk::API_VERSION_1_3 || properties.api_version < vk::API_VERSION_1_3 {
        return false;
    }
    let has_it = extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(NAME));
    if has_it && !is_forced() {
        return false;
    }
    let mut vulkan_1_2 = vk::PhysicalDeviceVulkan12Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan_1_2);
    // SAFETY: the caller's promise.
    unsafe { next.get_physical_device_features2(physical_device, &mut features) };
    let limits = properties.limits;
    let mut subgroups = vk::PhysicalDeviceSubgroupProperties::default();
    let mut more = vk::PhysicalDeviceProperties2::default().push_next(&mut subgroups);
    // SAFETY: the caller's promise.
    unsafe { next.get_physical_device_properties2(physical_device, &mut more) };
    vulkan_1_2.buffer_device_address != vk::FALSE
        && subgroups.supported_operations.contains(vk::SubgroupFeatureFlags::VOTE)
        && subgroups.supported_stages.contains(vk::ShaderStageFlags::COMPUTE)
        && limits.max_compute_work_group_invocations >= 256
        && limits.max_compute_shared_memory_size >= 16384
        && limits.max_vertex_input_attributes >= 24
}

/// Reports whether a driver's own extension is hidden.
pub(crate) fn is_forced() -> bool {
    std::env::var_os("GAURAST_EMULATION_FORCE").is_some_and(|value| value == "1")
}

/// Fills in the extension's features. Vertex shaders project where they can store what they write.
pub(crate) fn answer_features(features: &mut Features<'_>, vertex_shaders_store: bool) {
    let (s_type, p_next) = (features.s_type, features.p_next);
    *features = Features::default()
        .gaussian_primitive_topology(true)
        .vertex_shader_projection(vertex_shaders_store)
        .radial_distance_order(true)
        .primitive_order(true)
        .opacity_compensation(true)
        .orthographic_camera(true)
        .fisheye_camera(true)
        .equirectangular_camera(true)
        .unscented_projection(true)
        .gaussian_2d(true)
        .uniform_buffer_camera(true)
        .merged_draws(true)
        .gaussian_instancing(true)
        .gaussian_depth_stencil(true)
        .gaussian_multisample(true)
        .resolve_fragment_shader(true)
        .resolve_gaussian_indices(true)
        .gaussian_approximation(true)
        .attribute_activation(true)
        .spherical_harmonics_buffer(true)
        .gaussian_dynamic_state(true)
        .gaussian_cut_off(true)
        .gaussian_distortion(true)
        .unscented_parameters(true)
        .gaussian_multiview(true)
        .opacity_compensation_floor(true)
        .attribute_decoding(true)
        .gaussian_2d_cut_off(true);
    (features.s_type, features.p_next) = (s_type, p_next);
}

/// Fills in the extension's properties.
pub(crate) fn answer_properties(properties: &mut Properties<'_>, limits: &vk::PhysicalDeviceLimits) {
    properties.tile_size = vk::Extent2D { width: 16, height: 16 };
    // Degree 4 takes 29 attributes.
    properties.max_spherical_harmonics_degree = if limits.max_vertex_input_attributes >= 29 { 4 } else { 3 };
    properties.gaussian_sample_counts = limits.framebuffer_color_sample_counts;
    properties.max_gaussians_per_draw = u64::from(MAX_GAUSSIANS);
    properties.max_gaussians_per_set = u64::from(MAX_GAUSSIANS);
}
