//! The short form of the example `long_run`, in a process that does nothing else, since it watches memory.

use gaurast_tests::long_run;

#[gaurast_runner::test(alone)]
fn two_thousand_frames_neither_drift_nor_grow() {
    let report = long_run::run(2000, |_| ());
    assert_eq!(report.frames, 2000);
}
