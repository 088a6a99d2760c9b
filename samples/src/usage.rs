//! What the process uses: processor time and memory, as Linux tells. Elsewhere nothing is known.

use std::fs;
use std::time::Duration;

/// The processor time of all threads that are alive.
pub fn processor_time() -> Option<Duration> {
    let mut sum = 0;
    for task in fs::read_dir("/proc/self/task").ok()? {
        // A thread may have ended since.
        let Ok(text) = fs::read_to_string(task.ok()?.path().join("schedstat")) else {
            continue;
        };
        sum += text.split(' ').next()?.parse::<u64>().ok()?;
    }
    Some(Duration::from_nanos(sum))
}

/// The most bytes of memory that the process has held since [`reset_peak_memory`].
pub fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kibibytes * 1024)
}

/// Begins to look for the peak anew.
pub fn reset_peak_memory() {
    // Where it fails, the peak is that of the whole process.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn work_and_memory_are_seen() {
        let before = processor_time().expect("known");
        let memory = std::hint::black_box(vec![1_u8; 32 << 20]);
        // Other tests' threads may end meanwhile, and take their time with them.
        let is_seen = (0..200).any(|_| {
            let sum: u64 = memory.iter().map(|byte| u64::from(*byte)).sum();
            assert_eq!(sum, 32 << 20);
            processor_time().expect("known") > before
        });
        assert!(is_seen);
        assert!(peak_memory().expect("known") > 32 << 20);
    }
}
