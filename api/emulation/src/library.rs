//! Pipeline libraries: the parts of pipelines, kept until they are linked. The next layer cannot have those of Gaussians.

use std::collections::HashMap;
use std::ffi::{CStr, CString};
use std::sync::Arc;

use ash::vk;
use ash::vk::GraphicsPipelineLibraryFlagsEXT as Parts;
use gaurast::vk::{
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PipelineGaussianFootprintStateCreateInfoGAURAST as Footprint,
    PipelineGaussianStateCreateInfoGAURAST as State, PipelineGaussianUnscentedStateCreateInfoGAURAST as SigmaPoints,
};
use gaurast_layer_interface::{find, slice};

use crate::next::Next;
use crate::pipeline;

/// The words of shaders that are modules.
type Shaders = HashMap<vk::ShaderModule, Arc<[u32]>>;

/// Vertex input, of the vertex input interface.
struct Input {
    topology: vk::PrimitiveTopology,
    bindings: Vec<vk::VertexInputBindingDescription>,
    attributes: Vec<vk::VertexInputAttributeDescription>,
    divisors: Vec<vk::VertexInputBindingDivisorDescriptionKHR>,
}

/// The state of the part of pre-rasterization shaders.
struct PreRasterization {
    state: Option<State<'static>>,
    footprint: Option<Footprint<'static>>,
    sigma_points: Option<SigmaPoints<'static>>,
    vertex: Option<Shader>,
    viewport: Option<vk::Viewport>,
    scissor: Option<vk::Rect2D>,
    is_negative_one_to_one: bool,
    layout: vk::PipelineLayout,
    view_mask: u32,
}

/// A shader.
struct Shader {
    stage: vk::ShaderStageFlags,
    /// Of its module; none if that is named by an identifier.
    words: Option<Arc<[u32]>>,
    name: CString,
    flags: vk::PipelineShaderStageCreateFlags,
    constants: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl Shader {
    /// # Safety
    /// The creation info is valid.
    unsafe fn of(
        info: &vk::GraphicsPipelineCreateInfo<'_>,
        wanted: vk::ShaderStageFlags,
        shaders: &Shaders,
    ) -> Option<Self> {
        // SAFETY: the caller's promise.
        unsafe {
            let mut stages = slice(info.p_stages, info.stage_count).iter();
            let stage = stages.find(|stage| stage.stage == wanted)?;
            let special = stage.p_specialization_info.as_ref();
            let name = if stage.p_name.is_null() { c"" } else { CStr::from_ptr(stage.p_name) };
            Some(Self {
                stage: wanted,
                words: pipeline::shader_words(stage, shaders),
                name: name.to_owned(),
                flags: stage.flags,
                constants: special
                    .map(|special| slice(special.p_map_entries, special.map_entry_count).to_vec())
                    .unwrap_or_default(),
                data: special
                    .map(|special| slice(special.p_data.cast::<u8>(), special.data_size as u32).to_vec())
                    .unwrap_or_default(),
            })
        }
    }

    /// The creation info of its module.
    fn module(&self) -> vk::ShaderModuleCreateInfo<'_> {
        vk::ShaderModuleCreateInfo::default().code(self.words.as_deref().unwrap_or_default())
    }

    fn specialization(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.constants).data(&self.data)
    }
}

/// The state of the part of the fragment shader.
struct Fragment {
    shader: Option<Shader>,
    depth_stencil: Option<vk::PipelineDepthStencilStateCreateInfo<'static>>,
}

/// The state of the fragment output interface.
struct Output {
    blend: Option<vk::PipelineColorBlendStateCreateInfo<'static>>,
    attachments: Vec<vk::PipelineColorBlendAttachmentState>,
    multisample: Option<vk::PipelineMultisampleStateCreateInfo<'static>>,
    sample_mask: Vec<vk::SampleMask>,
    formats: Vec<vk::Format>,
    depth_format: vk::Format,
    stencil_format: vk::Format,
}

/// A pipeline library: the parts that it has. Structures in it name nothing of the application's.
#[derive(Clone, Default)]
pub(crate) struct Library {
    input: Option<Arc<Input>>,
    pre_rasterization: Option<Arc<PreRasterization>>,
    fragment: Option<Arc<Fragment>>,
    output: Option<Arc<Output>>,
    dynamic: Vec<vk::DynamicState>,
    render_pass: vk::RenderPass,
    subpass: u32,
}

