//! The environment variables that configure devices. They are read only here, when a device is created.
//!
//! - `GAURAST_SIMD`: the SIMD level, by name: best (the default), sse2, avx2 or avx512.
//! - `GAURAST_THREADS`: the number of worker threads of a device; 0 (the default) means one per processor.
//! - `GAURAST_TIMEOUT_MS`: the milliseconds that one batch of shader invocations may take before the device is lost, so
//!   that a loop without end is stopped. A batch is a workgroup, 128 vertices, or 64 or 256 fragments.
//! - `GAURAST_OPTIMIZATIONS`: the work that is skipped because it changes no image: all (the default), none, or names
//!   separated by commas (see [`simdevice::stats::optimizations`]).
//! - `GAURAST_TRACE`: a file to which the work of a device's last 64 render passes is written, as JSON, when the device
//!   is destroyed; `gaurast simulate` reads it. It costs a little time and changes no image.
//! - `GAURAST_TIMESTAMPS`: the clock of timestamps: host (the default) or simulated, which counts the nanoseconds that
//!   the paper's hardware would have spent since the device was created. Such a clock is no time domain of
//!   `VK_EXT_calibrated_timestamps`, which then has the host's alone.
//! - `GAURAST_DUMP`: the text that is printed to standard error, by name: ir (the device's programs, when pipelines are
//!   created).

use super::memory;
use crate::abi::error::Error;
use simdevice::Config;
use simdevice::runtime::SimdLevel;
use simdevice::stats::optimizations::UnknownOptimization;
use simdevice::stats::recorder::{Recorder, Trace};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// The ratio of the heap's size to the budget of host memory for chunks of Gaussians.
const HEAP_PER_CLUSTER_BUDGET: u64 = 8;

const SIMD: &str = "GAURAST_SIMD";
const THREADS: &str = "GAURAST_THREADS";
const TIMEOUT: &str = "GAURAST_TIMEOUT_MS";
const OPTIMIZATIONS: &str = "GAURAST_OPTIMIZATIONS";
const TRACE: &str = "GAURAST_TRACE";
const TIMESTAMPS: &str = "GAURAST_TIMESTAMPS";
const DUMP: &str = "GAURAST_DUMP";

/// Opens a simulated device with the configuration from the environment.
///
/// # Errors
/// [`Error::InitializationFailed`] for a value that is invalid or that this machine can't satisfy.
pub(crate) fn open_device() -> Result<simdevice::Device, Error> {
    let mut config = config(
        variable(SIMD)?.as_deref(),
        variable(THREADS)?.as_deref(),
        variable(TIMEOUT)?.as_deref(),
        variable(OPTIMIZATIONS)?.as_deref(),
    )?;
    config.simulated_timestamps = has_simulated_timestamps()?;
    if let Some(file) = variable(TRACE)?.filter(|file| !file.is_empty()) {
        let file = PathBuf::from(file);
        let recorder = Recorder::new(move |trace| write_trace(&file, &trace));
        config.recorder = Some(Arc::new(recorder));
    }
    simdevice::Device::new(&config).map_err(|error| Error::InitializationFailed(error.to_string()))
}

/// Reports whether timestamps of devices that are created now count the simulated hardware's time.
///
/// # Errors
/// [`Error::InitializationFailed`] for a value that is invalid.
pub(crate) fn has_simulated_timestamps() -> Result<bool, Error> {
    simulated_timestamps(variable(TIMESTAMPS)?.as_deref().unwrap_or_default())
}

/// Reports whether timestamps count the simulated hardware's time.
fn simulated_timestamps(name: &str) -> Result<bool, Error> {
    match name {
        "" | "host" => Ok(false),
        "simulated" => Ok(true),
        other => Err(Error::InitializationFailed(format!("{TIMESTAMPS}={other} is neither host nor simulated"))),
    }
}

/// Writes a trace. A failure is logged.
fn write_trace(file: &Path, trace: &Trace) {
    let written = serde_json::to_vec(trace).map_err(std::io::Error::from).and_then(|json| std::fs::write(file, json));
    if let Err(error) = written {
        log::error!("{TRACE}={}: {error}", file.display());
    }
}

