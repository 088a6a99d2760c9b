//! Every scene through the Vulkan loader, which finds this driver by its manifest: the same bits as
//! from the driver that is linked into the process.
//!
//! The loader reads the environment, so the test starts itself again in a process of its own.

use std::path::{Path, PathBuf};
use std::process::Command;

use gaurast_tests::triangles::{Expected, Gpu, OpenError, Output, scenes, shader};

use crate::devices::own;
use crate::sweep::try_draw;

/// Set in the process inside only.
const INSIDE: &str = "GAURAST_TEST_INSIDE";

/// The shared library that was built with this test.
fn library() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    // Tests lie in deps, the library there and, if it was asked for, above.
    let folders = test.ancestors().skip(1).take(2);
    folders
        .map(|folder| folder.join("libvulkan_gaurast.so"))
        .find(|library| library.exists())
        .expect("cargo builds the shared library with the driver")
}

/// Writes a manifest for the library.
fn manifest(folder: &Path) -> PathBuf {
    let manifest = serde_json::json!({
        "file_format_version": "1.0.0",
        "ICD": { "library_path": library(), "api_version": "1.3.281" },
    });
    let path = folder.join("gaurast_icd.json");
    std::fs::write(&path, manifest.to_string()).expect("written");
    path
}

#[test]
fn both_doors_give_the_same_bits() {
    if std::env::var_os(INSIDE).is_some() {
        return inside();
    }
    if !shader::can_compile() {
        eprintln!("skipped: there is no glslangValidator here");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = manifest(folder.path());
    let output = Command::new(std::env::current_exe().expect("the test's own path"))
        .args([
            "--exact",
            "doors::both_doors_give_the_same_bits",
            "--nocapture",
        ])
        .env(INSIDE, "1")
        .env("VK_DRIVER_FILES", &manifest)
        .env("VK_ICD_FILENAMES", &manifest)
        .env_remove("VK_INSTANCE_LAYERS")
        .output()
        .expect("the test starts itself");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("1 passed"), "{text}");
    for line in text.lines().filter(|line| line.starts_with("skipped:")) {
        eprintln!("{line}");
    }
}

fn inside() {
    let loaded = match Gpu::loaded() {
        Ok(gpu) => gpu,
        Err(error @ OpenError::NoLoader(_)) => {
            eprintln!("skipped: {error}");
            return;
        }
        Err(error) => panic!("{error}"),
    };
    let expected = Expected::read();
    let mut drawn = 0;
    for scene in scenes::ALL {
        let both = [own(), &loaded].map(|gpu| try_draw(scene, gpu));
        match both {
            [Ok(embedded), Ok(loaded)] => {
                assert_same(scene.name, &embedded, &loaded);
                drawn += 1;
            }
            // A scene that fails is the sweep's business; it must fail by both doors.
            [Err(_), Err(_)] => {}
            [embedded, loaded] => {
                let words = |result: Result<Output, String>| result.err().unwrap_or_default();
                panic!(
                    "{}: embedded: {}; loaded: {}",
                    scene.name,
                    words(embedded),
                    words(loaded)
                );
            }
        }
    }
    let supported = scenes::ALL
        .iter()
        .filter(|scene| expected.unsupported(scene.name).is_none());
    println!("{drawn} scenes of {} that should be", supported.count());
}

fn assert_same(scene: &str, embedded: &Output, loaded: &Output) {
    assert_eq!(embedded.pictures.len(), loaded.pictures.len());
    for (embedded, loaded) in embedded.pictures.iter().zip(&loaded.pictures) {
        assert!(
            embedded.bytes == loaded.bytes,
            "{scene}: {} differs",
            embedded.name
        );
    }
}
