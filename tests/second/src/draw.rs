//! Steps 6 and 7, depth, and the values written to the attachments.

use std::ops::Range;

use crate::linear::{Vector, widened};
use crate::project::{Camera, Gaussian, Projected, State, project};
use crate::viewport::Viewport;

/// A comparison of a Gaussian's depth with the stored one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum CompareOp {
    Never,
    Less,
    Equal,
    LessOrEqual,
    Greater,
    NotEqual,
    GreaterOrEqual,
    Always,
}

impl CompareOp {
    fn holds(self, depth: f64, stored: f64) -> bool {
        match self {
            Self::Never => false,
            Self::Less => depth < stored,
            Self::Equal => depth == stored,
            Self::LessOrEqual => depth <= stored,
            Self::Greater => depth > stored,
            Self::NotEqual => depth != stored,
            Self::GreaterOrEqual => depth >= stored,
            Self::Always => true,
        }
    }
}

/// The format of a depth attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthFormat {
    /// Normalized integers of 16 bits.
    Unorm16,
    /// Normalized integers of 24 bits.
    Unorm24,
    /// binary32.
    Float32,
}

impl DepthFormat {
    /// The nearest value that the format holds, ties to even.
    fn rounded(self, depth: f64) -> f64 {
        let unorm = |bits: u32| {
            let greatest = f64::from((1u32 << bits) - 1);
            (depth * greatest).round_ties_even() / greatest
        };
        match self {
            Self::Unorm16 => unorm(16),
            Self::Unorm24 => unorm(24),
            Self::Float32 => f64::from(depth as f32),
        }
    }
}

/// A depth test.
#[derive(Clone, Copy, Debug)]
pub struct DepthTest {
    /// The comparison.
    pub compare: CompareOp,
    /// True if the median depth is stored.
    pub write: bool,
    /// The attachment's format.
    pub format: DepthFormat,
}

/// A colour attachment of four binary32 components and a depth attachment, row by row.
#[derive(Clone, Debug)]
pub struct Attachments {
    /// Pixels in a row.
    pub width: usize,
    /// Colours, premultiplied.
    pub color: Vec<[f32; 4]>,
    /// Depths, each a value of the depth attachment's format.
    pub depth: Vec<f64>,
}

/// The accumulated state of a pixel.
#[derive(Clone, Copy, Debug)]
struct Pixel {
    color: Vector,
    transmittance: f64,
    finished: bool,
    /// The depth of the last Gaussian that contributed at a transmittance of a half or more.
    median: Option<f64>,
}

/// Draws one sorted set, and blends its fragments "over" the contents of the colour attachment.
///
/// Without a depth test the depth attachment does not change.
pub fn draw(
    gaussians: &[Gaussian<'_>],
    camera: &Camera,
    viewport: &Viewport,
    state: &State,
    depth_test: Option<DepthTest>,
    attachments: &mut Attachments,
) {
    let mut set: Vec<Projected> =
        gaussians.iter().filter_map(|gaussian| project(gaussian, camera, viewport, state)).collect();
    // Stable, so that ties are in the order of the draw.
    set.sort_by(|a, b| a.z.total_cmp(&b.z));

    let width = attachments.width;
    let height = attachments.color.len() / width;
    let origin = viewport.origin();
    let covered = [width, height].map(|pixels| 0..pixels);
    let covered = [0, 1].map(|axis| centres(origin[axis], origin[axis] + viewport.size()[axis], &covered[axis]));
    let empty = Pixel { color: [0.0; 3], transmittance: 1.0, finished: false, median: None };
    let mut pixels = vec![empty; attachments.color.len()];
    let [ceiling, floor, end] = widened([state.alpha_ceiling, state.alpha_floor, state.transmittance_floor]);
    let [c0, c1] = widened(camera.depth_coefficients);

    for gaussian in &set {
        let mean = [0, 1].map(|axis| origin[axis] + gaussian.mean[axis]);
        let depth = viewport.mapped(c0 + c1 / f64::from(gaussian.z));
        let depth = depth_test.map_or(DepthFormat::Float32, |test| test.format).rounded(depth);
        let [columns, rows] = [0, 1].map(|axis| {
            let reach = reach(gaussian.opacity, floor) * gaussian.variances()[axis].sqrt();
            centres(mean[axis] - reach - 1.0, mean[axis] + reach + 1.0, &covered[axis])
        });
        for y in rows {
            for x in columns.clone() {
                let index = y * width + x;
                let pixel = &mut pixels[index];
                if pixel.finished || depth_test.is_some_and(|test| !test.compare.holds(depth, attachments.depth[index]))
                {
                    continue;
                }
                // Step 6.
                let d = [x as f64 + 0.5 - mean[0], y as f64 + 0.5 - mean[1]];
                let alpha = ceiling.min(gaussian.opacity * (-0.5 * gaussian.squared_distance(d)).exp());
                if alpha < floor {
                    continue;
                }
                // Step 7.
                let behind = pixel.transmittance * (1.0 - alpha);
                if behind < end {
                    pixel.finished = true;
                    continue;
                }
                for (sum, component) in pixel.color.iter_mut().zip(gaussian.color) {
                    *sum += pixel.transmittance * alpha * component;
                }
                if pixel.transmittance >= 0.5 {
                    pixel.median = Some(depth);
                }
                pixel.transmittance = behind;
            }
        }
    }
    for (index, pixel) in pixels.iter().enumerate() {
        let Some(median) = pixel.median else { continue };
        let [red, green, blue] = pixel.color;
        let fragment = [red, green, blue, 1.0 - pixel.transmittance];
        let stored = attachments.color[index];
        attachments.color[index] =
            [0, 1, 2, 3].map(|at| (fragment[at] + (1.0 - fragment[3]) * f64::from(stored[at])) as f32);
        if depth_test.is_some_and(|test| test.write) {
            attachments.depth[index] = median;
        }
    }
}

/// The pixels of a range whose centres lie between two coordinates.
fn centres(least: f64, greatest: f64, range: &Range<usize>) -> Range<usize> {
    let first = (least - 0.5).ceil().clamp(range.start as f64, range.end as f64) as usize;
    let end = ((greatest - 0.5).ceil()).clamp(range.start as f64, range.end as f64) as usize;
    first..end.max(first)
}

/// The number of standard deviations at which alpha falls below the floor; infinity if the floor is 0.
fn reach(opacity: f64, floor: f64) -> f64 {
    if floor == 0.0 { f64::INFINITY } else { (2.0 * (opacity / floor).ln()).max(0.0).sqrt() }
}
