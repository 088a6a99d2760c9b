//! Extensions that are newer names of others, or that ask for what the device does in any case.

use ash::vk;
use gaurast_runner::Case;
use gaurast_testkit::devices::own;
use gaurast_testkit::newer::Flags;
use gaurast_testkit::settings::strictly;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::{
    Bindings, Buffer, Driver, Gpu, Opening, Pass, Pipeline, PipelineOptions, Resource, Target, Vertex, shapes,
};
use std::ffi::CStr;

/// Opens a device on which an extension with its features is enabled, and nothing else.
fn open<T: vk::ExtendsDeviceCreateInfo>(name: &CStr, features: &mut T) -> Gpu {
    let opening = Opening { extensions: &[name], bare: true, ..Opening::of(Driver::Embedded) };
    let gpu = Gpu::open_with(&opening, features).expect("a device");
    assert_eq!(gpu.message_texts(), [""; 0], "{name:?}");
    gpu
}

/// A strict device takes the features with either name of their extension.
#[gaurast_runner::test]
fn features_come_with_each_name(case: &Case) {
    strictly(case, || {
        for name in [ash::khr::index_type_uint8::NAME, ash::ext::index_type_uint8::NAME] {
            open(name, &mut vk::PhysicalDeviceIndexTypeUint8FeaturesKHR::default().index_type_uint8(true));
        }
        for name in [ash::khr::line_rasterization::NAME, ash::ext::line_rasterization::NAME] {
            open(name, &mut vk::PhysicalDeviceLineRasterizationFeaturesKHR::default().bresenham_lines(true));
        }
        for name in [ash::khr::vertex_attribute_divisor::NAME, ash::ext::vertex_attribute_divisor::NAME] {
            let features = vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR::default();
            open(name, &mut features.vertex_attribute_instance_rate_divisor(true));
        }
        for name in [c"VK_KHR_robustness2", ash::ext::robustness2::NAME] {
            open(name, &mut vk::PhysicalDeviceRobustness2FeaturesEXT::default().null_descriptor(true));
        }
        for name in [ash::khr::global_priority::NAME, ash::ext::global_priority_query::NAME] {
            open(name, &mut vk::PhysicalDeviceGlobalPriorityQueryFeaturesKHR::default().global_priority_query(true));
        }
        open(c"VK_KHR_unified_image_layouts", &mut Flags::<1_000_527_000, 2>::new([vk::TRUE, vk::FALSE]));
        let opening = Opening { extensions: &[], bare: true, ..Opening::of(Driver::Embedded) };
        let mut features = vk::PhysicalDeviceRobustness2FeaturesEXT::default().null_descriptor(true);
        assert!(Gpu::open_with(&opening, &mut features).is_err(), "no extension is enabled");
    });
}

/// Layouts of video are not unified, because there is none.
#[gaurast_runner::test]
fn the_newer_structures_are_written() {
    let gpu = own();
    let mut layouts = Flags::<1_000_527_000, 2>::new([vk::FALSE; 2]);
    let mut divisors = vk::PhysicalDeviceVertexAttributeDivisorPropertiesKHR::default();
    let mut robustness = vk::PhysicalDevicePipelineRobustnessPropertiesEXT::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut layouts);
    // SAFETY: see the crate.
    unsafe { gpu.instance().get_physical_device_features2(gpu.physical_device(), &mut features) };
    assert_eq!(layouts.values, [vk::TRUE, vk::FALSE]);
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut divisors).push_next(&mut robustness);
    // SAFETY: see the crate.
    unsafe { gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut properties) };
    assert_eq!((divisors.max_vertex_attrib_divisor, divisors.supports_non_zero_first_instance), (u32::MAX, vk::TRUE));
    let buffers = vk::PipelineRobustnessBufferBehaviorEXT::ROBUST_BUFFER_ACCESS_2;
    assert_eq!(robustness.default_robustness_storage_buffers, buffers);
    assert_eq!(robustness.default_robustness_uniform_buffers, buffers);
    assert_eq!(robustness.default_robustness_vertex_inputs, buffers);
    assert_eq!(robustness.default_robustness_images, vk::PipelineRobustnessImageBehaviorEXT::ROBUST_IMAGE_ACCESS_2);
}

