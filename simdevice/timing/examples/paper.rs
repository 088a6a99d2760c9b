//! Prints PAPER.md.

fn main() {
    print!("{}", timing::paper::markdown());
}
