//! Mutants of a driver, as a test of the cases themselves: the layer `VK_LAYER_GAURAST_mutants` makes the driver wrong in
//! one way after another, and for each of them some case of its chapter must fail.

use std::ffi::CStr;
use std::path::PathBuf;
use std::sync::OnceLock;

use gaurast_oracle::oracle::error_model::PrecisionClass;

use gaurast_mutants::environment::{MUTANT, REPORT};
use gaurast_mutants::{MUTANTS, Mutant};

use crate::cases::Case;
use crate::device::Device;
use crate::implementation::{Error, Implementation};
use crate::run::{Expectation, Outcome, missing};

/// The layer. The loader must find it, for example by `VK_ADD_LAYER_PATH`.
pub const LAYER: &CStr = c"VK_LAYER_GAURAST_mutants";

/// Cases with the oracle's answers, which are computed once for all mutants.
pub struct Answers {
    precision: Option<PrecisionClass>,
    cases: Vec<(Case, OnceLock<Expectation>)>,
}

impl Answers {
    /// The answers to cases, by a class of precision, or by that of the device.
    pub fn new(cases: Vec<Case>, precision: Option<PrecisionClass>) -> Self {
        Self { precision, cases: cases.into_iter().map(|case| (case, OnceLock::new())).collect() }
    }
}

/// What became of a mutant.
#[derive(Clone, Debug)]
pub struct Catch {
    /// The mutant.
    pub mutant: &'static Mutant,
    /// How often its code was reached.
    pub reached: u64,
    /// The cases that failed: chapter and name.
    pub failures: Vec<(&'static str, String)>,
}

impl Catch {
    /// A sentence about what is wrong: the code was not reached, or no case of the chapter failed.
    pub fn fault(&self) -> Option<String> {
        let Mutant { name, chapter, text } = self.mutant;
        if self.reached == 0 {
            return Some(format!("{name} ({text}): no case of {chapter} reaches its code"));
        }
        let is_caught = self.failures.iter().any(|(own, _)| own == chapter);
        (!is_caught).then(|| format!("{name} ({text}): no case of {chapter} fails"))
    }

    /// The chapters of the failures, with the number of each, those with the most first.
    fn chapters(&self) -> Vec<(&'static str, usize)> {
        let mut chapters: Vec<(&'static str, usize)> = Vec::new();
        for (chapter, _) in &self.failures {
            match chapters.iter_mut().find(|(name, _)| name == chapter) {
                Some((_, count)) => *count += 1,
                None => chapters.push((chapter, 1)),
            }
        }
        chapters.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        chapters
    }

    /// The row of the table of mutants: name, what is wrong, its chapter, and the failing cases.
    pub fn row(&self) -> String {
        let Mutant { name, chapter, text } = self.mutant;
        let own = self.failures.iter().filter(|(of, _)| of == chapter);
        let own: Vec<_> = own.map(|(_, name)| name.as_str()).collect();
        let first = own.first().copied().unwrap_or("none");
        let others = self.chapters().into_iter().filter(|(of, _)| of != chapter);
        let others: Vec<String> = others.map(|(chapter, count)| format!("{chapter} {count}")).collect();
        let others = if others.is_empty() { "-".to_owned() } else { others.join(", ") };
        let name = name.to_lowercase();
        format!("| `{name}` | {text} | `{chapter}` {}: `{first}` | {others} |", own.len())
    }
}

/// The cases on which a mutant is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Those of its chapter, up to the first that fails.
    UntilCaught,
    /// Those of its chapter, and every tenth of the others.
    EveryTenth,
    /// All of them.
    EveryCase,
}

/// Runs a mutant of a driver (see [`Device::open`]) on the cases.
///
/// # Errors
/// If the loader does not find the layer or the driver, or the layer does not say how often the mutant was reached.
pub fn catch(driver: &str, mutant: &'static Mutant, answers: &Answers, extent: Extent) -> Result<Catch, Error> {
    let report = Report::of(mutant);
    let mut failures = Vec::new();
    {
        let device = Device::open_under(driver, &[LAYER])?;
        for (number, (case, expectation)) in answers.cases.iter().enumerate() {
            let is_run = match extent {
                _ if case.chapter == mutant.chapter => true,
                Extent::UntilCaught => false,
                Extent::EveryTenth => number % 10 == 0,
                Extent::EveryCase => true,
            };
            if !is_run || missing(case, &device).is_some() {
                continue;
            }
            let precision = answers.precision.unwrap_or_else(|| device.precision());
            let expectation = expectation.get_or_init(|| Expectation::new(case, precision));
            if let Outcome::Fail(_) = expectation.judge(&device) {
                failures.push((case.chapter, case.name.clone()));
                if extent == Extent::UntilCaught {
                    break;
                }
            }
        }
    }
    Ok(Catch { mutant, reached: report.reached()?, failures })
}

/// The mutant with a name, in any case.
pub fn find(name: &str) -> Option<&'static Mutant> {
    MUTANTS.iter().copied().find(|mutant| mutant.name.eq_ignore_ascii_case(name))
}

/// The file to which the layer writes how often a mutant was reached.
struct Report(PathBuf);

impl Report {
    /// Tells the layer which mutant is active, and where it reports.
    fn of(mutant: &Mutant) -> Self {
        let path = std::env::temp_dir().join(format!("gaurast-mutant-{}", std::process::id()));
        // SAFETY: the layer and the loader read the environment on this thread, as a device is opened; no other thread
        // of this program reads it except through the standard library.
        unsafe {
            std::env::set_var(MUTANT, mutant.name);
            std::env::set_var(REPORT, &path);
        }
        Self(path)
    }

    /// The number that the layer has written as its instance was destroyed.
    fn reached(&self) -> Result<u64, Error> {
        let text = std::fs::read_to_string(&self.0);
        let text = text.map_err(|error| Error(format!("the layer has written no report: {error}")))?;
        text.trim().parse().map_err(|_| Error(format!("the layer's report is no number: {text}")))
    }
}

impl Drop for Report {
    fn drop(&mut self) {
        // It may not be there, if no instance was destroyed.
        let _ = std::fs::remove_file(&self.0);
        // SAFETY: as above.
        unsafe {
            std::env::remove_var(MUTANT);
            std::env::remove_var(REPORT);
        }
    }
}
