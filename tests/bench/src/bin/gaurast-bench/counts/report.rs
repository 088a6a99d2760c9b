//! The results of a check.

/// The failures of a check.
#[derive(Default)]
pub(super) struct Report {
    pub(super) failures: usize,
}

impl Report {
    /// Adds a failure and prints it.
    pub(super) fn fail(&mut self, text: String) {
        println!("FAILED: {text}");
        self.failures += 1;
    }
}
