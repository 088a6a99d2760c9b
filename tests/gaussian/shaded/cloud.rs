//! Gaussians as outputs of a vertex program.

use gaurast_tests::oracle::shaded::OracleOutputs;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simdevice::runtime::SimdLevel;

/// The SIMD level that a test's variant names.
pub fn level(case: &gaurast_runner::Case) -> SimdLevel {
    let mut levels = SimdLevel::supported().into_iter();
    let level = levels.find(|(name, _)| *name == case.variant());
    level.expect("a level that the processor has").1
}

/// Gaussians of any shape, on the screen and outside it, some with equal depths.
pub fn cloud(seed: u64, count: usize) -> Vec<OracleOutputs> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count)
        .map(|_| {
            let w: f32 = rng.random_range(0.5..8.0);
            let depth: f32 = rng.random_range(0.0..1.0);
            let ndc: [f32; 2] = std::array::from_fn(|_| rng.random_range(-1.2..1.2));
            let size: f32 = rng.random_range(-2.0f32..3.0).exp();
            let thin: f32 = size * rng.random_range(-5.0f32..0.0).exp();
            let angle: f32 = rng.random_range(0.0..std::f32::consts::PI);
            let (sin, cos) = angle.sin_cos();
            let (long, short) = (size * size, thin * thin);
            let key: f32 = rng.random_range(1.0..4.0);
            OracleOutputs {
                position: [ndc[0] * w, ndc[1] * w, depth * w, w],
                covariance: [
                    long * cos * cos + short * sin * sin,
                    (long - short) * sin * cos,
                    long * sin * sin + short * cos * cos,
                ],
                opacity: rng.random_range(0.02..1.5),
                color: std::array::from_fn(|_| rng.random_range(-0.1..1.0)),
                key: Some((16.0 * key).round() / 16.0),
            }
        })
        .collect()
}
