//! Graphics pipelines: all defaults, with what a scene changes; and descriptor sets.

use ash::vk;

use super::shader::{Stage, compile};
use super::{Gpu, Target};

/// Passes on position and colour.
pub const VERTEX: &str = "
    layout(location = 0) in vec4 position;
    layout(location = 1) in vec4 color;
    layout(location = 0) out vec4 v_color;
    void main() { gl_Position = position; gl_PointSize = 1.0; v_color = color; }";

/// Writes the interpolated colour.
pub const FRAGMENT: &str = "
    layout(location = 0) in vec4 v_color;
    layout(location = 0) out vec4 color;
    void main() { color = v_color; }";

/// What scenes draw by default.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// In clip coordinates.
    pub position: [f32; 4],
    /// Red, green, blue and alpha.
    pub color: [f32; 4],
}

/// What a pipeline is made of. The defaults draw a list of [`Vertex`] triangles, both sides, without
/// depth test or blending.
#[derive(Clone)]
pub struct PipelineOptions<'a> {
    /// GLSL.
    pub vertex: &'a str,
    /// GLSL; without it there is no fragment stage.
    pub fragment: Option<&'a str>,
    /// Specialization constants of both stages.
    pub specialization: Vec<(u32, u32)>,
    /// Where vertices come from.
    pub vertex_bindings: Vec<vk::VertexInputBindingDescription>,
    /// What they are made of.
    pub vertex_attributes: Vec<vk::VertexInputAttributeDescription>,
    /// What they become.
    pub topology: vk::PrimitiveTopology,
    /// Whether an index of all ones begins a new primitive.
    pub restart: bool,
    /// Rasterization.
    pub raster: vk::PipelineRasterizationStateCreateInfo<'static>,
    /// The least share of samples that are shaded one by one.
    pub sample_shading: Option<f32>,
    /// Which samples are written.
    pub sample_mask: u32,
    /// Whether alpha decides which samples are covered.
    pub alpha_to_coverage: bool,
    /// Whether alpha is replaced by one.
    pub alpha_to_one: bool,
    /// Depth and stencil tests.
    pub depth_stencil: vk::PipelineDepthStencilStateCreateInfo<'static>,
    /// Blending of each colour attachment; those beyond write all components unblended.
    pub blend: Vec<vk::PipelineColorBlendAttachmentState>,
    /// Constants for blending.
    pub blend_constants: [f32; 4],
    /// A logic operation instead of blending.
    pub logic_op: Option<vk::LogicOp>,
    /// Dynamic states beside viewport and scissor.
    pub dynamic: Vec<vk::DynamicState>,
    /// The descriptor set.
    pub bindings: Option<&'a Bindings>,
    /// A render pass object and subpass instead of dynamic rendering.
    pub subpass: Option<(vk::RenderPass, u32)>,
    /// The views of a dynamic render, a bit each.
    pub view_mask: u32,
}

impl Default for PipelineOptions<'_> {
    fn default() -> Self {
        Self {
            vertex: VERTEX,
            fragment: Some(FRAGMENT),
            specialization: Vec::new(),
            vertex_bindings: vec![binding(0, size_of::<Vertex>() as u32)],
            vertex_attributes: vec![
                attribute(0, vk::Format::R32G32B32A32_SFLOAT, 0),
                attribute(1, vk::Format::R32G32B32A32_SFLOAT, 16),
            ],
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            restart: false,
            raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0),
            sample_shading: None,
            sample_mask: u32::MAX,
            alpha_to_coverage: false,
            alpha_to_one: false,
            depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default(),
            blend: Vec::new(),
            blend_constants: [0.0; 4],
            logic_op: None,
            dynamic: Vec::new(),
            bindings: None,
            subpass: None,
            view_mask: 0,
        }
    }
}

/// A binding that advances by vertex.
pub fn binding(binding: u32, stride: u32) -> vk::VertexInputBindingDescription {
    vk::VertexInputBindingDescription {
        binding,
        stride,
        input_rate: vk::VertexInputRate::VERTEX,
    }
}

/// An attribute from binding 0.
pub fn attribute(
    location: u32,
    format: vk::Format,
    offset: u32,
) -> vk::VertexInputAttributeDescription {
    vk::VertexInputAttributeDescription {
        location,
        binding: 0,
        format,
        offset,
    }
}

