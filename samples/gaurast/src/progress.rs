//! Progress of long steps, shown only on a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Shows progress, or nothing.
#[derive(Clone, Copy)]
pub struct Progress {
    pub quiet: bool,
}

impl Progress {
    /// A bar of `length` bytes.
    pub fn bytes(self, message: &'static str, length: u64) -> ProgressBar {
        self.bar(ProgressBar::new(length), message, "{msg:>10} [{bar:40}] {bytes}/{total_bytes}")
    }

    /// A bar of `count` pictures, with the estimated remaining time.
    pub fn pictures(self, count: u64) -> ProgressBar {
        if count == 1 {
            return self.step("drawing");
        }
        let bar = self.bar(ProgressBar::new(count), "drawing", "{msg:>10} [{bar:40}] {pos}/{len}, {eta} left");
        bar.enable_steady_tick(Duration::from_millis(500));
        bar
    }

    /// A spinner for a step of unknown length.
    pub fn step(self, message: &'static str) -> ProgressBar {
        let bar = self.bar(ProgressBar::new_spinner(), message, "{msg:>10} {spinner} {elapsed}");
        bar.enable_steady_tick(Duration::from_millis(100));
        bar
    }

    fn bar(self, bar: ProgressBar, message: &'static str, template: &str) -> ProgressBar {
        if self.quiet {
            return ProgressBar::hidden();
        }
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.with_message(message)
    }
}
