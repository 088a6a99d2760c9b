//! A graphics pipeline that is created, as a copy that may be changed.

use ash::vk;
use ash::vk::TaggedStructure;
use gaurast::vk::{
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PipelineGaussianApproximationStateCreateInfoGAURAST as Approximation,
    PipelineGaussianDecodingStateCreateInfoGAURAST as Decoding,
    PipelineGaussianFootprintStateCreateInfoGAURAST as Footprint, PipelineGaussianStateCreateInfoGAURAST as State,
    PipelineGaussianUnscentedStateCreateInfoGAURAST as Unscented,
};

use gaurast_layer_interface::slice;

/// The copy. Its parts are joined by [`Request::join`].
#[derive(Default)]
pub(crate) struct Request {
    pub(crate) info: vk::GraphicsPipelineCreateInfo<'static>,
    pub(crate) stages: Vec<vk::PipelineShaderStageCreateInfo<'static>>,
    vertex_input: Option<vk::PipelineVertexInputStateCreateInfo<'static>>,
    pub(crate) bindings: Vec<vk::VertexInputBindingDescription>,
    pub(crate) attributes: Vec<vk::VertexInputAttributeDescription>,
    topology: Option<vk::PrimitiveTopology>,
    pub(crate) multisample: Option<vk::PipelineMultisampleStateCreateInfo<'static>>,
    pub(crate) sample_mask: Option<vk::SampleMask>,
    pub(crate) depth_stencil: Option<vk::PipelineDepthStencilStateCreateInfo<'static>>,
    pub(crate) color_blend: Option<vk::PipelineColorBlendStateCreateInfo<'static>>,
    pub(crate) blends: Vec<vk::PipelineColorBlendAttachmentState>,
    dynamic: Option<vk::PipelineDynamicStateCreateInfo<'static>>,
    pub(crate) dynamic_states: Vec<vk::DynamicState>,
    pub(crate) gaussian: Option<State<'static>>,
    pub(crate) approximation: Option<Approximation<'static>>,
    pub(crate) footprint: Option<Footprint<'static>>,
    pub(crate) unscented: Option<Unscented<'static>>,
    pub(crate) decoding: Option<Decoding<'static>>,
    rendering: Option<vk::PipelineRenderingCreateInfo<'static>>,
    pub(crate) parts: Option<vk::GraphicsPipelineLibraryCreateInfoEXT<'static>>,
    pub(crate) libraries: Option<vk::PipelineLibraryCreateInfoKHR<'static>>,
}

/// A copy of a structure whose chain stays the application's.
///
/// # Safety
/// The pointer is null or points at a structure that lives until the command returns, as the copy does.
unsafe fn copy<T: Copy>(from: *const T) -> Option<T> {
    // SAFETY: the caller's promise.
    unsafe { from.as_ref() }.copied()
}

impl Request {
    /// Copies what the application has passed.
    ///
    /// # Safety
    /// The creation info is valid, and outlives the copy.
    pub(crate) unsafe fn of(info: &vk::GraphicsPipelineCreateInfo<'_>) -> Self {
        let mut request = Self::default();
        // SAFETY: the caller's promise; lifetimes of the copies end with the command.
        unsafe {
            request.info = *std::ptr::from_ref(info).cast();
            request.stages = slice(request.info.p_stages, info.stage_count).to_vec();
            request.vertex_input = copy(request.info.p_vertex_input_state);
            if let Some(input) = &request.vertex_input {
                let (bindings, attributes) =
                    (input.p_vertex_binding_descriptions, input.p_vertex_attribute_descriptions);
                request.bindings = slice(bindings, input.vertex_binding_description_count).to_vec();
                request.attributes = slice(attributes, input.vertex_attribute_description_count).to_vec();
            }
            request.topology = copy(request.info.p_input_assembly_state).map(|assembly| assembly.topology);
            request.multisample = copy(request.info.p_multisample_state);
            request.sample_mask = request.multisample.and_then(|state| copy(state.p_sample_mask));
            request.depth_stencil = copy(request.info.p_depth_stencil_state);
            request.color_blend = copy(request.info.p_color_blend_state);
            if let Some(blend) = &request.color_blend {
                request.blends = slice(blend.p_attachments, blend.attachment_count).to_vec();
            }
            request.dynamic = copy(request.info.p_dynamic_state);
            if let Some(dynamic) = &request.dynamic {
                request.dynamic_states = slice(dynamic.p_dynamic_states, dynamic.dynamic_state_count).to_vec();
            }
            request.copy_chain();
        }
        request
    }