/// Test and write depth.
pub fn depth_test(op: vk::CompareOp) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(op)
        .max_depth_bounds(1.0)
}

/// Write all components without blending.
pub fn opaque() -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
}

/// Blend colour and alpha alike.
pub fn blend(
    from: vk::BlendFactor,
    to: vk::BlendFactor,
    op: vk::BlendOp,
) -> vk::PipelineColorBlendAttachmentState {
    opaque()
        .blend_enable(true)
        .src_color_blend_factor(from)
        .dst_color_blend_factor(to)
        .color_blend_op(op)
        .src_alpha_blend_factor(from)
        .dst_alpha_blend_factor(to)
        .alpha_blend_op(op)
}

/// A graphics pipeline.
pub struct Pipeline {
    /// The pipeline.
    pub raw: vk::Pipeline,
    /// Its layout: one descriptor set, if any, and 128 bytes of push constants.
    pub layout: vk::PipelineLayout,
    gpu: Gpu,
}

impl Pipeline {
    /// Creates a pipeline that draws to `target`.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn new(gpu: &Gpu, target: &Target, options: &PipelineOptions<'_>) -> Self {
        let layout = create_layout(gpu, options.bindings);
        let mut pipeline = Self {
            raw: vk::Pipeline::null(),
            layout,
            gpu: gpu.clone(),
        };
        let vertex = module(gpu, Stage::Vertex, options.vertex);
        let fragment = options
            .fragment
            .map(|source| module(gpu, Stage::Fragment, source));
        let created = pipeline.create(target, options, vertex, fragment);
        // SAFETY: see `triangles`.
        unsafe {
            gpu.device().destroy_shader_module(vertex, None);
            gpu.device()
                .destroy_shader_module(fragment.unwrap_or_default(), None);
        }
        pipeline.raw = created.unwrap_or_else(|result| panic!("a pipeline: {result}"));
        pipeline
    }

    fn create(
        &self,
        target: &Target,
        options: &PipelineOptions<'_>,
        vertex: vk::ShaderModule,
        fragment: Option<vk::ShaderModule>,
    ) -> Result<vk::Pipeline, vk::Result> {
        let (entries, values) = specialization(&options.specialization);
        let specialization = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(bytemuck::cast_slice(&values));
        let stage = |stage, module| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(stage)
                .module(module)
                .name(c"main")
                .specialization_info(&specialization)
        };
        let mut stages = vec![stage(vk::ShaderStageFlags::VERTEX, vertex)];
        stages.extend(fragment.map(|module| stage(vk::ShaderStageFlags::FRAGMENT, module)));
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&options.vertex_bindings)
            .vertex_attribute_descriptions(&options.vertex_attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(options.topology)
            .primitive_restart_enable(options.restart);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let mask = [options.sample_mask];
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(target.options.samples))
            .sample_shading_enable(options.sample_shading.is_some())
            .min_sample_shading(options.sample_shading.unwrap_or(0.0))
            .sample_mask(&mask)
            .alpha_to_coverage_enable(options.alpha_to_coverage)
            .alpha_to_one_enable(options.alpha_to_one);
        let mut blend = options.blend.clone();
        blend.resize(target.colors.len(), opaque());
        let blend = vk::PipelineColorBlendStateCreateInfo::default()
            .logic_op_enable(options.logic_op.is_some())
            .logic_op(options.logic_op.unwrap_or_default())
            .attachments(&blend)
            .blend_constants(options.blend_constants);
        let mut dynamic = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        dynamic.extend(&options.dynamic);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let (colors, depth, stencil) = target.formats();
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .view_mask(options.view_mask)
            .color_attachment_formats(colors)
            .depth_attachment_format(depth)
            .stencil_attachment_format(stencil);
        let mut info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&options.raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&options.depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout);
        match options.subpass {
            Some((pass, subpass)) => info = info.render_pass(pass).subpass(subpass),
            None => info = info.push_next(&mut rendering),
        }
        let device = self.gpu.device();
        // SAFETY: see `triangles`.
        let created =
            unsafe { device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
        created
            .map(|pipelines| pipelines[0])
            .map_err(|(_, result)| result)
    }
}

