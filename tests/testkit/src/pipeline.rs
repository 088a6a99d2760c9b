//! Graphics pipelines, made of defaults and a test's changes, and compute pipelines.

use ash::vk;
use gaurast::vk::{
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianDecodingStateCreateInfoGAURAST,
    PipelineGaussianFootprintStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
    PipelineGaussianUnscentedStateCreateInfoGAURAST,
};

use crate::descriptors::{Binding, Bindings, Sets, write};
use crate::gpu::{Commands, Gpu};
use crate::pass::{Attachments, Bindable};
use crate::resource::{Buffer, depth_and_stencil};
use crate::shader::{Stage, compile};
use vk::GraphicsPipelineLibraryFlagsEXT as Parts;

/// A shader of a pipeline.
#[derive(Clone, Debug)]
pub struct Shader {
    /// Its stage.
    pub stage: vk::ShaderStageFlags,
    /// Its SPIR-V.
    pub words: Vec<u32>,
    /// Specialization constants: number and bits.
    pub constants: Vec<(u32, u32)>,
}

impl Shader {
    /// A shader without specialization constants.
    pub fn new(stage: vk::ShaderStageFlags, words: Vec<u32>) -> Self {
        Self { stage, words, constants: Vec::new() }
    }

    /// A vertex shader.
    pub fn vertex(words: Vec<u32>) -> Self {
        Self::new(vk::ShaderStageFlags::VERTEX, words)
    }

    /// A fragment shader.
    pub fn fragment(words: Vec<u32>) -> Self {
        Self::new(vk::ShaderStageFlags::FRAGMENT, words)
    }
}

/// All state of a graphics pipeline. The defaults draw a list of triangles without shaders, both faces, to one
/// attachment of four 32-bit floats, without tests or blending.
#[derive(Clone)]
pub struct Graphics<'a> {
    /// Shaders, one per stage.
    pub shaders: Vec<Shader>,
    /// Layouts of descriptor sets.
    pub set_layouts: Vec<vk::DescriptorSetLayout>,
    /// Push constants.
    pub push: Vec<vk::PushConstantRange>,
    /// True if creation gets a pipeline layout.
    pub has_layout: bool,
    /// Flags of that layout.
    pub layout_flags: vk::PipelineLayoutCreateFlags,
    /// Flags of creation.
    pub flags: vk::PipelineCreateFlags,
    /// The parts that creation gets, without the state of others, or `None` for all.
    pub parts: Option<vk::GraphicsPipelineLibraryFlagsEXT>,
    /// Libraries with further parts.
    pub libraries: Vec<vk::Pipeline>,
    /// True if stages have their shaders' code, not modules.
    pub inline_modules: bool,
    /// The vertex bindings.
    pub bindings: Vec<vk::VertexInputBindingDescription>,
    /// The instance divisors of vertex bindings.
    pub divisors: Vec<vk::VertexInputBindingDivisorDescriptionKHR>,
    /// The vertex attributes.
    pub attributes: Vec<vk::VertexInputAttributeDescription>,
    /// The primitive topology.
    pub topology: vk::PrimitiveTopology,
    /// The number of vertices of a patch; 0 without tessellation.
    pub patch_vertices: u32,
    /// The origin of the domain of patches.
    pub domain_origin: vk::TessellationDomainOrigin,
    /// True if an index of all ones begins a new primitive.
    pub restart: bool,
    /// Number of viewports and of scissors.
    pub viewports: u32,
    /// True if clip space's depths are from -w, not from 0, to w.
    pub negative_one_to_one: bool,
    /// True if the last vertex of a primitive is the provoking one.
    pub provoking_last: bool,
    /// Rasterization.
    pub raster: vk::PipelineRasterizationStateCreateInfo<'static>,
    /// Sample count and sample shading.
    pub multisample: vk::PipelineMultisampleStateCreateInfo<'static>,
    /// The samples of each 32 that are written, or `None` for all.
    pub sample_mask: Option<u32>,
    /// Depth and stencil tests.
    pub depth_stencil: vk::PipelineDepthStencilStateCreateInfo<'static>,
    /// A logic operation instead of blending.
    pub logic_op: Option<vk::LogicOp>,
    /// Blending of each colour attachment.
    pub blend: Vec<vk::PipelineColorBlendAttachmentState>,
    /// Constants for blending.
    pub blend_constants: [f32; 4],
    /// Flags of blending.
    pub blend_flags: vk::PipelineColorBlendStateCreateFlags,
    /// Dynamic states.
    pub dynamic: Vec<vk::DynamicState>,
    /// Formats of colour attachments, for dynamic rendering.
    pub formats: Vec<vk::Format>,
    /// The format of depth, stencil or both, for dynamic rendering.
    pub depth_format: vk::Format,
    /// The views of dynamic rendering, one bit each.
    pub view_mask: u32,
    /// A render pass object and subpass, in place of dynamic rendering.
    pub subpass: Option<(vk::RenderPass, u32)>,
    /// The state of Gaussian draws.
    pub gaussian: Option<PipelineGaussianStateCreateInfoGAURAST<'a>>,
    /// The approximations that Gaussian draws may use.
    pub approximation: Option<PipelineGaussianApproximationStateCreateInfoGAURAST<'static>>,
    /// The pixels that Gaussians may reach.
    pub footprint: Option<PipelineGaussianFootprintStateCreateInfoGAURAST<'static>>,
    /// The sigma points of the unscented transform.
    pub unscented: Option<PipelineGaussianUnscentedStateCreateInfoGAURAST<'static>>,
    /// The decodings of attributes.
    pub decoding: Option<PipelineGaussianDecodingStateCreateInfoGAURAST<'static>>,
}

