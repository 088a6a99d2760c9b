//! Tests of what happens where something is wrong: input that nobody would write, memory that is wanting, and long runs.

mod faults;
mod fuzzing;
mod long_run;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
