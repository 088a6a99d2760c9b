//! The C sample, built with the system's compiler against the header and the loader, draws the same picture as the Rust
//! sample.

use std::path::{Path, PathBuf};
use std::process::Command;

use gaurast_runner::Need;

/// The build folder of this profile, which holds `examples/` and `deps/`.
fn build_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    test.ancestors().nth(2).expect("deps lies in it").to_owned()
}

/// Runs a command and checks that it succeeds.
fn succeed(command: &mut Command) {
    let output = command.output().expect("the command starts");
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Compiles the C sample.
fn compile(folder: &Path) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = folder.join("hello_gaussians");
    succeed(
        Command::new("cc")
            .args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror"])
            .arg("-I")
            .arg(root.join("../../api/include"))
            .arg(root.join("../c/hello_gaussians.c"))
            .args(["-lvulkan", "-lm", "-o"])
            .arg(&program),
    );
    program
}

#[gaurast_runner::test(needs = [
    Need::Program("cc"),
    Need::File("/usr/include/vulkan/vulkan.h"),
    Need::VulkanLoader,
])]
fn the_c_program_draws_what_the_rust_program_draws() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = compile(folder.path());
    let driver = gaurast_runner::built_library("gaurast-icd", "libvulkan_gaurast.so");
    let manifest = folder.path().join("gaurast_icd.json");
    let text = serde_json::json!({
        "file_format_version": "1.0.0",
        "ICD": {
            "library_path": driver,
            "api_version": "1.3.281",
        },
    });
    std::fs::write(&manifest, text.to_string()).expect("written");
    succeed(
        Command::new(program)
            .current_dir(&folder)
            .env("VK_DRIVER_FILES", &manifest)
            .env("VK_ICD_FILENAMES", &manifest)
            .env_remove("VK_INSTANCE_LAYERS"),
    );
    let sample = build_folder().join("examples/hello_gaussians");
    assert!(
        sample.exists(),
        "there is no {}: `cargo test` builds the samples, unless it is told which tests to build",
        sample.display()
    );
    succeed(Command::new(sample).current_dir(&folder));

    let expected = image::open(folder.path().join("hello_gaussians.png"));
    let expected = expected.expect("the Rust program's picture").to_rgb8();
    let ppm = std::fs::read(folder.path().join("hello_gaussians.ppm")).expect("the picture");
    let header = b"P6\n256 256\n255\n";
    let pixels = ppm.strip_prefix(header).expect("a PPM file of 256x256");
    assert!(pixels == expected.as_raw().as_slice());
    assert!(pixels.iter().any(|&byte| byte > 128));
}
