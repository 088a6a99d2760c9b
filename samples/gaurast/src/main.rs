//! `gaurast`: a command that draws pictures of 3D Gaussian scenes on a simulated Gaussian rasterizer, without a window.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod args;
mod cameras;
mod cfg_args;
mod command_line;
mod compare;
mod compare_drivers;
mod compliance;
mod devices;
mod drawing;
mod eval;
mod heatmap;
mod icd;
mod info;
mod limits;
mod measures;
mod messages;
mod outputs;
mod photographs;
mod progress;
mod render;
mod renderers;
mod report;
mod sheet;
mod simulate;
mod simulate_machines;
mod simulate_plot;
mod simulate_report;
mod sources;
mod training_size;

use std::process::ExitCode;

use command_line::{Arguments, Command};

/// A failure of the command: a sentence, and the exit code.
struct Failure {
    sentence: String,
    code: u8,
}

/// The exit code of a failure.
const FAILED: u8 = 1;

/// The exit code of an invalid command line, as clap's.
const MISUSE: u8 = 2;

fn main() -> ExitCode {
    // A write beyond the process's file size limit must be an error, as with a full disk, and not a signal.
    #[cfg(unix)]
    // SAFETY: no other thread runs yet, and ignoring a signal runs no code of ours.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
    // Messages of the driver do not come by the log, which `RUST_LOG` turns on for people who look for a defect.
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("off")).init();
    let arguments = Arguments::read();
    let result = run(arguments.command.unwrap_or_default());
    // Some errors of the driver have no result, such as a trace that does not fit on the disk.
    let failure = match (result, messages::last_error()) {
        (Ok(()), None) => return ExitCode::SUCCESS,
        (Ok(()), Some(sentence)) => Failure { sentence, code: FAILED },
        (Err(failure), _) => failure,
    };
    eprintln!("gaurast: {}", failure.sentence);
    ExitCode::from(failure.code)
}

fn run(command: Command) -> Result<(), Failure> {
    let failure =
        |sentence: String, is_misuse: bool| Failure { sentence, code: if is_misuse { MISUSE } else { FAILED } };
    match command {
        Command::Render(arguments) => {
            render::run(&arguments).map_err(|error| failure(error.to_string(), error.is_misuse()))
        }
        Command::Views(arguments) => sheet::run(&arguments).map_err(|error| failure(error.to_string(), false)),
        Command::Compare(arguments) => {
            compare::run(&arguments).map_err(|error| failure(error.to_string(), error.is_misuse()))
        }
        Command::CompareDrivers(arguments) => {
            compare_drivers::run(&arguments).map_err(|error| failure(error.to_string(), false))
        }
        Command::Eval(arguments) => {
            eval::run(&arguments).map_err(|error| failure(error.to_string(), error.is_misuse()))
        }
        Command::Info(arguments) => info::run(&arguments).map_err(|error| failure(error.to_string(), false)),
        Command::Simulate(arguments) => simulate::run(&arguments).map_err(|error| failure(error.to_string(), false)),
        Command::Icd => {
            let lines = icd::lines().map_err(|error| failure(error.to_string(), false))?;
            std::io::Write::write_all(&mut std::io::stdout(), lines.as_bytes())
                .map_err(|error| failure(format!("output: {error}"), false))
        }
        Command::Completions { shell } => {
            use clap::CommandFactory;
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "gaurast", &mut script);
            std::io::Write::write_all(&mut std::io::stdout(), &script)
                .map_err(|error| failure(format!("output: {error}"), false))
        }
        Command::Man { folder } => {
            use clap::CommandFactory;
            std::fs::create_dir_all(&folder)
                .and_then(|()| clap_mangen::generate_to(Arguments::command(), &folder))
                .map_err(|error| failure(format!("{}: {error}", folder.display()), false))
        }
    }
}
