//! Spherical harmonics: the view-dependent colour of a Gaussian, with the signs and order of 3DGS.

use super::fetch::{COEFFICIENT_FLOATS, MAX_COEFFICIENTS};
use fearless_simd::{Simd, f32x4, f32x16, prelude::*};

const C0: f32 = 0.282_094_79;
const C1: f32 = 0.488_602_51;
const C2: [f32; 5] = [
    1.092_548_4,
    -1.092_548_4,
    0.315_391_57,
    -1.092_548_4,
    0.546_274_2,
];
const C3: [f32; 7] = [
    -0.590_043_6,
    2.890_611_4,
    -0.457_045_8,
    0.373_176_34,
    -0.457_045_8,
    1.445_305_7,
    -0.590_043_6,
];

const C4: [f32; 9] = [
    2.503_343,
    -1.770_130_8,
    0.946_174_7,
    -0.669_046_54,
    0.105_785_55,
    -0.669_046_54,
    0.473_087_35,
    -1.770_130_8,
    0.625_835_7,
];

/// How many coefficients degrees 0 to `degree` have.
pub fn coefficient_count(degree: u32) -> usize {
    (degree as usize + 1).pow(2)
}

/// The basis functions of degrees 0 to `degree` (at most 4) in the unit direction from the eye.
#[inline(always)]
fn basis(degree: u32, [x, y, z]: [f32; 3]) -> [f32; MAX_COEFFICIENTS] {
    let mut b = [0.0; MAX_COEFFICIENTS];
    b[0] = C0;
    if degree >= 1 {
        b[1] = -C1 * y;
        b[2] = C1 * z;
        b[3] = -C1 * x;
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    if degree >= 2 {
        b[4] = C2[0] * (x * y);
        b[5] = C2[1] * (y * z);
        b[6] = C2[2] * (2.0 * zz - xx - yy);
        b[7] = C2[3] * (x * z);
        b[8] = C2[4] * (xx - yy);
    }
    if degree >= 3 {
        b[9] = C3[0] * y * (3.0 * xx - yy);
        b[10] = C3[1] * (x * y) * z;
        b[11] = C3[2] * y * (4.0 * zz - xx - yy);
        b[12] = C3[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
        b[13] = C3[4] * x * (4.0 * zz - xx - yy);
        b[14] = C3[5] * z * (xx - yy);
        b[15] = C3[6] * x * (xx - 3.0 * yy);
    }
    if degree >= 4 {
        b[16] = C4[0] * (x * y) * (xx - yy);
        b[17] = C4[1] * (y * z) * (3.0 * xx - yy);
        b[18] = C4[2] * (x * y) * (7.0 * zz - 1.0);
        b[19] = C4[3] * (y * z) * (7.0 * zz - 3.0);
        b[20] = C4[4] * (zz * (35.0 * zz - 30.0) + 3.0);
        b[21] = C4[5] * (x * z) * (7.0 * zz - 3.0);
        b[22] = C4[6] * (xx - yy) * (7.0 * zz - 1.0);
        b[23] = C4[7] * (x * z) * (xx - 3.0 * yy);
        b[24] = C4[8] * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy));
    }
    b
}

/// The colour `max(0, 0.5 + SH)` in the unit direction from the eye; `None` if a coefficient is not finite.
///
/// `coefficients` holds red, green and blue of each coefficient in turn; what follows them is not used.
#[inline(always)]
pub(super) fn color<S: Simd>(
    simd: S,
    degree: u32,
    direction: [f32; 3],
    coefficients: &[f32; COEFFICIENT_FLOATS],
) -> Option<[f32; 3]> {
    let count = coefficient_count(degree).min(MAX_COEFFICIENTS);
    let basis = basis(degree, direction);
    // A vector holds a coefficient's three components and the next one's first, which is not used. Two sums
    // halve the wait for one another; the largest terms, the constant one and 0.5, are added last.
    let (mut even, mut odd) = (f32x4::splat(simd, 0.0), f32x4::splat(simd, 0.0));
    for k in (1..count).step_by(2) {
        odd = term(simd, coefficients, &basis, k, odd);
    }
    for k in (2..count).step_by(2) {
        even = term(simd, coefficients, &basis, k, even);
    }
    let sum = term(simd, coefficients, &basis, 0, even + odd) + 0.5;
    // Multiplied by zero, what is not finite becomes NaN.
    let (whole, rest) = coefficients[..3 * count].as_chunks::<16>();
    let mut nothing = f32x16::splat(simd, 0.0);
    for part in whole {
        nothing += f32x16::simd_from(simd, *part) * 0.0;
    }
    let mut finite = nothing.simd_eq(0.0).to_bitmask() == 0xFFFF;
    for coefficient in rest {
        finite &= coefficient.is_finite();
    }
    finite.then_some([sum[0].max(0.0), sum[1].max(0.0), sum[2].max(0.0)])
}

