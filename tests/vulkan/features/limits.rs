//! Tests that use limits that programs ask for, up to their values.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Bindings, Buffer, Image, ImageOptions, Kernel, Pass, Pipeline, PipelineOptions, Resource, Sampler, Target,
    TargetOptions,
};

/// The words that a kernel writes to its binding 0, a buffer of this size.
fn words(buffer: &Buffer) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(&buffer.read())
}

/// 32 vectors of four components, all different, go from the vertices to the fragments.
#[gaurast_runner::test(needs = [GLSLANG])]
fn varyings_of_128_components_arrive() {
    let gpu = own();
    let limits = gpu.limits();
    assert_eq!((limits.max_vertex_output_components, limits.max_fragment_input_components), (128, 128));
    let declare = |direction: &str| -> String {
        (0..32).map(|location| format!("layout(location = {location}) {direction} vec4 v{location};\n")).collect()
    };
    let write: String = (0..32)
        .map(|location| {
            let first = 4 * location;
            let values = format!("{first}, {}, {}, {}", first + 1, first + 2, first + 3);
            format!("v{location} = vec4({values}) * position.w;\n")
        })
        .collect();
    let read: String = (0..32)
        .map(|location| {
            let first = 4 * location;
            let wanted = format!("vec4({first}, {}, {}, {})", first + 1, first + 2, first + 3);
            format!("if (all(lessThan(abs(v{location} - {wanted}), vec4(0.01)))) right += 1.0;\n")
        })
        .collect();
    let vertex = format!(
        "layout(location = 0) in vec4 position;
         {}
         void main() {{ gl_Position = position; {write} }}",
        declare("out")
    );
    let fragment = format!(
        "{}
         layout(location = 0) out vec4 color;
         void main() {{ float right = 0.0; {read} color = vec4(right); }}",
        declare("in")
    );
    let target = Target::new(gpu, &TargetOptions::of(vk::Format::R32_SFLOAT));
    let options = PipelineOptions { vertex: &vertex, fragment: Some(&fragment), ..PipelineOptions::default() };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &shapes::whole(0.5, [1.0; 4]));
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..6);
        });
    });
    let found: Vec<f32> = bytemuck::pod_collect_to_vec(&target.colors[0].read(vk::ImageAspectFlags::COLOR, 4));
    assert!(found.iter().all(|right| *right == 32.0), "{:?}", found[0]);
}

/// Dispatches of the greatest number of workgroups run in each dimension.
#[gaurast_runner::test(needs = [GLSLANG])]
fn dispatches_of_65535_workgroups_run() {
    let gpu = own();
    assert_eq!(gpu.limits().max_compute_work_group_count, [65535; 3]);
    let buffer = Buffer::new(gpu, 16);
    let bindings = Bindings::new(gpu, &[Resource::Storage(buffer.raw)]);
    let kernel = Kernel::new(
        gpu,
        "layout(local_size_x = 1) in;
         layout(binding = 0) buffer B { uint count; uint last; };
         void main() {
             uvec3 id = gl_WorkGroupID;
             atomicAdd(count, 1);
             atomicMax(last, id.x + id.y + id.z);
         }",
        &bindings,
    );
    for groups in [[65535, 1, 1], [1, 65535, 1], [1, 1, 65535]] {
        kernel.run(&[bindings.set], &[], groups);
    }
    assert_eq!(words(&buffer)[..2], [3 * 65535, 65534]);
}

