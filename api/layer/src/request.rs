//! The creation of a graphics pipeline, as far as the rules look at it.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use ash::vk;
use ash::vk::GraphicsPipelineLibraryFlagsEXT as Parts;
use gaurast::vk::{
    GaussianCutOffGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianDecodingStateCreateInfoGAURAST,
    PipelineGaussianFootprintStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
    PipelineGaussianUnscentedStateCreateInfoGAURAST,
};

use crate::facts::{Decoding, GaussianState};
use crate::objects::{Attribute, DepthTest, Layout, Objects, Subpass, VertexBinding};
use crate::spirv::reads_constants;
use gaurast_layer_interface::{find, slice, string};

/// A stage: which one, its SPIR-V if that is known, and the name of its entry point.
#[derive(Clone)]
pub(crate) struct Stage {
    pub(crate) stage: vk::ShaderStageFlags,
    pub(crate) words: Option<Arc<Vec<u32>>>,
    pub(crate) entry: Vec<u8>,
}

/// The footprint state, or its defaults.
#[derive(Clone, Copy)]
pub(crate) struct Footprint {
    pub(crate) cut_off: GaussianCutOffGAURAST,
    pub(crate) cut_off_deviations: f32,
    pub(crate) compensation_floor: f32,
}

/// The state of sigma points.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct SigmaPoints {
    pub(crate) alpha: f32,
    pub(crate) beta: f32,
    pub(crate) kappa: f32,
    pub(crate) picture_margin: f32,
    pub(crate) all: bool,
}

impl SigmaPoints {
    fn of(state: &PipelineGaussianUnscentedStateCreateInfoGAURAST<'_>) -> Self {
        Self {
            alpha: state.alpha,
            beta: state.beta,
            kappa: state.kappa,
            picture_margin: state.picture_margin,
            all: state.all_sigma_points != 0,
        }
    }

    /// Reports whether they are those of pipelines without the structure.
    pub(crate) fn are_default(&self) -> bool {
        *self == Self::of(&PipelineGaussianUnscentedStateCreateInfoGAURAST::default())
    }
}

/// Pipeline libraries, by their handles.
pub(crate) type Libraries = HashMap<vk::Pipeline, Arc<Request>>;

/// The parameters of a graphics pipeline's creation, those of the libraries that it is linked from included.
#[derive(Clone)]
pub(crate) struct Request {
    /// The parts of the state that are known.
    pub(crate) parts: Parts,
    /// True if it makes a library.
    pub(crate) is_library: bool,
    /// Something is wrong with a library, which was said.
    pub(crate) is_wrong: bool,
    pub(crate) draws_gaussians: bool,
    pub(crate) restart: bool,
    pub(crate) gaussian: Option<GaussianState>,
    pub(crate) approximation: Option<[f32; 2]>,
    pub(crate) footprint: Option<Footprint>,
    pub(crate) sigma_points: Option<SigmaPoints>,
    pub(crate) decoding: Option<Decoding>,
    pub(crate) stages: Vec<Stage>,
    /// By binding and by location; `None` where the vertex input is dynamic.
    pub(crate) vertex_input: Option<(BTreeMap<u32, VertexBinding>, BTreeMap<u32, Attribute>)>,
    pub(crate) subpass: Subpass,
    pub(crate) blend: Vec<vk::PipelineColorBlendAttachmentState>,
    pub(crate) has_logic_op: bool,
    pub(crate) cull_mode: vk::CullModeFlags,
    pub(crate) polygon_mode: vk::PolygonMode,
    pub(crate) discards: bool,
    /// Depths, depth bounds or stencils are tested.
    pub(crate) tests_depth: bool,
    pub(crate) depth: DepthTest,
    pub(crate) samples: vk::SampleCountFlags,
    pub(crate) viewport_count: u32,
    pub(crate) viewport: Option<[f32; 4]>,
    pub(crate) depth_range: Option<[f32; 2]>,
    pub(crate) dynamic: Vec<vk::DynamicState>,
    pub(crate) layout: Option<Arc<Layout>>,
}

impl Request {
    /// The creation of nothing yet.
    fn new(is_library: bool, dynamic: Vec<vk::DynamicState>) -> Self {
        Self {
            parts: Parts::empty(),
            is_library,
            is_wrong: false,
            draws_gaussians: false,
            restart: false,
            gaussian: None,
            approximation: None,
            footprint: None,
            sigma_points: None,
            decoding: None,
            stages: Vec::new(),
            vertex_input: None,
            subpass: Subpass::default(),
            blend: Vec::new(),
            has_logic_op: false,
            cull_mode: vk::CullModeFlags::empty(),
            polygon_mode: vk::PolygonMode::FILL,
            discards: false,
            tests_depth: false,
            depth: DepthTest::default(),
            samples: vk::SampleCountFlags::TYPE_1,
            viewport_count: 1,
            viewport: None,
            depth_range: None,
            dynamic,
            layout: None,
        }
    }

