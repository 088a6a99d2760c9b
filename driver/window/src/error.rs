//! Errors of window systems.

use driver::window::WindowLost;
use std::fmt::Display;

/// Converts an error of a window system to the loss of its window.
pub(crate) fn lost(error: impl Display) -> WindowLost {
    WindowLost(error.to_string())
}
