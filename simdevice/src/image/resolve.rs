//! Multisample resolve: combines the samples of a texel.

use crate::format::{Format, Numeric};
use crate::state::ResolveMode;
use isa::float::{greatest, least};

/// Resolves a row. `samples` has the registers of each sample's texels, of an aspect of this format, as many as
/// `resolved`. The average of integers is their first sample.
pub fn resolve_row<'a>(
    format: Format,
    mode: ResolveMode,
    samples: impl IntoIterator<Item = &'a [[f32; 4]]>,
    resolved: &mut [[f32; 4]],
) {
    let mut samples = samples.into_iter();
    let Some(first) = samples.next() else {
        return;
    };
    resolved.copy_from_slice(first);
    let mut count = 1.0f32;
    let mut each = |combine: fn(f32, f32) -> f32| {
        for sample in &mut samples {
            count += 1.0;
            for (all, one) in resolved.iter_mut().zip(sample) {
                for (all, one) in all.iter_mut().zip(one) {
                    *all = combine(*all, *one);
                }
            }
        }
    };
    match (mode, format.numeric()) {
        (ResolveMode::SampleZero, _) => {}
        (ResolveMode::Average, Numeric::Uint | Numeric::Sint) => {}
        (ResolveMode::Average, _) => {
            each(|a, b| a + b);
            for component in resolved.as_flattened_mut() {
                *component /= count;
            }
        }
        (ResolveMode::Min, Numeric::Uint) => each(|a, b| unsigned(a, b, u32::min)),
        (ResolveMode::Max, Numeric::Uint) => each(|a, b| unsigned(a, b, u32::max)),
        (ResolveMode::Min, Numeric::Sint) => each(|a, b| signed(a, b, i32::min)),
        (ResolveMode::Max, Numeric::Sint) => each(|a, b| signed(a, b, i32::max)),
        (ResolveMode::Min, _) => each(least),
        (ResolveMode::Max, _) => each(greatest),
    }
}

fn unsigned(a: f32, b: f32, choose: fn(u32, u32) -> u32) -> f32 {
    f32::from_bits(choose(a.to_bits(), b.to_bits()))
}

fn signed(a: f32, b: f32, choose: fn(i32, i32) -> i32) -> f32 {
    let [a, b] = [a, b].map(|bits| bits.to_bits().cast_signed());
    f32::from_bits(choose(a, b).cast_unsigned())
}
