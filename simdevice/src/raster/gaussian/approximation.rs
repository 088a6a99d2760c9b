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
use super::mode::{DepthMode, Exponential};
use crate::simd::exp2::{CUBIC, QUADRATIC};
use crate::state::gaussian::{GaussianApproximation, GaussianState};

/// The approximations of the fast kernel in a draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Approximation {
    /// The exactness of powers of two.
    pub(crate) exponential: Exponential,
    /// Blocks none of whose pixels has more than this are finished.
    pub(crate) least_transmittance: TransmittanceBits,
}

impl Approximation {
    /// No approximation.
    pub(crate) const EXACT: Self = Self { exponential: Exponential::Exact, least_transmittance: NOT_TERMINATED };

    /// The approximation that a state allows. All kernels but the fast one are exact, and so are all uses of depths.
    pub(crate) fn of(state: &GaussianState, kernel: &Kernel<'_>, depth_mode: DepthMode) -> Self {
        if depth_mode != DepthMode::Composite || !matches!(kernel, Kernel::Fast) {
            return Self::EXACT;
        }
        let GaussianApproximation { exponential_error, contribution_budget } = state.approximation;
        Self {
            exponential: if exponential_error >= QUADRATIC.error {
                Exponential::Quadratic
            } else if exponential_error >= CUBIC.error {
                Exponential::Cubic
            } else {
                Exponential::Exact
            },
            least_transmittance: TransmittanceBits::of(contribution_budget),
        }
    }
}
