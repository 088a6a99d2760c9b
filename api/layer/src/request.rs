//! The creation of a graphics pipeline, as far as the rules look at it.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use gaurast::vk::{
    GaussianCutOffGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianFootprintStateCreateInfoGAURAST,
    PipelineGaussianStateCreateInfoGAURAST, PipelineGaussianUnscentedStateCreateInfoGAURAST,
};

use crate::facts::GaussianState;
use crate::objects::{Attribute, Layout, Objects, Subpass, VertexBinding};
use gaurast_layer_interface::{find, slice, string};

/// A stage: which one, its SPIR-V if that is known, and the name of its entry point.
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

/// The parameters of a graphics pipeline's creation.
pub(crate) struct Request {
    pub(crate) draws_gaussians: bool,
    pub(crate) restart: bool,
    pub(crate) gaussian: Option<GaussianState>,
    pub(crate) approximation: Option<[f32; 2]>,
    pub(crate) footprint: Option<Footprint>,
    pub(crate) sigma_points: Option<SigmaPoints>,
    pub(crate) stages: Vec<Stage>,
    /// By binding and by location; `None` where the vertex input is dynamic.
    pub(crate) vertex_input: Option<(BTreeMap<u32, VertexBinding>, BTreeMap<u32, Attribute>)>,
    pub(crate) subpass: Subpass,
    pub(crate) blend: Vec<vk::PipelineColorBlendAttachmentState>,
    pub(crate) has_logic_op: bool,
    pub(crate) cull_mode: vk::CullModeFlags,
    pub(crate) polygon_mode: vk::PolygonMode,
    pub(crate) discards: bool,
    pub(crate) tests_depth: bool,
    pub(crate) writes_depth: bool,
    pub(crate) samples: vk::SampleCountFlags,
    pub(crate) viewport_count: u32,
    pub(crate) viewport: Option<[f32; 4]>,
    pub(crate) dynamic: Vec<vk::DynamicState>,
    pub(crate) layout: Option<Arc<Layout>>,
}

impl Request {
    /// Reads a creation info. Pipeline libraries, of which each holds a part, give `None`.
    ///
    /// # Safety
    /// The creation info is valid.
    pub(crate) unsafe fn read(info: &vk::GraphicsPipelineCreateInfo<'_>, objects: &Objects) -> Option<Self> {
        // SAFETY: pointers of a valid creation info are null, or valid with their counts.
        unsafe {
            let library = find::<vk::PipelineLibraryCreateInfoKHR<'_>>(info.p_next);
            if library.is_some() || info.flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR) {
                return None;
            }
            let dynamic = info.p_dynamic_state.as_ref();
            let dynamic = dynamic.map(|state| slice(state.p_dynamic_states, state.dynamic_state_count));
            let dynamic = dynamic.unwrap_or_default().to_vec();
            let assembly = info.p_input_assembly_state.as_ref();
            let raster = info.p_rasterization_state.as_ref();
            let multisample = info.p_multisample_state.as_ref();
            let depth = info.p_depth_stencil_state.as_ref();
            let viewport = info.p_viewport_state.as_ref();
            let blend = info.p_color_blend_state.as_ref();
            let approximation = find::<PipelineGaussianApproximationStateCreateInfoGAURAST<'_>>(info.p_next);
            let footprint = find::<PipelineGaussianFootprintStateCreateInfoGAURAST<'_>>(info.p_next);
            let sigma_points = find::<PipelineGaussianUnscentedStateCreateInfoGAURAST<'_>>(info.p_next);
            let gaussian = find::<PipelineGaussianStateCreateInfoGAURAST<'_>>(info.p_next);
            let stages = slice(info.p_stages, info.stage_count);
            let is_dynamic = |state: &vk::DynamicState| dynamic.contains(state);
            let static_viewport = viewport
                .filter(|state| !is_dynamic(&vk::DynamicState::VIEWPORT) && state.viewport_count > 0)
                .and_then(|state| state.p_viewports.as_ref())
                .map(|v| [v.x, v.y, v.width, v.height]);
            Some(Self {
                draws_gaussians: assembly
                    .is_some_and(|state| state.topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST),
                restart: assembly.is_some_and(|state| state.primitive_restart_enable != 0),
                gaussian: gaussian.map(GaussianState::of),
                approximation: approximation.map(|numbers| [numbers.exponential_error, numbers.contribution_budget]),
                footprint: footprint.map(|state| Footprint {
                    cut_off: state.cut_off,
                    cut_off_deviations: state.cut_off_deviations,
                    compensation_floor: state.compensation_floor,
                }),
                sigma_points: sigma_points.map(SigmaPoints::of),
                stages: stages.iter().map(|stage| read_stage(stage, objects)).collect(),
                vertex_input: (!is_dynamic(&vk::DynamicState::VERTEX_INPUT_EXT))
                    .then(|| read_vertex_input(info.p_vertex_input_state.as_ref())),
                subpass: read_subpass(info, objects),
                blend: blend
                    .map(|state| slice(state.p_attachments, state.attachment_count).to_vec())
                    .unwrap_or_default(),
                has_logic_op: blend.is_some_and(|state| state.logic_op_enable != 0),
                cull_mode: raster.map(|state| state.cull_mode).unwrap_or_default(),
                polygon_mode: raster.map(|state| state.polygon_mode).unwrap_or_default(),
                discards: raster.is_some_and(|state| state.rasterizer_discard_enable != 0),
                tests_depth: depth.is_some_and(|state| {
                    state.depth_test_enable != 0
                        || state.depth_bounds_test_enable != 0
                        || state.stencil_test_enable != 0
                }),
                writes_depth: depth.is_some_and(|state| state.depth_test_enable != 0 && state.depth_write_enable != 0),
                samples: multisample.map_or(vk::SampleCountFlags::TYPE_1, |state| state.rasterization_samples),
                viewport_count: if is_dynamic(&vk::DynamicState::VIEWPORT_WITH_COUNT) {
                    1
                } else {
                    viewport.map_or(1, |state| state.viewport_count)
                },
                viewport: static_viewport,
                layout: objects.layouts.get(&info.layout).cloned(),
                dynamic,
            })
        }
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
        }
    }
}
