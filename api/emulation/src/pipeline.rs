//! Pipelines of Gaussians: what the kernels need of one, and the graphics pipeline that shows what they have made.

use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::Arc;

use ash::vk;
use gaurast::vk as gvk;
use gaurast::vk::{
    GaussianCameraSourceGAURAST as CameraSource, GaussianGeometryGAURAST as Geometry,
    GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision, GaussianProjectionModeGAURAST as ProjectionMode,
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PipelineGaussianDecodingStateCreateInfoGAURAST as DecodingState,
    PipelineGaussianFootprintStateCreateInfoGAURAST as Footprint, PipelineGaussianStateCreateFlagsGAURAST as Flags,
    PipelineGaussianStateCreateInfoGAURAST as State,
    PipelineGaussianUnscentedStateCreateInfoGAURAST as SigmaPointsInfo,
};
use gaurast_layer_interface::{find, slice};

use crate::decoding::{Decodings, HARMONICS};
use crate::depth_stencil::{self, TestState};
use crate::draw_call::SHADED;
use crate::formats;
use crate::kernels::{self, CAMERA, Kernels, Variant};
use crate::made::{ATTRIBUTES, Covering};
use crate::next::Next;
use crate::projecting;
use crate::report::tell;
use crate::resolve::{self, Request, Rewritten};

/// A location that is not used.
const UNUSED: u32 = !0;

/// An attribute, as `shaders/set.glsl` has it.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Attribute {
    source: u32,
    offset: u32,
    format: u32,
}

/// A vertex buffer that attributes are read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Source {
    pub(crate) binding: u32,
    pub(crate) stride: u32,
    /// By instance; `None` by vertex.
    pub(crate) divisor: Option<u32>,
}

/// The uniform buffer of cameras.
pub(crate) struct CameraBuffer {
    pub(crate) set: u32,
    pub(crate) count: u32,
    pub(crate) pipeline: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
}

/// The resolve shader of a pipeline.
pub(crate) struct Resolve {
    pub(crate) has_camera: bool,
    /// It runs for each sample.
    pub(crate) is_sample_shaded: bool,
    pub(crate) covering: Covering,
    /// The pipeline that stores the outcomes of samples without a fragment, where something may be tested.
    pub(crate) without_shader: vk::Pipeline,
}

/// The pipeline that runs a projecting shader.
pub(crate) struct Projecting {
    pub(crate) raw: vk::Pipeline,
    /// The vertex binding that says where outputs are stored.
    pub(crate) binding: u32,
    pub(crate) has_dynamic_strides: bool,
}

/// A pipeline of Gaussians.
pub(crate) struct Pipeline {
    next: Arc<Next>,
    /// The graphics pipeline, which is also the application's handle.
    pub(crate) raw: vk::Pipeline,
    pub(crate) state: State<'static>,
    pub(crate) cut_off: u32,
    pub(crate) cut_off_deviations: f32,
    pub(crate) compensation_floor: f32,
    pub(crate) sigma_points: SigmaPoints,
    /// The constants that the pipeline fixes in the kernels.
    pub(crate) variant: Variant,
    pub(crate) decodings: Decodings,
    /// Bytes from a harmonic's attribute to the next one's.
    pub(crate) harmonics_step: u32,
    pub(crate) attributes: [Attribute; 33],
    pub(crate) sources: Vec<Source>,
    pub(crate) dynamic: Vec<vk::DynamicState>,
    /// Static ones.
    pub(crate) viewport: Option<vk::Viewport>,
    pub(crate) scissor: Option<vk::Rect2D>,
    pub(crate) view_mask: u32,
    /// Depth and stencil tests, if something may be tested.
    pub(crate) tests: Option<TestState>,
    pub(crate) is_negative_one_to_one: bool,
    /// Rasterization samples.
    pub(crate) samples: u32,
    pub(crate) camera_buffer: Option<CameraBuffer>,
    pub(crate) resolve: Option<Resolve>,
    pub(crate) projecting: Option<Projecting>,
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        if let Some(resolve) = &self.resolve {
            // SAFETY: as below.
            unsafe { self.next.destroy_pipeline(resolve.without_shader, None) };
        }
        if let Some(projecting) = &self.projecting {
            // SAFETY: as below.
            unsafe { self.next.destroy_pipeline(projecting.raw, None) };
        }
        if let Some(camera) = &self.camera_buffer {
            // SAFETY: no command buffer that uses it is executed any more.
            unsafe {
                self.next.destroy_pipeline(camera.pipeline, None);
                self.next.destroy_pipeline_layout(camera.layout, None);
            }
        }
    }
}