impl Default for Graphics<'_> {
    fn default() -> Self {
        Self {
            shaders: Vec::new(),
            set_layouts: Vec::new(),
            push: Vec::new(),
            has_layout: true,
            layout_flags: vk::PipelineLayoutCreateFlags::empty(),
            flags: vk::PipelineCreateFlags::empty(),
            parts: None,
            libraries: Vec::new(),
            inline_modules: false,
            bindings: Vec::new(),
            divisors: Vec::new(),
            attributes: Vec::new(),
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            patch_vertices: 0,
            domain_origin: vk::TessellationDomainOrigin::UPPER_LEFT,
            restart: false,
            viewports: 1,
            negative_one_to_one: false,
            provoking_last: false,
            raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0),
            multisample: vk::PipelineMultisampleStateCreateInfo::default()
                .rasterization_samples(vk::SampleCountFlags::TYPE_1),
            sample_mask: None,
            depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default(),
            logic_op: None,
            blend: vec![opaque()],
            blend_constants: [0.0; 4],
            blend_flags: vk::PipelineColorBlendStateCreateFlags::empty(),
            dynamic: vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR],
            formats: vec![vk::Format::R32G32B32A32_SFLOAT],
            depth_format: vk::Format::UNDEFINED,
            view_mask: 0,
            subpass: None,
            gaussian: None,
            approximation: None,
            footprint: None,
            unscented: None,
            decoding: None,
        }
    }
}

