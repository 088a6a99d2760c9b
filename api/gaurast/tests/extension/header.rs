//! Tests that the C header agrees with the Rust structures: sizes, offsets and values, as C11 and as C++17.

use crate::names::{LAYOUT, VALUES};
use gaurast_runner::Need;
use std::process::Command;

/// C expressions with their expected values.
fn expectations() -> impl Iterator<Item = (&'static str, i64)> {
    let layout = LAYOUT.iter().map(|&(name, size)| (name, size as i64));
    layout.chain(VALUES.iter().copied())
}

const VULKAN_HEADER: Need = Need::File("/usr/include/vulkan/vulkan.h");

/// Asserts that a file compiles, with the expectations as static assertions.
fn compile(compiler: &str, flags: &[&str], name: &str, assertion: &str) {
    let mut source = String::from("#include <stddef.h>\n#include \"vulkan_gaurast.h\"\n");
    for (expression, value) in expectations() {
        source += &format!("{assertion}((long long)({expression}) == {value}LL, \"{expression}\");\n");
    }
    let file = std::env::temp_dir().join(format!("{}-{name}", std::process::id()));
    std::fs::write(&file, source).expect("written");
    let include = concat!(env!("CARGO_MANIFEST_DIR"), "/../include");
    let output = Command::new(compiler)
        .args(flags)
        .args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only", "-I", include])
        .arg(&file)
        .output();
    std::fs::remove_file(&file).expect("removed");
    let output = output.expect("the compiler runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[gaurast_runner::test(needs = [Need::Program("cc"), VULKAN_HEADER])]
fn the_header_is_c11() {
    compile("cc", &["-std=c11"], "layout.c", "_Static_assert");
}

#[gaurast_runner::test(needs = [Need::Program("c++"), VULKAN_HEADER])]
fn the_header_is_cpp17() {
    compile("c++", &["-std=c++17"], "layout.cpp", "static_assert");
}