/// The libraries that a pipeline is linked from.
///
/// # Safety
/// The creation info is valid.
pub(crate) unsafe fn linked<'a>(info: &vk::GraphicsPipelineCreateInfo<'a>) -> &'a [vk::Pipeline] {
    // SAFETY: the caller's promise.
    unsafe {
        let libraries = find::<vk::PipelineLibraryCreateInfoKHR<'_>>(info.p_next);
        libraries.map(|all| slice(all.p_libraries, all.library_count)).unwrap_or_default()
    }
}

impl Input {
    /// # Safety
    /// The creation info is valid; here and below.
    unsafe fn new(info: &vk::GraphicsPipelineCreateInfo<'_>) -> Self {
        // SAFETY: the caller's promise.
        unsafe {
            let assembly = info.p_input_assembly_state.as_ref();
            let mut own = Self {
                topology: assembly.map_or(vk::PrimitiveTopology::POINT_LIST, |assembly| assembly.topology),
                bindings: Vec::new(),
                attributes: Vec::new(),
                divisors: Vec::new(),
            };
            if let Some(input) = info.p_vertex_input_state.as_ref() {
                own.bindings =
                    slice(input.p_vertex_binding_descriptions, input.vertex_binding_description_count).to_vec();
                own.attributes =
                    slice(input.p_vertex_attribute_descriptions, input.vertex_attribute_description_count).to_vec();
                if let Some(all) = find::<vk::PipelineVertexInputDivisorStateCreateInfoKHR<'_>>(input.p_next) {
                    own.divisors = slice(all.p_vertex_binding_divisors, all.vertex_binding_divisor_count).to_vec();
                }
            }
            own
        }
    }
}

impl PreRasterization {
    unsafe fn new(info: &vk::GraphicsPipelineCreateInfo<'_>, shaders: &Shaders) -> Self {
        use std::marker::PhantomData;
        use std::ptr::null;
        // SAFETY: the caller's promise.
        unsafe {
            let viewports = info.p_viewport_state.as_ref();
            let rendering = find::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next);
            let state = find::<State<'_>>(info.p_next);
            let footprint = find::<Footprint<'_>>(info.p_next);
            let sigma_points = find::<SigmaPoints<'_>>(info.p_next);
            let clip =
                viewports.and_then(|state| find::<vk::PipelineViewportDepthClipControlCreateInfoEXT<'_>>(state.p_next));
            Self {
                state: state.map(|state| State { p_next: null(), _marker: PhantomData, ..*state }),
                footprint: footprint.map(|state| Footprint { p_next: null(), _marker: PhantomData, ..*state }),
                sigma_points: sigma_points.map(|state| SigmaPoints { p_next: null(), _marker: PhantomData, ..*state }),
                vertex: Shader::of(info, vk::ShaderStageFlags::VERTEX, shaders),
                viewport: viewports.and_then(|state| state.p_viewports.as_ref()).copied(),
                scissor: viewports.and_then(|state| state.p_scissors.as_ref()).copied(),
                is_negative_one_to_one: clip.is_some_and(|clip| clip.negative_one_to_one != vk::FALSE),
                layout: info.layout,
                view_mask: rendering.map_or(0, |rendering| rendering.view_mask),
            }
        }
    }
}

impl Fragment {
    unsafe fn new(info: &vk::GraphicsPipelineCreateInfo<'_>, shaders: &Shaders) -> Self {
        use std::marker::PhantomData;
        use std::ptr::null;
        // SAFETY: the caller's promise.
        unsafe {
            let state = info.p_depth_stencil_state.as_ref();
            Self {
                shader: Shader::of(info, vk::ShaderStageFlags::FRAGMENT, shaders),
                depth_stencil: state.map(|state| vk::PipelineDepthStencilStateCreateInfo {
                    p_next: null(),
                    _marker: PhantomData,
                    ..*state
                }),
            }
        }
    }
}

