//! What rasterizing a frame took, whichever model says so.

use crate::work::Mode;
use serde::Serialize;

/// Cycles of all modules together, by what their PEs did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ModuleCycles {
    /// PEs evaluated pixels.
    pub busy: f64,
    /// Waiting for a pixel's transmittance to come back out of the pipeline.
    pub dependency: f64,
    /// Waiting for primitives from memory, or for the pixels of the tile before the last to be written.
    pub memory: f64,
    /// The controller at the beginning of a tile, or looking at primitives that reach no unfinished pixel.
    pub controller: f64,
    /// Draining and reconfiguring.
    pub mode_switch: f64,
    /// Nothing left to do while other modules, the last write-back or the last drain end.
    pub idle: f64,
}

impl ModuleCycles {
    /// All of them.
    pub fn total(&self) -> f64 {
        self.busy + self.dependency + self.memory + self.controller + self.mode_switch + self.idle
    }

    /// Names and values, for tables.
    pub fn by_cause(&self) -> [(&'static str, f64); 6] {
        [
            ("busy", self.busy),
            ("dependency", self.dependency),
            ("memory", self.memory),
            ("controller", self.controller),
            ("mode switch", self.mode_switch),
            ("idle", self.idle),
        ]
    }
}

/// What rasterizing a frame took.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RasterReport {
    /// Cycles from the first fetch to the last byte written.
    pub cycles: f64,
    /// Where the modules' cycles went; their total is `cycles` times the modules.
    pub modules: ModuleCycles,
    /// Bytes of primitives and lists that were fetched.
    pub bytes_in: f64,
    /// Of those, fetched ahead of a tile's end and thrown away.
    pub bytes_wasted: f64,
    /// Bytes of pixels that were written.
    pub bytes_out: f64,
    /// Pixels and Gaussians evaluated together.
    pub gaussian_evaluations: f64,
    /// Pixels and triangles evaluated together.
    pub triangle_evaluations: f64,
    /// Primitives and tiles taken together.
    pub pairs: f64,
    /// Mode switches.
    pub switches: f64,
}

impl RasterReport {
    /// Counts evaluations.
    pub fn add_evaluations(&mut self, mode: Mode, count: f64) {
        match mode {
            Mode::Triangle => self.triangle_evaluations += count,
            Mode::Gaussian => self.gaussian_evaluations += count,
        }
    }

    /// The share of PE cycles in which pixels were evaluated.
    pub fn utilization(&self) -> f64 {
        match self.modules.total() {
            0.0 => 0.0,
            total => self.modules.busy / total,
        }
    }

    /// Milliseconds at a clock in GHz.
    pub fn milliseconds(&self, clock_ghz: f64) -> f64 {
        self.cycles / clock_ghz * 1e-6
    }
}