    /// Reads a creation info, and links it with the libraries that it names.
    ///
    /// # Safety
    /// The creation info is valid.
    pub(crate) unsafe fn read(
        info: &vk::GraphicsPipelineCreateInfo<'_>,
        objects: &Objects,
        libraries: &Libraries,
    ) -> Self {
        // SAFETY: pointers of a valid creation info are null, or valid with their counts, in the parts that it has.
        unsafe {
            let linked = find::<vk::PipelineLibraryCreateInfoKHR<'_>>(info.p_next);
            let linked = linked.map(|info| slice(info.p_libraries, info.library_count)).unwrap_or_default();
            let further = find::<vk::PipelineCreateFlags2CreateInfoKHR<'_>>(info.p_next);
            let is_library = match further {
                Some(further) => further.flags.as_raw() & u64::from(vk::PipelineCreateFlags::LIBRARY_KHR.as_raw()) != 0,
                None => info.flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR),
            };
            let named = find::<vk::GraphicsPipelineLibraryCreateInfoEXT<'_>>(info.p_next);
            let own = match named {
                Some(named) => named.flags,
                None if is_library || !linked.is_empty() => Parts::empty(),
                None => all_parts(),
            };
            let dynamic = info.p_dynamic_state.as_ref();
            let dynamic = dynamic.map(|state| slice(state.p_dynamic_states, state.dynamic_state_count));
            let mut request = Self::new(is_library, dynamic.unwrap_or_default().to_vec());
            request.parts = own;
            request.layout = objects.layouts.get(&info.layout).cloned();
            request.subpass = read_subpass(info, objects);
            if own.contains(Parts::VERTEX_INPUT_INTERFACE) {
                request.read_vertex_interface(info);
            }
            if own.contains(Parts::PRE_RASTERIZATION_SHADERS) {
                request.read_pre_rasterization(info);
            }
            if own.contains(Parts::FRAGMENT_SHADER) {
                request.read_depth(info);
            }
            if own.contains(Parts::FRAGMENT_OUTPUT_INTERFACE) {
                request.read_output(info);
            }
            if own.intersects(Parts::PRE_RASTERIZATION_SHADERS | Parts::FRAGMENT_SHADER) {
                let stages = slice(info.p_stages, info.stage_count).iter();
                let stages = stages.filter(|stage| own.contains(part_of(stage.stage)));
                request.stages = stages.map(|stage| read_stage(stage, objects)).collect();
            }
            for library in linked.iter().filter_map(|library| libraries.get(library)) {
                request.link(library);
            }
            request.depth.is_there = request.subpass.depth != vk::Format::UNDEFINED;
            request
        }
    }

    /// # Safety
    /// The creation info is valid, and has the part.
    unsafe fn read_vertex_interface(&mut self, info: &vk::GraphicsPipelineCreateInfo<'_>) {
        // SAFETY: the caller's promise.
        unsafe {
            let assembly = info.p_input_assembly_state.as_ref();
            self.draws_gaussians =
                assembly.is_some_and(|state| state.topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
            self.restart = assembly.is_some_and(|state| state.primitive_restart_enable != 0);
            self.vertex_input = (!self.is_dynamic(vk::DynamicState::VERTEX_INPUT_EXT))
                .then(|| read_vertex_input(info.p_vertex_input_state.as_ref()));
        }
    }

    /// # Safety
    /// The creation info is valid, and has the part.
    unsafe fn read_pre_rasterization(&mut self, info: &vk::GraphicsPipelineCreateInfo<'_>) {
        // SAFETY: the caller's promise.
        unsafe {
            let approximation = find::<PipelineGaussianApproximationStateCreateInfoGAURAST<'_>>(info.p_next);
            let footprint = find::<PipelineGaussianFootprintStateCreateInfoGAURAST<'_>>(info.p_next);
            let sigma_points = find::<PipelineGaussianUnscentedStateCreateInfoGAURAST<'_>>(info.p_next);
            let gaussian = find::<PipelineGaussianStateCreateInfoGAURAST<'_>>(info.p_next);
            self.gaussian = gaussian.map(GaussianState::of);
            self.approximation = approximation.map(|numbers| [numbers.exponential_error, numbers.contribution_budget]);
            self.footprint = footprint.map(|state| Footprint {
                cut_off: state.cut_off,
                cut_off_deviations: state.cut_off_deviations,
                compensation_floor: state.compensation_floor,
            });
            self.sigma_points = sigma_points.map(SigmaPoints::of);
            let decoding = find::<PipelineGaussianDecodingStateCreateInfoGAURAST<'_>>(info.p_next);
            self.decoding = decoding.map(Decoding::of);
            if let Some(raster) = info.p_rasterization_state.as_ref() {
                self.cull_mode = raster.cull_mode;
                self.polygon_mode = raster.polygon_mode;
                self.discards = raster.rasterizer_discard_enable != 0;
            }
            let Some(state) = info.p_viewport_state.as_ref() else {
                return;
            };
            let control = find::<vk::PipelineViewportDepthClipControlCreateInfoEXT<'_>>(state.p_next);
            self.depth.from_minus_one = control.is_some_and(|control| control.negative_one_to_one != 0);
            if self.is_dynamic(vk::DynamicState::VIEWPORT_WITH_COUNT) {
                return;
            }
            self.viewport_count = state.viewport_count;
            if !self.is_dynamic(vk::DynamicState::VIEWPORT) && state.viewport_count > 0 {
                let viewport = state.p_viewports.as_ref();
                self.viewport = viewport.map(|v| [v.x, v.y, v.width, v.height]);
                self.depth_range = viewport.map(|v| [v.min_depth, v.max_depth]);
            }
        }
    }

    /// # Safety
    /// The creation info is valid, and has the part.
    unsafe fn read_depth(&mut self, info: &vk::GraphicsPipelineCreateInfo<'_>) {
        // Without a depth attachment the pointer may be any, if the pass is known here.
        let is_whole = self.parts.contains(Parts::FRAGMENT_OUTPUT_INTERFACE);
        if is_whole && self.subpass.depth == vk::Format::UNDEFINED {
            return;
        }
        // SAFETY: the caller's promise.
        let Some(state) = (unsafe { info.p_depth_stencil_state.as_ref() }) else {
            return;
        };
        self.tests_depth =
            state.depth_test_enable != 0 || state.depth_bounds_test_enable != 0 || state.stencil_test_enable != 0;
        self.depth.is_enabled = state.depth_test_enable != 0;
        self.depth.writes = state.depth_write_enable != 0;
        self.depth.op = state.depth_compare_op;
    }

    /// # Safety
    /// The creation info is valid, and has the part.
    unsafe fn read_output(&mut self, info: &vk::GraphicsPipelineCreateInfo<'_>) {
        // SAFETY: the caller's promise.
        unsafe {
            if let Some(blend) = info.p_color_blend_state.as_ref() {
                self.blend = slice(blend.p_attachments, blend.attachment_count).to_vec();
                self.has_logic_op = blend.logic_op_enable != 0;
            }
            if let Some(multisample) = info.p_multisample_state.as_ref() {
                self.samples = multisample.rasterization_samples;
            }
        }
    }

    /// Takes over a library's parts.
    fn link(&mut self, library: &Self) {
        let has = |part: Parts| library.parts.contains(part);
        let mut stages = library.stages.clone();
        stages.retain(|stage| has(part_of(stage.stage)));
        self.stages.append(&mut stages);
        if has(Parts::VERTEX_INPUT_INTERFACE) {
            self.draws_gaussians = library.draws_gaussians;
            self.restart = library.restart;
            self.vertex_input.clone_from(&library.vertex_input);
        }
        if has(Parts::PRE_RASTERIZATION_SHADERS) {
            self.gaussian = library.gaussian;
            self.approximation = library.approximation;
            self.footprint = library.footprint;
            self.sigma_points = library.sigma_points;
            self.decoding = library.decoding;
            self.cull_mode = library.cull_mode;
            self.polygon_mode = library.polygon_mode;
            self.discards = library.discards;
            self.viewport_count = library.viewport_count;
            self.viewport = library.viewport;
            self.depth_range = library.depth_range;
            self.depth.from_minus_one = library.depth.from_minus_one;
            self.subpass.view_mask = library.subpass.view_mask;
        }
        if has(Parts::FRAGMENT_SHADER) {
            self.tests_depth = library.tests_depth;
            self.depth = DepthTest { from_minus_one: self.depth.from_minus_one, ..library.depth };
        }
        if has(Parts::FRAGMENT_OUTPUT_INTERFACE) {
            self.blend.clone_from(&library.blend);
            self.has_logic_op = library.has_logic_op;
            self.samples = library.samples;
            self.subpass = Subpass { view_mask: self.subpass.view_mask, ..library.subpass.clone() };
        }
        self.parts |= library.parts;
        self.is_wrong |= library.is_wrong;
        self.dynamic.extend_from_slice(&library.dynamic);
        let own_layout = self.layout.take();
        self.layout = own_layout.or_else(|| library.layout.clone());
    }

    /// Reports whether a pipeline has all of its state, and draws.
    pub(crate) fn is_whole(&self) -> bool {
        self.parts.contains(all_parts()) && !self.is_library
    }

    /// The stages whose shaders read push constants.
    pub(crate) fn reads_constants(&self) -> vk::ShaderStageFlags {
        let reading =
            self.stages.iter().filter(|stage| stage.words.as_ref().is_some_and(|words| reads_constants(words)));
        reading.fold(vk::ShaderStageFlags::empty(), |stages, stage| stages | stage.stage)
    }

    /// Reports whether a stage is there.
    pub(crate) fn has(&self, stages: vk::ShaderStageFlags) -> bool {
        self.stages.iter().any(|stage| stages.intersects(stage.stage))
    }

    /// Reports whether a state is dynamic.
    pub(crate) fn is_dynamic(&self, state: vk::DynamicState) -> bool {
        self.dynamic.contains(&state)
    }
}

