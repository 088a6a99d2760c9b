//! The errors of commands, and their conversion to a `VkResult`, which happens only here.

use crate::window::WindowLost;
use ash::vk;
use std::borrow::Cow;

/// The reason that a command failed. The message goes to `log` and to the instance's listeners; the application
/// receives [`Error::result`].
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum Error {
    /// A handle that is null, destroyed or of another type.
    #[error("{raw:#x} is not a valid handle of type {expected:?}")]
    InvalidHandle {
        /// The type that was expected.
        expected: vk::ObjectType,
        /// The handle that was given.
        raw: u64,
    },
    /// A null pointer where Vulkan requires a valid one.
    #[error("a required pointer to {} is null", vulkan_type(what))]
    NullPointer {
        /// The type pointed at, as Rust names it, or the parameter.
        what: &'static str,
    },
    /// A command that this driver doesn't execute.
    #[error("this driver does not support {command} yet")]
    Unsupported {
        /// Its Vulkan name.
        command: String,
    },
    /// The device has no memory for an object.
    #[error("out of device memory: {0}")]
    OutOfDeviceMemory(String),
    /// The host has no memory for an object.
    #[error("out of host memory: {0}")]
    OutOfHostMemory(String),
    /// A descriptor pool has too few sets or descriptors left.
    #[error("out of pool memory: {0}")]
    OutOfPoolMemory(String),
    /// A shader that is malformed, or that needs a feature that the device lacks.
    #[error("invalid shader: {0}")]
    InvalidShader(String),
    /// An object could not be created.
    #[error("{0}")]
    InitializationFailed(String),
    /// The device is lost: a shader ran for too long, memory is lacking, or a command cannot be executed.
    #[error("the device is lost: {0}")]
    DeviceLost(String),
    /// The device is lost by a defect of the driver: a submission panicked.
    #[error("the device is lost by a defect in the driver: {0}")]
    DeviceLostByDefect(String),
    /// A window to which pictures can no longer be presented.
    #[error(transparent)]
    SurfaceLost(WindowLost),
    /// A window to which another swapchain presents.
    #[error("another swapchain presents to the window")]
    NativeWindowInUse,
    /// Memory that can't be mapped.
    #[error("memory cannot be mapped: {0}")]
    MemoryMapFailed(String),
    /// A handle of another process, device or host that can't be imported.
    #[error("{0}")]
    InvalidExternalHandle(String),
    /// The process has no file descriptor left.
    #[error("no file descriptor is left: {0}")]
    TooManyObjects(String),
    /// A trace of work that could not be written.
    #[error("{0}")]
    TraceNotWritten(String),
    /// An unknown layer.
    #[error("there is no layer {0}")]
    LayerNotPresent(String),
    /// An unknown extension.
    #[error("there is no extension {0}")]
    ExtensionNotPresent(String),
    /// A feature that isn't supported.
    #[error("{0} is not supported")]
    FeatureNotPresent(String),
    /// A mode of the extension whose feature is not enabled, or not supported by this device.
    #[error("{message} ({vuid})")]
    FeatureNotEnabled {
        /// The rule's id.
        vuid: &'static str,
        /// The mode, as the text of the message.
        message: String,
    },
    /// A format, or a use of it, that isn't supported.
    #[error("{0}")]
    FormatNotSupported(String),
    /// The application breaks a rule of the extension or of Vulkan that the driver must check itself.
    #[error("{message} ({vuid})")]
    InvalidUsage {
        /// The rule's id: Vulkan's, the extension's, or the driver's own where those have none.
        vuid: Cow<'static, str>,
        /// The fault, with the values that are wrong.
        message: String,
    },
    /// A defect of the driver: it panicked.
    #[error("defect in the driver: {0}")]
    Panic(String),
}

impl Error {
    /// The error of a rule that the application breaks.
    pub(crate) fn usage(vuid: impl Into<Cow<'static, str>>, message: impl Into<String>) -> Self {
        Self::InvalidUsage { vuid: vuid.into(), message: message.into() }
    }

