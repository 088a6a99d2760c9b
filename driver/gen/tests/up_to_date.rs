//! Tests that the checked-in files equal the generator's output.

use gaurast_runner::Need;
use registry_gen::{File, generate, generate_grammar, repository};
use std::path::PathBuf;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}

/// The variable that names the registry's file, which `driver/gen/fetch.sh` gets.
const VK_XML: &str = "GAURAST_VK_XML";
/// The variable that names the file of SPIR-V's grammar, which `driver/gen/fetch.sh` gets.
const SPIRV_GRAMMAR: &str = "GAURAST_SPIRV_GRAMMAR";

fn path_in(variable: &str) -> PathBuf {
    std::env::var_os(variable).expect("a variable that was just looked at").into()
}

fn assert_up_to_date(file: &File) {
    let found = std::fs::read_to_string(repository().join(file.path)).unwrap();
    assert!(
        found == file.text,
        "{} is not what the generator writes: run `cargo run -p registry-gen -- $GAURAST_VK_XML $GAURAST_SPIRV_GRAMMAR`",
        file.path
    );
}

#[gaurast_runner::test(needs = [Need::FileOf(VK_XML)])]
fn generated_files_are_up_to_date() {
    let files = generate(repository(), &path_in(VK_XML)).unwrap_or_else(|error| panic!("{error}"));
    assert!(!files.is_empty());
    files.iter().for_each(assert_up_to_date);
}

#[gaurast_runner::test(needs = [Need::FileOf(SPIRV_GRAMMAR)])]
fn the_grammar_is_up_to_date() {
    let file = generate_grammar(&path_in(SPIRV_GRAMMAR)).unwrap_or_else(|error| panic!("{error}"));
    assert_up_to_date(&file);
}