/// The objects that a pipeline's creation needs beside its creation info.
pub(crate) struct Context<'a> {
    pub(crate) next: &'a Arc<Next>,
    pub(crate) kernels: &'a Kernels,
    /// The view mask of the subpass, in a render pass object.
    pub(crate) view_mask: Option<u32>,
    /// Layouts of the descriptor sets.
    pub(crate) set_layouts: &'a [vk::DescriptorSetLayout],
    /// The words of vertex and fragment shaders that are modules.
    pub(crate) shaders: &'a HashMap<vk::ShaderModule, Arc<[u32]>>,
    pub(crate) cache: vk::PipelineCache,
}

/// The state of Gaussians, if a pipeline draws them.
///
/// # Safety
/// The creation info is valid.
pub(crate) unsafe fn gaussian_state<'a>(info: &vk::GraphicsPipelineCreateInfo<'a>) -> Option<&'a State<'a>> {
    // SAFETY: the caller's promise.
    unsafe {
        let assembly = info.p_input_assembly_state.as_ref();
        let is_gaussian =
            assembly.is_some_and(|assembly| assembly.topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        if is_gaussian { find::<State<'_>>(info.p_next) } else { None }
    }
}

/// The sigma points of the unscented transform.
pub(crate) struct SigmaPoints {
    /// Distance from the mean in standard deviations.
    pub(crate) distance: f64,
    /// Weights in the covariance of the point in the middle and of each other one.
    pub(crate) center: f64,
    pub(crate) other: f64,
    /// The least number of points in the picture and its margin.
    pub(crate) must_count: u32,
    margin: f64,
}

impl SigmaPoints {
    fn new(points: &SigmaPointsInfo<'_>) -> Self {
        let [alpha, beta, kappa] = [points.alpha, points.beta, points.kappa].map(f64::from);
        // n + lambda in the usual terms.
        let spread = alpha * alpha * (3.0 + kappa);
        let is_everywhere = points.picture_margin == f32::INFINITY;
        Self {
            distance: spread.sqrt(),
            center: (spread - 3.0) / spread + 1.0 - alpha * alpha + beta,
            other: 0.5 / spread,
            must_count: match points.all_sigma_points {
                _ if is_everywhere => 0,
                vk::FALSE => 1,
                _ => 7,
            },
            margin: if is_everywhere { 0.0 } else { points.picture_margin.into() },
        }
    }

    /// The part of a viewport's area, from its corner, in which points count: least and end in x and in y, in pixels.
    pub(crate) fn picture(&self, width: f32, height: f32) -> [f64; 4] {
        let [width, height] = [width, height].map(f64::from);
        let margins = [self.margin * width, self.margin * height];
        [-margins[0], width + margins[0], -margins[1], height + margins[1]]
    }
}

/// Reports whether a vertex shader projects.
fn is_shaded(state: &State<'_>) -> bool {
    state.projection_mode == ProjectionMode::VERTEX_SHADER
}

/// A reason to refuse a pipeline.
fn refusal(state: &State<'_>) -> Option<&'static str> {
    let refusals = [
        (state.order == Order::PER_PIXEL, "perPixelOrder"),
        (state.precision == Precision::FLOAT16, "rasterizationFloat16"),
    ];
    refusals.iter().find(|(is_used, _)| *is_used).map(|(_, feature)| *feature)
}

/// Dynamic states that act on the fragment that is shown; the others have no effect on Gaussians.
const SHOWN: [vk::DynamicState; 8] = [
    vk::DynamicState::BLEND_CONSTANTS,
    vk::DynamicState::LOGIC_OP_EXT,
    vk::DynamicState::LOGIC_OP_ENABLE_EXT,
    vk::DynamicState::COLOR_WRITE_ENABLE_EXT,
    vk::DynamicState::COLOR_BLEND_ENABLE_EXT,
    vk::DynamicState::COLOR_BLEND_EQUATION_EXT,
    vk::DynamicState::COLOR_WRITE_MASK_EXT,
    vk::DynamicState::SAMPLE_MASK_EXT,
];

/// The attributes of a pipeline and the buffers that they are read from, or the sentence that refuses them.
struct Attributes {
    list: [Attribute; 33],
    sources: Vec<Source>,
    /// Every attribute is of 32-bit floats, as many as are wanted or more.
    is_float32: bool,
    /// Bytes from a harmonic's attribute to the next one's, if all are of one buffer and as far apart.
    harmonics_step: Option<u32>,
}

/// Bytes from each harmonic's attribute to the next one's, if they are the same.
fn step(harmonics: &[Attribute]) -> Option<u32> {
    let [first, ..] = harmonics else {
        return None;
    };
    let step = harmonics.get(1).map_or(0, |second| second.offset.wrapping_sub(first.offset));
    // Small ones, so that no place overflows.
    let mut all = (0_u32..).zip(harmonics);
    let are_even = all.all(|(index, harmonic)| {
        harmonic.source == first.source && harmonic.offset.checked_sub(first.offset) == step.checked_mul(index)
    });
    Some(step).filter(|step| are_even && *step < 1 << 16)
}

impl Attributes {
    /// # Safety
    /// The creation info is valid.
    unsafe fn read(
        info: &vk::GraphicsPipelineCreateInfo<'_>,
        state: &State<'_>,
        decodings: Decodings,
    ) -> Result<Self, String> {
        // SAFETY: the caller's promise.
        let (bindings, attributes, divisors) = unsafe {
            let Some(input) = info.p_vertex_input_state.as_ref() else {
                return Err("a pipeline of Gaussians has no vertex input state".to_owned());
            };
            let divisors = find::<vk::PipelineVertexInputDivisorStateCreateInfoKHR<'_>>(input.p_next);
            (
                slice(input.p_vertex_binding_descriptions, input.vertex_binding_description_count),
                slice(input.p_vertex_attribute_descriptions, input.vertex_attribute_description_count),
                divisors
                    .map(|divisors| slice(divisors.p_vertex_binding_divisors, divisors.vertex_binding_divisor_count))
                    .unwrap_or_default(),
            )
        };
        let mut own =
            Self { list: [Attribute::default(); 33], sources: Vec::new(), is_float32: true, harmonics_step: None };
        let source = |binding: &vk::VertexInputBindingDescription| {
            let divisor = divisors.iter().find(|divisor| divisor.binding == binding.binding);
            let by_instance = binding.input_rate == vk::VertexInputRate::INSTANCE;
            Source {
                binding: binding.binding,
                stride: binding.stride,
                divisor: by_instance.then(|| divisor.map_or(1, |divisor| divisor.divisor)),
            }
        };
        if is_shaded(state) {
            own.sources = bindings.iter().map(source).collect();
            return Ok(own);
        }
        let at = &state.attribute_locations;
        let harmonics = if state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER) {
            0
        } else if decodings.are_harmonics_decoded {
            1
        } else {
            (state.spherical_harmonics_degree + 1).pow(2).min(25)
        };
        let matrix = (0..3).map(|row| (4 + row, at.first_model_matrix.saturating_add(row)));
        let matrix = matrix.filter(|_| at.first_model_matrix != UNUSED);
        let factor = Some((7, at.model_opacity)).filter(|_| at.model_opacity != UNUSED);
        let places = [(0, at.position), (1, at.scale), (2, at.rotation), (3, at.opacity)];
        let count = harmonics as usize;
        let harmonics =
            (0..harmonics).map(|k| (HARMONICS + k as usize, at.first_spherical_harmonics.saturating_add(k)));
        let used =
            places.into_iter().chain(matrix.map(|(place, at)| (place as usize, at))).chain(factor).chain(harmonics);
        for (place, location) in used {
            let attribute = attributes.iter().find(|attribute| attribute.location == location);
            let attribute =
                attribute.ok_or_else(|| format!("no attribute has location {location}, which Gaussians use"))?;
            let format = formats::code(attribute.format)
                .filter(|code| formats::has_integers(*code) == decodings.has_codes(place))
                .ok_or_else(|| format!("attributes of format {:?} are not read", attribute.format))?;
            let binding = bindings.iter().find(|binding| binding.binding == attribute.binding);
            let binding = binding.ok_or_else(|| format!("there is no vertex binding {}", attribute.binding))?;
            let source = source(binding);
            let known = own.sources.iter().position(|other| *other == source);
            let source = known.unwrap_or_else(|| {
                own.sources.push(source);
                own.sources.len() - 1
            });
            own.list[place] = Attribute { source: source as u32, offset: attribute.offset, format };
            let wanted = match place {
                1 if state.geometry == Geometry::GAUSSIAN_2D => 2,
                2 | 4..7 => 4,
                3 | 7 => 1,
                _ => 3,
            };
            own.is_float32 &= formats::is_float32(format, wanted);
        }
        own.harmonics_step = step(&own.list[HARMONICS..HARMONICS + count]).filter(|_| own.is_float32);
        Ok(own)
    }
}

/// Creates a pipeline of Gaussians. What is refused is told.
///
/// # Safety
/// The creation info is valid.
pub(crate) unsafe fn create(
    context: &Context<'_>,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    state: &State<'_>,
    allocator: Option<&vk::AllocationCallbacks<'_>>,
) -> Result<Pipeline, vk::Result> {
    // SAFETY: the caller's promise.
    unsafe {
        let sigma_points = find::<SigmaPointsInfo<'_>>(info.p_next).copied().unwrap_or_default();
        if let Some(feature) = refusal(state) {
            tell(&format!("a pipeline needs {feature}, which is not emulated"));
            return Err(vk::Result::ERROR_FEATURE_NOT_PRESENT);
        }
        let decodings = find::<DecodingState<'_>>(info.p_next).filter(|_| !is_shaded(state));
        let decodings = decodings.map(Decodings::new).unwrap_or_default();
        let attributes = match Attributes::read(info, state, decodings) {
            Ok(attributes) => attributes,
            Err(reason) => {
                tell(&reason);
                return Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED);
            }
        };
        let dynamic = info.p_dynamic_state.as_ref();
        let dynamic = dynamic.map(|dynamic| slice(dynamic.p_dynamic_states, dynamic.dynamic_state_count));
        let dynamic = dynamic.unwrap_or_default().to_vec();
        let is_dynamic =
            |one: vk::DynamicState, other: vk::DynamicState| dynamic.contains(&one) || dynamic.contains(&other);
        let viewports = info.p_viewport_state.as_ref();
        let viewport = viewports.and_then(|state| state.p_viewports.as_ref()).copied();
        let scissor = viewports.and_then(|state| state.p_scissors.as_ref()).copied();
        let (viewport_is_dynamic, scissor_is_dynamic) = (
            is_dynamic(vk::DynamicState::VIEWPORT, vk::DynamicState::VIEWPORT_WITH_COUNT),
            is_dynamic(vk::DynamicState::SCISSOR, vk::DynamicState::SCISSOR_WITH_COUNT),
        );
        let tests = info.p_depth_stencil_state.as_ref().map(TestState::of_pipeline).unwrap_or_default();
        let tests = Some(tests).filter(|tests| tests.may_test_anything(&dynamic));
        if tests.is_some() && dynamic.contains(&vk::DynamicState::DEPTH_CLIP_NEGATIVE_ONE_TO_ONE_EXT) {
            tell("a pipeline that may test depths has negativeOneToOne as a dynamic state, which is not emulated");
            return Err(vk::Result::ERROR_FEATURE_NOT_PRESENT);
        }
        let shader = match resolve_shader(context, info, state, tests.is_some()) {
            Ok(shader) => shader,
            Err(reason) => {
                tell(&reason);
                return Err(vk::Result::ERROR_FEATURE_NOT_PRESENT);
            }
        };
        let clip =
            viewports.and_then(|state| find::<vk::PipelineViewportDepthClipControlCreateInfoEXT<'_>>(state.p_next));
        let rendering = find::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next);
        let view_mask = context.view_mask.or(rendering.map(|rendering| rendering.view_mask)).unwrap_or(0);
        let footprint = find::<Footprint<'_>>(info.p_next);
        let cut_off = footprint.map_or(0, |footprint| footprint.cut_off.as_raw().cast_unsigned());
        let of_footprint = Variant {
            has_cut_tiles: cut_off >= 2,
            has_tests: tests.is_some_and(|tests| tests.tests_anything()),
            is_resolved: shader.as_ref().is_some_and(|shader| shader.rewritten.has_inputs),
            is_shaded: is_shaded(state),
            ..Variant::default()
        };
        let variant = if is_shaded(state) {
            of_footprint
        } else {
            Variant {
                has_matrix: state.attribute_locations.first_model_matrix != UNUSED,
                has_factor: state.attribute_locations.model_opacity != UNUSED,
                harmonics_in_buffer: state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER),
                is_float32: attributes.is_float32,
                are_harmonics_even: attributes.harmonics_step.is_some(),
                degree: state.spherical_harmonics_degree,
                // What a buffer holds is not known here, and what a command gives, later.
                has_angles: state.camera_source == CameraSource::UNIFORM_BUFFER,
                is_unscented: state.linearization == Linearization::UNSCENTED,
                is_surfel: state.geometry == Geometry::GAUSSIAN_2D,
                has_logarithms: state.flags.contains(Flags::LOG_SCALE),
                has_logits: state.flags.contains(Flags::LOGIT_OPACITY),
                has_decodings: decodings.is_used(),
                // What commands set is not known here either.
                has_lens: false,
                ..of_footprint
            }
        };
        // They are compiled now, rather than with the first draw.
        context.kernels.specialized(variant)?;
        let show = Show { dynamic: &dynamic, may_be_tested: tests.is_some(), view_mask, allocator };
        let raw = graphics(context, info, &show, shader.as_ref())?;
        let without_shader = if tests.is_some() && shader.is_some() {
            graphics(context, info, &show, None).inspect_err(|_| context.next.destroy_pipeline(raw, allocator))?
        } else {
            vk::Pipeline::null()
        };
        let projecting = match projecting_shader(context, info, state, view_mask, &dynamic) {
            Ok(projecting) => projecting,
            Err(refusal) => {
                context.next.destroy_pipeline(raw, allocator);
                context.next.destroy_pipeline(without_shader, allocator);
                if let Some(reason) = refusal.reason {
                    tell(&reason);
                }
                return Err(refusal.result);
            }
        };
        let mut own = Pipeline {
            next: Arc::clone(context.next),
            raw,
            state: State { p_next: std::ptr::null(), _marker: std::marker::PhantomData, ..*state },
            cut_off,
            cut_off_deviations: footprint.map_or(0.0, |footprint| footprint.cut_off_deviations),
            compensation_floor: footprint.map_or(0.0, |footprint| footprint.compensation_floor),
            sigma_points: SigmaPoints::new(&sigma_points),
            variant,
            decodings,
            harmonics_step: attributes.harmonics_step.unwrap_or(0),
            attributes: attributes.list,
            sources: attributes.sources,
            viewport: viewport.filter(|_| !viewport_is_dynamic),
            scissor: scissor.filter(|_| !scissor_is_dynamic),
            dynamic,
            view_mask,
            tests,
            is_negative_one_to_one: clip.is_some_and(|clip| clip.negative_one_to_one != vk::FALSE),
            samples: samples(info),
            camera_buffer: None,
            resolve: shader.map(|shader| Resolve {
                has_camera: shader.rewritten.has_camera,
                is_sample_shaded: shader.rewritten.is_sample_shaded,
                covering: shader.rewritten.covering,
                without_shader,
            }),
            projecting,
        };
        if state.camera_source == CameraSource::UNIFORM_BUFFER && !is_shaded(state) {
            match camera_buffer(context, state) {
                Ok(camera) => own.camera_buffer = Some(camera),
                Err(error) => {
                    context.next.destroy_pipeline(raw, allocator);
                    return Err(error);
                }
            }
        }
        Ok(own)
    }
}

