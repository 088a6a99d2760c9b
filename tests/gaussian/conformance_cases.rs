//! The conformance cases of the program `gaurast-conformance`: on this driver, one test for each chapter; and on oracles that
//! make mistakes, one test for each mistake.

use gaurast_conformance::{Expectation, MISTAKES, Mistake, Oracle, Outcome, all, cases, open, run};
use gaurast_runner::{Case, Variant};
use gaurast_tests::oracle::error_model::PrecisionClass;

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
        match run(&one, &*device, device.precision()) {
            Outcome::Pass(_) => passed += 1,
            // This driver supports one and four samples, and everything else. The oracle has all.
            Outcome::NotSupported(what) => {
                assert_eq!(what, "gaussianSampleCounts", "{}", one.path());
                let answer = Expectation::new(&one, PrecisionClass::Full).judge(&Oracle::default());
                assert!(matches!(answer, Outcome::Pass(_)), "{}: the oracle fails", one.path());
            }
            Outcome::Fail(failure) => failures.push(format!("{}: {}", one.path(), failure.message)),
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(passed > 0, "nothing was drawn");
}

fn each_mistake() -> Vec<Variant> {
    MISTAKES.iter().map(|mistake| Variant::new(mistake.name)).collect()
}

/// Runs the cases of the mistake's chapter up to the first that catches it, in both classes of precision.
#[gaurast_runner::test(each = each_mistake())]
fn a_case_catches_each_mistake(case: &Case) {
    let mistake = MISTAKES.iter().find(|mistake| mistake.name == case.variant()).expect("a variant is a mistake");
    is_caught(mistake, PrecisionClass::Full);
    if !mistake.is_rounding() {
        is_caught(mistake, PrecisionClass::Relaxed);
    }
}

fn is_caught(mistake: &Mistake, precision: PrecisionClass) {
    let all = all();
    let mut expectations = all
        .iter()
        .filter(|case| case.chapter == mistake.chapter)
        .filter_map(|case| case.draw())
        .map(|draw| Expectation::of_draw(draw.held_to(precision)));
    let caught = expectations.find(|expectation| mistake.is_caught(expectation));
    let caught = caught.unwrap_or_else(|| panic!("no case of {} catches it: {precision:?}", mistake.chapter));
    assert!(matches!(caught.judge(&Oracle::default()), Outcome::Pass(_)), "the case fails without the mistake");
}

/// The page has a row for each mistake, and each is caught.
#[gaurast_runner::test]
fn the_page_lists_the_mistakes_and_their_cases() {
    const PAGE: &str = include_str!("../../docs/conformance.md");
    let start = PAGE.find("| Pixel centres").expect("the table");
    let table = &PAGE[start..][..PAGE[start..].find("\n\n").expect("its end") + 1];
    assert_eq!(table.lines().count(), MISTAKES.len());
    for (row, mistake) in table.lines().zip(&MISTAKES) {
        let count = row.strip_prefix(&format!("| {} | ", mistake.text)).and_then(|rest| rest.split(' ').next());
        let count: usize = count.unwrap_or_else(|| panic!("no row: {}", mistake.text)).parse().expect("a number");
        assert!(count > 0, "{row}");
        assert!(row.contains(&format!("{} ", mistake.chapter)) || row.contains("more"), "{row}");
    }
}
