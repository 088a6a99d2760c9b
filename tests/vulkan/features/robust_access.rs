//! Robust access: reads and writes beyond resources, and through null descriptors.

use ash::vk;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::{Buffer, Gpu, Kernel};

fn robust() -> Gpu {
    let mut features = vk::PhysicalDeviceRobustness2FeaturesEXT::default()
        .robust_buffer_access2(true)
        .robust_image_access2(true)
        .null_descriptor(true);
    Gpu::extended(&[ash::ext::robustness2::NAME], &mut features).expect("a device")
}

/// A set of one binding for each descriptor type. All are null except the first, which is a whole storage buffer.
fn set(
    gpu: &Gpu,
    kinds: &[vk::DescriptorType],
    first: vk::DescriptorBufferInfo,
) -> (vk::DescriptorSet, vk::DescriptorSetLayout, vk::DescriptorPool) {
    let bindings: Vec<_> = (0..)
        .zip(kinds)
        .map(|(binding, &kind)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        })
        .collect();
    let sizes: Vec<_> = kinds.iter().map(|&ty| vk::DescriptorPoolSize { ty, descriptor_count: 1 }).collect();
    let device = gpu.device();
    // SAFETY: the create infos are valid, and null descriptors are enabled.
    unsafe {
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let layout = device.create_descriptor_set_layout(&info, None).expect("a layout");
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        let pool = device.create_descriptor_pool(&info, None).expect("a pool");
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        let set = device.allocate_descriptor_sets(&info).expect("a set")[0];
        for (binding, &kind) in (0..).zip(kinds) {
            let buffer = [match binding {
                0 => first,
                _ => vk::DescriptorBufferInfo::default().range(vk::WHOLE_SIZE),
            }];
            let sampler = vk::Sampler::null();
            let image = [vk::DescriptorImageInfo::default().sampler(sampler)];
            let texels = [vk::BufferView::null()];
            let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(binding).descriptor_type(kind);
            let write = match kind {
                vk::DescriptorType::UNIFORM_BUFFER | vk::DescriptorType::STORAGE_BUFFER => write.buffer_info(&buffer),
                vk::DescriptorType::UNIFORM_TEXEL_BUFFER => write.texel_buffer_view(&texels),
                _ => write.image_info(&image),
            };
            device.update_descriptor_sets(&[write], &[]);
        }
        (set, layout, pool)
    }
}

fn free(gpu: &Gpu, (_, layout, pool): (vk::DescriptorSet, vk::DescriptorSetLayout, vk::DescriptorPool)) {
    // SAFETY: the device is idle.
    unsafe {
        gpu.device().destroy_descriptor_pool(pool, None);
        gpu.device().destroy_descriptor_set_layout(layout, None);
    }
}

fn words(buffer: &Buffer) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(&buffer.read())
}

/// Null descriptors read zero and have no size, and writes to them have no effect.
#[gaurast_runner::test(needs = [GLSLANG])]
fn null_descriptors_read_zero() {
    use vk::DescriptorType as Kind;
    let gpu = robust();
    let result = Buffer::of(&gpu, &[!0u32; 8]);
    let kinds = [
        Kind::STORAGE_BUFFER,
        Kind::UNIFORM_BUFFER,
        Kind::STORAGE_BUFFER,
        Kind::SAMPLED_IMAGE,
        Kind::STORAGE_IMAGE,
        Kind::UNIFORM_TEXEL_BUFFER,
    ];
    let first = vk::DescriptorBufferInfo::default().buffer(result.raw).range(vk::WHOLE_SIZE);
    let set = set(&gpu, &kinds, first);
    let words_of = compile(
        Stage::Compute,
        "#extension GL_EXT_samplerless_texture_functions : require
         layout(local_size_x = 1) in;
         layout(binding = 0) buffer Out { uint found[8]; };
         layout(binding = 1) uniform U { uint uniform_value; };
         layout(binding = 2) buffer S { uint storage_values[]; };
         layout(binding = 3) uniform utexture2D image;
         layout(binding = 4, r32ui) uniform uimage2D stored;
         layout(binding = 5) uniform utextureBuffer texels;
         void main() {
             found[0] = uniform_value;
             storage_values[3] = 7;
             found[1] = storage_values[3];
             found[2] = uint(storage_values.length());
             found[3] = texelFetch(image, ivec2(0), 0).x;
             imageStore(stored, ivec2(0), uvec4(9));
             found[4] = imageLoad(stored, ivec2(0)).x;
             found[5] = texelFetch(texels, 0).x;
             found[6] = uint(textureSize(image, 0).x + imageSize(stored).x + textureSize(texels));
         }",
    );
    let kernel = Kernel::over(&gpu, &words_of, &[set.1]);
    kernel.run(&[set.0], &[], [1, 1, 1]);
    assert_eq!(words(&result), [0, 0, 0, 0, 0, 0, 0, !0]);
    drop(kernel);
    free(&gpu, set);
}

/// Beyond a descriptor's range, but within its buffer, reads of scalars give zero and writes have no effect. A vector
/// that crosses the end has the part before the end.
#[gaurast_runner::test(needs = [GLSLANG])]
fn ranges_end_where_they_say() {
    let gpu = robust();
    let mut robustness = vk::PhysicalDeviceRobustness2PropertiesEXT::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut robustness);
    // SAFETY: the physical device is the instance's.
    unsafe {
        gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut properties);
    }
    let storage = robustness.robust_storage_buffer_access_size_alignment;
    assert!(storage == 1 || storage == 4, "{storage}");
    let uniform = robustness.robust_uniform_buffer_access_size_alignment;
    assert!(uniform.is_power_of_two() && uniform <= 256, "{uniform}");
    let buffer = Buffer::of(&gpu, &(1..=64u32).collect::<Vec<_>>());
    let info = vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(4 * 40);
    let set = set(&gpu, &[vk::DescriptorType::STORAGE_BUFFER], info);
    let words_of = compile(
        Stage::Compute,
        "layout(local_size_x = 1) in;
         layout(binding = 0) buffer B { uint values[]; };
         void main() {
             values[0] = uint(values.length());
             values[1] = values[39];
             values[2] = values[40];
             values[3] = values[1000000000];
             values[41] = 77;
             values[2000000000] = 77;
             values[4] = atomicAdd(values[50], 5);
         }",
    );
    let kernel = Kernel::over(&gpu, &words_of, &[set.1]);
    kernel.run(&[set.0], &[], [1, 1, 1]);
    let found = words(&buffer);
    assert_eq!(found[..5], [40, 40, 0, 0, 0]);
    assert_eq!(found[40..], (41..=64).collect::<Vec<u32>>());
    drop(kernel);
    free(&gpu, set);
}
