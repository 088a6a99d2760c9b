//! The processor time and memory of the process, on Linux. Elsewhere there is no data.

use std::fs;
use std::time::Duration;

#[cfg(target_os = "linux")]
use rustix::time::{ClockId, clock_gettime};

/// The processor time of all threads of the process so far, including ended ones.
pub fn processor_time() -> Option<Duration> {
    // The sum over the threads would lose the time of those that end meanwhile.
    #[cfg(target_os = "linux")]
    return Duration::try_from(clock_gettime(ClockId::ProcessCPUTime)).ok();
    #[cfg(not(target_os = "linux"))]
    None
}

/// The greatest memory use of the process since [`reset_peak_memory`], in bytes.
pub fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kibibytes * 1024)
}

/// Resets the peak of [`peak_memory`].
pub fn reset_peak_memory() {
    // If it fails, the peak is that of the whole process.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_ended_has_spent_its_time() {
        let before = processor_time().expect("known");
        let work = || (0..1_000_000_u64).map(std::hint::black_box).sum::<u64>();
        let during = std::thread::spawn(move || {
            work();
            processor_time().expect("known")
        });
        let during = during.join().expect("no panic");
        assert!(during > before);
        assert!(processor_time().expect("known") > during);
    }

    #[test]
    fn work_and_memory_are_seen() {
        let before = processor_time().expect("known");
        let memory = std::hint::black_box(vec![1_u8; 32 << 20]);
        let sum: u64 = memory.iter().map(|byte| u64::from(*byte)).sum();
        assert_eq!(sum, 32 << 20);
        assert!(processor_time().expect("known") > before);
        assert!(peak_memory().expect("known") > 32 << 20);
    }
}