/// The last texel of the largest texel buffer is read, and the one beyond is not.
#[gaurast_runner::test(needs = [GLSLANG])]
fn texel_buffers_have_two_to_the_27_texels() {
    let gpu = own();
    let count = 1u32 << 27;
    assert_eq!(gpu.limits().max_texel_buffer_elements, count);
    let texels = Buffer::new(gpu, u64::from(count) + 16);
    let device = gpu.device();
    let view = |range: u64| {
        let info = vk::BufferViewCreateInfo::default().buffer(texels.raw).format(vk::Format::R8_UINT).range(range);
        // SAFETY: the buffer is alive, and the device refuses a wrong create info.
        unsafe { device.create_buffer_view(&info, None) }
    };
    assert!(view(u64::from(count) + 1).is_err());
    let view = view(count.into()).expect("a buffer view");
    gpu.run(|commands| {
        // SAFETY: the buffer has these bytes.
        unsafe { device.cmd_fill_buffer(commands.raw, texels.raw, u64::from(count) - 4, 8, !0) };
    });
    let result = Buffer::new(gpu, 16);
    let resources = [Resource::Storage(result.raw), Resource::Texels(view)];
    let bindings = Bindings::new(gpu, &resources);
    let kernel = Kernel::new(
        gpu,
        "layout(local_size_x = 1) in;
         layout(binding = 0) buffer B { uint found[4]; };
         layout(binding = 1) uniform usamplerBuffer texels;
         void main() {
             int size = textureSize(texels);
             found[0] = uint(size);
             found[1] = texelFetch(texels, size - 1).x;
             found[2] = texelFetch(texels, size - 5).x;
             found[3] = texelFetch(texels, size).x;
         }",
        &bindings,
    );
    kernel.run(&[bindings.set], &[], [1, 1, 1]);
    assert_eq!(words(&result), [count, 255, 0, 0]);
    // SAFETY: nothing uses it any more.
    unsafe { device.destroy_buffer_view(view, None) };
}

/// Texel offsets at both ends of the range shift samples, fetches and gathers by this number of texels.
#[gaurast_runner::test(needs = [GLSLANG])]
fn texel_offsets_reach_from_minus_32_to_31() {
    let gpu = own();
    let limits = gpu.limits();
    assert_eq!((limits.min_texel_offset, limits.max_texel_offset), (-32, 31));
    assert_eq!((limits.min_texel_gather_offset, limits.max_texel_gather_offset), (-32, 31));
    let side = 128u32;
    let texels: Vec<f32> = (0..side * side).map(|texel| texel as f32).collect();
    let usage = vk::ImageUsageFlags::SAMPLED;
    let options = ImageOptions::new(vk::Format::R32_SFLOAT, [side; 2], usage);
    let image = Image::textured(gpu, &options, &[texels]);
    let sampler = Sampler::new(gpu, &vk::SamplerCreateInfo::default());
    let result = Buffer::new(gpu, 24);
    let resources = [Resource::Storage(result.raw), Resource::Texture(image.view, sampler.raw)];
    let bindings = Bindings::new(gpu, &resources);
    // The compiler accepts only constant offsets in Vulkan's minimum range, so the words are patched.
    let words: Vec<u32> = compile(
        Stage::Compute,
        "layout(local_size_x = 1) in;
         layout(binding = 0) buffer B { float found[6]; };
         layout(binding = 1) uniform sampler2D image;
         void main() {
             vec2 at = vec2(64.5) / 128.0;
             found[0] = textureLodOffset(image, at, 0.0, ivec2(-8, -5)).x;
             found[1] = textureLodOffset(image, at, 0.0, ivec2(-5, -8)).x;
             found[2] = texelFetchOffset(image, ivec2(64), 0, ivec2(-8, -5)).x;
             found[3] = texelFetchOffset(image, ivec2(64), 0, ivec2(-5, -8)).x;
             vec2 corner = vec2(64.0) / 128.0;
             found[4] = textureGatherOffset(image, corner, ivec2(-8, -5)).w;
             found[5] = textureGatherOffset(image, corner, ivec2(-5, -8)).y;
         }",
    )
    .into_iter()
    .map(|word| match word.cast_signed() {
        -8 => (-32i32).cast_unsigned(),
        -5 => 31,
        _ => word,
    })
    .collect();
    let kernel = Kernel::over(gpu, &words, &[bindings.layout]);
    kernel.run(&[bindings.set], &[], [1, 1, 1]);
    let found: Vec<f32> = bytemuck::pod_collect_to_vec(&result.read());
    let at = |x: u32, y: u32| (y * side + x) as f32;
    assert_eq!(found, [at(32, 95), at(95, 32), at(32, 95), at(95, 32), at(31, 94), at(95, 32)]);
}

