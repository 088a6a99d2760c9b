//! Depth and stencil tests of a draw, sample by sample, in their literal form.
//!
//! Depths here are the numbers that the attachment's format holds ([`OracleDepthFormat::code`]). The caller gives the
//! values that a sample holds before the draw. The draw's own writes do not affect its tests.

use ash::vk;
use rayon::prelude::*;

use super::error_model::{PrecisionClass, UNIT_ROUNDOFF, relaxed};
use super::own_axes::RayDepth;
use super::pixel::{Outcome, Pixel};
use super::rays;
use super::render::{Bound, Projected, Reference, collect};
use super::splat::{Alpha, Splat};
use super::{OracleCamera, OracleModel, OracleOrder, OracleScene, OracleState, Rules};

/// The format of a depth attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OracleDepthFormat {
    /// An integer of this many bits, of which the greatest is 1.
    Unorm(u32),
    /// binary32.
    Float,
}

impl OracleDepthFormat {
    /// The nearest number to a depth, which is clamped to 0 to 1.
    pub fn code(self, depth: f64) -> u32 {
        self.code_by(f64::round_ties_even, depth)
    }

    /// The number of a depth, which is clamped to 0 to 1. Integers are rounded by `round`.
    fn code_by(self, round: fn(f64) -> f64, depth: f64) -> u32 {
        let depth = depth.clamp(0.0, 1.0);
        match self {
            Self::Float => (depth as f32).to_bits(),
            Self::Unorm(bits) => round(depth * ((1u64 << bits) - 1) as f64) as u32,
        }
    }

    /// The depth that a number means.
    pub fn depth(self, code: u32) -> f64 {
        match self {
            Self::Float => f32::from_bits(code).into(),
            Self::Unorm(bits) => f64::from(code) / ((1u64 << bits) - 1) as f64,
        }
    }
}

/// The stencil state of front faces. Each operation is applied in the case that its name says.
#[derive(Clone, Copy, Debug)]
pub struct OracleStencil {
    /// The operations, the comparison, the masks and the reference. The comparison is between the masked reference and
    /// the masked stored value.
    pub state: vk::StencilOpState,
}

impl OracleStencil {
    fn passes(&self, stored: u8) -> bool {
        let s = &self.state;
        compare(s.compare_op, s.reference & s.compare_mask, u32::from(stored) & s.compare_mask)
    }

    fn apply(&self, op: vk::StencilOp, stored: u8) -> u8 {
        let value = match op {
            vk::StencilOp::KEEP => stored,
            vk::StencilOp::ZERO => 0,
            vk::StencilOp::REPLACE => self.state.reference as u8,
            vk::StencilOp::INCREMENT_AND_CLAMP => stored.saturating_add(1),
            vk::StencilOp::DECREMENT_AND_CLAMP => stored.saturating_sub(1),
            vk::StencilOp::INVERT => !stored,
            vk::StencilOp::INCREMENT_AND_WRAP => stored.wrapping_add(1),
            vk::StencilOp::DECREMENT_AND_WRAP => stored.wrapping_sub(1),
            other => panic!("{other:?} is no stencil operation"),
        };
        let mask = self.state.write_mask as u8;
        stored & !mask | value & mask
    }
}

/// The tests of a draw, and the mapping to depths.
#[derive(Clone, Copy, Debug)]
pub struct OracleTests {
    /// The camera's `depthCoefficients`.
    pub depth_coefficients: [f32; 2],
    /// True if depths before the viewport are from -1, not from 0, to 1.
    pub negative_one_to_one: bool,
    /// The viewport's depths of 0 and of 1.
    pub depth_range: [f32; 2],
    /// The attachment's depth format.
    pub format: OracleDepthFormat,
    /// The comparison, and true if depth is written.
    pub depth: Option<(vk::CompareOp, bool)>,
    /// The least and the greatest stored depth.
    pub bounds: Option<[f32; 2]>,
    /// The stencil test.
    pub stencil: Option<OracleStencil>,
}

