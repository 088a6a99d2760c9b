//! The commands that set dynamic states of the extension.

use gaurast::vk::{GaussianAntialiasingGAURAST as Antialiasing, GaussianOrderGAURAST as Order};

use crate::facts::Facts;
use crate::report::Faults;

/// A value must be in `[0, 1]`, or with an end left out.
fn require_share(holds: bool, id: &'static str, name: &str, value: f32, range: &str, faults: &mut Faults) {
    faults.require(holds, id, || format!("{name} is {value}, but must be {range}"));
}

/// Reports whether an order is one.
pub(crate) fn is_order(order: Order) -> bool {
    (Order::VIEW_DEPTH..=Order::PER_PIXEL).contains(&order)
}

/// Reports whether an antialiasing is one.
pub(crate) fn is_antialiasing(antialiasing: Antialiasing) -> bool {
    (Antialiasing::DILATE..=Antialiasing::OPACITY_COMPENSATED).contains(&antialiasing)
}

pub(crate) fn check_order(order: Order, faults: &mut Faults) {
    faults.require(is_order(order), "VUID-vkCmdSetGaussianOrderGAURAST-order-parameter", || {
        format!("order is {}, which is no VkGaussianOrderGAURAST", order.as_raw())
    });
}

pub(crate) fn check_antialiasing(antialiasing: Antialiasing, faults: &mut Faults) {
    faults.require(
        is_antialiasing(antialiasing),
        "VUID-vkCmdSetGaussianAntialiasingGAURAST-antialiasing-parameter",
        || format!("antialiasing is {}, which is no VkGaussianAntialiasingGAURAST", antialiasing.as_raw()),
    );
}

pub(crate) fn check_low_pass_variance(value: f32, faults: &mut Faults) {
    let id = "VUID-vkCmdSetGaussianLowPassVarianceGAURAST-lowPassVariance-90053";
    let holds = value.is_finite() && value >= 0.0;
    require_share(holds, id, "lowPassVariance", value, "finite and not negative", faults);
}

pub(crate) fn check_alpha_floor(value: f32, faults: &mut Faults) {
    let id = "VUID-vkCmdSetGaussianAlphaFloorGAURAST-alphaFloor-90054";
    require_share((0.0..=1.0).contains(&value), id, "alphaFloor", value, "in [0, 1]", faults);
}

pub(crate) fn check_alpha_ceiling(value: f32, faults: &mut Faults) {
    let id = "VUID-vkCmdSetGaussianAlphaCeilingGAURAST-alphaCeiling-90055";
    let holds = value > 0.0 && value <= 1.0;
    require_share(holds, id, "alphaCeiling", value, "in (0, 1]", faults);
}

pub(crate) fn check_transmittance_floor(value: f32, faults: &mut Faults) {
    let id = "VUID-vkCmdSetGaussianTransmittanceFloorGAURAST-transmittanceFloor-90056";
    require_share((0.0..1.0).contains(&value), id, "transmittanceFloor", value, "in [0, 1)", faults);
}

pub(crate) fn check_degree(degree: u32, facts: &Facts, faults: &mut Faults) {
    let id = "VUID-vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST-sphericalHarmonicsDegree-90057";
    faults.require(degree <= facts.max_degree, id, || {
        format!(
            "sphericalHarmonicsDegree is {degree}, but must be at most maxSphericalHarmonicsDegree ({})",
            facts.max_degree
        )
    });
}

pub(crate) fn check_exponential_error(value: f32, faults: &mut Faults) {
    let id = "VUID-vkCmdSetGaussianExponentialErrorGAURAST-exponentialError-90058";
    require_share((0.0..=1.0).contains(&value), id, "exponentialError", value, "in [0, 1]", faults);
}

pub(crate) fn check_contribution_budget(value: f32, faults: &mut Faults) {
    let id = "VUID-vkCmdSetGaussianContributionBudgetGAURAST-contributionBudget-90059";
    require_share((0.0..=1.0).contains(&value), id, "contributionBudget", value, "in [0, 1]", faults);
}
