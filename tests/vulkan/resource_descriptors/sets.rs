//! Descriptor sets: pools and their limits, all forms of updates, and invalid uses that are refused.

use ash::vk;
use gaurast_testkit::descriptors::{set_layout, write};
use gaurast_testkit::devices::open;
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Binding, Buffer, Compute, Kernel, Sets, whole};

const STORAGE: vk::DescriptorType = vk::DescriptorType::STORAGE_BUFFER;
const UNIFORM: vk::DescriptorType = vk::DescriptorType::UNIFORM_BUFFER;
const NO_FLAGS: vk::DescriptorSetLayoutCreateFlags = vk::DescriptorSetLayoutCreateFlags::empty();

#[gaurast_runner::test]
fn pools_give_what_they_have() {
    let gpu = open();
    let one = set_layout(&gpu, &[(0, STORAGE, 1)], NO_FLAGS);
    let many = set_layout(&gpu, &[(0, STORAGE, 2), (5, UNIFORM, 3)], NO_FLAGS);
    let size = |ty, count| vk::DescriptorPoolSize::default().ty(ty).descriptor_count(count);
    let sizes = [size(STORAGE, 2), size(UNIFORM, 3), size(STORAGE, 2)];
    let info = vk::DescriptorPoolCreateInfo::default()
        .flags(vk::DescriptorPoolCreateFlags::FREE_DESCRIPTOR_SET)
        .max_sets(3)
        .pool_sizes(&sizes);
    // SAFETY: see the crate.
    unsafe {
        let pool = gpu.device().create_descriptor_pool(&info, None).unwrap();
        let allocate = |layouts: &[vk::DescriptorSetLayout]| {
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(layouts);
            gpu.device().allocate_descriptor_sets(&info)
        };
        let exhausted = Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY);
        assert_eq!(allocate(&[one, one, one, one]), exhausted, "sets");
        assert_eq!(allocate(&[many, many]), exhausted, "descriptors");
        let first = allocate(&[many]).unwrap();
        let second = allocate(&[one, one]).unwrap();
        assert_eq!(allocate(&[one]), exhausted, "all sets are given");
        gpu.device().free_descriptor_sets(pool, &second[..1]).unwrap();
        assert_eq!(allocate(&[many]), exhausted, "descriptors, one set freed");
        let third = allocate(&[one]).unwrap();
        let all = [first[0], second[1], third[0], vk::DescriptorSet::null()];
        gpu.device().free_descriptor_sets(pool, &all).unwrap();
        allocate(&[many, one, one]).unwrap();
        let flags = vk::DescriptorPoolResetFlags::empty();
        gpu.device().reset_descriptor_pool(pool, flags).unwrap();
        allocate(&[many, one, one]).unwrap();
        gpu.device().destroy_descriptor_pool(pool, None);
        gpu.device().destroy_descriptor_set_layout(one, None);
        gpu.device().destroy_descriptor_set_layout(many, None);
    }
}

/// GStreamer's filters make a pool of combined image samplers alone, and allocate uniform buffers of it too.
#[gaurast_runner::test]
fn pools_give_descriptors_of_other_types() {
    let gpu = open();
    let both = set_layout(&gpu, &[(0, UNIFORM, 1), (1, STORAGE, 1)], NO_FLAGS);
    let sizes = [vk::DescriptorPoolSize::default().ty(STORAGE).descriptor_count(3)];
    let info = vk::DescriptorPoolCreateInfo::default().max_sets(3).pool_sizes(&sizes);
    // SAFETY: see the crate.
    unsafe {
        let pool = gpu.device().create_descriptor_pool(&info, None).unwrap();
        let layouts = [both];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        gpu.device().allocate_descriptor_sets(&info).unwrap();
        assert_eq!(
            gpu.device().allocate_descriptor_sets(&info),
            Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY),
            "four descriptors of a pool of three"
        );
        gpu.device().destroy_descriptor_pool(pool, None);
        gpu.device().destroy_descriptor_set_layout(both, None);
    }
}

#[gaurast_runner::test]
fn descriptors_are_copied_between_sets() {
    let gpu = open();
    let bindings: &[_] = &[(0, STORAGE, 1), (1, STORAGE, 1)];
    let kernel = Compute::new(&gpu, &spirv("push_constants.comp"), &[bindings]);
    let source = Buffer::of(&gpu, &(0..64u32).collect::<Vec<_>>());
    let target = Buffer::of(&gpu, &[0u32; 64]);
    let templates = set_layout(&gpu, &[(0, STORAGE, 4)], NO_FLAGS);
    let sizes = [vk::DescriptorPoolSize::default().ty(STORAGE).descriptor_count(4)];
    let pool_info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
    // SAFETY: see the crate.
    unsafe {
        let pool = gpu.device().create_descriptor_pool(&pool_info, None).unwrap();
        let layouts = [templates];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        let from = gpu.device().allocate_descriptor_sets(&info).unwrap()[0];
        write(&gpu, from, (0, 1), STORAGE, &[whole(&source), whole(&target)]);
        let set = kernel.sets.allocate()[0];
        // Both bindings in one copy: it continues from one binding into the next.
        let copies =
            [vk::CopyDescriptorSet::default().src_set(from).src_array_element(1).dst_set(set).descriptor_count(2)];
        gpu.device().update_descriptor_sets(&[], &copies);
        gpu.device().destroy_descriptor_pool(pool, None);
        gpu.device().destroy_descriptor_set_layout(templates, None);
        kernel.run(&[set], &[2, 1], [1, 1, 1]);
    }
    assert!(target.values::<u32>().into_iter().eq((0..64).map(|i| 2 * i + 1)));
}

