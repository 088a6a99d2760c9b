//! A box around the opaque parts of a scene.

use glam::DVec3;

use crate::camera::DEFAULT_NEAR;
use crate::scene::Scene;

/// The part of the scene's opacity that lies outside the box at each end of each axis. Trained scenes have a haze of
/// far-off Gaussians.
const TAIL: f64 = 0.04;

/// The distance from the middle within which the middle's Gaussians lie, relative to that within which half of the opacity
/// lies.
const NEAR: f64 = 2.0;

/// The least distance within which half of the area lies, relative to that of the opacity, of a scene of which most is far
/// from its middle.
const SCATTERED: f64 = 4.0;

/// The most Gaussians that the box is computed from.
const SAMPLE: usize = 1 << 18;

/// Half of the least side of the box, for scenes without extent or sizes.
const LEAST: f64 = 1e-3;

/// A box around most of a scene's opacity and its triangles, in the scene's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The middle.
    pub centre: [f64; 3],
    /// Half of each side; positive.
    pub half: [f64; 3],
}

impl Extent {
    /// The box around most of `scene`'s opacity and all of its triangles.
    pub fn of(scene: &Scene) -> Self {
        let sample = sample(scene);
        let (mut min, mut max) = bounds(sample.iter().map(|s| (s.position, s.opacity)).collect(), TAIL);
        if let Some((least, greatest)) = scene.mesh().bounds() {
            let (least, greatest) = (DVec3::from_array(least), DVec3::from_array(greatest));
            (min, max) = if sample.is_empty() { (least, greatest) } else { (min.min(least), max.max(greatest)) };
        }
        let half = (max - min) / 2.0;
        // A scene of one point gets a box as large as its Gaussian.
        let size = typical_size(&sample);
        let least = if size > 0.0 {
            (2.0 * size).min(1e30)
        } else if half.max_element() > 0.0 {
            LEAST * half.max_element()
        } else {
            LEAST
        };
        let centre = (min + max) / 2.0 + DVec3::from_array(scene.origin());
        Self { centre: centre.into(), half: half.max(DVec3::splat(least)).into() }
    }

    /// The box around the middle of a scene of which most is far from there: half of its opacity lies within a distance that
    /// is less than a quarter of the one within which half of its area lies. None of another scene, or one with triangles.
    pub(super) fn of_middle(scene: &Scene) -> Option<Self> {
        let sample = sample(scene);
        if sample.is_empty() || !scene.mesh().is_empty() {
            return None;
        }
        let (middle, _) = bounds(sample.iter().map(|s| (s.position, s.opacity)).collect(), 0.5);
        let within = |weight: &dyn Fn(&Sample) -> f64| {
            half_of(sample.iter().map(|s| (s.position.distance(middle), weight(s))).collect())
        };
        let distance = within(&|s| s.opacity);
        if within(&|s| s.area) <= SCATTERED * distance {
            return None;
        }
        let near = sample.iter().filter(|s| s.position.distance(middle) <= NEAR * distance);
        let (min, max) = bounds(near.map(|s| (s.position, s.opacity)).collect(), TAIL);
        let centre = (min + max) / 2.0 + DVec3::from_array(scene.origin());
        let half = ((max - min) / 2.0).max(DVec3::splat(LEAST * distance));
        Some(Self { centre: centre.into(), half: half.into() })
    }

    /// Half of the box's diagonal.
    pub fn radius(&self) -> f64 {
        DVec3::from_array(self.half).length()
    }

    /// A near plane for cameras in and around the box: that of 3DGS, or nearer where the scene is small.
    pub fn near(&self) -> f64 {
        DEFAULT_NEAR.min(self.radius() / 5.0)
    }

    /// The distance from the box's middle to its farthest point in `direction`, a unit vector.
    pub(super) fn reach(&self, direction: DVec3) -> f64 {
        DVec3::from_array(self.half).dot(direction.abs())
    }
}

/// The distance from `centre` within which half of the scene's opacity lies.
pub(super) fn median_distance(scene: &Scene, centre: [f64; 3]) -> f64 {
    let centre = DVec3::from_array(centre) - DVec3::from_array(scene.origin());
    half_of(sample(scene).iter().map(|s| (s.position.distance(centre), s.opacity)).collect())
}

/// The distance within which half of the weight lies, of distances and weights; 0 if there are none.
fn half_of(mut distances: Vec<(f64, f64)>) -> f64 {
    distances.sort_unstable_by(|(a, _), (b, _)| a.total_cmp(b));
    let half = distances.iter().map(|(_, weight)| weight).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let median = distances.iter().find(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    median.map_or(0.0, |(distance, _)| *distance)
}

/// The data of a Gaussian that framing uses.
struct Sample {
    /// The centre, relative to the scene's origin.
    position: DVec3,
    opacity: f64,
    /// Its greatest standard deviation.
    size: f64,
    /// The product of its two greatest standard deviations and the opacity.
    area: f64,
}

fn sample(scene: &Scene) -> Vec<Sample> {
    let step = scene.len().div_ceil(SAMPLE).max(1);
    scene
        .positions()
        .iter()
        .zip(scene.shapes())
        .step_by(step)
        .map(|(position, shape)| {
            let mut scale = shape.scale.map(f64::from);
            scale.sort_unstable_by(f64::total_cmp);
            let opacity = f64::from(shape.opacity);
            let size = shape.scale.iter().copied().fold(0.0, f32::max).into();
            let area = opacity * scale[1] * scale[2];
            let area = if area.is_finite() { area } else { 0.0 };
            Sample { position: DVec3::from_array(position.map(f64::from)), opacity, size, area }
        })
        .filter(|s| s.position.is_finite() && s.opacity > 0.0 && s.opacity < 1e6)
        .collect()
}

/// The median of the finite sizes; 0 if there are none.
fn typical_size(sample: &[Sample]) -> f64 {
    let mut sizes: Vec<f64> = (sample.iter().map(|s| s.size)).filter(|size| size.is_finite()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Opposite corners of a box around most of the opacity: `tail` of it lies outside at each end of each axis.
fn bounds(mut sample: Vec<(DVec3, f64)>, tail: f64) -> (DVec3, DVec3) {
    let total: f64 = sample.iter().map(|(_, opacity)| opacity).sum();
    let (mut min, mut max) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        sample.sort_unstable_by(|(a, _), (b, _)| a[axis].total_cmp(&b[axis]));
        let beyond = |fraction: f64| {
            let mut sum = 0.0;
            sample
                .iter()
                .find(|(_, opacity)| {
                    sum += opacity;
                    sum >= fraction * total
                })
                .or(sample.last())
                .map_or(0.0, |(position, _)| position[axis])
        };
        (min[axis], max[axis]) = (beyond(tail), beyond(1.0 - tail));
    }
    (min, max)
}
