//! The driver through the Vulkan loader, as programs that know nothing of it would use it. These tests start
//! themselves again with `VK_DRIVER_FILES` set, because the loader reads the environment. They are skipped, aloud, on
//! machines without a loader.

mod support;

use ash::vk::{self, TaggedStructure};
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST;
use std::ffi::CStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use support::{Context, Heard};

const VALIDATION: &str = "VK_LAYER_KHRONOS_validation";
const VALIDATION_NAME: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Set for the process that runs a test's inside.
const INSIDE: &str = "GAURAST_TEST_INSIDE_LOADER";

/// The shared library that was built with this test.
fn library() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    let directories = test.ancestors().skip(1).take(2);
    directories
        .map(|directory| directory.join("libvulkan_gaurast.so"))
        .find(|library| library.exists())
        .expect("cargo builds the shared library beside its tests")
}

/// Writes a manifest for the library.
fn manifest(directory: &Path) -> PathBuf {
    let template = include_str!("../gaurast_icd.json");
    let library = library().to_string_lossy().into_owned();
    let text = template.replace("../target/release/libvulkan_gaurast.so", &library);
    assert!(text.contains(&library), "the template names the library");
    let path = directory.join("gaurast_icd.json");
    std::fs::write(&path, text).expect("a writable directory");
    path
}

/// The extension's structures as the validation layer wants to be told of them: pairs of type and size.
fn unregistered_structures() -> String {
    use gaurast::vk::{
        PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features,
        PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties,
    };
    [
        (Features::STRUCTURE_TYPE, size_of::<Features<'_>>()),
        (Properties::STRUCTURE_TYPE, size_of::<Properties<'_>>()),
    ]
    .map(|(structure, size)| format!("{},{size}", structure.as_raw()))
    .join(",")
}

/// Runs `inside` in a process of its own, where the loader finds this driver alone.
fn through_the_loader(test: &str, inside: impl FnOnce(ash::Entry)) {
    // SAFETY: the loader is the system's own.
    let entry = match unsafe { ash::Entry::load() } {
        Ok(entry) => entry,
        Err(error) => {
            eprintln!("skipped: there is no Vulkan loader here ({error})");
            return;
        }
    };
    if std::env::var_os(INSIDE).is_some() {
        return inside(entry);
    }
    let directory = tempfile::tempdir().expect("a temporary directory");
    let output = Command::new(std::env::current_exe().expect("the test's own path"))
        .args(["--exact", test, "--nocapture"])
        .env(INSIDE, "1")
        .env("VK_DRIVER_FILES", manifest(directory.path()))
        .env("VK_ICD_FILENAMES", manifest(directory.path()))
        .env("VK_LAYER_CUSTOM_STYPE_LIST", unregistered_structures())
        .output()
        .expect("the test starts itself");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("1 passed"), "{text}");
    for line in text.lines().filter(|line| line.starts_with("skipped:")) {
        eprintln!("{line}");
    }
}

#[test]
fn a_device_is_created_and_destroyed() {
    through_the_loader("a_device_is_created_and_destroyed", |entry| {
        let context = Context::new(entry, &[ash::ext::debug_utils::NAME]);
        // SAFETY: the physical device is the instance's.
        let properties = unsafe {
            context
                .instance
                .get_physical_device_properties(context.physical_device)
        };
        assert_eq!(
            properties.device_name_as_c_str().unwrap(),
            c"GauRast simulated device"
        );
        let device = context
            .device(
                &[gaurast::gaussian_primitive_topology::NAME],
                &mut vk::PhysicalDeviceFeatures2::default(),
            )
            .unwrap();
        // The loader doesn't know this command: it comes straight from the driver.
        let functions =
            gaurast::gaussian_primitive_topology::Device::new(&context.instance, &device);
        assert_eq!(functions.device(), device.handle());
        // SAFETY: the device is live, and destroyed last.
        unsafe {
            assert_ne!(device.get_device_queue(0, 0), vk::Queue::null());
            device.destroy_device(None);
        }
    });
}

/// The library is unloaded with the last instance, when no thread may be left in it.
#[test]
fn the_library_is_loaded_and_unloaded_many_times() {
    through_the_loader("the_library_is_loaded_and_unloaded_many_times", |entry| {
        for _ in 0..20 {
            let context = Context::new(entry.clone(), &[]);
            let device = context
                .device(&[], &mut vk::PhysicalDeviceFeatures2::default())
                .unwrap();
            // SAFETY: the device is live and not used again.
            unsafe { device.destroy_device(None) };
        }
    });
}

/// Physical-device commands of extensions that the loader may not know reach the driver.
#[test]
fn counters_are_enumerated() {
    through_the_loader("counters_are_enumerated", |entry| {
        let context = Context::new(entry, &[]);
        let performance =
            ash::khr::performance_query::Instance::new(&context.entry, &context.instance);
        // SAFETY: the physical device is the instance's.
        let count = unsafe {
            performance.enumerate_physical_device_queue_family_performance_query_counters_len(
                context.physical_device,
                0,
            )
        };
        assert!(count.unwrap() > 10);
    });
}

/// `vulkaninfo` asks for everything that a physical device can be asked for.
#[test]
fn vulkaninfo_lists_the_device() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    for layer in ["", VALIDATION] {
        let output = Command::new("vulkaninfo")
            .env("VK_DRIVER_FILES", manifest(directory.path()))
            .env("VK_ICD_FILENAMES", manifest(directory.path()))
            .env("VK_INSTANCE_LAYERS", layer)
            .env_remove("DISPLAY")
            .output();
        let Ok(output) = output else {
            eprintln!("skipped: vulkaninfo is not installed");
            return;
        };
        let text = String::from_utf8_lossy(&output.stdout);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}{errors}");
        assert!(text.contains("GauRast simulated device"), "{text}");
        assert!(
            text.contains("VK_GAURAST_gaussian_primitive_topology"),
            "{text}"
        );
        assert!(
            !errors.contains("vulkan_gaurast"),
            "the driver complains: {errors}"
        );
    }
}

