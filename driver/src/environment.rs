//! The environment variables that choose how devices work. They are read here and nowhere else, when a device is
//! created.
//!
//! - `GAURAST_SIMD`: the SIMD level, by name: best (the default), sse2, sse4.2, avx2 or avx512.
//! - `GAURAST_THREADS`: how many worker threads a device has; 0 (the default) means one per processor.

use crate::error::Error;
use simdevice::device::{Config, SimdLevel};

const SIMD: &str = "GAURAST_SIMD";
const THREADS: &str = "GAURAST_THREADS";

/// Opens a simulated device as the environment says.
///
/// # Errors
/// [`Error::InitializationFailed`] for a value that means nothing or that this machine can't satisfy.
pub(crate) fn open_device() -> Result<simdevice::Device, Error> {
    let config = config(variable(SIMD)?.as_deref(), variable(THREADS)?.as_deref())?;
    simdevice::Device::new(&config).map_err(|error| Error::InitializationFailed(error.to_string()))
}

fn variable(name: &str) -> Result<Option<String>, Error> {
    match std::env::var(name) {
        Ok(value) => Ok(Some(value)),
        Err(std::env::VarError::NotPresent) => Ok(None),
        Err(std::env::VarError::NotUnicode(_)) => {
            Err(Error::InitializationFailed(format!("{name} is not text")))
        }
    }
}

/// The configuration that the variables' values choose.
fn config(simd: Option<&str>, threads: Option<&str>) -> Result<Config, Error> {
    let mut config = Config::default();
    if let Some(name) = simd {
        config.simd = SimdLevel::from_name(name).ok_or_else(|| {
            let names: Vec<_> = SimdLevel::NAMES.iter().map(|(name, _)| *name).collect();
            Error::InitializationFailed(format!("{SIMD}={name} is none of {}", names.join(", ")))
        })?;
    }
    if let Some(count) = threads {
        config.threads = count.parse().map_err(|_| {
            Error::InitializationFailed(format!("{THREADS}={count} is not a number of threads"))
        })?;
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_understood_or_refused() {
        assert_eq!(config(None, None).unwrap().threads, 0);
        let chosen = config(Some("sse2"), Some("3")).unwrap();
        assert_eq!((chosen.simd, chosen.threads), (SimdLevel::Baseline, 3));
        let error = config(Some("mmx"), None).unwrap_err();
        assert_eq!(error.result(), ash::vk::Result::ERROR_INITIALIZATION_FAILED);
        assert!(error.to_string().contains("GAURAST_SIMD=mmx"));
        assert!(config(None, Some("-1")).is_err());
    }
}