/// All parts of a graphics pipeline.
fn all_parts() -> Parts {
    Parts::VERTEX_INPUT_INTERFACE
        | Parts::PRE_RASTERIZATION_SHADERS
        | Parts::FRAGMENT_SHADER
        | Parts::FRAGMENT_OUTPUT_INTERFACE
}

/// The part that has a stage.
fn part_of(stage: vk::ShaderStageFlags) -> Parts {
    match stage {
        vk::ShaderStageFlags::FRAGMENT => Parts::FRAGMENT_SHADER,
        _ => Parts::PRE_RASTERIZATION_SHADERS,
    }
}

/// # Safety
/// The stage is valid.
unsafe fn read_stage(stage: &vk::PipelineShaderStageCreateInfo<'_>, objects: &Objects) -> Stage {
    // SAFETY: the caller's promise.
    unsafe {
        let inline = find::<vk::ShaderModuleCreateInfo<'_>>(stage.p_next);
        let words = match objects.modules.get(&stage.module) {
            Some(words) => Some(Arc::clone(words)),
            None => inline.map(|info| {
                let count = u32::try_from(info.code_size / 4).unwrap_or(0);
                Arc::new(slice(info.p_code, count).to_vec())
            }),
        };
        Stage { stage: stage.stage, words, entry: string(stage.p_name).to_bytes().to_vec() }
    }
}

