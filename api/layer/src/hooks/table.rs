//! The hooks by the names of their commands.

use crate::hooks::instance::*;
use crate::hooks::objects::*;
use crate::hooks::recording::*;
use crate::hooks::submit::*;
use crate::hooks::waits::*;
use crate::next::device_commands;
use gaurast_layer_interface::hooks;

macro_rules! of_device {
    ($($name:ident)*) => {
        hooks! {
            /// The hook of a device's command.
            device_hook: $($name)*
        }
    };
}
device_commands!(of_device);

hooks! {
    /// The hook of an instance's command.
    instance_hook:
    create_instance
    destroy_instance
    create_device
    create_messenger
    destroy_messenger
}
