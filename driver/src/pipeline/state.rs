//! Fixed-function state and the sources of vertex attributes, validated and converted.

use super::parts::{GraphicsState, VertexInput};
use crate::abi::error::Error;
use crate::convert::{self, StencilOpIds, StencilOps};
use crate::physical_device::{formats, limits};
use crate::registry::features::SUPPORTED;
use ash::vk;
use gaurast::vk::GAUSSIAN_LOCATION_UNUSED_GAURAST;
use simdevice::Format;
use simdevice::state::gaussian::GaussianState;
use simdevice::state::{
    BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState, CompareOp, DepthBias, DepthStencil, DepthTest,
    DrawState, LineMode, LineStipple, LogicOp, PolygonMode, StencilFace, StencilOp, Topology,
};

/// The source of an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AttributeSource {
    /// The vertex buffer binding.
    pub(crate) binding: u32,
    /// Bytes from one vertex to the next.
    pub(crate) stride: u32,
    /// Bytes from the vertex's start to the attribute.
    pub(crate) offset: u32,
    /// The format in memory.
    pub(crate) format: Format,
    /// The number of instances after which it advances (0: never); `None` if it advances by vertex.
    pub(crate) instance_divisor: Option<u32>,
}

/// Finds the attribute at `location`, which the extension calls `name` and for which it needs `components`.
///
/// # Errors
/// An [`Error`] if the location, its binding or its format is unsuitable.
pub(crate) fn attribute(
    graphics: &GraphicsState,
    name: &str,
    location: u32,
    components: u32,
) -> Result<AttributeSource, Error> {
    let source = find_attribute(graphics, name, location)?;
    let format = source.format;
    if format.is_integer() {
        let what = format!("whose format {format:?} does not convert to floating point");
        return Err(unsuitable(name, location, &what));
    }
    if (format.components().len() as u32) < components {
        let what = format!("whose format {format:?} has fewer than {components} components");
        return Err(unsuitable(name, location, &what));
    }
    Ok(source)
}

/// Finds the attribute at `location`, which the extension calls `name`, of whatever format.
///
/// # Errors
/// An [`Error`] if the location or its binding is unsuitable, or its format is none of vertex attributes.
pub(crate) fn find_attribute(graphics: &GraphicsState, name: &str, location: u32) -> Result<AttributeSource, Error> {
    source(&graphics.vertex_input.input, location).map_err(|what| unsuitable(name, location, &what))
}

/// The error that the attribute `name` cannot be read from `location`, because of `what`.
fn unsuitable(name: &str, location: u32, what: &str) -> Error {
    Error::usage(
        "VUID-VkGaussianAttributeLocationsGAURAST-None-90015",
        if location == GAUSSIAN_LOCATION_UNUSED_GAURAST {
            format!("{name} is unused, but the pipeline reads it")
        } else {
            format!("{name} is location {location}, {what}")
        },
    )
}

/// Finds the attribute at `location`.
///
/// # Errors
/// The problem with the attribute, as the end of a sentence about its location.
pub(crate) fn source(input: &VertexInput, location: u32) -> Result<AttributeSource, String> {
    let at = |location: u32| input.attributes.iter().find(move |attribute| attribute.location == location);
    // Components of 64 bits are read as two words each, of which a location has four.
    let first = at(location).map(|attribute| (attribute, 0));
    let second = || Some((at(location.checked_sub(1)?)?, 1));
    let found = first.or_else(|| second().filter(|(attribute, _)| wide_words(attribute.format) > 4));
    let (attribute, half) = found.ok_or("which the vertex input state does not have")?;
    let number = attribute.binding;
    let binding = input.bindings.iter().find(|b| b.binding == number);
    let binding = binding.ok_or_else(|| format!("whose binding {number} the vertex input state does not have"))?;
    let features = formats::properties(attribute.format).buffer_features;
    let format = match wide_words(attribute.format) - 4 * half {
        words if words <= 0 => formats::device_format(attribute.format),
        2 => Some(Format::R32G32Uint),
        _ => Some(Format::R32G32B32A32Uint),
    };
    let format = format.filter(|_| features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER));
    let format = format.ok_or_else(|| {
        format!("whose format {:?} this device does not read as a vertex attribute", attribute.format)
    })?;
    let instance_divisor = match binding.input_rate {
        vk::VertexInputRate::VERTEX => None,
        vk::VertexInputRate::INSTANCE => {
            let given = input.divisors.iter().find(|it| it.binding == number);
            Some(given.map_or(1, |it| it.divisor))
        }
        rate => return Err(format!("whose binding has the unknown rate {rate:?}")),
    };
    let offset = attribute.offset.saturating_add(16 * half as u32);
    Ok(AttributeSource { binding: number, stride: binding.stride, offset, format, instance_divisor })
}

