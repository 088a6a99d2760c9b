//! The expected results of a [`Draw`], computed by the oracle, and the comparison of a picture with them.

use std::collections::BTreeMap;

use ash::vk;
use gaurast::vk::GaussianPrecisionGAURAST as Precision;
use gaurast_oracle::compare::{Accuracy, Limits};
use gaurast_oracle::oracle::error_model::PrecisionClass;
use gaurast_oracle::oracle::project::project;
use gaurast_oracle::oracle::{
    DepthCodes, OracleCamera, OracleInstance, OracleScene, OracleState, OracleStencil, OracleTests, Reference, Stored,
    render_binary16, render_bounded, render_tested,
};
use gaurast_oracle::scenes::SceneBuffers;
use half::f16;

use crate::draw::{Blend, Call, ColorFormat, Draw, Equation};
use crate::picture::Picture;

/// The distance from the envelope that the extension's text allows, per unit of the greatest colour above 1.
pub(crate) fn contract(class: PrecisionClass) -> f64 {
    match class {
        PrecisionClass::Full => 5e-6,
        PrecisionClass::Relaxed => 5e-5,
    }
}

/// The contents that the attachments may have after a draw.
#[derive(Clone, Debug)]
pub struct Expected {
    /// The colours.
    pub color: Reference,
    /// Distance that a colour may have from the envelope.
    pub distance: f64,
    /// The depths that each pixel may store, `None` if they are not known; empty if depths are not compared.
    pub depth: Vec<Option<Vec<DepthCodes>>>,
    /// The stencils that each pixel may store; empty if stencils are not compared.
    pub stencil: Vec<Vec<u8>>,
}

/// Contents of the depth and stencil attachment before a draw.
pub fn stored_before(draw: &Draw) -> Stored {
    let Some(depth) = &draw.depth else {
        return Stored::default();
    };
    let tests = tests(draw);
    let model = oracle_camera(draw).model;
    let pixels = (draw.size[0] * draw.size[1]) as usize;
    let width = draw.size[0] as usize;
    let code = |at: usize| match draw.samples {
        1 => tests.code(model, &draw.rules, depth.stripes[(at % width / 5 + at / width / 9) % 6]),
        _ => tests.format.code(1.0),
    };
    let stencils = if depth.has_stencil() { pixels } else { 0 };
    Stored {
        depth: (0..pixels).map(code).collect(),
        stencil: (0..stencils)
            .map(|at| match draw.samples {
                1 => (at / 3 % 8) as u8,
                _ => 0,
            })
            .collect(),
    }
}

/// Computes the expected results of a draw.
pub fn expected(draw: &Draw, before: &Stored) -> Expected {
    let pixels = (draw.size[0] * draw.size[1]) as usize;
    let state = oracle_state(draw);
    let camera = oracle_camera(draw);
    let mut color = Reference {
        width: draw.size[0],
        height: draw.size[1],
        nominal: vec![stored_color(draw, draw.behind.map(f64::from)); pixels],
        alternatives: BTreeMap::new(),
        slack: vec![0.0; pixels],
        exhausted: 0,
        skips: Default::default(),
        undecidable_keys: 0,
    };
    let (mut depth, mut stencil, mut greatest) = (Vec::new(), Vec::new(), 1.0_f64);
    let sets = sets(draw);
    for members in &sets {
        let (scene, instances) = combined_scene(draw, members);
        let scene = OracleScene { requested_degree: draw.degree, instances: &instances, ..scene.as_oracle() };
        let colors = (0..scene.len()).filter_map(|index| project(&scene, &camera, &state, index).ok());
        greatest = colors.flat_map(|splat| splat.color).fold(greatest, f64::max);
        let drawn = if draw.depth.is_some() {
            let tested = render_tested(&scene, &camera, &state, &tests(draw), before);
            if draw.samples == 1 {
                (depth, stencil) = (tested.depth, tested.stencil);
            }
            tested.color
        } else if draw.state.precision == Precision::FLOAT16 {
            render_binary16(&scene, &camera, &state)
        } else {
            render_bounded(&scene, &camera, &state)
        };
        blend(draw, &mut color, &drawn, greatest);
    }
    if draw.depth.as_ref().is_some_and(|depth| !depth.has_stencil()) {
        stencil.clear();
    }
    Expected { color, distance: distance(draw, greatest, sets.len()), depth, stencil }
}

