//! Errors of rendering.

use ash::vk;
use gaurast_scene::camera::CameraError;
use thiserror::Error;

use crate::options::take_error;

/// The reason that rendering failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A Vulkan call failed.
    #[error("{}", message.clone().unwrap_or_else(|| format!("{call} failed: {result}")))]
    Vulkan {
        /// The call.
        call: &'static str,
        /// Its result.
        result: vk::Result,
        /// The driver's reason, if it gave one.
        message: Option<String>,
    },
    /// No device draws Gaussians.
    #[error("no Vulkan device draws Gaussians (there is {found})")]
    NoDevice {
        /// The names of the devices that were found.
        found: String,
    },
    /// No device has the requested name.
    #[error("no Vulkan device has \"{name}\" in its name and Vulkan 1.3 (there is {found})")]
    NoSuchDevice {
        /// The requested part of a name.
        name: String,
        /// The names of the devices that were found.
        found: String,
    },
    /// No memory type has the required properties.
    #[error("the device has no {0} memory for a resource")]
    NoMemory(&'static str),
    /// The picture is too large or empty.
    #[error("a picture of {width}x{height} pixels is not within the device's 1x1 to {max}x{max}")]
    Size {
        /// The width in pixels.
        width: u32,
        /// The height in pixels.
        height: u32,
        /// The greatest width and height.
        max: u32,
    },
    /// The scene has more Gaussians than one draw takes.
    #[error("the scene has {count} Gaussians, and the device draws at most {max} at once")]
    TooMany {
        /// The scene's Gaussians.
        count: u64,
        /// The most in a draw.
        max: u64,
    },
    /// The camera is invalid.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The device doesn't support this combination of modes.
    #[error("{0}")]
    Combination(&'static str),
}

/// Names the call that a Vulkan error came from.
pub trait During<T> {
    /// Returns the value, or the error with the name of the `call` that failed.
    ///
    /// # Errors
    /// Returns an error if the call failed.
    fn during(self, call: &'static str) -> Result<T, RenderError>;
}

impl<T> During<T> for ash::prelude::VkResult<T> {
    fn during(self, call: &'static str) -> Result<T, RenderError> {
        // A message about an earlier call isn't this call's.
        let message = take_error();
        self.map_err(|result| RenderError::Vulkan { call, result, message })
    }
}
