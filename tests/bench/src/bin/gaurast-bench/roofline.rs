//! Roofs for whole frames: what the tile kernel reaches when everything is in the first-level cache, and the rate at which the
//! processor multiplies and adds.

use std::hint::black_box;
use std::time::Instant;

use devmem::dispatch;
use fearless_simd::{Level, Simd, prelude::*};
use serde::Serialize;

use gaurast_render::Settings;

use super::worker::{Contender, Drawn, Worker};
use super::workload::{Source, TILE_GAUSSIANS, Workload};
use crate::error::BenchError;

/// Tiles of a frame. Rates are those of what the larger has more, so that what a frame takes beside does not count.
const TILES: [usize; 2] = [4, 20];

/// Frames; the fastest counts.
const FRAMES: usize = 300;

/// Pixels of a block that is evaluated at once.
const BLOCK: f64 = 16.0;

/// Floating-point operations of an evaluation at a pixel, a fused one counted as two, at the level that takes least: 3 for the
/// exponent, 8 for its power, 1 for the ceiling, 9 for compositing. Comparisons and whole numbers are not among them.
const OPERATIONS: f64 = 21.0;

/// Rates on one thread.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Roofline {
    /// Pairs of a tile and a Gaussian that reaches one block of it, a second.
    pub pairs: f64,
    /// Evaluations of a Gaussian at a pixel, a second, of Gaussians that cover the tile.
    pub pixels: f64,
    /// Floating-point operations a second in fused multiplications that wait for nothing, with the widest vectors that there
    /// are.
    pub operations: f64,
}

impl Roofline {
    /// Measures tiles of one thread.
    pub fn measure() -> Result<Self, BenchError> {
        let [few, many] = TILES;
        let rate = |whole| -> Result<f64, BenchError> {
            let time = fastest(whole, many)? - fastest(whole, few)?;
            Ok(((many - few) * TILE_GAUSSIANS) as f64 / time.max(1e-9))
        };
        Ok(Self {
            pairs: rate(false)?,
            pixels: 256.0 * rate(true)?,
            operations: operations(),
        })
    }

    /// The share of the roof that a frame's rasterization reaches on `threads`: the time that its
    /// pairs and pixels take at the rates above, by the time that it took. It may exceed 1 where
    /// pairs need less than here.
    pub fn share(&self, drawn: &Drawn, threads: usize) -> f64 {
        let pairs = drawn.counter("tile pairs evaluated");
        let pixels = evaluations(drawn);
        // A pair costs its test and its first block together; what is beyond that is pixels alone.
        let further = (pixels - BLOCK * pairs).max(0.0);
        let per_pixel = ((1.0 / self.pixels) * 256.0 - 1.0 / self.pairs).max(0.0) / (256.0 - BLOCK);
        let roof = pairs / self.pairs + further * per_pixel;
        roof / busy(drawn, threads)
    }

    /// The share of multiplications' rate that a frame's rasterization reaches on `threads`.
    pub fn share_of_operations(&self, drawn: &Drawn, threads: usize) -> f64 {
        OPERATIONS * evaluations(drawn) / busy(drawn, threads) / self.operations
    }
}

/// The seconds that threads had for a frame's rasterization.
fn busy(drawn: &Drawn, threads: usize) -> f64 {
    drawn.counter("raster") * 1e-3 * threads.max(1) as f64
}

/// Evaluations of a Gaussian at a pixel in a frame.
pub fn evaluations(drawn: &Drawn) -> f64 {
    BLOCK * drawn.counter("block evaluations")
}

/// The most floating-point operations a second.
fn operations() -> f64 {
    let level = Level::new();
    let rates = (0..FRAMES).map(|_| {
        let start = Instant::now();
        let count = dispatch!(level, simd => multiply_and_add(simd));
        count / start.elapsed().as_secs_f64()
    });
    rates.fold(0.0, f64::max)
}

/// Works on more sums than a processor's units have on their way at a time; returns how many operations that was.
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

/// The least seconds that some tiles took.
fn fastest(whole: bool, tiles: usize) -> Result<f64, BenchError> {
    let workload = Workload::new(Source::Tiles { whole, tiles }, [16 * tiles as u32, 16]);
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
