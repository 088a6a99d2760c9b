//! Drivers that the Vulkan loader finds, by manifests in the environment.

use std::ffi::CStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use ash::vk::TaggedStructure;
use gaurast_runner::Case;

/// Writes a manifest of this driver's shared library to `folder`, and returns its path.
///
/// It is the project's manifest with another library path.
///
/// # Panics
/// If the library is not built, or the folder cannot be written.
pub fn manifest(folder: &Path) -> PathBuf {
    let library = gaurast_runner::built_library("gaurast-icd", "libvulkan_gaurast.so");
    let library = library.to_str().expect("a path of Unicode");
    let template = include_str!("../../../driver/icd/gaurast_icd.json");
    let text = template.replace("../../target/release/libvulkan_gaurast.so", library);
    assert!(text.contains(library), "the template names the library");
    let path = folder.join("gaurast_icd.json");
    std::fs::write(&path, text).expect("the manifest is written");
    path
}

/// The validation layer of the extension.
pub const LAYER: &CStr = c"VK_LAYER_GAURAST_validation";

/// Builds the extension's validation layer, and writes its manifest to `folder`, as [`manifest`] does for the driver.
///
/// # Panics
/// As [`manifest`].
pub fn layer_manifest(folder: &Path) -> PathBuf {
    let name = "libVkLayer_gaurast_validation.so";
    let library = gaurast_runner::built_library("gaurast-layer", name);
    let library = library.to_str().expect("a path of Unicode");
    let template = include_str!("../../../api/layer/gaurast_layer.json");
    let text = template.replace(&format!("../../target/release/{name}"), library);
    assert!(text.contains(library), "the template names the library");
    let path = folder.join("gaurast_layer.json");
    std::fs::write(&path, text).expect("the manifest is written");
    path
}

/// Builds the layer that makes drivers wrong, and writes its manifest to `folder`, as [`manifest`] does for the driver.
fn mutants_manifest(folder: &Path) {
    let name = "libgaurast_mutants.so";
    let library = gaurast_runner::built_library("gaurast-mutants", name);
    let library = library.to_str().expect("a path of Unicode");
    let template = include_str!("../../conformance/mutants/gaurast_mutants.json");
    let text = template.replace(&format!("../../../target/release/{name}"), library);
    assert!(text.contains(library), "the template names the library");
    std::fs::write(folder.join("gaurast_mutants.json"), text).expect("the manifest is written");
}

/// Builds the layer that gives devices the extension, and writes its manifest to `folder`, as [`manifest`] does for the driver.
fn emulation_manifest(folder: &Path) {
    let name = "libVkLayer_gaurast_emulation.so";
    let library = gaurast_runner::built_library("gaurast-emulation-layer", name);
    let library = library.to_str().expect("a path of Unicode");
    let template = include_str!("../../../api/emulation/layer/gaurast_emulation.json");
    let revision = format!("\"spec_version\": \"{}\"", gaurast::gaussian_primitive_topology::SPEC_VERSION);
    assert!(template.contains(&revision), "the template names the extension's revision");
    let text = template.replace(&format!("../../../target/release/{name}"), library);
    assert!(text.contains(library), "the template names the library");
    std::fs::write(folder.join("gaurast_emulation.json"), text).expect("the manifest is written");
}