/// The texts that are printed for readers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Dump {
    /// True to print the device's programs when pipelines are created.
    pub(crate) ir: bool,
}

/// The texts that the environment asks to print.
///
/// # Errors
/// [`Error::InitializationFailed`] for an unknown name.
pub(crate) fn dump() -> Result<Dump, Error> {
    parse_dump(variable(DUMP)?.as_deref().unwrap_or_default())
}

fn parse_dump(names: &str) -> Result<Dump, Error> {
    let mut dump = Dump::default();
    for name in names.split(',').filter(|name| !name.is_empty()) {
        match name {
            "ir" => dump.ir = true,
            other => {
                return Err(Error::InitializationFailed(format!("{DUMP}={other} is not ir")));
            }
        }
    }
    Ok(dump)
}

fn variable(name: &str) -> Result<Option<String>, Error> {
    match std::env::var(name) {
        Ok(value) => Ok(Some(value)),
        Err(std::env::VarError::NotPresent) => Ok(None),
        Err(std::env::VarError::NotUnicode(_)) => Err(Error::InitializationFailed(format!("{name} is not text"))),
    }
}

/// The configuration from the values of the variables.
fn config(
    simd: Option<&str>,
    threads: Option<&str>,
    timeout: Option<&str>,
    optimizations: Option<&str>,
) -> Result<Config, Error> {
    let mut config =
        Config { cluster_budget_bytes: memory::heap_size() / HEAP_PER_CLUSTER_BUDGET, ..Config::default() };
    if let Some(name) = simd {
        config.simd = SimdLevel::from_name(name).ok_or_else(|| {
            let names: Vec<_> = SimdLevel::NAMES.iter().map(|(name, _)| *name).collect();
            Error::InitializationFailed(format!("{SIMD}={name} is none of {}", names.join(", ")))
        })?;
    }
    if let Some(count) = threads {
        config.threads = count
            .parse()
            .map_err(|_| Error::InitializationFailed(format!("{THREADS}={count} is not a number of threads")))?;
    }
    if let Some(milliseconds) = timeout {
        let milliseconds = milliseconds
            .parse()
            .map_err(|_| Error::InitializationFailed(format!("{TIMEOUT}={milliseconds} is not a number")))?;
        config.shader_timeout = Duration::from_millis(milliseconds);
    }
    if let Some(names) = optimizations {
        let unknown =
            |error: UnknownOptimization| Error::InitializationFailed(format!("{OPTIMIZATIONS}={names}: {error}"));
        config.optimizations = names.parse().map_err(unknown)?;
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;
    use simdevice::stats::optimizations::Optimization;

    #[test]
    fn values_are_understood_or_refused() {
        assert_eq!(config(None, None, None, None).unwrap().threads, 0);
        let chosen = config(Some("sse2"), Some("3"), Some("250"), Some("blocks,bounds")).unwrap();
        assert_eq!(chosen.shader_timeout, Duration::from_millis(250));
        assert_eq!((chosen.simd, chosen.threads), (SimdLevel::Baseline, 3));
        let error = config(Some("mmx"), None, None, None).unwrap_err();
        assert_eq!(error.result(), ash::vk::Result::ERROR_INITIALIZATION_FAILED);
        assert!(error.to_string().contains("GAURAST_SIMD=mmx"));
        assert!(config(None, Some("-1"), None, None).is_err());
        assert!(config(None, None, Some("soon"), None).is_err());
        assert!(chosen.optimizations.has(Optimization::Bounds) && !chosen.optimizations.has(Optimization::Ellipse));
        let error = config(None, None, None, Some("blocks,much")).unwrap_err();
        assert!(error.to_string().contains("GAURAST_OPTIMIZATIONS=blocks,much: \"much\" is"), "{error}");
        assert!(simulated_timestamps("simulated").unwrap());
        assert!(!simulated_timestamps("host").unwrap() && !simulated_timestamps("").unwrap());
        assert!(simulated_timestamps("device").is_err());
        assert!(parse_dump("ir").unwrap().ir);
        assert!(!parse_dump("").unwrap().ir);
        assert!(parse_dump("ir,everything").is_err());
    }
}