impl Graphics<'_> {
    /// The same with another shader, which replaces that of its stage.
    #[must_use]
    pub fn with_shader(mut self, shader: Shader) -> Self {
        self.shaders.retain(|other| other.stage != shader.stage);
        self.shaders.push(shader);
        self
    }

    /// The same with one more dynamic state.
    #[must_use]
    pub fn with_dynamic(mut self, state: vk::DynamicState) -> Self {
        self.dynamic.push(state);
        self
    }

    /// Creates the pipeline.
    ///
    /// # Errors
    /// The driver's result.
    ///
    /// # Panics
    /// If a shader module is refused, or the driver gives a pipeline that it refused.
    pub fn create(&self, gpu: &Gpu) -> Result<Pipeline, vk::Result> {
        let layout = create_layout(gpu, &self.set_layouts, &self.push, self.layout_flags);
        let mut pipeline = Pipeline { raw: vk::Pipeline::null(), layout, gpu: gpu.clone() };
        let modules = self.shaders.iter().map(|shader| match self.inline_modules {
            true => vk::ShaderModule::null(),
            false => module(gpu, &shader.words),
        });
        let modules: Vec<_> = modules.collect();
        let codes = self.shaders.iter();
        let mut codes: Vec<_> = codes.map(|shader| vk::ShaderModuleCreateInfo::default().code(&shader.words)).collect();
        let constants = self.shaders.iter();
        let constants: Vec<_> = constants.map(|shader| specialization(&shader.constants)).collect();
        let specializations: Vec<_> = (constants.iter())
            .map(|(entries, values)| {
                vk::SpecializationInfo::default().map_entries(entries).data(bytemuck::cast_slice(values))
            })
            .collect();
        let stages: Vec<_> = (codes.iter_mut().enumerate())
            .map(|(index, code)| {
                let stage = vk::PipelineShaderStageCreateInfo::default()
                    .stage(self.shaders[index].stage)
                    .module(modules[index])
                    .name(c"main")
                    .specialization_info(&specializations[index]);
                match self.inline_modules {
                    true => stage.push_next(code),
                    false => stage,
                }
            })
            .collect();
        let created = self.create_of(gpu, layout, &stages);
        for module in modules {
            // SAFETY: see the crate.
            unsafe { gpu.device().destroy_shader_module(module, None) };
        }
        pipeline.raw = created?;
        Ok(pipeline)
    }

    /// Reports whether creation gets a part.
    fn has(&self, part: Parts) -> bool {
        self.parts.is_none_or(|parts| parts.contains(part))
    }

    fn create_of(
        &self,
        gpu: &Gpu,
        layout: vk::PipelineLayout,
        stages: &[vk::PipelineShaderStageCreateInfo<'_>],
    ) -> Result<vk::Pipeline, vk::Result> {
        let mut divisors =
            vk::PipelineVertexInputDivisorStateCreateInfoKHR::default().vertex_binding_divisors(&self.divisors);
        let mut vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&self.bindings)
            .vertex_attribute_descriptions(&self.attributes);
        if !self.divisors.is_empty() {
            vertex_input = vertex_input.push_next(&mut divisors);
        }
        let mut provoking = vk::PipelineRasterizationProvokingVertexStateCreateInfoEXT::default()
            .provoking_vertex_mode(vk::ProvokingVertexModeEXT::LAST_VERTEX);
        let mut raster = self.raster;
        if self.provoking_last {
            raster = raster.push_next(&mut provoking);
        }
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(self.topology)
            .primitive_restart_enable(self.restart);
        let mut origin =
            vk::PipelineTessellationDomainOriginStateCreateInfo::default().domain_origin(self.domain_origin);
        let tessellation = vk::PipelineTessellationStateCreateInfo::default()
            .patch_control_points(self.patch_vertices)
            .push_next(&mut origin);
        let mut control =
            vk::PipelineViewportDepthClipControlCreateInfoEXT::default().negative_one_to_one(self.negative_one_to_one);
        let mut viewport =
            vk::PipelineViewportStateCreateInfo::default().viewport_count(self.viewports).scissor_count(self.viewports);
        if self.negative_one_to_one {
            viewport = viewport.push_next(&mut control);
        }
        let mut multisample = self.multisample;
        let words = multisample.rasterization_samples.as_raw().div_ceil(32).max(1) as usize;
        let mask: Vec<_> = self.sample_mask.into_iter().flat_map(|word| vec![word; words]).collect();
        if !mask.is_empty() {
            multisample = multisample.sample_mask(&mask);
        }
        let blend = vk::PipelineColorBlendStateCreateInfo::default()
            .flags(self.blend_flags)
            .attachments(&self.blend)
            .logic_op_enable(self.logic_op.is_some())
            .logic_op(self.logic_op.unwrap_or_default())
            .blend_constants(self.blend_constants);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&self.dynamic);
        let (depth, stencil) = depth_and_stencil(self.depth_format);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .view_mask(self.view_mask)
            .color_attachment_formats(&self.formats)
            .depth_attachment_format(depth)
            .stencil_attachment_format(stencil);
        let mut gaussian = self.gaussian.unwrap_or_default();
        let mut approximation = self.approximation.unwrap_or_default();
        let mut footprint = self.footprint.unwrap_or_default();
        let mut unscented = self.unscented.unwrap_or_default();
        let mut decoding = self.decoding.unwrap_or_default();
        let mut parts = vk::GraphicsPipelineLibraryCreateInfoEXT::default().flags(self.parts.unwrap_or_default());
        let mut libraries = vk::PipelineLibraryCreateInfoKHR::default().libraries(&self.libraries);
        let mut info = vk::GraphicsPipelineCreateInfo::default().flags(self.flags).dynamic_state(&dynamic);
        if self.has(Parts::VERTEX_INPUT_INTERFACE) {
            info = info.vertex_input_state(&vertex_input).input_assembly_state(&assembly);
        }
        if self.has(Parts::PRE_RASTERIZATION_SHADERS) {
            info = info.viewport_state(&viewport).rasterization_state(&raster);
            if self.patch_vertices > 0 {
                info = info.tessellation_state(&tessellation);
            }
        }
        if self.has(Parts::FRAGMENT_SHADER) {
            info = info.depth_stencil_state(&self.depth_stencil);
        }
        if self.has(Parts::FRAGMENT_OUTPUT_INTERFACE) {
            info = info.multisample_state(&multisample).color_blend_state(&blend);
        }
        if self.has(Parts::PRE_RASTERIZATION_SHADERS) || self.has(Parts::FRAGMENT_SHADER) {
            info = info.stages(stages);
        }
        if self.has_layout {
            info = info.layout(layout);
        }
        info = match self.subpass {
            Some((render_pass, subpass)) => info.render_pass(render_pass).subpass(subpass),
            None => info.push_next(&mut rendering),
        };
        if self.parts.is_some() {
            info = info.push_next(&mut parts);
        }
        if !self.libraries.is_empty() {
            info = info.push_next(&mut libraries);
        }
        if self.gaussian.is_some() {
            info = info.push_next(&mut gaussian);
        }
        if self.approximation.is_some() {
            info = info.push_next(&mut approximation);
        }
        if self.footprint.is_some() {
            info = info.push_next(&mut footprint);
        }
        if self.unscented.is_some() {
            info = info.push_next(&mut unscented);
        }
        if self.decoding.is_some() {
            info = info.push_next(&mut decoding);
        }
        let cache = vk::PipelineCache::null();
        // SAFETY: see the crate.
        one(unsafe { gpu.device().create_graphics_pipelines(cache, &[info], None) })
    }
}

