//! The kernel's mode: what it does with depths, and how exact its powers are.

/// The kernel's use of depths: a constant, so that what isn't done costs nothing. Each from [`NO_DEPTH`] on does what
/// those from there to it do; before it are [`FAST_POWERS`] and [`FASTER_POWERS`].
pub(crate) type DepthMode = u8;

/// Nothing: it only finishes the pixels that some Gaussian reaches.
pub(crate) const FIND_REACHED: DepthMode = 0;

/// Composites with powers of two of a cubic.
pub(crate) const FAST_POWERS: DepthMode = 1;

/// Composites with powers of two of a parabola.
pub(crate) const FASTER_POWERS: DepthMode = 2;

/// Composites.
pub(crate) const NO_DEPTH: DepthMode = 3;

/// Leaves out what fails the test.
pub(crate) const TEST_DEPTH: DepthMode = 4;

/// Also finds the median.
pub(crate) const FIND_MEDIAN: DepthMode = 5;

/// And what the mean is made of.
pub(crate) const FIND_MEAN: DepthMode = 6;
