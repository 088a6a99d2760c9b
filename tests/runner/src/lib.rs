//! The runner of the project's tests.
//!
//! It has the command line and the output of Rust's own test runner, and is built on `libtest-mimic`. In addition, a
//! test declares its requirements, its variants, and if it runs in a process of its own. A test whose requirements are
//! missing is *ignored*, with the reason, and does not count as passed.
//!
//! A test executable has `harness = false` and this `main`:
//!
//! ```no_run
//! fn main() -> std::process::ExitCode {
//!     gaurast_runner::main()
//! }
//!
//! #[gaurast_runner::test(needs = [gaurast_runner::Need::Program("glslangValidator")])]
//! fn shaders_compile() {}
//!
//! #[gaurast_runner::test(each = gaurast_runner::simd_levels())]
//! fn every_level_draws_the_same(case: &gaurast_runner::Case) {
//!     assert!(gaurast_runner::SIMD_LEVELS.contains(&case.variant()));
//! }
//! ```
//!
//! Environment variables configure the runner:
//!
//! | variable | meaning |
//! |---|---|
//! | `GAURAST_TEST_DATA` | the folder of test data: splat files, meshes, cameras |
//! | `GAURAST_VK_XML` | the Vulkan registry's `vk.xml`, which `driver/gen/fetch.sh` gets |
//! | `GAURAST_SPIRV_GRAMMAR` | SPIR-V's `spirv.core.grammar.json`, which `driver/gen/fetch.sh` gets |
//! | `GAURAST_TEST_REQUIRE` | `programs`: a missing program or system file is a failure; `all`: missing data too |
//! | `GAURAST_TEST_LONG` | `1`: tests that use a small sample by default run completely |
//! | `GAURAST_TEST_LIBRARIES` | the folder of shared libraries that were built with the tests |
//! | `GAURAST_TEST_REPORT` | a file to which the times of tests and the reasons of ignored ones are appended |

mod case;
mod library;
mod need;
mod report;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use libtest_mimic::{Arguments, Completion, Failed, Trial};

pub use case::{Case, Shard, Variant, shards, simd_levels};
pub use gaurast_runner_macros::test;
#[doc(hidden)]
pub use inventory;
pub use library::{built_example, built_library};
use need::Ignored;
pub use need::{
    Missing, Need, SIMD_LEVELS, data, data_folder, has_simd_level, ignore, is_long, lavapipe_manifest, require,
};
use report::Report;

/// A registered test.
#[derive(Debug)]
pub struct Test {
    /// The path of the test's module.
    pub module: &'static str,
    /// The name of the test's function.
    pub name: &'static str,
    /// A function that lists the test's requirements.
    pub needs: fn() -> Vec<Need>,
    /// A function that lists the test's variants.
    pub each: Option<fn() -> Vec<Variant>>,
    /// True if the test runs in a process of its own.
    pub alone: bool,
    /// The test's function.
    pub run: fn(&Case),
}

inventory::collect!(Test);

/// The kinds of missing requirements that are failures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Requirement {
    None,
    Programs,
    All,
}

impl Requirement {
    /// Reads `GAURAST_TEST_REQUIRE`.
    fn from_environment() -> Result<Self, String> {
        match std::env::var("GAURAST_TEST_REQUIRE").as_deref() {
            Err(std::env::VarError::NotPresent) | Ok("") => Ok(Self::None),
            Ok("programs") => Ok(Self::Programs),
            Ok("all") => Ok(Self::All),
            Ok(other) => Err(format!("GAURAST_TEST_REQUIRE is `programs` or `all`, not `{other}`")),
            Err(error) => Err(format!("GAURAST_TEST_REQUIRE: {error}")),
        }
    }

    fn forbids(self, missing: Missing) -> bool {
        match missing {
            Missing::Program => self != Self::None,
            Missing::Data => self == Self::All,
            Missing::Capability => false,
        }
    }
}

/// Runs the executable's tests. The command line is that of Rust's own runner.
pub fn main() -> ExitCode {
    case::first_environment();
    let arguments = Arguments::from_args();
    let requirement = match Requirement::from_environment() {
        Ok(requirement) => requirement,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::FAILURE;
        }
    };
    let mut tests: Vec<&Test> = inventory::iter::<Test>.into_iter().collect();
    // Tests with a process of their own take longest, so they begin first.
    tests.sort_by_key(|test| (!test.alone, test.module, test.name));
    let report = Arc::new(Report::default());
    let mut trials = Vec::new();
    for test in tests {
        let module = test.module.split_once("::").map(|(_, module)| module);
        let path = module.into_iter().chain([test.name]).collect::<Vec<_>>().join("::");
        let variants = match test.each {
            Some(each) => each().into_iter().map(Some).collect(),
            None => vec![None],
        };
        for variant in variants {
            let name = match &variant {
                Some(variant) => format!("{path} [{}]", variant.name),
                None => path.clone(),
            };
            let mut needs = (test.needs)();
            needs.extend(variant.iter().flat_map(|variant| &variant.needs));
            let case = Case { name, variant: variant.map(|variant| variant.name) };
            trials.push(trial(test, case, needs, requirement, &arguments, &report));
        }
    }
    let conclusion = libtest_mimic::run(&arguments, trials);
    if !arguments.list {
        report.tell();
    }
    conclusion.exit_code()
}

/// Makes a trial of one variant of a test.
fn trial(
    test: &'static Test,
    case: Case,
    needs: Vec<Need>,
    requirement: Requirement,
    arguments: &Arguments,
    report: &Arc<Report>,
) -> Trial {
    let missing = move || needs.iter().find_map(|need| need.missing());
    // Programs that list the tests before running them must see which ones will be ignored.
    let is_ignored = arguments.list && missing().is_some_and(|ignored| !requirement.forbids(ignored.missing));
    let report = Arc::clone(report);
    Trial::ignorable_test(case.name.clone(), move || {
        let ignored = match missing() {
            Some(ignored) => ignored,
            None => {
                let start = Instant::now();
                let outcome = run(test, &case);
                report.add_time(&case.name, start.elapsed());
                match outcome {
                    Ok(()) => return Ok(Completion::Completed),
                    Err(ignored) => ignored,
                }
            }
        };
        if requirement.forbids(ignored.missing) {
            return Err(Failed::from(format!("{}, and GAURAST_TEST_REQUIRE asks for it", ignored.reason)));
        }
        case.say_ignored(&ignored);
        report.add_ignored(&ignored.reason);
        Ok(Completion::ignored_with(ignored.reason))
    })
    .with_ignored_flag(is_ignored)
}

/// Runs a test; returns an error if the test ended itself as ignored.
fn run(test: &Test, case: &Case) -> Result<(), Ignored> {
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        if test.alone && !case.is_alone() {
            case.run_alone(|_| {});
        } else {
            (test.run)(case);
        }
    }));
    outcome.or_else(|payload| match payload.downcast::<Ignored>() {
        Ok(ignored) => Err(*ignored),
        Err(panic) => resume_unwind(panic),
    })
}
