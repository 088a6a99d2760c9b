//! The document about skips as hardware is up to date with the device.

use gaurast_testkit::shader::GLSLANG;
use std::path::Path;

use gaurast_tests::what_ifs::markdown;

const HOW: &str = "run `cargo run --release -p gaurast-tests --example what_ifs > simdevice/timing/studies/WHAT_IF.md`";

#[gaurast_runner::test(needs = [GLSLANG])]
fn the_document_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../simdevice/timing/studies/WHAT_IF.md");
    let stored = std::fs::read_to_string(path).expect("the document");
    let (generated, _) = markdown();
    for (stored, generated) in stored.lines().zip(generated.lines()) {
        assert_eq!(stored, generated, "{HOW}");
    }
    assert_eq!(stored.lines().count(), generated.lines().count(), "{HOW}");
}
