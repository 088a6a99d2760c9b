//! The values of a Gaussian pipeline's state that a command may set, too: their conversion, and their rules.

use crate::abi::error::Error;
use gaurast::vk::{GaussianAntialiasingGAURAST, GaussianCutOffGAURAST, GaussianOrderGAURAST};
use simdevice::state::gaussian::{GaussianCutOff, GaussianOrder};

/// The order of a value; None if the value is unknown.
pub(crate) fn order(value: GaussianOrderGAURAST) -> Option<GaussianOrder> {
    match value {
        GaussianOrderGAURAST::VIEW_DEPTH => Some(GaussianOrder::ViewDepth),
        GaussianOrderGAURAST::RADIAL_DISTANCE => Some(GaussianOrder::RadialDistance),
        GaussianOrderGAURAST::PRIMITIVE => Some(GaussianOrder::Primitive),
        GaussianOrderGAURAST::PER_PIXEL => Some(GaussianOrder::PerPixel),
        _ => None,
    }
}

/// True if opacity compensates for the low-pass filter; `None` if the value is unknown.
pub(crate) fn is_compensated(value: GaussianAntialiasingGAURAST) -> Option<bool> {
    match value {
        GaussianAntialiasingGAURAST::DILATE => Some(false),
        GaussianAntialiasingGAURAST::OPACITY_COMPENSATED => Some(true),
        _ => None,
    }
}

/// The cut-off of a value, if it is one.
pub(super) fn cut_off(value: GaussianCutOffGAURAST) -> Option<GaussianCutOff> {
    match value {
        GaussianCutOffGAURAST::NONE => Some(GaussianCutOff::None),
        GaussianCutOffGAURAST::ELLIPSE => Some(GaussianCutOff::Ellipse),
        GaussianCutOffGAURAST::TILE_SQUARE => Some(GaussianCutOff::TileSquare),
        GaussianCutOffGAURAST::TILE_RECTANGLE => Some(GaussianCutOff::TileRectangle),
        GaussianCutOffGAURAST::TILE_RECTANGLE_COMPENSATED => Some(GaussianCutOff::TileRectangleCompensated),
        _ => None,
    }
}

/// The rule of a number.
pub(crate) struct Rule {
    name: &'static str,
    holds: fn(f32) -> bool,
    /// The end of the message: the range in words.
    must_be: &'static str,
}

// Comparisons are false for NaN, which is therefore refused.
pub(crate) const LOW_PASS_VARIANCE: Rule = Rule {
    name: "lowPassVariance",
    holds: |value| value >= 0.0 && value.is_finite(),
    must_be: "finite and not negative",
};
pub(crate) const ALPHA_FLOOR: Rule =
    Rule { name: "alphaFloor", holds: |value| (0.0..=1.0).contains(&value), must_be: "at least 0 and at most 1" };
pub(crate) const ALPHA_CEILING: Rule =
    Rule { name: "alphaCeiling", holds: |value| value > 0.0 && value <= 1.0, must_be: "greater than 0 and at most 1" };
pub(crate) const TRANSMITTANCE_FLOOR: Rule = Rule {
    name: "transmittanceFloor",
    holds: |value| (0.0..1.0).contains(&value),
    must_be: "at least 0 and less than 1",
};
pub(crate) const EXPONENTIAL_ERROR: Rule =
    Rule { name: "exponentialError", holds: |value| (0.0..=1.0).contains(&value), must_be: "at least 0 and at most 1" };
pub(crate) const CONTRIBUTION_BUDGET: Rule = Rule {
    name: "contributionBudget",
    holds: |value| (0.0..=1.0).contains(&value),
    must_be: "at least 0 and at most 1",
};

pub(super) const CUT_OFF_DEVIATIONS: Rule = Rule {
    name: "cutOffDeviations",
    holds: |value| value > 0.0 && value.is_finite(),
    must_be: "finite and greater than 0, since there is a cut-off",
};
pub(super) const COMPENSATION_FLOOR: Rule = Rule {
    name: "compensationFloor",
    holds: |value| (0.0..=1.0).contains(&value),
    must_be: "at least 0 and at most 1",
};

pub(super) const ALPHA: Rule =
    Rule { name: "alpha", holds: |value| value > 0.0 && value.is_finite(), must_be: "finite and greater than 0" };
pub(super) const BETA: Rule = Rule { name: "beta", holds: f32::is_finite, must_be: "finite" };
pub(super) const KAPPA: Rule =
    Rule { name: "kappa", holds: |value| value > -3.0 && value.is_finite(), must_be: "finite and greater than -3" };
pub(super) const PICTURE_MARGIN: Rule =
    Rule { name: "pictureMargin", holds: |value| value >= 0.0, must_be: "at least 0; it may be infinite" };

impl Rule {
    /// Refuses a value that breaks the rule.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] with the id `vuid`.
    pub(crate) fn check(&self, value: f32, vuid: &'static str) -> Result<(), Error> {
        if (self.holds)(value) {
            return Ok(());
        }
        let Self { name, must_be, .. } = self;
        let message = format!("{name} is {value}, but must be {must_be}");
        Err(Error::usage(vuid, message))
    }
}
