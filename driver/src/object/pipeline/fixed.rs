//! Fixed-function state of points, lines and triangles. What a switch governs is kept beside the switch, as either may
//! be dynamic without the other.

use super::setting::{self, Setting, Settings};
use super::{GraphicsPipelineInfo, blend, convert, viewport};
use crate::capabilities::limits;
use crate::error::Error;
use crate::lower::rendering;
use crate::registry::features::SUPPORTED;
use ash::vk;
use simdevice::state::{
    BlendFactor, CompareOp, DepthBias, DepthStencil, DepthTest, DrawState, PolygonMode,
    StencilFace, StencilOp, Topology,
};

/// A feature of the device: if it works, and its name.
macro_rules! supported {
    ($feature:ident) => {
        (SUPPORTED.$feature, stringify!($feature))
    };
}

/// The state of a pipeline, or of a draw.
#[derive(Clone, Debug)]
pub(crate) struct FixedState {
    /// All but depth bias, depth and stencil.
    pub(crate) draw: DrawState,
    depth_bias_enable: bool,
    depth_bias: DepthBias,
    depth_test: bool,
    depth_write: bool,
    depth_compare: CompareOp,
    depth_bounds_test: bool,
    depth_bounds: (f32, f32),
    stencil_test: bool,
    stencil: [StencilFace; 2],
}

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

