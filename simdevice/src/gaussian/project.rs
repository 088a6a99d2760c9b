//! Projection: 3D Gaussians to the nine numbers that the rasterizer takes.
//!
//! Everything from the camera-space mean to the conic is computed in binary64 and rounded once at the end: in
//! binary32 the determinant of a needle and the depth of neighbours are wrong in the fourth digit. The loops
//! are straight lines over lanes, compiled once per SIMD level; what is culled leaves before the covariance is
//! computed, and spherical harmonics are read only for what reaches a tile.

use super::fetch::{BATCH, Batch, CoefficientReader, Fetcher, MAX_COEFFICIENTS};
use super::footprint::{Ellipse, Span, Visible};
use super::sort::ordered_bits;
use super::spherical_harmonics;
use crate::counters::{Counter, Counters};
use crate::packet::{Camera, GaussianAttributes, GaussianState, Viewport};

/// A projected Gaussian: what the tile engine needs of it, in one cache line.
///
/// At offset `d` pixels from the mean, `log2(alpha) = log2_opacity - u^2 - v^2` with `u = factor[0] d.x` and
/// `v = factor[1] d.x + factor[2] d.y`: the Cholesky factor of the conic, scaled so that base 2 needs no more.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct Splat {
    /// The mean in framebuffer pixels.
    pub mean: [f64; 2],
    /// The scaled Cholesky factor of the conic, in 1/px.
    pub factor: [f64; 3],
    /// Base-2 logarithm of the opacity.
    pub log2_opacity: f32,
    /// Red, green, blue.
    pub color: [f32; 3],
    /// Where its spans begin in its batch.
    pub first_span: u32,
    /// How many spans it has.
    pub span_count: u32,
}

/// What came of a batch.
#[derive(Debug, Default)]
pub(crate) struct Projected {
    /// What is drawn, in the order of the draw.
    pub splats: Vec<Splat>,
    /// The depth key of each.
    pub keys: Vec<u32>,
    /// The tiles of each.
    pub spans: Vec<Span>,
    /// What was skipped and why.
    pub counters: Counters,
}

/// Why a Gaussian is skipped, as lanes hold it; `KEPT` for those that are not.
const KEPT: u32 = 0;
const REASONS: [Counter; 7] = [
    Counter::SkippedNonFinite,
    Counter::SkippedZeroRotation,
    Counter::SkippedNegativeScale,
    Counter::SkippedFaint,
    Counter::SkippedNear,
    Counter::SkippedFar,
    Counter::SkippedOffScreen,
];

/// `log2_opacity` less this is how far the exponent may fall where the alpha floor is zero: beyond, alpha
/// underflows binary32.
const LEAST_LOG2_ALPHA: f64 = -150.0;

/// `q / 2` in units of natural exponents is this times `u^2 + v^2`: `ln 2`.
const LN_2: f64 = std::f64::consts::LN_2;

/// What is the same for all Gaussians of a draw.
#[derive(Clone, Debug)]
pub(crate) struct Projection {
    rotation: [f64; 9],
    eye: [f64; 3],
    focal: [f64; 2],
    /// The principal point in framebuffer pixels.
    center: [f64; 2],
    /// Bounds of `t.x / t.z` and `t.y / t.z` in the Jacobian.
    slope_min: [f64; 2],
    slope_max: [f64; 2],
    near: f32,
    far: f32,
    low_pass: f64,
    compensated: bool,
    alpha_floor: f32,
    log2_floor: f64,
    sh_degree: u32,
    visible: Visible,
}

/// A lane's worth of every attribute and of what becomes of it.
pub(crate) struct Scratch {
    fetcher: Fetcher,
    position: [[f32; BATCH]; 3],
    scale: [[f32; BATCH]; 3],
    rotation: [[f32; BATCH]; 4],
    opacity: [f32; BATCH],
    offset: [[f64; BATCH]; 3],
    camera: [[f64; BATCH]; 3],
    reason: [u32; BATCH],
    /// The lanes that were kept.
    lanes: [usize; BATCH],
    mean: [[f64; BATCH]; 2],
    covariance: [[f64; BATCH]; 3],
    determinant: [f64; BATCH],
    log2_opacity: [f64; BATCH],
}

