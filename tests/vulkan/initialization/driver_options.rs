//! `VK_GAURAST_driver_options`: options in the `pNext` chain of `VkInstanceCreateInfo`, embedded, through the loader, and
//! below a layer.

use ash::vk;
use gaurast::WorkTrace;
use gaurast::vk::{DriverOptionsGAURAST, SimdLevelGAURAST};
use gaurast_runner::{Case, Need, Variant};
use gaurast_testkit::context::{Context, loader};
use gaurast_testkit::loader::{LAYER, through_the_loader, with_the_layer};
use gaurast_testkit::{Message, Messages};
use std::ffi::CStr;
use std::ptr;

/// Creates an instance with options, which lie between two other structures of its chain.
fn instance(entry: ash::Entry, layers: &[&CStr], options: DriverOptionsGAURAST<'_>, messages: &Messages) -> Context {
    let layers: Vec<_> = layers.iter().map(|name| name.as_ptr()).collect();
    let extensions = [ash::ext::debug_utils::NAME.as_ptr()];
    let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let mut messenger = messages.messenger();
    let mut options = options;
    let mut features = vk::ValidationFeaturesEXT::default();
    let info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions)
        .push_next(&mut messenger)
        .push_next(&mut options)
        .push_next(&mut features);
    // SAFETY: the creation info is valid, and the tests keep what it points at.
    let instance = unsafe { entry.create_instance(&info, None) }.expect("an instance");
    Context::of(entry, instance)
}

/// Creates a device and destroys it.
fn use_device(context: &Context) -> Result<(), vk::Result> {
    let device = context.device(&[], &mut vk::PhysicalDeviceFeatures2::default())?;
    // SAFETY: the device is live and not used again.
    unsafe { device.destroy_device(None) };
    Ok(())
}

/// Asserts that a device gives its trace to the function in the options.
fn assert_trace_arrives(entry: ash::Entry, layers: &[&CStr]) {
    let (trace, messages) = (WorkTrace::default(), Messages::default());
    let context = instance(entry, layers, DriverOptionsGAURAST::default().work_trace(&trace), &messages);
    assert_eq!(trace.take(), None);
    use_device(&context).expect("a device");
    let json = String::from_utf8(trace.take().expect("a trace")).expect("UTF-8");
    assert!(json.starts_with('{') && json.contains("\"frames\":[]"), "{json}");
    assert_eq!(trace.take(), None);
}

#[gaurast_runner::test]
fn the_trace_goes_to_the_programs_function() {
    assert_trace_arrives(vulkan_gaurast::entry(), &[]);
}

#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn the_loader_passes_the_options_on(case: &Case) {
    through_the_loader(case, || assert_trace_arrives(loader(), &[]));
}

#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn a_layer_passes_the_options_on(case: &Case) {
    with_the_layer(case, None, || assert_trace_arrives(loader(), &[LAYER]));
}

/// A variant for each way to the driver.
fn ways() -> Vec<Variant> {
    vec![Variant::new("embedded"), Variant { needs: vec![Need::VulkanLoader], ..Variant::new("loader") }]
}

/// Each refused option is named by the message, which reaches a messenger that is created with the instance.
#[gaurast_runner::test(each = ways())]
fn a_wrong_option_is_refused_by_its_rule(case: &Case) {
    let check = |entry: fn() -> ash::Entry| {
        let options = DriverOptionsGAURAST::default();
        for (wrong, rule, text) in [
            (options.thread_count(u32::MAX), "threadCount-91001", "threadCount is 4294967295: there are "),
            (options.simd_level(SimdLevelGAURAST::from_raw(9)), "simdLevel-parameter", "simdLevel is 9: "),
            (options.p_optimizations(c"much".as_ptr()), "pOptimizations-91002", "pOptimizations is \"much\": "),
        ] {
            let messages = Messages::default();
            let context = instance(entry(), &[], wrong, &messages);
            let debug_utils = ash::ext::debug_utils::Instance::new(&context.entry, &context.instance);
            // SAFETY: the extension is enabled, and the messages outlive the messenger.
            let messenger = unsafe { debug_utils.create_debug_utils_messenger(&messages.messenger(), None) };
            assert_eq!(use_device(&context), Err(vk::Result::ERROR_VALIDATION_FAILED_EXT));
            // SAFETY: the messenger is the instance's.
            unsafe { debug_utils.destroy_debug_utils_messenger(messenger.expect("a messenger"), None) };
            let id = format!("VUID-VkDriverOptionsGAURAST-{rule}");
            let is_it = |message: &Message| message.id == id && message.text.contains(text);
            let messages = messages.take();
            assert!(messages.iter().any(is_it), "{id}: {messages:?}");
        }
    };
    match case.variant() {
        "embedded" => check(vulkan_gaurast::entry),
        _ => through_the_loader(case, || check(loader)),
    }
}