/// The only pipeline that was created, or the error. A refused pipeline must be null.
fn one(created: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>) -> Result<vk::Pipeline, vk::Result> {
    match created {
        Ok(pipelines) => Ok(pipelines[0]),
        Err((pipelines, error)) => {
            assert_eq!(pipelines, [vk::Pipeline::null()]);
            Err(error)
        }
    }
}

/// A vertex shader that passes on position and colour.
pub const VERTEX: &str = "
    layout(location = 0) in vec4 position;
    layout(location = 1) in vec4 color;
    layout(location = 0) out vec4 v_color;
    void main() { gl_Position = position; gl_PointSize = 1.0; v_color = color; }";

/// A fragment shader that writes the interpolated colour.
pub const FRAGMENT: &str = "
    layout(location = 0) in vec4 v_color;
    layout(location = 0) out vec4 color;
    void main() { color = v_color; }";

/// The default vertex of scenes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// The position in clip coordinates.
    pub position: [f32; 4],
    /// Red, green, blue and alpha.
    pub color: [f32; 4],
}

/// The options of a pipeline. The defaults draw a list of [`Vertex`] triangles, both faces, without depth test or
/// blending.
#[derive(Clone)]
pub struct PipelineOptions<'a> {
    /// The vertex shader in GLSL.
    pub vertex: &'a str,
    /// The shaders between the vertex and the fragment shader, in GLSL.
    pub between: Vec<(Stage, &'a str)>,
    /// The fragment shader in GLSL, or `None` for no fragment stage.
    pub fragment: Option<&'a str>,
    /// Specialization constants of all stages.
    pub specialization: Vec<(u32, u32)>,
    /// The vertex bindings.
    pub vertex_bindings: Vec<vk::VertexInputBindingDescription>,
    /// The vertex attributes.
    pub vertex_attributes: Vec<vk::VertexInputAttributeDescription>,
    /// The primitive topology.
    pub topology: vk::PrimitiveTopology,
    /// The number of vertices of a patch; 0 without tessellation.
    pub patch_vertices: u32,
    /// The origin of the domain of patches.
    pub domain_origin: vk::TessellationDomainOrigin,
    /// True if an index of all ones begins a new primitive.
    pub restart: bool,
    /// Number of viewports and of scissors.
    pub viewports: u32,
    /// True if clip space's depths are from -w, not from 0, to w.
    pub negative_one_to_one: bool,
    /// Rasterization.
    pub raster: vk::PipelineRasterizationStateCreateInfo<'static>,
    /// The minimum share of samples that are shaded separately, or `None` without sample shading.
    pub sample_shading: Option<f32>,
    /// The samples of each 32 that are written.
    pub sample_mask: u32,
    /// True if alpha determines the covered samples.
    pub alpha_to_coverage: bool,
    /// True if alpha is replaced by one.
    pub alpha_to_one: bool,
    /// Depth and stencil tests.
    pub depth_stencil: vk::PipelineDepthStencilStateCreateInfo<'static>,
    /// Blending of each colour attachment; further attachments write all components unblended.
    pub blend: Vec<vk::PipelineColorBlendAttachmentState>,
    /// Constants for blending.
    pub blend_constants: [f32; 4],
    /// Flags of blending.
    pub blend_flags: vk::PipelineColorBlendStateCreateFlags,
    /// A logic operation instead of blending.
    pub logic_op: Option<vk::LogicOp>,
    /// Dynamic states in addition to viewport and scissor.
    pub dynamic: Vec<vk::DynamicState>,
    /// The descriptor set.
    pub bindings: Option<&'a Bindings>,
    /// A render pass object and subpass, in place of dynamic rendering.
    pub subpass: Option<(vk::RenderPass, u32)>,
    /// The views of dynamic rendering, one bit each.
    pub view_mask: u32,
    /// The flags of its creation.
    pub flags: vk::PipelineCreateFlags,
}

