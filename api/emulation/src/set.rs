//! A sorted set that is being recorded: its state is that of its first draw.

use std::sync::Arc;

use ash::vk;

use crate::bindings::Bindings;
use crate::cameras::{Cameras, SeenBy};
use crate::depth_stencil::TestState;
use crate::draw_call::{Draw, ShaderDraw};
use crate::lens::Lens;
use crate::made::Area;
use crate::pipeline::{self, Pipeline};
use crate::support::MAX_GAUSSIANS;
use crate::work::{DrawSource, Values, Work};

/// The extension's dynamic states, as far as they have been set.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DynamicValues {
    pub(crate) order: Option<u32>,
    pub(crate) is_compensated: Option<bool>,
    pub(crate) low_pass: Option<f32>,
    pub(crate) alpha_floor: Option<f32>,
    pub(crate) alpha_ceiling: Option<f32>,
    pub(crate) transmittance_floor: Option<f32>,
    pub(crate) degree: Option<u32>,
    pub(crate) exponential_error: Option<f32>,
    pub(crate) contribution_budget: Option<f32>,
}

impl DynamicValues {
    /// The values of a draw with a pipeline; `None` if one has not been set, or is not valid.
    pub(crate) fn of(&self, pipeline: &Pipeline) -> Option<Values> {
        fn chosen<T: Copy>(pipeline: &Pipeline, name: vk::DynamicState, dynamic: Option<T>, own: T) -> Option<T> {
            if pipeline.is_dynamic(name) { dynamic } else { Some(own) }
        }
        let state = &pipeline.state;
        let is_compensated = state.antialiasing.as_raw() == 1;
        let values = Values {
            order: chosen(pipeline, pipeline::ORDER, self.order, state.order.as_raw().cast_unsigned())?,
            is_compensated: chosen(pipeline, pipeline::ANTIALIASING, self.is_compensated, is_compensated)?,
            low_pass: chosen(pipeline, pipeline::LOW_PASS_VARIANCE, self.low_pass, state.low_pass_variance)?,
            alpha_floor: chosen(pipeline, pipeline::ALPHA_FLOOR, self.alpha_floor, state.alpha_floor)?,
            alpha_ceiling: chosen(pipeline, pipeline::ALPHA_CEILING, self.alpha_ceiling, state.alpha_ceiling)?,
            transmittance_floor: chosen(
                pipeline,
                pipeline::TRANSMITTANCE_FLOOR,
                self.transmittance_floor,
                state.transmittance_floor,
            )?,
            degree: chosen(
                pipeline,
                pipeline::SPHERICAL_HARMONICS_DEGREE,
                self.degree,
                state.spherical_harmonics_degree,
            )?,
        };
        chosen(pipeline, pipeline::EXPONENTIAL_ERROR, self.exponential_error, 0.0)?;
        chosen(pipeline, pipeline::CONTRIBUTION_BUDGET, self.contribution_budget, 0.0)?;
        let is_valid = values.order <= 2
            && values.low_pass.is_finite()
            && values.low_pass >= 0.0
            && (0.0..=1.0).contains(&values.alpha_floor)
            && values.alpha_ceiling > 0.0
            && values.alpha_ceiling <= 1.0
            && values.alpha_ceiling >= values.alpha_floor
            && (0.0..1.0).contains(&values.transmittance_floor)
            && values.degree <= state.spherical_harmonics_degree;
        is_valid.then_some(values)
    }
}

/// The state that all draws of a set share.
#[derive(Clone)]
pub(crate) struct SetState {
    pub(crate) pipeline: Arc<Pipeline>,
    pub(crate) values: Values,
    pub(crate) cameras: Cameras,
    /// Depth and stencil tests, if something is tested.
    pub(crate) tests: Option<TestState>,
    pub(crate) viewport: vk::Viewport,
    pub(crate) scissor: vk::Rect2D,
    /// Descriptor sets and push constants of a resolve shader, if there is one.
    pub(crate) bindings: Option<Arc<Bindings>>,
}

