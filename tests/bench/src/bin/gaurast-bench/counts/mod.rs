//! `gaurast-bench counts`: figures that do not depend on the machine's load, compared with stored ones.

mod compute;
mod error;
mod instructions;
mod objects;
mod pictures;
mod report;
mod sizes;
mod stored;
mod triangles;
mod workload;

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use error::Obstacle;
use report::Report;

pub use error::CountsError;
pub use workload::{WORKER, WorkerArguments};

/// The variable that makes a missing program a failure: `programs` or `all`.
const REQUIRE: &str = "GAURAST_TEST_REQUIRE";

/// Arguments of the counts.
#[derive(Args)]
pub struct CountsArguments {
    /// Stores the counts instead of comparing them with the stored ones
    #[arg(long)]
    store: bool,

    /// Repetitions of counting instructions; the median counts, and the spread is printed
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100))]
    runs: u32,

    /// Makes these counts only
    #[arg(long, value_name = "COUNT", value_enum)]
    only: Vec<Part>,

    /// Compares a frame's instructions through the Vulkan loader, by the driver of this manifest, with the embedded
    /// driver's
    #[arg(long, value_name = "ICD.json", conflicts_with_all = ["store", "only"])]
    loader: Option<PathBuf>,
}

/// A kind of counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Instructions of a frame
    Instructions,
    /// Hashes of pictures
    Pictures,
    /// Bytes of the device's functions
    Sizes,
}

/// Makes the counts, and compares them with the stored ones.
pub fn run(arguments: &CountsArguments) -> Result<(), CountsError> {
    if cfg!(debug_assertions) {
        return Err(CountsError::Profile);
    }
    let mut report = Report::default();
    let is_wanted = |part| arguments.only.is_empty() || arguments.only.contains(&part);
    if let Some(manifest) = &arguments.loader {
        if can_count(instructions::obstacle_to_the_loader())? {
            instructions::compare_loader(&mut report, manifest)?;
        }
    } else {
        if is_wanted(Part::Sizes) {
            sizes::check(&mut report, arguments.store)?;
        }
        if is_wanted(Part::Pictures) {
            pictures::check(&mut report, arguments.store)?;
        }
        if is_wanted(Part::Instructions) && can_count(instructions::obstacle())? {
            instructions::check(&mut report, arguments.runs, arguments.store)?;
        }
    }
    match report.failures {
        0 => Ok(()),
        failures => Err(CountsError::Differs(failures)),
    }
}

/// Returns true if there is no obstacle to counting instructions. Otherwise it prints the obstacle, or fails with it if
/// the environment requires all programs.
fn can_count(obstacle: Option<Obstacle>) -> Result<bool, CountsError> {
    let Some(reason) = obstacle else {
        return Ok(true);
    };
    let required = std::env::var(REQUIRE).unwrap_or_default();
    if ["programs", "all"].contains(&required.as_str()) && reason != Obstacle::NoAvx2 {
        return Err(CountsError::Required(reason));
    }
    println!("ignored: instructions are not counted, since {reason}");
    Ok(false)
}

/// Draws in a worker process, for the counts.
pub fn work(arguments: &WorkerArguments) -> Result<(), CountsError> {
    workload::run(arguments)
}
