//! Pictures and buffers have the stored hashes at every SIMD level, with any number of threads, and on emulated processors.

use std::process::Command;

use gaurast_exact::{Device, all, stored};
use gaurast_runner::{Case, Need, Variant, is_long, simd_levels};
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

/// Processors of QEMU, whose floating point is software: one with all that QEMU knows, one of AVX2, and one of SSE2.
const PROCESSORS: [&str; 3] = ["max", "Haswell", "Westmere"];

/// One case of so many is made on emulated processors by default, which takes seconds.
const EVERY_EMULATED: usize = 60;

fn processors() -> Vec<Variant> {
    PROCESSORS.map(Variant::new).into()
}

#[gaurast_runner::test(needs = [GLSLANG, Need::Program("qemu-x86_64")], each = processors())]
fn emulated_processors_make_the_stored_ones(processor: &Case) {
    let every = if is_long() { 1 } else { EVERY_EMULATED };
    let output = Command::new("qemu-x86_64")
        .args(["-cpu", processor.variant(), env!("CARGO_BIN_EXE_gaurast-bench")])
        .args(["exact", "--threads", "2", "--check", "--every", &every.to_string()])
        .output()
        .expect("QEMU starts");
    let [text, errors] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
    assert!(output.status.success(), "{text}{errors}");
    assert!(text.contains("are the expected ones"), "{text}{errors}");
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