/// The distance that a colour may have from the envelope, if no drawn colour exceeds `greatest`.
fn distance(draw: &Draw, greatest: f64, sets: usize) -> f64 {
    let behind = draw.behind.iter().fold(0.0_f32, |most, c| most.max(*c));
    let range = greatest.max(behind.into());
    let approximate = match draw.approximation {
        Some([error, budget]) => {
            let state = &draw.state;
            let left = f64::from(state.transmittance_floor) / (1.0 - f64::from(state.alpha_ceiling));
            let finished = if error > 0.0 { left } else { 0.0 };
            range * (f64::from(error) + f64::from(budget) + finished)
        }
        None => 0.0,
    };
    // binary16 is defined to the bit; only the blending of its fragments may differ.
    let exact = match draw.state.precision {
        Precision::FLOAT16 => 3e-7,
        _ => contract(draw.rules.precision),
    };
    let stored = draw.format.rounding(2.0 * range) + draw.format.blending(2.0 * range) * sets as f64;
    range * exact + approximate + stored
}

/// The pixels of a viewport, and the position of its corner relative to them.
struct Covered {
    /// The first column and row.
    first: [i64; 2],
    /// Columns and rows.
    size: [u32; 2],
    /// The corner's position in pixels relative to the first pixel, at most half a pixel away.
    corner: [f32; 2],
}

impl Covered {
    /// The pixels whose centres are within the viewport.
    fn of(viewport: &vk::Viewport) -> Self {
        let top = viewport.y + viewport.height.min(0.0);
        let [columns, rows] = [[viewport.x, viewport.width], [top, viewport.height.abs()]].map(|[start, side]| {
            let centre_from = |edge: f32| (edge - 0.5).ceil();
            let first = centre_from(start);
            (first, centre_from(start + side) - first, start - first)
        });
        Self {
            first: [columns.0 as i64, rows.0 as i64],
            size: [columns.1 as u32, rows.1 as u32],
            corner: [columns.2, rows.2],
        }
    }
}

/// The state of a draw.
pub(crate) fn oracle_state(draw: &Draw) -> OracleState {
    let state = OracleState::from(&draw.state)
        .with_footprint(&draw.footprint.unwrap_or_default())
        .with_unscented(&draw.unscented.unwrap_or_default());
    OracleState { rules: draw.rules, ..state }
}

/// The camera of the pixels of the viewport. Where the viewport has fractions of pixels, that is another one unless it
/// clamps no slope.
pub(crate) fn oracle_camera(draw: &Draw) -> OracleCamera {
    let covered = Covered::of(&draw.viewport());
    let mut camera = OracleCamera::new(&draw.camera, covered.size).expect("one of the four models");
    for (principal, corner) in camera.principal.iter_mut().zip(covered.corner) {
        *principal += corner;
    }
    camera.with_distortion(draw.distortion.as_ref())
}

fn tests(draw: &Draw) -> OracleTests {
    let depth = draw.depth.as_ref().expect("a depth attachment");
    let viewport = draw.viewport();
    OracleTests {
        negative_one_to_one: false,
        depth_coefficients: draw.camera.depth_coefficients,
        depth_range: [viewport.min_depth, viewport.max_depth],
        format: depth.oracle_format(),
        depth: depth.test,
        bounds: depth.bounds,
        stencil: depth.stencil.map(|state| OracleStencil { state }),
    }
}

/// A Gaussian of a set: the indices of its vertex and its instance.
type Member = [u32; 2];

/// The sorted sets of a draw. Their members are in the order that breaks ties.
pub(crate) fn sets(draw: &Draw) -> Vec<Vec<Member>> {
    let (mut sets, mut open) = (Vec::<Vec<Member>>::new(), false);
    for call in &draw.calls {
        let members: Vec<Member> = match *call {
            Call::Draw { vertices: [first, count], instances: [first_instance, instances] } => (first_instance
                ..first_instance + instances)
                .flat_map(|instance| (first..first + count).map(move |vertex| [vertex, instance]))
                .collect(),
            Call::Indirect { vertices: [first, count] } => (first..first + count).map(|vertex| [vertex, 0]).collect(),
            Call::Indexed { indices: [first, count], offset } => {
                let indices = &draw.indices[first as usize..][..count as usize];
                indices.iter().map(|index| [index.wrapping_add_signed(offset), 0]).collect()
            }
            Call::EndSet => {
                open = false;
                continue;
            }
        };
        match sets.last_mut() {
            Some(set) if open && draw.merged => set.extend(members),
            _ => sets.push(members),
        }
        open = true;
    }
    sets
}

