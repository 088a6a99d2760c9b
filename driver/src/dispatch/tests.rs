use super::lookup::{Availability, Command, Scope};
use super::*;
use crate::instance::API_VERSION;
use std::collections::HashSet;
use std::ffi::c_void;
use std::ptr;

/// Runs one of ash's loaders. Returns the names of the commands that it looks up.
fn names_loaded<T>(load: impl FnOnce(&mut dyn FnMut(&CStr) -> *const c_void) -> T) -> Vec<String> {
    let mut names = Vec::new();
    load(&mut |name| {
        names.push(name.to_str().unwrap().to_owned());
        ptr::null()
    });
    assert!(!names.is_empty());
    names
}

fn find_by(name: &str) -> Option<&'static Command> {
    COMMANDS.rows.iter().find(|command| command.name == name)
}

fn scope_and_version(name: &str) -> Option<(Scope, u32)> {
    match find_by(name)? {
        Command { scope, availability: Availability::Core(version), .. } => Some((*scope, *version)),
        _ => None,
    }
}

/// Tests the commands that ash loads: ash aborts the process when an application calls a core command that it didn't
/// find.
#[test]
fn every_core_command_that_ash_loads_is_there() {
    let (v10, v11, v12, v13) = (vk::API_VERSION_1_0, vk::API_VERSION_1_1, vk::API_VERSION_1_2, vk::API_VERSION_1_3);
    let device = [
        (v10, names_loaded(|f| ash::DeviceFnV1_0::load(f))),
        (v11, names_loaded(|f| ash::DeviceFnV1_1::load(f))),
        (v12, names_loaded(|f| ash::DeviceFnV1_2::load(f))),
        (v13, names_loaded(|f| ash::DeviceFnV1_3::load(f))),
    ];
    let mut count = 0;
    for (version, name) in device.iter().flat_map(|(v, names)| names.iter().map(move |n| (v, n))) {
        assert_eq!(scope_and_version(name), Some((Scope::Device, *version)), "{name}");
        count += 1;
    }
    assert!(count > 150, "ash's tables hold Vulkan 1.3's device commands");

    let instance = [
        (v10, names_loaded(|f| ash::InstanceFnV1_0::load(f))),
        (v11, names_loaded(|f| ash::InstanceFnV1_1::load(f))),
        (v13, names_loaded(|f| ash::InstanceFnV1_3::load(f))),
    ];
    for (version, name) in instance.iter().flat_map(|(v, names)| names.iter().map(move |n| (v, n))) {
        let (scope, found) = scope_and_version(name).unwrap_or_else(|| panic!("{name}"));
        assert_ne!(scope, Scope::Global, "{name}");
        assert_eq!(found, *version, "{name}");
    }

    let global = [
        names_loaded(|f| ash::StaticFn::load(f)),
        names_loaded(|f| ash::EntryFnV1_0::load(f)),
        names_loaded(|f| ash::EntryFnV1_1::load(f)),
    ];
    for name in global.iter().flatten() {
        assert_eq!(find_by(name).map(|c| c.scope), Some(Scope::Global), "{name}");
    }
}

/// Tests the commands of the advertised extensions.
#[test]
fn every_command_of_an_advertised_extension_is_there() {
    let mut names = names_loaded(|f| ash::ext::debug_utils::InstanceFn::load(f));
    names.extend(names_loaded(|f| ash::ext::debug_utils::DeviceFn::load(f)));
    names.extend(names_loaded(|f| ash::ext::debug_report::InstanceFn::load(f)));
    names.extend(names_loaded(|f| ash::khr::get_physical_device_properties2::InstanceFn::load(f)));
    names.extend(names_loaded(|f| ash::khr::dynamic_rendering::DeviceFn::load(f)));
    names.extend(names_loaded(|f| ash::khr::synchronization2::DeviceFn::load(f)));
    names.extend(names_loaded(|f| ash::khr::performance_query::InstanceFn::load(f)));
    names.extend(names_loaded(|f| ash::khr::performance_query::DeviceFn::load(f)));
    names.extend(names_loaded(|f| gaurast::gaussian_primitive_topology::DeviceFn::load(f)));
    // ash also loads commands of other vendors' extensions.
    let is_ours = |name: &String| !name.ends_with("AMD") && !name.ends_with("NV");
    for name in names.into_iter().filter(is_ours) {
        let command = find_by(&name).unwrap_or_else(|| panic!("{name}"));
        assert!(!matches!(command.availability, Availability::Core(_)), "{name}");
    }
}

