//! The report of a run: the slowest tests, and the reasons for which tests were ignored.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The variable for a file to which each executable appends its rows: seconds or `ignored`, a tab, and the test's name
/// or the reason. A script can then report on all executables together.
pub(crate) const REPORT: &str = "GAURAST_TEST_REPORT";

/// The number of slowest tests that are printed.
const SLOWEST: usize = 20;

/// The times of tests and the reasons of ignored ones.
#[derive(Debug, Default)]
pub(crate) struct Report {
    times: Mutex<Vec<(Duration, String)>>,
    ignored: Mutex<BTreeMap<String, usize>>,
}

impl Report {
    pub fn add_time(&self, name: &str, time: Duration) {
        lock(&self.times).push((time, name.to_owned()));
    }

    pub fn add_ignored(&self, reason: &str) {
        *lock(&self.ignored).entry(reason.to_owned()).or_default() += 1;
    }

    /// Prints the reasons, and the tests that took a second or more; appends all to the report's file.
    pub fn tell(&self) {
        let mut times = std::mem::take(&mut *lock(&self.times));
        times.sort_by(|a, b| b.cmp(a));
        let ignored = lock(&self.ignored);
        for (reason, count) in &*ignored {
            println!("ignored: {count} ({reason})");
        }
        if let Some(path) = std::env::var_os(REPORT) {
            let rows: String = times
                .iter()
                .map(|(time, name)| format!("{:.2}\t{name}\n", time.as_secs_f64()))
                .chain(
                    ignored
                        .iter()
                        .flat_map(|(reason, &count)| std::iter::repeat_n(format!("ignored\t{reason}\n"), count)),
                )
                .collect();
            let file = std::fs::OpenOptions::new().create(true).append(true).open(&path);
            if let Err(error) = file.and_then(|mut file| file.write_all(rows.as_bytes())) {
                eprintln!("{}: {error}", path.display());
            }
            return;
        }
        let slow = times.iter().take(SLOWEST);
        for (time, name) in slow.take_while(|(time, _)| time.as_secs() >= 1) {
            println!("{:8.2} s  {name}", time.as_secs_f64());
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
