//! The number of runs, and the panics in them.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use gaurast_runner::Case;

/// The messages of panics in any thread. The driver catches panics, so that an application never sees them.
static PANICS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Records all panics of this process from now on, and prints them with their backtraces.
pub fn watch_panics() {
    std::panic::set_hook(Box::new(|info| {
        eprintln!("{info}\n{}", std::backtrace::Backtrace::force_capture());
        let mut panics = PANICS.lock().unwrap_or_else(PoisonError::into_inner);
        panics.push(info.to_string());
    }));
}

/// The panics since the last call.
pub fn panics() -> Vec<String> {
    std::mem::take(&mut *PANICS.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The numbers of a shard's runs. The total is `GAURAST_FUZZ_RUNS`, or `usual`.
pub fn runs(case: &Case, usual: u64) -> Range<u64> {
    let number = |variable, otherwise| match std::env::var(variable) {
        Ok(text) => text.parse().expect("a number"),
        Err(_) => otherwise,
    };
    let first: u64 = number("GAURAST_FUZZ_FIRST", 0);
    let Range { start, end } = case.shard().range(number("GAURAST_FUZZ_RUNS", usual));
    first + start..first + end
}

/// Returns true if there are enough runs for all outcomes to occur.
pub fn are_many(runs: &Range<u64>) -> bool {
    runs.end - runs.start >= 100
}
