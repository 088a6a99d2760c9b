//! What a pipeline lets the device leave inexact.

use super::feature::{APPROXIMATION, require};
use crate::error::Error;
use crate::object::pipeline::GraphicsPipelineInfo;
use crate::registry::features::Features;
use simdevice::state::gaussian::GaussianApproximation;

const STRUCTURE: &str = "VkPipelineGaussianApproximationStateCreateInfoGAURAST";

/// Validates and converts the chain's structure of approximations, if it has one.
pub(super) fn of(
    info: &GraphicsPipelineInfo,
    features: &Features,
) -> Result<GaussianApproximation, Error> {
    let Some(given) = &info.approximation else {
        return Ok(GaussianApproximation::default());
    };
    check(
        "exponentialError",
        "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-exponentialError-value",
        given.exponential_error,
    )?;
    check(
        "contributionBudget",
        "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-contributionBudget-value",
        given.contribution_budget,
    )?;
    let approximation = GaussianApproximation {
        exponential_error: given.exponential_error,
        contribution_budget: given.contribution_budget,
    };
    if approximation != GaussianApproximation::default() {
        let what = "exponentialError or contributionBudget is not 0";
        require(features, APPROXIMATION, what)?;
    }
    Ok(approximation)
}

fn check(name: &str, vuid: &'static str, value: f32) -> Result<(), Error> {
    // A NaN is in no range.
    if (0.0..=1.0).contains(&value) {
        return Ok(());
    }
    let message = format!("{STRUCTURE}: {name} is {value}, but must be at least 0 and at most 1");
    Err(Error::usage(vuid, message))
}
