//! The short form of the example `long_run`, in a process that does nothing else.

use gaurast_tests::long_run;

#[test]
fn two_thousand_frames_neither_drift_nor_grow() {
    let report = long_run::run(2000, |_| ());
    println!("{report:?}");
}
