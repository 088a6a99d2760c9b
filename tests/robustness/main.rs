//! Robustness tests: invalid input, failing allocations, and long runs.

mod abort;
mod fuzzing;
mod long_run;
mod sanitizers;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
