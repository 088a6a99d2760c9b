//! The depth of a Gaussian's centre, encoded as in the depth attachment.

use crate::format::Format;
use crate::format::depth::DepthEncoding;
use crate::state::Viewport;
use crate::state::gaussian::{Camera, CameraModel};

/// The change of depths as depth variables ascend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DepthTrend {
    /// Depths never decrease.
    Rising,
    /// Depths never increase.
    Falling,
    /// Depths follow no order.
    None,
}

/// The map from the depth variable of a Gaussian's centre to its depth in the attachment's encoding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CenterDepth {
    /// True if the depth is linear in the depth variable, false if it is linear in its inverse.
    is_linear: bool,
    coefficients: [f64; 2],
    /// The factor and the summand that take depths before the viewport to 0 to 1.
    to_unit: [f64; 2],
    /// The viewport's depths of 0 and 1.
    range: [f64; 2],
    code: DepthEncoding,
}

impl CenterDepth {
    /// Of a camera, a viewport and the depths before it, for an attachment of `format`.
    pub(crate) fn new(camera: &Camera, viewport: &Viewport, negative_one_to_one: bool, format: Format) -> Self {
        Self {
            is_linear: camera.model == CameraModel::Orthographic,
            coefficients: camera.depth_coefficients.map(f64::from),
            to_unit: if negative_one_to_one { [0.5, 0.5] } else { [1.0, 0.0] },
            range: [viewport.min_depth, viewport.max_depth].map(f64::from),
            code: DepthEncoding::of(format),
        }
    }

    /// The depth of a centre whose depth variable is `z`: computed in binary64, taken to 0 to 1, clamped to that, mapped to
    /// the viewport's range and rounded once, to the format's nearest.
    #[inline]
    pub(crate) fn code(&self, z: f32) -> u32 {
        let z = f64::from(z);
        let [c0, c1] = self.coefficients;
        self.encode(c0 + if self.is_linear { c1 * z } else { c1 / z })
    }

    /// The depth of a centre whose normalised device coordinate is `depth`, taken to 0 to 1, clamped, mapped and rounded so.
    #[inline]
    pub(crate) fn encode(&self, depth: f64) -> u32 {
        let [near, far] = self.range;
        let [factor, summand] = self.to_unit;
        let unit = clamp(depth * factor + summand);
        let depth = near + unit * (far - near);
        match self.code {
            DepthEncoding::Float => self.code.encode_one(depth as f32),
            DepthEncoding::Unorm(bits) => {
                let depth = clamp(depth);
                let greatest = f64::from((1u32 << bits) - 1);
                libm::rint(depth * greatest) as u32
            }
        }
    }

    /// The encoding of depths.
    pub(crate) fn unit(&self) -> DepthEncoding {
        self.code
    }

    /// The change of [`CenterDepth::code`] as z grows. Each operation in it is monotonic, its rounding included. Only a
    /// linear depth allows z of either sign.
    pub(crate) fn trend(&self) -> DepthTrend {
        let [near, far] = self.range;
        let slope = self.coefficients[1] * (far - near);
        let slope = if self.is_linear { slope } else { -slope };
        if slope < 0.0 { DepthTrend::Falling } else { DepthTrend::Rising }
    }
}

/// Clamps to 0 to 1. NaN becomes 0, and so does negative zero.
fn clamp(depth: f64) -> f64 {
    if depth > 0.0 { depth.min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(model: CameraModel, coefficients: [f32; 2], range: [f32; 2], format: Format) -> CenterDepth {
        let camera = Camera {
            model,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0; 3],
            focal_length: [1.0; 2],
            principal_point: [0.0; 2],
            near_plane: 0.5,
            far_plane: 100.0,
            depth_coefficients: coefficients,
            distortion: None,
        };
        let viewport = Viewport { x: 0.0, y: 0.0, width: 8.0, height: 8.0, min_depth: range[0], max_depth: range[1] };
        CenterDepth::new(&camera, &viewport, false, format)
    }

    #[gaurast_runner::test]
    fn depths_are_the_projection_matrix_s() {
        // Near 1, far 4: depth (4 / 3) (1 - 1 / z).
        let of = |format| depth(CameraModel::Pinhole, [4.0 / 3.0, -4.0 / 3.0], [0.0, 1.0], format);
        let float = of(Format::D32Sfloat);
        let at = |z| float.unit().decode(float.code(z));
        assert_eq!(at(1.0), 0.0);
        assert_eq!(at(0.5), 0.0, "nearer than the near plane");
        assert_eq!(at(9.0), 1.0, "beyond the far plane");
        let (two, expected) = (at(2.0), 2.0 / 3.0);
        assert!((two - expected).abs() < 1e-6, "{two}");
        assert_eq!(of(Format::D16Unorm).code(2.0), 43690);
        assert_eq!(of(Format::X8D24UnormPack32).code(4.0), (1 << 24) - 1);
    }

    #[gaurast_runner::test]
    fn depths_from_minus_one_are_taken_to_the_unit() {
        let format = Format::D32Sfloat;
        let unit = depth(CameraModel::Orthographic, [0.0, 1.0], [0.25, 0.75], format);
        let both = CenterDepth { to_unit: [0.5, 0.5], ..unit };
        for (z, expected) in [(-2.0, 0.25), (-1.0, 0.25), (0.0, 0.5), (0.5, 0.625), (3.0, 0.75)] {
            assert_eq!(both.unit().decode(both.code(z)), expected, "{z}");
        }
        assert_eq!(unit.unit().decode(unit.code(0.5)), 0.5);
    }

    #[gaurast_runner::test]
    fn the_viewport_maps_depths_and_trends_are_true() {
        let cases = [
            (CameraModel::Pinhole, [1.0, -1.0], [0.25, 0.75], DepthTrend::Rising),
            (CameraModel::Pinhole, [0.0, 1.0], [0.0, 1.0], DepthTrend::Falling),
            (CameraModel::Fisheye, [0.0, 1.0], [1.0, 0.5], DepthTrend::Rising),
            (CameraModel::Orthographic, [0.5, 0.01], [0.0, 1.0], DepthTrend::Rising),
            (CameraModel::Orthographic, [0.5, 0.01], [1.0, 0.0], DepthTrend::Falling),
            (CameraModel::Pinhole, [1.0, -1.0], [-3.0, 2.0], DepthTrend::Rising),
        ];
        for (model, coefficients, range, trend) in cases {
            for format in [Format::D16Unorm, Format::X8D24UnormPack32, Format::D32Sfloat] {
                let depth = depth(model, coefficients, range, format);
                assert_eq!(depth.trend(), trend);
                let first = if model == CameraModel::Orthographic { -40 } else { 1 };
                let codes: Vec<u32> = (first..200).map(|z| depth.code(0.3 * z as f32)).collect();
                let ordered = match trend {
                    DepthTrend::Falling => codes.is_sorted_by(|a, b| a >= b),
                    _ => codes.is_sorted(),
                };
                assert!(ordered && codes[0] != codes[codes.len() - 1], "{model:?} {format:?}");
                let [low, high] = [range[0].min(range[1]), range[0].max(range[1])];
                if format == Format::D32Sfloat {
                    let inside = |&code: &u32| (low..=high).contains(&depth.unit().decode(code));
                    assert!(codes.iter().all(inside));
                }
            }
        }
    }
}
