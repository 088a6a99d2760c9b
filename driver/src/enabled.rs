//! The features and extensions that an application enabled, and the use of what it did not enable.
//!
//! A device can do what it supports whether or not the application asked for it, and every driver does it. Therefore such
//! a use is one warning; to find it is the business of validation layers. Under `GAURAST_STRICT` it is an error.

use crate::abi::error::Error;
use crate::abi::handle::Reporter;
use crate::abi::valid;
use crate::registry::features::{Features, SUPPORTED, extensions_of};
use ash::vk;
use std::collections::HashSet;
use std::ffi::CStr;
use std::sync::{Arc, Mutex, PoisonError};

/// The features and extensions that an application enabled on a device, and the answer to uses of others.
pub(crate) struct Enabled {
    features: Features,
    extensions: Vec<&'static CStr>,
    is_strict: bool,
    /// The warnings that were given.
    warned: Mutex<HashSet<String>>,
    reporter: Arc<dyn Reporter + Send + Sync>,
}

impl std::fmt::Debug for Enabled {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Enabled").field("is_strict", &self.is_strict).finish_non_exhaustive()
    }
}

impl Enabled {
    /// Extensions without features. Warnings go to `reporter`; uses are errors instead if `is_strict`.
    pub(crate) fn new(
        extensions: Vec<&'static CStr>,
        is_strict: bool,
        reporter: Arc<dyn Reporter + Send + Sync>,
    ) -> Self {
        Self { features: Features::NONE, extensions, is_strict, warned: Mutex::default(), reporter }
    }

    /// Enables the features of a creation info.
    ///
    /// # Errors
    /// [`Error::FeatureNotPresent`] names the first feature that isn't supported. A feature whose extension isn't
    /// enabled is a use of what is not enabled.
    ///
    /// # Safety
    /// The creation info is valid.
    pub(crate) unsafe fn enable_features(&mut self, info: &vk::DeviceCreateInfo<'_>) -> Result<(), Error> {
        // SAFETY: the pointer is null or valid in a valid creation info.
        if let Some(features) = unsafe { info.p_enabled_features.as_ref() } {
            self.features.add_core(features);
            require_supported(&self.features)?;
        }
        // SAFETY: the chain of a valid creation info is valid.
        for structure in unsafe { valid::chain(info.p_next) } {
            if let Some(features) = valid::cast::<vk::PhysicalDeviceFeatures2<'_>>(structure) {
                self.features.add_core(&features.features);
            } else {
                self.require_extension(structure)?;
                self.features.add(structure);
            }
            require_supported(&self.features)?;
        }
        Ok(())
    }

    /// The features.
    pub(crate) fn features(&self) -> &Features {
        &self.features
    }

    /// The extensions.
    pub(crate) fn extensions(&self) -> &[&'static CStr] {
        &self.extensions
    }

    /// Fails, or warns, unless what is used is enabled. The device supports it.
    ///
    /// # Errors
    /// As [`Enabled::tolerate`].
    pub(crate) fn require(&self, is_enabled: bool, error: impl FnOnce() -> Error) -> Result<(), Error> {
        if is_enabled { Ok(()) } else { self.tolerate(error()) }
    }

    /// Warns once of a use that breaks a rule and that the device can do.
    ///
    /// # Errors
    /// The error, if the device is strict.
    pub(crate) fn tolerate(&self, error: Error) -> Result<(), Error> {
        if self.is_strict {
            return Err(error);
        }
        let is_new = self.warned.lock().unwrap_or_else(PoisonError::into_inner).insert(error.to_string());
        if is_new {
            log::warn!("{error}: the device does it all the same");
            self.reporter.report_warning(&error);
        }
        Ok(())
    }

    /// Requires an extension of a structure of features, if one of them is asked for.
    fn require_extension(&self, structure: &vk::BaseInStructure<'_>) -> Result<(), Error> {
        let needed = extensions_of(structure.s_type);
        if needed.is_empty() || needed.iter().any(|name| self.extensions.contains(name)) {
            return Ok(());
        }
        let mut requested = Features::NONE;
        requested.add(structure);
        require_supported(&requested)?;
        match requested.list().find(|(_, is_on)| *is_on) {
            None => Ok(()),
            Some((feature, _)) => self.tolerate(Error::usage(
                "VUID-VkDeviceCreateInfo-pNext-pNext",
                format!(
                    "the feature {feature} needs {}, which is not enabled",
                    needed.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(" or ")
                ),
            )),
        }
    }
}

