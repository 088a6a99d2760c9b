//! The bound of binary16 rasterization's errors, by which everything that looks for splats is widened.

/// The least factor, in 1/px, whose binary16 value has full precision.
pub(crate) const LEAST_HALF_FACTOR: f64 = 1.0 / 16384.0;

/// The greatest `u^2 + v^2` that binary16 rasterization may accept where exact arithmetic accepts `log2_range`, the base-2 logarithm of the ratio of
/// opacity and floor.
///
/// With a unit roundoff of 2^-11, `u` and the two terms of `v` have an error of three units each, and `v` one more. The
/// terms of `v` are at most `|v| + 2 |factor[1] / factor[0]| |u|`, so that thin Gaussians, where they cancel, have the
/// largest error. Sums, exponent, logarithm, power and floor add less than a quarter.
pub(crate) fn binary16_headroom(factor: [f64; 3], log2_range: f64) -> f64 {
    const UNIT: f64 = 1.0 / 2048.0;
    let [a, b, c] = factor.map(f64::abs);
    // NaN has no bound.
    if a.min(c) >= LEAST_HALF_FACTOR {
        let stretch = 1.0 + 8.0 * UNIT * (1.0 + b / a);
        (log2_range + 0.25 + 0.02 * log2_range.abs()) * stretch * stretch
    } else {
        f64::INFINITY
    }
}
