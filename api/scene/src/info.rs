//! Statistics of a scene.

use serde::Serialize;

use crate::metadata::Metadata;
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// The number of bars of [`Info::opacities`].
const OPACITY_BARS: usize = 10;

/// The powers of ten at which [`Info::scales`] begins and ends.
const SCALE_DECADES: [i32; 2] = [-7, 4];

/// Statistics of a scene; `serde` writes them as JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    /// The number of Gaussians.
    pub gaussians: usize,
    /// The spherical harmonics degree.
    pub sh_degree: u32,
    /// The number of triangles among the Gaussians.
    pub triangles: usize,
    /// Its size in memory, in bytes.
    pub bytes: u64,
    /// The number of Gaussians with a number that is not finite. The device skips those whose shape or position is not
    /// finite.
    pub non_finite: usize,
    /// The point to which positions in memory are relative.
    pub origin: [f64; 3],
    /// The least and the greatest coordinates of finite centres; None if there is none.
    pub bounds: Option<Bounds>,
    /// A histogram of the finite Gaussians' opacities, in ten steps from 0 to 1.
    pub opacities: Vec<Bar>,
    /// A histogram of the finite Gaussians' largest standard deviations, a decade a bar. The outermost bars include the
    /// rest.
    pub scales: Vec<Bar>,
    /// The file's metadata.
    pub metadata: Metadata,
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// The least coordinates, in the file's.
    pub min: [f64; 3],
    /// The greatest coordinates, in the file's.
    pub max: [f64; 3],
}

/// A bar of a histogram.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bar {
    /// The least value in the bar.
    pub from: f32,
    /// The number of Gaussians in the bar.
    pub count: usize,
}

impl Info {
    /// The statistics of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let bar = |from: f32| Bar { from, count: 0 };
        let [first, last] = SCALE_DECADES;
        let mut info = Self {
            gaussians: scene.len(),
            sh_degree: scene.sh_degree(),
            triangles: scene.mesh().triangles(),
            bytes: (size_of_val(scene.positions())
                + size_of_val(scene.mesh().vertices())
                + size_of_val(scene.shapes())
                + size_of_val(scene.sh())) as u64,
            non_finite: 0,
            origin: scene.origin(),
            bounds: None,
            opacities: (0..OPACITY_BARS).map(|step| bar(step as f32 / OPACITY_BARS as f32)).collect(),
            scales: (first..last).map(|power| bar(libm::exp10(power.into()) as f32)).collect(),
            metadata: scene.metadata().clone(),
        };
        let coefficients = scene.sh().chunks_exact(scene.sh_stride());
        for ((position, shape), sh) in scene.positions().iter().zip(scene.shapes()).zip(coefficients) {
            info.add(position, scene.origin(), shape, sh);
        }
        info
    }

    fn add(&mut self, position: &[f32; 3], origin: [f64; 3], shape: &GaussianShape, sh: &[[f32; 3]]) {
        if position.iter().all(|c| c.is_finite()) {
            let place: [f64; 3] = std::array::from_fn(|axis| f64::from(position[axis]) + origin[axis]);
            let bounds = self.bounds.get_or_insert(Bounds { min: place, max: place });
            for (axis, &value) in place.iter().enumerate() {
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