/// The number of 32-bit words of a format of 64-bit components; 0 for other formats.
fn wide_words(format: vk::Format) -> i32 {
    2 * formats::wide_components(format) as i32
}

/// The state of a single colour attachment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AttachmentState {
    /// True if blending is enabled.
    pub(super) blend_enable: bool,
    pub(super) equations: BlendEquations,
    /// The components that are written, a bit each, if writes are enabled.
    pub(super) write_mask: u8,
    pub(super) write_enable: bool,
    /// True if the pipeline has the attachment, whatever attachments a pass has.
    is_used: bool,
}

/// The equation that gives the source.
const REPLACE: BlendEquation =
    BlendEquation { source: BlendFactor::One, destination: BlendFactor::Zero, op: BlendOp::Add };

impl AttachmentState {
    /// The state that writes the source unchanged.
    const WRITTEN: Self = Self {
        blend_enable: false,
        equations: BlendEquations::both(REPLACE),
        write_mask: 0xf,
        write_enable: true,
        is_used: true,
    };

    /// The state for the device.
    fn blend_state(self) -> BlendState {
        BlendState {
            equations: self.blend_enable.then_some(self.equations),
            write_mask: if self.write_enable && self.is_used { self.write_mask } else { 0 },
        }
    }
}

/// The state of all colour attachments.
///
/// # Errors
/// An [`Error`] if their number is not that of the attachments, or for state that the device doesn't support.
fn attachment_states(graphics: &GraphicsState) -> Result<Vec<AttachmentState>, Error> {
    let enables = &graphics.fragment_output.color_write_enables;
    let formats = &graphics.fragment_output.color_formats;
    let with_enables = |index: usize, state: AttachmentState| AttachmentState {
        write_enable: enables.get(index).is_none_or(|&enable| enable != vk::FALSE),
        is_used: formats.get(index).is_some_and(|&format| format != vk::Format::UNDEFINED),
        ..state
    };
    if graphics.has_dynamic_blending() {
        let states = (0..formats.len()).map(|index| with_enables(index, AttachmentState::WRITTEN));
        return Ok(states.collect());
    }
    if graphics.fragment_output.blend.is_empty() && formats.iter().all(|&format| format == vk::Format::UNDEFINED) {
        // No attachment is used, so there need be no blend state.
        return Ok(vec![AttachmentState { is_used: false, ..AttachmentState::WRITTEN }; formats.len()]);
    }
    if graphics.fragment_output.blend.len() != formats.len() {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-renderPass-07609",
            format!(
                "the colour blend state's attachmentCount is {}, but the subpass has {} colour attachments",
                graphics.fragment_output.blend.len(),
                formats.len()
            ),
        ));
    }
    let given = graphics.fragment_output.blend.iter().enumerate();
    given
        .map(|(index, given)| {
            let blend_enable = given.blend_enable != vk::FALSE;
            let mut state = AttachmentState {
                blend_enable,
                write_mask: convert::write_mask(given.color_write_mask),
                ..AttachmentState::WRITTEN
            };
            // An unused value may be anything.
            let may_blend = blend_enable || graphics.is_dynamic(vk::DynamicState::COLOR_BLEND_ENABLE_EXT);
            if may_blend && !graphics.is_dynamic(vk::DynamicState::COLOR_BLEND_EQUATION_EXT) {
                state.equations = convert::blend_equations(given)?;
            }
            Ok(with_enables(index, state))
        })
        .collect()
}

