//! `gaurast icd`: the variables with which other programs find this installation's driver.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// The places of the driver's manifest, from the folder of the command: installed, in the Python package, and in a build folder of
/// the source code.
const MANIFESTS: [&str; 3] =
    ["../share/vulkan/icd.d/gaurast_icd.json", "../lib/gaurast_icd.json", "../../driver/icd/gaurast_icd.json"];

/// The places of the layer's manifest, likewise.
const LAYERS: [&str; 3] = [
    "../share/vulkan/explicit_layer.d/gaurast_layer.json",
    "../lib/gaurast_layer.json",
    "../../api/layer/gaurast_layer.json",
];

/// A failure to find the driver. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum IcdError {
    #[error("the place of this command is unknown: {0}")]
    Command(std::io::Error),
    #[error("{}: there is no manifest of the driver where the command is installed, such as {}", folder.display(), MANIFESTS[0])]
    Missing { folder: PathBuf },
    #[cfg(any(test, not(feature = "driver")))]
    #[error("{}: {reason}", manifest.display())]
    Manifest { manifest: PathBuf, reason: String },
}

/// The first of `places` from `folder` that exists.
fn find(folder: &Path, places: [&str; 3]) -> Option<PathBuf> {
    places.iter().find_map(|place| folder.join(place).canonicalize().ok())
}

/// The folder of this command.
fn installation() -> Result<PathBuf, IcdError> {
    let command = std::env::current_exe().and_then(|path| path.canonicalize()).map_err(IcdError::Command)?;
    Ok(command.parent().unwrap_or(Path::new("/")).to_owned())
}

fn manifest_of(folder: &Path) -> Result<PathBuf, IcdError> {
    find(folder, MANIFESTS).ok_or_else(|| IcdError::Missing { folder: folder.to_owned() })
}

/// The library of the installation's driver, as its manifest names it.
///
/// # Errors
/// [`IcdError`].
#[cfg(not(feature = "driver"))]
pub fn library() -> Result<PathBuf, IcdError> {
    library_of(&manifest_of(&installation()?)?)
}

#[cfg(any(test, not(feature = "driver")))]
fn library_of(manifest: &Path) -> Result<PathBuf, IcdError> {
    let wrong = |reason: String| IcdError::Manifest { manifest: manifest.to_owned(), reason };
    let text = std::fs::read(manifest).map_err(|error| wrong(error.to_string()))?;
    let json: serde_json::Value = serde_json::from_slice(&text).map_err(|error| wrong(error.to_string()))?;
    let path = json["ICD"]["library_path"].as_str().ok_or_else(|| wrong("it names no library".to_owned()))?;
    Ok(manifest.parent().unwrap_or(Path::new("/")).join(path))
}

/// A word of a shell, in quotes.
fn quoted(path: &Path) -> String {
    format!("'{}'", path.display().to_string().replace('\'', r"'\''"))
}

/// Lines for a shell: `VK_DRIVER_FILES`, its older name, and the folder of the layer.
///
/// # Errors
/// [`IcdError`].
pub fn lines() -> Result<String, IcdError> {
    lines_of(&installation()?)
}

fn lines_of(folder: &Path) -> Result<String, IcdError> {
    let manifest = manifest_of(folder)?;
    let mut lines = String::new();
    for name in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        let _ = writeln!(lines, "export {name}={}", quoted(&manifest));
    }
    if let Some(layer) = find(folder, LAYERS).as_deref().and_then(Path::parent) {
        let _ = writeln!(lines, "export VK_ADD_LAYER_PATH={}", quoted(layer));
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_installation_names_its_own_manifests() {
        let root = tempfile::tempdir().expect("a folder");
        let root = root.path().canonicalize().expect("a path").join("it's");
        for folder in ["bin", "share/vulkan/icd.d", "share/vulkan/explicit_layer.d"] {
            std::fs::create_dir_all(root.join(folder)).expect(folder);
        }
        assert!(lines_of(&root.join("bin")).is_err());
        std::fs::write(root.join("share/vulkan/icd.d/gaurast_icd.json"), "").expect("a manifest");
        assert_eq!(lines_of(&root.join("bin")).expect("found").lines().count(), 2);
        std::fs::write(root.join("share/vulkan/explicit_layer.d/gaurast_layer.json"), "").expect("a manifest");
        let lines = lines_of(&root.join("bin")).expect("found");
        let in_quotes = root.display().to_string().replace('\'', r"'\''");
        let expected = format!("export VK_DRIVER_FILES='{in_quotes}/share/vulkan/icd.d/gaurast_icd.json'");
        assert_eq!(lines.lines().next(), Some(&*expected));
        assert!(lines.ends_with("/share/vulkan/explicit_layer.d'\n"), "{lines}");
    }

    #[test]
    fn the_driver_is_the_one_that_the_manifest_names() {
        let root = tempfile::tempdir().expect("a folder");
        let manifest = root.path().join("gaurast_icd.json");
        let library = |text: &str| {
            std::fs::write(&manifest, text).expect("a manifest");
            library_of(&manifest)
        };
        let near = library(include_str!("../../../driver/icd/gaurast_icd.json")).expect("a library");
        assert_eq!(near, root.path().join("../../target/release/libvulkan_gaurast.so"));
        assert_eq!(library(r#"{"ICD": {"library_path": "/a/b.so"}}"#).expect("a library"), Path::new("/a/b.so"));
        let sentence = library("{}").expect_err("no library").to_string();
        assert!(sentence.ends_with("gaurast_icd.json: it names no library"), "{sentence}");
    }
}