impl OracleTests {
    /// The depth of a centre with depth variable `z`, as the attachment holds it.
    pub fn code(&self, model: OracleModel, rules: &Rules, z: f32) -> u32 {
        let [c0, c1] = self.depth_coefficients.map(f64::from);
        let [near, far] = self.depth_range.map(f64::from);
        let z = f64::from(z);
        let depth = match model {
            OracleModel::Orthographic if rules.orthographic_depth_is_linear => c0 + c1 * z,
            _ => c0 + c1 / z,
        };
        let depth = if self.negative_one_to_one { depth / 2.0 + 0.5 } else { depth };
        let round = if rules.depths_round_down { f64::floor } else { f64::round_ties_even };
        self.format.code_by(round, near + depth.clamp(0.0, 1.0) * (far - near))
    }
}

impl OracleTests {
    /// The depths that a centre may have in the attachment, if its depth variable has the error `z_error`.
    pub fn codes(&self, model: OracleModel, rules: &Rules, (z, z_error): (f32, f64)) -> DepthCodes {
        let nominal = self.code(model, rules, z);
        if rules.precision == PrecisionClass::Full {
            return DepthCodes { nominal, least: nominal, greatest: nominal };
        }
        let [c0, c1] = self.depth_coefficients.map(|c| f64::from(c).abs());
        let [near, far] = self.depth_range.map(f64::from);
        let z_error = z_error + UNIT_ROUNDOFF * f64::from(z).abs();
        let (varying, by_z) = match model {
            OracleModel::Orthographic => (c1 * f64::from(z).abs(), c1),
            _ => (c1 / f64::from(z).abs(), c1 / f64::from(z).powi(2)),
        };
        let relative = relaxed::MAPPING * UNIT_ROUNDOFF;
        let error =
            (by_z * z_error + relative * (c0 + varying)) * (far - near).abs() + relative * near.abs().max(far.abs());
        let depth = self.format.depth(nominal);
        let code = |depth: f64| self.format.code(depth);
        DepthCodes { nominal, least: code(depth - error), greatest: code(depth + error) }
    }
}

/// The depths that a Gaussian may have in an attachment, as its format holds them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthCodes {
    /// That of binary64.
    pub nominal: u32,
    /// The least.
    pub least: u32,
    /// The greatest.
    pub greatest: u32,
}

impl DepthCodes {
    /// The one depth of a pixel that stores what it stored before.
    fn stored(code: u32) -> Self {
        Self { nominal: code, least: code, greatest: code }
    }

    /// Reports whether a depth may be stored.
    pub fn contains(&self, code: u32) -> bool {
        (self.least..=self.greatest).contains(&code)
    }

    /// The nominal result of the comparison with a stored depth, and whether it may be decided otherwise.
    fn compare(&self, op: vk::CompareOp, stored: u32) -> (bool, bool) {
        let nominal = compare(op, self.nominal, stored);
        let equal = self.contains(stored) && compare(op, stored, stored) != nominal;
        (nominal, equal || [self.least, self.greatest].iter().any(|&code| compare(op, code, stored) != nominal))
    }
}

/// `reference op stored`.
pub fn compare<T: PartialOrd>(op: vk::CompareOp, reference: T, stored: T) -> bool {
    match op {
        vk::CompareOp::NEVER => false,
        vk::CompareOp::LESS => reference < stored,
        vk::CompareOp::EQUAL => reference == stored,
        vk::CompareOp::LESS_OR_EQUAL => reference <= stored,
        vk::CompareOp::GREATER => reference > stored,
        vk::CompareOp::NOT_EQUAL => reference != stored,
        vk::CompareOp::GREATER_OR_EQUAL => reference >= stored,
        vk::CompareOp::ALWAYS => true,
        other => panic!("{other:?} is no comparison"),
    }
}

