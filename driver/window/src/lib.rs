//! Windows of X11 and Wayland for the GauRast driver.
//!
//! The driver shows pictures through [`driver::window`] and contains no window system. This crate registers those of
//! Linux, so that only programs with windows build and link their dependencies. The libraries of the window systems
//! (libxcb, libX11-xcb, libwayland-client) are loaded when the first window is opened. Then the application has loaded
//! them already, because it passes their pointers; on a machine without them the driver still works.

#![cfg(target_os = "linux")]

mod error;
mod shared_memory;
mod wayland;
mod x11;

use driver::window::{WindowSystem, use_window_systems};

/// The window systems of this machine.
static WINDOW_SYSTEMS: [&dyn WindowSystem; 3] = [&wayland::Wayland, &x11::Xcb, &x11::Xlib];

/// Registers the window systems of this machine with the driver, before the first instance is created.
pub fn register() {
    use_window_systems(&WINDOW_SYSTEMS);
}

/// The driver as an [`ash::Entry`], like [`driver::entry`], with windows.
pub fn entry() -> ash::Entry {
    register();
    driver::entry()
}