/// An image with the greatest length in each of its three dimensions is sampled at its far end.
#[gaurast_runner::test(needs = [GLSLANG])]
fn volumes_are_4096_texels_long() {
    let gpu = own();
    let side = gpu.limits().max_image_dimension3_d;
    assert_eq!(side, 4096);
    let sampler = Sampler::new(gpu, &vk::SamplerCreateInfo::default());
    for direction in 0..3 {
        let mut size = [1; 3];
        size[direction] = side;
        let options = ImageOptions {
            size,
            view: vk::ImageViewType::TYPE_3D,
            ..ImageOptions::new(vk::Format::R32_UINT, [1, 1], vk::ImageUsageFlags::SAMPLED)
        };
        let image = Image::textured(gpu, &options, &[(0..side).collect()]);
        let result = Buffer::new(gpu, 8);
        let resources = [Resource::Storage(result.raw), Resource::Texture(image.view, sampler.raw)];
        let bindings = Bindings::new(gpu, &resources);
        let kernel = Kernel::new(
            gpu,
            "layout(local_size_x = 1) in;
             layout(binding = 0) buffer B { uint found[2]; };
             layout(binding = 1) uniform usampler3D image;
             void main() {
                 ivec3 size = textureSize(image, 0);
                 found[0] = uint(size.x * size.y * size.z);
                 found[1] = texelFetch(image, size - 1, 0).x;
             }",
            &bindings,
        );
        kernel.run(&[bindings.set], &[], [1, 1, 1]);
        assert_eq!(words(&result), [side, side - 1]);
    }
}

/// Formats of three components of 8 or 16 bits can be sampled but cannot be input attachments, which need a format that can be rendered
/// to.
#[gaurast_runner::test]
fn input_attachments_are_of_formats_that_are_rendered_to() {
    let gpu = own();
    let answer = |format, usage| {
        let (ty, tiling) = (vk::ImageType::TYPE_2D, vk::ImageTiling::OPTIMAL);
        let flags = vk::ImageCreateFlags::empty();
        // SAFETY: the physical device is the instance's.
        unsafe {
            gpu.instance().get_physical_device_image_format_properties(
                gpu.physical_device(),
                format,
                ty,
                tiling,
                usage,
                flags,
            )
        }
    };
    let (sampled, input) = (vk::ImageUsageFlags::SAMPLED, vk::ImageUsageFlags::INPUT_ATTACHMENT);
    for format in [vk::Format::R8G8B8_UNORM, vk::Format::R16G16B16_SFLOAT] {
        assert!(answer(format, sampled).is_ok(), "{format:?}");
        assert_eq!(answer(format, sampled | input).err(), Some(vk::Result::ERROR_FORMAT_NOT_SUPPORTED), "{format:?}");
    }
    assert!(answer(vk::Format::R8G8B8A8_UNORM, sampled | input).is_ok());
    assert!(answer(vk::Format::D32_SFLOAT, sampled | input).is_ok());
}

/// A Vulkan 1.0 device that enables push descriptors and update templates has every command of both. One that enables
/// push descriptors alone has the commands that push.
#[gaurast_runner::test]
fn commands_of_listed_extensions_are_found() {
    let entry = vulkan_gaurast::entry();
    let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
    let (push, template) = (ash::khr::push_descriptor::NAME, ash::khr::descriptor_update_template::NAME);
    // SAFETY: the create infos are valid, and nothing outlives the instance.
    unsafe {
        let instance = entry.create_instance(&vk::InstanceCreateInfo::default(), None).expect("an instance");
        let physical_device = instance.enumerate_physical_devices().expect("a device")[0];
        let listed = instance.enumerate_device_extension_properties(physical_device).expect("extensions");
        for name in [push, template] {
            let is_it = |it: &&vk::ExtensionProperties| it.extension_name_as_c_str() == Ok(name);
            assert_eq!(listed.iter().filter(is_it).count(), 1, "{name:?}");
        }
        let finds = |names: &[&std::ffi::CStr], commands: &[&std::ffi::CStr]| {
            let names: Vec<_> = names.iter().map(|name| name.as_ptr()).collect();
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names);
            let device = instance.create_device(physical_device, &info, None).expect("a device");
            for command in commands {
                let found = instance.get_device_proc_addr(device.handle(), command.as_ptr());
                assert!(found.is_some(), "{command:?}");
            }
            device.destroy_device(None);
        };
        let pushes = [c"vkCmdPushDescriptorSetKHR", c"vkCmdPushDescriptorSetWithTemplateKHR"];
        finds(&[push], &pushes);
        let all = [
            pushes[0],
            pushes[1],
            c"vkCreateDescriptorUpdateTemplateKHR",
            c"vkDestroyDescriptorUpdateTemplateKHR",
            c"vkUpdateDescriptorSetWithTemplateKHR",
        ];
        finds(&[push, template], &all);
        instance.destroy_instance(None);
    }
}
