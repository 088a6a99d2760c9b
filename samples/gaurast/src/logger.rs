//! A logger that prints each message of the driver once. Errors become a part of the command's last sentence.

use std::collections::HashSet;
use std::sync::{Mutex, PoisonError};

use log::{Level, LevelFilter, Log, Metadata, Record};

/// The messages logged so far.
static LOGGED: Mutex<Logged> = Mutex::new(Logged { errors: Vec::new(), seen: None });

struct Logged {
    errors: Vec<String>,
    /// Messages that were printed already.
    seen: Option<HashSet<String>>,
}

struct Logger {
    inner: env_logger::Logger,
    /// True if `RUST_LOG` is set: errors are then also printed immediately.
    asked_for: bool,
}

/// Logs warnings, or the levels of `RUST_LOG`, to stderr from now on.
pub fn start() {
    let variable = env_logger::Env::default().default_filter_or("warn");
    let inner = env_logger::Builder::from_env(variable).build();
    let level = inner.filter().max(LevelFilter::Error);
    let asked_for = std::env::var_os("RUST_LOG").is_some();
    // No other code sets a logger.
    if log::set_boxed_logger(Box::new(Logger { inner, asked_for })).is_ok() {
        log::set_max_level(level);
    }
}

/// The last error that was logged, without the parts that are meant for programs.
pub fn last_error() -> Option<String> {
    let logged = LOGGED.lock().unwrap_or_else(PoisonError::into_inner);
    logged.errors.last().map(|message| plain(message).to_owned())
}

/// A message without the kind in brackets at its end and without the call at its beginning.
fn plain(message: &str) -> &str {
    let message = match message.rsplit_once(" [") {
        Some((message, kind)) if kind.ends_with(']') => message,
        _ => message,
    };
    match message.split_once(": ") {
        Some((call, rest)) if call.starts_with("vk") => rest,
        _ => message,
    }
}

impl Log for Logger {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() == Level::Error || self.inner.enabled(metadata)
    }

    fn log(&self, record: &Record<'_>) {
        let message = record.args().to_string();
        let new = {
            let mut logged = LOGGED.lock().unwrap_or_else(PoisonError::into_inner);
            if record.level() == Level::Error {
                logged.errors.push(message.clone());
            }
            let seen = logged.seen.get_or_insert_with(HashSet::new);
            seen.insert(message)
        };
        // An error is printed at the end.
        if new && (self.asked_for || record.level() != Level::Error) {
            self.inner.log(record);
        }
    }

    fn flush(&self) {
        self.inner.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_sentences() {
        assert_eq!(
            plain("vkCreateDevice: GAURAST_SIMD=mmx is none of best, sse2 [GAURAST-error]"),
            "GAURAST_SIMD=mmx is none of best, sse2"
        );
        let trace = "GAURAST_TRACE=/a: No space left on device (os error 28)";
        assert_eq!(plain(trace), trace);
    }
}
