//! Settings of a device of the embedded driver.

use std::ffi::CStr;
use std::sync::Arc;
use std::time::Duration;

use gaurast::WorkTrace;
use gaurast::vk::{DriverOptionsGAURAST, SimdLevelGAURAST};
use gaurast_runner::Case;

/// The settings of a device: the options of this driver, `VkDriverOptionsGAURAST`. `None` is an option's default.
#[derive(Clone, Copy, Debug, Default)]
pub struct Settings<'a> {
    /// The name of the SIMD level.
    pub simd: Option<&'a str>,
    /// The number of worker threads.
    pub threads: Option<usize>,
    /// The longest time of a batch of shader invocations.
    pub timeout: Option<Duration>,
    /// The names of the optimizations.
    pub optimizations: Option<&'a CStr>,
    /// The receiver of the device's work when the device is destroyed.
    pub trace: Option<&'a Arc<WorkTrace>>,
}

impl Settings<'_> {
    /// The default settings.
    pub const DEFAULT: Settings<'static> =
        Settings { simd: None, threads: None, timeout: None, optimizations: None, trace: None };

    /// The SIMD level.
    ///
    /// # Panics
    /// If there is no SIMD level of that name.
    pub fn level(&self) -> Option<SimdLevelGAURAST> {
        self.simd.map(simd_level)
    }

    /// The settings as the driver receives them.
    ///
    /// # Panics
    /// If there is no SIMD level of that name.
    pub(crate) fn options(&self) -> DriverOptionsGAURAST<'_> {
        let mut options = DriverOptionsGAURAST::default()
            .thread_count(self.threads.unwrap_or_default() as u32)
            .simd_level(self.level().unwrap_or_default())
            .shader_timeout(self.timeout.unwrap_or_default().as_nanos() as u64);
        if let Some(names) = self.optimizations {
            options = options.p_optimizations(names.as_ptr());
        }
        if let Some(trace) = self.trace {
            options = options.work_trace(trace);
        }
        options
    }
}

/// Runs `inside` in a process of its own, where devices refuse the use of what is not enabled.
///
/// # Panics
/// If it fails there.
pub fn strictly(case: &Case, inside: impl FnOnce()) {
    if case.is_alone() {
        return inside();
    }
    case.run_alone(|command| {
        command.env("GAURAST_STRICT", "1");
    });
}

/// The SIMD level of a name of the variable `GAURAST_SIMD`.
fn simd_level(name: &str) -> SimdLevelGAURAST {
    match name {
        "best" => SimdLevelGAURAST::BEST,
        "sse2" => SimdLevelGAURAST::SSE2,
        "avx2" => SimdLevelGAURAST::AVX2,
        "avx512" => SimdLevelGAURAST::AVX512,
        _ => panic!("{name} is no SIMD level"),
    }
}
