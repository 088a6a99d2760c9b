//! All kept shaders translate; what is kept is what their sources compile to.

mod common;

use std::process::Command;

use common::{all_shaders, folder, translated};
use vulkan_gaurast::shader::Specialization;

#[test]
fn every_kept_shader_translates() {
    let names = all_shaders();
    assert!(names.len() >= 18);
    for name in names {
        let shader = translated(&name, &Specialization::default());
        assert!(!shader.program.body.is_empty(), "{name}");
    }
}

/// Everything but the header's generator word, which changes with glslang's version.
fn comparable(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if let Some(generator) = bytes.get_mut(8..12) {
        generator.fill(0);
    }
    bytes
}

#[test]
fn kept_binaries_match_their_sources() {
    let compiler = "glslangValidator";
    let version = Command::new(compiler).arg("--version").output();
    match version {
        Ok(output)
            if String::from_utf8_lossy(&output.stdout).contains("Glslang Version: 11:12.") => {}
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            let line = text.lines().next().unwrap_or_default();
            eprintln!("skipped: the binaries are of glslang 12, this is {line}");
            return;
        }
        Err(error) => {
            eprintln!("skipped: {compiler} can't be run: {error}");
            return;
        }
    }
    let scratch = tempfile::tempdir().unwrap();
    for name in all_shaders() {
        let binary = scratch.path().join("out.spv");
        let output = Command::new(compiler)
            .args(["-V", "--target-env", "vulkan1.3", "-o"])
            .arg(&binary)
            .arg(folder().join(&name))
            .output()
            .unwrap();
        assert!(output.status.success(), "{name} doesn't compile");
        let kept = std::fs::read(folder().join(format!("{name}.spv"))).unwrap();
        let fresh = std::fs::read(&binary).unwrap();
        assert!(
            comparable(&kept) == comparable(&fresh),
            "{name}.spv isn't what {name} compiles to"
        );
    }
}
