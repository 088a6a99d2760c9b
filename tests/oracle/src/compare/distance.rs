//! The distance of a pixel from a reference.

use crate::oracle::Reference;

/// True if a pixel within the envelope differs from the binary64 result.
pub(super) fn took_other_branch(rgba: [f32; 4], reference: &Reference, index: usize, distance: f64) -> bool {
    reference.alternatives.contains_key(&index) && distance_between(rgba, reference.nominal[index]) > distance
}

/// The distance of a pixel's worst channel from the hull of its outcomes.
pub(super) fn distance_from_envelope(rgba: [f32; 4], reference: &Reference, index: usize) -> f64 {
    let (least, greatest) = reference.envelope(index);
    let outside = |channel: usize| {
        let value = f64::from(rgba[channel]);
        not_nan((least[channel] - value).max(value - greatest[channel]), value)
    };
    (0..4).map(outside).fold(0.0, f64::max)
}

/// The distance of a pixel's worst channel from `expected`.
pub(super) fn distance_between(rgba: [f32; 4], expected: [f64; 4]) -> f64 {
    let difference = |channel: usize| {
        let value = f64::from(rgba[channel]);
        not_nan((value - expected[channel]).abs(), value)
    };
    (0..4).map(difference).fold(0.0, f64::max)
}

/// `distance`, or infinity where `value` is not a number.
fn not_nan(distance: f64, value: f64) -> f64 {
    if value.is_nan() { f64::INFINITY } else { distance }
}
