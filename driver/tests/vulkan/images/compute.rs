//! A compute pipeline with one descriptor set.

use super::device::{Buffer, Device, GENERAL};
use ash::vk;

/// A resource to bind.
#[derive(Clone, Copy)]
pub enum Bound {
    /// An image with a sampler.
    Sampled(vk::ImageView, vk::Sampler),
    /// A storage image.
    Stored(vk::ImageView),
    /// A uniform texel buffer.
    Texels(vk::BufferView),
    /// A storage texel buffer.
    StoredTexels(vk::BufferView),
    /// A storage buffer.
    Buffer(Buffer),
}

/// A pipeline whose bindings are numbered from 0 on, with two words of push constants.
pub struct Compute<'a> {
    gpu: &'a Device,
    types: Vec<vk::DescriptorType>,
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    descriptors: vk::DescriptorPool,
    set: vk::DescriptorSet,
}

impl<'a> Compute<'a> {
    /// A pipeline of SPIR-V.
    pub fn new(gpu: &'a Device, spirv: &[u8], types: &[vk::DescriptorType]) -> Self {
        let words = spirv.chunks_exact(4);
        let code: Vec<u32> = words.map(bytemuck::pod_read_unaligned).collect();
        let stage_flags = vk::ShaderStageFlags::COMPUTE;
        let bindings: Vec<_> = (0..)
            .zip(types)
            .map(|(number, &ty)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(number)
                    .descriptor_type(ty)
                    .descriptor_count(1)
                    .stage_flags(stage_flags)
            })
            .collect();
        let sizes = types.iter().map(|&ty| vk::DescriptorPoolSize {
            ty,
            descriptor_count: 1,
        });
        let sizes: Vec<_> = sizes.collect();
        let device = &gpu.device;
        // SAFETY: see the crate.
        unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layout = device.create_descriptor_set_layout(&info, None).unwrap();
            let ranges = [vk::PushConstantRange {
                stage_flags,
                offset: 0,
                size: 8,
            }];
            let layouts = [set_layout];
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&layouts)
                .push_constant_ranges(&ranges);
            let layout = device.create_pipeline_layout(&info, None).unwrap();
            let info = vk::ShaderModuleCreateInfo::default().code(&code);
            let module = device.create_shader_module(&info, None).unwrap();
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(stage_flags)
                .module(module)
                .name(c"main");
            let info = [vk::ComputePipelineCreateInfo::default()
                .stage(stage)
                .layout(layout)];
            let cache = vk::PipelineCache::null();
            let pipeline = device.create_compute_pipelines(cache, &info, None).unwrap()[0];
            device.destroy_shader_module(module, None);
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(1)
                .pool_sizes(&sizes);
            let descriptors = device.create_descriptor_pool(&info, None).unwrap();
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(descriptors)
                .set_layouts(&layouts);
            let set = device.allocate_descriptor_sets(&info).unwrap()[0];
            Self {
                gpu,
                types: types.to_vec(),
                set_layout,
                layout,
                pipeline,
                descriptors,
                set,
            }
        }
    }

    /// Binds one descriptor.
    fn bind(&self, number: u32, bound: Bound) {
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(number)
            .descriptor_type(self.types[number as usize]);
        let image = |image_view, sampler| {
            [vk::DescriptorImageInfo {
                sampler,
                image_view,
                image_layout: GENERAL,
            }]
        };
        // SAFETY: see the crate.
        let update = |write| unsafe { self.gpu.device.update_descriptor_sets(&[write], &[]) };
        match bound {
            Bound::Sampled(view, sampler) => update(write.image_info(&image(view, sampler))),
            Bound::Stored(view) => update(write.image_info(&image(view, vk::Sampler::null()))),
            Bound::Texels(view) | Bound::StoredTexels(view) => {
                update(write.texel_buffer_view(&[view]));
            }
            Bound::Buffer(buffer) => update(write.buffer_info(&[vk::DescriptorBufferInfo {
                buffer: buffer.buffer,
                offset: 0,
                range: vk::WHOLE_SIZE,
            }])),
        }
    }

    /// Runs workgroups.
    pub fn run(&self, bound: &[Bound], constants: [u32; 2], workgroups: u32) {
        for (number, &bound) in (0..).zip(bound) {
            self.bind(number, bound);
        }
        self.gpu.run(|device, commands| {
            let (compute, layout) = (vk::PipelineBindPoint::COMPUTE, self.layout);
            let (stage, bytes) = (
                vk::ShaderStageFlags::COMPUTE,
                bytemuck::bytes_of(&constants),
            );
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, compute, self.pipeline);
                device.cmd_bind_descriptor_sets(commands, compute, layout, 0, &[self.set], &[]);
                device.cmd_push_constants(commands, layout, stage, 0, bytes);
                device.cmd_dispatch(commands, workgroups, 1, 1);
            }
        });
    }
}

impl Drop for Compute<'_> {
    fn drop(&mut self) {
        let device = &self.gpu.device;
        // SAFETY: see the crate.
        unsafe {
            device.destroy_descriptor_pool(self.descriptors, None);
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