    /// The result that the application receives.
    pub(crate) fn result(&self) -> vk::Result {
        match self {
            Self::InvalidHandle { .. } | Self::TraceNotWritten(_) | Self::Panic(_) => vk::Result::ERROR_UNKNOWN,
            Self::Unsupported { .. } | Self::FeatureNotPresent(_) | Self::FeatureNotEnabled { .. } => {
                vk::Result::ERROR_FEATURE_NOT_PRESENT
            }
            Self::OutOfHostMemory(_) => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
            Self::OutOfDeviceMemory(_) => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
            Self::OutOfPoolMemory(_) => vk::Result::ERROR_OUT_OF_POOL_MEMORY,
            Self::InvalidShader(_) => vk::Result::ERROR_INVALID_SHADER_NV,
            Self::InitializationFailed(_) => vk::Result::ERROR_INITIALIZATION_FAILED,
            Self::DeviceLost(_) | Self::DeviceLostByDefect(_) => vk::Result::ERROR_DEVICE_LOST,
            Self::SurfaceLost(_) => vk::Result::ERROR_SURFACE_LOST_KHR,
            Self::NativeWindowInUse => vk::Result::ERROR_NATIVE_WINDOW_IN_USE_KHR,
            Self::MemoryMapFailed(_) => vk::Result::ERROR_MEMORY_MAP_FAILED,
            Self::InvalidExternalHandle(_) => vk::Result::ERROR_INVALID_EXTERNAL_HANDLE,
            Self::TooManyObjects(_) => vk::Result::ERROR_TOO_MANY_OBJECTS,
            Self::LayerNotPresent(_) => vk::Result::ERROR_LAYER_NOT_PRESENT,
            Self::ExtensionNotPresent(_) => vk::Result::ERROR_EXTENSION_NOT_PRESENT,
            Self::FormatNotSupported(_) => vk::Result::ERROR_FORMAT_NOT_SUPPORTED,
            Self::InvalidUsage { .. } | Self::NullPointer { .. } => vk::Result::ERROR_VALIDATION_FAILED_EXT,
        }
    }

    /// The message id that debug messengers show.
    pub(crate) fn message_id(&self) -> &str {
        match self {
            Self::InvalidUsage { vuid, .. } => vuid,
            Self::FeatureNotEnabled { vuid, .. } => vuid,
            Self::InvalidHandle { .. } => "GAURAST-invalid-handle",
            Self::NullPointer { .. } => "GAURAST-null-pointer",
            Self::Unsupported { .. } => "GAURAST-unsupported-command",
            Self::InvalidShader(_) => "GAURAST-invalid-shader",
            Self::InvalidExternalHandle(_) => "GAURAST-invalid-external-handle",
            Self::DeviceLost(_) => "GAURAST-device-lost",
            Self::Panic(_) | Self::DeviceLostByDefect(_) => "GAURAST-driver-defect",
            _ => "GAURAST-error",
        }
    }

    /// Reports whether the application's usage is at fault, not the driver or the machine.
    pub(crate) fn is_usage(&self) -> bool {
        matches!(
            self,
            Self::InvalidUsage { .. }
                | Self::FeatureNotEnabled { .. }
                | Self::InvalidHandle { .. }
                | Self::NullPointer { .. }
        )
    }
}

/// Vulkan's name of a type that Rust names by its path; other names stay as they are.
fn vulkan_type(name: &str) -> String {
    let path = name.split('<').next().unwrap_or(name);
    match path.rsplit_once("::") {
        Some((_, own)) => format!("Vk{own}"),
        None => path.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaurast::vk::GaussianCameraGAURAST;

    #[test]
    fn a_null_pointer_is_named_as_vulkan_names_it() {
        for (what, name) in [
            (std::any::type_name::<GaussianCameraGAURAST<'_>>(), "VkGaussianCameraGAURAST"),
            (std::any::type_name::<vk::BufferCopy>(), "VkBufferCopy"),
            ("pName", "pName"),
        ] {
            let error = Error::NullPointer { what };
            assert_eq!(error.to_string(), format!("a required pointer to {name} is null"));
            assert_eq!(error.result(), vk::Result::ERROR_VALIDATION_FAILED_EXT);
        }
    }
}
