//! Tables of commands, and the ways to look one up: a row is a command's name, function, scope and availability.

use crate::abi::error::Error;
use crate::device::Device;
use crate::instance::{EnabledExtensions, Instance};
use ash::vk;
use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::OnceLock;

/// The kind of a command's first parameter, which decides through which object the command may be looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    /// No object: the command is called before there is an instance.
    Global,
    Instance,
    PhysicalDevice,
    /// A device, queue or command buffer.
    Device,
}

/// The condition under which a command is available.
#[derive(Clone, Copy, Debug)]
pub(super) enum Availability {
    /// A core version.
    Core(u32),
    /// One of these instance extensions is enabled.
    InstanceExtension(&'static [&'static CStr]),
    /// One of these device extensions is enabled, when looked up for a device; or supported, when looked up for an
    /// instance.
    DeviceExtension(&'static [&'static CStr]),
}

/// A row of the table.
#[derive(Debug)]
pub(super) struct Command {
    pub(super) name: &'static str,
    pub(super) function: unsafe extern "system" fn(),
    pub(super) scope: Scope,
    pub(super) availability: Availability,
}

/// The rows, by scope and availability: `Device, Core(vk::API_VERSION_1_0) => { vkCmdDraw: vk::PFN_vkCmdDraw; }`. A
/// function has its command's name and is checked against the command's type. Other names of the command have rows of
/// the form `vkCmdDrawIndirectCountKHR = vkCmdDrawIndirectCount;`.
macro_rules! rows {
    ($($scope:ident, $availability:expr => {
        $($name:ident $(: $type:path)? $(= $function:ident)?;)*
    })*) => {
        &[$($(Command {
            name: stringify!($name),
            function: rows!(@function $name $(: $type)? $(= $function)?),
            scope: Scope::$scope,
            availability: $availability,
        },)*)*]
    };
    (@function $name:ident: $type:path) => {{
        let function: $type = $name;
        // SAFETY: function pointers have one size, and callers of a void function cast it back first.
        unsafe { std::mem::transmute::<$type, unsafe extern "system" fn()>(function) }
    }};
    (@function $name:ident = $function:ident) => {
        // SAFETY: the pointer is that of a function, and callers of a void function cast it back first.
        unsafe { std::mem::transmute::<*const (), unsafe extern "system" fn()>($function as *const ()) }
    };
}
pub(super) use rows;

/// A table of commands.
pub(super) struct Commands {
    /// The rows.
    pub(super) rows: &'static [Command],
    /// Rows by name. A command that is available for several reasons has a name for each.
    by_name: OnceLock<HashMap<&'static [u8], &'static Command>>,
}

impl Commands {
    /// A table of these rows.
    pub(super) const fn new(rows: &'static [Command]) -> Self {
        Self { rows, by_name: OnceLock::new() }
    }

    fn find(&self, name: &CStr) -> Option<&'static Command> {
        let by_name = self.by_name.get_or_init(|| {
            let rows = self.rows.iter();
            rows.map(|command| (command.name.as_bytes(), command)).collect()
        });
        by_name.get(name.to_bytes()).copied()
    }

    /// `vkGetInstanceProcAddr` without an instance.
    pub(super) fn global_command(&self, name: &CStr) -> vk::PFN_vkVoidFunction {
        self.find(name).filter(|command| command.scope == Scope::Global).map(|command| command.function)
    }

    /// `vkGetInstanceProcAddr` of an instance: its own commands, and those of all devices, whose `device_extensions`
    /// are all that are supported. All core commands of devices are found, whatever version the instance requested,
    /// because devices have them.
    pub(super) fn instance_command(&self, name: &CStr, enabled: &EnabledExtensions<'_>) -> vk::PFN_vkVoidFunction {
        let is_reachable = |command: &&Command| match (command.scope, command.availability) {
            (Scope::Global, _) => command.name == "vkGetInstanceProcAddr",
            (Scope::Device, Availability::Core(_)) => true,
            (_, availability) => availability.is_available(enabled),
        };
        self.find(name).filter(is_reachable).map(|command| command.function)
    }

    /// `vk_icdGetPhysicalDeviceProcAddr`: commands whose first parameter is a physical device.
    pub(super) fn physical_device_command(
        &self,
        name: &CStr,
        enabled: &EnabledExtensions<'_>,
    ) -> vk::PFN_vkVoidFunction {
        self.find(name)
            .filter(|command| command.scope == Scope::PhysicalDevice && command.availability.is_available(enabled))
            .map(|command| command.function)
    }

    /// `vkGetDeviceProcAddr`: commands of a device, its queues and command buffers.
    pub(super) fn device_command(&self, name: &CStr, enabled: &EnabledExtensions<'_>) -> vk::PFN_vkVoidFunction {
        self.find(name)
            .filter(|command| command.scope == Scope::Device && command.availability.is_available(enabled))
            .map(|command| command.function)
    }
}

fn version_reaches(enabled: u32, needed: u32) -> bool {
    (vk::api_version_major(enabled), vk::api_version_minor(enabled))
        >= (vk::api_version_major(needed), vk::api_version_minor(needed))
}

impl Availability {
    fn is_available(self, enabled: &EnabledExtensions<'_>) -> bool {
        let is_any = |names: &[&CStr], enabled: &[&CStr]| names.iter().any(|name| enabled.contains(name));
        match self {
            Self::Core(version) => version_reaches(enabled.api_version, version),
            Self::InstanceExtension(names) => is_any(names, enabled.instance_extensions),
            Self::DeviceExtension(names) => is_any(names, enabled.device_extensions),
        }
    }
}

#[doc(alias = "vkGetInstanceProcAddr")]
pub(super) fn get_instance_proc_addr(
    commands: &Commands,
    instance: Option<&Instance>,
    name: &CStr,
) -> Result<vk::PFN_vkVoidFunction, Error> {
    Ok(match instance {
        None => commands.global_command(name),
        Some(instance) => commands.instance_command(name, &instance.enabled_extensions()),
    })
}

#[doc(alias = "vkGetDeviceProcAddr")]
pub(super) fn get_device_proc_addr(
    commands: &Commands,
    device: &Device,
    name: &CStr,
) -> Result<vk::PFN_vkVoidFunction, Error> {
    Ok(commands.device_command(name, &device.enabled_extensions()))
}
