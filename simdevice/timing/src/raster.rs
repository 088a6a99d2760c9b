//! The result of rasterizing a frame, common to all models of the rasterizer.

use crate::work::Mode;
use serde::Serialize;

/// Cycles of all modules together, by the activity of their PEs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ModuleCycles {
    /// The PEs evaluate pixels.
    pub busy: f64,
    /// The PEs wait for a pixel's transmittance to leave the pipeline.
    pub dependency: f64,
    /// The PEs wait for primitives from memory, or for the pixels of the tile before the last to be written.
    pub memory: f64,
    /// The controller begins a tile or a piece of its list that was waited for, discards a piece of a list that has ended, or
    /// checks primitives that reach no unfinished pixel.
    pub controller: f64,
    /// The pipeline drains and is reconfigured.
    pub mode_switch: f64,
    /// The module has no work left while other modules, the last write-back or the last drain end.
    pub idle: f64,
}

impl ModuleCycles {
    /// The sum of all activities.
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

/// The time, transfers and work of rasterizing a frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RasterReport {
    /// Cycles from the first fetch to the last byte written.
    pub cycles: f64,
    /// The modules' cycles by activity; their total is `cycles` times the modules.
    pub modules: ModuleCycles,
    /// Bytes of primitives and lists that were fetched.
    pub bytes_in: f64,
    /// The part of `bytes_in` that was fetched ahead past a tile's end and discarded.
    pub bytes_wasted: f64,
    /// Bytes of pixels that were written.
    pub bytes_out: f64,
    /// Pairs of a pixel and a Gaussian that were evaluated.
    pub gaussian_evaluations: f64,
    /// Pairs of a pixel and a triangle that were evaluated.
    pub triangle_evaluations: f64,
    /// Pairs of a tile and a primitive that were fetched.
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
