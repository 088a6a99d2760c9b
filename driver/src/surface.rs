//! Surfaces: the windows to which applications present, and their capabilities.

use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::abi::valid::{OutputChain, Structures};
use crate::physical_device::formats::{self, ImageQuery};
use crate::physical_device::limits;
use crate::window::{Canvas, CanvasOptions, NativeWindow, PresentMode, Window, WindowLost, window_system};
use ash::vk;
use std::ffi::{CStr, c_void};
use std::ptr::NonNull;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The extent of a surface whose size is that of its swapchain's images.
const OF_THE_SWAPCHAIN: vk::Extent2D = vk::Extent2D { width: u32::MAX, height: u32::MAX };

/// The formats of presented images: those that window systems accept without a conversion.
const FORMATS: [vk::SurfaceFormatKHR; 2] = [
    vk::SurfaceFormatKHR { format: vk::Format::B8G8R8A8_UNORM, color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR },
    vk::SurfaceFormatKHR { format: vk::Format::B8G8R8A8_SRGB, color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR },
];

/// A surface.
pub(crate) struct Surface {
    window: Box<dyn Window>,
    /// True if a swapchain presents to it that no other has replaced.
    is_taken: AtomicBool,
}

objects! { vk::SurfaceKHR => Surface; }

impl Surface {
    fn new(window: Box<dyn Window>) -> Arc<Self> {
        Arc::new(Self { window, is_taken: AtomicBool::new(false) })
    }

    /// Reserves it for a swapchain; only one at a time can have it.
    ///
    /// # Errors
    /// [`Error::NativeWindowInUse`].
    pub(crate) fn take(&self) -> Result<(), Error> {
        if self.is_taken.swap(true, Ordering::AcqRel) {
            return Err(Error::NativeWindowInUse);
        }
        Ok(())
    }

    /// Ends the reservation.
    pub(crate) fn give_back(&self) {
        self.is_taken.store(false, Ordering::Release);
    }

    /// The size of its window; `None` if it has the size of the presented images.
    ///
    /// # Errors
    /// [`Error::SurfaceLost`].
    pub(crate) fn extent(&self) -> Result<Option<[u32; 2]>, Error> {
        self.window.extent().map_err(Error::SurfaceLost)
    }

    /// Prepares the window for a swapchain's images.
    ///
    /// # Errors
    /// [`Error::SurfaceLost`], or [`Error::InvalidUsage`] for an unsupported present mode.
    pub(crate) fn canvas(
        &self,
        extent: vk::Extent2D,
        mode: vk::PresentModeKHR,
        alpha: vk::CompositeAlphaFlagsKHR,
    ) -> Result<(Box<dyn Canvas>, PresentMode), Error> {
        let modes = self.window.present_modes().iter();
        let found = modes.copied().find(|&found| present_mode(found) == mode);
        let present_mode = found.ok_or_else(|| {
            Error::usage(
                "VUID-VkSwapchainCreateInfoKHR-presentMode-01281",
                format!("the surface does not present by {mode:?}"),
            )
        })?;
        let canvas = self.window.canvas(CanvasOptions {
            extent: [extent.width, extent.height],
            present_mode,
            has_alpha: alpha.contains(vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED),
        });
        Ok((canvas.map_err(Error::SurfaceLost)?, present_mode))
    }

    fn capabilities(&self) -> Result<vk::SurfaceCapabilitiesKHR, Error> {
        let largest = limits::MAX_IMAGE_DIMENSION;
        let (current, min, max) = match self.extent()? {
            Some([width, height]) => {
                let extent = vk::Extent2D { width, height };
                (extent, extent, extent)
            }
            None => (
                OF_THE_SWAPCHAIN,
                vk::Extent2D { width: 1, height: 1 },
                vk::Extent2D { width: largest, height: largest },
            ),
        };
        let mut supported_composite_alpha = vk::CompositeAlphaFlagsKHR::OPAQUE | vk::CompositeAlphaFlagsKHR::INHERIT;
        if self.window.has_alpha() {
            supported_composite_alpha |= vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED;
        }
        Ok(vk::SurfaceCapabilitiesKHR {
            min_image_count: 2,
            max_image_count: 0,
            current_extent: current,
            min_image_extent: min,
            max_image_extent: max,
            max_image_array_layers: 1,
            supported_transforms: vk::SurfaceTransformFlagsKHR::IDENTITY,
            current_transform: vk::SurfaceTransformFlagsKHR::IDENTITY,
            supported_composite_alpha,
            supported_usage_flags: usages(),
        })
    }
}