/// Refuses features that are not supported.
fn require_supported(requested: &Features) -> Result<(), Error> {
    match requested.list().zip(SUPPORTED.list()).find(|((_, is_requested), (_, works))| *is_requested && !works) {
        None => Ok(()),
        Some(((name, _), _)) => Err(Error::FeatureNotPresent(format!("the feature {name}"))),
    }
}

#[cfg(test)]
impl Enabled {
    /// Nothing, on a strict device.
    pub(crate) fn strict() -> Self {
        Self::new(Vec::new(), true, Arc::new(tests::Heard::default()))
    }

    /// Features and extensions, on a strict device.
    pub(crate) fn strict_with(features: Features, extensions: &[&'static CStr]) -> Self {
        Self { features, extensions: extensions.to_vec(), ..Self::strict() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaurast::gaussian_primitive_topology;

    /// A listener that keeps the ids of warnings.
    #[derive(Default)]
    pub(super) struct Heard(Mutex<Vec<String>>);

    impl Reporter for Heard {
        fn report_error(&self, _: &str, _: &Error) {}

        fn report_warning(&self, error: &Error) {
            self.0.lock().unwrap().push(error.message_id().to_owned());
        }
    }

    fn enabled(is_strict: bool) -> (Enabled, Arc<Heard>) {
        let heard = Arc::new(Heard::default());
        (Enabled::new(vec![gaussian_primitive_topology::NAME], is_strict, Arc::clone(&heard) as _), heard)
    }

    /// The features that a request enables on a strict device.
    fn request(info: &vk::DeviceCreateInfo<'_>) -> Result<Features, Error> {
        let (mut enabled, _) = enabled(true);
        // SAFETY: ash built the creation info.
        unsafe { enabled.enable_features(info)? };
        Ok(enabled.features)
    }

    #[test]
    fn requests_are_checked_wherever_they_stand() {
        let mut works = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        let core = vk::PhysicalDeviceFeatures::default().robust_buffer_access(true);
        let info = vk::DeviceCreateInfo::default().enabled_features(&core).push_next(&mut works);
        let enabled = request(&info).unwrap();
        assert!(enabled.dynamic_rendering && enabled.robust_buffer_access);
        assert!(!enabled.synchronization2);

        let refused = |result: Result<Features, Error>, name: &str| {
            let error = result.unwrap_err();
            assert_eq!(error.result(), vk::Result::ERROR_FEATURE_NOT_PRESENT);
            assert!(error.to_string().contains(name), "{error}");
        };
        let core = vk::PhysicalDeviceFeatures::default().sparse_residency_buffer(true);
        refused(request(&vk::DeviceCreateInfo::default().enabled_features(&core)), "sparseResidencyBuffer");
        let mut core = vk::PhysicalDeviceFeatures2::default();
        core.features.sparse_binding = vk::TRUE;
        refused(request(&vk::DeviceCreateInfo::default().push_next(&mut core)), "sparseBinding");
        let mut missing =
            vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).texture_compression_astc_hdr(true);
        refused(request(&vk::DeviceCreateInfo::default().push_next(&mut missing)), "textureCompressionASTC_HDR");

        let mut other = vk::PhysicalDevicePerformanceQueryFeaturesKHR::default().performance_counter_query_pools(true);
        let error = request(&vk::DeviceCreateInfo::default().push_next(&mut other)).unwrap_err();
        assert!(error.is_usage(), "{error}");
    }

    #[test]
    fn what_is_not_enabled_is_one_warning() {
        let (mut enabled, heard) = enabled(false);
        let mut other = vk::PhysicalDevicePerformanceQueryFeaturesKHR::default().performance_counter_query_pools(true);
        let info = vk::DeviceCreateInfo::default().push_next(&mut other);
        for _ in 0..2 {
            // SAFETY: ash built the creation info.
            unsafe { enabled.enable_features(&info).unwrap() };
        }
        assert!(enabled.features.performance_counter_query_pools);
        assert_eq!(*heard.0.lock().unwrap(), ["VUID-VkDeviceCreateInfo-pNext-pNext"]);
        for text in ["one", "one", "other"] {
            enabled.require(false, || Error::usage("VUID-VkDeviceCreateInfo-pNext-pNext", text)).unwrap();
        }
        enabled.require(true, || unreachable!()).unwrap();
        assert_eq!(heard.0.lock().unwrap().len(), 3);
    }
}
