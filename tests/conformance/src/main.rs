//! `gaurast-conformance`: tests an implementation of the Gaussian primitive against the extension's text.

use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use clap::{Parser, ValueEnum};
use gaurast_conformance::mutants::{self, Answers, Extent};
use gaurast_conformance::report::{Counts, Result, junit};
use gaurast_conformance::{Case, Implementation, Outcome, cases, mistakes, open, run};
use gaurast_mutants::MUTANTS;
use gaurast_oracle::oracle::error_model::PrecisionClass;

/// Runs the conformance cases of VK_GAURAST_gaussian_primitive_topology on a driver.
///
/// The exit code is 0 if no case fails, 1 if one does, and 2 if there is nothing to test or this program has a defect.
#[derive(Debug, Parser)]
#[command(name = "gaurast-conformance", version)]
struct Arguments {
    /// `embedded`; the path of a manifest for the Vulkan loader (ICD.json); `second`, the second implementation; `oracle`,
    /// the oracle itself; `loader`, the loader's first device that draws Gaussians; or a part of such a device's name
    #[arg(long, value_name = "NAME|ICD.json", default_value = "embedded")]
    driver: String,
    /// Holds pictures to this class of precision, not to the one that the device says
    #[arg(long, value_enum, value_name = "CLASS")]
    precision: Option<Class>,
    /// Lists the cases and runs none
    #[arg(long)]
    list: bool,
    /// Runs the cases whose name contains PATTERN (`*` stands for any text); may be given more than once
    #[arg(long, value_name = "PATTERN")]
    case: Vec<String>,
    /// Writes the results as JUnit XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Folder for pictures of failures: expected, drawn, and the distance from the envelope
    #[arg(long, value_name = "FOLDER", default_value = "conformance-failures")]
    pictures: PathBuf,
    /// Prints every case, not only failures
    #[arg(long, short)]
    verbose: bool,
    /// Tests the cases: lets the oracle make one mistake after another, and prints the number of cases that fail. The exit
    /// code is 1 if none fails
    #[arg(long, conflicts_with = "driver")]
    mistakes: bool,
    /// Tests the cases: makes the driver wrong in one way after another, by the layer VK_LAYER_GAURAST_mutants, whose
    /// manifest is in FOLDER. The exit code is 1 if a mutant fails no case of its chapter, or its code is not reached
    #[arg(long, value_name = "FOLDER", conflicts_with = "mistakes")]
    mutants: Option<PathBuf>,
    /// With --mutants: this one; may be given more than once
    #[arg(long, value_name = "NAME", requires = "mutants")]
    mutant: Vec<String>,
    /// With --mutants: runs each on all cases and prints a table, not on its chapter's up to the first that fails
    #[arg(long, requires = "mutants")]
    every_case: bool,
    /// Runs the largest draws too, which take long and much memory
    #[arg(long)]
    large: bool,
}

/// A class of precision.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Class {
    /// Projection in binary64 or an equivalent
    Full,
    /// binary32 throughout
    Relaxed,
}