impl FixedState {
    /// Validates and converts the static state of a pipeline.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(super) fn new(info: &GraphicsPipelineInfo) -> Result<Self, Error> {
        let mut state = Self::of(info, convert::topology(info.topology)?)?;
        if !info.discards() {
            state.set_viewports(info)?;
            state.set_samples(info)?;
            state.set_depth_stencil(info)?;
            state.set_blend(info)?;
        }
        Ok(state)
    }

    /// As [`FixedState::new`], of Gaussians: what becomes of their fragments.
    ///
    /// # Errors
    /// As there.
    pub(super) fn of_gaussians(info: &GraphicsPipelineInfo) -> Result<Self, Error> {
        // Nothing comes of the topology.
        let mut state = Self::of(info, Topology::TriangleStrip)?;
        if !info.multisample.rasterization_samples.is_empty() {
            state.set_samples(info)?;
        }
        state.set_depth_stencil(info)?;
        state.set_blend(info)?;
        Ok(state)
    }

    /// Vertex assembly and rasterization; the rest such that it does nothing.
    fn of(info: &GraphicsPipelineInfo, topology: Topology) -> Result<Self, Error> {
        let raster = &info.rasterization;
        let polygon_mode = convert::polygon_mode(raster.polygon_mode)?;
        let needs = [
            (
                polygon_mode != PolygonMode::Fill,
                supported!(fill_mode_non_solid),
                "a polygon mode but FILL",
            ),
            (
                raster.depth_clamp_enable != vk::FALSE,
                supported!(depth_clamp),
                "depthClampEnable",
            ),
            (
                raster.depth_bias_enable != vk::FALSE && raster.depth_bias_clamp != 0.0,
                supported!(depth_bias_clamp),
                "depthBiasClamp",
            ),
            (
                info.line_width() != 1.0,
                supported!(wide_lines),
                "a line width but 1",
            ),
        ];
        require_all(&needs)?;
        let is_list = matches!(
            topology,
            Topology::PointList | Topology::LineList | Topology::TriangleList
        );
        if info.primitive_restart
            && is_list
            && !info.is_dynamic(vk::DynamicState::PRIMITIVE_TOPOLOGY)
        {
            return Err(Error::usage(
                "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-06252",
                format!("primitiveRestartEnable is VK_TRUE, but {topology:?} has no restart"),
            ));
        }
        let draw = DrawState {
            topology,
            primitive_restart: info.primitive_restart,
            viewports: Vec::new(),
            scissors: Vec::new(),
            depth_clamp: raster.depth_clamp_enable != vk::FALSE,
            rasterizer_discard: raster.rasterizer_discard_enable != vk::FALSE,
            polygon_mode,
            cull_front: false,
            cull_back: false,
            front_clockwise: false,
            depth_bias: None,
            line_width: info.line_width(),
            provoking_last: info.provoking_last,
            samples: 1,
            sample_mask: u32::MAX,
            sample_shading: false,
            alpha_to_coverage: false,
            alpha_to_one: false,
            depth_stencil: DepthStencil {
                depth: None,
                bounds: None,
                stencil: None,
            },
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
        };
        let mut state = Self {
            draw,
            depth_bias_enable: raster.depth_bias_enable != vk::FALSE,
            depth_bias: DepthBias {
                constant: raster.depth_bias_constant_factor,
                clamp: raster.depth_bias_clamp,
                slope: raster.depth_bias_slope_factor,
            },
            depth_test: false,
            depth_write: false,
            depth_compare: CompareOp::Always,
            depth_bounds_test: false,
            depth_bounds: (0.0, 1.0),
            stencil_test: false,
            stencil: [KEEP; 2],
        };
        state.set(setting::cull_mode(raster.cull_mode));
        state.set(setting::front_face(raster.front_face));
        Ok(state)
    }

    fn set_viewports(&mut self, info: &GraphicsPipelineInfo) -> Result<(), Error> {
        use vk::DynamicState as S;
        let counts = [info.viewport_count, info.scissor_count];
        let dynamic = [
            info.is_dynamic(S::VIEWPORT_WITH_COUNT),
            info.is_dynamic(S::SCISSOR_WITH_COUNT),
        ];
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
                format!(
                    "there are {} viewports, but {} scissors",
                    counts[0], counts[1]
                ),
            ));
        }
        let has = |given: usize, count: u32| given == count as usize;
        let static_viewports = !(dynamic[0] || info.is_dynamic(S::VIEWPORT));
        let static_scissors = !(dynamic[1] || info.is_dynamic(S::SCISSOR));
        if (static_viewports && !has(info.viewports.len(), counts[0]))
            || (static_scissors && !has(info.scissors.len(), counts[1]))
        {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-04130",
                "the pipeline has no viewports or scissors, and they are not dynamic",
            ));
        }
        if static_viewports {
            self.draw.viewports = info.viewports.iter().copied().map(viewport).collect();
        }
        if static_scissors {
            self.draw.scissors = info.scissors.iter().copied().map(rendering::rect).collect();
        }
        Ok(())
    }

    fn set_samples(&mut self, info: &GraphicsPipelineInfo) -> Result<(), Error> {
        let multisample = &info.multisample;
        let samples = multisample.rasterization_samples;
        let supported = limits::properties().framebuffer_no_attachments_sample_counts;
        let count = samples.as_raw();
        if !count.is_power_of_two() || !supported.contains(samples) {
            return Err(Error::FeatureNotPresent(format!(
                "rasterizationSamples {samples:?} (there are {supported:?})"
            )));
        }
        let needs = [
            (
                multisample.sample_shading_enable != vk::FALSE,
                supported!(sample_rate_shading),
                "sampleShadingEnable",
            ),
            (
                multisample.alpha_to_one_enable != vk::FALSE,
                supported!(alpha_to_one),
                "alphaToOneEnable",
            ),
        ];
        require_all(&needs)?;
        let draw = &mut self.draw;
        draw.samples = count;
        draw.sample_mask = info.sample_mask;
        // The device shades either once or every sample, and as many as are asked for is at least.
        let shaded = (multisample.min_sample_shading * count as f32).ceil();
        draw.sample_shading = multisample.sample_shading_enable != vk::FALSE && shaded > 1.0;
        draw.alpha_to_coverage = multisample.alpha_to_coverage_enable != vk::FALSE;
        draw.alpha_to_one = multisample.alpha_to_one_enable != vk::FALSE;
        Ok(())
    }

    fn set_depth_stencil(&mut self, info: &GraphicsPipelineInfo) -> Result<(), Error> {
        let Some(state) = &info.depth_stencil else {
            return Ok(());
        };
        let bounds_test = state.depth_bounds_test_enable != vk::FALSE;
        require_all(&[(
            bounds_test,
            supported!(depth_bounds),
            "depthBoundsTestEnable",
        )])?;
        self.depth_test = state.depth_test_enable != vk::FALSE;
        self.depth_write = state.depth_write_enable != vk::FALSE;
        self.depth_bounds_test = bounds_test;
        self.depth_bounds = (state.min_depth_bounds, state.max_depth_bounds);
        // What isn't used may hold anything.
        let may_test = |enabled, state| enabled || info.is_dynamic(state);
        let tests_depth = may_test(self.depth_test, vk::DynamicState::DEPTH_TEST_ENABLE);
        if tests_depth && !info.is_dynamic(vk::DynamicState::DEPTH_COMPARE_OP) {
            self.depth_compare = convert::compare_op(state.depth_compare_op)?;
        }
        self.stencil_test = state.stencil_test_enable != vk::FALSE;
        let tests_stencil = may_test(self.stencil_test, vk::DynamicState::STENCIL_TEST_ENABLE);
        let static_ops = tests_stencil && !info.is_dynamic(vk::DynamicState::STENCIL_OP);
        for (face, given) in [state.front, state.back].into_iter().enumerate() {
            if static_ops {
                let ops = setting::stencil_ops(
                    given.fail_op,
                    given.pass_op,
                    given.depth_fail_op,
                    given.compare_op,
                )?;
                self.set(Setting::StencilOp(face, ops));
            }
            self.set(Setting::StencilCompareMask(face, given.compare_mask as u8));
            self.set(Setting::StencilWriteMask(face, given.write_mask as u8));
            self.set(Setting::StencilReference(face, given.reference as u8));
        }
        Ok(())
    }

    fn set_blend(&mut self, info: &GraphicsPipelineInfo) -> Result<(), Error> {
        if let Some(op) = info.logic_op {
            require_all(&[(true, supported!(logic_op), "logicOpEnable")])?;
            self.draw.logic_op = Some(convert::logic_op(op)?);
        }
        self.draw.blend = blend::blend_states(info)?;
        self.draw.blend_constants = info.blend_constants;
        Ok(())
    }

    /// Takes over a setting of the command buffer.
    pub(crate) fn set(&mut self, setting: Setting) {
        match setting {
            Setting::LineWidth(width) => self.draw.line_width = width,
            Setting::DepthBias(bias) => self.depth_bias = bias,
            Setting::DepthBiasEnable(enable) => self.depth_bias_enable = enable,
            Setting::BlendConstants(constants) => self.draw.blend_constants = constants,
            Setting::DepthBounds(min, max) => self.depth_bounds = (min, max),
            Setting::DepthBoundsTestEnable(enable) => self.depth_bounds_test = enable,
            Setting::DepthTestEnable(enable) => self.depth_test = enable,
            Setting::DepthWriteEnable(enable) => self.depth_write = enable,
            Setting::DepthCompareOp(op) => self.depth_compare = op,
            Setting::StencilTestEnable(enable) => self.stencil_test = enable,
            Setting::StencilOp(face, ops) => {
                let face = &mut self.stencil[face];
                face.fail = ops.fail;
                face.pass = ops.pass;
                face.depth_fail = ops.depth_fail;
                face.compare = ops.compare;
            }
            Setting::StencilCompareMask(face, mask) => self.stencil[face].compare_mask = mask,
            Setting::StencilWriteMask(face, mask) => self.stencil[face].write_mask = mask,
            Setting::StencilReference(face, reference) => self.stencil[face].reference = reference,
            Setting::CullMode { front, back } => {
                self.draw.cull_front = front;
                self.draw.cull_back = back;
            }
            Setting::FrontFaceClockwise(clockwise) => self.draw.front_clockwise = clockwise,
            Setting::PrimitiveTopology(topology) => self.draw.topology = topology,
            Setting::PrimitiveRestartEnable(enable) => self.draw.primitive_restart = enable,
            Setting::RasterizerDiscardEnable(enable) => self.draw.rasterizer_discard = enable,
        }
    }

    /// Takes over what a command buffer has set of the states that are `dynamic`.
    ///
    /// # Errors
    /// The first that it has not set, though the draw depends on it.
    pub(crate) fn set_dynamic(
        &mut self,
        dynamic: &[vk::DynamicState],
        settings: &Settings,
    ) -> Result<(), vk::DynamicState> {
        let mut missing = Vec::new();
        for &state in dynamic {
            let mut any = false;
            for setting in settings.of(state) {
                self.set(setting);
                any = true;
            }
            if !any {
                missing.push(state);
            }
        }
        match missing.into_iter().find(|&state| self.depends_on(state)) {
            Some(state) => Err(state),
            None => Ok(()),
        }
    }

    /// Whether a draw needs what is dynamic to be set.
    fn depends_on(&self, state: vk::DynamicState) -> bool {
        use vk::DynamicState as S;
        let draw = &self.draw;
        match state {
            S::PRIMITIVE_TOPOLOGY | S::PRIMITIVE_RESTART_ENABLE | S::RASTERIZER_DISCARD_ENABLE => {
                true
            }
            _ if draw.rasterizer_discard => false,
            S::LINE_WIDTH => {
                draw.polygon_mode == PolygonMode::Line || class(draw.topology) == Class::Lines
            }
            S::DEPTH_BIAS => self.depth_bias_enable,
            S::DEPTH_BOUNDS => self.depth_bounds_test,
            S::DEPTH_WRITE_ENABLE | S::DEPTH_COMPARE_OP => self.depth_test,
            S::STENCIL_OP
            | S::STENCIL_COMPARE_MASK
            | S::STENCIL_WRITE_MASK
            | S::STENCIL_REFERENCE => self.stencil_test,
            S::BLEND_CONSTANTS => draw.logic_op.is_none() && blends_by_constants(draw),
            _ => true,
        }
    }

    /// The state for the device.
    pub(crate) fn lower(&self) -> DrawState {
        DrawState {
            depth_bias: self.depth_bias_enable.then_some(self.depth_bias),
            depth_stencil: DepthStencil {
                depth: self.depth_test.then_some(DepthTest {
                    compare: self.depth_compare,
                    write: self.depth_write,
                }),
                bounds: self.depth_bounds_test.then_some(self.depth_bounds),
                stencil: self.stencil_test.then_some(self.stencil),
            },
            ..self.draw.clone()
        }
    }
}

/// Whether an attachment is blended by the constants.
fn blends_by_constants(state: &DrawState) -> bool {
    let equations = state.blend.iter().filter_map(|blend| blend.equations);
    equations
        .flat_map(|(color, alpha)| {
            [
                color.source,
                color.destination,
                alpha.source,
                alpha.destination,
            ]
        })
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

/// What a topology makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    /// Points.
    Points,
    /// Lines.
    Lines,
    /// Triangles.
    Triangles,
}

/// A topology's class, which a dynamic topology stays in.
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
    }
}

/// Fails for the first need whose feature the device lacks.
fn require_all(needs: &[(bool, (bool, &str), &str)]) -> Result<(), Error> {
    let lacks = |needed: bool, is_supported: bool| needed && !is_supported;
    match needs
        .iter()
        .find(|(needed, (is_supported, _), _)| lacks(*needed, *is_supported))
    {
        None => Ok(()),
        Some((_, (_, feature), what)) => Err(Error::FeatureNotPresent(format!(
            "{what} (feature {feature})"
        ))),
    }
}