/// A kernel that reads beyond its buffer sees zeros there, whatever robustness its pipeline asks for.
#[gaurast_runner::test(needs = [GLSLANG])]
fn pipelines_are_robust() {
    use vk::PipelineRobustnessBufferBehaviorEXT as Behavior;
    let mut features = vk::PhysicalDevicePipelineRobustnessFeaturesEXT::default().pipeline_robustness(true);
    let gpu = Gpu::extended(&[ash::ext::pipeline_robustness::NAME], &mut features).expect("a device");
    let device = gpu.device();
    let words = compile(
        Stage::Compute,
        "layout(local_size_x = 8) in;
         layout(binding = 0) buffer Input { uint inputs[]; };
         layout(binding = 1) buffer Output { uint outputs[]; };
         void main() { outputs[gl_LocalInvocationIndex] = 1u + inputs[gl_LocalInvocationIndex]; }",
    );
    let (input, output) = (Buffer::of(&gpu, &[10u32; 4]), Buffer::new(&gpu, 32));
    let bindings = Bindings::new(&gpu, &[Resource::Storage(input.raw), Resource::Storage(output.raw)]);
    for behavior in [Behavior::DEVICE_DEFAULT, Behavior::ROBUST_BUFFER_ACCESS, Behavior::ROBUST_BUFFER_ACCESS_2] {
        let mut robustness = vk::PipelineRobustnessCreateInfoEXT::default().storage_buffers(behavior);
        let layouts = [bindings.layout];
        // SAFETY: see the crate.
        unsafe {
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
            let layout = device.create_pipeline_layout(&info, None).expect("a layout");
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            let module = device.create_shader_module(&info, None).expect("a module");
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main");
            let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout).push_next(&mut robustness);
            let pipeline = device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            let pipeline = pipeline.expect("a pipeline")[0];
            gpu.run(|commands| {
                let (_, raw) = commands.raw();
                device.cmd_bind_pipeline(raw, vk::PipelineBindPoint::COMPUTE, pipeline);
                device.cmd_bind_descriptor_sets(raw, vk::PipelineBindPoint::COMPUTE, layout, 0, &[bindings.set], &[]);
                device.cmd_dispatch(raw, 1, 1, 1);
                commands.barrier();
            });
            device.destroy_pipeline(pipeline, None);
            device.destroy_shader_module(module, None);
            device.destroy_pipeline_layout(layout, None);
        }
        assert_eq!(output.values::<u32>(), [11, 11, 11, 11, 1, 1, 1, 1], "{behavior:?}");
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
}

/// A pipeline without access to protected memory draws as any.
#[gaurast_runner::test(needs = [GLSLANG])]
fn pipelines_need_no_protected_memory() {
    let mut features = vk::PhysicalDevicePipelineProtectedAccessFeaturesEXT::default().pipeline_protected_access(true);
    let gpu = Gpu::extended(&[ash::ext::pipeline_protected_access::NAME], &mut features).expect("a device");
    let target = Target::floats(&gpu, [8; 2]);
    let flags = vk::PipelineCreateFlags::NO_PROTECTED_ACCESS_EXT;
    let pipeline = Pipeline::new(&gpu, &target, &PipelineOptions { flags, ..PipelineOptions::default() });
    let vertices = Buffer::of(&gpu, &shapes::whole(0.5, [0.25, 0.5, 0.75, 1.0]));
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..vertices.values::<Vertex>().len() as u32);
        });
    });
    assert!(target.read::<[f32; 4]>().iter().all(|pixel| *pixel == [0.25, 0.5, 0.75, 1.0]));
    assert_eq!(gpu.message_texts(), [""; 0]);
}