impl Scratch {
    /// Scratch for one worker.
    pub(crate) fn new() -> Box<Self> {
        Box::new(Self {
            fetcher: Fetcher::default(),
            position: [[0.0; BATCH]; 3],
            scale: [[0.0; BATCH]; 3],
            rotation: [[0.0; BATCH]; 4],
            opacity: [0.0; BATCH],
            offset: [[0.0; BATCH]; 3],
            camera: [[0.0; BATCH]; 3],
            reason: [0; BATCH],
            lanes: [0; BATCH],
            mean: [[0.0; BATCH]; 2],
            covariance: [[0.0; BATCH]; 3],
            determinant: [0.0; BATCH],
            log2_opacity: [0.0; BATCH],
        })
    }

    fn fetch(&mut self, attributes: &GaussianAttributes, batch: &Batch) {
        let [x, y, z] = &mut self.position;
        self.fetcher.read(&attributes.position, batch, [x, y, z]);
        let [x, y, z] = &mut self.scale;
        self.fetcher.read(&attributes.scale, batch, [x, y, z]);
        let [w, x, y, z] = &mut self.rotation;
        self.fetcher.read(&attributes.rotation, batch, [w, x, y, z]);
        self.fetcher
            .read(&attributes.opacity, batch, [&mut self.opacity]);
    }
}

impl Projection {
    /// The constants of a draw that may touch the pixels of `visible`.
    pub(crate) fn new(
        state: &GaussianState,
        camera: &Camera,
        viewport: &Viewport,
        visible: Visible,
    ) -> Self {
        let focal = camera.focal_length.map(f64::from);
        let principal = camera.principal_point.map(f64::from);
        let size = [viewport.width, viewport.height].map(f64::from);
        let margin = [0, 1].map(|axis| 0.15 * size[axis] / focal[axis]);
        Self {
            rotation: camera.rotation.map(f64::from),
            eye: camera.eye,
            focal,
            center: [
                principal[0] + f64::from(viewport.x),
                principal[1] + f64::from(viewport.y),
            ],
            slope_min: [0, 1].map(|axis| -(principal[axis] / focal[axis] + margin[axis])),
            slope_max: [0, 1]
                .map(|axis| (size[axis] - principal[axis]) / focal[axis] + margin[axis]),
            near: camera.near_plane,
            far: camera.far_plane,
            low_pass: f64::from(state.low_pass_variance),
            compensated: state.opacity_compensated,
            alpha_floor: state.alpha_floor,
            log2_floor: f64::from(state.alpha_floor).log2().max(LEAST_LOG2_ALPHA),
            sh_degree: state.sh_degree,
            visible,
        }
    }

    /// Projects a batch.
    #[inline(always)]
    pub(crate) fn run(
        &self,
        attributes: &GaussianAttributes,
        batch: &Batch,
        scratch: &mut Scratch,
        out: &mut Projected,
    ) {
        scratch.fetch(attributes, batch);
        self.cull(batch.len, scratch);
        out.counters.add(Counter::GaussiansRead, batch.len as u64);
        let mut kept = 0;
        for lane in 0..batch.len {
            scratch.lanes[kept] = lane;
            kept += usize::from(scratch.reason[lane] == KEPT);
        }
        if kept < batch.len {
            for reason in &scratch.reason[..batch.len] {
                if *reason != KEPT {
                    out.counters.add(REASONS[*reason as usize - 1], 1);
                }
            }
        }
        self.flatten(kept, scratch);
        self.emit(kept, attributes, batch, scratch, out);
    }

