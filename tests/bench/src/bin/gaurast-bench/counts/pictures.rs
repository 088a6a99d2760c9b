//! Hashes of the workloads' pictures, which are the same at every SIMD level, on one thread and on two.

use std::collections::BTreeMap;
use std::process::Command;

use super::error::CountsError;
use super::report::Report;
use super::stored::Table;
use super::workload::{WORKER, Workload};
use crate::worker::OPTIMIZATIONS;

/// The SIMD levels of `GAURAST_SIMD`.
const LEVELS: [&str; 3] = ["sse2", "avx2", "avx512"];

/// Returns true if this processor has a SIMD level.
pub(super) fn is_there(level: &str) -> bool {
    #[cfg(target_arch = "x86_64")]
    // The feature that a level is named after stands for all features that it needs.
    return match level {
        "avx2" => std::arch::is_x86_feature_detected!("avx2"),
        "avx512" => std::arch::is_x86_feature_detected!("avx512vbmi2"),
        _ => true,
    };
    #[cfg(not(target_arch = "x86_64"))]
    return level == "sse2";
}

/// Compares the hash of every workload's picture at every level, on one thread and on two, with the stored one, or stores those of
/// SSE2.
pub(super) fn check(report: &mut Report, store: bool) -> Result<(), CountsError> {
    let mut table = Table::load(
        "pictures.csv",
        "FNV-1a hashes of the pictures at any SIMD level, on any number of threads. Written by gaurast-bench counts --store.",
        &["workload", "hash"],
        1,
    )?;
    let mut equal = 0;
    for level in LEVELS {
        if !is_there(level) {
            println!("ignored: pictures at {level}, since this processor does not support it");
            continue;
        }
        for threads in [1, 2] {
            for (name, hash) in &hashes(level, threads)? {
                if store && level == LEVELS[0] && threads == 1 {
                    table.set(&[name], &[hash]);
                }
                let stored = table.get(&[name]).map_or("no hash", |cells| &cells[0]);
                if stored == hash {
                    equal += 1;
                } else {
                    report.fail(format!(
                        "{name} at {level}, {threads} threads: the picture is {hash}, and {stored} is stored"
                    ));
                }
            }
        }
    }
    if store {
        table.store()?;
    } else {
        println!("pictures: {equal} are the stored ones");
    }
    Ok(())
}

/// The hash of every workload's picture, by name.
fn hashes(level: &str, threads: usize) -> Result<BTreeMap<String, String>, CountsError> {
    let workloads = Workload::stored().map(Workload::name);
    let output = Command::new(std::env::current_exe()?)
        .args([WORKER, "--frames", "2"])
        .args(workloads)
        .env("GAURAST_SIMD", level)
        .env("GAURAST_THREADS", threads.to_string())
        .env("GAURAST_OPTIMIZATIONS", OPTIMIZATIONS)
        .output()?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(CountsError::Worker(said));
    }
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let words = |line: &str| {
        let (name, hash) = line.split_once(' ')?;
        Some((name.to_owned(), hash.to_owned()))
    };
    said.lines().map(|line| words(line).ok_or_else(|| CountsError::Worker(line.to_owned()))).collect()
}