impl From<Class> for PrecisionClass {
    fn from(class: Class) -> Self {
        match class {
            Class::Full => Self::Full,
            Class::Relaxed => Self::Relaxed,
        }
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    // A driver's panic is an outcome of a case, with its message. One of this program ends it.
    let last_panic = Arc::new(Mutex::new(String::new()));
    let heard = Arc::clone(&last_panic);
    std::panic::set_hook(Box::new(move |panic| {
        if let Ok(mut heard) = heard.lock() {
            *heard = panic.to_string();
        }
    }));
    catch_unwind(|| test(&arguments)).unwrap_or_else(|_| {
        let said = last_panic.lock().map(|said| said.clone()).unwrap_or_default();
        eprintln!("a defect of this program: {said}");
        ExitCode::from(2)
    })
}

/// Does what the arguments say.
fn test(arguments: &Arguments) -> ExitCode {
    let mut cases = if arguments.large { cases::with_largest() } else { cases::all() };
    let precision = arguments.precision.map(PrecisionClass::from);
    if !arguments.case.is_empty() {
        cases.retain(|case| arguments.case.iter().any(|pattern| cases::fits(&case.path(), pattern)));
    }
    if arguments.list {
        for case in &cases {
            println!("{}", case.path());
        }
        return ExitCode::SUCCESS;
    }
    if arguments.mistakes {
        return catch_mistakes(&cases, precision.unwrap_or_default());
    }
    if let Some(folder) = &arguments.mutants {
        return catch_mutants(cases, folder, arguments);
    }
    let device = match open(&arguments.driver) {
        Ok(device) => device,
        Err(error) => {
            eprintln!("{}: {}", arguments.driver, error.0);
            return ExitCode::from(2);
        }
    };
    let precision = precision.unwrap_or_else(|| device.precision());
    println!("{} cases on {}, held to {precision:?} precision", cases.len(), device.name());
    let results: Vec<Result> = cases.iter().map(|case| tell(&*device, case, precision, arguments)).collect();
    for chapter in cases::chapters() {
        let own: Vec<&Result> = results.iter().filter(|result| result.chapter == chapter).collect();
        let counts = Counts::of(own.iter().copied());
        if counts.all() > 0 {
            let seconds: f64 = own.iter().map(|result| result.time.as_secs_f64()).sum();
            println!("{chapter:15} {}  {seconds:6.1} s", line(counts));
        }
    }
    let counts = Counts::of(&results);
    println!("{:15} {}", "all", line(counts));
    if let Some(path) = &arguments.junit
        && let Err(error) = std::fs::write(path, junit(device.name(), &results))
    {
        eprintln!("{}: {error}", path.display());
        return ExitCode::from(2);
    }
    if counts.failed > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

/// Prints the number of cases that catch each mistake.
fn catch_mistakes(cases: &[Case], precision: PrecisionClass) -> ExitCode {
    let catches = match mistakes::catches(cases, precision) {
        Ok(catches) => catches,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::FAILURE;
        }
    };
    print!("{}", mistakes::table(&catches));
    let escaped = catches.iter().filter(|catches| catches.all() == 0).count();
    println!("{} mistakes, {escaped} of them escape", catches.len());
    if escaped == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Prints what became of each mutant.
fn catch_mutants(cases: Vec<Case>, folder: &Path, arguments: &Arguments) -> ExitCode {
    // SAFETY: the program has not started a second thread.
    unsafe { std::env::set_var("VK_ADD_LAYER_PATH", folder) };
    let chosen =
        |name: &str| arguments.mutant.is_empty() || arguments.mutant.iter().any(|one| one.eq_ignore_ascii_case(name));
    let answers = Answers::new(cases, arguments.precision.map(PrecisionClass::from));
    let extent = if arguments.every_case { Extent::EveryCase } else { Extent::UntilCaught };
    let (mut all, mut faults) = (0, 0);
    for mutant in MUTANTS.iter().filter(|mutant| chosen(mutant.name)) {
        let catch = match mutants::catch(&arguments.driver, mutant, &answers, extent) {
            Ok(catch) => catch,
            Err(error) => {
                eprintln!("{}: {}", arguments.driver, error.0);
                return ExitCode::from(2);
            }
        };
        all += 1;
        println!("{}", catch.row());
        if let Some(fault) = catch.fault() {
            println!("    {fault}");
            faults += 1;
        }
    }
    println!("{all} mutants, {faults} of them escape");
    if faults == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn line(counts: Counts) -> String {
    let Counts { passed, failed, not_supported } = counts;
    format!("{passed:4} Pass {failed:4} Fail {not_supported:4} NotSupported")
}

/// Runs a case and prints its outcome.
fn tell(device: &dyn Implementation, case: &Case, precision: PrecisionClass, arguments: &Arguments) -> Result {
    let start = Instant::now();
    let outcome = run(case, device, precision);
    let time = start.elapsed();
    match &outcome {
        Outcome::Pass(distance) if arguments.verbose => {
            println!("Pass          {}  ({distance:.1e} from the envelope)", case.path());
        }
        Outcome::NotSupported(what) if arguments.verbose => {
            println!("NotSupported  {}  ({what})", case.path());
        }
        Outcome::Fail(failure) => {
            println!("Fail          {}\n    {}", case.path(), failure.message);
            let picture: &Path = &arguments.pictures.join(format!("{}.png", case.path()));
            if failure.write(picture) {
                println!("    {}", picture.display());
            }
        }
        _ => {}
    }
    Result { chapter: case.chapter, name: case.name.clone(), outcome, time }
}
