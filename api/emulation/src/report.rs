//! Messages to the user.

/// Tells the user what the application cannot learn from a result.
pub(crate) fn tell(message: &str) {
    eprintln!("VK_LAYER_GAURAST_emulation: {message}");
}
