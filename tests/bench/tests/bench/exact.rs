//! Pictures and buffers have the stored hashes at every SIMD level, with any number of threads, and on emulated processors.

use std::process::Command;

use gaurast_exact::{Case as ExactCase, Device, all, stored};
use gaurast_runner::{Case, Need, Variant, is_long, simd_levels};
use gaurast_testkit::shader::GLSLANG;

/// The stored lines.
const STORED: &str = include_str!("../../stored/exact.tsv");

/// One case of so many is made by default, and one operation of so many with each number of threads and mode.
const EVERY: usize = 12;
const EVERY_OPERATION: usize = 3;

/// The cases that are made with the first, the second and so on of some numbers of threads or modes: each has others.
fn chosen(cases: &[ExactCase], number: usize) -> impl Iterator<Item = &ExactCase> {
    let of = |is_operation: bool, every: usize| {
        let every = if is_long() { 1 } else { every };
        let cases = cases.iter().filter(move |case| (case.chapter == "operations") == is_operation);
        cases.skip(number % every).step_by(every)
    };
    of(true, EVERY_OPERATION).chain(of(false, EVERY))
}

#[gaurast_runner::test(needs = [GLSLANG], each = simd_levels())]
fn pictures_and_buffers_are_the_stored_ones(level: &Case) {
    let expected = stored(STORED).expect("the list is well-formed");
    let cases = all();
    for (number, threads) in [1, 2, 7].into_iter().enumerate() {
        let device = Device::open(level.variant(), threads).expect("a device");
        for case in chosen(&cases, number) {
            let line = case.line(&device).expect("the device has all features");
            assert!(expected.contains(&line), "{threads} threads: {line} is not in the list");
        }
    }
}

/// The application's threads may round in other ways and flush denormals: nothing changes. Operands of `operations` are
/// made by the device. What other cases draw is computed by the thread that has the modes, so that it may not round in another
/// way itself; without denormals, a thread that flushes them computes the same.
#[cfg(target_arch = "x86_64")]
#[gaurast_runner::test(needs = [GLSLANG])]
fn the_modes_of_the_applications_threads_change_nothing() {
    use gaurast_testkit::control::{Control, FLUSH, ROUNDING};
    let expected = stored(STORED).expect("the list is well-formed");
    let cases = all();
    for (number, mode) in ROUNDING.into_iter().enumerate() {
        let _control = Control::with(mode | FLUSH);
        let device = Device::open("best", 2).expect("a device");
        for case in chosen(&cases, number).filter(|case| case.chapter == "operations") {
            let line = case.line(&device).expect("the device has all features");
            assert!(expected.contains(&line), "{mode:#x}: {line} is not in the list");
        }
    }
    let _control = Control::with(FLUSH);
    let device = Device::open("best", 2).expect("a device");
    for case in chosen(&cases, 0).filter(|case| case.chapter != "files") {
        let line = case.line(&device).expect("the device has all features");
        assert!(expected.contains(&line), "flushed denormals: {line} is not in the list");
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
