//! Inputs of resolve shaders, which a case shows as colours, by the oracle.

use gaurast_oracle::oracle::resolve::{Resolved, resolve_scene};
use gaurast_oracle::oracle::{OracleDepthFormat, OracleScene, OracleTests};

use crate::draw::{Draw, Shown};
use crate::implementation::Picture;
use crate::judge::{CONTRACT, combined_scene, oracle_camera, oracle_state, sets};

/// The distance from its envelope of the farthest number that a picture shows.
///
/// # Errors
/// A sentence about the first pixel that shows something wrong.
pub(crate) fn distance(draw: &Draw, shown: Shown, picture: &Picture) -> Result<f64, String> {
    let all = sets(draw);
    let [members] = all.as_slice() else {
        return Err("a case with a resolve shader has one set".to_owned());
    };
    let (scene, instances) = combined_scene(draw, members);
    let scene = OracleScene { requested_degree: draw.degree, instances: &instances, ..scene.as_oracle() };
    let (camera, viewport) = (oracle_camera(draw), draw.viewport());
    let tests = OracleTests {
        depth_coefficients: draw.camera.depth_coefficients,
        depth_range: [viewport.min_depth, viewport.max_depth],
        format: OracleDepthFormat::Float,
        negative_one_to_one: false,
        depth: None,
        bounds: None,
        stencil: None,
    };
    let pixels = resolve_scene(&scene, &camera, &oracle_state(draw), &tests);
    let judge = Judge { draw, shown, members };
    let mut farthest = 0.0_f64;
    for (at, (ways, color)) in pixels.iter().zip(&picture.color).enumerate() {
        let far = judge.pixel(ways, *color);
        farthest = farthest.max(far.map_err(|message| {
            let place = [at as u32 % draw.size[0], at as u32 / draw.size[0]];
            format!("{shown:?} is {color:?} at {place:?}: {message}")
        })?);
    }
    Ok(farthest)
}

struct Judge<'a> {
    draw: &'a Draw,
    shown: Shown,
    /// Vertex and instance of each Gaussian, in primitive order.
    members: &'a [[u32; 2]],
}

impl Judge<'_> {
    /// The distance from their envelope of the numbers of a pixel.
    fn pixel(&self, ways: &[Resolved], color: [f32; 4]) -> Result<f64, String> {
        let is_there = color != self.draw.behind;
        let ways: Vec<&Resolved> = ways.iter().filter(|way| way.covered == is_there).collect();
        if ways.is_empty() {
            return Err("a fragment, or none, is expected".to_owned());
        }
        if !is_there {
            return Ok(0.0);
        }
        let [x, y, ..] = color.map(f64::from);
        match self.shown {
            Shown::Accumulated => {
                let mut farthest = 0.0_f64;
                for (channel, value) in color.into_iter().enumerate() {
                    let values = ways.iter().map(|way| way.accumulated[channel]);
                    farthest = farthest.max(within(values, value, CONTRACT)?);
                }
                Ok(farthest)
            }
            Shown::Depths => {
                let expected = ways.iter().map(|way| way.expected_depth);
                let medians = ways.iter().flat_map(|way| &way.median_depths);
                self.is_median(&ways, medians.copied(), y, 1e-7)?;
                within(expected, color[0], CONTRACT)
            }
            Shown::LinearDepths => {
                let expected = ways.iter().map(|way| way.expected_distance);
                let medians = ways.iter().flat_map(|way| &way.median_gaussians);
                self.is_median(&ways, medians.map(|median| median.1.into()), y, 0.0)?;
                let greatest = expected.clone().fold(x.abs(), |most, z| most.max(z.abs()));
                within(expected, color[0], CONTRACT * greatest.max(1.0))
            }
            Shown::Gaussians => {
                let named = |index: usize| self.members[index].map(|number| number as f32);
                let (median, nearest) = ([color[0], color[1]], [color[2], color[3]]);
                let mut firsts = ways.iter().filter_map(|way| way.nearest);
                if !firsts.any(|index| named(index) == nearest) {
                    return Err("the nearest Gaussian is another one".to_owned());
                }
                let mut medians = ways.iter().flat_map(|way| &way.median_gaussians);
                let is_one = medians.any(|(index, _)| named(*index) == median);
                let is_unknown = ways.iter().any(|way| way.medians_exhausted);
                if !is_one && !is_unknown {
                    return Err("the median Gaussian is another one".to_owned());
                }
                Ok(0.0)
            }
            Shown::Camera(location) => {
                let expected = self.camera(location);
                let mut farthest = 0.0_f64;
                for (value, expected) in color.into_iter().zip(expected) {
                    let tolerance = 1e-7 * expected.abs().max(f64::MIN_POSITIVE);
                    let values = std::iter::once(expected);
                    if f64::from(value) != expected {
                        farthest = farthest.max(within(values, value, tolerance)?);
                    }
                }
                Ok(farthest)
            }
        }
    }

    /// Checks that a number is one of the medians', unless those are not all known.
    fn is_median(
        &self,
        ways: &[&Resolved],
        mut medians: impl Iterator<Item = f64>,
        value: f64,
        tolerance: f64,
    ) -> Result<(), String> {
        let is_one = medians.any(|median| (median - value).abs() <= tolerance);
        let is_unknown = ways.iter().any(|way| way.medians_exhausted);
        if is_one || is_unknown { Ok(()) } else { Err("the median is another one".to_owned()) }
    }

    /// The camera's vector at a location.
    fn camera(&self, location: u32) -> [f64; 4] {
        let camera = &self.draw.camera;
        let rotation = camera.rotation.map(f64::from);
        let [fx, fy] = camera.focal_length.map(f64::from);
        let [cx, cy] = camera.principal_point.map(f64::from);
        let [c0, c1] = camera.depth_coefficients.map(f64::from);
        match location {
            row @ 0..3 => {
                let [x, y, z] = [0, 1, 2].map(|column| rotation[3 * row as usize + column]);
                let [ex, ey, ez] = camera.eye;
                [x, y, z, -(x * ex + y * ey + z * ez)]
            }
            3 => [fx, fy, cx, cy],
            4 => [c0, c1, camera.near_plane.into(), camera.far_plane.into()],
            _ => {
                let [x, y, z] = camera.eye;
                [x, y, z, camera.model.as_raw().into()]
            }
        }
    }
}

/// The distance of a number from the least and the greatest of others.
fn within(values: impl Iterator<Item = f64>, value: f32, tolerance: f64) -> Result<f64, String> {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    let value = f64::from(value);
    let distance = (low - value).max(value - high).max(0.0);
    if distance <= tolerance { Ok(distance) } else { Err(format!("{value} is not within {low} to {high}")) }
}