impl Default for PipelineOptions<'_> {
    fn default() -> Self {
        Self {
            vertex: VERTEX,
            between: Vec::new(),
            fragment: Some(FRAGMENT),
            specialization: Vec::new(),
            vertex_bindings: vec![binding(0, size_of::<Vertex>() as u32)],
            vertex_attributes: vec![
                attribute(0, vk::Format::R32G32B32A32_SFLOAT, 0),
                attribute(1, vk::Format::R32G32B32A32_SFLOAT, 16),
            ],
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            patch_vertices: 0,
            domain_origin: vk::TessellationDomainOrigin::UPPER_LEFT,
            restart: false,
            viewports: 1,
            negative_one_to_one: false,
            raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0),
            sample_shading: None,
            sample_mask: u32::MAX,
            alpha_to_coverage: false,
            alpha_to_one: false,
            depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default(),
            blend: Vec::new(),
            blend_constants: [0.0; 4],
            blend_flags: vk::PipelineColorBlendStateCreateFlags::empty(),
            logic_op: None,
            dynamic: Vec::new(),
            bindings: None,
            subpass: None,
            view_mask: 0,
            flags: vk::PipelineCreateFlags::empty(),
        }
    }
}

/// A binding that advances by vertex.
pub fn binding(binding: u32, stride: u32) -> vk::VertexInputBindingDescription {
    vk::VertexInputBindingDescription { binding, stride, input_rate: vk::VertexInputRate::VERTEX }
}

