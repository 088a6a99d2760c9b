//! A Gaussian draw through the loader, under the validation layer.

use ash::vk;
use gaurast::vk::{GaussianSphericalHarmonicsBufferGAURAST, PipelineGaussianStateCreateFlagsGAURAST};
use gaurast_runner::{Case, Need};
use gaurast_testkit::devices::{MAPPABLE, everything_of, gaussian};
use gaurast_testkit::loader::{through_the_loader, through_the_loader_with};
use gaurast_testkit::scene::{CENTER, Scene, assert_close, at, pass, premultiplied, splat, splats};
use gaurast_testkit::{Driver, Gpu, Graphics, Opening};
use std::collections::BTreeSet;
use std::ffi::CStr;

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The layer's messages about valid usage of the extension, which it does not know.
const EXPECTED: &[&str] = &[
    // The device extension is unknown.
    "VUID_Undefined",
    // The topology is out of the enum's range.
    "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter",
    // The pipeline has no vertex stage, and so no stage at all.
    "VUID-VkGraphicsPipelineCreateInfo-pStages-06600",
    "VUID-VkGraphicsPipelineCreateInfo-pStages-06896",
    "VUID-VkGraphicsPipelineCreateInfo-stage-00727",
    "VUID-VkGraphicsPipelineCreateInfo-stageCount-06604",
];

/// Advice of the layer on speed, which is ignored: the testkit keeps every image in one layout.
const ADVICE: &str = "For optimal performance";

#[gaurast_runner::test(needs = [Need::ValidationLayer])]
fn a_draw_is_as_it_is_without_the_layer(case: &Case) {
    through_the_loader(case, || {
        let color = [0.9, 0.2, 0.1];
        let gaussians = [splat([0.0, 0.0, 5.0], 0.1, 0.8, color)];
        let opening = Opening { layers: &[LAYER], ..everything_of(Driver::Loaded) };
        let gpu = Gpu::open(&opening).expect("a device");
        let scene = Scene::on(gpu, &gaussians, &splats());
        let pixels = scene.draw([0.0; 4], |device, commands| {
            // SAFETY: see the crate.
            unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
        });
        assert_close(at(&pixels, CENTER), premultiplied(color, 0.8));
        let messages = scene.gpu.message_texts();
        let ids: BTreeSet<_> = messages.iter().map(|message| id(message)).collect();
        let unexpected: Vec<_> =
            messages.iter().filter(|message| !EXPECTED.contains(&id(message)) && !message.contains(ADVICE)).collect();
        assert!(unexpected.is_empty(), "{unexpected:#?}");
        let layer_was_there = "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter";
        assert!(ids.contains(layer_was_there), "{ids:?}");
    });
}

/// The variable by which the layer looks for hazards, too.
const FIND_HAZARDS: (&str, &str) = ("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT");

/// A buffer that is copied to and has an address.
fn addressed(gpu: &Gpu, size: u64) -> (vk::Buffer, vk::DeviceMemory, u64) {
    use vk::BufferUsageFlags as Usage;
    let usage = Usage::SHADER_DEVICE_ADDRESS | Usage::STORAGE_BUFFER | Usage::TRANSFER_DST;
    let info = vk::BufferCreateInfo::default().size(size).usage(usage);
    let device = gpu.device();
    // SAFETY: see the crate.
    unsafe {
        let buffer = device.create_buffer(&info, None).unwrap();
        let needed = device.get_buffer_memory_requirements(buffer);
        let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        let allocation = vk::MemoryAllocateInfo::default()
            .allocation_size(needed.size)
            .memory_type_index(MAPPABLE)
            .push_next(&mut flags);
        let memory = device.allocate_memory(&allocation, None).unwrap();
        device.bind_buffer_memory(buffer, memory, 0).unwrap();
        let info = vk::BufferDeviceAddressInfo::default().buffer(buffer);
        (buffer, memory, device.get_buffer_device_address(&info))
    }
}