/// Reports whether blending of an attachment reads the second source of the fragment stage.
pub(crate) fn reads_second_source(state: &vk::PipelineColorBlendAttachmentState) -> bool {
    use vk::BlendFactor as F;
    let factors = [
        state.src_color_blend_factor,
        state.dst_color_blend_factor,
        state.src_alpha_blend_factor,
        state.dst_alpha_blend_factor,
    ];
    let is_second =
        |factor: F| matches!(factor, F::SRC1_COLOR | F::ONE_MINUS_SRC1_COLOR | F::SRC1_ALPHA | F::ONE_MINUS_SRC1_ALPHA);
    state.blend_enable != vk::FALSE && factors.into_iter().any(is_second)
}

/// A [`DeviceFeature`] by its name.
macro_rules! supported {
    ($feature:ident) => {
        DeviceFeature { is_supported: SUPPORTED.$feature, name: stringify!($feature) }
    };
}

/// The state of a pipeline, or of a draw.
#[derive(Clone, Debug)]
pub(crate) struct FixedFunctionState {
    /// All state except depth bias, depth, stencil, logic operations and the state of single colour attachments.
    pub(crate) draw: DrawState,
    /// The number of vertices of a patch.
    pub(super) patch_control_points: u32,
    pub(super) depth_bias_enable: bool,
    pub(super) depth_bias: DepthBias,
    /// True if the pipeline has a depth attachment; without it, no depth is tested, whatever attachments a pass has.
    has_depth: bool,
    /// The same of a stencil attachment.
    has_stencil: bool,
    pub(super) depth_test: bool,
    pub(super) depth_write: bool,
    pub(super) depth_compare: CompareOp,
    pub(super) depth_bounds_test: bool,
    pub(super) depth_bounds: (f32, f32),
    pub(super) stencil_test: bool,
    pub(super) stencil: [StencilFace; 2],
    /// The state of Gaussians, if the pipeline draws them.
    pub(super) gaussian: Option<Box<GaussianState>>,
    pub(super) logic_op_enable: bool,
    pub(super) logic_op: LogicOp,
    pub(super) attachments: Vec<AttachmentState>,
}

/// The ids of the rules on the operations of `VkStencilOpState`.
const STENCIL_OP_STATE: StencilOpIds = StencilOpIds {
    fail: "VUID-VkStencilOpState-failOp-parameter",
    pass: "VUID-VkStencilOpState-passOp-parameter",
    depth_fail: "VUID-VkStencilOpState-depthFailOp-parameter",
    compare: "VUID-VkStencilOpState-compareOp-parameter",
};

/// A stencil face that changes nothing.
const KEEP: StencilFace = StencilFace {
    fail: StencilOp::Keep,
    pass: StencilOp::Keep,
    depth_fail: StencilOp::Keep,
    compare: CompareOp::Always,
    compare_mask: 0xFF,
    write_mask: 0xFF,
    reference: 0,
};