/// The stored values of one sample of each pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stored {
    /// Numbers of depths.
    pub depth: Vec<u32>,
    /// Stencils.
    pub stencil: Vec<u8>,
}

/// The results of a draw at one sample of each pixel.
#[derive(Clone, Debug)]
pub struct TestedReference {
    /// Its colours.
    pub color: Reference,
    /// Every depth that it may store afterwards, the binary64 one among them; `None` if that is not known.
    pub depth: Vec<Option<Vec<DepthCodes>>>,
    /// Every stencil that it may store afterwards.
    pub stencil: Vec<Vec<u8>>,
    /// Samples that have a fragment for certain, and those that may have one.
    pub fragments: [usize; 2],
}

/// One sample while Gaussians are added to it.
struct Sample<'a> {
    pixel: Pixel,
    /// In the per-pixel order, or where keys have errors: the Gaussians that have passed and are not sorted yet.
    passed: Vec<(RayDepth, (&'a Splat, Alpha))>,
    stored: (u32, u8),
    /// True if depth bounds and stencil let it pass.
    candidate: bool,
    stencil_passes: bool,
    /// True if an alpha certainly reached the floor, and if one may have reached it.
    reached: [bool; 2],
}

impl Sample<'_> {
    fn new(tests: &OracleTests, rules: &Rules, stored: (u32, u8)) -> Self {
        let depth = tests.format.depth(stored.0);
        let within = |[least, greatest]: [f32; 2]| {
            let [least, greatest] = [least, greatest].map(|bound| {
                let code = tests.format.code(bound.into());
                tests.format.depth(code)
            });
            (least..=greatest).contains(&depth)
        };
        Self {
            pixel: Pixel::EMPTY,
            passed: Vec::new(),
            stored,
            candidate: tests.bounds.is_none_or(within),
            stencil_passes: tests.stencil.is_none_or(|stencil| stencil.passes(stored.1)),
            reached: [!rules.failures_need_gaussian; 2],
        }
    }

    /// Notes if a Gaussian reaches the pixel at all.
    fn reach(&mut self, alpha: Alpha, state: &OracleState) {
        let floor = f64::from(state.alpha_floor);
        let is_whole = !alpha.is_cut && !alpha.cut_undecidable;
        self.reached[0] |= is_whole && (floor == 0.0 || alpha.value - alpha.error >= floor);
        self.reached[1] |= !alpha.is_certainly_cut() && alpha.value + alpha.error >= floor;
    }

    /// The values that it may store afterwards: depths, if known, and stencils.
    fn after(&self, tests: &OracleTests, rules: &Rules, model: OracleModel) -> (Option<Vec<DepthCodes>>, Vec<u8>) {
        let writes = tests.depth.is_some_and(|(_, write)| write);
        let (mut depths, mut stencils) = (Some(Vec::new()), Vec::new());
        for outcome in self.pixel.outcomes() {
            let Outcome { covered, medians, .. } = &outcome;
            match &mut depths {
                Some(depths) if *covered && writes => {
                    depths.extend(medians.iter().map(|&median| tests.codes(model, rules, median)));
                }
                Some(depths) => depths.push(DepthCodes::stored(self.stored.0)),
                None => {}
            }
            if *covered && writes && outcome.medians_exhausted {
                depths = None;
            }
            stencils.extend(self.stencils(tests, rules, *covered));
        }
        (depths, stencils)
    }

    fn stencils(&self, tests: &OracleTests, rules: &Rules, covered: bool) -> Vec<u8> {
        let old = self.stored.1;
        let Some(stencil) = tests.stencil.filter(|_| self.candidate) else {
            return vec![old];
        };
        let state = &stencil.state;
        let apply = |op| (0..rules.stencil_repetitions).fold(old, |value, _| stencil.apply(op, value));
        if covered {
            return vec![apply(state.pass_op)];
        }
        let failed = if self.stencil_passes { state.depth_fail_op } else { state.fail_op };
        let failed = apply(failed);
        match self.reached {
            [true, _] => vec![failed],
            [false, true] => vec![failed, old],
            [false, false] => vec![old],
        }
    }
}

