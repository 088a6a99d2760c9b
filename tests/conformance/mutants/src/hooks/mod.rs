//! The commands that the layer intercepts, by chapter of Vulkan. Each passes itself on, but for what a mutant changes.

mod bind;
mod draw;
mod gaussian;
mod instance;
mod pass;
mod pipeline;
mod submit;
mod transfer;

use crate::next::device_commands;
use gaurast_layer_interface::hooks;

use bind::*;
use draw::*;
use gaussian::*;
use instance::*;
use pass::*;
use pipeline::*;
use submit::*;
use transfer::*;

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
    get_physical_device_features2
    get_physical_device_properties2
}
