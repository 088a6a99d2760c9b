//! The decoding of attributes: from integers of compressed files to the numbers that they stand for. Everything is
//! evaluated in binary64, and rounded once to binary32 where a number is an attribute.

use std::f64::consts::FRAC_1_SQRT_2;

/// The value of a code of `bits` bits between the bounds of its chunk.
pub fn value_of_chunk(code: u32, bits: i32, [low, high]: [f64; 2]) -> f64 {
    let t = f64::from(code) / (2_f64.powi(bits) - 1.0);
    low * (1.0 - t) + high * t
}

/// The coordinate of a signed logarithm.
pub fn coordinate_of_logarithm(value: f64) -> f32 {
    let magnitude = value.abs().exp_m1();
    if value < 0.0 { -magnitude as f32 } else { magnitude as f32 }
}

/// The standard deviation of a decoded logarithm.
pub fn scale_of_decoded_logarithm(value: f64) -> f32 {
    value.exp() as f32
}

/// The opacity of a decoded logit.
pub fn opacity_of_decoded_logit(value: f64) -> f32 {
    (1.0 / (1.0 + (-value).exp())) as f32
}

/// The coefficient 0 of a decoded component of a colour.
pub fn coefficient_of_color(value: f64) -> f32 {
    ((value - 0.5) / 0.282_094_791_773_878_14) as f32
}

/// The quaternion of three codes of `bits` bits and the number of the component that is left out; (1, 0, 0, 0) if there
/// is no such component.
pub fn quaternion_of_smaller(codes: [u32; 3], bits: i32, left_out: Option<usize>) -> [f32; 4] {
    let Some(left_out) = left_out else {
        return [1.0, 0.0, 0.0, 0.0];
    };
    let smaller = codes.map(|code| {
        let fraction = f64::from(code) / (2_f64.powi(bits) - 1.0);
        (2.0 * fraction - 1.0) * FRAC_1_SQRT_2
    });
    let squares = smaller[0] * smaller[0] + smaller[1] * smaller[1] + smaller[2] * smaller[2];
    let mut quaternion = smaller.to_vec();
    quaternion.insert(left_out, f64::max(0.0, 1.0 - squares).sqrt());
    std::array::from_fn(|component| quaternion[component] as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert_eq!(value_of_chunk(0, 11, [-3.0, 7.0]), -3.0);
        assert_eq!(value_of_chunk(2047, 11, [-3.0, 7.0]), 7.0);
        assert_eq!(value_of_chunk(51, 8, [0.0, 1.0]), 0.2);
        assert_eq!(coordinate_of_logarithm(1.0), (std::f64::consts::E - 1.0) as f32);
        assert_eq!(coordinate_of_logarithm(-1.0), -((std::f64::consts::E - 1.0) as f32));
        assert_eq!(coordinate_of_logarithm(1e-9), 1e-9);
        assert_eq!(coefficient_of_color(0.5), 0.0);
        let half = std::f32::consts::FRAC_1_SQRT_2;
        assert_eq!(quaternion_of_smaller([1023, 0, 0], 10, Some(3)), [half, -half, -half, 0.0]);
        assert_eq!(quaternion_of_smaller([0; 3], 8, None), [1.0, 0.0, 0.0, 0.0]);
        let [w, x, y, z] = quaternion_of_smaller([128; 3], 8, Some(1));
        assert!(w == y && y == z && (0.0..0.01).contains(&w) && (0.99..1.0).contains(&x));
    }
}
