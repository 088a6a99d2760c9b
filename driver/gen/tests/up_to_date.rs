//! The generated files are what the generator writes.

use gaurast_runner::Need;
use registry_gen::{generate, repository};
use std::path::Path;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}

/// The variable that names the registry's file, which `driver/gen/fetch.sh` gets.
const VK_XML: &str = "GAURAST_VK_XML";

#[gaurast_runner::test(needs = [Need::FileOf(VK_XML)])]
fn generated_files_are_up_to_date() {
    let vk_xml = std::env::var_os(VK_XML).expect("a variable that was just looked at");
    let files =
        generate(repository(), Path::new(&vk_xml)).unwrap_or_else(|error| panic!("{error}"));
    assert!(!files.is_empty());
    for file in files {
        let found = std::fs::read_to_string(repository().join(file.path)).unwrap();
        assert!(
            found == file.text,
            "{} is not what the generator writes: run `cargo run -p registry-gen -- $GAURAST_VK_XML`",
            file.path
        );
    }
}
