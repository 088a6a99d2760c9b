//! The interface to the host's window systems. The driver receives them from outside, so that it can be built without
//! their libraries. `driver/window` implements X11 and Wayland.

use std::ffi::{CStr, c_void};
use std::ptr::NonNull;
use std::sync::OnceLock;
use std::time::Duration;

/// A window, as an application passes it to Vulkan.
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

/// A window system, which opens the windows of one of Vulkan's surface extensions.
pub trait WindowSystem: Sync {
    /// The instance extension of its surfaces.
    fn extension(&self) -> &'static CStr;

    /// Opens a window.
    ///
    /// # Errors
    /// [`WindowLost`] if pictures can't be shown in it, or it is of another window system.
    ///
    /// # Safety
    /// The window's pointers are valid, and stay so until the returned window and everything made of it are dropped.
    unsafe fn open(&self, window: NativeWindow) -> Result<Box<dyn Window>, WindowLost>;
}

/// The loss of a window, which was closed or whose server has ended. The text says what happened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the window is lost: {0}")]
pub struct WindowLost(pub String);

/// A window in which pictures are shown.
pub trait Window: Send + Sync {
    /// Its present width and height in pixels; `None` if the window takes the size of its pictures.
    ///
    /// # Errors
    /// [`WindowLost`].
    fn extent(&self) -> Result<Option<[u32; 2]>, WindowLost>;

    /// The supported present modes.
    fn present_modes(&self) -> &'static [PresentMode];

    /// Reports whether the background is visible through pictures with an alpha below 1.
    fn has_alpha(&self) -> bool;

    /// Prepares for pictures of one size.
    ///
    /// # Errors
    /// [`WindowLost`].
    fn canvas(&self, options: CanvasOptions) -> Result<Box<dyn Canvas>, WindowLost>;
}

/// A present mode: one of `VkPresentModeKHR`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresentMode {
    /// Each picture is shown at once.
    Immediate,
    /// At each refresh of the display, the newest picture is shown.
    Mailbox,
    /// At each refresh of the display, the next picture is shown, in order.
    Fifo,
}

/// The properties of the pictures that a window will show.
#[derive(Clone, Copy, Debug)]
pub struct CanvasOptions {
    /// Their width and height in pixels.
    pub extent: [u32; 2],
    /// The present mode.
    pub present_mode: PresentMode,
    /// True if alpha is used: colours are premultiplied with it.
    pub has_alpha: bool,
}

/// A window prepared for pictures of one size. It is used on a thread of its own.
pub trait Canvas: Send {
    /// Waits until the display accepts the next picture, at most for `longest`. Returns true if it does. In mode
    /// [`PresentMode::Immediate`] it always does.
    ///
    /// # Errors
    /// [`WindowLost`].
    fn wait(&mut self, longest: Duration) -> Result<bool, WindowLost>;

    /// Shows a picture. `copy` writes its pixels: rows without gaps from the top, with a byte each for blue, green, red
    /// and alpha.
    ///
    /// # Errors
    /// [`WindowLost`].
    fn show(&mut self, copy: &mut dyn FnMut(&mut [u8])) -> Result<(), WindowLost>;
}

/// The surface extensions that are available only if a window system for them is registered.
const OF_WINDOW_SYSTEMS: [&CStr; 3] =
    [ash::khr::wayland_surface::NAME, ash::khr::xcb_surface::NAME, ash::khr::xlib_surface::NAME];

static WINDOW_SYSTEMS: OnceLock<&[&dyn WindowSystem]> = OnceLock::new();

/// Registers the window systems of this process, before the first instance is created. Later calls have no effect.
pub fn use_window_systems(systems: &'static [&'static dyn WindowSystem]) {
    WINDOW_SYSTEMS.get_or_init(|| systems);
}

/// The window system of an extension.
pub(crate) fn window_system(extension: &CStr) -> Option<&'static dyn WindowSystem> {
    let systems = WINDOW_SYSTEMS.get()?;
    systems.iter().copied().find(|system| system.extension() == extension)
}

/// Reports whether an instance extension is available: those of window systems are, if a window system is registered.
pub(crate) fn is_available(extension: &CStr) -> bool {
    !OF_WINDOW_SYSTEMS.contains(&extension) || window_system(extension).is_some()
}