/// # Safety
/// The state is valid.
unsafe fn read_vertex_input(
    state: Option<&vk::PipelineVertexInputStateCreateInfo<'_>>,
) -> (BTreeMap<u32, VertexBinding>, BTreeMap<u32, Attribute>) {
    let Some(state) = state else {
        return Default::default();
    };
    // SAFETY: the caller's promise.
    unsafe {
        let divisors = find::<vk::PipelineVertexInputDivisorStateCreateInfoKHR<'_>>(state.p_next);
        let divisors = divisors
            .map(|info| slice(info.p_vertex_binding_divisors, info.vertex_binding_divisor_count))
            .unwrap_or_default();
        let bindings = slice(state.p_vertex_binding_descriptions, state.vertex_binding_description_count);
        let attributes = slice(state.p_vertex_attribute_descriptions, state.vertex_attribute_description_count);
        let binding = |b: &vk::VertexInputBindingDescription| {
            let divisor = divisors.iter().find(|divisor| divisor.binding == b.binding);
            let binding = VertexBinding {
                stride: b.stride,
                by_instance: b.input_rate == vk::VertexInputRate::INSTANCE,
                divisor: divisor.map_or(1, |divisor| divisor.divisor),
            };
            (b.binding, binding)
        };
        let attribute = |a: &vk::VertexInputAttributeDescription| {
            let attribute = Attribute { binding: a.binding, format: a.format, offset: a.offset };
            (a.location, attribute)
        };
        (bindings.iter().map(binding).collect(), attributes.iter().map(attribute).collect())
    }
}

/// # Safety
/// The creation info is valid.
unsafe fn read_subpass(info: &vk::GraphicsPipelineCreateInfo<'_>, objects: &Objects) -> Subpass {
    if info.render_pass != vk::RenderPass::null() {
        let subpasses = objects.render_passes.get(&info.render_pass);
        let subpass = subpasses.and_then(|all| all.get(info.subpass as usize));
        return subpass.cloned().unwrap_or_default();
    }
    // SAFETY: the caller's promise.
    unsafe {
        let Some(rendering) = find::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next) else {
            return Subpass::default();
        };
        let formats = slice(rendering.p_color_attachment_formats, rendering.color_attachment_count);
        let depth = if rendering.depth_attachment_format == vk::Format::UNDEFINED {
            rendering.stencil_attachment_format
        } else {
            rendering.depth_attachment_format
        };
        Subpass {
            view_mask: rendering.view_mask,
            colors: formats.iter().map(|&format| (format, false)).collect(),
            depth,
            cleared_depth: None,
        }
    }
}