impl Output {
    unsafe fn new(info: &vk::GraphicsPipelineCreateInfo<'_>) -> Self {
        use std::marker::PhantomData;
        use std::ptr::null;
        // SAFETY: the caller's promise.
        unsafe {
            let blend = info.p_color_blend_state.as_ref();
            let multisample = info.p_multisample_state.as_ref();
            let rendering = find::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next);
            let attachments = blend.map(|blend| slice(blend.p_attachments, blend.attachment_count));
            let mask = multisample.map(|state| {
                let words = state.rasterization_samples.as_raw().div_ceil(32);
                slice(state.p_sample_mask, if state.p_sample_mask.is_null() { 0 } else { words })
            });
            let formats = rendering.map(|all| slice(all.p_color_attachment_formats, all.color_attachment_count));
            Self {
                blend: blend.map(|state| vk::PipelineColorBlendStateCreateInfo {
                    p_next: null(),
                    p_attachments: null(),
                    _marker: PhantomData,
                    ..*state
                }),
                attachments: attachments.unwrap_or_default().to_vec(),
                multisample: multisample.map(|state| vk::PipelineMultisampleStateCreateInfo {
                    p_next: null(),
                    p_sample_mask: null(),
                    _marker: PhantomData,
                    ..*state
                }),
                sample_mask: mask.unwrap_or_default().to_vec(),
                formats: formats.unwrap_or_default().to_vec(),
                depth_format: rendering.map_or(vk::Format::UNDEFINED, |all| all.depth_attachment_format),
                stencil_format: rendering.map_or(vk::Format::UNDEFINED, |all| all.stencil_attachment_format),
            }
        }
    }
}

impl Library {
    /// The parts that a creation info has, beside those of the libraries that it links.
    ///
    /// # Safety
    /// The creation info is valid.
    pub(crate) unsafe fn new(
        info: &vk::GraphicsPipelineCreateInfo<'_>,
        libraries: &[Arc<Self>],
        shaders: &Shaders,
    ) -> Self {
        let mut own = Self { render_pass: info.render_pass, subpass: info.subpass, ..Self::default() };
        for library in libraries {
            let Self { input, pre_rasterization, fragment, output, dynamic, render_pass, subpass } =
                (**library).clone();
            own.input = own.input.or(input);
            own.pre_rasterization = own.pre_rasterization.or(pre_rasterization);
            own.fragment = own.fragment.or(fragment);
            own.output = own.output.or(output);
            own.dynamic.extend(dynamic);
            if own.render_pass == vk::RenderPass::null() {
                (own.render_pass, own.subpass) = (render_pass, subpass);
            }
        }
        // SAFETY: the caller's promise.
        unsafe {
            let parts = find::<vk::GraphicsPipelineLibraryCreateInfoEXT<'_>>(info.p_next).map(|parts| parts.flags);
            let parts = parts.unwrap_or(if libraries.is_empty() { !Parts::empty() } else { Parts::empty() });
            if parts.contains(Parts::VERTEX_INPUT_INTERFACE) {
                own.input = Some(Arc::new(Input::new(info)));
            }
            if parts.contains(Parts::PRE_RASTERIZATION_SHADERS) {
                own.pre_rasterization = Some(Arc::new(PreRasterization::new(info, shaders)));
            }
            if parts.contains(Parts::FRAGMENT_SHADER) {
                own.fragment = Some(Arc::new(Fragment::new(info, shaders)));
            }
            if parts.contains(Parts::FRAGMENT_OUTPUT_INTERFACE) {
                own.output = Some(Arc::new(Output::new(info)));
            }
            if let Some(dynamic) = info.p_dynamic_state.as_ref() {
                own.dynamic.extend_from_slice(slice(dynamic.p_dynamic_states, dynamic.dynamic_state_count));
            }
        }
        own
    }

