//! Windows of the host's window systems, as the driver wants them: what shows a picture there is given to the driver, so
//! that it can be had without the libraries of any. `driver/window` has X11 and Wayland.

use std::ffi::{CStr, c_void};
use std::ptr::NonNull;
use std::sync::OnceLock;
use std::time::Duration;

/// A window, as an application names it to Vulkan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NativeWindow {
    /// A window of X11 over libxcb.
    Xcb {
        /// The `xcb_connection_t`.
        connection: NonNull<c_void>,
        /// The window's id.
        window: u32,
    },
    /// A window of X11 over Xlib.
    Xlib {
        /// The `Display`.
        display: NonNull<c_void>,
        /// The window's id.
        window: u32,
    },
    /// A surface of Wayland.
    Wayland {
        /// The `wl_display`.
        display: NonNull<c_void>,
        /// The `wl_surface`.
        surface: NonNull<c_void>,
    },
}

/// A window system: opens the windows of one of Vulkan's extensions of surfaces.
pub trait WindowSystem: Sync {
    /// The instance extension whose surfaces it opens.
    fn extension(&self) -> &'static CStr;

    /// Opens a window.
    ///
    /// # Errors
    /// [`WindowLost`] if it can't be shown to, or is of another window system.
    ///
    /// # Safety
    /// The window's pointers are what they are said to be, and stay so until what is returned and all made of it are
    /// dropped.
    unsafe fn open(&self, window: NativeWindow) -> Result<Box<dyn Window>, WindowLost>;
}

/// A window that cannot be shown to: it was closed, or its server is gone. The text says what happened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the window is lost: {0}")]
pub struct WindowLost(pub String);

/// A window to which pictures are shown.
pub trait Window: Send + Sync {
    /// Its width and height in pixels now; `None` where a window gets the size of the pictures that it is shown.
    ///
    /// # Errors
    /// [`WindowLost`].
    fn extent(&self) -> Result<Option<[u32; 2]>, WindowLost>;

    /// The ways in which pictures are shown to it.
    fn present_modes(&self) -> &'static [PresentMode];

    /// Tells if what is behind it can be seen through pictures with an alpha below 1.
    fn has_alpha(&self) -> bool;

    /// Prepares for pictures of one size.
    ///
    /// # Errors
    /// [`WindowLost`].
    fn canvas(&self, options: CanvasOptions) -> Result<Box<dyn Canvas>, WindowLost>;
}

/// A way in which pictures are shown: one of `VkPresentModeKHR`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresentMode {
    /// Each at once.
    Immediate,
    /// The newest at each refresh of the display.
    Mailbox,
    /// One at each refresh of the display, in order.
    Fifo,
}

/// The pictures that a window will be shown.
#[derive(Clone, Copy, Debug)]
pub struct CanvasOptions {
    /// Their width and height in pixels.
    pub extent: [u32; 2],
    /// How they are shown.
    pub present_mode: PresentMode,
    /// Alpha counts: colours are premultiplied with it.
    pub has_alpha: bool,
}

/// A window's place for pictures of one size. It is used on a thread of its own.
pub trait Canvas: Send {
    /// Waits until the display takes the next picture, at most for `longest`; tells if it does. Of mode
    /// [`PresentMode::Immediate`] it always does.
    ///
    /// # Errors
    /// [`WindowLost`].
    fn wait(&mut self, longest: Duration) -> Result<bool, WindowLost>;

    /// Shows a picture, which `copy` writes: rows without gaps from the top, a pixel's blue, green, red and alpha a byte each.
    ///
    /// # Errors
    /// [`WindowLost`].
    fn show(&mut self, copy: &mut dyn FnMut(&mut [u8])) -> Result<(), WindowLost>;
}

/// The extensions of surfaces that are there if a window system is given that opens them.
const OF_WINDOW_SYSTEMS: [&CStr; 3] = [
    ash::khr::wayland_surface::NAME,
    ash::khr::xcb_surface::NAME,
    ash::khr::xlib_surface::NAME,
];

static WINDOW_SYSTEMS: OnceLock<&[&dyn WindowSystem]> = OnceLock::new();

/// Gives the driver the window systems of this process, before the first instance is created. The first that are given
/// stay.
pub fn use_window_systems(systems: &'static [&'static dyn WindowSystem]) {
    WINDOW_SYSTEMS.get_or_init(|| systems);
}

/// The window system of an extension.
pub(crate) fn window_system(extension: &CStr) -> Option<&'static dyn WindowSystem> {
    let systems = WINDOW_SYSTEMS.get()?;
    systems
        .iter()
        .copied()
        .find(|system| system.extension() == extension)
}

/// Tells if an instance extension is there: those of window systems are there with them.
pub(crate) fn is_available(extension: &CStr) -> bool {
    !OF_WINDOW_SYSTEMS.contains(&extension) || window_system(extension).is_some()
}