/// `sum` and coefficient `k` times its basis function.
#[inline(always)]
fn term<S: Simd>(
    simd: S,
    coefficients: &[f32; COEFFICIENT_FLOATS],
    basis: &[f32; MAX_COEFFICIENTS],
    k: usize,
    sum: f32x4<S>,
) -> f32x4<S> {
    let coefficient = f32x4::from_slice(simd, &coefficients[3 * k..3 * k + 4]);
    coefficient.mul_add(f32x4::splat(simd, basis[k]), sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    use fearless_simd::{Level, dispatch};

    fn color(degree: u32, direction: [f32; 3], sh: &[f32; COEFFICIENT_FLOATS]) -> Option<[f32; 3]> {
        dispatch!(Level::new(), simd => super::color(simd, degree, direction, sh))
    }

    fn coefficients(values: &[(usize, [f32; 3])]) -> [f32; COEFFICIENT_FLOATS] {
        let mut out = [0.0; COEFFICIENT_FLOATS];
        for &(k, rgb) in values {
            out[3 * k..3 * k + 3].copy_from_slice(&rgb);
        }
        out
    }

    #[test]
    fn degree_zero_is_the_same_from_everywhere() {
        let sh = coefficients(&[(0, [1.0, 0.0, -9.0])]);
        let seen = color(0, [0.0, 0.6, 0.8], &sh).unwrap();
        assert_eq!(seen, [0.5 + C0, 0.5, 0.0], "negative sums are clamped");
    }

    #[test]
    fn degree_one_has_the_signs_of_3dgs() {
        let sh = coefficients(&[
            (1, [1.0, 0.0, 0.0]),
            (2, [0.0, 1.0, 0.0]),
            (3, [0.0, 0.0, 1.0]),
        ]);
        let from = |direction| color(1, direction, &sh).unwrap();
        assert_eq!(from([0.0, 1.0, 0.0])[0], 0.5 - C1);
        assert_eq!(from([0.0, 0.0, 1.0])[1], 0.5 + C1);
        assert_eq!(from([-1.0, 0.0, 0.0])[2], 0.5 + C1);
    }

    #[test]
    fn coefficients_that_are_not_finite_are_found_at_the_degree_drawn_only() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let sh = coefficients(&[(3, [0.0, bad, 0.0])]);
            assert_eq!(color(1, [0.0, 1.0, 0.0], &sh), None);
            assert!(color(0, [0.0, 1.0, 0.0], &sh).is_some());
        }
    }

    #[test]
    fn the_basis_is_orthonormal() {
        // A midpoint rule over the sphere is exact enough to tell any wrong constant or sign of a square.
        let (rows, columns) = (200u32, 400u32);
        let mut products = vec![[0.0f64; MAX_COEFFICIENTS]; MAX_COEFFICIENTS];
        for row in 0..rows {
            let z = -1.0 + (f64::from(row) + 0.5) * 2.0 / f64::from(rows);
            let radius = (1.0 - z * z).sqrt();
            for column in 0..columns {
                let angle = (f64::from(column) + 0.5) * std::f64::consts::TAU / f64::from(columns);
                let direction = [radius * angle.cos(), radius * angle.sin(), z].map(|v| v as f32);
                let b = basis(4, direction);
                for i in 0..MAX_COEFFICIENTS {
                    for j in 0..MAX_COEFFICIENTS {
                        products[i][j] += f64::from(b[i]) * f64::from(b[j]);
                    }
                }
            }
        }
        let area = 4.0 * std::f64::consts::PI / f64::from(rows * columns);
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!(
                    (product * area - expected).abs() < 1e-3,
                    "{i} {j}: {}",
                    product * area
                );
            }
        }
    }
}