/// Rasterization samples.
///
/// # Safety
/// The creation info is valid.
unsafe fn samples(info: &vk::GraphicsPipelineCreateInfo<'_>) -> u32 {
    // SAFETY: the caller's promise.
    let state = unsafe { info.p_multisample_state.as_ref() };
    state.map_or(1, |state| state.rasterization_samples.as_raw().max(1))
}

/// A resolve shader that loads its inputs, and the application's stage.
struct ResolveShader<'a> {
    stage: vk::PipelineShaderStageCreateInfo<'a>,
    rewritten: Rewritten,
}

/// The resolve shader of a pipeline, if it has one, or the sentence that refuses it.
///
/// # Safety
/// The creation info is valid.
unsafe fn resolve_shader<'a>(
    context: &Context<'_>,
    info: &vk::GraphicsPipelineCreateInfo<'a>,
    state: &State<'_>,
    may_be_tested: bool,
) -> Result<Option<ResolveShader<'a>>, String> {
    // SAFETY: the caller's promise.
    unsafe {
        let mut stages = slice(info.p_stages, info.stage_count).iter();
        let Some(stage) = stages.find(|stage| stage.stage == vk::ShaderStageFlags::FRAGMENT) else {
            return Ok(None);
        };
        let words = shader_words(stage, context.shaders);
        let words = words.ok_or("a resolve shader is named by an identifier of its module, which is not emulated")?;
        if stage.p_name.is_null() {
            return Err("a resolve shader has no name".to_owned());
        }
        let multisample = info.p_multisample_state.as_ref();
        let rewritten = resolve::rewrite(&Request {
            words: &words,
            entry: CStr::from_ptr(stage.p_name),
            locations: state.resolve_input_locations,
            may_be_tested,
            samples: samples(info),
            is_sample_shaded: multisample.is_some_and(|state| state.sample_shading_enable != vk::FALSE),
        })?;
        Ok(Some(ResolveShader { stage: *stage, rewritten }))
    }
}

