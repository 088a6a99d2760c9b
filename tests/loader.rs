//! This driver's shared library, as the Vulkan loader finds it.

use std::path::{Path, PathBuf};

/// Builds the library, and writes its manifest to `folder`; returns the manifest's path.
///
/// It is the project's manifest but for the library's path.
pub fn manifest(folder: &Path) -> PathBuf {
    let library = gaurast_runner::built_library("vulkan_gaurast-icd", "libvulkan_gaurast.so");
    let text = include_str!("../driver/icd/gaurast_icd.json");
    let mut manifest: serde_json::Value = serde_json::from_str(text).expect("a manifest");
    manifest["ICD"]["library_path"] = library.to_str().expect("a path of Unicode").into();
    let path = folder.join("gaurast_icd.json");
    std::fs::write(&path, manifest.to_string()).expect("the manifest is written");
    path
}
