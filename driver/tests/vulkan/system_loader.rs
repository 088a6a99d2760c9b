//! Starting a test again in a process of its own, where the Vulkan loader finds this driver alone.

use ash::vk::TaggedStructure;
use gaurast_runner::Case;
use std::path::{Path, PathBuf};

/// The shared library, built in the profile of these tests.
pub fn library() -> PathBuf {
    gaurast_runner::built_library("vulkan_gaurast-icd", "libvulkan_gaurast.so")
}

/// Writes a manifest for the library.
pub fn manifest(directory: &Path) -> PathBuf {
    let template = include_str!("../../icd/gaurast_icd.json");
    let library = library().to_string_lossy().into_owned();
    let text = template.replace("../../target/release/libvulkan_gaurast.so", &library);
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

/// Runs `inside` in a process of its own, where the loader finds this driver alone. The test needs the loader.
pub fn through_the_loader(case: &Case, inside: impl FnOnce(ash::Entry)) {
    if case.is_alone() {
        // SAFETY: the loader is the system's own.
        return inside(unsafe { ash::Entry::load() }.expect("the system's loader"));
    }
    let directory = tempfile::tempdir().expect("a temporary directory");
    let manifest = manifest(directory.path());
    case.run_alone(|command| {
        command
            .env("VK_DRIVER_FILES", &manifest)
            .env("VK_ICD_FILENAMES", &manifest)
            .env("VK_LAYER_CUSTOM_STYPE_LIST", unregistered_structures());
    });
}
