//! Pictures and buffers have the stored hashes at every SIMD level and with any number of threads.

use gaurast_exact::{Device, all, stored};
use gaurast_runner::{Case, is_long, simd_levels};
use gaurast_testkit::shader::GLSLANG;

/// The stored lines.
const STORED: &str = include_str!("../../stored/exact.tsv");

/// One case of so many is made by default.
const EVERY: usize = 12;

#[gaurast_runner::test(needs = [GLSLANG], each = simd_levels())]
fn pictures_and_buffers_are_the_stored_ones(level: &Case) {
    let expected = stored(STORED).expect("the list is well-formed");
    let (cases, every) = (all(), if is_long() { 1 } else { EVERY });
    // Each number of threads makes other cases, unless all are made.
    for (first, threads) in [1, 2, 7].into_iter().enumerate() {
        let device = Device::open(level.variant(), threads).expect("a device");
        for case in cases.iter().skip(first % every).step_by(every) {
            let line = case.line(&device).expect("the device has all features");
            assert!(expected.contains(&line), "{} threads: {line} is not in the list", threads);
        }
    }
}

/// The list has a line for each case, and no other.
#[gaurast_runner::test]
fn the_list_is_complete() {
    let lines = stored(STORED).expect("the list is well-formed");
    let cases = all();
    assert_eq!(lines.len(), cases.len());
    for (line, case) in lines.iter().zip(&cases) {
        assert_eq!((line.chapter.as_str(), &line.name), (case.chapter, &case.name));
    }
}