/// A reason not to create a pipeline; none where the next layer has failed.
struct Refusal {
    reason: Option<String>,
    result: vk::Result,
}

impl From<String> for Refusal {
    fn from(reason: String) -> Self {
        Self { reason: Some(reason), result: vk::Result::ERROR_FEATURE_NOT_PRESENT }
    }
}

impl From<vk::Result> for Refusal {
    fn from(result: vk::Result) -> Self {
        Self { reason: None, result }
    }
}

/// The highest two numbers below a limit that are not used.
fn unused<const N: usize>(limit: u32, used: impl Fn(u32) -> bool) -> Option<[u32; N]> {
    let mut free = (0..limit).rev().filter(|&number| !used(number));
    let found: Vec<u32> = free.by_ref().take(N).collect();
    found.try_into().ok()
}

/// The pipeline that runs a projecting shader, if there is one: it draws points, of which nothing is rasterized.
///
/// # Safety
/// The creation info is valid.
unsafe fn projecting_shader(
    context: &Context<'_>,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    state: &State<'_>,
    view_mask: u32,
    dynamic: &[vk::DynamicState],
) -> Result<Option<Projecting>, Refusal> {
    if !is_shaded(state) {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    unsafe {
        let mut stages = slice(info.p_stages, info.stage_count).iter();
        let stage = stages.find(|stage| stage.stage == vk::ShaderStageFlags::VERTEX);
        let stage = stage.ok_or_else(|| "a pipeline whose vertex shader projects has none".to_owned())?;
        let words = shader_words(stage, context.shaders).ok_or_else(|| {
            "a projecting shader is named by an identifier of its module, which is not emulated".to_owned()
        })?;
        if stage.p_name.is_null() {
            return Err("a projecting shader has no name".to_owned().into());
        }
        let input = info.p_vertex_input_state.as_ref().copied().unwrap_or_default();
        let mut bindings = slice(input.p_vertex_binding_descriptions, input.vertex_binding_description_count).to_vec();
        let mut attributes =
            slice(input.p_vertex_attribute_descriptions, input.vertex_attribute_description_count).to_vec();
        let binding =
            unused(context.next.max_vertex_bindings, |number| bindings.iter().any(|binding| binding.binding == number));
        let locations = unused(context.next.max_vertex_attributes, |number| {
            attributes.iter().any(|attribute| attribute.location == number)
        });
        let (Some([binding]), Some(places)) = (binding, locations) else {
            return Err("a projecting shader leaves no vertex binding, or no two locations, to the emulation"
                .to_owned()
                .into());
        };
        bindings.push(vk::VertexInputBindingDescription {
            binding,
            stride: 0,
            input_rate: vk::VertexInputRate::VERTEX,
        });
        for (location, offset) in places.into_iter().zip(SHADED) {
            let format = vk::Format::R32G32B32A32_UINT;
            attributes.push(vk::VertexInputAttributeDescription { location, binding, format, offset });
        }
        let input = vk::PipelineVertexInputStateCreateInfo {
            p_next: input.p_next,
            ..vk::PipelineVertexInputStateCreateInfo::default()
                .vertex_binding_descriptions(&bindings)
                .vertex_attribute_descriptions(&attributes)
        };
        let rewritten = projecting::rewrite(&projecting::Request {
            words: &words,
            entry: CStr::from_ptr(stage.p_name),
            locations: state.vertex_output_locations,
            places,
            has_views: view_mask != 0,
        })?;
        let module =
            context.next.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&rewritten), None)?;
        let mut stage = stage.module(module);
        stage.p_next = std::ptr::null();
        let stages = [stage];
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::POINT_LIST);
        let raster =
            vk::PipelineRasterizationStateCreateInfo::default().rasterizer_discard_enable(true).line_width(1.0);
        let strides = vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE;
        let has_dynamic_strides = dynamic.contains(&strides);
        let states: &[vk::DynamicState] = if has_dynamic_strides { &[strides] } else { &[] };
        let states = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(states);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().view_mask(view_mask);
        let own = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .rasterization_state(&raster)
            .dynamic_state(&states)
            .layout(info.layout)
            .push_next(&mut rendering);
        let created = context.next.create_graphics_pipelines(context.cache, &[own], None);
        context.next.destroy_shader_module(module, None);
        match created {
            Ok(created) => {
                let raw = created.first().copied().ok_or(vk::Result::ERROR_UNKNOWN)?;
                Ok(Some(Projecting { raw, binding, has_dynamic_strides }))
            }
            Err((_, error)) => Err(error.into()),
        }
    }
}

