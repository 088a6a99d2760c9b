//! Options of a translation.

/// Options of a translation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Invocations of a subgroup: a power of two, at most 128.
    pub subgroup_size: u32,
    /// Samples of a pixel that `interpolateAtSample` may name, at the standard positions.
    pub samples: u32,
    /// The length used for a descriptor array without one.
    pub unsized_descriptors: u32,
    /// True if the index of a view is that of the device, which is 0.
    pub view_is_device: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { subgroup_size: 64, samples: 1, unsized_descriptors: 1, view_is_device: false }
    }
}
