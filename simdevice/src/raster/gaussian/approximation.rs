//! What a draw lets the plain kernel leave inexact.
//!
//! *Powers of two of fewer terms.* An alpha that errs by a part e of it changes a pixel by that part of what the Gaussian
//! contributes, times the difference of two colours at most; all contributions add up to one.
//!
//! *Light that is left.* What is behind a transmittance of T contributes T at most, whatever it is. A block all of whose
//! pixels have no more than the budget is looked at no further. (To leave out what is faint in front of others, too, needs
//! a sum for each block and a bound of each Gaussian's alpha in it; that took as long as it saved.)

use super::layer::{ANY_LIGHT, Light};
use super::{DepthMode, GaussianTile, NO_DEPTH, Task, TileMode, Work};
use crate::simd::exp2::{CUBIC, QUADRATIC, exp2_of_negated};
use crate::state::gaussian::{GaussianApproximation, GaussianState};
use crate::stats::recorder::Run;
use devmem::dispatch;
use fearless_simd::{Level, Simd, f32x16};

/// It composites with powers of two of a cubic.
pub(super) const FAST_POWERS: DepthMode = 1;
/// Of a parabola.
pub(super) const FASTER_POWERS: DepthMode = 2;

/// How the plain kernel goes about a draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// [`NO_DEPTH`], or what is cheaper.
    powers: DepthMode,
    /// Blocks with no more light are finished.
    pub(super) light: Light,
}

impl Way {
    /// As exactly as it can.
    pub(super) const EXACT: Self = Self {
        powers: NO_DEPTH,
        light: ANY_LIGHT,
    };

    /// As a state allows it in a mode; all but the plain one are exact.
    pub(super) fn of(state: &GaussianState, mode: &TileMode<'_>, depth: DepthMode) -> Self {
        if depth != NO_DEPTH || !matches!(mode, TileMode::Fast) {
            return Self::EXACT;
        }
        let GaussianApproximation {
            exponential_error,
            contribution_budget,
        } = state.approximation;
        Self {
            powers: if exponential_error >= QUADRATIC.error {
                FASTER_POWERS
            } else if exponential_error >= CUBIC.error {
                FAST_POWERS
            } else {
                NO_DEPTH
            },
            light: Light::of(contribution_budget),
        }
    }

    /// Whether powers of two have fewer terms.
    pub(super) fn has_fast_powers(self) -> bool {
        self.powers != NO_DEPTH
    }
}

/// 2 to the power of `-fall`, as a mode has it.
#[inline(always)]
pub(super) fn power<S: Simd>(simd: S, mode: DepthMode, fall: f32x16<S>) -> f32x16<S> {
    match mode {
        FAST_POWERS => CUBIC.of_negated(simd, fall),
        FASTER_POWERS => QUADRATIC.of_negated(simd, fall),
        _ => exp2_of_negated(simd, fall),
    }
}

impl GaussianTile {
    /// As [`GaussianTile::composite`], with the task's fast powers.
    pub(super) fn composite_with_fast_powers(
        &mut self,
        level: Level,
        task: &Task<'_>,
        layer: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> Work {
        match task.way.powers {
            FASTER_POWERS => dispatch!(level, simd =>
                self.composite::<_, FASTER_POWERS>(simd, task, layer, runs)),
            _ => dispatch!(level, simd =>
                self.composite::<_, FAST_POWERS>(simd, task, layer, runs)),
        }
    }
}
