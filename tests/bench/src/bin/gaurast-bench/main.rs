//! `gaurast-bench`: run time against error, beside what a machine without a GPU offers otherwise.

mod callgrind;
mod commands;
mod counts;
mod frames;
mod growth;
mod judge;
mod machine;
mod optimizations;
mod output;
mod pair;
mod pareto;
mod plot;
mod roofline;
mod worker;
mod workload;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use gaurast_bench::quads::QuadError;
use gaurast_picture::Size;
use gaurast_render::RenderError;
use gaurast_scene::SceneError;
use gaurast_scene::{camera::CameraError, camera_files::CameraFileError};
use thiserror::Error;

use commands::{CommandsArguments, CommandsWorkerArguments};
use counts::{CountsArguments, CountsError, WorkerArguments};
use worker::Contender;
use workload::{Extra, Source, Workload};

/// Why there are no figures. Displayed as one sentence.
#[derive(Debug, Error)]
pub(crate) enum BenchError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    CameraFile(#[from] CameraFileError),
    #[error(transparent)]
    Camera(#[from] CameraError),
    #[error("{}: there is no camera", .0.display())]
    NoCamera(PathBuf),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Quads(#[from] QuadError),
    #[error(transparent)]
    Counts(#[from] CountsError),
    #[error(transparent)]
    Callgrind(#[from] callgrind::CallgrindError),
    #[error("the driver refused a command: {0}")]
    Refused(#[from] ash::vk::Result),
    #[error("a worker failed: {0}")]
    Worker(String),
    #[error("a worker could not be spoken to: {0}")]
    Io(#[from] std::io::Error),
    #[error("a worker was not understood: {0}")]
    Json(#[from] serde_json::Error),
    #[error("--only: no setting is called \"{0}\"")]
    NoSuchSetting(String),
    #[error("the picture has no camera that the oracle knows")]
    NoOracle,
    #[error("the plot could not be drawn: {0}")]
    Plot(String),
    #[error("the plot could not be written: {0}")]
    Image(#[from] image::ImageError),
}

/// Measures run time and error of this driver's Gaussians, beside quads on lavapipe and on this driver.
///
/// Without a command, `gaurast-bench` does what `gaurast-bench frames` does.
#[derive(Parser)]
#[command(version, max_term_width = 100, args_conflicts_with_subcommands = true)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    frames: FramesArguments,
}

#[derive(Subcommand)]
enum Command {
    /// Draws whole frames and tells their stages.
    Frames(FramesArguments),
    /// Sweeps settings and peers over several scenes and draws run time against error.
    Pareto(ParetoArguments),
    /// How time and memory grow with Gaussians, pixels, overlap and the share off the screen.
    Growth(SweepArguments),
    /// What each optimization saves, and what Gaussians cost that nobody sees.
    Optimizations(OptimizationsArguments),
    /// Holds instructions, hashes of pictures and sizes of functions against stored ones.
    Counts(CountsArguments),
    /// Tells what recording draws and creating pipelines cost, without the device.
    Commands(CommandsArguments),
    /// Draws for the other commands, which start it.
    #[command(hide = true)]
    Worker,
    /// Draws for `counts`, which starts it.
    #[command(hide = true)]
    CountsWorker(WorkerArguments),
    /// Works for `commands`, which starts it.
    #[command(hide = true)]
    CommandsWorker(CommandsWorkerArguments),
}

/// What whole frames cost.
#[derive(Args)]
struct FramesArguments {
    /// Scene files; the synthetic benchmark scene if there is none
    scenes: Vec<PathBuf>,

    /// Gaussians of the synthetic scene
    #[arg(long, value_name = "N", default_value_t = 300_000)]
    count: usize,

    /// The pictures' size in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    size: Size,

    /// Measured frames of each contender, each from another place; a first, cold one comes before
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,

    /// Numbers of threads to draw with
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [1, 2])]
    threads: Vec<usize>,

    /// Frames whose error is measured
    #[arg(long, value_name = "N", default_value_t = 1)]
    judged: u32,

    /// Writes every measured frame as a row
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,

    /// Writes everything
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
}

/// What a sweep takes.
#[derive(Args)]
struct SweepArguments {
    /// Fewer frames of fewer pixels, and nothing that is larger than a million Gaussians
    #[arg(long)]
    quick: bool,

    /// The folder that CSV, JSON, PNG and SVG files go to
    #[arg(
        short,
        long,
        value_name = "FOLDER",
        default_value = "samples/benchmarks"
    )]
    output: PathBuf,

    /// Measured frames of each point
    #[arg(long, value_name = "N")]
    runs: Option<u32>,

    /// Threads to draw with, 0 for one for each processor
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
}

/// Arguments of the comparison of optimizations.
#[derive(Args)]
struct OptimizationsArguments {
    #[command(flatten)]
    sweep: SweepArguments,

    /// Counts instructions of a frame with and without each, by Callgrind, instead of measuring time
    #[arg(long)]
    instructions: bool,

    /// Counts for optimizations of these names only
    #[arg(long, value_name = "NAME", requires = "instructions")]
    only: Vec<String>,
}

/// What the sweep over settings takes.
#[derive(Args)]
struct ParetoArguments {
    #[command(flatten)]
    sweep: SweepArguments,

    /// A folder with cameras/*.json and splats/* [default: GAURAST_TEST_DATA of the environment]
    ///
    /// Cameras that are not there are replaced by an orbit, and scenes that are not there are left out.
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,

    /// Leaves out settings of other names; "as meant" compares with the peers alone
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,

    /// Leaves out a contender: "quads on gaurast", say, which takes most of the time
    #[arg(long, value_name = "NAME", value_parser = contender)]
    without: Vec<Contender>,
}

/// The contender of a name.
fn contender(name: &str) -> Result<Contender, String> {
    let found = CONTENDERS.into_iter().find(|one| one.name() == name);
    found.ok_or_else(|| format!("it is one of {:?}", CONTENDERS.map(Contender::name)))
}

fn main() -> ExitCode {
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("warn")).init();
    let arguments = Arguments::parse();
    let command = (arguments.command).unwrap_or(Command::Frames(arguments.frames));
    match run(&command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("gaurast-bench: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: &Command) -> Result<(), BenchError> {
    match command {
        Command::Frames(arguments) => frames::run(arguments),
        Command::Pareto(arguments) => pareto::run(arguments),
        Command::Growth(arguments) => growth::run(arguments),
        Command::Optimizations(arguments) => optimizations::run(arguments),
        Command::Counts(arguments) => Ok(counts::run(arguments)?),
        Command::Worker => worker::run(),
        Command::CountsWorker(arguments) => Ok(counts::work(arguments)?),
        Command::Commands(arguments) => commands::run(arguments),
        Command::CommandsWorker(arguments) => commands::work(arguments),
    }
}

/// All contenders, in the order of tables.
const CONTENDERS: [Contender; 3] = [
    Contender::Gaurast,
    Contender::QuadsOnLavapipe,
    Contender::QuadsOnGaurast,
];

/// The middle one of `values`, the mean of two if their number is even; NaN of none.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => f64::midpoint(values[n / 2 - 1], values[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median([]).is_nan());
    }
}