/// The words of a stage's module, or of the creation info in its chain.
///
/// # Safety
/// The stage is valid.
pub(crate) unsafe fn shader_words(
    stage: &vk::PipelineShaderStageCreateInfo<'_>,
    shaders: &HashMap<vk::ShaderModule, Arc<[u32]>>,
) -> Option<Arc<[u32]>> {
    if let Some(known) = shaders.get(&stage.module) {
        return Some(Arc::clone(known));
    }
    // SAFETY: the caller's promise.
    unsafe {
        let module = find::<vk::ShaderModuleCreateInfo<'_>>(stage.p_next)?;
        Some(slice(module.p_code, (module.code_size / 4) as u32).into())
    }
}

/// Parameters of a graphics pipeline that shows sets, beside its creation info.
struct Show<'a> {
    dynamic: &'a [vk::DynamicState],
    may_be_tested: bool,
    view_mask: u32,
    allocator: Option<&'a vk::AllocationCallbacks<'a>>,
}

/// The graphics pipeline: two triangles over each tile of the set's area, whose fragments fetch what the kernels have made, or run the
/// resolve shader.
///
/// # Safety
/// The creation info is valid.
unsafe fn graphics(
    context: &Context<'_>,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    show: &Show<'_>,
    shader: Option<&ResolveShader<'_>>,
) -> Result<vk::Pipeline, vk::Result> {
    let (kernels, may_be_tested, has_views) = (context.kernels, show.may_be_tested, show.view_mask != 0);
    let (mut vertex, fetch) = match (!has_views, may_be_tested) {
        (true, false) => (kernels.vertex, kernels.fetch),
        (true, true) => (kernels.vertex, kernels.fetch_tested),
        (false, false) => (kernels.vertex_views, kernels.fetch_views),
        (false, true) => (kernels.vertex_views, kernels.fetch_tested_views),
    };
    let stage = |stage: vk::ShaderStageFlags, module: vk::ShaderModule| {
        vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
    };
    let mut fragment = stage(vk::ShaderStageFlags::FRAGMENT, fetch);
    let mut input = vk::PipelineVertexInputStateCreateInfo::default();
    let bindings = [vk::VertexInputBindingDescription {
        binding: 0,
        stride: ATTRIBUTES as u32,
        input_rate: vk::VertexInputRate::INSTANCE,
    }];
    let attributes = [0, 1, 2, 3].map(|location| vk::VertexInputAttributeDescription {
        location,
        binding: 0,
        format: vk::Format::R32G32B32A32_UINT,
        offset: 16 * location,
    });
    let mut module = vk::ShaderModule::null();
    if let Some(shader) = shader {
        let info = vk::ShaderModuleCreateInfo::default().code(&shader.rewritten.words);
        // SAFETY: the words are a module's.
        module = unsafe { context.next.create_shader_module(&info, None)? };
        fragment = shader.stage.module(module);
        fragment.p_next = std::ptr::null();
        vertex = if has_views { kernels.vertex_resolved_views } else { kernels.vertex_resolved };
        input = input.vertex_binding_descriptions(&bindings).vertex_attribute_descriptions(&attributes);
    }
    let stages = [stage(vk::ShaderStageFlags::VERTEX, vertex), fragment];
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewports = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default().depth_compare_op(vk::CompareOp::ALWAYS);
    let mut states: Vec<vk::DynamicState> =
        show.dynamic.iter().copied().filter(|state| SHOWN.contains(state)).collect();
    states.extend([vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
    if may_be_tested {
        states.extend(depth_stencil::STORED);
    }
    let states = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
    // SAFETY: the caller's promise.
    unsafe {
        let blend = info.p_color_blend_state.as_ref();
        let mut attachments =
            blend.map(|blend| slice(blend.p_attachments, blend.attachment_count)).unwrap_or_default().to_vec();
        // Without a resolve shader there is a colour at location 0 alone.
        let colors = if shader.is_some() { attachments.len() } else { 1 };
        for attachment in attachments.iter_mut().skip(colors) {
            attachment.color_write_mask = vk::ColorComponentFlags::empty();
        }
        let mut blend = blend.copied().unwrap_or_default();
        if !blend.p_attachments.is_null() {
            blend.p_attachments = attachments.as_ptr();
        }
        let mut multisample = info.p_multisample_state.as_ref().copied().unwrap_or_default();
        let is_sample_shaded = shader.is_some() && multisample.sample_shading_enable != vk::FALSE;
        multisample.sample_shading_enable = is_sample_shaded.into();
        multisample.min_sample_shading = 1.0;
        let mut rendering = find::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next).copied().unwrap_or_default();
        rendering.p_next = std::ptr::null();
        let mut own = vk::GraphicsPipelineCreateInfo::default()
            .flags(info.flags & !vk::PipelineCreateFlags::DERIVATIVE)
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewports)
            .rasterization_state(&raster)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .multisample_state(&multisample)
            .dynamic_state(&states)
            .layout(if shader.is_some() { info.layout } else { kernels.fetch_layout })
            .render_pass(info.render_pass)
            .subpass(info.subpass);
        if info.render_pass == vk::RenderPass::null() {
            own = own.push_next(&mut rendering);
        }
        let created = context.next.create_graphics_pipelines(context.cache, &[own], show.allocator);
        context.next.destroy_shader_module(module, None);
        match created {
            Ok(created) => created.first().copied().ok_or(vk::Result::ERROR_UNKNOWN),
            Err((_, error)) => Err(error),
        }
    }
}

