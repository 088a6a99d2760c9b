//! Gaussians that are not drawn, and the reasons.

/// The reason for which a Gaussian is not drawn at all. A Gaussian is counted under the first reason that holds, in
/// this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkipReason {
    /// A position, scale, quaternion, opacity or coefficient of the drawn degree is not finite.
    NonFinite,
    /// All four components of the quaternion are zero.
    ZeroQuaternion,
    /// A scale is below zero.
    NegativeScale,
    /// The opacity, before compensation, is below the alpha floor.
    OpacityBelowFloor,
    /// `near < z` does not hold.
    Near,
    /// `z < far` does not hold.
    Far,
    /// The mean lies beyond the fold of the lens.
    BeyondFold,
    /// Too few sigma points lie in the picture.
    OutsidePicture,
    /// The determinant of the projected covariance is not positive and finite, or the model matrix is singular.
    DegenerateCovariance,
}

/// The number of skipped Gaussians by the first reason that holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs, reason = "the fields are the reasons of `SkipReason`")]
pub struct SkipCounts {
    pub non_finite: usize,
    pub zero_quaternion: usize,
    pub negative_scale: usize,
    pub opacity_below_floor: usize,
    pub near: usize,
    pub far: usize,
    pub beyond_fold: usize,
    pub outside_picture: usize,
    pub degenerate_covariance: usize,
}

impl SkipCounts {
    /// Counts one Gaussian.
    pub(super) fn count(&mut self, reason: SkipReason) {
        *match reason {
            SkipReason::NonFinite => &mut self.non_finite,
            SkipReason::ZeroQuaternion => &mut self.zero_quaternion,
            SkipReason::NegativeScale => &mut self.negative_scale,
            SkipReason::OpacityBelowFloor => &mut self.opacity_below_floor,
            SkipReason::Near => &mut self.near,
            SkipReason::Far => &mut self.far,
            SkipReason::BeyondFold => &mut self.beyond_fold,
            SkipReason::OutsidePicture => &mut self.outside_picture,
            SkipReason::DegenerateCovariance => &mut self.degenerate_covariance,
        } += 1;
    }

    /// The number of all skipped Gaussians.
    pub fn total(&self) -> usize {
        self.non_finite
            + self.zero_quaternion
            + self.negative_scale
            + self.opacity_below_floor
            + self.near
            + self.far
            + self.beyond_fold
            + self.outside_picture
            + self.degenerate_covariance
    }
}
