//! Robustness tests: invalid input, failing allocations, and long runs.

mod faults;
mod fuzzing;
mod long_run;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