    /// Finds the camera-space mean of each lane and the first reason to skip it, if there is one.
    #[inline(always)]
    fn cull(&self, len: usize, scratch: &mut Scratch) {
        let Scratch {
            position,
            scale,
            rotation,
            opacity,
            offset,
            camera,
            reason,
            ..
        } = scratch;
        let len = len.min(BATCH);
        let r = &self.rotation;
        for lane in 0..len {
            let p = [0, 1, 2].map(|axis| f64::from(position[axis][lane]) - self.eye[axis]);
            for axis in 0..3 {
                offset[axis][lane] = p[axis];
                let row = &r[3 * axis..3 * axis + 3];
                camera[axis][lane] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2];
            }
        }
        let greatest = opacity[..len].iter().fold(1.0f32, |a, &b| a.max(b));
        let extent = 2.0 * LN_2 * (f64::from(greatest).log2() - self.log2_floor) * 1.01;
        let [a0, a1] = [0, 1].map(|axis| [0, 1, 2].map(|k| r[3 * axis + k]));
        let a2 = [r[6], r[7], r[8]];
        let left = self.visible.left as f64 - 1.0;
        let right = self.visible.right as f64 + 1.0;
        let top = self.visible.top as f64 - 1.0;
        let bottom = self.visible.bottom as f64 + 1.0;
        for lane in 0..len {
            let s = [0, 1, 2].map(|axis| scale[axis][lane]);
            let q = [0, 1, 2, 3].map(|part| rotation[part][lane]);
            let p = [0, 1, 2].map(|axis| position[axis][lane]);
            let o = opacity[lane];
            // Multiplied by zero, what is not finite becomes NaN.
            let zero = p[0] * 0.0
                + p[1] * 0.0
                + p[2] * 0.0
                + s[0] * 0.0
                + s[1] * 0.0
                + s[2] * 0.0
                + q[0] * 0.0
                + q[1] * 0.0
                + q[2] * 0.0
                + q[3] * 0.0
                + o * 0.0;
            let z = camera[2][lane];
            let slope = [camera[0][lane] / z, camera[1][lane] / z];
            let clamped = [0, 1].map(|axis| {
                slope[axis]
                    .max(self.slope_min[axis])
                    .min(self.slope_max[axis])
            });
            // The projection of the sphere about the Gaussian bounds that of the Gaussian.
            let largest = f64::from(s[0].max(s[1]).max(s[2]));
            let reach = |axis: usize, row: &[f64; 3]| {
                let scale = largest * self.focal[axis] / z;
                let k = [0, 1, 2].map(|k| row[k] - clamped[axis] * a2[k]);
                let norm2 = k[0] * k[0] + k[1] * k[1] + k[2] * k[2];
                (extent * (scale * scale * norm2 + self.low_pass)).sqrt()
            };
            let reach = [reach(0, &a0), reach(1, &a1)];
            let x = self.focal[0] * slope[0] + self.center[0];
            let y = self.focal[1] * slope[1] + self.center[1];
            let outside = (x + reach[0] < left)
                | (x - reach[0] > right)
                | (y + reach[1] < top)
                | (y - reach[1] > bottom);
            let z = z as f32;
            let mut why = if outside { 7 } else { KEPT };
            why = if z < self.far { why } else { 6 };
            why = if self.near < z { why } else { 5 };
            why = if o < self.alpha_floor { 4 } else { why };
            why = if (s[0] < 0.0) | (s[1] < 0.0) | (s[2] < 0.0) {
                3
            } else {
                why
            };
            why = if (q[0] == 0.0) & (q[1] == 0.0) & (q[2] == 0.0) & (q[3] == 0.0) {
                2
            } else {
                why
            };
            reason[lane] = if zero == 0.0 { why } else { 1 };
        }
    }

    /// Computes mean, covariance and opacity on the screen of the kept lanes, densely.
    #[inline(always)]
    fn flatten(&self, kept: usize, scratch: &mut Scratch) {
        let Scratch {
            scale,
            rotation,
            opacity,
            camera,
            lanes,
            mean,
            covariance,
            determinant,
            log2_opacity,
            ..
        } = scratch;
        let r = &self.rotation;
        for (at, &lane) in lanes[..kept.min(BATCH)].iter().enumerate() {
            let lane = lane % BATCH;
            let z = camera[2][lane];
            let slope = [camera[0][lane] / z, camera[1][lane] / z];
            mean[0][at] = self.focal[0] * slope[0] + self.center[0];
            mean[1][at] = self.focal[1] * slope[1] + self.center[1];
            let q = normalized([0, 1, 2, 3].map(|part| f64::from(rotation[part][lane])));
            let columns = rotation_columns(q);
            let m = [0, 1].map(|axis| {
                let clamped = slope[axis]
                    .max(self.slope_min[axis])
                    .min(self.slope_max[axis]);
                let scale_to_screen = self.focal[axis] / z;
                let row =
                    [0, 1, 2].map(|k| scale_to_screen * (r[3 * axis + k] - clamped * r[6 + k]));
                [0, 1, 2].map(|k| f64::from(scale[k][lane]) * dot(row, columns[k]))
            });
            let cross = [
                m[0][1] * m[1][2] - m[0][2] * m[1][1],
                m[0][2] * m[1][0] - m[0][0] * m[1][2],
                m[0][0] * m[1][1] - m[0][1] * m[1][0],
            ];
            let area2 = dot(cross, cross);
            let (a, b, c) = (dot(m[0], m[0]), dot(m[0], m[1]), dot(m[1], m[1]));
            let low_pass = self.low_pass;
            let det = area2 + low_pass * (a + c) + low_pass * low_pass;
            covariance[0][at] = a + low_pass;
            covariance[1][at] = b;
            covariance[2][at] = c + low_pass;
            determinant[at] = det;
            let o = f64::from(opacity[lane]);
            let o = if self.compensated {
                o * (area2 / det).sqrt()
            } else {
                o
            };
            log2_opacity[at] = log2(o);
        }
    }

    /// Finds the tiles and the colour of the kept lanes and appends what reaches a tile to `out`.
    #[inline(always)]
    fn emit(
        &self,
        kept: usize,
        attributes: &GaussianAttributes,
        batch: &Batch,
        scratch: &Scratch,
        out: &mut Projected,
    ) {
        let reader = CoefficientReader::new(&attributes.spherical_harmonics);
        let mut coefficients = [0.0; 3 * MAX_COEFFICIENTS];
        for at in 0..kept {
            let determinant = scratch.determinant[at];
            if !(determinant > 0.0 && determinant.is_finite()) {
                out.counters.add(Counter::SkippedDegenerate, 1);
                continue;
            }
            let log2_opacity = scratch.log2_opacity[at];
            let [a, b, c] = [0, 1, 2].map(|part| scratch.covariance[part][at]);
            let mean = [scratch.mean[0][at], scratch.mean[1][at]];
            // The tile engine evaluates the exponent in binary32: a margin wider than its error keeps every
            // pixel that it would accept.
            let room = log2_opacity - self.log2_floor;
            let extent = 2.0 * LN_2 * (room + 1e-3 + 1e-5 * room.abs());
            let first_span = out.spans.len();
            if extent > 0.0 {
                let ellipse = Ellipse {
                    mean,
                    a,
                    b,
                    c,
                    determinant,
                    extent,
                };
                ellipse.append_spans(&self.visible, &mut out.spans);
            }
            if out.spans.len() == first_span {
                out.counters.add(Counter::SkippedOffScreen, 1);
                continue;
            }
            let lane = scratch.lanes[at];
            reader.read(batch, lane, &mut coefficients);
            let direction = direction([0, 1, 2].map(|axis| scratch.offset[axis][lane]));
            let Some(color) = spherical_harmonics::color(self.sh_degree, direction, &coefficients)
            else {
                out.spans.truncate(first_span);
                out.counters.add(Counter::SkippedNonFinite, 1);
                continue;
            };
            // alpha = opacity exp(-q / 2) = 2^(log2 opacity - q / (2 ln 2)), and q = d.x^2 / a +
            // (a / det) (d.y - (b / a) d.x)^2.
            let unit = (0.5 / LN_2).sqrt();
            let vertical = unit * (a / determinant).sqrt();
            let factor = [unit / a.sqrt(), -(b / a) * vertical, vertical];
            out.keys.push(ordered_bits(scratch.camera[2][lane] as f32));
            out.splats.push(Splat {
                mean,
                factor,
                log2_opacity: log2_opacity as f32,
                color,
                first_span: first_span as u32,
                span_count: (out.spans.len() - first_span) as u32,
            });
        }
        out.counters
            .add(Counter::GaussiansDrawn, out.splats.len() as u64);
    }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The unit quaternion of one that is not zero, whatever its size.
