//! `gaurast`: pictures of 3D Gaussian scenes, headless, on a simulated Gaussian rasterizer.

mod args;
mod progress;
mod render;
mod report;
mod simulate;
mod simulate_plot;
mod simulate_report;

use std::process::ExitCode;

use clap::Parser;

use args::{Arguments, Command};

fn main() -> ExitCode {
    // A file that grows beyond the process's limit is an error like a full disk, and no signal.
    #[cfg(unix)]
    // SAFETY: no other thread runs yet, and ignoring a signal runs no code of ours.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("warn")).init();
    let arguments = Arguments::parse();
    let result = match arguments.command.unwrap_or_default() {
        Command::Render(arguments) => render::run(&arguments).map_err(|error| error.to_string()),
        Command::Simulate(arguments) => {
            simulate::run(&arguments).map_err(|error| error.to_string())
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("gaurast: {error}");
            ExitCode::FAILURE
        }
    }
}
