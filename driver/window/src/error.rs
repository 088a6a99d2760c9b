//! What goes wrong with a window system.

use driver::window::WindowLost;
use std::fmt::Display;

/// An error of a window system's as the loss of its window.
pub(crate) fn lost(error: impl Display) -> WindowLost {
    WindowLost(error.to_string())
}
