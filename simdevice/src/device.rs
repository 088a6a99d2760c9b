//! The device that a driver creates: a runtime, and what is kept of Gaussians from one picture to the next.

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
        Ok(Self {
            runtime: Runtime::new(config)?,
            caches: Caches::default(),
        })
    }

    /// What its stages run by.
    pub fn runtime(&self) -> &Runtime {
        &self.runtime
    }

    /// What it keeps of Gaussians.
    pub fn caches(&self) -> &Caches {
        &self.caches
    }

    /// The SIMD level that programs are made ready for.
    pub fn level(&self) -> Level {
        self.runtime.level()
    }
}
