//! Results of calls for which there is no memory.

/// What a call's failure is called, where an application expected success.
pub const RESULTS: [&str; 3] = [
    "ERROR_OUT_OF_HOST_MEMORY",
    "ERROR_OUT_OF_DEVICE_MEMORY",
    "ERROR_DEVICE_LOST",
];
pub const HOST_MEMORY: usize = 0;
pub const DEVICE_MEMORY: usize = 1;
pub const LOST: usize = 2;
