//! Starting a test again in a process of its own, where the Vulkan loader finds this driver alone.

use ash::vk::TaggedStructure;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Set for the process that runs a test's inside.
const INSIDE: &str = "GAURAST_TEST_INSIDE_LOADER";

/// The shared library that was built with this test.
pub fn library() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    let directories = test.ancestors().skip(1).take(2);
    directories
        .map(|directory| directory.join("libvulkan_gaurast.so"))
        .find(|library| library.exists())
        .expect("cargo builds the shared library beside its tests")
}

/// Writes a manifest for the library.
pub fn manifest(directory: &Path) -> PathBuf {
    let template = include_str!("../../gaurast_icd.json");
    let library = library().to_string_lossy().into_owned();
    let text = template.replace("../target/release/libvulkan_gaurast.so", &library);
    assert!(text.contains(&library), "the template names the library");
    let path = directory.join("gaurast_icd.json");
    std::fs::write(&path, text).expect("a writable directory");
    path
}

/// The extension's structures as the validation layer wants to be told of them in the environment: pairs of type and
/// size, all of them separated by colons.
fn unregistered_structures() -> String {
    use gaurast::vk::{
        GaussianCameraGAURAST as Camera,
        PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features,
        PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties,
        PipelineGaussianApproximationStateCreateInfoGAURAST as Approximation,
        PipelineGaussianStateCreateInfoGAURAST as State,
    };
    [
        (Features::STRUCTURE_TYPE, size_of::<Features<'_>>()),
        (Properties::STRUCTURE_TYPE, size_of::<Properties<'_>>()),
        (State::STRUCTURE_TYPE, size_of::<State<'_>>()),
        (
            Approximation::STRUCTURE_TYPE,
            size_of::<Approximation<'_>>(),
        ),
        (Camera::STRUCTURE_TYPE, size_of::<Camera<'_>>()),
    ]
    .map(|(structure, size)| format!("{}:{size}", structure.as_raw()))
    .join(":")
}

/// Runs `inside` in a process of its own, where the loader finds this driver alone.
pub fn through_the_loader(test: &str, inside: impl FnOnce(ash::Entry)) {
    // SAFETY: the loader is the system's own.
    let entry = match unsafe { ash::Entry::load() } {
        Ok(entry) => entry,
        Err(error) => {
            eprintln!("skipped: there is no Vulkan loader here ({error})");
            return;
        }
    };
    if std::env::var_os(INSIDE).is_some() {
        return inside(entry);
    }
    let directory = tempfile::tempdir().expect("a temporary directory");
    let output = Command::new(std::env::current_exe().expect("the test's own path"))
        .args(["--exact", test, "--nocapture"])
        .env(INSIDE, "1")
        .env("VK_DRIVER_FILES", manifest(directory.path()))
        .env("VK_ICD_FILENAMES", manifest(directory.path()))
        .env("VK_LAYER_CUSTOM_STYPE_LIST", unregistered_structures())
        .output()
        .expect("the test starts itself");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("1 passed"), "{text}");
    for line in text.lines().filter(|line| line.starts_with("skipped:")) {
        eprintln!("{line}");
    }
}