/// An attribute from binding 0.
pub fn attribute(location: u32, format: vk::Format, offset: u32) -> vk::VertexInputAttributeDescription {
    vk::VertexInputAttributeDescription { location, binding: 0, format, offset }
}

/// The state that tests and writes depth.
pub fn depth_test(op: vk::CompareOp) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(op)
        .max_depth_bounds(1.0)
}

/// The state that writes all components without blending.
pub fn opaque() -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
}

/// The state that blends colour and alpha in the same way.
pub fn blend(from: vk::BlendFactor, to: vk::BlendFactor, op: vk::BlendOp) -> vk::PipelineColorBlendAttachmentState {
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
#[derive(Debug)]
pub struct Pipeline {
    /// The pipeline.
    pub raw: vk::Pipeline,
    /// Its layout.
    pub layout: vk::PipelineLayout,
    gpu: Gpu,
}

impl Pipeline {
    /// Creates a pipeline that draws to `target`, with one descriptor set, if any, and 128 bytes of push constants.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn new(gpu: &Gpu, target: &impl Attachments, options: &PipelineOptions<'_>) -> Self {
        let formats = target.attachment_formats();
        let shader = |stage, flags, source| Shader {
            constants: options.specialization.clone(),
            ..Shader::new(flags, compile(stage, source))
        };
        let fragment = options.fragment.map(|source| (Stage::Fragment, source));
        let sources = std::iter::once((Stage::Vertex, options.vertex));
        let sources = sources.chain(options.between.iter().copied()).chain(fragment);
        let shaders = sources.map(|(stage, source)| shader(stage, stage.flag(), source));
        let shaders = shaders.collect();
        let push = vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::ALL_GRAPHICS).size(128);
        let mut blend = options.blend.clone();
        blend.resize(formats.colors.len(), opaque());
        let mut dynamic = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        dynamic.extend(&options.dynamic);
        let graphics = Graphics {
            shaders,
            set_layouts: options.bindings.iter().map(|set| set.layout).collect(),
            push: vec![push],
            bindings: options.vertex_bindings.clone(),
            attributes: options.vertex_attributes.clone(),
            topology: options.topology,
            patch_vertices: options.patch_vertices,
            domain_origin: options.domain_origin,
            restart: options.restart,
            viewports: options.viewports,
            negative_one_to_one: options.negative_one_to_one,
            raster: options.raster,
            multisample: vk::PipelineMultisampleStateCreateInfo::default()
                .rasterization_samples(vk::SampleCountFlags::from_raw(formats.samples))
                .sample_shading_enable(options.sample_shading.is_some())
                .min_sample_shading(options.sample_shading.unwrap_or(0.0))
                .alpha_to_coverage_enable(options.alpha_to_coverage)
                .alpha_to_one_enable(options.alpha_to_one),
            sample_mask: Some(options.sample_mask),
            depth_stencil: options.depth_stencil,
            logic_op: options.logic_op,
            blend,
            blend_constants: options.blend_constants,
            blend_flags: options.blend_flags,
            dynamic,
            formats: formats.colors,
            depth_format: formats.depth,
            view_mask: options.view_mask,
            flags: options.flags,
            subpass: options.subpass,
            ..Graphics::default()
        };
        let created = graphics.create(gpu);
        created.unwrap_or_else(|result| panic!("a pipeline: {result:?}"))
    }
}

