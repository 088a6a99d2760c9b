//! The approximations that a draw allows the fast kernel.
//!
//! *Powers of two of fewer terms.* An alpha that errs by a part e of it changes a pixel by that part of what the
//! Gaussian contributes, times the difference of two colours at most; all contributions add up to one.
//!
//! *The transmittance that is left.* What is behind a transmittance of T contributes T at most, whatever it is. A block
//! all of whose pixels have no more than the budget is looked at no further. (To leave out what is faint in front of
//! others, too, needs a sum for each block and a bound of each Gaussian's alpha in it; that took as long as it saved.)

use super::accumulator::{NOT_TERMINATED, TransmittanceBits};
use super::kernel::Kernel;
use super::mode::{DepthMode, FAST_POWERS, FASTER_POWERS, NO_DEPTH};
use crate::simd::exp2::{CUBIC, QUADRATIC};
use crate::state::gaussian::{GaussianApproximation, GaussianState};

/// The approximations of the plain kernel in a draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Approximation {
    /// [`NO_DEPTH`], or what is cheaper.
    pub(crate) powers: DepthMode,
    /// Blocks with no more light are finished.
    pub(crate) light: TransmittanceBits,
}

impl Approximation {
    /// As exactly as it can.
    pub(crate) const EXACT: Self = Self { powers: NO_DEPTH, light: NOT_TERMINATED };

    /// As a state allows it in a mode; all but the plain one are exact.
    pub(crate) fn of(state: &GaussianState, mode: &Kernel<'_>, depth: DepthMode) -> Self {
        if depth != NO_DEPTH || !matches!(mode, Kernel::Fast) {
            return Self::EXACT;
        }
        let GaussianApproximation { exponential_error, contribution_budget } = state.approximation;
        Self {
            powers: if exponential_error >= QUADRATIC.error {
                FASTER_POWERS
            } else if exponential_error >= CUBIC.error {
                FAST_POWERS
            } else {
                NO_DEPTH
            },
            light: TransmittanceBits::of(contribution_budget),
        }
    }
}
