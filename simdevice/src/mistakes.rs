//! Mistakes that implementations make, for tests of the conformance suite: the device makes one of them on demand. They
//! exist only with the feature `mistakes`.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::packet::GaussianBegin;
use crate::state::gaussian::{GaussianCutOff, GaussianLinearization, GaussianOrder};

macro_rules! mistakes {
    ($($(#[doc = $doc:literal])* $mistake:ident,)*) => {
        /// A mistake.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Mistake {
            $($(#[doc = $doc])* $mistake,)*
        }

        impl Mistake {
            /// All mistakes, each with its description.
            pub const ALL: &[(Self, &str)] = &[$((Self::$mistake, concat!($($doc),*)),)*];
        }
    };
}

mistakes! {
    /// Pixel centres are at corners.
    PixelCentres,
    /// The low-pass is left out.
    NoLowPass,
    /// The opacity is never compensated.
    NoCompensation,
    /// Alphas must be greater than the floor.
    FloorExcluded,
    /// Alphas have no ceiling.
    NoCeiling,
    /// No pixel is finished early.
    NeverFinished,
    /// Gaussians in the near plane are drawn.
    NearIncluded,
    /// Gaussians in the far plane are drawn.
    FarIncluded,
    /// The eye is rounded to binary32.
    EyeRounded,
    /// Slopes of the Jacobian are not clamped.
    SlopesUnclamped,
    /// The radial distance is taken for the view depth.
    RadialIsDepth,
    /// Pixels take one order.
    OneOrder,
    /// The unscented transform is left out.
    NoUnscented,
    /// The mean has no weight in the unscented covariance.
    MeanUnweighted,
    /// Of Gaussians with equal keys the last one is in front.
    TiesReversed,
    /// Keys have more digits than binary32.
    KeysUnrounded,
    /// Keys have 16 bits.
    KeysQuantised,
    /// Directions of harmonics point to the eye.
    HarmonicsReversed,
    /// Functions of degree 4 are left out.
    NoDegree4,
    /// Gaussians end at three standard deviations, in whole tiles.
    ThreeSigmaBox,
    /// A Gaussian's weight is the transmittance behind it times its alpha.
    TransmittanceAfter,
    /// The Gaussian that ends a pixel contributes.
    LastContributes,
    /// The median is the last to contribute at less than a half.
    MedianOfOtherHalf,
    /// Stencil operations run twice.
    StencilTwice,
    /// A depth that fails runs its stencil operation where nothing reaches.
    DepthFailAnywhere,
    /// Depths of integer formats are rounded down.
    DepthRoundedDown,
    /// An orthographic depth is taken from 1/z.
    ParallelDepthInverse,
    /// The viewport's depth range is left out.
    NoDepthRange,
    /// Equal depths pass where only smaller ones do.
    LessOrEqualForLess,
    /// The sample mask is left out.
    NoSampleMask,
    /// Quaternions are x, y, z, w.
    QuaternionScalarLast,
    /// A panorama ends at its edges.
    PanoramaEnds,
    /// Discs are met behind the near plane.
    DiscsBehindNear,
    /// Directions of harmonics are the world's, whatever the model matrix.
    DirectionsOfWorld,
    /// Nothing is cut off.
    NoCutOff,
    /// Cut-offs are ellipses, not tiles.
    CutOffNotInTiles,
    /// The compensation of the opacity has no floor.
    NoCompensationFloor,
}

/// The number of the mistake that is made, plus one; 0 if none is made.
static MADE: AtomicUsize = AtomicUsize::new(0);

/// Makes the device make a mistake from now on, or none.
pub fn make(mistake: Option<Mistake>) {
    MADE.store(mistake.map_or(0, |mistake| mistake as usize + 1), Ordering::SeqCst);
}

impl Mistake {
    /// True if the device makes this mistake.
    #[inline]
    pub fn is_made(self) -> bool {
        MADE.load(Ordering::Relaxed) == self as usize + 1
    }
}

/// Returns the beginning of a set, changed if the mistake that is made concerns it.
pub(crate) fn begin(begin: &GaussianBegin) -> GaussianBegin {
    let mut begin = begin.clone();
    let state = Arc::make_mut(&mut begin.state);
    let camera = &mut begin.camera;
    let made = MADE.load(Ordering::Relaxed).checked_sub(1);
    let Some((mistake, _)) = made.and_then(|made| Mistake::ALL.get(made)) else {
        return begin;
    };
    match mistake {
        Mistake::PixelCentres => camera.principal_point = camera.principal_point.map(|c| c + 0.5),
        Mistake::NoLowPass => state.low_pass_variance = 0.0,
        Mistake::NoCompensation => state.opacity_compensated = false,
        Mistake::NoCutOff => state.footprint.cut_off = GaussianCutOff::None,
        Mistake::CutOffNotInTiles if state.footprint.cut_off != GaussianCutOff::None => {
            state.footprint.cut_off = GaussianCutOff::Ellipse;
        }
        Mistake::NoCompensationFloor => state.footprint.compensation_floor = 0.0,
        Mistake::FloorExcluded => state.alpha_floor = state.alpha_floor.next_up(),
        Mistake::NoCeiling => state.alpha_ceiling = 1.0,
        Mistake::NeverFinished => state.transmittance_floor = 0.0,
        Mistake::NearIncluded => camera.near_plane = camera.near_plane.next_down(),
        Mistake::FarIncluded => camera.far_plane = camera.far_plane.next_up(),
        Mistake::EyeRounded => camera.eye = camera.eye.map(|c| f64::from(c as f32)),
        Mistake::RadialIsDepth if state.order == GaussianOrder::RadialDistance => {
            state.order = GaussianOrder::ViewDepth;
        }
        Mistake::OneOrder if state.order == GaussianOrder::PerPixel => {
            state.order = GaussianOrder::ViewDepth;
        }
        Mistake::NoUnscented => state.linearization = GaussianLinearization::Jacobian,
        Mistake::NoDepthRange => (begin.viewport.min_depth, begin.viewport.max_depth) = (0.0, 1.0),
        _ => {}
    }
    begin
}

/// Returns a sort key with more digits than binary32, or with fewer, if that mistake is made; else `key`.
pub(crate) fn key(depth: f64, key: u32) -> u32 {
    if Mistake::KeysUnrounded.is_made() && depth > 0.0 {
        // Two more digits, for depths from 2^-63 to 2^64.
        (depth.to_bits().saturating_sub(960 << 52) >> 27) as u32
    } else if Mistake::KeysQuantised.is_made() {
        key >> 16
    } else {
        key
    }
}
