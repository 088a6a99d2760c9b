//! The driver through the Vulkan loader, as ordinary programs use it.

use ash::vk;
use gaurast_runner::{Case, Need, Variant, built_library};
use gaurast_testkit::context::{Context, loader};
use gaurast_testkit::loader::{manifest, through_the_loader};
use std::process::Command;

#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn a_device_is_created_and_destroyed(case: &Case) {
    through_the_loader(case, || {
        let context = Context::loaded(&[ash::ext::debug_utils::NAME]);
        // SAFETY: the physical device is the instance's.
        let properties = unsafe { context.instance.get_physical_device_properties(context.physical_device) };
        assert_eq!(properties.device_name_as_c_str().unwrap(), c"GauRast simulated device");
        let device = context
            .device(&[gaurast::gaussian_primitive_topology::NAME], &mut vk::PhysicalDeviceFeatures2::default())
            .unwrap();
        // The loader does not know this command, so the pointer comes from the driver.
        let functions = gaurast::gaussian_primitive_topology::Device::new(&context.instance, &device);
        assert_eq!(functions.device(), device.handle());
        // SAFETY: the device is live, and destroyed last.
        unsafe {
            assert_ne!(device.get_device_queue(0, 0), vk::Queue::null());
            device.destroy_device(None);
        }
    });
}

/// The library is unloaded with the last instance. No thread may still run in it then.
#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn the_library_is_loaded_and_unloaded_many_times(case: &Case) {
    through_the_loader(case, || {
        // The loader itself remains loaded.
        let entry = loader();
        for _ in 0..20 {
            let context = Context::new(entry.clone(), &[]);
            let device = context.device(&[], &mut vk::PhysicalDeviceFeatures2::default()).unwrap();
            // SAFETY: the device is live and not used again.
            unsafe { device.destroy_device(None) };
        }
    });
}

/// Physical-device commands of extensions that the loader may not know reach the driver.
#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn counters_are_enumerated(case: &Case) {
    through_the_loader(case, || {
        let context = Context::loaded(&[]);
        let performance = ash::khr::performance_query::Instance::new(&context.entry, &context.instance);
        // SAFETY: the physical device is the instance's.
        let count = unsafe {
            performance
                .enumerate_physical_device_queue_family_performance_query_counters_len(context.physical_device, 0)
        };
        assert!(count.unwrap() > 10);
    });
}

const VALIDATION: &str = "VK_LAYER_KHRONOS_validation";

/// A variant without layers and one under the validation layer.
fn layers() -> Vec<Variant> {
    let validated = Variant { name: VALIDATION.to_owned(), needs: vec![Need::ValidationLayer] };
    vec![Variant::new("no layer"), validated]
}

/// `vulkaninfo` makes every query of a physical device.
#[gaurast_runner::test(needs = [Need::Program("vulkaninfo"), Need::VulkanLoader], each = layers())]
fn vulkaninfo_lists_the_device(case: &Case) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let manifest = manifest(directory.path());
    let layer = Some(VALIDATION).filter(|&layer| layer == case.variant());
    let output = Command::new("vulkaninfo")
        .env("VK_DRIVER_FILES", &manifest)
        .env("VK_ICD_FILENAMES", &manifest)
        .env("VK_INSTANCE_LAYERS", layer.unwrap_or_default())
        .env_remove("DISPLAY")
        .output()
        .expect("vulkaninfo runs");
    let text = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}{errors}");
    assert!(text.contains("GauRast simulated device"), "{text}");
    assert!(text.contains("VK_GAURAST_gaussian_primitive_topology"), "{text}");
    assert!(!errors.contains("vulkan_gaurast"), "the driver complains: {errors}");
}

/// The shared library exports the loader's symbols and no Vulkan command.
#[gaurast_runner::test(needs = [Need::Program("nm")])]
fn only_the_loaders_symbols_are_exported() {
    let output = Command::new("nm")
        .args(["--dynamic", "--defined-only", "--format=just-symbols"])
        .arg(built_library("gaurast-icd", "libvulkan_gaurast.so"))
        .output()
        .expect("nm runs");
    assert!(output.status.success());
    let text = String::from_utf8_lossy(&output.stdout);
    let mut symbols: Vec<_> = text.lines().filter(|name| name.starts_with("vk")).collect();
    symbols.sort_unstable();
    let wanted =
        ["vk_icdGetInstanceProcAddr", "vk_icdGetPhysicalDeviceProcAddr", "vk_icdNegotiateLoaderICDInterfaceVersion"];
    assert_eq!(symbols, wanted);
}
