//! Rules of the text that are plain data here, so that a test can follow others and see if somebody notices.

use super::error_model::PrecisionClass;

/// The rules that the steps follow, and the precision to which they are followed. The defaults are the text's.
///
/// Steps 6 and 7 in binary16 always follow the text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// The class that tells which roundings are granted.
    pub precision: PrecisionClass,
    /// Step 2: the rounding of depths and distances to sort keys.
    pub key_rounding: KeyRounding,
    /// Step 3: the share of the viewport's side by which a pinhole's slope may exceed the viewport before it is clamped.
    pub slope_margin: f64,
    /// Step 3: true if a panorama goes on at its other edge.
    pub panorama_repeats: bool,
    /// Step 3: the unscented transform's parameter beta, on which the mean's weight in the covariance depends, in place of the
    /// state's.
    pub unscented_beta: Option<f64>,
    /// Step 3: true if nothing is drawn beyond the fold of a lens.
    pub lenses_fold: bool,
    /// Step 3: true if the Jacobian is that of the distorted place, false if it is that of the ideal one.
    pub jacobian_is_distorted: bool,
    /// Step 5: the direction in which spherical harmonics are evaluated.
    pub color_direction: ColorDirection,
    /// Step 6: true if a ray meets a disc only beyond the near plane.
    pub discs_begin_at_near: bool,
    /// Step 7: the one of two Gaussians with equal keys that is in front.
    pub front_of_ties: FrontOfTies,
    /// Step 7: the transmittance by which alpha is multiplied to a weight.
    pub weighed_by: WeighedBy,
    /// Step 7: true if the Gaussian that finishes a pixel contributes to it.
    pub last_contributes: bool,
    /// The transmittances at which a contributing Gaussian may be the median.
    pub median_half: MedianHalf,
    /// True if an orthographic camera's depth is linear in the depth variable, false if it is linear in the reciprocal.
    pub orthographic_depth_is_linear: bool,
    /// True if integer formats hold the greatest number that is not greater than a depth, false if they hold the nearest.
    pub depths_round_down: bool,
    /// Number of times that a stencil operation runs.
    pub stencil_repetitions: u32,
    /// True if the operation of a failed test runs only where a Gaussian reaches the pixel.
    pub failures_need_gaussian: bool,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            precision: PrecisionClass::Full,
            key_rounding: KeyRounding::Binary32,
            slope_margin: 0.15,
            panorama_repeats: true,
            unscented_beta: None,
            lenses_fold: true,
            jacobian_is_distorted: true,
            color_direction: ColorDirection::FromEye,
            discs_begin_at_near: true,
            front_of_ties: FrontOfTies::First,
            weighed_by: WeighedBy::TransmittanceBefore,
            last_contributes: false,
            median_half: MedianHalf::Upper,
            orthographic_depth_is_linear: true,
            depths_round_down: false,
            stencil_repetitions: 1,
            failures_need_gaussian: true,
        }
    }
}

/// The rounding of depths and distances to sort keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyRounding {
    /// To binary32.
    Binary32,
    /// To the upper 16 bits of binary32.
    UpperHalf,
    /// None: keys are binary64.
    Binary64,
}

impl KeyRounding {
    /// The key of a depth or distance.
    pub(super) fn key(self, value: f64) -> f64 {
        match self {
            Self::Binary32 => f64::from(value as f32),
            Self::UpperHalf => f64::from(f32::from_bits((value as f32).to_bits() & 0xFFFF_0000)),
            Self::Binary64 => value,
        }
    }
}

/// The direction in which spherical harmonics are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorDirection {
    /// From the eye to the centre, in the axes of the model.
    FromEye,
    /// From the centre to the eye, in the axes of the model.
    ToEye,
    /// From the eye to the centre, in the axes of the world.
    FromEyeInWorld,
}

/// The one of two Gaussians with equal keys that is in front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrontOfTies {
    /// The first in primitive order.
    First,
    /// The last in primitive order.
    Last,
}

/// The transmittance by which a Gaussian's alpha is multiplied to the weight of its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeighedBy {
    /// That of the Gaussians before it.
    TransmittanceBefore,
    /// That with it.
    TransmittanceBehind,
}

/// The transmittances at which a contributing Gaussian may be a pixel's median, which is the last such Gaussian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MedianHalf {
    /// One half and more.
    Upper,
    /// Less than one half.
    Lower,
}
