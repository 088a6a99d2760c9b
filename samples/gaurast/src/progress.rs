//! Progress of long steps: a bar on a terminal, and elsewhere a line from time to time.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle, WeakProgressBar};

/// The time between two lines if standard error is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);

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
        let bar = bar.with_message(message);
        if !std::io::stderr().is_terminal() {
            let weak = bar.downgrade();
            // Without the thread there are no lines, which nobody misses.
            let _ = std::thread::Builder::new().spawn(move || print_lines(&weak, message));
        }
        bar
    }
}

/// Prints a line from time to time until the step has ended.
fn print_lines(bar: &WeakProgressBar, message: &str) {
    let start = Instant::now();
    loop {
        std::thread::sleep(BETWEEN_LINES);
        let Some(bar) = bar.upgrade().filter(|bar| !bar.is_finished()) else {
            return;
        };
        eprintln!("gaurast: {}", line(message, bar.position(), bar.length(), start.elapsed()));
    }
}

/// The line on a step in progress: the part of its length that is done, if that is known, and the time.
fn line(message: &str, position: u64, length: Option<u64>, time: Duration) -> String {
    let seconds = time.as_secs();
    match length.filter(|length| *length > 0) {
        Some(length) => format!("{message}: {position} of {length} after {seconds} s"),
        None => format!("{message} since {seconds} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_the_part_that_is_done_and_the_time() {
        let time = Duration::from_millis(20_400);
        assert_eq!(line("drawing", 12, Some(240), time), "drawing: 12 of 240 after 20 s");
        assert_eq!(line("uploading", 0, None, time), "uploading since 20 s");
        assert_eq!(line("reading", 5, Some(0), time), "reading since 20 s");
    }
}