impl Bindable for Pipeline {
    fn handles(&self) -> (vk::Pipeline, vk::PipelineLayout) {
        (self.raw, self.layout)
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        destroy(&self.gpu, self.raw, self.layout);
    }
}

/// A compute pipeline.
#[derive(Debug)]
pub struct Kernel {
    /// The pipeline.
    pub raw: vk::Pipeline,
    /// Its layout: descriptor sets, and 128 bytes of push constants.
    pub layout: vk::PipelineLayout,
    gpu: Gpu,
}

impl Kernel {
    /// Creates a pipeline of a compute shader in GLSL over one set.
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
        let created = Self::create(gpu, words, sets, &vk::SpecializationInfo::default());
        created.unwrap_or_else(|error| panic!("{error:?}: {:?}", gpu.messages()))
    }

    /// Creates a pipeline with specialization constants: number and bits.
    ///
    /// # Errors
    /// The driver's result.
    pub fn specialized(
        gpu: &Gpu,
        words: &[u32],
        sets: &[vk::DescriptorSetLayout],
        constants: &[(u32, u32)],
    ) -> Result<Self, vk::Result> {
        let (entries, values) = specialization(constants);
        let info = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&values));
        Self::create(gpu, words, sets, &info)
    }

    /// Creates a pipeline with specialization constants of any type.
    ///
    /// # Errors
    /// The driver's result.
    pub fn create(
        gpu: &Gpu,
        words: &[u32],
        sets: &[vk::DescriptorSetLayout],
        specialization: &vk::SpecializationInfo<'_>,
    ) -> Result<Self, vk::Result> {
        let ranges = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(128)];
        let mut kernel = Self {
            raw: vk::Pipeline::null(),
            layout: create_layout(gpu, sets, &ranges, vk::PipelineLayoutCreateFlags::empty()),
            gpu: gpu.clone(),
        };
        let device = gpu.device();
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: see the crate.
        unsafe {
            let module = device.create_shader_module(&info, None)?;
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main")
                .specialization_info(specialization);
            let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(kernel.layout);
            let created = device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            device.destroy_shader_module(module, None);
            kernel.raw = one(created)?;
        }
        Ok(kernel)
    }

    /// Binds the pipeline and sets, without dynamic offsets.
    pub fn bind(&self, commands: vk::CommandBuffer, sets: &[vk::DescriptorSet]) {
        let (device, point) = (self.gpu.device(), vk::PipelineBindPoint::COMPUTE);
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, point, self.raw);
            if !sets.is_empty() {
                device.cmd_bind_descriptor_sets(commands, point, self.layout, 0, sets, &[]);
            }
        }
    }

    /// Pushes words of push constants.
    pub fn push(&self, commands: vk::CommandBuffer, words: &[u32]) {
        let (stage, bytes) = (vk::ShaderStageFlags::COMPUTE, bytemuck::cast_slice(words));
        let device = self.gpu.device();
        // SAFETY: see the crate.
        unsafe { device.cmd_push_constants(commands, self.layout, stage, 0, bytes) };
    }

    /// Records a dispatch of workgroups with sets.
    pub fn dispatch(&self, commands: &Commands, sets: &[vk::DescriptorSet], push: &[u32], [x, y, z]: [u32; 3]) {
        self.bind(commands.raw, sets);
        if !push.is_empty() {
            self.push(commands.raw, push);
        }
        // SAFETY: see the crate.
        unsafe { self.gpu.device().cmd_dispatch(commands.raw, x, y, z) };
    }

    /// Dispatches workgroups with sets, and waits.
    pub fn run(&self, sets: &[vk::DescriptorSet], push: &[u32], groups: [u32; 3]) {
        self.gpu.run(|commands| {
            commands.barrier();
            self.dispatch(commands, sets, push, groups);
            commands.barrier();
        });
    }
}