#[test]
fn names_are_distinct() {
    let names: HashSet<_> = COMMANDS.rows.iter().map(|command| command.name).collect();
    assert_eq!(names.len(), COMMANDS.rows.len());
    assert!(names.iter().all(|name| name.starts_with("vk")));
}

#[test]
fn commands_are_there_with_what_is_enabled() {
    let bare = EnabledExtensions { api_version: vk::API_VERSION_1_0, instance_extensions: &[], device_extensions: &[] };
    let newest = EnabledExtensions { api_version: API_VERSION, ..bare };
    let with_extension = EnabledExtensions { device_extensions: &[ash::khr::dynamic_rendering::NAME], ..bare };
    let with_messengers = EnabledExtensions { instance_extensions: &[ash::ext::debug_utils::NAME], ..bare };

    let begin = c"vkCmdBeginRendering";
    assert!(COMMANDS.device_command(begin, &bare).is_none());
    assert!(COMMANDS.device_command(begin, &newest).is_some());
    assert!(COMMANDS.device_command(begin, &with_extension).is_none());
    let begin_khr = c"vkCmdBeginRenderingKHR";
    assert!(COMMANDS.device_command(begin_khr, &newest).is_none());
    assert!(COMMANDS.device_command(begin_khr, &with_extension).is_some());

    // Two extensions come with this command, and one is enough.
    let with_template = c"vkCmdPushDescriptorSetWithTemplateKHR";
    for name in [ash::khr::push_descriptor::NAME, ash::khr::descriptor_update_template::NAME] {
        let enabled = EnabledExtensions { device_extensions: &[name], ..bare };
        assert!(COMMANDS.device_command(with_template, &enabled).is_some());
    }
    assert!(COMMANDS.device_command(with_template, &bare).is_none());

    // Only a device's own commands are found through it.
    assert!(COMMANDS.device_command(c"vkCreateBuffer", &bare).is_some());
    assert!(COMMANDS.device_command(c"vkCreateDevice", &bare).is_none());
    assert!(COMMANDS.device_command(c"vkCreateInstance", &bare).is_none());
    assert!(COMMANDS.device_command(c"vkNoSuchCommand", &newest).is_none());

    // An instance finds its commands and its devices'.
    assert!(COMMANDS.instance_command(c"vkCreateDevice", &bare).is_some());
    assert!(COMMANDS.instance_command(c"vkGetPhysicalDeviceFeatures2", &bare).is_none());
    assert!(COMMANDS.instance_command(c"vkGetPhysicalDeviceFeatures2", &newest).is_some());
    assert!(COMMANDS.instance_command(begin, &bare).is_some());
    assert!(COMMANDS.instance_command(c"vkCreateInstance", &bare).is_none());
    let messenger = c"vkCreateDebugUtilsMessengerEXT";
    assert!(COMMANDS.instance_command(messenger, &bare).is_none());
    assert!(COMMANDS.instance_command(messenger, &with_messengers).is_some());

    // Before there is an instance, and for the loader.
    assert!(COMMANDS.global_command(c"vkCreateInstance").is_some());
    assert!(COMMANDS.global_command(c"vkCreateDevice").is_none());
    assert!(physical_device_command(c"vkGetPhysicalDeviceFeatures", &bare).is_some());
    assert!(physical_device_command(c"vkCreateBuffer", &bare).is_none());
}
