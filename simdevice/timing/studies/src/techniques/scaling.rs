//! Vorion (arXiv 2511.16831): the frame on machines with more and more rasterizers, with the same main memory.

use serde::{Deserialize, Serialize};
use timing::config::{Config, ConfigError};
use timing::fast;
use timing::work::FrameWork;

/// The numbers of rasterizers, from Vorion's prototype to its scaled design.
pub const RASTERIZERS: [u32; 4] = [2, 4, 8, 16];

/// Milliseconds of stage 3 with each number of [`RASTERIZERS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    /// Milliseconds with the main memory of the preset.
    pub raster_ms: [f64; RASTERIZERS.len()],
    /// Milliseconds with a main memory a hundred times as fast.
    pub fast_memory_ms: [f64; RASTERIZERS.len()],
}

impl Scaling {
    /// The times of a frame on modules of the preset `paper-15x16`.
    ///
    /// # Errors
    /// Returns a [`ConfigError`] if the preset can't be read.
    pub fn of(frame: &FrameWork) -> Result<Self, ConfigError> {
        let mut scaling = Self::default();
        for (index, modules) in RASTERIZERS.into_iter().enumerate() {
            let mut config = Config::preset("paper-15x16", &[])?;
            config.rasterizer.modules = modules;
            let time = |config: &Config| {
                fast::rasterize(frame, config, 0.0).milliseconds(config.rasterizer.clock_ghz)
            };
            scaling.raster_ms[index] = time(&config);
            config.memory.bandwidth_gb_s *= 100.0;
            scaling.fast_memory_ms[index] = time(&config);
        }
        Ok(scaling)
    }

    /// The speed-ups of eight times the rasterizers, with the preset's memory and with the fast one.
    pub fn speed_ups(&self) -> [f64; 2] {
        [self.raster_ms, self.fast_memory_ms].map(|times| times[0] / times[RASTERIZERS.len() - 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::simulate::even_frame;

    #[test]
    fn even_work_scales_until_memory_limits() {
        // Long lists of whole tiles: 16 cycles a Gaussian, and 36 bytes.
        let scaling = Scaling::of(&even_frame([1280, 640], 1_600_000, 0.2)).unwrap();
        let [limited, free] = scaling.speed_ups();
        assert!(free > 7.5 && free <= 8.05, "{scaling:?}");
        assert!(limited <= free && limited > 1.0, "{scaling:?}");
    }
}