impl FixedFunctionState {
    /// Validates and converts the static state of a pipeline.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(crate) fn new(graphics: &GraphicsState) -> Result<Self, Error> {
        let mut state = Self::of(graphics, convert::topology(graphics.vertex_input.topology)?)?;
        if !graphics.discards() {
            state.set_viewports(graphics)?;
            state.set_samples(graphics)?;
            state.set_depth_stencil(graphics)?;
            state.set_blend(graphics)?;
        }
        Ok(state)
    }

    /// As [`FixedFunctionState::new`], for the fragments of Gaussians.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn of_gaussians(graphics: &GraphicsState) -> Result<Self, Error> {
        // The topology has no effect.
        let mut state = Self::of(graphics, Topology::TriangleStrip)?;
        if !graphics.fragment_output.multisample.rasterization_samples.is_empty() {
            state.set_samples(graphics)?;
        }
        state.set_depth_stencil(graphics)?;
        state.set_blend(graphics)?;
        Ok(state)
    }

    /// The state with vertex assembly and rasterization of the pipeline; all other state has no effect.
    fn of(graphics: &GraphicsState, topology: Topology) -> Result<Self, Error> {
        let raster = &graphics.pre_rasterization.rasterization;
        let polygon_mode = convert::polygon_mode(raster.polygon_mode)?;
        let needs = [
            FeatureNeed {
                is_needed: polygon_mode != PolygonMode::Fill,
                feature: supported!(fill_mode_non_solid),
                state: "a polygon mode but FILL",
            },
            FeatureNeed {
                is_needed: raster.depth_clamp_enable != vk::FALSE,
                feature: supported!(depth_clamp),
                state: "depthClampEnable",
            },
            FeatureNeed {
                is_needed: raster.depth_bias_enable != vk::FALSE && raster.depth_bias_clamp != 0.0,
                feature: supported!(depth_bias_clamp),
                state: "depthBiasClamp",
            },
            FeatureNeed {
                is_needed: graphics.line_width() != 1.0,
                feature: supported!(wide_lines),
                state: "a line width but 1",
            },
        ];
        require_all(&needs)?;
        let lines = &graphics.pre_rasterization.lines;
        let draw = DrawState {
            topology,
            primitive_restart: graphics.vertex_input.primitive_restart,
            viewports: Vec::new(),
            scissors: Vec::new(),
            depth_clamp: raster.depth_clamp_enable != vk::FALSE,
            unrestricted_depth: false,
            depth_clip: graphics.pre_rasterization.depth_clip,
            negative_one_to_one: graphics.pre_rasterization.negative_one_to_one,
            rasterizer_discard: raster.rasterizer_discard_enable != vk::FALSE,
            polygon_mode,
            cull_front: false,
            cull_back: false,
            front_clockwise: false,
            depth_bias: None,
            line_width: graphics.line_width(),
            line_mode: if graphics.is_dynamic(vk::DynamicState::LINE_RASTERIZATION_MODE_EXT) {
                LineMode::Rectangular
            } else {
                convert::line_mode(
                    lines.line_rasterization_mode,
                    "VUID-VkPipelineRasterizationLineStateCreateInfoEXT-lineRasterizationMode-parameter",
                )?
            },
            stipples_lines: lines.stippled_line_enable != vk::FALSE,
            line_stipple: LineStipple { factor: lines.line_stipple_factor, pattern: lines.line_stipple_pattern },
            provoking_last: graphics.pre_rasterization.provoking_last,
            rasterized_stream: graphics.pre_rasterization.rasterized_stream,
            lower_left_domain: graphics.pre_rasterization.lower_left_domain,
            samples: 1,
            sample_mask: u32::MAX,
            sample_shading: false,
            alpha_to_coverage: false,
            alpha_to_one: false,
            depth_stencil: DepthStencil { depth: None, bounds: None, stencil: None },
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
            reads_attachments: graphics.reads_attachments(),
        };
        let mut state = Self {
            draw,
            patch_control_points: graphics.pre_rasterization.patch_control_points,
            depth_bias_enable: raster.depth_bias_enable != vk::FALSE,
            depth_bias: DepthBias {
                constant: raster.depth_bias_constant_factor,
                unit: graphics.pre_rasterization.depth_bias_unit,
                clamp: raster.depth_bias_clamp,
                slope: raster.depth_bias_slope_factor,
            },
            has_depth: graphics.fragment_output.has_depth,
            has_stencil: graphics.fragment_output.has_stencil,
            depth_test: false,
            depth_write: false,
            depth_compare: CompareOp::Always,
            depth_bounds_test: false,
            depth_bounds: (0.0, 1.0),
            stencil_test: false,
            stencil: [KEEP; 2],
            gaussian: None,
            logic_op_enable: false,
            logic_op: LogicOp::Copy,
            attachments: Vec::new(),
        };
        state.set_cull_mode(raster.cull_mode);
        state.set_front_face(raster.front_face);
        Ok(state)
    }

    fn set_viewports(&mut self, graphics: &GraphicsState) -> Result<(), Error> {
        use vk::DynamicState as S;
        let counts = [graphics.pre_rasterization.viewport_count, graphics.pre_rasterization.scissor_count];
        let dynamic = [graphics.is_dynamic(S::VIEWPORT_WITH_COUNT), graphics.is_dynamic(S::SCISSOR_WITH_COUNT)];
        for (count, dynamic) in counts.into_iter().zip(dynamic) {
            if count > limits::properties().max_viewports {
                return Err(Error::usage(
                    "VUID-VkPipelineViewportStateCreateInfo-viewportCount-01218",
                    format!("{count} viewports or scissors are more than maxViewports"),
                ));
            }
            if count == 0 && !dynamic {
                return Err(Error::usage(
                    "VUID-VkPipelineViewportStateCreateInfo-viewportCount-04135",
                    "there is no viewport or no scissor, and their count is not dynamic",
                ));
            }
        }
        if counts[0] != counts[1] && dynamic == [false; 2] {
            return Err(Error::usage(
                "VUID-VkPipelineViewportStateCreateInfo-scissorCount-04134",
                format!("there are {} viewports, but {} scissors", counts[0], counts[1]),
            ));
        }
        let has = |given: usize, count: u32| given == count as usize;
        let static_viewports = !(dynamic[0] || graphics.is_dynamic(S::VIEWPORT));
        let static_scissors = !(dynamic[1] || graphics.is_dynamic(S::SCISSOR));
        if (static_viewports && !has(graphics.pre_rasterization.viewports.len(), counts[0]))
            || (static_scissors && !has(graphics.pre_rasterization.scissors.len(), counts[1]))
        {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-04130",
                "the pipeline has no viewports or scissors, and they are not dynamic",
            ));
        }
        if static_viewports {
            self.draw.viewports = graphics.pre_rasterization.viewports.iter().copied().map(convert::viewport).collect();
        }
        if static_scissors {
            self.draw.scissors = graphics.pre_rasterization.scissors.iter().copied().map(convert::rect).collect();
        }
        Ok(())
    }

    fn set_samples(&mut self, graphics: &GraphicsState) -> Result<(), Error> {
        let multisample = &graphics.fragment_output.multisample;
        let samples = multisample.rasterization_samples;
        let supported = limits::properties().framebuffer_no_attachments_sample_counts;
        let count = samples.as_raw();
        if !count.is_power_of_two() || !supported.contains(samples) {
            return Err(Error::FeatureNotPresent(format!(
                "rasterizationSamples {samples:?} (there are {supported:?})"
            )));
        }
        let needs = [
            FeatureNeed {
                is_needed: multisample.sample_shading_enable != vk::FALSE,
                feature: supported!(sample_rate_shading),
                state: "sampleShadingEnable",
            },
            FeatureNeed {
                is_needed: multisample.alpha_to_one_enable != vk::FALSE,
                feature: supported!(alpha_to_one),
                state: "alphaToOneEnable",
            },
        ];
        require_all(&needs)?;
        let draw = &mut self.draw;
        draw.samples = count;
        draw.sample_mask = graphics.fragment_output.sample_mask;
        // The device shades a pixel once or at every sample, and the requested number is a minimum.
        let shades_more = multisample.min_sample_shading * count as f32 > 1.0;
        draw.sample_shading = multisample.sample_shading_enable != vk::FALSE && shades_more;
        draw.alpha_to_coverage = multisample.alpha_to_coverage_enable != vk::FALSE;
        draw.alpha_to_one = multisample.alpha_to_one_enable != vk::FALSE;
        Ok(())
    }

    fn set_depth_stencil(&mut self, graphics: &GraphicsState) -> Result<(), Error> {
        let Some(state) = graphics.depth_stencil() else {
            return Ok(());
        };
        let bounds_test = state.depth_bounds_test_enable != vk::FALSE;
        require_all(&[FeatureNeed {
            is_needed: bounds_test,
            feature: supported!(depth_bounds),
            state: "depthBoundsTestEnable",
        }])?;
        self.depth_test = state.depth_test_enable != vk::FALSE;
        self.depth_write = state.depth_write_enable != vk::FALSE;
        self.depth_bounds_test = bounds_test;
        self.depth_bounds = (state.min_depth_bounds, state.max_depth_bounds);
        // An unused value may be anything.
        let may_test = |enabled, state| enabled || graphics.is_dynamic(state);
        let tests_depth = may_test(self.depth_test, vk::DynamicState::DEPTH_TEST_ENABLE);
        if tests_depth && !graphics.is_dynamic(vk::DynamicState::DEPTH_COMPARE_OP) {
            self.depth_compare = convert::compare_op(
                state.depth_compare_op,
                "VUID-VkPipelineDepthStencilStateCreateInfo-depthCompareOp-parameter",
            )?;
        }
        self.stencil_test = state.stencil_test_enable != vk::FALSE;
        let tests_stencil = may_test(self.stencil_test, vk::DynamicState::STENCIL_TEST_ENABLE);
        let static_ops = tests_stencil && !graphics.is_dynamic(vk::DynamicState::STENCIL_OP);
        for (face, given) in [state.front, state.back].into_iter().enumerate() {
            if static_ops {
                let ops = StencilOps::from_vk(
                    given.fail_op,
                    given.pass_op,
                    given.depth_fail_op,
                    given.compare_op,
                    &STENCIL_OP_STATE,
                )?;
                ops.set(&mut self.stencil[face]);
            }
            self.stencil[face].compare_mask = given.compare_mask as u8;
            self.stencil[face].write_mask = given.write_mask as u8;
            self.stencil[face].reference = given.reference as u8;
        }
        Ok(())
    }

    fn set_blend(&mut self, graphics: &GraphicsState) -> Result<(), Error> {
        let (op, enable) = graphics.fragment_output.logic_op;
        require_all(&[FeatureNeed { is_needed: enable, feature: supported!(logic_op), state: "logicOpEnable" }])?;
        self.logic_op_enable = enable;
        // An unused value may be anything.
        let may_operate = enable || graphics.is_dynamic(vk::DynamicState::LOGIC_OP_ENABLE_EXT);
        if may_operate && !graphics.is_dynamic(vk::DynamicState::LOGIC_OP_EXT) {
            self.logic_op = convert::logic_op(op)?;
        }
        self.attachments = attachment_states(graphics)?;
        self.draw.blend_constants = graphics.fragment_output.blend_constants;
        Ok(())
    }

    /// Sets the faces that are culled.
    pub(super) fn set_cull_mode(&mut self, mode: vk::CullModeFlags) {
        self.draw.cull_front = mode.contains(vk::CullModeFlags::FRONT);
        self.draw.cull_back = mode.contains(vk::CullModeFlags::BACK);
    }

    /// Sets the face that is the front.
    pub(super) fn set_front_face(&mut self, face: vk::FrontFace) {
        self.draw.front_clockwise = face == vk::FrontFace::CLOCKWISE;
    }

    /// Reports whether anything is rasterized.
    pub(super) fn rasterizes(&self) -> bool {
        !self.draw.rasterizer_discard
    }

    /// Reports whether lines are drawn, so that their width is used.
    pub(super) fn draws_lines(&self) -> bool {
        let draw = &self.draw;
        let are_lines = draw.polygon_mode == PolygonMode::Line || class(draw.topology) == Class::Lines;
        self.rasterizes() && are_lines
    }

    /// Reports whether lines are drawn by a pattern.
    pub(super) fn stipples_lines(&self) -> bool {
        self.draws_lines() && self.draw.stipples_lines
    }

    /// Reports whether patches are drawn.
    pub(super) fn draws_patches(&self) -> bool {
        class(self.draw.topology) == Class::Patches
    }

    /// Sets the number of vertices of a patch.
    pub(super) fn set_patch_control_points(&mut self, count: u32) {
        self.patch_control_points = count.min(limits::MAX_PATCH_SIZE);
    }

    /// Reports whether depth bias is enabled.
    pub(super) fn biases_depth(&self) -> bool {
        self.rasterizes() && self.depth_bias_enable
    }

    /// Reports whether the depth bounds test is enabled.
    pub(super) fn tests_depth_bounds(&self) -> bool {
        self.rasterizes() && self.depth_bounds_test
    }

    /// Reports whether the depth test is enabled.
    pub(super) fn tests_depth(&self) -> bool {
        self.rasterizes() && self.depth_test
    }

    /// Reports whether the stencil test is enabled.
    pub(super) fn tests_stencil(&self) -> bool {
        self.rasterizes() && self.stencil_test
    }

    /// Reports whether an attachment's blending uses the blend constants.
    pub(super) fn blends_by_constants(&self) -> bool {
        self.rasterizes() && !self.logic_op_enable && blends_by_constants(&self.attachments)
    }

    /// Reports whether a logic operation replaces blending.
    pub(super) fn operates(&self) -> bool {
        self.rasterizes() && self.logic_op_enable
    }

    /// Reports whether fragments are written to a colour attachment.
    pub(super) fn has_colors(&self) -> bool {
        self.rasterizes() && !self.attachments.is_empty()
    }

    /// Reports whether a colour attachment is blended.
    pub(super) fn blends(&self) -> bool {
        self.rasterizes() && self.attachments.iter().any(|attachment| attachment.blend_enable)
    }

    /// Changes the state of a colour attachment, if it exists.
    pub(super) fn set_attachment(&mut self, index: usize, set: impl FnOnce(&mut AttachmentState)) {
        if let Some(attachment) = self.attachments.get_mut(index) {
            set(attachment);
        }
    }

    /// Reports whether Gaussians are drawn.
    pub(super) fn draws_gaussians(&self) -> bool {
        self.gaussian.is_some()
    }

    /// Changes the state of Gaussians, if any are drawn.
    pub(super) fn set_gaussian(&mut self, set: impl FnOnce(&mut GaussianState)) {
        if let Some(state) = &mut self.gaussian {
            set(state);
        }
    }

    /// The state of Gaussians, combined with the rest of the state that they use.
    pub(crate) fn gaussian_state(&self) -> GaussianState {
        let converted = self.draw_state();
        GaussianState {
            sample_mask: converted.sample_mask,
            depth_stencil: converted.depth_stencil,
            logic_op: converted.logic_op,
            blend: converted.blend,
            blend_constants: converted.blend_constants,
            negative_one_to_one: converted.negative_one_to_one,
            ..self.gaussian.as_deref().cloned().unwrap_or_default()
        }
    }

    /// The state for the device.
    pub(crate) fn draw_state(&self) -> DrawState {
        DrawState {
            depth_bias: self.depth_bias_enable.then_some(self.depth_bias),
            depth_stencil: DepthStencil {
                depth: (self.has_depth && self.depth_test)
                    .then_some(DepthTest { compare: self.depth_compare, write: self.depth_write }),
                bounds: (self.has_depth && self.depth_bounds_test).then_some(self.depth_bounds),
                stencil: (self.has_stencil && self.stencil_test).then_some(self.stencil),
            },
            topology: match self.draw.topology {
                Topology::PatchList { .. } => Topology::PatchList { control_points: self.patch_control_points },
                other => other,
            },
            logic_op: self.logic_op_enable.then_some(self.logic_op),
            blend: match &self.attachments[..] {
                // A pass may have attachments where the pipeline has none.
                [] => vec![BlendState { equations: None, write_mask: 0 }],
                attachments => attachments.iter().map(|it| it.blend_state()).collect(),
            },
            ..self.draw.clone()
        }
    }
}

