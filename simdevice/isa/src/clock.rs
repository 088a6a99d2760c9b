//! The clock of shaders and timestamps.

use std::sync::LazyLock;
use std::time::Instant;

/// The host's monotonic time since the first call in this process, in nanoseconds.
pub fn host_time() -> u64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_nanos() as u64
}