    /// # Safety
    /// As [`Self::of`].
    unsafe fn copy_chain(&mut self) {
        let mut structure = self.info.p_next.cast::<vk::BaseInStructure<'static>>();
        // SAFETY: the caller's promise: every structure of the chain begins with its type and the next one's address,
        // and is what its type says.
        unsafe {
            while let Some(found) = structure.as_ref() {
                match found.s_type {
                    State::STRUCTURE_TYPE => self.gaussian = copy(structure.cast()),
                    Approximation::STRUCTURE_TYPE => self.approximation = copy(structure.cast()),
                    Footprint::STRUCTURE_TYPE => self.footprint = copy(structure.cast()),
                    Unscented::STRUCTURE_TYPE => self.unscented = copy(structure.cast()),
                    Decoding::STRUCTURE_TYPE => self.decoding = copy(structure.cast()),
                    vk::PipelineRenderingCreateInfo::STRUCTURE_TYPE => self.rendering = copy(structure.cast()),
                    vk::GraphicsPipelineLibraryCreateInfoEXT::STRUCTURE_TYPE => self.parts = copy(structure.cast()),
                    vk::PipelineLibraryCreateInfoKHR::STRUCTURE_TYPE => self.libraries = copy(structure.cast()),
                    other => eprintln!("VK_LAYER_GAURAST_mutants: a structure of a pipeline is dropped: {other:?}"),
                }
                structure = found.p_next;
            }
        }
    }

    /// Reports whether the pipeline draws Gaussians, or is a part of one that does.
    pub(crate) fn is_gaussian(&self) -> bool {
        self.topology == Some(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST) || self.gaussian.is_some()
    }

    /// Reports whether the pipeline has a fragment stage.
    pub(crate) fn has_fragment_stage(&self) -> bool {
        self.stages.iter().any(|stage| stage.stage == vk::ShaderStageFlags::FRAGMENT)
    }

    /// Reports whether a state is dynamic.
    pub(crate) fn is_dynamic(&self, state: vk::DynamicState) -> bool {
        self.dynamic_states.contains(&state)
    }

    /// Joins the parts; the result is valid as long as they do not move.
    pub(crate) fn join(&mut self) -> vk::GraphicsPipelineCreateInfo<'static> {
        let info = &mut self.info;
        info.p_stages = self.stages.as_ptr();
        if let Some(input) = &mut self.vertex_input {
            input.p_vertex_binding_descriptions = self.bindings.as_ptr();
            input.vertex_binding_description_count = self.bindings.len() as u32;
            input.p_vertex_attribute_descriptions = self.attributes.as_ptr();
            info.p_vertex_input_state = input;
        }
        if let Some(multisample) = &mut self.multisample {
            multisample.p_sample_mask = self.sample_mask.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
            info.p_multisample_state = multisample;
        }
        if let Some(depth_stencil) = &self.depth_stencil {
            info.p_depth_stencil_state = depth_stencil;
        }
        if let Some(blend) = &mut self.color_blend {
            blend.p_attachments = self.blends.as_ptr();
            info.p_color_blend_state = blend;
        }
        if let Some(dynamic) = &mut self.dynamic {
            dynamic.p_dynamic_states = self.dynamic_states.as_ptr();
            dynamic.dynamic_state_count = self.dynamic_states.len() as u32;
            info.p_dynamic_state = dynamic;
        }
        info.p_next = std::ptr::null();
        macro_rules! chain {
            ($($part:ident),*) => {
                $(if let Some(structure) = &mut self.$part {
                    structure.p_next = info.p_next;
                    info.p_next = std::ptr::from_ref(structure).cast();
                })*
            };
        }
        chain!(gaussian, approximation, footprint, unscented, decoding, rendering, parts, libraries);
        *info
    }
}
