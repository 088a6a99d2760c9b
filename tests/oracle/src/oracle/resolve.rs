//! The inputs of a resolve shader at a pixel, computed in their literal form.

use super::OracleState;
use super::pixel::{Outcome, Pixel};
use super::render::{Projected, bounded_pixels};
use super::sample_tests::OracleTests;
use super::shaded::{OracleOutputs, OracleViewport, project};
use super::splat::Splat;
use super::{OracleCamera, OracleScene};

/// One possible result of a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Resolved {
    /// (C, 1 - T).
    pub accumulated: [f64; 4],
    /// True if a Gaussian contributed, so that there is a fragment.
    pub covered: bool,
    /// The mean of the contributing centres' depths, weighted by T alpha.
    pub expected_depth: f64,
    /// The possible median depths.
    pub median_depths: Vec<f64>,
    /// The possible errors of a depth and of a depth variable.
    pub errors: [f64; 2],
    /// By how much the envelope of the accumulated colour is wider, per unit of the greatest colour.
    pub slack: f64,
    /// True if the list of medians is incomplete.
    pub medians_exhausted: bool,
    /// The mean of the contributing centres' depth variables, weighted by T alpha.
    pub expected_distance: f64,
    /// Every Gaussian that may be the median, by its place in primitive order, with its depth variable.
    pub median_gaussians: Vec<(usize, f32)>,
    /// The first Gaussian that contributed, by its place in primitive order.
    pub nearest: Option<usize>,
}

impl Resolved {
    fn new(outcome: &Outcome, depth: impl Fn(f32) -> f64) -> Self {
        let median_depths: Vec<f64> = outcome.medians.iter().map(|&(z, _)| depth(z)).collect();
        let [depths, weights] = outcome.depths;
        let last = median_depths.last().copied().unwrap_or(0.0);
        let last_distance = outcome.median_gaussians.last().map_or(0.0, |m| m.1.into());
        Self {
            accumulated: outcome.rgba,
            covered: outcome.covered,
            expected_depth: if weights > 0.0 { depths / weights } else { last },
            median_depths,
            errors: outcome.depth_errors,
            slack: outcome.slack,
            medians_exhausted: outcome.medians_exhausted,
            expected_distance: if weights > 0.0 { outcome.distances / weights } else { last_distance },
            median_gaussians: outcome.median_gaussians.clone(),
            nearest: outcome.nearest,
        }
    }
}

/// The possible results of each pixel, the binary64 one first. `depth` gives a centre's depth from the depth variable.
fn resolve(
    mut projected: Projected,
    size: [u32; 2],
    state: &OracleState,
    depth: impl Fn(f32) -> f64,
    error: impl Fn(&Splat) -> f64,
) -> Vec<Vec<Resolved>> {
    let set_depth = |splat: &mut Splat| (splat.depth, splat.depth_error) = (depth(splat.z), error(splat));
    projected.splats.iter_mut().for_each(set_depth);
    let pixels = bounded_pixels(&projected, size, state);
    let ways = |pixel: &Pixel| {
        let outcomes = pixel.outcomes();
        outcomes.map(|outcome| Resolved::new(&outcome, &depth)).collect()
    };
    pixels.iter().flatten().map(ways).collect()
}

/// The resolve shader's inputs after fixed-function projection. Of `tests` only the conversion to depths is used.
pub fn resolve_scene(
    scene: &OracleScene,
    camera: &OracleCamera,
    state: &OracleState,
    tests: &OracleTests,
) -> Vec<Vec<Resolved>> {
    let projected = Projected::new(scene, camera, state);
    let depth = |z| tests.format.depth(tests.code(camera.model, &state.rules, z));
    let error = |splat: &Splat| {
        let codes = tests.codes(camera.model, &state.rules, (splat.z, splat.error.rounding().depth));
        tests.format.depth(codes.greatest) - tests.format.depth(codes.least)
    };
    resolve(projected, [camera.width, camera.height], state, depth, error)
}

/// The resolve shader's inputs after vertex-shader projection, with a viewport of depths from 0 to 1 and binary32
/// depths.
pub fn resolve_shaded(
    outputs: &[OracleOutputs],
    size: [u32; 2],
    viewport: &OracleViewport,
    state: &OracleState,
) -> Vec<Vec<Resolved>> {
    let all = outputs.iter().map(|one| project(one, viewport, state));
    resolve(Projected::sort(all, state), size, state, f64::from, |_| 0.0)
}
