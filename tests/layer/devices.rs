//! Mistakes in the creation of devices.

use ash::vk;
use gaurast::gaussian_primitive_topology::NAME;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
use gaurast_testkit::{Gpu, Message};

use crate::stage::{Mistake, mistake};

/// The messages as a device is created.
fn created(gpu: &Gpu, has_extension: bool, features: Option<Features<'static>>) -> Vec<Message> {
    gpu.messages();
    let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
    let names = if has_extension { vec![NAME.as_ptr()] } else { Vec::new() };
    let mut given = features.unwrap_or_default();
    let mut info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names);
    if features.is_some() {
        info = info.push_next(&mut given);
    }
    // SAFETY: see the crate.
    unsafe {
        if let Ok(device) = gpu.instance().create_device(gpu.physical_device(), &info, None) {
            device.destroy_device(None);
        }
    }
    gpu.messages()
}

pub fn mistakes() -> Vec<Mistake> {
    vec![
        mistake("the extension is enabled without a structure of features", "GAURAST-Device-no-features", |stage| {
            created(&stage.full, true, None)
        }),
        mistake("the structure of features enables none", "GAURAST-Device-no-features", |stage| {
            created(&stage.full, true, Some(Features::default()))
        }),
        mistake(
            "an optional feature without `gaussianPrimitiveTopology`",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianPrimitiveTopology-90032",
            |stage| {
                let features = Features::default().radial_distance_order(true);
                created(&stage.full, true, Some(features))
            },
        ),
        mistake("features without the extension", "VUID-VkDeviceCreateInfo-pNext-pNext", |stage| {
            let features = Features::default().gaussian_primitive_topology(true);
            created(&stage.full, false, Some(features))
        }),
    ]
}