/// The extension is listed, and can be enabled, where no loader hides it.
#[gaurast_runner::test]
fn the_extension_is_listed() {
    let entry = vulkan_gaurast::entry();
    // SAFETY: the entry is the driver's.
    let listed = unsafe { entry.enumerate_instance_extension_properties(None) }.expect("extensions");
    let is_it = |it: &&vk::ExtensionProperties| it.extension_name_as_c_str() == Ok(gaurast::driver_options::NAME);
    let found = listed.iter().find(is_it).expect("the extension");
    assert_eq!(found.spec_version, gaurast::driver_options::SPEC_VERSION);
    use_device(&Context::embedded(&[gaurast::driver_options::NAME])).expect("a device");
}

/// A variant for each value of `GAURAST_THREADS`.
fn thread_counts() -> Vec<Variant> {
    ["2", "0", "many"].map(Variant::new).into()
}

/// A variable of the environment wins over a wrong option, and a wrong variable is refused.
#[gaurast_runner::test(each = thread_counts())]
fn the_environment_wins(case: &Case) {
    if !case.is_alone() {
        return case.run_alone(|command| {
            command.env("GAURAST_THREADS", case.variant()).env("GAURAST_SIMD", "").env("GAURAST_OPTIMIZATIONS", "all");
        });
    }
    let messages = Messages::default();
    let options = DriverOptionsGAURAST::default().thread_count(u32::MAX).p_optimizations(c"much".as_ptr());
    let context = instance(vulkan_gaurast::entry(), &[], options, &messages);
    let expected = match case.variant() {
        "many" => Err(vk::Result::ERROR_INITIALIZATION_FAILED),
        _ => Ok(()),
    };
    assert_eq!(use_device(&context), expected);
}

/// A variant for each value of `GAURAST_DEVICE_TYPE`.
fn device_types() -> Vec<Variant> {
    ["cpu", "discrete", "integrated", "virtual", "other", "gpu"].map(Variant::new).into()
}

/// The device reports the type that the environment asks for, and no device is created for an unknown one.
#[gaurast_runner::test(each = device_types())]
fn the_device_reports_another_type(case: &Case) {
    if !case.is_alone() {
        return case.run_alone(|command| {
            command.env("GAURAST_DEVICE_TYPE", case.variant());
        });
    }
    let messages = Messages::default();
    let context = instance(vulkan_gaurast::entry(), &[], DriverOptionsGAURAST::default(), &messages);
    let expected = match case.variant() {
        "discrete" => vk::PhysicalDeviceType::DISCRETE_GPU,
        "integrated" => vk::PhysicalDeviceType::INTEGRATED_GPU,
        "virtual" => vk::PhysicalDeviceType::VIRTUAL_GPU,
        "other" => vk::PhysicalDeviceType::OTHER,
        _ => vk::PhysicalDeviceType::CPU,
    };
    let mut second = vk::PhysicalDeviceProperties2::default();
    // SAFETY: the physical device is the instance's.
    let first = unsafe {
        context.instance.get_physical_device_properties2(context.physical_device, &mut second);
        context.instance.get_physical_device_properties(context.physical_device)
    };
    assert_eq!((first.device_type, second.properties.device_type), (expected, expected));
    let created = match case.variant() {
        "gpu" => Err(vk::Result::ERROR_INITIALIZATION_FAILED),
        _ => Ok(()),
    };
    assert_eq!(use_device(&context), created);
}

/// A function that is null, and options of zeros, are the defaults.
#[gaurast_runner::test]
fn zeros_are_the_defaults() {
    let options =
        DriverOptionsGAURAST { p_user_data: ptr::without_provenance_mut(1), ..DriverOptionsGAURAST::default() };
    let messages = Messages::default();
    use_device(&instance(vulkan_gaurast::entry(), &[], options, &messages)).expect("a device");
    assert!(messages.take().is_empty());
}