/// The kernel that copies the cameras of a uniform buffer, with its descriptor where the application has it.
///
/// # Safety
/// The layouts live.
unsafe fn camera_buffer(context: &Context<'_>, state: &State<'_>) -> Result<CameraBuffer, vk::Result> {
    const OP_DECORATE: u32 = 71;
    const BINDING: u32 = 33;
    const DESCRIPTOR_SET: u32 = 34;
    let mut words = kernels::words(CAMERA);
    let mut at = 5;
    while at < words.len() {
        let (length, opcode) = (words[at] >> 16, words[at] & 0xFFFF);
        if opcode == OP_DECORATE && length == 4 {
            match words[at + 2] {
                BINDING => words[at + 3] = state.camera_binding,
                DESCRIPTOR_SET => words[at + 3] = state.camera_set,
                _ => {}
            }
        }
        at += (length as usize).max(1);
    }
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    let sets = context.set_layouts.get(..=state.camera_set as usize).unwrap_or(context.set_layouts);
    // SAFETY: the caller's promise.
    unsafe {
        let layout = kernels::layout(context.next, sets, vk::ShaderStageFlags::COMPUTE)?;
        let module = context.next.create_shader_module(&info, None)?;
        let pipeline = kernels::compute(context.next, module, layout, &[8 * state.camera_count.max(1)]);
        context.next.destroy_shader_module(module, None);
        Ok(CameraBuffer { set: state.camera_set, count: state.camera_count.max(1), pipeline: pipeline?, layout })
    }
}

