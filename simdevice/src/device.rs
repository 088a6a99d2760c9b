//! The device: its worker pool, its SIMD level and its configuration, chosen once when it is created.

use crate::gaussian::cache::ChunkCache;
use crate::gaussian::unchanged::LastSets;
use crate::limits::{MAX_MACRO_TILE_SIZE, TILE_SIZE};
use crate::stats::optimizations::Skips;
use crate::stats::recorder::Recorder;
use crate::workers::Workers;
use fearless_simd::Level;
pub use isa::level::SimdLevel;
use std::sync::Arc;
use std::time::Duration;

/// What can be chosen when a device is created.
#[derive(Clone, Debug)]
pub struct Config {
    /// Worker threads; 0 means one per processor.
    pub threads: usize,
    /// The SIMD level of every kernel.
    pub simd: SimdLevel,
    /// The side of a macro-tile, the piece of a pass that one worker renders, in pixels: a multiple of 16 from 16
    /// to 128. It never changes an image.
    pub macro_tile_size: u32,
    /// A pass is flushed early when its bins exceed this many bytes.
    pub bin_budget_bytes: u64,
    /// How many bytes of host memory may hold Gaussians in an order that is faster to read (see
    /// [`Skip::Chunks`](crate::stats::optimizations::Skip::Chunks)): 48 for each, and 192 for spherical harmonics
    /// of degree 3 if there is room for them.
    pub chunk_budget_bytes: u64,
    /// When a pass is flushed.
    pub flush: FlushPolicy,
    /// The longest time that one batch of shader invocations may take.
    pub shader_timeout: Duration,
    /// The work that is left out where it changes no pixel.
    pub skips: Skips,
    /// Gathers what draws do in tiles, if anybody wants to know. It never changes an image.
    pub recorder: Option<Arc<Recorder>>,
    /// Timestamps count the simulated hardware's nanoseconds instead of the host's.
    pub simulated_timestamps: bool,
}

/// When a pass's bins are rendered. It never changes an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FlushPolicy {
    /// When they exceed the budget, at a barrier and at the end of the pass.
    WhenFull,
    /// After every draw, too.
    EveryDraw,
    /// After some draws, too, which follow from the number and how many draws the pass had.
    SomeDraws(u64),
}

impl Default for Config {
    fn default() -> Self {
        Self {
            threads: 0,
            simd: SimdLevel::Best,
            macro_tile_size: 64,
            bin_budget_bytes: 256 << 20,
            chunk_budget_bytes: 512 << 20,
            flush: FlushPolicy::WhenFull,
            shader_timeout: Duration::from_secs(5),
            skips: Skips::default(),
            recorder: None,
            simulated_timestamps: false,
        }
    }
}

/// Why a device could not be created.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The processor lacks the SIMD level asked for.
    #[error("this processor does not support the SIMD level {0:?}")]
    UnsupportedSimdLevel(SimdLevel),
    /// A macro-tile of this side cannot be cut into tiles, or is too large.
    #[error("a macro-tile's side must be a multiple of 16 from 16 to 128, not {0}")]
    MacroTileSize(u32),
    /// The host gave no threads.
    #[error("the worker pool cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// A simulated device. Its threads are joined when it is dropped.
#[derive(Debug)]
pub struct Device {
    workers: Workers,
    level: Level,
    config: Config,
    chunks: ChunkCache,
    last_sets: LastSets,
    recorder: Arc<Recorder>,
}

impl Device {
    /// Starts a device.
    ///
    /// # Errors
    /// [`DeviceError`] if the processor lacks the level, the macro-tile's size is impossible or the host refuses
    /// threads.
    pub fn new(config: &Config) -> Result<Self, DeviceError> {
        let level = config
            .simd
            .resolve()
            .ok_or(DeviceError::UnsupportedSimdLevel(config.simd))?;
        let size = config.macro_tile_size;
        if !(TILE_SIZE..=MAX_MACRO_TILE_SIZE).contains(&size) || !size.is_multiple_of(TILE_SIZE) {
            return Err(DeviceError::MacroTileSize(size));
        }
        let workers = Workers::new(config.threads)?;
        Ok(Self {
            workers,
            level,
            config: config.clone(),
            chunks: ChunkCache::default(),
            last_sets: LastSets::default(),
            recorder: config.recorder.clone().unwrap_or_default(),
        })
    }

    /// What was chosen when it was created.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// What was last made of Gaussians that may be drawn again.
    pub(crate) fn last_sets(&self) -> &LastSets {
        &self.last_sets
    }

    /// The chunks of Gaussians that were drawn more than once.
    pub(crate) fn chunks(&self) -> &ChunkCache {
        &self.chunks
    }

    /// Where what is done goes, if anybody wants to know now.
    pub(crate) fn recorder(&self) -> Option<&Recorder> {
        let config = &self.config;
        let wanted = config.recorder.is_some()
            || config.simulated_timestamps
            || self.recorder.has_listeners();
        wanted.then_some(&*self.recorder)
    }

    /// Where what is done goes once somebody wants to know.
    pub(crate) fn listened_recorder(&self) -> &Recorder {
        &self.recorder
    }

    /// The SIMD level of every kernel.
    pub fn level(&self) -> Level {
        self.level
    }

    /// How many workers it has.
    pub fn threads(&self) -> usize {
        self.workers
            .pool()
            .map_or(1, rayon::ThreadPool::current_num_threads)
    }

    /// Runs `work` on the device's workers.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match self.workers.pool() {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_macro_tiles_are_refused() {
        for macro_tile_size in [0, 8, 40, 144, u32::MAX] {
            let config = Config {
                threads: 1,
                macro_tile_size,
                ..Config::default()
            };
            assert!(matches!(
                Device::new(&config),
                Err(DeviceError::MacroTileSize(size)) if size == macro_tile_size
            ));
        }
    }
}
