//! Features: what an application may enable of them.

use crate::error::Error;
use crate::pnext;
use crate::registry::features::{Features, SUPPORTED, extension_of};
use ash::vk;
use std::ffi::CStr;

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
) -> Result<Features, Error> {
    let mut enabled = Features::NONE;
    // SAFETY: the pointer is null or valid in a valid creation info.
    if let Some(features) = unsafe { info.p_enabled_features.as_ref() } {
        enabled.add_core(features);
        require_supported(&enabled)?;
    }
    // SAFETY: the chain of a valid creation info is valid.
    for structure in unsafe { pnext::iter(info.p_next) } {
        if let Some(features) = pnext::cast::<vk::PhysicalDeviceFeatures2<'_>>(structure) {
            enabled.add_core(&features.features);
        } else {
            require_extension(structure, extensions)?;
            enabled.add(structure);
        }
        require_supported(&enabled)?;
    }
    Ok(enabled)
}

/// Refuses features that don't work.
fn require_supported(requested: &Features) -> Result<(), Error> {
    let supported = SUPPORTED.list();
    match requested
        .list()
        .into_iter()
        .zip(supported)
        .find(|((_, is_requested), (_, works))| *is_requested && !works)
    {
        None => Ok(()),
        Some(((name, _), _)) => Err(Error::FeatureNotPresent(format!("the feature {name}"))),
    }
}

/// Refuses features of an extension that isn't enabled.
fn require_extension(
    structure: &vk::BaseInStructure<'_>,
    extensions: &[&CStr],
) -> Result<(), Error> {
    let Some(needed) = extension_of(structure.s_type).filter(|name| !extensions.contains(name))
    else {
        return Ok(());
    };
    let mut requested = Features::NONE;
    requested.add(structure);
    match requested.list().into_iter().find(|(_, is_on)| *is_on) {
        None => Ok(()),
        Some((feature, _)) => Err(Error::usage(
            "VUID-VkDeviceCreateInfo-pNext-extension",
            format!("the feature {feature} needs {needed:?}, which is not enabled"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::features::MANDATORY;
    use gaurast::gaussian_primitive_topology;
    use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST;
    use std::collections::HashMap;

    /// Features that Vulkan 1.3 requires of an implementation and that don't work yet; `driver/support.toml` says why.
    const REQUIRED_BUT_MISSING: &[&str] = &[
        "buffer_device_address",
        "inline_uniform_block",
        "multiview",
        "pipeline_creation_cache_control",
        "shader_integer_dot_product",
    ];

    /// Counts the features that work of a structure.
    fn count<T: vk::TaggedStructure + Default>() -> usize {
        let mut structure = T::default();
        let first = (&raw mut structure).cast();
        let mut features = Features::NONE;
        // SAFETY: the structure is alone in its chain.
        unsafe {
            pnext::for_each_output(first, |out| SUPPORTED.write(out));
            pnext::iter(first.cast_const()).for_each(|structure| features.add(structure));
        }
        count_of(&features)
    }

    fn count_of(features: &Features) -> usize {
        features.list().iter().filter(|(_, is_on)| *is_on).count()
    }

    #[test]
    fn supported_features_are_those_of_the_structures() {
        let mut core = Features::NONE;
        core.add_core(&SUPPORTED.core());
        let counts = [
            count_of(&core),
            count::<vk::PhysicalDeviceVulkan11Features<'_>>(),
            count::<vk::PhysicalDeviceVulkan12Features<'_>>(),
            count::<vk::PhysicalDeviceVulkan13Features<'_>>(),
            count::<vk::PhysicalDevicePerformanceQueryFeaturesKHR<'_>>(),
            count::<vk::PhysicalDeviceIndexTypeUint8FeaturesKHR<'_>>(),
            count::<vk::PhysicalDeviceProvokingVertexFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR<'_>>(),
            count::<PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_>>(),
        ];
        assert_eq!(counts, [37, 4, 32, 10, 1, 1, 1, 2, 19]);
        assert_eq!(count_of(&SUPPORTED), counts.iter().sum::<usize>());
    }

    #[test]
    fn missing_features_are_listed_truly() {
        let supported: HashMap<_, _> = SUPPORTED.list().into_iter().collect();
        let mut missing: Vec<_> = MANDATORY
            .iter()
            .flat_map(|(_, names)| names.iter().copied())
            .filter(|name| !supported[name])
            .collect();
        missing.sort_unstable();
        assert_eq!(missing, REQUIRED_BUT_MISSING);
    }

    #[test]
    fn requests_are_checked_wherever_they_stand() {
        let request = |info: &vk::DeviceCreateInfo<'_>| {
            // SAFETY: ash built the creation info.
            unsafe { requested(info, &[gaussian_primitive_topology::NAME]) }
        };
        let mut works = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        let core = vk::PhysicalDeviceFeatures::default().robust_buffer_access(true);
        let info = vk::DeviceCreateInfo::default()
            .enabled_features(&core)
            .push_next(&mut works);
        let enabled = request(&info).unwrap();
        assert!(enabled.dynamic_rendering && enabled.robust_buffer_access);
        assert!(!enabled.synchronization2);

        let refused = |result: Result<Features, Error>, name: &str| {
            let error = result.unwrap_err();
            assert_eq!(error.result(), vk::Result::ERROR_FEATURE_NOT_PRESENT);
            assert!(error.to_string().contains(name), "{error}");
        };
        let core = vk::PhysicalDeviceFeatures::default().geometry_shader(true);
        refused(
            request(&vk::DeviceCreateInfo::default().enabled_features(&core)),
            "geometry_shader",
        );
        let mut core = vk::PhysicalDeviceFeatures2::default();
        core.features.sparse_binding = vk::TRUE;
        refused(
            request(&vk::DeviceCreateInfo::default().push_next(&mut core)),
            "sparse_binding",
        );
        let mut missing = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .inline_uniform_block(true);
        refused(
            request(&vk::DeviceCreateInfo::default().push_next(&mut missing)),
            "inline_uniform_block",
        );

        let mut other = vk::PhysicalDevicePerformanceQueryFeaturesKHR::default()
            .performance_counter_query_pools(true);
        let error = request(&vk::DeviceCreateInfo::default().push_next(&mut other)).unwrap_err();
        assert!(error.is_usage(), "{error}");
    }
}