/// A compute pipeline.
pub struct Kernel {
    /// The pipeline.
    pub raw: vk::Pipeline,
    /// Its layout: one descriptor set, if any.
    pub layout: vk::PipelineLayout,
    gpu: Gpu,
}

impl Kernel {
    /// Creates a pipeline of a compute shader over one set.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn new(gpu: &Gpu, source: &str, bindings: &Bindings) -> Self {
        Self::over(gpu, &compile(Stage::Compute, source), &[bindings.layout])
    }

    /// Creates a pipeline of a compute shader's SPIR-V over sets of these layouts.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn over(gpu: &Gpu, words: &[u32], sets: &[vk::DescriptorSetLayout]) -> Self {
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(128)];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(sets)
            .push_constant_ranges(&ranges);
        let device = gpu.device();
        // SAFETY: see `triangles`.
        unsafe {
            let module = vk::ShaderModuleCreateInfo::default().code(words);
            let module = device
                .create_shader_module(&module, None)
                .expect("a shader module");
            let layout = device
                .create_pipeline_layout(&info, None)
                .expect("a pipeline layout");
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main");
            let info = vk::ComputePipelineCreateInfo::default()
                .stage(stage)
                .layout(layout);
            let created = device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            device.destroy_shader_module(module, None);
            Self {
                raw: created.map_err(|(_, result)| result).expect("a pipeline")[0],
                layout,
                gpu: gpu.clone(),
            }
        }
    }

    /// Dispatches workgroups over sets, and waits.
    pub fn run(&self, sets: &[vk::DescriptorSet], push: &[u32], [x, y, z]: [u32; 3]) {
        let device = self.gpu.device();
        let point = vk::PipelineBindPoint::COMPUTE;
        self.gpu.run(|commands| {
            commands.barrier();
            // SAFETY: see `triangles`.
            unsafe {
                device.cmd_bind_pipeline(commands.raw, point, self.raw);
                if !sets.is_empty() {
                    device.cmd_bind_descriptor_sets(commands.raw, point, self.layout, 0, sets, &[]);
                }
                if !push.is_empty() {
                    let (stage, bytes) = (
                        vk::ShaderStageFlags::COMPUTE,
                        bytemuck::cast_slice::<u32, u8>(push),
                    );
                    device.cmd_push_constants(commands.raw, self.layout, stage, 0, bytes);
                }
                device.cmd_dispatch(commands.raw, x, y, z);
            }
            commands.barrier();
        });
    }
}

impl Drop for Kernel {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see `triangles`.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
        }
    }
}

fn specialization(constants: &[(u32, u32)]) -> (Vec<vk::SpecializationMapEntry>, Vec<u32>) {
    let entry = |(index, &(id, _)): (usize, &(u32, u32))| {
        vk::SpecializationMapEntry::default()
            .constant_id(id)
            .offset(4 * index as u32)
            .size(4)
    };
    let entries = constants.iter().enumerate().map(entry).collect();
    (entries, constants.iter().map(|&(_, value)| value).collect())
}

fn create_layout(gpu: &Gpu, bindings: Option<&Bindings>) -> vk::PipelineLayout {
    let ranges = [vk::PushConstantRange::default()
        .stage_flags(vk::ShaderStageFlags::ALL_GRAPHICS)
        .size(128)];
    let sets: Vec<_> = bindings.iter().map(|bindings| bindings.layout).collect();
    let info = vk::PipelineLayoutCreateInfo::default()
        .set_layouts(&sets)
        .push_constant_ranges(&ranges);
    // SAFETY: see `triangles`.
    unsafe { gpu.device().create_pipeline_layout(&info, None) }.expect("a pipeline layout")
}

fn module(gpu: &Gpu, stage: Stage, source: &str) -> vk::ShaderModule {
    let words = compile(stage, source);
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: see `triangles`.
    unsafe { gpu.device().create_shader_module(&info, None) }.expect("a shader module")
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see `triangles`.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
        }
    }
}