/// The application's own structure that an update template reads.
#[repr(C)]
struct Resources {
    padding: u64,
    target: vk::DescriptorBufferInfo,
    source: vk::DescriptorBufferInfo,
}

fn template_entries() -> [vk::DescriptorUpdateTemplateEntry; 2] {
    let entry = |binding, offset| {
        vk::DescriptorUpdateTemplateEntry::default()
            .dst_binding(binding)
            .descriptor_count(1)
            .descriptor_type(STORAGE)
            .offset(offset)
    };
    [entry(0, std::mem::offset_of!(Resources, source)), entry(1, std::mem::offset_of!(Resources, target))]
}

#[gaurast_runner::test]
fn templates_update_sets() {
    let gpu = open();
    let bindings: &[_] = &[(0, STORAGE, 1), (1, STORAGE, 1)];
    let kernel = Compute::new(&gpu, &spirv("push_constants.comp"), &[bindings]);
    let source = Buffer::of(&gpu, &(0..64u32).collect::<Vec<_>>());
    let target = Buffer::new(&gpu, 256);
    let entries = template_entries();
    let info = vk::DescriptorUpdateTemplateCreateInfo::default()
        .descriptor_update_entries(&entries)
        .template_type(vk::DescriptorUpdateTemplateType::DESCRIPTOR_SET)
        .descriptor_set_layout(kernel.sets.layouts[0]);
    let resources = Resources { padding: 0, target: whole(&target), source: whole(&source) };
    let set = kernel.sets.allocate()[0];
    // SAFETY: see the crate; the data is what the template describes.
    unsafe {
        let template = gpu.device().create_descriptor_update_template(&info, None).unwrap();
        let data = (&raw const resources).cast();
        gpu.device().update_descriptor_set_with_template(set, template, data);
        gpu.device().destroy_descriptor_update_template(template, None);
    }
    kernel.run(&[set], &[5, 0], [1, 1, 1]);
    assert!(target.values::<u32>().into_iter().eq((0..64).map(|i| 5 * i)));
}

#[gaurast_runner::test]
fn descriptors_are_pushed() {
    let gpu = open();
    let bindings: &[_] = &[(0, STORAGE, 1), (1, STORAGE, 1)];
    let flags = vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR;
    let layouts = vec![set_layout(&gpu, bindings, flags)];
    let words = spirv("push_constants.comp");
    let none = vk::SpecializationInfo::default();
    let kernel = Compute::over(&gpu, &words, Sets::of(&gpu, layouts, &[bindings]), &none);
    let push = ash::khr::push_descriptor::Device::new(gpu.instance(), gpu.device());
    let source = Buffer::of(&gpu, &(0..64u32).collect::<Vec<_>>());
    let targets = [Buffer::new(&gpu, 256), Buffer::new(&gpu, 256), Buffer::new(&gpu, 256)];
    let bind_point = vk::PipelineBindPoint::COMPUTE;
    let entries = template_entries();
    let info = vk::DescriptorUpdateTemplateCreateInfo::default()
        .descriptor_update_entries(&entries)
        .template_type(vk::DescriptorUpdateTemplateType::PUSH_DESCRIPTORS_KHR)
        .pipeline_bind_point(bind_point)
        .pipeline_layout(kernel.layout);
    let resources = Resources { padding: 0, target: whole(&targets[2]), source: whole(&source) };
    // SAFETY: see the crate; the data is what the template describes.
    unsafe {
        let template = gpu.device().create_descriptor_update_template(&info, None).unwrap();
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            let write = |binding, infos| {
                vk::WriteDescriptorSet::default().dst_binding(binding).descriptor_type(STORAGE).buffer_info(infos)
            };
            kernel.bind(commands, &[]);
            let infos = [whole(&source), whole(&targets[0]), whole(&targets[1])].map(|info| [info]);
            let both = [write(0, &infos[0]), write(1, &infos[1])];
            kernel.push(commands, &[1, 1]);
            push.cmd_push_descriptor_set(commands, bind_point, kernel.layout, 0, &both);
            device.cmd_dispatch(commands, 1, 1, 1);
            // Descriptors that are not pushed again keep their values.
            kernel.push(commands, &[1, 2]);
            let other = [write(1, &infos[2])];
            push.cmd_push_descriptor_set(commands, bind_point, kernel.layout, 0, &other);
            device.cmd_dispatch(commands, 1, 1, 1);
            kernel.push(commands, &[1, 3]);
            let data = (&raw const resources).cast();
            push.cmd_push_descriptor_set_with_template(commands, template, kernel.layout, 0, data);
            device.cmd_dispatch(commands, 1, 1, 1);
        });
        gpu.device().destroy_descriptor_update_template(template, None);
    }
    for (addend, target) in (1..).zip(targets) {
        assert!(target.values::<u32>().into_iter().eq(addend..64 + addend));
    }
}

