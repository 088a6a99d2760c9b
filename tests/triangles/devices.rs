//! The devices of this process.

use std::sync::LazyLock;

use gaurast_tests::contexts::Settings;
use gaurast_tests::triangles::{Gpu, OpenError, accurate_lavapipe, shader};

/// This driver, linked into the process.
pub fn own() -> &'static Gpu {
    static OWN: LazyLock<Gpu> =
        LazyLock::new(|| Gpu::embedded(&Settings::default()).expect("this driver's device"));
    &OWN
}

/// lavapipe, or `None` and a printed reason.
pub fn lavapipe() -> Option<&'static Gpu> {
    static LAVAPIPE: LazyLock<Result<Gpu, OpenError>> = LazyLock::new(|| {
        // SAFETY: other tests wait for lavapipe too, or read the environment through the standard
        // library.
        unsafe { accurate_lavapipe() };
        Gpu::lavapipe()
    });
    if !shader::can_compile() {
        eprintln!("skipped: there is no glslangValidator here");
        return None;
    }
    match &*LAVAPIPE {
        Ok(gpu) => Some(gpu),
        Err(error @ (OpenError::NoLoader(_) | OpenError::NoDevice(_))) => {
            eprintln!("skipped: {error}");
            None
        }
        Err(error) => panic!("lavapipe: {error}"),
    }
}
