//! Uses of what the device supports and the application did not enable: they do what they do where it is enabled, with one
//! warning; a strict device refuses them.

use ash::vk;
use gaurast_runner::{Case, Variant};
use gaurast_testkit::descriptors::set_layout;
use gaurast_testkit::devices::open;
use gaurast_testkit::settings::strictly;
use gaurast_testkit::shader::{GLSLANG, Stage, compile};
use gaurast_testkit::{Bindings, Buffer, Driver, Gpu, Graphics, Kernel, Opening, Resource, Shader};

const LACKING: vk::Result = vk::Result::ERROR_FEATURE_NOT_PRESENT;

/// A device on which nothing is enabled.
fn bare() -> Gpu {
    Gpu::open(&Opening { bare: true, ..Opening::of(Driver::Embedded) }).expect("a device")
}

fn ids(gpu: &Gpu) -> Vec<String> {
    gpu.messages().into_iter().map(|message| message.id).collect()
}

/// As programs of ncnn do: 8- and 16-bit storage, and arithmetic of all widths.
const SHADER: &str = "
    #extension GL_EXT_shader_8bit_storage : require
    #extension GL_EXT_shader_16bit_storage : require
    #extension GL_EXT_shader_explicit_arithmetic_types : require
    #extension GL_KHR_shader_subgroup_arithmetic : require
    layout(local_size_x = 32) in;
    layout(binding = 0) buffer Halves { float16_t halves[]; };
    layout(binding = 1) buffer Bytes { uint8_t bytes[]; };
    layout(binding = 2) buffer Longs { uint64_t longs[]; };
    layout(binding = 3) buffer Doubles { double doubles[]; };
    void main() {
        uint at = gl_GlobalInvocationID.x;
        halves[at] = halves[at] * float16_t(0.5) + float16_t(at);
        bytes[at] = uint8_t(uint(bytes[at]) + 3u * at);
        longs[at] = uint64_t(at) << 33 | uint64_t(uint16_t(at) * uint16_t(7));
        doubles[at] = double(at) / 3.0;
    }";

/// The contents of the shader's buffers when it has run.
fn run(gpu: &Gpu) -> Vec<Vec<u8>> {
    let buffers = [2, 1, 8, 8].map(|bytes| Buffer::new(gpu, 32 * bytes));
    for buffer in &buffers {
        buffer.write(&vec![0x3c_u8; buffer.read().len()]);
    }
    let set = Bindings::new(gpu, &buffers.each_ref().map(|buffer| Resource::Storage(buffer.raw)));
    Kernel::new(gpu, SHADER, &set).run(&[set.set], &[], [1, 1, 1]);
    buffers.iter().map(Buffer::read).collect()
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn shaders_compute_the_same() {
    let (enabled, bare) = (open(), bare());
    let expected = run(&enabled);
    assert_eq!(ids(&enabled), [""; 0]);
    assert_eq!(run(&bare), expected);
    let messages = bare.messages();
    for capability in ["Float16", "StorageBuffer16BitAccess", "StorageBuffer8BitAccess", "Int16", "Int64", "Float64"] {
        let of_it = messages.iter().filter(|message| message.text.contains(&format!("capability {capability},")));
        assert_eq!(of_it.count(), 1, "{capability}: {messages:?}");
    }
    assert!(messages.iter().all(|message| message.id == "VUID-VkShaderModuleCreateInfo-pCode-08740"), "{messages:?}");
    assert_eq!(run(&bare), expected);
    assert_eq!(ids(&bare), [""; 0], "each is warned of once");
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn a_strict_device_refuses_shaders(case: &Case) {
    strictly(case, || {
        let gpu = bare();
        let words = compile(Stage::Compute, SHADER);
        let set = set_layout(&gpu, &[], vk::DescriptorSetLayoutCreateFlags::empty());
        let refused = Kernel::specialized(&gpu, &words, &[set], &[]);
        assert_eq!(refused.map(drop), Err(LACKING));
        assert_eq!(ids(&gpu), ["VUID-VkShaderModuleCreateInfo-pCode-08740"]);
        // SAFETY: see the crate.
        unsafe { gpu.device().destroy_descriptor_set_layout(set, None) };
    });
}

/// True and false for devices that are strict and those that aren't.
fn strictness() -> Vec<Variant> {
    ["lenient", "strict"].map(Variant::new).into()
}

/// Runs `inside` with true in a strict process, or with false.
fn of_strictness(case: &Case, inside: impl FnOnce(bool)) {
    match case.variant() {
        "strict" => strictly(case, || inside(true)),
        _ => inside(false),
    }
}

#[gaurast_runner::test(each = strictness(), needs = [GLSLANG])]
fn pipelines_have_stages_and_topologies(case: &Case) {
    of_strictness(case, |is_strict| {
        let gpu = bare();
        let invalid = vk::Result::ERROR_VALIDATION_FAILED_EXT;
        let vertex = Shader::vertex(compile(Stage::Vertex, "void main() { gl_Position = vec4(0.0); }"));
        let plain = Graphics { shaders: vec![vertex], ..Graphics::default() };
        let adjacent = Graphics { topology: vk::PrimitiveTopology::LINE_LIST_WITH_ADJACENCY, ..plain.clone() };
        let restarting = Graphics { restart: true, topology: vk::PrimitiveTopology::POINT_LIST, ..plain.clone() };
        let library = Graphics {
            flags: vk::PipelineCreateFlags::LIBRARY_KHR,
            parts: Some(vk::GraphicsPipelineLibraryFlagsEXT::VERTEX_INPUT_INTERFACE),
            ..plain.clone()
        };
        let inline = Graphics { inline_modules: true, ..plain };
        for (request, error, id) in [
            (adjacent, invalid, "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-00429"),
            (restarting, invalid, "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-06252"),
            (inline, invalid, "VUID-VkPipelineShaderStageCreateInfo-stage-08771"),
            (library, LACKING, "VUID-VkGraphicsPipelineCreateInfo-graphicsPipelineLibrary-06606"),
        ] {
            let expected = if is_strict { Err(error) } else { Ok(()) };
            assert_eq!(request.create(&gpu).map(drop), expected, "{id}");
            assert_eq!(ids(&gpu), [id]);
            assert_eq!(request.create(&gpu).map(drop), expected, "{id}");
            assert_eq!(ids(&gpu).len(), usize::from(is_strict), "{id}: a warning comes once, errors each time");
        }
    });
}

#[gaurast_runner::test(each = strictness())]
fn features_of_extensions_that_are_not_enabled(case: &Case) {
    of_strictness(case, |is_strict| {
        let gpu = open();
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let mut feature = vk::PhysicalDeviceTransformFeedbackFeaturesEXT::default().transform_feedback(true);
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut feature);
        // SAFETY: see the crate.
        let created = unsafe { gpu.instance().create_device(gpu.physical_device(), &info, None) };
        assert_eq!(created.is_err(), is_strict);
        assert_eq!(ids(&gpu), ["VUID-VkDeviceCreateInfo-pNext-pNext"]);
        if let Ok(device) = created {
            // SAFETY: nothing was made of it.
            unsafe { device.destroy_device(None) };
        }
        // What the device lacks is refused by any.
        let mut lacking = vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT::default()
            .extended_dynamic_state3_color_blend_advanced(true);
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut lacking);
        // SAFETY: see the crate.
        let refused = unsafe { gpu.instance().create_device(gpu.physical_device(), &info, None) };
        assert_eq!(refused.map(drop), Err(LACKING));
    });
}