#[gaurast_runner::test]
fn sets_are_read_when_commands_execute() {
    let gpu = open();
    let bindings: &[_] = &[(0, STORAGE, 1), (1, STORAGE, 1)];
    let kernel = Compute::new(&gpu, &spirv("push_constants.comp"), &[bindings]);
    let buffers = [Buffer::of(&gpu, &[1u32; 64]), Buffer::new(&gpu, 256)];
    // A dispatch without sets does nothing and gives a message.
    kernel.run(&[], &[1, 1], [1, 1, 1]);
    let messages = gpu.message_texts();
    let told = |message: &String| message.contains("set 0") && message.contains("not bound");
    assert!(messages.iter().any(told), "{messages:?}");
    // A set without descriptors reads zero, and writes to it have no effect.
    let set = kernel.sets.allocate()[0];
    kernel.run(&[set], &[1, 1], [1, 1, 1]);
    write(&gpu, set, (1, 0), STORAGE, &[whole(&buffers[1])]);
    kernel.run(&[set], &[1, 7], [1, 1, 1]);
    assert_eq!(buffers[1].values::<u32>(), [7; 64]);
}

/// Breaks VUID-VkWriteDescriptorSet-dstBinding-00315, VUID-VkWriteDescriptorSet-dstArrayElement-00321 and
/// VUID-VkWriteDescriptorSet-descriptorType-00319.
#[gaurast_runner::test]
fn updates_that_do_not_fit_change_nothing() {
    let gpu = open();
    let bindings: &[_] = &[(0, STORAGE, 1), (1, STORAGE, 1)];
    let kernel = Compute::new(&gpu, &spirv("push_constants.comp"), &[bindings]);
    let buffer = Buffer::new(&gpu, 256);
    let set = kernel.sets.allocate()[0];
    let refused = |place, ty, count| {
        write(&gpu, set, place, ty, &vec![whole(&buffer); count]);
        let messages = gpu.message_texts();
        assert!(!messages.is_empty(), "{place:?} {ty:?} {count}");
    };
    refused((2, 0), STORAGE, 1);
    refused((1, 1), STORAGE, 1);
    refused((0, u32::MAX), STORAGE, 1);
    refused((0, 0), STORAGE, 3);
    refused((0, 0), UNIFORM, 1);
}

#[gaurast_runner::test]
fn pipelines_that_do_not_fit_their_layout_are_refused() {
    let gpu = open();
    let words = spirv("descriptors.comp");
    let refused = |sets: &[&[Binding]], complaint: &str| {
        let layouts: Vec<_> = sets.iter().map(|set| set_layout(&gpu, set, NO_FLAGS)).collect();
        let none = vk::SpecializationInfo::default();
        assert!(Kernel::create(&gpu, &words, &layouts, &none).is_err());
        for layout in layouts {
            // SAFETY: see the crate.
            unsafe { gpu.device().destroy_descriptor_set_layout(layout, None) };
        }
        let messages = gpu.message_texts();
        assert!(messages.iter().any(|m| m.contains(complaint)), "{complaint}: {messages:?}");
    };
    refused(&[], "set 0, binding 0");
    refused(&[&[(0, STORAGE, 4)]], "set 1, binding");
    refused(&[&[(0, STORAGE, 3)], &[(0, UNIFORM, 2), (3, STORAGE, 1)]], "has 3 descriptors in the pipeline layout");
    refused(&[&[(0, STORAGE, 4)], &[(0, STORAGE, 2), (3, STORAGE, 1)]], "UniformBuffer");
}

#[gaurast_runner::test]
fn shaders_that_cannot_run_are_refused_with_the_instruction() {
    let gpu = open();
    let layouts = [set_layout(&gpu, &[(0, STORAGE, 1), (1, STORAGE, 1)], NO_FLAGS)];
    let refused = |words: &[u32], complaint: &str| {
        let none = vk::SpecializationInfo::default();
        let created = Kernel::create(&gpu, words, &layouts, &none);
        assert!(created.is_err(), "{complaint}");
        let messages = gpu.message_texts();
        assert!(messages.iter().any(|m| m.contains(complaint)), "{complaint}: {messages:?}");
    };
    let whole = spirv("push_constants.comp");
    refused(&whole[..4], "SPIR-V");
    refused(&whole[..whole.len() - 3], "SPIR-V");
    // The first OpIMul (132) gets an operand that does not exist, and then an opcode that does not exist.
    let multiply = whole.iter().position(|&word| word == 5 << 16 | 132).unwrap();
    let mut changed = whole.clone();
    changed[multiply + 4] = 12345;
    refused(&changed, "OpIMul");
    changed[multiply] = 5 << 16 | 60000;
    refused(&changed, "SPIR-V");
    // SAFETY: see the crate.
    unsafe {
        gpu.device().destroy_descriptor_set_layout(layouts[0], None);
    }
}