impl Drop for Kernel {
    fn drop(&mut self) {
        destroy(&self.gpu, self.raw, self.layout);
    }
}

/// A compute pipeline with the layouts of its sets, and a pool for one set of each.
pub struct Compute {
    /// The pipeline.
    pub kernel: Kernel,
    /// The layouts and the pool.
    pub sets: Sets,
}

impl Compute {
    /// Makes the pipeline of a shader whose sets have these bindings.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn new(gpu: &Gpu, words: &[u32], sets: &[&[Binding]]) -> Self {
        Self::specialized(gpu, words, sets, &vk::SpecializationInfo::default())
    }

    /// Makes the pipeline of a shader with specialization constants.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn specialized(
        gpu: &Gpu,
        words: &[u32],
        sets: &[&[Binding]],
        specialization: &vk::SpecializationInfo<'_>,
    ) -> Self {
        Self::over(gpu, words, Sets::new(gpu, sets), specialization)
    }

    /// Makes the pipeline of a shader over these sets.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn over(gpu: &Gpu, words: &[u32], sets: Sets, specialization: &vk::SpecializationInfo<'_>) -> Self {
        let kernel = Kernel::create(gpu, words, &sets.layouts, specialization)
            .unwrap_or_else(|error| panic!("{error:?}: {:?}", gpu.messages()));
        Self { kernel, sets }
    }

    /// A set whose first bindings are these storage buffers, each as a whole.
    pub fn storage_set(&self, buffers: &[&Buffer]) -> vk::DescriptorSet {
        let set = self.sets.allocate()[0];
        for (binding, buffer) in (0..).zip(buffers) {
            let ty = vk::DescriptorType::STORAGE_BUFFER;
            write(&self.kernel.gpu, set, (binding, 0), ty, &[whole(buffer)]);
        }
        set
    }
}

impl std::ops::Deref for Compute {
    type Target = Kernel;

    fn deref(&self) -> &Kernel {
        &self.kernel
    }
}

/// All of a buffer.
pub fn whole(buffer: &Buffer) -> vk::DescriptorBufferInfo {
    vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)
}

fn specialization(constants: &[(u32, u32)]) -> (Vec<vk::SpecializationMapEntry>, Vec<u32>) {
    let entry = |(index, &(id, _)): (usize, &(u32, u32))| {
        vk::SpecializationMapEntry::default().constant_id(id).offset(4 * index as u32).size(4)
    };
    let entries = constants.iter().enumerate().map(entry).collect();
    (entries, constants.iter().map(|&(_, value)| value).collect())
}

fn create_layout(
    gpu: &Gpu,
    sets: &[vk::DescriptorSetLayout],
    ranges: &[vk::PushConstantRange],
    flags: vk::PipelineLayoutCreateFlags,
) -> vk::PipelineLayout {
    let info = vk::PipelineLayoutCreateInfo::default().flags(flags).set_layouts(sets).push_constant_ranges(ranges);
    // SAFETY: see the crate.
    unsafe { gpu.device().create_pipeline_layout(&info, None) }.expect("a pipeline layout")
}

fn module(gpu: &Gpu, words: &[u32]) -> vk::ShaderModule {
    let info = vk::ShaderModuleCreateInfo::default().code(words);
    // SAFETY: see the crate.
    unsafe { gpu.device().create_shader_module(&info, None) }.expect("a shader module")
}

fn destroy(gpu: &Gpu, pipeline: vk::Pipeline, layout: vk::PipelineLayout) {
    // SAFETY: see the crate.
    unsafe {
        gpu.device().destroy_pipeline(pipeline, None);
        gpu.device().destroy_pipeline_layout(layout, None);
    }
}