impl Pipeline {
    /// Reports whether a state of the extension is set by a command.
    pub(crate) fn is_dynamic(&self, state: vk::DynamicState) -> bool {
        self.dynamic.contains(&state)
    }

    /// The greatest view index and one.
    pub(crate) fn planes(&self) -> u32 {
        (u32::BITS - self.view_mask.leading_zeros()).max(1)
    }

    /// The views that are drawn.
    pub(crate) fn views(&self) -> impl Iterator<Item = u32> + use<> {
        let mask = self.view_mask.max(1);
        (0..u32::BITS).filter(move |view| mask >> view & 1 != 0)
    }

    /// Reports whether harmonics come from a buffer of their own.
    pub(crate) fn has_harmonics_buffer(&self) -> bool {
        self.state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER) && self.projecting.is_none()
    }
}

/// The names of the extension's dynamic states.
pub(crate) use gvk::{
    DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST as ALPHA_CEILING,
    DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST as ALPHA_FLOOR,
    DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST as ANTIALIASING,
    DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST as CONTRIBUTION_BUDGET,
    DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST as EXPONENTIAL_ERROR,
    DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST as LOW_PASS_VARIANCE,
    DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST as ORDER,
    DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST as SPHERICAL_HARMONICS_DEGREE,
    DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST as TRANSMITTANCE_FLOOR,
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_are_even_in_one_buffer() {
        let at = |source: u32, offset: u32| Attribute { source, offset, format: 3 << 8 };
        assert_eq!(step(&[]), None);
        assert_eq!(step(&[at(0, 40)]), Some(0));
        assert_eq!(step(&[at(0, 40), at(0, 52), at(0, 64)]), Some(12));
        assert_eq!(step(&[at(0, 40), at(0, 52), at(0, 68)]), None, "gaps differ");
        assert_eq!(step(&[at(0, 40), at(0, 52), at(1, 64)]), None, "buffers differ");
        assert_eq!(step(&[at(0, 40), at(0, 28), at(0, 16)]), None, "offsets go down");
    }
}
