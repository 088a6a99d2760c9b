//! The short form of the example `long_run`. It has a process of its own because it measures the process's memory.

use gaurast_tests::long_run;

#[gaurast_runner::test(alone)]
fn two_thousand_frames_neither_drift_nor_grow() {
    let report = long_run::run(2000, |_| ());
    assert_eq!(report.frames, 2000);
}