/// Reports whether an attachment's blending uses the blend constants.
fn blends_by_constants(attachments: &[AttachmentState]) -> bool {
    let blended = attachments.iter().filter(|attachment| attachment.blend_enable);
    blended
        .map(|attachment| attachment.equations)
        .flat_map(|BlendEquations { color, alpha }| [color.source, color.destination, alpha.source, alpha.destination])
        .any(|factor| {
            matches!(
                factor,
                BlendFactor::ConstantColor
                    | BlendFactor::OneMinusConstantColor
                    | BlendFactor::ConstantAlpha
                    | BlendFactor::OneMinusConstantAlpha
            )
        })
}

/// The class of primitives that a topology makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    /// Points.
    Points,
    /// Lines.
    Lines,
    /// Triangles.
    Triangles,
    /// Patches.
    Patches,
}

/// The class of a topology.
pub(crate) fn class(topology: Topology) -> Class {
    match topology {
        Topology::PointList => Class::Points,
        Topology::LineList
        | Topology::LineStrip
        | Topology::LineListWithAdjacency
        | Topology::LineStripWithAdjacency => Class::Lines,
        Topology::TriangleList
        | Topology::TriangleStrip
        | Topology::TriangleFan
        | Topology::TriangleListWithAdjacency
        | Topology::TriangleStripWithAdjacency => Class::Triangles,
        Topology::PatchList { .. } => Class::Patches,
    }
}

