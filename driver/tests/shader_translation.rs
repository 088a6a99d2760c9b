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

/// Whether spirv-opt is there, in the version that the kept binaries are of.
fn spirv_opt_is_as_kept() -> bool {
    let version = Command::new("spirv-opt").arg("--version").output();
    let found = version.is_ok_and(|output| {
        String::from_utf8_lossy(&output.stdout).contains("SPIRV-Tools v2023.1")
    });
    if !found {
        eprintln!("skipped what spirv-opt makes: SPIRV-Tools v2023.1 isn't there");
    }
    found
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
        let source = name.strip_suffix(".opt").unwrap_or(&name);
        let binary = scratch.path().join("out.spv");
        let output = Command::new(compiler)
            .args(["-V", "--target-env", "vulkan1.3", "-o"])
            .arg(&binary)
            .arg(folder().join(source))
            .output()
            .unwrap();
        assert!(output.status.success(), "{source} doesn't compile");
        if source != name {
            if !spirv_opt_is_as_kept() {
                continue;
            }
            let mut optimizer = Command::new("spirv-opt");
            optimizer
                .args(["-O", "--target-env=vulkan1.3"])
                .arg(&binary);
            let output = optimizer.arg("-o").arg(&binary).output().unwrap();
            assert!(output.status.success(), "{source} can't be optimized");
        }
        let kept = std::fs::read(folder().join(format!("{name}.spv"))).unwrap();
        let fresh = std::fs::read(&binary).unwrap();
        assert!(
            comparable(&kept) == comparable(&fresh),
            "{name}.spv isn't what {source} compiles to"
        );
    }
}

/// Disassemblies that are kept, to be looked at when the translation changes.
const KEPT: [&str; 3] = ["triangle.vert", "mandelbrot.comp", "matrix_product.comp"];

#[test]
fn disassemblies_are_as_kept() {
    for name in KEPT {
        let text = translated(name, &Specialization::default())
            .program
            .to_string();
        let path = folder().join(format!("{name}.ir"));
        if std::env::var_os("GAURAST_BLESS").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let kept = std::fs::read_to_string(&path).unwrap();
        assert_eq!(
            text, kept,
            "{name}: run with GAURAST_BLESS=1 to keep the new disassembly"
        );
    }
}