/// What a binding refers to.
#[derive(Clone, Copy, Debug)]
pub enum Resource {
    /// A uniform buffer.
    Uniform(vk::Buffer),
    /// A uniform buffer of some bytes at an offset given when it is bound.
    DynamicUniform(vk::Buffer, u64),
    /// A storage buffer.
    Storage(vk::Buffer),
    /// An image with a sampler.
    Texture(vk::ImageView, vk::Sampler),
    /// An attachment of the same pass.
    Input(vk::ImageView),
    /// An image that programs write to.
    StorageImage(vk::ImageView),
    /// The texels of a buffer.
    Texels(vk::BufferView),
}

impl Resource {
    fn descriptor_type(&self) -> vk::DescriptorType {
        match self {
            Self::Uniform(_) => vk::DescriptorType::UNIFORM_BUFFER,
            Self::DynamicUniform(..) => vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC,
            Self::Storage(_) => vk::DescriptorType::STORAGE_BUFFER,
            Self::Texture(..) => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            Self::Input(_) => vk::DescriptorType::INPUT_ATTACHMENT,
            Self::StorageImage(_) => vk::DescriptorType::STORAGE_IMAGE,
            Self::Texels(_) => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        }
    }

    fn stages(&self) -> vk::ShaderStageFlags {
        match self {
            Self::Input(_) => vk::ShaderStageFlags::FRAGMENT,
            _ => {
                vk::ShaderStageFlags::VERTEX
                    | vk::ShaderStageFlags::FRAGMENT
                    | vk::ShaderStageFlags::COMPUTE
            }
        }
    }
}

/// A descriptor set whose bindings are numbered from 0.
pub struct Bindings {
    /// The set.
    pub set: vk::DescriptorSet,
    /// Its layout.
    pub layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    gpu: Gpu,
}

impl Bindings {
    /// Creates it. What it refers to must outlive it.
    pub fn new(gpu: &Gpu, resources: &[Resource]) -> Self {
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(index, resource)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(index)
                    .descriptor_type(resource.descriptor_type())
                    .descriptor_count(1)
                    .stage_flags(resource.stages())
            })
            .collect();
        let sizes: Vec<_> = resources
            .iter()
            .map(|resource| vk::DescriptorPoolSize {
                ty: resource.descriptor_type(),
                descriptor_count: 1,
            })
            .collect();
        let device = gpu.device();
        // SAFETY: see `triangles`.
        let bindings = unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&entries);
            let layout = device
                .create_descriptor_set_layout(&info, None)
                .expect("a descriptor set layout");
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(1)
                .pool_sizes(&sizes);
            let pool = device
                .create_descriptor_pool(&info, None)
                .expect("a descriptor pool");
            let layouts = [layout];
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts);
            let sets = device.allocate_descriptor_sets(&info);
            Self {
                set: sets.expect("a descriptor set")[0],
                layout,
                pool,
                gpu: gpu.clone(),
            }
        };
        for (index, resource) in (0..).zip(resources) {
            bindings.write(index, resource);
        }
        bindings
    }

    fn write(&self, binding: u32, resource: &Resource) {
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(binding)
            .descriptor_type(resource.descriptor_type());
        let image = |view, sampler| {
            [vk::DescriptorImageInfo::default()
                .image_view(view)
                .sampler(sampler)
                .image_layout(vk::ImageLayout::GENERAL)]
        };
        let buffer = |buffer, range| {
            [vk::DescriptorBufferInfo::default()
                .buffer(buffer)
                .range(range)]
        };
        // SAFETY: see `triangles`.
        let update = |write| unsafe { self.gpu.device().update_descriptor_sets(&[write], &[]) };
        match *resource {
            Resource::Uniform(raw) | Resource::Storage(raw) => {
                update(write.buffer_info(&buffer(raw, vk::WHOLE_SIZE)));
            }
            Resource::DynamicUniform(raw, range) => update(write.buffer_info(&buffer(raw, range))),
            Resource::Texture(view, sampler) => update(write.image_info(&image(view, sampler))),
            Resource::Input(view) | Resource::StorageImage(view) => {
                update(write.image_info(&image(view, vk::Sampler::null())));
            }
            Resource::Texels(view) => update(write.texel_buffer_view(&[view])),
        }
    }
}

impl Drop for Bindings {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see `triangles`.
        unsafe {
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.layout, None);
        }
    }
}
