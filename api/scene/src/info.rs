//! What a scene holds, in numbers.

use serde::Serialize;

use crate::metadata::Metadata;
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// Bars of [`Info::opacities`].
const OPACITY_BARS: usize = 10;

/// The powers of ten that [`Info::scales`] begins and ends with.
const SCALE_DECADES: [i32; 2] = [-7, 4];

/// What a scene holds, in numbers; as JSON by `serde`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    /// Gaussians.
    pub gaussians: usize,
    /// The spherical harmonics degree.
    pub sh_degree: u32,
    /// Bytes in memory.
    pub bytes: u64,
    /// Gaussians of which a number is not finite; the device skips those whose shape or place is not.
    pub non_finite: usize,
    /// The least and the greatest coordinates of finite centres; none if there is no such.
    pub bounds: Option<Bounds>,
    /// The finite Gaussians by opacity, in ten steps from 0 to 1.
    pub opacities: Vec<Bar>,
    /// The finite Gaussians by their largest standard deviation, a decade a bar. The outermost bars have the rest, too.
    pub scales: Vec<Bar>,
    /// What the file says of itself.
    pub metadata: Metadata,
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// The least coordinates.
    pub min: [f32; 3],
    /// The greatest coordinates.
    pub max: [f32; 3],
}

/// A bar of a histogram.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bar {
    /// The least value that belongs to it.
    pub from: f32,
    /// Gaussians.
    pub count: usize,
}

impl Info {
    /// The numbers of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let bar = |from: f32| Bar { from, count: 0 };
        let [first, last] = SCALE_DECADES;
        let mut info = Self {
            gaussians: scene.len(),
            sh_degree: scene.sh_degree(),
            bytes: (size_of_val(scene.positions())
                + size_of_val(scene.shapes())
                + size_of_val(scene.sh())) as u64,
            non_finite: 0,
            bounds: None,
            opacities: (0..OPACITY_BARS)
                .map(|step| bar(step as f32 / OPACITY_BARS as f32))
                .collect(),
            scales: (first..last).map(|power| bar(10_f32.powi(power))).collect(),
            metadata: scene.metadata().clone(),
        };
        let coefficients = scene.sh().chunks_exact(scene.sh_stride());
        for ((position, shape), sh) in scene
            .positions()
            .iter()
            .zip(scene.shapes())
            .zip(coefficients)
        {
            info.add(position, shape, sh);
        }
        info
    }

    fn add(&mut self, position: &[f32; 3], shape: &GaussianShape, sh: &[[f32; 3]]) {
        if position.iter().all(|c| c.is_finite()) {
            let bounds = self.bounds.get_or_insert(Bounds {
                min: *position,
                max: *position,
            });
            for (axis, &value) in position.iter().enumerate() {
                bounds.min[axis] = bounds.min[axis].min(value);
                bounds.max[axis] = bounds.max[axis].max(value);
            }
        }
        let numbers = shape.scale.iter().chain(&shape.rotation);
        let numbers = numbers.chain(position).chain(sh.as_flattened());
        if !(shape.opacity.is_finite() && numbers.copied().all(f32::is_finite)) {
            self.non_finite += 1;
            return;
        }
        let opacity = (shape.opacity * OPACITY_BARS as f32) as usize;
        self.opacities[opacity.min(OPACITY_BARS - 1)].count += 1;
        let largest = shape.scale.into_iter().fold(0.0, f32::max);
        let above = self.scales.partition_point(|bar| bar.from <= largest);
        self.scales[above.saturating_sub(1)].count += 1;
    }
}