    /// Reports whether a part is of Gaussians alone.
    pub(crate) fn is_gaussian(&self) -> bool {
        let input = self.input.as_ref();
        let has_topology = input.is_some_and(|input| input.topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        has_topology
            || self.pre_rasterization.as_ref().is_some_and(|part| part.state.is_some() && part.vertex.is_none())
    }

    /// Calls a function with the creation info of the pipeline that the parts make, and its state of Gaussians. `None` where it has
    /// none.
    pub(crate) fn with_info<R>(
        &self,
        flags: vk::PipelineCreateFlags,
        layout: vk::PipelineLayout,
        create: impl FnOnce(&vk::GraphicsPipelineCreateInfo<'_>, &State<'_>) -> R,
    ) -> Option<R> {
        let (Some(input), Some(shaders)) = (&self.input, &self.pre_rasterization) else {
            return None;
        };
        let state = shaders.state.as_ref().filter(|_| input.topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST)?;
        let mut divisors =
            vk::PipelineVertexInputDivisorStateCreateInfoKHR::default().vertex_binding_divisors(&input.divisors);
        let mut vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&input.bindings)
            .vertex_attribute_descriptions(&input.attributes);
        if !input.divisors.is_empty() {
            vertex_input = vertex_input.push_next(&mut divisors);
        }
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(input.topology);
        let fragment = self.fragment.as_ref().and_then(|part| part.shader.as_ref());
        let both: Vec<&Shader> = shaders.vertex.iter().chain(fragment).collect();
        let mut modules: Vec<_> = both.iter().map(|shader| shader.module()).collect();
        let constants: Vec<_> = both.iter().map(|shader| shader.specialization()).collect();
        let stages: Vec<_> = both
            .iter()
            .zip(&mut modules)
            .zip(&constants)
            .map(|((shader, module), constants)| {
                let stage = vk::PipelineShaderStageCreateInfo::default()
                    .flags(shader.flags)
                    .stage(shader.stage)
                    .name(&shader.name)
                    .specialization_info(constants);
                if shader.words.is_some() { stage.push_next(module) } else { stage }
            })
            .collect();
        let clip = vk::PipelineViewportDepthClipControlCreateInfoEXT::default()
            .negative_one_to_one(shaders.is_negative_one_to_one);
        let viewports = vk::PipelineViewportStateCreateInfo {
            p_next: (&raw const clip).cast(),
            p_viewports: shaders.viewport.as_ref().map_or(std::ptr::null(), std::ptr::from_ref),
            p_scissors: shaders.scissor.as_ref().map_or(std::ptr::null(), std::ptr::from_ref),
            ..Default::default()
        };
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&self.dynamic);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().view_mask(shaders.view_mask);
        let mut blend = None;
        let mut multisample = None;
        if let Some(output) = &self.output {
            rendering = rendering
                .color_attachment_formats(&output.formats)
                .depth_attachment_format(output.depth_format)
                .stencil_attachment_format(output.stencil_format);
            blend = output.blend.map(|blend| blend.attachments(&output.attachments));
            multisample = output.multisample;
            if let (Some(state), false) = (&mut multisample, output.sample_mask.is_empty()) {
                state.p_sample_mask = output.sample_mask.as_ptr();
            }
        }
        let mut footprint = shaders.footprint;
        let mut sigma_points = shaders.sigma_points;
        let layout = if layout == vk::PipelineLayout::null() { shaders.layout } else { layout };
        let linking = vk::PipelineCreateFlags::LIBRARY_KHR
            | vk::PipelineCreateFlags::LINK_TIME_OPTIMIZATION_EXT
            | vk::PipelineCreateFlags::RETAIN_LINK_TIME_OPTIMIZATION_INFO_EXT;
        let mut info = vk::GraphicsPipelineCreateInfo::default()
            .flags(flags & !linking)
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewports)
            .dynamic_state(&dynamic)
            .layout(layout)
            .render_pass(self.render_pass)
            .subpass(self.subpass)
            .push_next(&mut rendering);
        if let Some(footprint) = &mut footprint {
            info = info.push_next(footprint);
        }
        if let Some(sigma_points) = &mut sigma_points {
            info = info.push_next(sigma_points);
        }
        info.p_color_blend_state = blend.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
        info.p_multisample_state = multisample.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
        let depth_stencil = self.fragment.as_ref().and_then(|part| part.depth_stencil.as_ref());
        info.p_depth_stencil_state = depth_stencil.map_or(std::ptr::null(), std::ptr::from_ref);
        Some(create(&info, state))
    }
}

/// Creates a library without anything, whose handle stands for one of Gaussians.
///
/// # Safety
/// The device lives.
pub(crate) unsafe fn empty(
    next: &Next,
    allocator: Option<&vk::AllocationCallbacks<'_>>,
) -> Result<vk::Pipeline, vk::Result> {
    let blend = vk::PipelineColorBlendStateCreateInfo::default();
    let multisample =
        vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let mut parts = vk::GraphicsPipelineLibraryCreateInfoEXT::default().flags(Parts::FRAGMENT_OUTPUT_INTERFACE);
    let mut rendering = vk::PipelineRenderingCreateInfo::default();
    let info = vk::GraphicsPipelineCreateInfo::default()
        .flags(vk::PipelineCreateFlags::LIBRARY_KHR)
        .color_blend_state(&blend)
        .multisample_state(&multisample)
        .push_next(&mut parts)
        .push_next(&mut rendering);
    // SAFETY: the caller's promise.
    match unsafe { next.create_graphics_pipelines(vk::PipelineCache::null(), &[info], allocator) } {
        Ok(created) => created.first().copied().ok_or(vk::Result::ERROR_UNKNOWN),
        Err((_, error)) => Err(error),
    }
}
