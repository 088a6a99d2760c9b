//! What a draw lets the plain kernel leave inexact: powers of two of fewer terms, and contributions that are left out as
//! long as they stay within a budget.
//!
//! Taking a Gaussian away changes a pixel by its transmittance times its alpha times the difference of two colours: its
//! own and that of all behind it. Those that are left out, put back one at a time from front to back, each find in front
//! of them what the exact picture has, and so at most the transmittance that was measured without them: what is spent of
//! a block's budget bounds what its pixels change by.

use super::exp2::{CUBIC, QUADRATIC, exp2_of_negated};
use super::layer::Layer;
use super::{BLOCKS, DepthMode, GaussianTile, NO_DEPTH, Task, Work};
use crate::packet::GaussianState;
use crate::trace::Run;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*};

/// It composites with powers of two of a cubic.
pub(super) const FAST_POWERS: DepthMode = 1;
/// Of a parabola.
pub(super) const FASTER_POWERS: DepthMode = 2;
/// It leaves contributions out.
pub(super) const PRUNE: DepthMode = 3;
/// Both.
pub(super) const PRUNE_WITH_FAST_POWERS: DepthMode = 4;

/// Whether the kernel leaves contributions out.
pub(super) const fn prunes(mode: DepthMode) -> bool {
    matches!(mode, PRUNE | PRUNE_WITH_FAST_POWERS)
}

/// What a state lets the plain kernel do: [`NO_DEPTH`], or what is cheaper.
pub(super) fn mode_of(state: &GaussianState) -> DepthMode {
    let error = state.approximation.exponential_error;
    let prunes = state.approximation.contribution_budget > 0.0;
    match (prunes, error >= CUBIC.error, error >= QUADRATIC.error) {
        (true, false, _) => PRUNE,
        (true, true, _) => PRUNE_WITH_FAST_POWERS,
        (false, _, true) => FASTER_POWERS,
        (false, true, _) => FAST_POWERS,
        _ => NO_DEPTH,
    }
}

/// 2 to the power of `-fall`, as a mode has it.
#[inline(always)]
pub(super) fn power<S: Simd, const MODE: DepthMode>(simd: S, fall: f32x16<S>) -> f32x16<S> {
    match MODE {
        FAST_POWERS | PRUNE_WITH_FAST_POWERS => CUBIC.of_negated(simd, fall),
        FASTER_POWERS => QUADRATIC.of_negated(simd, fall),
        _ => exp2_of_negated(simd, fall),
    }
}

impl GaussianTile {
    /// As [`GaussianTile::composite`], in the task's mode.
    pub(super) fn composite_approximately(
        &mut self,
        level: Level,
        task: &Task<'_>,
        layer: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> Work {
        match task.plain_mode {
            FAST_POWERS => dispatch!(level, simd =>
                self.composite::<_, FAST_POWERS>(simd, task, layer, runs)),
            FASTER_POWERS => dispatch!(level, simd =>
                self.composite::<_, FASTER_POWERS>(simd, task, layer, runs)),
            PRUNE => dispatch!(level, simd =>
                self.composite::<_, PRUNE>(simd, task, layer, runs)),
            _ => dispatch!(level, simd =>
                self.composite::<_, PRUNE_WITH_FAST_POWERS>(simd, task, layer, runs)),
        }
    }
}

/// Of the budget, the most that one contribution may take.
const SHARE: f32 = 0.25;

/// What rounding may add to a fall, with what it may do to a sum of some thousand contributions.
const MARGIN: f32 = 2e-3;

/// What is left of a budget in each block of a tile.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Pruning {
    budget: f32,
    /// What the contributions that were left out may have changed a pixel of a block by.
    spent: [f32; BLOCKS],
    /// The greatest transmittance of a block's unfinished pixels, at the chunk's beginning.
    most: [f32; BLOCKS],
    /// What has fallen less is worth more than its share.
    least_fall: [f32; BLOCKS],
}

impl Pruning {
    pub(super) const fn new(budget: f32) -> Self {
        Self {
            budget,
            spent: [0.0; BLOCKS],
            most: [1.0; BLOCKS],
            least_fall: [f32::INFINITY; BLOCKS],
        }
    }

    /// Looks at the pixels before a chunk. Finishes the blocks all of whose light is within what is left of the budget,
    /// and returns how many those are.
    #[inline(always)]
    pub(super) fn begin_chunk(&mut self, layer: &mut Layer) -> u64 {
        let mut closed = 0;
        for (block, lanes) in layer.transmittance.iter_mut().enumerate() {
            // Ordered like the numbers, and below zero where finished.
            let most = lanes.iter().fold(0, |most, t| most.max(t.to_bits() as i32));
            let most = f32::from_bits(most as u32);
            let left = self.budget - self.spent[block];
            if most > 0.0 && most <= left {
                for t in lanes {
                    *t = -t.abs();
                }
                closed += 1;
            }
            self.most[block] = most;
            let shares = most / left.min(SHARE * self.budget);
            // No more than the logarithm, and within a tenth of it.
            self.least_fall[block] = shares.to_bits() as f32 / (1 << 23) as f32 - 127.0;
        }
        closed
    }

    /// Of the blocks that `may` be reached, those in which a Gaussian is left out whose sum of squares is `least` or more.
    #[inline(always)]
    pub(super) fn leave_out<S: Simd>(
        &mut self,
        simd: S,
        least: f32x16<S>,
        log2_opacity: f32,
        alpha_ceiling: f32,
        may: mask32x16<S>,
    ) -> mask32x16<S> {
        let load = |numbers: &[f32; BLOCKS]| f32x16::from_slice(simd, numbers);
        let fall = least - (log2_opacity + MARGIN);
        let faint = may & fall.simd_ge(load(&self.least_fall));
        if !faint.any_true() {
            return faint;
        }
        let ceiling = f32x16::splat(simd, alpha_ceiling);
        let alpha = exp2_of_negated(simd, fall).min(ceiling);
        let before = load(&self.spent);
        let spent = alpha.mul_add(load(&self.most), before);
        let left_out = faint & spent.simd_le(f32x16::splat(simd, self.budget));
        left_out.select(spent, before).store_slice(&mut self.spent);
        left_out
    }
}
