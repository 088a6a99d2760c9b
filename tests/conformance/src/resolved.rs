//! Inputs of resolve shaders, which a case shows as colours, by the oracle.

use gaurast_oracle::oracle::error_model::PrecisionClass;
use gaurast_oracle::oracle::resolve::{Resolved, resolve_scene};
use gaurast_oracle::oracle::{OracleDepthFormat, OracleScene, OracleTests};

use crate::draw::{Camera, Draw, Shown};
use crate::judge::{combined_scene, contract, oracle_camera, oracle_state, sets};
use crate::picture::Picture;

/// The inputs of a draw's resolve shader, and those that it shows.
#[derive(Clone, Debug)]
pub(crate) struct Inputs {
    shown: Shown,
    camera: Camera,
    /// The class of precision to which the inputs are held.
    precision: PrecisionClass,
    /// The colour where there is no fragment.
    behind: [f32; 4],
    /// Width of the picture in pixels.
    width: u32,
    /// Vertex and instance of each Gaussian, in primitive order.
    members: Vec<[u32; 2]>,
    /// The possible inputs at each pixel, those of the binary64 decisions first.
    pixels: Vec<Vec<Resolved>>,
}

impl Inputs {
    /// Computes the inputs of a draw, which has one set, whose shader shows some of them.
    pub(crate) fn of(draw: &Draw, shown: Shown) -> Self {
        let members = sets(draw).swap_remove(0);
        let (scene, instances) = combined_scene(draw, &members);
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
        let precision = draw.rules.precision;
        Self { shown, precision, camera: draw.camera, behind: draw.behind, width: draw.size[0], members, pixels }
    }

    /// The distance from its envelope of the farthest number that a picture shows.
    ///
    /// # Errors
    /// A sentence about the first pixel that shows something wrong.
    pub(crate) fn distance(&self, picture: &Picture) -> Result<f64, String> {
        let (width, shown) = (self.width, self.shown);
        let mut farthest = 0.0_f64;
        for (at, (ways, color)) in self.pixels.iter().zip(&picture.color).enumerate() {
            let far = self.pixel(ways, *color);
            farthest = farthest.max(far.map_err(|message| {
                let place = [at as u32 % width, at as u32 / width];
                format!("{shown:?} is {color:?} at {place:?}: {message}")
            })?);
        }
        Ok(farthest)
    }

    /// The picture of the binary64 decisions.
    pub(crate) fn picture(&self) -> Picture {
        let color = |ways: &Vec<Resolved>| if ways[0].covered { self.color(&ways[0]) } else { self.behind };
        Picture { color: self.pixels.iter().map(color).collect(), ..Picture::default() }
    }

    /// The colour that the shader makes of its inputs.
    fn color(&self, inputs: &Resolved) -> [f32; 4] {
        // Every covered pixel has a median, unless a mistake leaves it without one.
        let (median, distance) = inputs.median_gaussians.first().copied().unwrap_or_default();
        match self.shown {
            Shown::Accumulated => inputs.accumulated.map(|c| c as f32),
            Shown::Depths => {
                let median = inputs.median_depths.first().copied().unwrap_or_default();
                [inputs.expected_depth as f32, median as f32, 0.0, 1.0]
            }
            Shown::LinearDepths => [inputs.expected_distance as f32, distance, 0.0, 1.0],
            Shown::Gaussians => {
                let nearest = inputs.nearest.unwrap_or_default();
                let [[median, of_median], [nearest, of_nearest]] = [median, nearest].map(|index| self.named(index));
                [median, of_median, nearest, of_nearest]
            }
            Shown::Camera(location) => self.camera(location).map(|c| c as f32),
        }
    }

    /// Vertex and instance of a Gaussian, as the shader shows them.
    fn named(&self, index: usize) -> [f32; 2] {
        self.members[index].map(|number| number as f32)
    }

    /// The distance from their envelope of the numbers of a pixel.
    fn pixel(&self, ways: &[Resolved], color: [f32; 4]) -> Result<f64, String> {
        let is_there = color != self.behind;
        let ways: Vec<&Resolved> = ways.iter().filter(|way| way.covered == is_there).collect();
        if ways.is_empty() {
            return Err("a fragment, or none, is expected".to_owned());
        }
        if !is_there {
            return Ok(0.0);
        }
        let [x, y, ..] = color.map(f64::from);
        let greatest = |of: fn(&Resolved) -> f64| ways.iter().fold(0.0, |most: f64, way| most.max(of(way)));
        let contract = contract(self.precision);
        let slack = greatest(|way| way.slack);
        // A mean divides by the weights.
        let of_mean = greatest(|way| 2.0 * way.slack / way.accumulated[3]);
        let [of_depth, of_distance] = [greatest(|way| way.errors[0]), greatest(|way| way.errors[1])];
        match self.shown {
            Shown::Accumulated => {
                let mut farthest = 0.0_f64;
                for (channel, value) in color.into_iter().enumerate() {
                    let values = ways.iter().map(|way| way.accumulated[channel]);
                    farthest = farthest.max(within(values, value, contract + slack)?);
                }
                Ok(farthest)
            }
            Shown::Depths => {
                let expected = ways.iter().map(|way| way.expected_depth);
                let medians = ways.iter().flat_map(|way| &way.median_depths);
                self.is_median(&ways, medians.copied(), y, 1e-7 + of_depth)?;
                within(expected, color[0], contract + of_mean + of_depth)
            }
            Shown::LinearDepths => {
                let expected = ways.iter().map(|way| way.expected_distance);
                let medians = ways.iter().flat_map(|way| &way.median_gaussians);
                self.is_median(&ways, medians.map(|median| median.1.into()), y, of_distance)?;
                let greatest = expected.clone().fold(x.abs(), |most, z| most.max(z.abs()));
                within(expected, color[0], (contract + of_mean) * greatest.max(1.0) + of_distance)
            }
            Shown::Gaussians => {
                let (median, nearest) = ([color[0], color[1]], [color[2], color[3]]);
                let mut firsts = ways.iter().filter_map(|way| way.nearest);
                if !firsts.any(|index| self.named(index) == nearest) {
                    return Err("the nearest Gaussian is another one".to_owned());
                }
                let mut medians = ways.iter().flat_map(|way| &way.median_gaussians);
                let is_one = medians.any(|(index, _)| self.named(*index) == median);
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
        let camera = &self.camera;
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
