//! Depth bias of polygons (Vulkan 1.3, "Depth Bias").

use super::viewport::WindowVertex;
use crate::format::{Channel, Format, Numeric};
use crate::state::{DepthBias, DepthBiasUnit};

/// The smallest difference of depths that a depth attachment resolves, as Vulkan's `r`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum DepthUnit {
    /// The same for all depths, of so many bits.
    Fixed(u32),
    /// The unit in the last place of a binary32 number with the exponent of the polygon's depth of greatest magnitude.
    Float,
}

impl DepthUnit {
    /// The unit of a pass's depth attachment; that of 24 bits if there is none.
    pub(super) fn of(format: Option<Format>) -> Self {
        let depth = format.and_then(|format| {
            let bits = format.components().iter();
            let bits = bits.filter(|component| component.channel == Channel::D);
            bits.map(|component| component.bits).next()
        });
        let is_float = format.is_some_and(|format| {
            let numeric = format.numeric();
            numeric == Numeric::Sfloat || format == Format::D32SfloatS8Uint
        });
        match depth {
            Some(_) if is_float => Self::Float,
            bits => Self::Fixed(bits.unwrap_or(24)),
        }
    }

    /// The unit of a bias of a polygon.
    fn at(self, greatest_depth: f32, unit: DepthBiasUnit) -> f32 {
        match (unit, self) {
            (DepthBiasUnit::One, _) => 1.0,
            (DepthBiasUnit::Format { .. }, Self::Float) => {
                let exponent = greatest_depth.to_bits() & 0x7F80_0000;
                f32::from_bits(exponent.saturating_sub(23 << 23))
            }
            (DepthBiasUnit::Format { is_exact } | DepthBiasUnit::FixedPoint { is_exact }, of) => {
                let bits = match of {
                    Self::Fixed(bits) => bits,
                    Self::Float => f32::MANTISSA_DIGITS,
                };
                let steps = (1u64 << bits) as f64;
                // Vulkan allows twice the distance of neighbouring values.
                (if is_exact { 1.0 / steps } else { 2.0 / (steps - 1.0) }) as f32
            }
        }
    }
}

/// The bias that is added to the depth of a triangle.
pub(super) fn bias(bias: &DepthBias, unit: DepthUnit, corners: [&WindowVertex; 3]) -> f32 {
    let [a, b, c] = corners;
    let difference = |to: &WindowVertex, from: &WindowVertex| {
        let [x, y] = [0, 1].map(|axis| to.window[axis] - from.window[axis]);
        [x, y, to.depth - from.depth]
    };
    let (e, f) = (difference(a, b), difference(c, a));
    let inverse = 1.0 / (e[0] * f[1] - e[1] * f[0]);
    let along_x = ((e[1] * f[2] - e[2] * f[1]) * inverse).abs();
    let along_y = ((e[2] * f[0] - e[0] * f[2]) * inverse).abs();
    let slope = along_x.max(along_y);
    let slope = if slope.is_finite() { slope } else { 0.0 };
    let greatest = a.depth.abs().max(b.depth.abs()).max(c.depth.abs());
    let offset = unit.at(greatest, bias.unit) * bias.constant + slope * bias.slope;
    if bias.clamp > 0.0 {
        offset.min(bias.clamp)
    } else if bias.clamp < 0.0 {
        offset.max(bias.clamp)
    } else {
        offset
    }
}