/// Runs `inside` in a process of its own, where the loader has the layer that gives devices the extension over all drivers of the
/// system, with further variables in the environment. The test needs lavapipe.
///
/// # Panics
/// If it fails there.
pub fn with_emulation(case: &Case, variables: &[(&str, &str)], inside: impl FnOnce()) {
    if case.is_alone() {
        return inside();
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    emulation_manifest(folder.path());
    case.run_alone(|command| {
        command
            .env("VK_ADD_LAYER_PATH", folder.path())
            .env("VK_INSTANCE_LAYERS", "VK_LAYER_GAURAST_emulation")
            .env_remove("VK_DRIVER_FILES")
            .env_remove("VK_ICD_FILENAMES")
            .envs(variables.iter().copied());
    });
}

/// As [`through_the_loader`], where the loader also finds the layer that makes drivers wrong.
///
/// # Panics
/// As [`through_the_loader`].
pub fn with_mutants(case: &Case, inside: impl FnOnce()) {
    let add = |command: &mut Command, folder: &Path| {
        mutants_manifest(folder);
        command.env("VK_ADD_LAYER_PATH", folder);
    };
    loaded(case, add, inside);
}

/// Runs `inside` in a process of its own, where the loader finds this driver alone. The test needs the loader.
///
/// # Panics
/// If it fails there.
pub fn through_the_loader(case: &Case, inside: impl FnOnce()) {
    through_the_loader_with(case, &[], inside);
}

/// As [`through_the_loader`], with further variables in the environment of the process.
///
/// # Panics
/// As [`through_the_loader`].
pub fn through_the_loader_with(case: &Case, variables: &[(&str, &str)], inside: impl FnOnce()) {
    let add = |command: &mut Command, _: &Path| {
        command.envs(variables.iter().copied());
    };
    loaded(case, add, inside);
}

/// As [`through_the_loader`], where the loader also finds the extension's validation layer, [`LAYER`], and layers find a file
/// of settings if one is given.
///
/// # Panics
/// As [`through_the_loader`].
pub fn with_the_layer(case: &Case, settings: Option<&str>, inside: impl FnOnce()) {
    let add = |command: &mut Command, folder: &Path| {
        layer_manifest(folder);
        command.env("VK_ADD_LAYER_PATH", folder);
        if let Some(settings) = settings {
            let path = folder.join("vk_layer_settings.txt");
            std::fs::write(&path, settings).expect("the settings are written");
            command.env("VK_LAYER_SETTINGS_PATH", path).env_remove("VK_LAYER_CUSTOM_STYPE_LIST");
        }
    };
    loaded(case, add, inside);
}

/// As [`with_the_layer`], where devices refuse the use of what is not enabled.
///
/// # Panics
/// As [`through_the_loader`].
pub fn strictly_with_the_layer(case: &Case, inside: impl FnOnce()) {
    let add = |command: &mut Command, folder: &Path| {
        layer_manifest(folder);
        command.env("VK_ADD_LAYER_PATH", folder).env("GAURAST_STRICT", "1");
    };
    loaded(case, add, inside);
}

fn loaded(case: &Case, add: impl FnOnce(&mut Command, &Path), inside: impl FnOnce()) {
    if case.is_alone() {
        return inside();
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let manifest = manifest(folder.path());
    case.run_alone(|command| {
        command
            .env("VK_DRIVER_FILES", &manifest)
            .env("VK_ICD_FILENAMES", &manifest)
            .env("VK_LAYER_CUSTOM_STYPE_LIST", unregistered_structures())
            .env_remove("VK_INSTANCE_LAYERS");
        add(command, folder.path());
    });
}

/// The extension's structures in the form of the validation layer's environment variable: pairs of structure type and
/// size, all separated by colons.
fn unregistered_structures() -> String {
    use gaurast::vk::{
        GaussianCameraGAURAST as Camera, PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features,
        PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties,
        PipelineGaussianApproximationStateCreateInfoGAURAST as Approximation,
        PipelineGaussianDecodingStateCreateInfoGAURAST as Decoding,
        PipelineGaussianFootprintStateCreateInfoGAURAST as Footprint, PipelineGaussianStateCreateInfoGAURAST as State,
    };
    let separator = if cfg!(windows) { ";" } else { ":" };
    [
        (Features::STRUCTURE_TYPE, size_of::<Features<'_>>()),
        (Properties::STRUCTURE_TYPE, size_of::<Properties<'_>>()),
        (State::STRUCTURE_TYPE, size_of::<State<'_>>()),
        (Approximation::STRUCTURE_TYPE, size_of::<Approximation<'_>>()),
        (Footprint::STRUCTURE_TYPE, size_of::<Footprint<'_>>()),
        (Decoding::STRUCTURE_TYPE, size_of::<Decoding<'_>>()),
        (Camera::STRUCTURE_TYPE, size_of::<Camera<'_>>()),
    ]
    .map(|(structure, size)| format!("{}{separator}{size}", structure.as_raw()))
    .join(separator)
}

/// Makes lavapipe sample textures as accurately as it can: per pixel, and in floats. This has an effect only before the
/// process creates its first lavapipe device.
///
/// # Safety
/// No other thread may read the environment at the same time, except through the standard library.
pub unsafe fn accurate_lavapipe() {
    // SAFETY: the caller guarantees it.
    unsafe { std::env::set_var("GALLIVM_PERF", "no_aos_sampling,no_quad_lod") };
}
