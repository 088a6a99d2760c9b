//! Prints PAPER.md.

fn main() {
    print!("{}", timing_studies::paper::markdown(&timing_studies::paper::report()));
}