/// Harmonics that a command writes are drawn behind the barrier that the extension's text names, which the layer finds no
/// hazard in; it does find one that is there.
#[gaurast_runner::test(needs = [Need::ValidationLayer])]
fn harmonics_from_a_buffer_are_synchronized_as_the_text_says(case: &Case) {
    through_the_loader_with(case, &[FIND_HAZARDS], || {
        let opening = Opening { layers: &[LAYER], ..everything_of(Driver::Loaded) };
        let gpu = Gpu::open(&opening).expect("a device");
        let request = splats();
        let flag = PipelineGaussianStateCreateFlagsGAURAST::SPHERICAL_HARMONICS_BUFFER;
        let request = Graphics { gaussian: request.gaussian.map(|state| state.flags(flag)), ..request };
        let gaussians = [splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.9, 0.2, 0.1])];
        let scene = Scene::on(gpu, &gaussians, &request);
        let (buffer, memory, address) = addressed(&scene.gpu, 12);
        let harmonics = GaussianSphericalHarmonicsBufferGAURAST::default()
            .device_address(address)
            .size(12)
            .format(vk::Format::R32G32B32_SFLOAT)
            .stride(12);
        use vk::{AccessFlags as Access, PipelineStageFlags as Stage};
        let written =
            [vk::MemoryBarrier::default().src_access_mask(Access::TRANSFER_WRITE).dst_access_mask(Access::SHADER_READ)];
        let no = vk::DependencyFlags::empty();
        scene.gpu.run(|recording| {
            let (device, commands) = recording.raw();
            // SAFETY: see the crate.
            unsafe {
                // The colour of zeros is a half.
                device.cmd_fill_buffer(commands, buffer, 0, 12, 0);
                let stages = (Stage::TRANSFER, Stage::VERTEX_SHADER);
                device.cmd_pipeline_barrier(commands, stages.0, stages.1, no, &written, &[], &[]);
            }
            pass(device, commands, &scene.image, [0.0; 4], || {
                scene.bind(device, commands);
                // SAFETY: see the crate.
                unsafe {
                    let own = gaussian(&scene.gpu);
                    own.cmd_bind_gaussian_spherical_harmonics(commands, &harmonics);
                    device.cmd_draw(commands, 1, 1, 0, 0);
                }
            });
            let written_again = [vk::MemoryBarrier::default()
                .src_access_mask(Access::TRANSFER_WRITE)
                .dst_access_mask(Access::TRANSFER_WRITE)];
            // SAFETY: see the crate. What was read may be written again.
            unsafe {
                let before = Stage::VERTEX_SHADER | Stage::TRANSFER;
                let after = Stage::TRANSFER;
                device.cmd_pipeline_barrier(commands, before, after, no, &written_again, &[], &[]);
                device.cmd_fill_buffer(commands, buffer, 0, 12, 1);
            }
        });
        assert_close(at(&scene.pixels(), CENTER), premultiplied([0.5; 3], 0.8));
        let hazards = |messages: &[String]| -> Vec<String> {
            let is_hazard = |message: &&String| message.contains("SYNC-HAZARD");
            messages.iter().filter(is_hazard).cloned().collect()
        };
        let found = hazards(&scene.gpu.message_texts());
        assert!(found.is_empty(), "{found:#?}");
        scene.gpu.run(|recording| {
            let (device, commands) = recording.raw();
            // SAFETY: see the crate; that the second may come first is the point.
            unsafe {
                device.cmd_fill_buffer(commands, buffer, 0, 12, 2);
                device.cmd_fill_buffer(commands, buffer, 0, 12, 3);
            }
        });
        let found = hazards(&scene.gpu.message_texts());
        assert!(!found.is_empty(), "the layer does not look for hazards");
        // SAFETY: see the crate.
        unsafe {
            scene.gpu.device().destroy_buffer(buffer, None);
            scene.gpu.device().free_memory(memory, None);
        }
    });
}

/// The id in a message of the layer: "Validation Error: [ ID ] ...".
fn id(message: &str) -> &str {
    let after = message.split_once("[ ").map_or(message, |(_, rest)| rest);
    after.split_once(" ]").map_or(after, |(id, _)| id)
}
