//! Workloads on this driver beside other software drivers, by the manifests of those drivers.

mod contender;
mod fixed_costs;
mod list;
mod sampling;
mod workload;

use std::path::PathBuf;

use clap::Args;

use crate::error::BenchError;
use crate::machine::Machine;
use crate::median::median;
use crate::output::{self, Rows, number};
use crate::worker::lavapipe;
use contender::{Contender, Process, Sample};

pub use contender::WorkerArguments as BesideWorkerArguments;

/// The ratio below which a workload counts as this in the mean, so that no single one makes it.
const LEAST_RATIO: f64 = 0.25;

/// The columns of the table.
const COLUMNS: [&str; 11] = [
    "workload",
    "threads",
    "driver",
    "own wall ms",
    "own processor ms",
    "own MiB",
    "driver's wall ms",
    "driver's processor ms",
    "driver's MiB",
    "wall ratio",
    "processor ratio",
];

/// Arguments of the comparison.
#[derive(Args)]
pub struct BesideArguments {
    /// Manifests of the other drivers [default: lavapipe's, if it is installed]
    ///
    /// With `@FOLDER` after it, the driver is loaded with the dynamic linker and the libraries of the system in that
    /// folder, which may be another release of Linux than this one.
    #[arg(long = "driver", value_name = "MANIFEST[@FOLDER]")]
    drivers: Vec<Contender>,

    /// Measures only workloads whose names contain one of these
    #[arg(long, value_name = "NAME,NAME", value_delimiter = ',')]
    only: Vec<String>,

    /// Numbers of threads
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [1, available()])]
    threads: Vec<usize>,

    /// Measured runs of each workload, after a first one
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,

    /// A folder with splats/* and meshes/* [default: GAURAST_TEST_DATA of the environment]
    ///
    /// Workloads whose files are missing are left out.
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,

    /// Writes the rows to this file instead of the standard output
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
}

/// The processors of this process.
fn available() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Measures all workloads, and prints a row for each, each other driver and each number of threads.
///
/// # Errors
/// If a process cannot be started, or a file cannot be written.
pub fn run(arguments: &BesideArguments) -> Result<(), BenchError> {
    let mut drivers = arguments.drivers.clone();
    if drivers.is_empty() {
        drivers.extend(lavapipe().map(Contender::of));
    }
    let mut threads = arguments.threads.clone();
    threads.dedup();
    let mut rows = Rows::new(&COLUMNS);
    for &threads in &threads {
        let mut logarithms = Vec::new();
        for name in list::names() {
            if !arguments.only.is_empty() && !arguments.only.iter().any(|part| name.contains(part)) {
                continue;
            }
            let (measured, ratio) = measure(arguments, &drivers, name, threads)?;
            measured.iter().for_each(|row| eprintln!("{}", row.join(", ")));
            rows.rows.extend(measured);
            logarithms.extend(ratio.map(|ratio| ratio.max(LEAST_RATIO).ln()));
        }
        if logarithms.is_empty() {
            eprintln!("{threads} threads: no workload was measured beside another driver");
            continue;
        }
        let mean = (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp();
        eprintln!(
            "{threads} threads: geometric mean of the processor time of {} workloads, relative to the best other driver: {}",
            logarithms.len(),
            number(mean)
        );
    }
    let text = rows.csv(&Machine::this().line());
    match &arguments.csv {
        Some(path) => output::write(path, &text),
        None => {
            print!("{text}");
            Ok(())
        }
    }
}

/// Measures a workload. Returns a row for each driver that can do it, and the processor time relative to the best of them.
fn measure(
    arguments: &BesideArguments,
    drivers: &[Contender],
    name: &str,
    threads: usize,
) -> Result<(Vec<Vec<String>>, Option<f64>), BenchError> {
    let data = arguments.data.as_deref();
    let mut own = match Process::start(&Contender::Own, name, threads, data) {
        Ok(own) => own,
        Err(error) => {
            eprintln!("{name} is left out: {error}");
            return Ok((Vec::new(), None));
        }
    };
    let mut others = Vec::new();
    for driver in drivers {
        match Process::start(driver, name, threads, data) {
            Ok(other) => others.push((other, Vec::new())),
            Err(error) => eprintln!("{name} is left out beside {driver}: {error}"),
        }
    }
    let mut samples = Vec::new();
    // Contenders take turns, so that other load on the machine affects all of them equally.
    for _ in 0..arguments.runs {
        samples.push(own.run()?);
        others.retain_mut(|(other, samples)| match other.run() {
            Ok(sample) => {
                samples.push(sample);
                true
            }
            Err(error) => {
                eprintln!("{name} is left out beside {}: {error}", other.driver);
                false
            }
        });
    }
    let (mut rows, mut greatest) = (Vec::new(), None);
    for (other, theirs) in &others {
        let (ours, theirs) = (medians(&samples), medians(theirs));
        let [wall, processor] = [0, 1].map(|cost| ours[cost] / theirs[cost]);
        greatest = Some(processor.max(greatest.unwrap_or(0.0)));
        let cells = [ours, theirs].into_iter().flatten().chain([wall, processor]);
        let mut row = vec![name.to_owned(), threads.to_string(), other.driver.clone()];
        row.extend(cells.map(number));
        rows.push(row);
    }
    Ok((rows, greatest))
}

/// Does the work of a worker process.
///
/// # Errors
/// If its input cannot be read.
pub fn work(arguments: &BesideWorkerArguments) -> Result<(), BenchError> {
    contender::work(arguments)
}

/// The medians of wall time, processor time and peak memory.
fn medians(samples: &[Sample]) -> [f64; 3] {
    let of = |cost: fn(&Sample) -> f64| median(samples.iter().map(cost));
    [of(|sample| sample.wall), of(|sample| sample.processor), of(|sample| sample.memory)]
}
