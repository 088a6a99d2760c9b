//! The results of calls that fail for lack of memory.

/// The names of the results.
pub const RESULTS: [&str; 3] = ["ERROR_OUT_OF_HOST_MEMORY", "ERROR_OUT_OF_DEVICE_MEMORY", "ERROR_DEVICE_LOST"];
pub const HOST_MEMORY: usize = 0;
pub const DEVICE_MEMORY: usize = 1;
pub const LOST: usize = 2;
