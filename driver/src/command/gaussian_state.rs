//! Commands that set the dynamic states of Gaussian pipelines.

use super::buffer::Recorder;
use super::dynamic_state::set;
use crate::abi::error::Error;
use crate::physical_device::limits::MAX_SPHERICAL_HARMONICS_DEGREE;
use crate::pipeline::dynamic_state::DynamicState;
use crate::pipeline::gaussian::values;
use gaurast::vk::{GaussianAntialiasingGAURAST, GaussianOrderGAURAST};

#[doc(alias = "vkCmdSetGaussianOrderGAURAST")]
pub(crate) fn cmd_set_gaussian_order(recorder: &mut Recorder, order: GaussianOrderGAURAST) -> Result<(), Error> {
    let order = values::order(order).ok_or_else(|| {
        Error::usage(
            "VUID-vkCmdSetGaussianOrderGAURAST-order-parameter",
            format!("{order:?} is not a VkGaussianOrderGAURAST"),
        )
    })?;
    set(recorder, DynamicState::GaussianOrder { order })
}

#[doc(alias = "vkCmdSetGaussianAntialiasingGAURAST")]
pub(crate) fn cmd_set_gaussian_antialiasing(
    recorder: &mut Recorder,
    antialiasing: GaussianAntialiasingGAURAST,
) -> Result<(), Error> {
    let compensated = values::is_compensated(antialiasing).ok_or_else(|| {
        Error::usage(
            "VUID-vkCmdSetGaussianAntialiasingGAURAST-antialiasing-parameter",
            format!("{antialiasing:?} is not a VkGaussianAntialiasingGAURAST"),
        )
    })?;
    set(recorder, DynamicState::GaussianAntialiasing { compensated })
}

#[doc(alias = "vkCmdSetGaussianLowPassVarianceGAURAST")]
pub(crate) fn cmd_set_gaussian_low_pass_variance(recorder: &mut Recorder, low_pass_variance: f32) -> Result<(), Error> {
    let vuid = "VUID-vkCmdSetGaussianLowPassVarianceGAURAST-lowPassVariance-90053";
    values::LOW_PASS_VARIANCE.check(low_pass_variance, vuid)?;
    let variance = low_pass_variance;
    set(recorder, DynamicState::GaussianLowPassVariance { variance })
}

#[doc(alias = "vkCmdSetGaussianAlphaFloorGAURAST")]
pub(crate) fn cmd_set_gaussian_alpha_floor(recorder: &mut Recorder, alpha_floor: f32) -> Result<(), Error> {
    let vuid = "VUID-vkCmdSetGaussianAlphaFloorGAURAST-alphaFloor-90054";
    values::ALPHA_FLOOR.check(alpha_floor, vuid)?;
    set(recorder, DynamicState::GaussianAlphaFloor { floor: alpha_floor })
}

#[doc(alias = "vkCmdSetGaussianAlphaCeilingGAURAST")]
pub(crate) fn cmd_set_gaussian_alpha_ceiling(recorder: &mut Recorder, alpha_ceiling: f32) -> Result<(), Error> {
    let vuid = "VUID-vkCmdSetGaussianAlphaCeilingGAURAST-alphaCeiling-90055";
    values::ALPHA_CEILING.check(alpha_ceiling, vuid)?;
    let ceiling = alpha_ceiling;
    set(recorder, DynamicState::GaussianAlphaCeiling { ceiling })
}

#[doc(alias = "vkCmdSetGaussianTransmittanceFloorGAURAST")]
pub(crate) fn cmd_set_gaussian_transmittance_floor(
    recorder: &mut Recorder,
    transmittance_floor: f32,
) -> Result<(), Error> {
    let vuid = "VUID-vkCmdSetGaussianTransmittanceFloorGAURAST-transmittanceFloor-90056";
    values::TRANSMITTANCE_FLOOR.check(transmittance_floor, vuid)?;
    let floor = transmittance_floor;
    set(recorder, DynamicState::GaussianTransmittanceFloor { floor })
}

#[doc(alias = "vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST")]
pub(crate) fn cmd_set_gaussian_spherical_harmonics_degree(
    recorder: &mut Recorder,
    spherical_harmonics_degree: u32,
) -> Result<(), Error> {
    let degree = spherical_harmonics_degree;
    if degree > MAX_SPHERICAL_HARMONICS_DEGREE {
        return Err(Error::usage(
            "VUID-vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST-sphericalHarmonicsDegree-90057",
            format!(
                "sphericalHarmonicsDegree is {degree}, but must be at most maxSphericalHarmonicsDegree \
                 ({MAX_SPHERICAL_HARMONICS_DEGREE})"
            ),
        ));
    }
    set(recorder, DynamicState::GaussianSphericalHarmonicsDegree { degree })
}

#[doc(alias = "vkCmdSetGaussianExponentialErrorGAURAST")]
pub(crate) fn cmd_set_gaussian_exponential_error(recorder: &mut Recorder, exponential_error: f32) -> Result<(), Error> {
    let vuid = "VUID-vkCmdSetGaussianExponentialErrorGAURAST-exponentialError-90058";
    values::EXPONENTIAL_ERROR.check(exponential_error, vuid)?;
    let error = exponential_error;
    set(recorder, DynamicState::GaussianExponentialError { error })
}

#[doc(alias = "vkCmdSetGaussianContributionBudgetGAURAST")]
pub(crate) fn cmd_set_gaussian_contribution_budget(
    recorder: &mut Recorder,
    contribution_budget: f32,
) -> Result<(), Error> {
    let vuid = "VUID-vkCmdSetGaussianContributionBudgetGAURAST-contributionBudget-90059";
    values::CONTRIBUTION_BUDGET.check(contribution_budget, vuid)?;
    let budget = contribution_budget;
    set(recorder, DynamicState::GaussianContributionBudget { budget })
}
