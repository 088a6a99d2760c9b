//! What the tile kernel reaches when everything is in the first-level cache: the roof for whole frames.

use serde::Serialize;

use gaurast_samples::renderer::Settings;

use super::BenchError;
use super::worker::{Contender, Drawn, Worker};
use super::workload::{Source, TILE_GAUSSIANS, Workload};

/// Frames of a tile; the fastest counts.
const FRAMES: usize = 300;

/// Pixels of a block that is evaluated at once.
const BLOCK: f64 = 16.0;

/// The kernel's rates on one thread.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Roofline {
    /// Pairs of a tile and a Gaussian that reaches one block of it, a second.
    pub pairs: f64,
    /// Evaluations of a Gaussian at a pixel, a second, of Gaussians that cover the tile.
    pub pixels: f64,
}

impl Roofline {
    /// Measures tiles of one thread.
    pub fn measure() -> Result<Self, BenchError> {
        let dust = fastest(false)?;
        let covered = fastest(true)?;
        Ok(Self {
            pairs: TILE_GAUSSIANS as f64 / dust,
            pixels: TILE_GAUSSIANS as f64 * 256.0 / covered,
        })
    }

    /// The share of the roof that a frame's rasterization reaches on `threads`: the time that its
    /// pairs and pixels take at the rates above, by the time that it took. It may exceed 1 where
    /// pairs need less than the kernel's least here.
    pub fn share(&self, drawn: &Drawn, threads: usize) -> f64 {
        let pairs = drawn.counter("tile pairs evaluated");
        let pixels = BLOCK * drawn.counter("block evaluations");
        // A pair costs its test and its first block together; what is beyond that is pixels alone.
        let further = (pixels - BLOCK * pairs).max(0.0);
        let per_pixel = ((1.0 / self.pixels) * 256.0 - 1.0 / self.pairs).max(0.0) / (256.0 - BLOCK);
        let roof = pairs / self.pairs + further * per_pixel;
        roof / (drawn.counter("raster") * 1e-3 * threads.max(1) as f64)
    }
}

/// The least seconds that a tile took.
fn fastest(whole: bool) -> Result<f64, BenchError> {
    let workload = Workload::new(Source::Tile { whole }, [16, 16]);
    let views = workload.views(&workload.scene()?, 1)?;
    let mut worker = Worker::start(Contender::Gaurast, &workload, 1)?
        .ok_or(BenchError::Worker("it is not there".to_owned()))?;
    let mut least = f64::INFINITY;
    for _ in 0..FRAMES {
        let drawn = worker.draw(&views[0], Settings::default(), None)?;
        least = least.min(drawn.counter("raster") * 1e-3);
    }
    Ok(least)
}
