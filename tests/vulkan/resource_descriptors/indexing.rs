//! Descriptor sets: arrays without a length, updates after binding, variable counts, inline uniform blocks.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::{Buffer, Gpu, Kernel};

const STORAGE: vk::DescriptorType = vk::DescriptorType::STORAGE_BUFFER;
const INLINE: vk::DescriptorType = vk::DescriptorType::INLINE_UNIFORM_BLOCK;

/// A set with its layout and pool. Its bindings are numbered from 0; each has a type, a count and flags.
struct Set {
    raw: vk::DescriptorSet,
    layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    gpu: Gpu,
}

type Row = (vk::DescriptorType, u32, vk::DescriptorBindingFlags);

impl Set {
    fn new(gpu: &Gpu, rows: &[Row], variable_count: Option<u32>) -> Self {
        let layout = layout(gpu, rows).expect("a layout");
        let sizes: Vec<_> =
            rows.iter().map(|&(ty, descriptor_count, _)| vk::DescriptorPoolSize { ty, descriptor_count }).collect();
        let mut blocks = vk::DescriptorPoolInlineUniformBlockCreateInfo::default().max_inline_uniform_block_bindings(4);
        let info = vk::DescriptorPoolCreateInfo::default()
            .flags(vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND)
            .max_sets(1)
            .pool_sizes(&sizes)
            .push_next(&mut blocks);
        let counts = [variable_count.unwrap_or(0)];
        let mut variable = vk::DescriptorSetVariableDescriptorCountAllocateInfo::default().descriptor_counts(&counts);
        let layouts = [layout];
        // SAFETY: the create infos are valid.
        unsafe {
            let pool = gpu.device().create_descriptor_pool(&info, None).expect("a pool");
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts)
                .push_next(&mut variable);
            let sets = gpu.device().allocate_descriptor_sets(&info);
            Self { raw: sets.expect("a set")[0], layout, pool, gpu: gpu.clone() }
        }
    }

    /// Writes a whole buffer to an element of a binding.
    fn write(&self, binding: u32, element: u32, buffer: &Buffer) {
        let info = [vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.raw)
            .dst_binding(binding)
            .dst_array_element(element)
            .descriptor_type(STORAGE)
            .buffer_info(&info);
        // SAFETY: the set and the buffer are alive.
        unsafe { self.gpu.device().update_descriptor_sets(&[write], &[]) };
    }

    /// Writes bytes of an inline uniform block.
    fn write_inline(&self, binding: u32, offset: u32, bytes: &[u8]) {
        let mut block = vk::WriteDescriptorSetInlineUniformBlock::default().data(bytes);
        let mut write = vk::WriteDescriptorSet::default()
            .dst_set(self.raw)
            .dst_binding(binding)
            .dst_array_element(offset)
            .descriptor_type(INLINE)
            .push_next(&mut block);
        write.descriptor_count = bytes.len() as u32;
        // SAFETY: the set is alive and has the bytes.
        unsafe { self.gpu.device().update_descriptor_sets(&[write], &[]) };
    }
}

impl Drop for Set {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: the device is idle.
        unsafe {
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.layout, None);
        }
    }
}

fn layout(gpu: &Gpu, rows: &[Row]) -> Result<vk::DescriptorSetLayout, vk::Result> {
    let bindings: Vec<_> = (0..)
        .zip(rows)
        .map(|(number, &(ty, count, _))| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(number)
                .descriptor_type(ty)
                .descriptor_count(count)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        })
        .collect();
    let flags: Vec<_> = rows.iter().map(|&(.., flags)| flags).collect();
    let mut flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
    let info = vk::DescriptorSetLayoutCreateInfo::default()
        .flags(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
        .bindings(&bindings)
        .push_next(&mut flags);
    // SAFETY: the create info is valid, except in tests of invalid ones.
    unsafe { gpu.device().create_descriptor_set_layout(&info, None) }
}

fn words(buffer: &Buffer) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(&buffer.read())
}

