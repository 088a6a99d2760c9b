//! A compute pipeline with what it takes to run it.

use crate::gpu::{Buffer, Gpu};
use ash::vk;

/// The SPIR-V of a shader beside these tests.
#[macro_export]
macro_rules! spirv {
    ($name:literal) => {
        $crate::kernel::words(include_bytes!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/spirv/tests/shaders/",
            $name,
            ".spv"
        )))
    };
}

/// Bytes as SPIR-V's words.
pub fn words(bytes: &[u8]) -> Vec<u32> {
    bytes
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
        .collect()
}

/// A binding: its number, what it holds and how many.
pub type Binding = (u32, vk::DescriptorType, u32);

/// A compute pipeline over descriptor sets of these bindings.
pub struct Kernel<'a> {
    pub gpu: &'a Gpu,
    pub set_layouts: Vec<vk::DescriptorSetLayout>,
    pub layout: vk::PipelineLayout,
    pub pipeline: vk::Pipeline,
    pub pool: vk::DescriptorPool,
}

/// A descriptor set layout of these bindings.
pub fn set_layout(
    gpu: &Gpu,
    bindings: &[Binding],
    flags: vk::DescriptorSetLayoutCreateFlags,
) -> vk::DescriptorSetLayout {
    let bindings: Vec<_> = bindings
        .iter()
        .map(|&(number, ty, count)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(number)
                .descriptor_type(ty)
                .descriptor_count(count)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        })
        .collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default()
        .flags(flags)
        .bindings(&bindings);
    // SAFETY: see the crate.
    unsafe {
        gpu.device
            .create_descriptor_set_layout(&info, None)
            .unwrap()
    }
}

/// A compute pipeline of SPIR-V, or why there is none.
pub fn pipeline(
    gpu: &Gpu,
    layout: vk::PipelineLayout,
    words: &[u32],
    specialization: &vk::SpecializationInfo<'_>,
) -> Result<vk::Pipeline, vk::Result> {
    // SAFETY: see the crate.
    unsafe {
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        let module = gpu.device.create_shader_module(&info, None)?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(specialization);
        let infos = [vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(layout)];
        let cache = vk::PipelineCache::null();
        let created = gpu.device.create_compute_pipelines(cache, &infos, None);
        gpu.device.destroy_shader_module(module, None);
        match created {
            Ok(pipelines) => Ok(pipelines[0]),
            Err((pipelines, error)) => {
                assert_eq!(pipelines, [vk::Pipeline::null()]);
                Err(error)
            }
        }
    }
}

impl<'a> Kernel<'a> {
    /// Makes the pipeline of a shader whose sets have these bindings.
    pub fn new(gpu: &'a Gpu, words: &[u32], sets: &[&[Binding]]) -> Self {
        Self::specialized(gpu, words, sets, &vk::SpecializationInfo::default())
    }

    /// Makes the pipeline of a shader with specialization constants.
    pub fn specialized(
        gpu: &'a Gpu,
        words: &[u32],
        sets: &[&[Binding]],
        specialization: &vk::SpecializationInfo<'_>,
    ) -> Self {
        let none = vk::DescriptorSetLayoutCreateFlags::empty();
        let layouts = sets.iter().map(|bindings| set_layout(gpu, bindings, none));
        Self::over(gpu, words, layouts.collect(), sets, specialization)
    }

