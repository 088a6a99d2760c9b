//! The modes of the kernels: constants that the fast kernel is compiled for, so that what is not done costs nothing.

/// The use of depths. From [`DepthMode::Composite`] on, each mode also does what those before it do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DepthMode {
    /// Neither colours nor depths are needed: the pixels that some Gaussian reaches are finished.
    FindReached,
    /// Colours are composited.
    Composite,
    /// Samples that fail the depth test are left out.
    Test,
    /// The median depth is found.
    FindMedian,
    /// The sums that make the mean depth are found.
    FindMean,
    /// The Gaussians that pixels show are found, and the sums that make the mean depth variable.
    Track,
}

impl DepthMode {
    /// True if depths are tested.
    #[inline(always)]
    pub(crate) const fn tests(self) -> bool {
        matches!(self, Self::Test) || self.finds_median()
    }

    /// True if the median depth is found.
    #[inline(always)]
    pub(crate) const fn finds_median(self) -> bool {
        matches!(self, Self::FindMedian) || self.finds_mean()
    }

    /// True if the sums of the mean depth are found.
    #[inline(always)]
    pub(crate) const fn finds_mean(self) -> bool {
        matches!(self, Self::FindMean) || self.tracks()
    }

    /// True if the Gaussians that pixels show are found.
    #[inline(always)]
    pub(crate) const fn tracks(self) -> bool {
        matches!(self, Self::Track)
    }

    /// True if only reached pixels are found.
    #[inline(always)]
    pub(crate) const fn finds_reached(self) -> bool {
        matches!(self, Self::FindReached)
    }
}

/// The exactness of the powers of two that alphas are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exponential {
    /// As exact as binary32 allows.
    Exact,
    /// A cubic polynomial.
    Cubic,
    /// A quadratic polynomial.
    Quadratic,
}

impl Exponential {
    /// True if powers err by more than rounding.
    #[inline(always)]
    pub(crate) const fn is_approximate(self) -> bool {
        !matches!(self, Self::Exact)
    }
}

/// A mode that the fast kernel is compiled for.
pub(crate) trait Mode {
    /// The use of depths.
    const DEPTH: DepthMode;
    /// The exactness of powers of two.
    const EXPONENTIAL: Exponential = Exponential::Exact;
}

/// The mode that finds reached pixels.
pub(crate) struct FindReached;
/// The mode that composites.
pub(crate) struct Composite;
/// The mode that composites with powers of two of a cubic.
pub(crate) struct CompositeByCubic;
/// The mode that composites with powers of two of a parabola.
pub(crate) struct CompositeByQuadratic;
/// The mode that tests depths.
pub(crate) struct TestDepth;
/// The mode that finds the median depth.
pub(crate) struct FindMedian;
/// The mode that finds the median and the mean depth.
pub(crate) struct FindMean;
/// The mode that finds depths, and the Gaussians that pixels show.
pub(crate) struct Track;

impl Mode for FindReached {
    const DEPTH: DepthMode = DepthMode::FindReached;
}

impl Mode for Composite {
    const DEPTH: DepthMode = DepthMode::Composite;
}

impl Mode for CompositeByCubic {
    const DEPTH: DepthMode = DepthMode::Composite;
    const EXPONENTIAL: Exponential = Exponential::Cubic;
}

impl Mode for CompositeByQuadratic {
    const DEPTH: DepthMode = DepthMode::Composite;
    const EXPONENTIAL: Exponential = Exponential::Quadratic;
}

impl Mode for TestDepth {
    const DEPTH: DepthMode = DepthMode::Test;
}

impl Mode for FindMedian {
    const DEPTH: DepthMode = DepthMode::FindMedian;
}

impl Mode for FindMean {
    const DEPTH: DepthMode = DepthMode::FindMean;
}

impl Mode for Track {
    const DEPTH: DepthMode = DepthMode::Track;
}
