//! Requirements of tests: programs, files, data, capabilities; and the end of a test if one is missing.

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};

/// A requirement of a test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// A program on the `PATH`.
    Program(&'static str),
    /// A file of the system, by its absolute path.
    File(&'static str),
    /// A file whose path is in an environment variable.
    FileOf(&'static str),
    /// The Vulkan loader, a shared library.
    VulkanLoader,
    /// Lavapipe, Mesa's software Vulkan driver, by its manifest, and the loader that finds it.
    Lavapipe,
    /// The Khronos validation layer, by its manifest, and the loader that finds it.
    ValidationLayer,
    /// A file or a folder in the folder of test data, [`data_folder`].
    Data(&'static str),
    /// A SIMD level of the processor, by its name in `GAURAST_SIMD`.
    SimdLevel(&'static str),
}

/// A missing requirement, by the way in which it can be provided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// A program, a library or a file of a package: `GAURAST_TEST_REQUIRE=programs` makes it a failure.
    Program,
    /// Test data: `GAURAST_TEST_REQUIRE=all` makes it a failure.
    Data,
    /// A capability of the processor or of another implementation, which is never a failure.
    Capability,
}

/// The panic payload of a test that is ignored.
pub(crate) struct Ignored {
    pub missing: Missing,
    pub reason: String,
}

/// Ends the running test as ignored, or as failed if `GAURAST_TEST_REQUIRE` says so. It must be called in the test's
/// own thread.
pub fn ignore(missing: Missing, reason: impl Into<String>) -> ! {
    resume_unwind(Box::new(Ignored { missing, reason: reason.into() }))
}

/// Ends the running test as ignored if `need` is missing.
pub fn require(need: Need) {
    if let Some(Ignored { missing, reason }) = need.missing() {
        ignore(missing, reason);
    }
}

/// The folder of test data, which `GAURAST_TEST_DATA` names.
pub fn data_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("GAURAST_TEST_DATA")?;
    (!folder.is_empty()).then(|| folder.into())
}

/// The path of a file or folder of the test data, relative to [`data_folder`]. Ends the running test as ignored if it
/// is missing.
pub fn data(name: &'static str) -> PathBuf {
    require(Need::Data(name));
    data_folder().expect("a folder that was just looked into").join(name)
}

/// Returns true if `GAURAST_TEST_LONG` requests complete runs in place of small samples.
pub fn is_long() -> bool {
    std::env::var_os("GAURAST_TEST_LONG").is_some_and(|value| value == "1")
}

impl Missing {
    /// The kind with this name.
    pub(crate) fn from_name(name: &str) -> Self {
        [Self::Program, Self::Data, Self::Capability]
            .into_iter()
            .find(|missing| format!("{missing:?}") == name)
            .expect("the name that this program wrote")
    }
}

impl Need {
    /// The reason for ignoring the test, if the requirement is missing.
    pub(crate) fn missing(self) -> Option<Ignored> {
        let (missing, reason) = match self {
            Self::Program(name) if !on_the_path(name) => (Missing::Program, format!("there is no {name}")),
            Self::File(path) if !Path::new(path).exists() => (Missing::Program, format!("there is no {path}")),
            Self::FileOf(variable) if !std::env::var_os(variable).is_some_and(is_file) => {
                (Missing::Program, format!("{variable} names no file"))
            }
            Self::VulkanLoader if !has_vulkan_loader() => (Missing::Program, "there is no Vulkan loader".to_owned()),
            Self::Lavapipe if lavapipe_manifest().is_none() || !has_vulkan_loader() => {
                (Missing::Program, "there is no lavapipe".to_owned())
            }
            Self::ValidationLayer if !has_validation_layer() || !has_vulkan_loader() => {
                (Missing::Program, "there is no validation layer".to_owned())
            }
            Self::Data(name) => match data_folder() {
                None => (Missing::Data, "GAURAST_TEST_DATA is not set".to_owned()),
                Some(folder) if !folder.join(name).exists() => {
                    (Missing::Data, format!("there is no {name} in the data"))
                }
                Some(_) => return None,
            },
            Self::SimdLevel(level) if !has_simd_level(level) => {
                (Missing::Capability, format!("this processor has no {level}"))
            }
            _ => return None,
        };
        Some(Ignored { missing, reason })
    }
}

fn is_file(path: std::ffi::OsString) -> bool {
    Path::new(&path).is_file()
}

/// The names of the device's SIMD levels in `GAURAST_SIMD`, the simplest first.
pub const SIMD_LEVELS: [&str; 3] = ["sse2", "avx2", "avx512"];

/// Returns true if the processor has a SIMD level.
pub fn has_simd_level(level: &str) -> bool {
    #[cfg(target_arch = "x86_64")]
    // The feature that a level is named after stands for all features that it needs.
    match level {
        "sse2" => true,
        "avx2" => std::arch::is_x86_feature_detected!("avx2"),
        "avx512" => std::arch::is_x86_feature_detected!("avx512vbmi2"),
        _ => false,
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        level == "sse2"
    }
}

/// Lavapipe's manifest in the folders where Linux systems store drivers' manifests.
pub fn lavapipe_manifest() -> Option<PathBuf> {
    const FOLDERS: [&str; 3] = ["/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
    first_file(&FOLDERS, |name| name.starts_with("lvp_icd"))
}

fn has_validation_layer() -> bool {
    const FOLDERS: [&str; 4] = [
        "/usr/share/vulkan/explicit_layer.d",
        "/usr/local/share/vulkan/explicit_layer.d",
        "/etc/vulkan/explicit_layer.d",
        "/usr/share/vulkan/implicit_layer.d",
    ];
    first_file(&FOLDERS, |name| name.starts_with("VkLayer_khronos_validation")).is_some()
}

fn has_vulkan_loader() -> bool {
    let architecture = format!("/usr/lib/{}-linux-gnu", std::env::consts::ARCH);
    let folders = [architecture.as_str(), "/usr/lib64", "/usr/lib", "/usr/local/lib"];
    first_file(&folders, |name| name.starts_with("libvulkan.so")).is_some()
}

/// The first file in `folders` whose name matches.
fn first_file(folders: &[&str], fits: impl Fn(&str) -> bool) -> Option<PathBuf> {
    let entries = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .find(|path| path.file_name().and_then(|name| name.to_str()).is_some_and(&fits))
}

fn on_the_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}