#[inline(always)]
fn normalized(q: [f64; 4]) -> [f64; 4] {
    let largest = q[0].abs().max(q[1].abs()).max(q[2].abs()).max(q[3].abs());
    let q = q.map(|part| part / largest);
    let norm = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    q.map(|part| part / norm)
}

/// The columns of the rotation matrix of a unit quaternion w, x, y, z.
#[inline(always)]
fn rotation_columns([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y + w * z),
            2.0 * (x * z - w * y),
        ],
        [
            2.0 * (x * y - w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z + w * x),
        ],
        [
            2.0 * (x * z + w * y),
            2.0 * (y * z - w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// The unit vector along `d` in binary32; zero where `d` is.
#[inline(always)]
fn direction(d: [f64; 3]) -> [f32; 3] {
    let largest = d[0].abs().max(d[1].abs()).max(d[2].abs());
    if largest == 0.0 {
        return [0.0; 3];
    }
    let d = d.map(|part| part / largest);
    let norm = dot(d, d).sqrt();
    d.map(|part| (part / norm) as f32)
}

/// Base-2 logarithm of a number that is zero (negative infinity) or a binary32 number or above 1e-300, to
/// 1e-13; a series without branches, so that it is computed in lanes.
#[inline(always)]
fn log2(x: f64) -> f64 {
    // Mantissa in [sqrt(1/2), sqrt(2)): subtracting the bits of sqrt(1/2) makes the exponent field tell.
    const SQRT_HALF_BITS: u64 = 0x3fe6_a09e_667f_3bcd;
    let exponent = (x.to_bits().wrapping_sub(SQRT_HALF_BITS) as i64) >> 52;
    let mantissa = f64::from_bits(x.to_bits().wrapping_sub((exponent << 52) as u64));
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s2 = s * s;
    // 2 atanh(s) = 2 (s + s^3 / 3 + ...), |s| < 0.1716: the first term left out is below 1e-14.
    let series = 1.0
        + s2 * (1.0 / 3.0
            + s2 * (1.0 / 5.0
                + s2 * (1.0 / 7.0
                    + s2 * (1.0 / 9.0
                        + s2 * (1.0 / 11.0
                            + s2 * (1.0 / 13.0 + s2 * (1.0 / 15.0 + s2 * (1.0 / 17.0))))))));
    let value = exponent as f64 + 2.0 / LN_2 * s * series;
    if x > 0.0 { value } else { f64::NEG_INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log2_is_exact_enough() {
        let mut x = 1e-45f64;
        while x < 4e38 {
            let error = (log2(x) - x.log2()).abs();
            assert!(error <= 1e-13 * x.log2().abs().max(1.0), "{x}: {error}");
            x *= 1.000_37;
        }
        assert_eq!(log2(0.0), f64::NEG_INFINITY);
        assert_eq!(log2(1.0), 0.0);
    }

    #[test]
    fn quaternions_of_any_size_rotate_alike() {
        let unit = rotation_columns(normalized([0.5, -0.5, 0.5, 0.5]));
        for size in [1e-30, 1e-20, 3.0, 1e20, 1e30] {
            let columns = rotation_columns(normalized([size, -size, size, size]));
            for (a, b) in unit.iter().flatten().zip(columns.iter().flatten()) {
                assert!((a - b).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_direction_is_a_unit_vector_at_any_distance() {
        for size in [1e-30, 1.0, 1e200] {
            let [x, y, z] = direction([3.0 * size, 0.0, -4.0 * size]);
            assert_eq!([x, y, z], [0.6, 0.0, -0.8]);
        }
        assert_eq!(direction([0.0; 3]), [0.0; 3]);
    }
}