/// The validation layer works over the driver and has nothing against it.
#[test]
fn the_validation_layer_is_content() {
    through_the_loader("the_validation_layer_is_content", |entry| {
        // SAFETY: the loader is loaded.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap();
        if !layers
            .iter()
            .any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_NAME))
        {
            eprintln!("skipped: there is no validation layer here");
            return;
        }
        let heard = Heard::default();
        let layers = [VALIDATION_NAME.as_ptr()];
        let names = [ash::ext::debug_utils::NAME.as_ptr()];
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let mut messenger = heard.messenger();
        messenger.message_severity = vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
            | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR;
        let info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&names)
            .push_next(&mut messenger);
        // SAFETY: the creation info is valid.
        let instance = unsafe { entry.create_instance(&info, None) }.unwrap();
        let context = Context::of(entry, instance);
        let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .synchronization2(true);
        let mut gaussian = PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default()
            .gaussian_primitive_topology(true);
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut vulkan13)
            .push_next(&mut gaussian);
        let extensions = [
            ash::khr::performance_query::NAME,
            gaurast::gaussian_primitive_topology::NAME,
        ];
        let device = context.device(&extensions, &mut features).unwrap();
        // SAFETY: the device is live, and destroyed last.
        unsafe {
            device.get_device_queue(0, 0);
            device.destroy_device(None);
        }
        drop(context);
        assert_eq!(heard.take(), []);
    });
}

/// The shared library exports what the loader needs and no Vulkan command.
#[test]
fn only_the_loaders_symbols_are_exported() {
    let Ok(output) = Command::new("nm")
        .args(["--dynamic", "--defined-only", "--format=just-symbols"])
        .arg(library())
        .output()
    else {
        eprintln!("skipped: nm is not installed");
        return;
    };
    assert!(output.status.success());
    let text = String::from_utf8_lossy(&output.stdout);
    let mut symbols: Vec<_> = text.lines().filter(|name| name.starts_with("vk")).collect();
    symbols.sort_unstable();
    let wanted = [
        "vk_icdGetInstanceProcAddr",
        "vk_icdGetPhysicalDeviceProcAddr",
        "vk_icdNegotiateLoaderICDInterfaceVersion",
    ];
    assert_eq!(symbols, wanted);
}
