//! Culling within a group: the lanes that may be seen.

use super::frustum::Frustum;
use crate::gaussian::lanes::{Bits, F32_LANES};
use crate::gaussian::read::attributes::Attributes;
use crate::gaussian::read::group::{GroupAttributes, GroupSource, Members};
use crate::gaussian::spherical_harmonics::{Bases, COEFFICIENT_FLOATS};
use crate::gaussian::view::constants::ViewConstants;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use fearless_simd::{Simd, prelude::*};
use std::borrow::Cow;
use std::sync::Arc;

/// A group to project.
#[derive(Clone)]
pub(crate) struct GroupTask<'a> {
    pub(crate) source: GroupSource<'a>,
    /// The frustum of the group's instance, for opacities of at most 1, or of at most the clusters' opacity.
    pub(crate) frustum: Arc<Frustum>,
}

impl GroupTask<'_> {
    /// The frustum that culls the lanes of a group, in the space of its Gaussians; `None` if they are not culled.
    pub(crate) fn frustum_of(&self, group: &GroupAttributes<'_>, view: &ViewConstants) -> Option<Cow<'_, Frustum>> {
        if !view.optimizations.has(Optimization::Bounds) {
            return None;
        }
        let mut frustum = Cow::Borrowed(&*self.frustum);
        if let Members::Run(_) = self.source.members {
            let opacities = &group.attributes.opacity[..group.vertices.len];
            let opacity = opacities.iter().copied().fold(1.0, f32::max);
            if opacity > 1.0 {
                frustum = Cow::Owned(Frustum::new(view, opacity));
            }
        }
        match group.matrices {
            None => Some(frustum),
            // With one matrix for all lanes, the frustum is transformed to the space before it.
            Some(matrices) => frustum.within(matrices.uniform()?).map(Cow::Owned),
        }
    }
}

/// The lanes that no test culls. Counts the others by the first reason to skip them.
#[inline(always)]
pub(crate) fn cull<S: Simd>(
    view: &ViewConstants,
    simd: S,
    group: &GroupAttributes<'_>,
    frustum: Option<&Frustum>,
    counters: &mut Counters,
) -> Bits {
    let len = group.vertices.len;
    counters.add(Counter::GaussiansRead, len as u64);
    let mut kept = Bits::first(len);
    let mut keep = |passed: &Bits, counter: Counter| {
        let skipped = kept.without(passed).count();
        counters.add(counter, skipped);
        kept = kept.and(passed);
        skipped
    };
    if !view.optimizations.has(Optimization::Harmonics) {
        let colored = find_colored(view, simd, group);
        keep(&colored, Counter::SkippedNonFinite);
    }
    if let Some(matrices) = group.matrices {
        keep(&matrices.find_finite(len), Counter::SkippedNonFinite);
    }
    if !group.is_sound {
        let [finite, rotated, positive] = find_sound(simd, group.attributes, len);
        keep(&finite, Counter::SkippedNonFinite);
        keep(&rotated, Counter::SkippedZeroRotation);
        keep(&positive, Counter::SkippedNegativeScale);
    }
    let bright = find_bright(view, simd, group.attributes, len);
    keep(&bright, Counter::SkippedFaint);
    if let Some(frustum) = frustum {
        let outside = frustum.lanes_outside(simd, group.attributes, len);
        let all = Bits::first(len);
        keep(&all.without(&outside.near), Counter::SkippedNear);
        keep(&all.without(&outside.far), Counter::SkippedFar);
        let beside = all.without(&outside.beside);
        let skipped = keep(&beside, Counter::SkippedOffScreen);
        counters.add(Counter::OutsideByBounds, skipped);
    }
    kept
}

/// The lanes with finite spherical harmonics. Reads the coefficients of all lanes.
#[inline(always)]
fn find_colored<S: Simd>(view: &ViewConstants, simd: S, group: &GroupAttributes<'_>) -> Bits {
    let reader = &group.reader;
    let mut coefficients = [0.0; COEFFICIENT_FLOATS];
    let anywhere = Bases::default();
    let mut colored = Bits::default();
    for lane in 0..group.vertices.len {
        reader.read(&group.vertices, lane, &mut coefficients);
        let color = anywhere.color(simd, view.sh_degree, 0, &coefficients);
        colored.set_one(lane, color.is_some());
    }
    colored
}

/// The lanes whose attributes are finite, those with a nonzero rotation, and those without a negative scale.
#[inline(always)]
fn find_sound<S: Simd>(simd: S, attributes: &Attributes, len: usize) -> [Bits; 3] {
    let mut sound = [Bits::default(); 3];
    let zero = S::f32s::splat(simd, 0.0);
    for at in (0..len).step_by(S::f32s::LEN) {
        let load = |lanes: &[f32; F32_LANES]| S::f32s::from_slice(simd, &lanes[at..at + S::f32s::LEN]);
        // Times zero, a number that is not finite becomes NaN, and sums stay NaN.
        let mut nothing = load(&attributes.opacity) * zero;
        let mut least = zero;
        for lanes in &attributes.scale {
            least = least.min(load(lanes));
        }
        let mut largest = zero;
        for lanes in &attributes.rotation {
            let part = load(lanes);
            nothing += part * zero;
            largest = largest.max(part.abs());
        }
        for lanes in attributes.position.iter().chain(&attributes.scale) {
            nothing += load(lanes) * zero;
        }
        let [finite, rotated, positive] = &mut sound;
        finite.set(at, nothing.simd_eq(zero));
        rotated.set(at, largest.simd_gt(zero));
        positive.set(at, least.simd_ge(zero));
    }
    sound
}

/// The lanes whose opacities reach the alpha floor.
#[inline(always)]
fn find_bright<S: Simd>(view: &ViewConstants, simd: S, attributes: &Attributes, len: usize) -> Bits {
    let mut bright = Bits::default();
    // The floor was binary32 originally.
    let floor = S::f32s::splat(simd, view.alpha_floor as f32);
    for at in (0..len).step_by(S::f32s::LEN) {
        let o = S::f32s::from_slice(simd, &attributes.opacity[at..at + S::f32s::LEN]);
        bright.set(at, o.simd_ge(floor));
    }
    bright
}