    /// Makes the pipeline of a shader over sets of these layouts.
    pub fn over(
        gpu: &'a Gpu,
        words: &[u32],
        set_layouts: Vec<vk::DescriptorSetLayout>,
        sets: &[&[Binding]],
        specialization: &vk::SpecializationInfo<'_>,
    ) -> Self {
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(128)];
        let layout_info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(&ranges);
        let sizes: Vec<_> = sets
            .iter()
            .flat_map(|bindings| bindings.iter())
            .map(|&(_, ty, count)| {
                vk::DescriptorPoolSize::default()
                    .ty(ty)
                    .descriptor_count(count)
            })
            .collect();
        let pool_info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(sets.len().max(1) as u32)
            .pool_sizes(&sizes);
        // SAFETY: see the crate.
        let (layout, pool) = unsafe {
            (
                gpu.device
                    .create_pipeline_layout(&layout_info, None)
                    .unwrap(),
                gpu.device.create_descriptor_pool(&pool_info, None).unwrap(),
            )
        };
        let pipeline = pipeline(gpu, layout, words, specialization)
            .unwrap_or_else(|error| panic!("{error}: {:?}", gpu.take_messages()));
        Self {
            gpu,
            set_layouts,
            layout,
            pipeline,
            pool,
        }
    }

    /// Sets of the kernel's layouts.
    pub fn sets(&self) -> Vec<vk::DescriptorSet> {
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&self.set_layouts);
        // SAFETY: see the crate.
        unsafe { self.gpu.device.allocate_descriptor_sets(&info).unwrap() }
    }

    /// One set whose first bindings are these storage buffers, whole.
    pub fn storage_set(&self, buffers: &[Buffer]) -> vk::DescriptorSet {
        let set = self.sets()[0];
        for (binding, &buffer) in (0..).zip(buffers) {
            let ty = vk::DescriptorType::STORAGE_BUFFER;
            write(self.gpu, set, (binding, 0), ty, &[whole(buffer)]);
        }
        set
    }

    /// Binds the pipeline and sets, without dynamic offsets.
    pub fn bind(&self, commands: vk::CommandBuffer, sets: &[vk::DescriptorSet]) {
        let bind_point = vk::PipelineBindPoint::COMPUTE;
        let device = &self.gpu.device;
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, bind_point, self.pipeline);
            device.cmd_bind_descriptor_sets(commands, bind_point, self.layout, 0, sets, &[]);
        }
    }

    /// Pushes words of push constants.
    pub fn push(&self, commands: vk::CommandBuffer, words: &[u32]) {
        let stage = vk::ShaderStageFlags::COMPUTE;
        let bytes = bytemuck::cast_slice(words);
        // SAFETY: see the crate.
        unsafe {
            self.gpu
                .device
                .cmd_push_constants(commands, self.layout, stage, 0, bytes);
        }
    }

    /// Binds sets, pushes constants, dispatches and waits.
    pub fn run(&self, sets: &[vk::DescriptorSet], push: &[u32], groups: [u32; 3]) {
        self.gpu.run(|device, commands| {
            self.bind(commands, sets);
            if !push.is_empty() {
                self.push(commands, push);
            }
            let [x, y, z] = groups;
            // SAFETY: see the crate.
            unsafe { device.cmd_dispatch(commands, x, y, z) };
        });
    }
}

impl Drop for Kernel<'_> {
    fn drop(&mut self) {
        let device = &self.gpu.device;
        // SAFETY: see the crate.
        unsafe {
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            for &layout in &self.set_layouts {
                device.destroy_descriptor_set_layout(layout, None);
            }
            device.destroy_descriptor_pool(self.pool, None);
        }
    }
}

/// All of a buffer.
pub fn whole(buffer: Buffer) -> vk::DescriptorBufferInfo {
    vk::DescriptorBufferInfo::default()
        .buffer(buffer.buffer)
        .range(vk::WHOLE_SIZE)
}

/// Writes buffers' descriptors from a binding's element on.
pub fn write(
    gpu: &Gpu,
    set: vk::DescriptorSet,
    (binding, element): (u32, u32),
    ty: vk::DescriptorType,
    infos: &[vk::DescriptorBufferInfo],
) {
    let writes = [vk::WriteDescriptorSet::default()
        .dst_set(set)
        .dst_binding(binding)
        .dst_array_element(element)
        .descriptor_type(ty)
        .buffer_info(infos)];
    // SAFETY: see the crate.
    unsafe { gpu.device.update_descriptor_sets(&writes, &[]) };
}
