//! What a check found.

/// The failures of a check.
#[derive(Default)]
pub(super) struct Report {
    pub(super) failures: usize,
}

impl Report {
    /// Tells a failure.
    pub(super) fn fail(&mut self, text: String) {
        println!("FAILED: {text}");
        self.failures += 1;
    }
}