/// The supported usages of images of the first format.
fn usages() -> vk::ImageUsageFlags {
    let all = [
        vk::ImageUsageFlags::TRANSFER_SRC,
        vk::ImageUsageFlags::TRANSFER_DST,
        vk::ImageUsageFlags::SAMPLED,
        vk::ImageUsageFlags::STORAGE,
        vk::ImageUsageFlags::COLOR_ATTACHMENT,
        vk::ImageUsageFlags::INPUT_ATTACHMENT,
    ];
    let is_supported = |usage: &vk::ImageUsageFlags| {
        formats::image_properties(ImageQuery {
            format: FORMATS[0].format,
            ty: vk::ImageType::TYPE_2D,
            tiling: vk::ImageTiling::OPTIMAL,
            usage: *usage,
            flags: vk::ImageCreateFlags::empty(),
        })
        .is_ok()
    };
    let supported = all.into_iter().filter(is_supported);
    supported.fold(vk::ImageUsageFlags::empty(), |all, usage| all | usage)
}

fn present_mode(mode: PresentMode) -> vk::PresentModeKHR {
    match mode {
        PresentMode::Immediate => vk::PresentModeKHR::IMMEDIATE,
        PresentMode::Mailbox => vk::PresentModeKHR::MAILBOX,
        PresentMode::Fifo => vk::PresentModeKHR::FIFO,
    }
}

/// The window of a headless surface: nothing is visible, and every image is accepted at once.
struct Headless;

impl Window for Headless {
    fn extent(&self) -> Result<Option<[u32; 2]>, WindowLost> {
        Ok(None)
    }

    fn present_modes(&self) -> &'static [PresentMode] {
        &[PresentMode::Fifo, PresentMode::Mailbox, PresentMode::Immediate]
    }

    fn has_alpha(&self) -> bool {
        true
    }

    fn canvas(&self, _options: CanvasOptions) -> Result<Box<dyn Canvas>, WindowLost> {
        Ok(Box::new(Self))
    }
}

impl Canvas for Headless {
    fn wait(&mut self, _longest: Duration) -> Result<bool, WindowLost> {
        Ok(true)
    }

    fn show(&mut self, _copy: &mut dyn FnMut(&mut [u8])) -> Result<(), WindowLost> {
        Ok(())
    }
}

#[doc(alias = "vkCreateHeadlessSurfaceEXT")]
pub(crate) fn create_headless_surface() -> Result<Arc<Surface>, Error> {
    Ok(Surface::new(Box::new(Headless)))
}

/// A surface of a window.
///
/// # Safety
/// The window's pointers are live until the surface and its swapchains are destroyed.
unsafe fn create_surface(extension: &CStr, window: NativeWindow) -> Result<Arc<Surface>, Error> {
    let system =
        window_system(extension).ok_or_else(|| Error::ExtensionNotPresent(extension.to_string_lossy().into_owned()))?;
    // SAFETY: the caller's promise.
    let window = unsafe { system.open(window) }.map_err(Error::SurfaceLost)?;
    Ok(Surface::new(window))
}

fn not_null(pointer: *mut c_void, what: &'static str) -> Result<NonNull<c_void>, Error> {
    NonNull::new(pointer).ok_or(Error::NullPointer { what })
}

/// # Safety
/// The connection is live until the surface and its swapchains are destroyed.
#[doc(alias = "vkCreateXcbSurfaceKHR")]
pub(crate) unsafe fn create_xcb_surface(create_info: &vk::XcbSurfaceCreateInfoKHR<'_>) -> Result<Arc<Surface>, Error> {
    let window = NativeWindow::Xcb {
        connection: not_null(create_info.connection, "xcb_connection_t")?,
        window: create_info.window,
    };
    // SAFETY: the caller's promise.
    unsafe { create_surface(ash::khr::xcb_surface::NAME, window) }
}

/// # Safety
/// The display is open until the surface and its swapchains are destroyed.
#[doc(alias = "vkCreateXlibSurfaceKHR")]
pub(crate) unsafe fn create_xlib_surface(
    create_info: &vk::XlibSurfaceCreateInfoKHR<'_>,
) -> Result<Arc<Surface>, Error> {
    let window = NativeWindow::Xlib {
        display: not_null(create_info.dpy, "Display")?,
        // Window ids have 29 bits, whatever the width of their type.
        window: create_info.window as u32,
    };
    // SAFETY: the caller's promise.
    unsafe { create_surface(ash::khr::xlib_surface::NAME, window) }
}

