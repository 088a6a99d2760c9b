//! Vorion (arXiv 2511.16831): the frame on machines with more and more rasterizers, with the same main memory.

use serde::{Deserialize, Serialize};
use timing::config::{Config, ConfigError};
use timing::fast;
use timing::work::{FrameWork, Saturation};

/// The numbers of rasterizers, from Vorion's prototype to its scaled design.
pub const RASTERIZERS: [u32; 4] = [2, 4, 8, 16];

/// Milliseconds of stage 3 with each number of [`RASTERIZERS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    /// Milliseconds if whole tiles are evaluated, as in the paper's machine.
    pub tiles_ms: [f64; RASTERIZERS.len()],
    /// Milliseconds if only unfinished blocks that a Gaussian reaches are evaluated.
    pub blocks_ms: [f64; RASTERIZERS.len()],
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
            let time = |config: &Config| fast::rasterize(frame, config, 0.0).milliseconds(config.rasterizer.clock_ghz);
            scaling.tiles_ms[index] = time(&config);
            config.rasterizer.saturation = Saturation::Reached;
            scaling.blocks_ms[index] = time(&config);
        }
        Ok(scaling)
    }

    /// The speed-ups of eight times the rasterizers, with whole tiles and with blocks.
    pub fn speed_ups(&self) -> [f64; 2] {
        [self.tiles_ms, self.blocks_ms].map(|times| times[0] / times[RASTERIZERS.len() - 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::simulate::even_frame;

    #[test]
    fn even_work_scales_until_memory_limits() {
        // Long lists: 16 cycles and 40 bytes a Gaussian, and one cycle if it reaches one block.
        let mut frame = even_frame([1280, 640], 1_600_000, 0.2);
        for tile in &mut frame.draws[0].tiles {
            tile.runs[0].reached = tile.listed;
        }
        let scaling = Scaling::of(&frame).unwrap();
        let [tiles, blocks] = scaling.speed_ups();
        assert!(tiles > 7.5 && tiles <= 8.05, "{scaling:?}");
        assert!(blocks < tiles && blocks > 1.0, "{scaling:?}");
        assert!(scaling.blocks_ms[0] < scaling.tiles_ms[0]);
    }
}