/// A set is bound, and is updated before the command buffer is submitted and between two submissions. Invocations of
/// one subgroup index an array without a length at different elements, some of which were never written.
#[gaurast_runner::test(needs = [GLSLANG])]
fn sets_are_updated_after_they_were_bound() {
    let gpu = own();
    let flags = vk::DescriptorBindingFlags::UPDATE_AFTER_BIND
        | vk::DescriptorBindingFlags::PARTIALLY_BOUND
        | vk::DescriptorBindingFlags::UPDATE_UNUSED_WHILE_PENDING;
    let count = 500_000;
    let last = flags | vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT;
    let rows = [(STORAGE, 1, vk::DescriptorBindingFlags::UPDATE_AFTER_BIND), (STORAGE, count, last)];
    let set = Set::new(gpu, &rows, Some(count));
    let kernel = Kernel::over(
        gpu,
        &compile(
            Stage::Compute,
            "#extension GL_EXT_nonuniform_qualifier : require
             layout(local_size_x = 16) in;
             layout(binding = 0) buffer Out { uint found[16]; };
             layout(binding = 1) buffer In { uint value; } inputs[];
             void main() {
                 uint index = gl_LocalInvocationIndex * 33333;
                 found[gl_LocalInvocationIndex] = inputs[nonuniformEXT(index)].value;
             }",
        ),
        &[set.layout],
    );
    let result = Buffer::new(gpu, 64);
    let inputs: Vec<_> = (0..16u32).map(|it| Buffer::of(gpu, &[100 + it; 4])).collect();
    let device = gpu.device();
    let recorded = gpu.record(|commands| {
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: all handles are alive.
        unsafe {
            device.cmd_bind_pipeline(commands.raw, point, kernel.raw);
            let sets = [set.raw];
            device.cmd_bind_descriptor_sets(commands.raw, point, kernel.layout, 0, &sets, &[]);
            device.cmd_dispatch(commands.raw, 1, 1, 1);
        }
        commands.barrier();
    });
    set.write(0, 0, &result);
    for (index, input) in (0..16).zip(&inputs).filter(|(index, _)| index % 3 != 2) {
        set.write(1, index * 33333, input);
    }
    recorded.submit();
    let expected = |swapped: bool| -> Vec<u32> {
        (0..16)
            .map(|index| match index {
                3 if swapped => 115,
                _ if index % 3 == 2 => 0,
                _ => 100 + index,
            })
            .collect()
    };
    assert_eq!(words(&result), expected(false));
    set.write(1, 3 * 33333, &inputs[15]);
    recorded.submit();
    assert_eq!(words(&result), expected(true));
}

/// A set may have fewer descriptors of its last binding than the layout says. It then has only these, and takes only
/// these from its pool.
#[gaurast_runner::test(needs = [GLSLANG])]
fn sets_choose_the_length_of_their_last_binding() {
    let gpu = own();
    let variable = vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT | vk::DescriptorBindingFlags::PARTIALLY_BOUND;
    let rows = [(STORAGE, 1, vk::DescriptorBindingFlags::empty()), (STORAGE, 64, variable)];
    let mut support = vk::DescriptorSetVariableDescriptorCountLayoutSupport::default();
    let bindings = [vk::DescriptorSetLayoutBinding::default().descriptor_type(STORAGE).descriptor_count(64)];
    let flags = [variable];
    let mut flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings).push_next(&mut flags);
    let mut answer = vk::DescriptorSetLayoutSupport::default().push_next(&mut support);
    // SAFETY: the create info is valid.
    unsafe {
        gpu.device().get_descriptor_set_layout_support(&info, &mut answer);
    }
    assert_eq!(answer.supported, vk::TRUE);
    // All that a set may have, whatever is asked for.
    let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut maintenance);
    // SAFETY: the physical device is the instance's.
    unsafe { gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut properties) };
    assert_eq!(support.max_variable_descriptor_count, maintenance.max_per_set_descriptors);

    let set = Set::new(gpu, &rows, Some(2));
    let (result, input) = (Buffer::new(gpu, 16), Buffer::of(gpu, &[7u32; 4]));
    set.write(0, 0, &result);
    set.write(1, 1, &input);
    // Beyond the set: nothing is written, and nothing else changes.
    set.write(1, 2, &input);
    let kernel = Kernel::over(
        gpu,
        &compile(
            Stage::Compute,
            "#extension GL_EXT_nonuniform_qualifier : require
             layout(local_size_x = 4) in;
             layout(binding = 0) buffer Out { uint found[4]; };
             layout(binding = 1) buffer In { uint value; } inputs[];
             void main() {
                 uint index = gl_LocalInvocationIndex;
                 found[index] = inputs[nonuniformEXT(index)].value;
             }",
        ),
        &[set.layout],
    );
    kernel.run(&[set.raw], &[], [1, 1, 1]);
    assert_eq!(words(&result), [0, 7, 0, 0]);
    // Only the last binding may have a variable count.
    let wrong = [(STORAGE, 4, variable), rows[0]];
    assert!(layout(gpu, &wrong).is_err());
}