/// The attributes of a set's Gaussians after conversion to binary32, and their instances.
pub(crate) fn combined_scene(draw: &Draw, members: &[Member]) -> (SceneBuffers, Vec<OracleInstance>) {
    let scene = &draw.scene;
    let triples = (scene.degree + 1).pow(2) as usize;
    let stored = |value: f32| {
        if draw.half { f16::from_f32(value).to_f32() } else { value }
    };
    let mut all = SceneBuffers { degree: scene.degree, ..SceneBuffers::default() };
    let mut instances = Vec::new();
    for &[vertex, instance] in members {
        let at = vertex as usize;
        all.positions.push(scene.positions[at].map(stored));
        all.scales.push(scene.scales[at].map(stored));
        all.rotations.push(scene.rotations[at].map(stored));
        all.opacities.push(stored(scene.opacities[at]));
        let coefficients = &scene.sh[at * triples..][..triples];
        all.sh.extend(coefficients.iter().map(|triple| triple.map(stored)));
        if let Some((rate, placed)) = &draw.instances {
            let which = match *rate {
                vk::VertexInputRate::INSTANCE => instance,
                _ => vertex,
            };
            instances.push(placed[which as usize]);
        }
    }
    (all, instances)
}

/// The colour after storing it in the attachment's format, up to rounding.
fn stored_color(draw: &Draw, color: [f64; 4]) -> [f64; 4] {
    match draw.format {
        ColorFormat::Unorm8 => color.map(|component| component.clamp(0.0, 1.0)),
        _ => color,
    }
}

/// Blends a set's fragments over the attachment's contents. No colour is greater than `range`.
fn blend(draw: &Draw, held: &mut Reference, drawn: &Reference, range: f64) {
    let [left, top] = Covered::of(&draw.viewport()).first;
    let inside = |rectangle: Option<vk::Rect2D>, [x, y]: [i64; 2]| {
        rectangle.is_none_or(|vk::Rect2D { offset, extent }| {
            let [right, bottom] =
                [i64::from(offset.x) + i64::from(extent.width), i64::from(offset.y) + i64::from(extent.height)];
            (i64::from(offset.x)..right).contains(&x) && (i64::from(offset.y)..bottom).contains(&y)
        })
    };
    let samples = u64::MAX >> (64 - draw.samples);
    let mask = u64::from(draw.sample_mask);
    let written = ((mask << 32 | mask) & samples).count_ones();
    let share = f64::from(written) / f64::from(draw.samples);
    for at in 0..held.nominal.len() {
        let place = [at as u32 % held.width, at as u32 / held.width].map(i64::from);
        let own = [place[0] - left, place[1] - top];
        let within = (0..i64::from(drawn.width)).contains(&own[0]) && (0..i64::from(drawn.height)).contains(&own[1]);
        if !within || !inside(draw.scissor, place) || !inside(draw.area, place) {
            continue;
        }
        let source = (own[1] * i64::from(drawn.width) + own[0]) as usize;
        let mut outcomes = Vec::new();
        for &behind in held.outcomes(at) {
            for fragment in drawn.outcomes(source) {
                let after = blended(draw, *fragment, behind);
                let mix = |c: usize| share * after[c] + (1.0 - share) * behind[c];
                outcomes.push([0, 1, 2, 3].map(mix));
            }
        }
        // A factor of a blend is at most 1, or a colour.
        held.slack[at] += range * drawn.slack[source];
        held.nominal[at] = outcomes.remove(0);
        if outcomes.is_empty() {
            held.alternatives.remove(&at);
        } else {
            held.alternatives.insert(at, outcomes);
        }
    }
    held.exhausted += drawn.exhausted;
}

/// The result of blending one fragment, if there is one, with the contents behind it.
fn blended(draw: &Draw, fragment: [f64; 4], behind: [f64; 4]) -> [f64; 4] {
    // Every contributing Gaussian increases alpha, so a zero means that there is no fragment.
    if fragment[3] <= 0.0 {
        return behind;
    }
    let fragment = stored_color(draw, fragment);
    if let Some(equation) = &draw.equation {
        return stored_color(draw, by_equation(draw, equation, fragment, behind));
    }
    let [source, destination] = match draw.blend {
        Blend::Over => [1.0, 1.0 - fragment[3]],
        Blend::Add => [1.0, 1.0],
        Blend::Under => [1.0 - behind[3], 1.0],
        Blend::Replace => [1.0, 0.0],
    };
    let mask = draw.write_mask.as_raw();
    let component = |c: usize| {
        if mask >> c & 1 == 1 { source * fragment[c] + destination * behind[c] } else { behind[c] }
    };
    stored_color(draw, [0, 1, 2, 3].map(component))
}

