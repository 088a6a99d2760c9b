//! The `gaurast` command.
fn main() {}