/// Draws every Gaussian, where it passes, at one sample of each pixel.
pub fn render_tested(
    scene: &OracleScene,
    camera: &OracleCamera,
    state: &OracleState,
    tests: &OracleTests,
    stored: &Stored,
) -> TestedReference {
    let projected = Projected::new(scene, camera, state);
    let rules = &state.rules;
    let codes = |splat: &Splat| tests.codes(camera.model, rules, (splat.z, splat.error.rounding().depth));
    let codes: Vec<DepthCodes> = projected.splats.iter().map(codes).collect();
    let bounds: Vec<Bound> = projected.splats.iter().map(|splat| Bound::new(splat, state)).collect();
    let per_pixel = state.order == OracleOrder::PerPixel;
    let has_uncertain_keys = rules.precision == PrecisionClass::Relaxed && state.order.has_keys();
    let row = |y: u32| {
        let first = (y * camera.width) as usize;
        let mut row: Vec<Sample> = (first..first + camera.width as usize)
            .map(|at| {
                let stencil = stored.stencil.get(at).copied().unwrap_or(0);
                Sample::new(tests, &state.rules, (stored.depth[at], stencil))
            })
            .collect();
        for ((splat, bound), &code) in projected.splats.iter().zip(&bounds).zip(&codes) {
            if !bound.rows(camera.height).contains(&y) {
                continue;
            }
            for x in bound.columns(y, camera.width) {
                let sample = &mut row[x as usize];
                if !sample.candidate {
                    continue;
                }
                let alpha = splat.alpha(x, y, state);
                sample.reach(alpha, state);
                if !sample.stencil_passes {
                    continue;
                }
                let (passes, is_uncertain) =
                    tests.depth.map_or((true, false), |(op, _)| code.compare(op, sample.stored.0));
                if !passes && !is_uncertain {
                    continue;
                }
                let alpha = Alpha {
                    is_cut: alpha.is_cut || !passes,
                    cut_undecidable: alpha.cut_undecidable || is_uncertain,
                    ..alpha
                };
                if per_pixel {
                    let center = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                    let depth = splat.own_axes.depth(camera, center);
                    sample.passed.push((depth, (splat, alpha)));
                } else if has_uncertain_keys {
                    let depth = RayDepth { value: splat.key, error: splat.error.rounding().depth };
                    sample.passed.push((depth, (splat, alpha)));
                } else if !sample.pixel.is_finished() {
                    sample.pixel.add(splat, alpha, state);
                }
            }
        }
        for sample in row.iter_mut().filter(|_| per_pixel || has_uncertain_keys) {
            let passed = std::mem::take(&mut sample.passed);
            sample.pixel = rays::composite(
                &passed,
                |(a, _), (b, _)| has_uncertain_keys && a.has_key_of(b),
                |pixel, (splat, alpha)| pixel.add(splat, *alpha, state),
            );
        }
        row
    };
    let samples: Vec<Sample> = (0..camera.height).into_par_iter().flat_map_iter(row).collect();
    let (depth, stencil) = samples.iter().map(|sample| sample.after(tests, rules, camera.model)).unzip();
    let covered = |sample: &Sample| -> Vec<bool> {
        let outcomes = sample.pixel.outcomes();
        outcomes.map(|outcome| outcome.covered).collect()
    };
    let count = |holds: fn(&[bool]) -> bool| {
        let holds = |sample: &&Sample| holds(&covered(sample));
        samples.iter().filter(holds).count()
    };
    TestedReference {
        color: collect([camera.width, camera.height], &projected, || samples.iter().map(|s| &s.pixel)),
        depth,
        stencil,
        fragments: [
            count(|outcomes| outcomes.iter().all(|covered| *covered)),
            count(|outcomes| outcomes.contains(&true)),
        ],
    }
}
