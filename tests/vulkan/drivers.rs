//! The drivers that the Vulkan loader finds while these tests run.

use std::path::Path;
use std::sync::LazyLock;

use gaurast_testkit::loader::manifest;
use gaurast_testkit::{Gpu, accurate_lavapipe};

/// The folder of this driver's manifest while tests run.
const FOLDER: &str = env!("CARGO_TARGET_TMPDIR");

/// This driver's device, through the loader.
pub fn loaded() -> &'static Gpu {
    static LOADED: LazyLock<Gpu> = LazyLock::new(|| {
        manifest(Path::new(FOLDER));
        Gpu::loaded().expect("this driver's device")
    });
    &LOADED
}

/// Makes the loader find this driver and lavapipe, unless the environment names drivers already. Makes lavapipe sample
/// textures as accurately as it can.
///
/// # Safety
/// No other thread may run.
pub unsafe fn set_environment() {
    let drivers = [Some(Path::new(FOLDER).join("gaurast_icd.json")), gaurast_runner::lavapipe_manifest()];
    let drivers = std::env::join_paths(drivers.iter().flatten()).expect("paths without separators");
    // SAFETY: the caller guarantees it.
    unsafe {
        accurate_lavapipe();
        // Older loaders read the second name.
        for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            if std::env::var_os(variable).is_none() {
                std::env::set_var(variable, &drivers);
            }
        }
    }
}
