//! Upper bounds of the rasterization's speed: the rate of the tile kernel if all data is in the first-level cache, and
//! the rate of the processor's multiplications and additions.

use std::hint::black_box;
use std::time::Instant;

use devmem::dispatch;
use fearless_simd::{Level, Simd, prelude::*};
use serde::Serialize;

use gaurast_render::Settings;

use super::worker::{Contender, Drawn, Worker};
use super::workload::{Source, TILE_GAUSSIANS, Workload};
use crate::error::BenchError;

/// Numbers of tiles of the two measured frames. Rates come from the difference of the two, so that the fixed cost of a
/// frame cancels.
const TILES: [usize; 2] = [4, 20];

/// Number of frames; the fastest counts.
const FRAMES: usize = 300;

/// Pixels of a block, which is evaluated at once.
const BLOCK: f64 = 16.0;

/// Floating-point operations of an evaluation at a pixel, with a fused operation counted as two, at the SIMD level that
/// needs fewest: 3 for the exponent, 8 for its power, 1 for the ceiling, 9 for compositing. Comparisons and integer
/// operations are not counted.
const OPERATIONS: f64 = 21.0;

/// Rates on one thread.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Roofline {
    /// Pairs of a tile and a Gaussian that reaches one block of the tile, per second.
    pub pairs: f64,
    /// Evaluations of a Gaussian at a pixel per second, for Gaussians that cover the tile.
    pub pixels: f64,
    /// Floating-point operations per second of independent fused multiply-adds with the widest available vectors.
    pub operations: f64,
}

impl Roofline {
    /// Measures the rates on one thread.
    pub fn measure() -> Result<Self, BenchError> {
        let [few, many] = TILES;
        let rate = |whole| -> Result<f64, BenchError> {
            let time = fastest(whole, many)? - fastest(whole, few)?;
            Ok(((many - few) * TILE_GAUSSIANS) as f64 / time.max(1e-9))
        };
        Ok(Self { pairs: rate(false)?, pixels: 256.0 * rate(true)?, operations: operations() })
    }

    /// The share of the bound that a frame's rasterization reaches on `threads`. It is the time that the frame's pairs
    /// and pixels take at the rates above, divided by the measured time. It may exceed 1 if pairs cost less than in the
    /// measurement.
    pub fn share(&self, drawn: &Drawn, threads: usize) -> f64 {
        let pairs = drawn.counter("tile pairs evaluated");
        let pixels = evaluations(drawn);
        // The rate of pairs includes the first block of each pair, so only the remaining pixels are added.
        let further = (pixels - BLOCK * pairs).max(0.0);
        let per_pixel = ((1.0 / self.pixels) * 256.0 - 1.0 / self.pairs).max(0.0) / (256.0 - BLOCK);
        let roof = pairs / self.pairs + further * per_pixel;
        roof / busy(drawn, threads)
    }

    /// The share of the multiply-add rate that a frame's rasterization reaches on `threads`.
    pub fn share_of_operations(&self, drawn: &Drawn, threads: usize) -> f64 {
        OPERATIONS * evaluations(drawn) / busy(drawn, threads) / self.operations
    }
}

/// The seconds of a frame's rasterization, times the number of threads.
fn busy(drawn: &Drawn, threads: usize) -> f64 {
    drawn.counter("raster") * 1e-3 * threads.max(1) as f64
}

/// Evaluations of a Gaussian at a pixel in a frame.
pub fn evaluations(drawn: &Drawn) -> f64 {
    BLOCK * drawn.counter("block evaluations")
}

/// The greatest number of floating-point operations per second.
fn operations() -> f64 {
    let level = Level::new();
    let rates = (0..FRAMES).map(|_| {
        let start = Instant::now();
        let count = dispatch!(level, simd => multiply_and_add(simd));
        count / start.elapsed().as_secs_f64()
    });
    rates.fold(0.0, f64::max)
}

/// Updates more independent sums than a processor has operations in flight; returns the number of operations.
#[inline(always)]
fn multiply_and_add<S: Simd>(simd: S) -> f64 {
    const ROUNDS: u32 = 10_000;
    simd.vectorize(
        #[inline(always)]
        || {
            let factor = S::f32s::splat(simd, black_box(0.999));
            let term = S::f32s::splat(simd, black_box(0.001));
            let mut sums = [term; 12];
            for _ in 0..ROUNDS {
                for sum in &mut sums {
                    *sum = sum.mul_add(factor, term);
                }
            }
            black_box(sums.map(|sum| sum.as_slice()[0]));
            f64::from(ROUNDS) * (2 * sums.len() * S::f32s::LEN) as f64
        },
    )
}

/// The least time, in seconds, of a frame of this many tiles.
fn fastest(whole: bool, tiles: usize) -> Result<f64, BenchError> {
    let workload = Workload::new(Source::Tiles { whole, tiles }, [16 * tiles as u32, 16]);
    let views = workload.views(&workload.scene()?, 1)?;
    let mut worker =
        Worker::start(Contender::Gaurast, &workload, 1)?.ok_or(BenchError::Worker("it is not there".to_owned()))?;
    let mut least = f64::INFINITY;
    for _ in 0..FRAMES {
        let drawn = worker.draw(&views[0], Settings::default(), None)?;
        least = least.min(drawn.counter("raster") * 1e-3);
    }
    Ok(least)
}