/// A feature of the device.
struct DeviceFeature {
    is_supported: bool,
    name: &'static str,
}

/// The need of a pipeline for a feature.
struct FeatureNeed {
    /// True if the pipeline needs it.
    is_needed: bool,
    feature: DeviceFeature,
    /// The state that needs it.
    state: &'static str,
}

/// Fails for the first needed feature that the device lacks.
fn require_all(needs: &[FeatureNeed]) -> Result<(), Error> {
    match needs.iter().find(|need| need.is_needed && !need.feature.is_supported) {
        None => Ok(()),
        Some(FeatureNeed { feature, state, .. }) => {
            Err(Error::FeatureNotPresent(format!("{state} (feature {})", feature.name)))
        }
    }
}

/// True if alpha may determine coverage.
pub(crate) fn uses_coverage_alpha(graphics: &GraphicsState, fixed: &FixedFunctionState) -> bool {
    fixed.draw.alpha_to_coverage || graphics.is_dynamic(vk::DynamicState::ALPHA_TO_COVERAGE_ENABLE_EXT)
}

/// True for each colour attachment whose source has an effect.
pub(crate) fn live_color_outputs(graphics: &GraphicsState, fixed: &FixedFunctionState) -> Vec<bool> {
    // Dynamic state may be enabled.
    let any_mask = graphics.is_dynamic(vk::DynamicState::COLOR_WRITE_MASK_EXT);
    let mut live_outputs: Vec<_> = std::iter::zip(&fixed.attachments, &graphics.fragment_output.color_formats)
        .map(|(attachment, format)| (any_mask || attachment.write_mask != 0) && *format != vk::Format::UNDEFINED)
        .collect();
    if uses_coverage_alpha(graphics, fixed) {
        match live_outputs.first_mut() {
            Some(first) => *first = true,
            None => live_outputs.push(true),
        }
    }
    live_outputs
}
