//! This driver's device and lavapipe's, both as accurate as possible, and the formats that both support.

use crate::{Gpu, Settings};
use ash::vk;
use gaurast_runner::{Case, Missing, ignore};
use simdevice::format::Aspect;

/// The Vulkan flags of an aspect.
pub fn aspect_flags(aspect: Aspect) -> vk::ImageAspectFlags {
    match aspect {
        Aspect::Color => vk::ImageAspectFlags::COLOR,
        Aspect::Depth => vk::ImageAspectFlags::DEPTH,
        Aspect::Stencil => vk::ImageAspectFlags::STENCIL,
    }
}

/// The formats that both devices support for a use, and those that only this driver supports.
pub struct Formats {
    /// Formats of both devices.
    pub of_both: Vec<vk::Format>,
    /// Formats of this driver that lavapipe lacks.
    pub of_ours_alone: Vec<vk::Format>,
}

/// Finds the formats up to `last` that devices support for a use; `is_capable` tests one.
pub fn formats(ours: &Gpu, theirs: &Gpu, last: vk::Format, is_capable: impl Fn(&Gpu, vk::Format) -> bool) -> Formats {
    let all = (1..=last.as_raw()).map(vk::Format::from_raw);
    let (of_both, of_ours_alone) =
        all.filter(|&format| is_capable(ours, format)).partition(|&format| is_capable(theirs, format));
    Formats { of_both, of_ours_alone }
}

/// Ends the test as ignored if lavapipe lacks more formats for `operations` than are known, because fewer formats were
/// then compared than expected.
pub fn expect_lacking(operations: &str, lacking: &[vk::Format], known: &[vk::Format]) {
    let new: Vec<_> = lacking.iter().filter(|format| !known.contains(format)).collect();
    if !new.is_empty() {
        let reason = format!("lavapipe's {operations} lack {new:?}");
        ignore(Missing::Capability, reason);
    }
}

/// Runs `inside` with this device and lavapipe, in a process of its own in which lavapipe filters in binary32 and uses
/// no approximations. The test needs lavapipe.
pub fn exactly(case: &Case, inside: impl FnOnce(&Gpu, &Gpu)) {
    if case.is_alone() {
        let ours = Gpu::embedded(&Settings::default()).expect("this driver's device");
        let theirs = Gpu::lavapipe().expect("lavapipe's device");
        return inside(&ours, &theirs);
    }
    let exact = "no_aos_sampling,no_quad_lod,no_brilinear,no_rho_approx";
    let manifest = gaurast_runner::lavapipe_manifest().expect("the test needs lavapipe");
    case.run_alone(|command| {
        command.env("GALLIVM_PERF", exact).env("VK_DRIVER_FILES", &manifest).env("VK_ICD_FILENAMES", &manifest);
    });
}