/// # Safety
/// The display and the surface are live until the surface and its swapchains are destroyed.
#[doc(alias = "vkCreateWaylandSurfaceKHR")]
pub(crate) unsafe fn create_wayland_surface(
    create_info: &vk::WaylandSurfaceCreateInfoKHR<'_>,
) -> Result<Arc<Surface>, Error> {
    let window = NativeWindow::Wayland {
        display: not_null(create_info.display, "wl_display")?,
        surface: not_null(create_info.surface, "wl_surface")?,
    };
    // SAFETY: the caller's promise.
    unsafe { create_surface(ash::khr::wayland_surface::NAME, window) }
}

/// Returns true: presentation copies images to windows, which any queue can do.
#[doc(alias = "vkGetPhysicalDeviceSurfaceSupportKHR")]
pub(crate) fn get_physical_device_surface_support(_surface: &Surface) -> Result<vk::Bool32, Error> {
    Ok(vk::TRUE)
}

/// Returns true: any window can be presented to. A window's depth is checked when its surface is used.
#[doc(alias = "vkGetPhysicalDeviceXcbPresentationSupportKHR")]
#[doc(alias = "vkGetPhysicalDeviceXlibPresentationSupportKHR")]
#[doc(alias = "vkGetPhysicalDeviceWaylandPresentationSupportKHR")]
pub(crate) fn get_physical_device_presentation_support(_queue_family_index: u32) -> Result<vk::Bool32, Error> {
    Ok(vk::TRUE)
}

#[doc(alias = "vkGetPhysicalDeviceSurfaceCapabilitiesKHR")]
pub(crate) fn get_physical_device_surface_capabilities(surface: &Surface) -> Result<vk::SurfaceCapabilitiesKHR, Error> {
    surface.capabilities()
}

#[doc(alias = "vkGetPhysicalDeviceSurfaceCapabilities2KHR")]
pub(crate) fn get_physical_device_surface_capabilities2(
    surface: &Surface,
    mut surface_capabilities: OutputChain<'_, vk::SurfaceCapabilities2KHR<'_>>,
) -> Result<(), Error> {
    surface_capabilities.surface_capabilities = surface.capabilities()?;
    surface_capabilities.for_each_chained(|mut chained| {
        if let Some(protected) = chained.cast::<vk::SurfaceProtectedCapabilitiesKHR<'_>>() {
            protected.supports_protected = vk::FALSE;
        }
    });
    Ok(())
}

#[doc(alias = "vkGetPhysicalDeviceSurfaceFormatsKHR")]
pub(crate) fn get_physical_device_surface_formats(
    _surface: &Surface,
) -> Result<[vk::SurfaceFormatKHR; FORMATS.len()], Error> {
    Ok(FORMATS)
}

#[doc(alias = "vkGetPhysicalDeviceSurfaceFormats2KHR")]
pub(crate) fn get_physical_device_surface_formats2(
    surface_formats: Structures<'_, vk::SurfaceFormat2KHR<'_>>,
) -> Result<vk::Result, Error> {
    surface_formats.fill(FORMATS.len(), |index, format| {
        format.surface_format = FORMATS[index];
    })
}

#[doc(alias = "vkGetPhysicalDeviceSurfacePresentModesKHR")]
pub(crate) fn get_physical_device_surface_present_modes(surface: &Surface) -> Result<Vec<vk::PresentModeKHR>, Error> {
    let modes = surface.window.present_modes().iter();
    Ok(modes.copied().map(present_mode).collect())
}

/// Returns one rectangle, the whole window.
#[doc(alias = "vkGetPhysicalDevicePresentRectanglesKHR")]
pub(crate) fn get_physical_device_present_rectangles(surface: &Surface) -> Result<Vec<vk::Rect2D>, Error> {
    Ok(vec![vk::Rect2D { offset: vk::Offset2D::default(), extent: surface.capabilities()?.current_extent }])
}

/// Returns that the group's only device presents its own images.
#[doc(alias = "vkGetDeviceGroupSurfacePresentModesKHR")]
pub(crate) fn get_device_group_surface_present_modes(
    _surface: &Surface,
) -> Result<vk::DeviceGroupPresentModeFlagsKHR, Error> {
    Ok(vk::DeviceGroupPresentModeFlagsKHR::LOCAL)
}

/// As [`get_device_group_surface_present_modes`].
#[doc(alias = "vkGetDeviceGroupPresentCapabilitiesKHR")]
pub(crate) fn get_device_group_present_capabilities(
    device_group_present_capabilities: &mut vk::DeviceGroupPresentCapabilitiesKHR<'_>,
) -> Result<(), Error> {
    let out = device_group_present_capabilities;
    out.present_mask = [0; vk::MAX_DEVICE_GROUP_SIZE];
    out.present_mask[0] = 1;
    out.modes = vk::DeviceGroupPresentModeFlagsKHR::LOCAL;
    Ok(())
}
