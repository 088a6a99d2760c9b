//! The conformance cases of the program `gaurast-conformance` on this driver, one test for each chapter.

use gaurast_conformance::{Outcome, all, cases, open, run};
use gaurast_runner::{Case, Variant};

fn chapters() -> Vec<Variant> {
    cases::chapters().map(Variant::new).collect()
}

#[gaurast_runner::test(each = chapters())]
fn every_case_passes(case: &Case) {
    let device = open("embedded").expect("a device");
    let (mut failures, mut passed) = (Vec::new(), 0);
    for one in all() {
        if one.chapter != case.variant() {
            continue;
        }
        match run(&one, &*device) {
            Outcome::Pass(_) => passed += 1,
            // This driver supports one and four samples, and everything else.
            Outcome::NotSupported(what) => {
                assert_eq!(what, "gaussianSampleCounts", "{}", one.path());
            }
            Outcome::Fail(failure) => failures.push(format!("{}: {}", one.path(), failure.message)),
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(passed > 0, "nothing was drawn");
}
