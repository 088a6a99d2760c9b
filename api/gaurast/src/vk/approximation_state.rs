//! How far the colours of a pipeline's Gaussians may be from what the extension defines.

use core::ffi::c_void;
use core::marker::PhantomData;

use ash::vk::{StructureType, TaggedStructure};

use crate::ash_compat::setters;

/// `VkPipelineGaussianApproximationStateCreateInfoGAURAST`: what a pipeline's Gaussians may be drawn
/// the cheaper for.
///
/// Chain it to `VkGraphicsPipelineCreateInfo`, beside
/// [`PipelineGaussianStateCreateInfoGAURAST`](crate::vk::PipelineGaussianStateCreateInfoGAURAST).
/// Without it both numbers are 0, which is the default. Both are permissions: an implementation is
/// free to be closer. Other numbers need `gaussianApproximation`.
///
/// With r the difference of the greatest and the least colour of the Gaussians that are drawn and
/// what is behind them, no pixel's colour changes by more than (`exponential_error` +
/// `contribution_budget`) r, and its alpha by no more than the factor of r; but where an exponential
/// that errs finishes a pixel before another Gaussian than an exact one, `transmittance_floor` /
/// (1 - `alpha_ceiling`) adds to the factor.
#[repr(C)]
#[derive(Copy, Clone, Debug)]
#[must_use]
pub struct PipelineGaussianApproximationStateCreateInfoGAURAST<'a> {
    /// The structure's type.
    pub s_type: StructureType,
    /// The next structure of the chain, or null.
    pub p_next: *const c_void,
    /// The greatest relative error of the exponential that alpha is made of; in \[0, 1\]. Whether
    /// alpha reaches the floor is decided without it.
    pub exponential_error: f32,
    /// What the contributions that are left out at a pixel may add up to: the transmittance in front
    /// of each, times its alpha; in \[0, 1\].
    pub contribution_budget: f32,
    /// The lifetime of the `p_next` chain.
    pub _marker: PhantomData<&'a ()>,
}

impl Default for PipelineGaussianApproximationStateCreateInfoGAURAST<'_> {
    #[inline]
    fn default() -> Self {
        Self {
            s_type: Self::STRUCTURE_TYPE,
            p_next: core::ptr::null(),
            exponential_error: 0.0,
            contribution_budget: 0.0,
            _marker: PhantomData,
        }
    }
}

impl PipelineGaussianApproximationStateCreateInfoGAURAST<'_> {
    setters! {
        exponential_error: f32,
        contribution_budget: f32,
    }
}
