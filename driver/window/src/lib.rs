//! Windows of X11 and Wayland for the GauRast driver.
//!
//! The driver shows pictures through [`driver::window`], and knows no window system; this crate gives it those of Linux, so
//! that only programs that have a window build and link what these take. The libraries of the window systems (libxcb,
//! libX11-xcb, libwayland-client) are loaded when the first window of theirs is opened: the application has them then, for
//! it gives pointers of theirs, and on a machine without them the driver works as well.

#![cfg(target_os = "linux")]

mod error;
mod shared_memory;
mod wayland;
mod x11;

use driver::window::{WindowSystem, use_window_systems};

/// The window systems of this machine.
static WINDOW_SYSTEMS: [&dyn WindowSystem; 3] = [&wayland::Wayland, &x11::Xcb, &x11::Xlib];

/// Gives the driver the window systems of this machine, before the first instance is created.
pub fn register() {
    use_window_systems(&WINDOW_SYSTEMS);
}

/// The driver as an [`ash::Entry`], as [`driver::entry`], with windows.
pub fn entry() -> ash::Entry {
    register();
    driver::entry()
}