impl SetState {
    /// Reports whether a draw with another state belongs to the set.
    pub(crate) fn is_shared_with(&self, other: &Self) -> bool {
        let viewport = |v: &vk::Viewport| [v.x, v.y, v.width, v.height].map(f32::to_bits);
        let depths = |v: &vk::Viewport| [v.min_depth, v.max_depth].map(f32::to_bits);
        let are_tests_same = match (&self.tests, &other.tests) {
            (Some(own), Some(others)) => own.is_same(others) && depths(&self.viewport) == depths(&other.viewport),
            (own, others) => own.is_none() && others.is_none(),
        };
        let cameras = match (&self.cameras, &other.cameras) {
            (Cameras::Command(own), Cameras::Command(others)) => {
                own.len() == others.len() && own.iter().zip(others).all(|(own, other)| own.is_same(other))
            }
            // What is bound is that of the first draw.
            _ => true,
        };
        Arc::ptr_eq(&self.pipeline, &other.pipeline)
            && self.values == other.values
            && cameras
            && are_tests_same
            && viewport(&self.viewport) == viewport(&other.viewport)
            && self.scissor == other.scissor
    }
}

/// A set.
pub(crate) struct Set {
    pub(crate) state: SetState,
    pub(crate) draws: Vec<Draw>,
    pub(crate) sources: Vec<DrawSource>,
    /// Of each draw, where a vertex shader projects.
    pub(crate) shader_draws: Vec<ShaderDraw>,
    /// The most Gaussians.
    pub(crate) gaussians: u64,
}

impl Set {
    pub(crate) fn new(state: SetState) -> Self {
        Self { state, draws: Vec::new(), sources: Vec::new(), shader_draws: Vec::new(), gaussians: 0 }
    }

    pub(crate) fn push(&mut self, draw: Draw, sources: &[DrawSource], gaussians: u64) {
        self.draws.push(draw);
        self.sources.extend_from_slice(sources);
        self.gaussians = (self.gaussians + gaussians).min(u64::from(MAX_GAUSSIANS));
    }

    /// The work of the set in a pass; `None` if it reaches no pixel.
    pub(crate) fn into_work(self, pass_area: Option<vk::Rect2D>) -> Option<Work> {
        let state = self.state;
        let v = &state.viewport;
        let (x, y) = (v.x + v.width.min(0.0), v.y + v.height.min(0.0));
        let viewport = [x, y, v.width.abs(), v.height.abs()];
        let center = [(v.x, v.width), (v.y, v.height)].map(|(at, size)| f64::from(at) + 0.5 * f64::from(size));
        let around = vk::Rect2D {
            offset: vk::Offset2D { x: x.floor() as i32, y: y.floor() as i32 },
            extent: vk::Extent2D {
                width: (f64::from(x) + f64::from(viewport[2]) - f64::from(x.floor())).ceil() as u32,
                height: (f64::from(y) + f64::from(viewport[3]) - f64::from(y.floor())).ceil() as u32,
            },
        };
        let area = common(around, state.scissor);
        let area = pass_area.map_or(area, |pass| common(area, pass));
        // Framebuffers begin at 0.
        let positive = vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent: vk::Extent2D { width: i32::MAX as u32, height: i32::MAX as u32 },
        };
        let area = common(area, positive);
        let lenses = match &state.cameras {
            Cameras::Command(cameras) if cameras.iter().any(|seen| seen.lens.is_some()) => {
                let size = [viewport[2], viewport[3]];
                let lens = |seen: &SeenBy| seen.lens.map(|lens| Lens::new(&lens, &seen.camera, size));
                cameras.iter().map(|seen| lens(seen).unwrap_or_default()).collect()
            }
            _ => Vec::new(),
        };
        let is_empty = area.extent.width == 0 || area.extent.height == 0 || self.gaussians == 0;
        let work = Work {
            pipeline: state.pipeline,
            values: state.values,
            cameras: state.cameras,
            lenses,
            tests: state.tests,
            depth_range: [v.min_depth, v.max_depth],
            viewport,
            center,
            half_size: [0.5 * v.width, 0.5 * v.height],
            area: Area { origin: [area.offset.x, area.offset.y], size: [area.extent.width, area.extent.height] },
            draws: self.draws,
            sources: self.sources,
            shader_draws: self.shader_draws,
            gaussians: self.gaussians,
            bindings: state.bindings,
            pixels: None,
        };
        (!is_empty).then_some(work)
    }
}

/// The common part of two rectangles.
fn common(a: vk::Rect2D, b: vk::Rect2D) -> vk::Rect2D {
    fn along(a: i32, a_size: u32, b: i32, b_size: u32) -> (i32, u32) {
        let first = i64::from(a).max(i64::from(b));
        let end = (i64::from(a) + i64::from(a_size)).min(i64::from(b) + i64::from(b_size));
        (first.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32, u32::try_from(end - first).unwrap_or(0))
    }
    let (x, width) = along(a.offset.x, a.extent.width, b.offset.x, b.extent.width);
    let (y, height) = along(a.offset.y, a.extent.height, b.offset.y, b.extent.height);
    vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } }
}
