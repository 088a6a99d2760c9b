//! The devices of this process.

use std::path::Path;
use std::sync::LazyLock;

use gaurast_testkit::Settings;
use gaurast_testkit::loader::manifest;
use gaurast_testkit::{Gpu, accurate_lavapipe};

/// The folder where this driver's manifest is while tests run.
const FOLDER: &str = env!("CARGO_TARGET_TMPDIR");

/// This driver, linked into the process.
pub fn own() -> &'static Gpu {
    static OWN: LazyLock<Gpu> =
        LazyLock::new(|| Gpu::embedded(&Settings::default()).expect("this driver's device"));
    &OWN
}

/// This driver, through the loader.
pub fn loaded() -> &'static Gpu {
    static LOADED: LazyLock<Gpu> = LazyLock::new(|| {
        manifest(Path::new(FOLDER));
        Gpu::loaded().expect("this driver's device")
    });
    &LOADED
}

/// lavapipe, where `Need::Lavapipe` is met.
pub fn lavapipe() -> &'static Gpu {
    static LAVAPIPE: LazyLock<Gpu> = LazyLock::new(|| Gpu::lavapipe().expect("lavapipe's device"));
    &LAVAPIPE
}

/// Has the loader find this driver beside lavapipe, unless the environment says what it finds; and lavapipe sample
/// textures as accurately as it can.
///
/// # Safety
/// No other thread may run.
pub unsafe fn set_environment() {
    let drivers = [
        Some(Path::new(FOLDER).join("gaurast_icd.json")),
        gaurast_runner::lavapipe_manifest(),
    ];
    let drivers = std::env::join_paths(drivers.iter().flatten()).expect("paths without separators");
    // SAFETY: the caller's promise.
    unsafe {
        accurate_lavapipe();
        // The older name is for older loaders.
        for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            if std::env::var_os(variable).is_none() {
                std::env::set_var(variable, &drivers);
            }
        }
    }
}