/// Command buffers are reset, begun and pending without what their pools and flags would need.
#[gaurast_runner::test]
fn command_buffers_are_reset_and_pending() {
    let gpu = bare();
    let device = gpu.device();
    let buffer = Buffer::new(&gpu, 4);
    // SAFETY: see the crate; the driver allows what breaks valid usage.
    unsafe {
        let pool = device.create_command_pool(&vk::CommandPoolCreateInfo::default(), None).expect("a pool");
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let commands = device.allocate_command_buffers(&info).expect("a command buffer")[0];
        let begin = vk::CommandBufferBeginInfo::default();
        let record = |word| {
            device.begin_command_buffer(commands, &begin).expect("it begins");
            device.cmd_fill_buffer(commands, buffer.raw, 0, 4, word);
        };
        record(1);
        record(2);
        device.end_command_buffer(commands).expect("it ends");
        record(3);
        device.end_command_buffer(commands).expect("it ends");
        device.reset_command_buffer(commands, vk::CommandBufferResetFlags::empty()).expect("a reset");
        record(4);
        device.end_command_buffer(commands).expect("it ends");
        let both = [commands, commands];
        let submit = vk::SubmitInfo::default().command_buffers(&both);
        device.queue_submit(gpu.queue(), &[submit], vk::Fence::null()).expect("a submission");
        device.queue_wait_idle(gpu.queue()).expect("it ends");
        assert_eq!(buffer.values::<u32>(), [4]);
        let heard = ids(&gpu);
        for rule in [
            "VUID-vkBeginCommandBuffer-commandBuffer-00049",
            "VUID-vkBeginCommandBuffer-commandBuffer-00050",
            "VUID-vkResetCommandBuffer-commandBuffer-00046",
            "VUID-vkQueueSubmit-pCommandBuffers-00071",
        ] {
            assert_eq!(heard.iter().filter(|id| *id == rule).count(), 1, "{rule}: {heard:?}");
        }
        device.destroy_command_pool(pool, None);
    }
}

/// Sets are freed one by one, and are updated after bind, of pools that are not for that.
#[gaurast_runner::test]
fn pools_give_and_take_any_set() {
    let gpu = bare();
    let kinds = [(0, vk::DescriptorType::STORAGE_BUFFER, 1)];
    let layout = set_layout(&gpu, &kinds, vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL);
    let sizes = [vk::DescriptorPoolSize { ty: kinds[0].1, descriptor_count: 1 }];
    let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
    // SAFETY: see the crate; the driver allows what breaks valid usage.
    unsafe {
        let pool = gpu.device().create_descriptor_pool(&info, None).expect("a pool");
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        for _ in 0..2 {
            let sets = gpu.device().allocate_descriptor_sets(&info).expect("a set");
            gpu.device().free_descriptor_sets(pool, &sets).expect("it is freed");
        }
        assert_eq!(
            ids(&gpu),
            ["VUID-VkDescriptorSetAllocateInfo-pSetLayouts-03044", "VUID-vkFreeDescriptorSets-descriptorPool-00312"]
        );
        gpu.device().destroy_descriptor_pool(pool, None);
        gpu.device().destroy_descriptor_set_layout(layout, None);
    }
}
