//! `gaurast-bench`: run time and error of Gaussian draws, compared with the alternatives on a machine without a GPU.

mod arguments;
mod beside;
mod callgrind;
mod commands;
mod counts;
mod error;
mod exact;
mod frames;
mod growth;
mod judge;
mod machine;
mod median;
mod optimizations;
mod output;
mod pair;
mod pareto;
mod path;
mod plot;
mod ply;
mod roofline;
mod worker;
mod workload;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use arguments::{FramesArguments, OptimizationsArguments, ParetoArguments, PathArguments, SweepArguments};
use beside::{BesideArguments, BesideWorkerArguments};
use commands::{CommandsArguments, CommandsWorkerArguments};
use counts::{CountsArguments, CountsError, WorkerArguments};
use error::BenchError;
use exact::ExactArguments;

/// Measures run time and error of this driver's Gaussians, and of quads on lavapipe and on this driver.
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
    /// Draws whole frames and prints the times of their stages.
    Frames(FramesArguments),
    /// Measures a viewer's frames: the first ones, the slowest one of a camera path, and the parts of a cold picture.
    Path(PathArguments),
    /// Sweeps settings and peers over several scenes and plots run time against error.
    Pareto(ParetoArguments),
    /// Measures the growth of time and memory with Gaussians, pixels, overlap and the share outside the picture.
    Growth(SweepArguments),
    /// Measures the time that each optimization saves, and the cost of Gaussians that are not visible.
    Optimizations(OptimizationsArguments),
    /// Compares instructions, hashes of pictures and sizes of functions with stored ones.
    Counts(CountsArguments),
    /// Prints hashes of pictures and buffers that are the same on every machine, or compares them with stored ones.
    Exact(ExactArguments),
    /// Measures workloads of triangles, textures, kernels and small commands beside other drivers.
    Beside(BesideArguments),
    /// Measures the cost of recording draws and creating pipelines, without the device.
    Commands(CommandsArguments),
    /// Draws for the other commands, which start it as a process.
    #[command(hide = true)]
    Worker,
    /// Draws for `counts`, which starts it as a process.
    #[command(hide = true)]
    CountsWorker(WorkerArguments),
    /// Works for `commands`, which starts it as a process.
    #[command(hide = true)]
    CommandsWorker(CommandsWorkerArguments),
    /// Works for `beside`, which starts it as a process.
    #[command(hide = true)]
    BesideWorker(BesideWorkerArguments),
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
        Command::Path(arguments) => path::run(arguments),
        Command::Pareto(arguments) => pareto::run(arguments),
        Command::Growth(arguments) => growth::run(arguments),
        Command::Optimizations(arguments) => optimizations::run(arguments),
        Command::Counts(arguments) => counts::run(arguments).map_err(counts_failed),
        Command::Exact(arguments) => exact::run(arguments).map_err(BenchError::from),
        Command::Worker => worker::run(),
        Command::CountsWorker(arguments) => counts::work(arguments).map_err(counts_failed),
        Command::Commands(arguments) => commands::run(arguments),
        Command::CommandsWorker(arguments) => commands::work(arguments),
        Command::Beside(arguments) => beside::run(arguments),
        Command::BesideWorker(arguments) => beside::work(arguments),
    }
}

fn counts_failed(error: CountsError) -> BenchError {
    BenchError::Counts(error.to_string())
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
