//! Opacity compensation, which a cut-off may know where the pipeline does not compensate.

use super::error_model::{ErrorModel, Rounding};

/// The opacity of a Gaussian after compensation for the low-pass filter.
#[derive(Clone, Copy, Debug)]
pub struct CompensatedOpacity {
    /// The opacity.
    pub value: f64,
    /// The bound on its relative error.
    pub error: f64,
}

impl CompensatedOpacity {
    /// The opacity of a Gaussian whose error model has this spread. `area` is the root of the determinant that compensation takes.
    pub(super) fn new(value: f64, area: f64, spread: [f64; 2], rounding: Rounding) -> Self {
        Self { value, error: ErrorModel::new(spread, value, Some(area), rounding).alpha([0.0; 2], 0.0) }
    }
}
