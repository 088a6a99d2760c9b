//! The dispatch table: every command's name, function, scope and gate, and the ways to look one up. The table itself and
//! the functions that Vulkan calls are generated; see `driver/gen`.

mod commands;

use self::commands::COMMANDS;
use ash::vk;
use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::LazyLock;

/// What a command's first parameter is, which decides who may look it up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    /// Before there is an instance.
    Global,
    Instance,
    PhysicalDevice,
    /// A device, queue or command buffer.
    Device,
}

/// What must be there for a command to be.
#[derive(Clone, Copy, Debug)]
enum Gate {
    /// A core version.
    Core(u32),
    /// An enabled instance extension.
    InstanceExtension(&'static CStr),
    /// A device extension: enabled, when looked up for a device; supported, when looked up for an instance.
    DeviceExtension(&'static CStr),
}

/// A row of the table.
#[derive(Debug)]
struct Command {
    name: &'static str,
    function: unsafe extern "system" fn(),
    scope: Scope,
    gate: Gate,
}

/// The table, by scope and gate: `Device, Core(vk::API_VERSION_1_0) => { vkCmdDraw: vk::PFN_vkCmdDraw = vkCmdDraw; }`.
/// Functions are checked against their types.
macro_rules! table {
    ($($scope:ident, $gate:expr => {
        $($name:ident: $type:path = $function:path;)*
    })*) => {
        /// Every command of the driver.
        pub(super) static COMMANDS: &[Command] = &[$($(Command {
            name: stringify!($name),
            function: {
                let function: $type = $function;
                // SAFETY: function pointers have one size, and callers of a void function cast it back first.
                unsafe { std::mem::transmute::<$type, unsafe extern "system" fn()>(function) }
            },
            scope: Scope::$scope,
            gate: $gate,
        },)*)*];
    };
}
use table;

/// What has been enabled where a command is looked up.
pub(crate) struct Enabled<'a> {
    /// The instance's `apiVersion`, at most the driver's.
    pub(crate) api_version: u32,
    /// Enabled instance extensions.
    pub(crate) instance_extensions: &'a [&'static CStr],
    /// Enabled device extensions.
    pub(crate) device_extensions: &'a [&'static CStr],
}

/// Rows by name. A command may be reached through several gates only under several names.
static BY_NAME: LazyLock<HashMap<&'static [u8], &'static Command>> = LazyLock::new(|| {
    COMMANDS
        .iter()
        .map(|command| (command.name.as_bytes(), command))
        .collect()
});

fn find(name: &CStr) -> Option<&'static Command> {
    BY_NAME.get(name.to_bytes()).copied()
}

fn version_reaches(enabled: u32, needed: u32) -> bool {
    (
        vk::api_version_major(enabled),
        vk::api_version_minor(enabled),
    ) >= (vk::api_version_major(needed), vk::api_version_minor(needed))
}

impl Gate {
    fn is_open(self, enabled: &Enabled<'_>) -> bool {
        match self {
            Self::Core(version) => version_reaches(enabled.api_version, version),
            Self::InstanceExtension(name) => enabled.instance_extensions.contains(&name),
            Self::DeviceExtension(name) => enabled.device_extensions.contains(&name),
        }
    }
}

/// `vkGetInstanceProcAddr` without an instance.
pub(crate) fn global_command(name: &CStr) -> vk::PFN_vkVoidFunction {
    find(name)
        .filter(|command| command.scope == Scope::Global)
        .map(|command| command.function)
}

/// `vkGetInstanceProcAddr` of an instance: its own commands, and those of every device that it could have, whose
/// `device_extensions` are all that are supported. A device's core commands are there whatever version the instance
/// asked for, as its devices have them.
pub(crate) fn instance_command(name: &CStr, enabled: &Enabled<'_>) -> vk::PFN_vkVoidFunction {
    let is_reachable = |command: &&Command| match (command.scope, command.gate) {
        (Scope::Global, _) => command.name == "vkGetInstanceProcAddr",
        (Scope::Device, Gate::Core(_)) => true,
        (_, gate) => gate.is_open(enabled),
    };
    find(name)
        .filter(is_reachable)
        .map(|command| command.function)
}

/// `vk_icdGetPhysicalDeviceProcAddr`: commands whose first parameter is a physical device.
pub(crate) fn physical_device_command(
    name: &CStr,
    enabled: &Enabled<'_>,
) -> vk::PFN_vkVoidFunction {
    find(name)
        .filter(|command| command.scope == Scope::PhysicalDevice && command.gate.is_open(enabled))
        .map(|command| command.function)
}

/// `vkGetDeviceProcAddr`: commands of a device, its queues and command buffers.
pub(crate) fn device_command(name: &CStr, enabled: &Enabled<'_>) -> vk::PFN_vkVoidFunction {
    find(name)
        .filter(|command| command.scope == Scope::Device && command.gate.is_open(enabled))
        .map(|command| command.function)
}

#[cfg(test)]
mod tests;