/// Bytes are written to a block in parts, by a copy and by a template, also after the set was bound.
#[gaurast_runner::test(needs = [GLSLANG])]
fn inline_uniform_blocks_hold_bytes() {
    let gpu = own();
    let limits = {
        let mut limits = vk::PhysicalDeviceInlineUniformBlockProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
        // SAFETY: the physical device is the instance's.
        unsafe {
            gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut properties);
        }
        limits
    };
    let most = limits.max_inline_uniform_block_size;
    assert!(most >= 256);
    let after_bind = vk::DescriptorBindingFlags::UPDATE_AFTER_BIND;
    let rows =
        [(STORAGE, 1, vk::DescriptorBindingFlags::empty()), (INLINE, 32, after_bind), (INLINE, most, after_bind)];
    let (set, other) = (Set::new(gpu, &rows, None), Set::new(gpu, &rows, None));
    let result = Buffer::new(gpu, 40);
    set.write(0, 0, &result);
    let kernel = Kernel::over(
        gpu,
        &compile(
            Stage::Compute,
            &format!(
                "layout(local_size_x = 1) in;
                 layout(binding = 0) buffer Out {{ uint found[10]; }};
                 layout(binding = 1) uniform Small {{ uvec4 a; uvec4 b; }};
                 layout(binding = 2) uniform Large {{ uvec4 c[{}]; }};
                 void main() {{
                     for (int i = 0; i < 4; i++) {{ found[i] = a[i]; found[4 + i] = b[i]; }}
                     found[8] = c[0].x;
                     found[9] = c[{}].w;
                 }}",
                most / 16,
                most / 16 - 1
            ),
        ),
        &[set.layout],
    );
    let run = || {
        kernel.run(&[set.raw], &[], [1, 1, 1]);
        words(&result)
    };
    assert_eq!(run(), [0; 10]);
    let bytes = |words: &[u32]| bytemuck::cast_slice::<u32, u8>(words).to_vec();
    set.write_inline(1, 0, &bytes(&[1, 2, 3, 4, 5, 6, 7, 8]));
    set.write_inline(1, 8, &bytes(&[30]));
    set.write_inline(2, most - 4, &bytes(&[99]));
    assert_eq!(run(), [1, 2, 30, 4, 5, 6, 7, 8, 0, 99]);
    // Beyond the block: nothing is written.
    set.write_inline(1, 28, &bytes(&[77, 77]));
    assert_eq!(run()[7], 8);

    other.write_inline(2, 16, &bytes(&[50, 51]));
    let mut copy = vk::CopyDescriptorSet::default()
        .src_set(other.raw)
        .src_binding(2)
        .src_array_element(16)
        .dst_set(set.raw)
        .dst_binding(1)
        .dst_array_element(4);
    copy.descriptor_count = 8;
    let device = gpu.device();
    // SAFETY: both sets have the bytes.
    unsafe { device.update_descriptor_sets(&[], &[copy]) };
    assert_eq!(run(), [1, 50, 51, 4, 5, 6, 7, 8, 0, 99]);

    let entries = [vk::DescriptorUpdateTemplateEntry {
        dst_binding: 2,
        dst_array_element: 0,
        descriptor_count: 4,
        descriptor_type: INLINE,
        offset: 12,
        stride: 0,
    }];
    let info = vk::DescriptorUpdateTemplateCreateInfo::default()
        .descriptor_update_entries(&entries)
        .template_type(vk::DescriptorUpdateTemplateType::DESCRIPTOR_SET)
        .descriptor_set_layout(set.layout);
    let data = [0u32, 1, 2, 1234];
    // SAFETY: the template describes the data.
    unsafe {
        let template = device.create_descriptor_update_template(&info, None).expect("a template");
        device.update_descriptor_set_with_template(set.raw, template, data.as_ptr().cast());
        device.destroy_descriptor_update_template(template, None);
    }
    assert_eq!(run()[8], 1234);

    let too_long = [(INLINE, most + 4, vk::DescriptorBindingFlags::empty())];
    assert!(layout(gpu, &too_long).is_err());
    let odd = [(INLINE, 6, vk::DescriptorBindingFlags::empty())];
    assert!(layout(gpu, &odd).is_err());
}