/// The result of a blend equation.
fn by_equation(draw: &Draw, equation: &Equation, fragment: [f64; 4], behind: [f64; 4]) -> [f64; 4] {
    use vk::BlendFactor as Factor;
    let constants = equation.constants.map(f64::from);
    let factor = |factor: Factor, c: usize| match factor {
        Factor::ZERO => 0.0,
        Factor::SRC_COLOR => fragment[c],
        Factor::ONE_MINUS_SRC_COLOR => 1.0 - fragment[c],
        Factor::DST_COLOR => behind[c],
        Factor::ONE_MINUS_DST_COLOR => 1.0 - behind[c],
        Factor::SRC_ALPHA => fragment[3],
        Factor::ONE_MINUS_SRC_ALPHA => 1.0 - fragment[3],
        Factor::DST_ALPHA => behind[3],
        Factor::ONE_MINUS_DST_ALPHA => 1.0 - behind[3],
        Factor::CONSTANT_COLOR => constants[c],
        Factor::ONE_MINUS_CONSTANT_COLOR => 1.0 - constants[c],
        Factor::CONSTANT_ALPHA => constants[3],
        Factor::ONE_MINUS_CONSTANT_ALPHA => 1.0 - constants[3],
        _ => 1.0,
    };
    let mask = draw.write_mask.as_raw();
    [0, 1, 2, 3].map(|c| {
        if mask >> c & 1 == 0 {
            return behind[c];
        }
        let ([from, to], op) = if c == 3 { equation.alpha } else { equation.color };
        let [source, destination] = [factor(from, c) * fragment[c], factor(to, c) * behind[c]];
        match op {
            vk::BlendOp::SUBTRACT => source - destination,
            vk::BlendOp::REVERSE_SUBTRACT => destination - source,
            vk::BlendOp::MIN => fragment[c].min(behind[c]),
            vk::BlendOp::MAX => fragment[c].max(behind[c]),
            _ => source + destination,
        }
    })
}

impl Expected {
    /// The picture of the binary64 decisions.
    pub(crate) fn picture(&self) -> Picture {
        // Every pixel has a depth and a stencil, unless a mistake leaves it without a median.
        let depth = self.depth.iter().map(|allowed| allowed.as_ref().and_then(|allowed| allowed.first()));
        let stencil = self.stencil.iter().map(|allowed| allowed[0]);
        Picture {
            color: self.color.to_f32(),
            stored: Stored {
                depth: depth.map(|codes| codes.map_or(0, |codes| codes.nominal)).collect(),
                stencil: stencil.collect(),
            },
        }
    }

    /// The accuracy of a picture's colours.
    pub fn accuracy(&self, picture: &Picture) -> Accuracy {
        let limits = Limits { distance: self.distance, ..Limits::ENVELOPE_ONLY };
        Accuracy::of(&picture.color, &self.color, limits)
    }

    /// A description of the first error in a picture, or `None` if it is correct.
    pub fn fault(&self, picture: &Picture) -> Option<String> {
        let accuracy = self.accuracy(picture);
        if !accuracy.holds() {
            return Some(format!("colours: {accuracy}"));
        }
        let place = |at: usize| [at % self.color.width as usize, at / self.color.width as usize];
        for (at, (allowed, code)) in self.depth.iter().zip(&picture.stored.depth).enumerate() {
            if allowed.as_ref().is_some_and(|allowed| !allowed.iter().any(|codes| codes.contains(*code))) {
                let place = place(at);
                return Some(format!("depths: {code:#x} at {place:?}, not one of {allowed:x?}"));
            }
        }
        for (at, (allowed, stencil)) in self.stencil.iter().zip(&picture.stored.stencil).enumerate() {
            if !allowed.contains(stencil) {
                let place = place(at);
                return Some(format!("stencils: {stencil} at {place:?}, not one of {allowed:?}"));
            }
        }
        None
    }
}
