//! Tests of the runner, which start themselves again with something missing.

use std::process::{Command, ExitCode, Output};

use gaurast_runner::{Case, Missing, Need, Variant, ignore, shards};

/// The variable that is set in the process that a test starts and observes.
const OBSERVED: &str = "GAURAST_RUNNER_OBSERVED";

fn main() -> ExitCode {
    gaurast_runner::main()
}

fn is_observed() -> bool {
    std::env::var_os(OBSERVED).is_some()
}

/// A requirement that exists only in the observed process.
fn if_observed(need: Need) -> Vec<Need> {
    is_observed().then_some(need).into_iter().collect()
}

/// Runs the test again with `arguments` and a value of `GAURAST_TEST_REQUIRE`.
fn observe(case: &Case, requirement: &str, arguments: &[&str]) -> (Output, String) {
    let output = Command::new(std::env::current_exe().expect("a path"))
        .args(["--exact", case.name()])
        .args(arguments)
        .env(OBSERVED, "1")
        .env("GAURAST_TEST_REQUIRE", requirement)
        .env_remove("GAURAST_TEST_DATA")
        .env_remove("GAURAST_TEST_REPORT")
        .output()
        .expect("the test starts itself");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    (output, text)
}

/// Checks that the observed process is ignored for `reason` without a value of `GAURAST_TEST_REQUIRE` and with those in
/// `allowed`, and that it fails with those in `forbidden`.
fn assert_ignored(case: &Case, reason: &str, allowed: &[&str], forbidden: &[&str]) {
    for requirement in [""].iter().chain(allowed) {
        let (output, text) = observe(case, requirement, &[]);
        assert!(output.status.success(), "{text}");
        assert!(text.contains("0 passed; 0 failed; 1 ignored"), "{text}");
        assert!(text.contains(&format!("ignored: 1 ({reason})")), "{text}");
    }
    for requirement in forbidden {
        let (output, text) = observe(case, requirement, &[]);
        assert!(!output.status.success(), "{text}");
        assert!(text.contains("0 passed; 1 failed; 0 ignored"), "{text}");
        assert!(text.contains(reason), "{text}");
    }
}

#[gaurast_runner::test(needs = if_observed(Need::Program("no-such-program")))]
fn a_missing_program_is_ignored_unless_it_is_required(case: &Case) {
    assert!(!is_observed(), "the test ran");
    let reason = "there is no no-such-program";
    assert_ignored(case, reason, &[], &["programs", "all"]);
    let (_, listed) = observe(case, "", &["--list", "--ignored"]);
    assert!(listed.contains(case.name()), "{listed}");
    let (_, listed) = observe(case, "programs", &["--list", "--ignored"]);
    assert!(!listed.contains(case.name()), "{listed}");
}

#[gaurast_runner::test(needs = if_observed(Need::File("/no/such/file")))]
fn a_missing_file_is_ignored_unless_it_is_required(case: &Case) {
    assert!(!is_observed(), "the test ran");
    assert_ignored(case, "there is no /no/such/file", &[], &["programs", "all"]);
}

#[gaurast_runner::test]
fn missing_data_are_ignored_unless_all_is_required(case: &Case) {
    if is_observed() {
        gaurast_runner::data("no/such/file.ply");
        panic!("the test went on");
    }
    let reason = "GAURAST_TEST_DATA is not set";
    assert_ignored(case, reason, &["programs"], &["all"]);
}

#[gaurast_runner::test(needs = if_observed(Need::SimdLevel("no-such-level")))]
fn a_missing_capability_is_never_a_failure(case: &Case) {
    assert!(!is_observed(), "the test ran");
    let reason = "this processor has no no-such-level";
    assert_ignored(case, reason, &["programs", "all"], &[]);
}

#[gaurast_runner::test]
fn a_test_may_find_out_late_that_it_cannot_run(case: &Case) {
    if is_observed() {
        ignore(Missing::Capability, "no such feature");
    }
    assert_ignored(case, "no such feature", &["programs", "all"], &[]);
}

#[gaurast_runner::test(alone)]
fn a_test_alone_is_ignored_as_any_other(case: &Case) {
    assert!(case.is_alone());
    if is_observed() {
        ignore(Missing::Program, "no such program");
    }
    assert_ignored(case, "no such program", &[], &["programs", "all"]);
}

#[gaurast_runner::test(alone)]
fn a_test_alone_fails_as_any_other(case: &Case) {
    assert!(!is_observed(), "on purpose");
    let (output, text) = observe(case, "", &[]);
    assert!(!output.status.success(), "{text}");
    assert!(text.contains("on purpose"), "{text}");
}

#[gaurast_runner::test]
fn a_test_alone_sees_nothing_of_what_others_do_to_the_environment(case: &Case) {
    const CHANGED: &str = "GAURAST_RUNNER_CHANGED";
    if case.is_alone() {
        assert_eq!(std::env::var_os(CHANGED), None);
        assert_eq!(std::env::var("GAURAST_RUNNER_GIVEN").as_deref(), Ok("1"));
        return;
    }
    // SAFETY: all other threads read the environment through the standard library.
    unsafe { std::env::set_var(CHANGED, "1") };
    case.run_alone(|command| {
        command.env("GAURAST_RUNNER_GIVEN", "1");
    });
}

#[gaurast_runner::test]
fn a_requirement_is_one_that_exists(case: &Case) {
    let (output, _) = observe(case, "everything", &[]);
    assert!(!output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("not `everything`"), "{message}");
}

#[gaurast_runner::test(each = vec![Variant::new("this one")])]
fn a_variant_stands_behind_the_name(case: &Case) {
    assert_eq!(case.variant(), "this one");
    assert_eq!(case.name(), "a_variant_stands_behind_the_name [this one]");
}

#[gaurast_runner::test(each = shards(3))]
fn shards_share_the_work(case: &Case) {
    let shard = case.shard();
    assert_eq!(shard.count, 3);
    let range = shard.range(10);
    assert_eq!(range, [0..3, 3..6, 6..10][shard.index]);
    assert_eq!((0..9).filter(|&item| shard.has(item)).count(), 3);
}
