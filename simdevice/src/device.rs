//! The device that a driver creates: a runtime, and the caches of Gaussians, kept from one frame to the next.

use crate::gaussian::caches::Caches;
use crate::runtime::{Config, DeviceError, Runtime};
use fearless_simd::Level;

/// A simulated device. Its threads are joined when it is dropped.
#[derive(Debug)]
pub struct Device {
    runtime: Runtime,
    caches: Caches,
}

impl Device {
    /// Starts a device.
    ///
    /// # Errors
    /// [`DeviceError`] if the processor lacks the SIMD level, the macro-tile's size is impossible or the host refuses
    /// threads.
    pub fn new(config: &Config) -> Result<Self, DeviceError> {
        Ok(Self { runtime: Runtime::new(config)?, caches: Caches::default() })
    }

    /// The runtime: the workers, the SIMD level and the configuration.
    pub fn runtime(&self) -> &Runtime {
        &self.runtime
    }

    /// The caches of Gaussians, which are kept from one frame to the next.
    pub fn caches(&self) -> &Caches {
        &self.caches
    }

    /// The SIMD level that programs are compiled for.
    pub fn level(&self) -> Level {
        self.runtime.level()
    }
}
