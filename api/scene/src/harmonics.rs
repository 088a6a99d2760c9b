//! Rotations of spherical harmonics.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use glam::{DMat3, DVec3};

/// The value of the constant spherical harmonic, 1 / (2 sqrt(pi)).
pub const SH_C0: f64 = 0.282_094_791_773_878_14;

/// The highest spherical harmonics degree that a [`Scene`](crate::Scene) holds.
pub const MAX_SH_DEGREE: u32 = 4;

/// The number of coefficients of all degrees up to `degree`.
pub(crate) fn sh_coefficients(degree: u32) -> usize {
    (degree as usize + 1).pow(2)
}

/// The number of basis functions up to [`MAX_SH_DEGREE`].
const BASIS: usize = (MAX_SH_DEGREE as usize + 1).pow(2);

/// The effect of an orthogonal map on spherical harmonics coefficients. The new coefficients have in a mapped direction
/// the colour that the old ones have in the direction itself.
#[derive(Debug)]
pub(crate) enum Turn {
    /// No change.
    Identity,
    /// A sign for each coefficient.
    Signs([f32; BASIS]),
    /// A square matrix for each degree from 1 on, stored row by row.
    Matrices(Vec<Vec<f64>>),
}

impl Turn {
    /// The effect of `map`, an orthogonal matrix that may include a reflection, on coefficients up to `degree`.
    pub(crate) fn new(map: &DMat3, degree: u32) -> Self {
        if degree == 0 || *map == DMat3::IDENTITY {
            return Self::Identity;
        }
        let matrices: Vec<_> = (1..=degree as usize).map(|degree| matrix(map, degree)).collect();
        let mut signs = [1.0; BASIS];
        for (l, matrix) in (1..).zip(&matrices) {
            let size = 2 * l + 1;
            for (index, entry) in matrix.iter().enumerate() {
                let (row, column) = (index / size, index % size);
                if row == column && entry.abs() == 1.0 {
                    signs[l * l + row] = *entry as f32;
                } else if row == column || *entry != 0.0 {
                    return Self::Matrices(matrices);
                }
            }
        }
        Self::Signs(signs)
    }

    /// Transforms one Gaussian's coefficients, of which the constant one is first.
    pub(crate) fn apply(&self, sh: &mut [[f32; 3]]) {
        match self {
            Self::Identity => {}
            Self::Signs(signs) => {
                for (rgb, sign) in sh.iter_mut().zip(signs) {
                    *rgb = rgb.map(|value| value * sign);
                }
            }
            Self::Matrices(matrices) => {
                for (l, matrix) in (1..).zip(matrices) {
                    let size = 2 * l + 1;
                    let Some(band) = sh.get_mut(l * l..(l + 1) * (l + 1)) else {
                        return;
                    };
                    let mut old = [[0.0; 3]; 2 * MAX_SH_DEGREE as usize + 1];
                    old[..size].copy_from_slice(band);
                    for (rgb, row) in band.iter_mut().zip(matrix.chunks_exact(size)) {
                        let mut sum = [0.0; 3];
                        for (factor, old) in row.iter().zip(&old) {
                            // A factor of zero is skipped, because zero times infinity is NaN.
                            if *factor != 0.0 {
                                for (sum, old) in sum.iter_mut().zip(old) {
                                    *sum += factor * f64::from(*old);
                                }
                            }
                        }
                        *rgb = sum.map(|value| value as f32);
                    }
                }
            }
        }
    }
}

/// The matrix that maps the coefficients of `degree`: entry (m, n) is the integral over the sphere of basis function m
/// in the mapped direction times function n.
fn matrix(map: &DMat3, degree: usize) -> Vec<f64> {
    let band = degree * degree..(degree + 1) * (degree + 1);
    let size = band.len();
    let mut matrix = vec![0.0; size * size];
    for (direction, weight) in quadrature() {
        let (mapped, old) = (basis(*map * direction), basis(direction));
        for (row, mapped) in matrix.chunks_exact_mut(size).zip(&mapped[band.clone()]) {
            for (entry, old) in row.iter_mut().zip(&old[band.clone()]) {
                *entry += weight * mapped * old;
            }
        }
    }
    // Entries that are -1, 0 or 1 up to rounding become exact, as they are for rotations of the axes onto each other.
    for entry in &mut matrix {
        for exact in [-1.0, 0.0, 1.0] {
            if (*entry - exact).abs() < 1e-12 {
                *entry = exact;
            }
        }
    }
    matrix
}

/// Directions and weights that integrate polynomials of degree 9 and less over the sphere exactly: the Gauss-Legendre
/// quadrature of five heights, with ten directions each.
fn quadrature() -> impl Iterator<Item = (DVec3, f64)> {
    let heights = [
        (0.0, 128.0 / 225.0),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    heights.into_iter().flat_map(|(z, weight): (f64, f64)| {
        (0..10).map(move |step| {
            let (sine, cosine) = libm::sincos(TAU * f64::from(step) / 10.0);
            let radius = (1.0 - z * z).sqrt();
            let direction = DVec3::new(radius * cosine, radius * sine, z);
            (direction, weight * TAU / 10.0)
        })
    })
}

/// The real spherical harmonics in direction `d`, a unit vector, with the Condon-Shortley phase: 3DGS's order and
/// signs.
pub(crate) fn basis(d: DVec3) -> [f64; BASIS] {
    const DEGREE: usize = MAX_SH_DEGREE as usize;
    let mut values = [0.0; BASIS];
    // The real and imaginary parts of (x + iy)^m; below, the associated Legendre functions without their power of
    // sin(theta).
    let (mut real, mut imaginary) = (1.0, 0.0);
    let mut sectoral = 1.0;
    for m in 0..=DEGREE {
        let (mut below, mut legendre) = (0.0, sectoral);
        for l in m..=DEGREE {
            let ratio: f64 = (l - m + 1..=l + m).map(|k| k as f64).product();
            let norm = ((2 * l + 1) as f64 / (4.0 * PI * ratio)).sqrt();
            let norm = if m == 0 { norm * FRAC_1_SQRT_2 } else { norm };
            let value = std::f64::consts::SQRT_2 * norm * legendre;
            let middle = l * l + l;
            values[middle - m] = value * imaginary;
            values[middle + m] = value * real;
            let next = ((2 * l + 1) as f64 * d.z * legendre - (l + m) as f64 * below) / (l - m + 1) as f64;
            (below, legendre) = (legendre, next);
        }
        (real, imaginary) = (real * d.x - imaginary * d.y, real * d.y + imaginary * d.x);
        sectoral *= -((2 * m + 1) as f64);
    }
    debug_assert_eq!(values.len(), sh_coefficients(MAX_SH_DEGREE));
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn the_basis_is_that_of_3dgs() {
        let d = DVec3::new(0.36, -0.48, 0.8);
        let [x, y, z] = d.to_array();
        // The constants of the original 3DGS code.
        let expected = [
            SH_C0,
            -0.488_602_511_902_919_9 * y,
            0.488_602_511_902_919_9 * z,
            -0.488_602_511_902_919_9 * x,
            1.092_548_430_592_079_2 * x * y,
            -1.092_548_430_592_079_2 * y * z,
            0.315_391_565_252_520_05 * (2.0 * z * z - x * x - y * y),
            -1.092_548_430_592_079_2 * x * z,
            0.546_274_215_296_039_6 * (x * x - y * y),
            -0.590_043_589_926_643_5 * y * (3.0 * x * x - y * y),
            2.890_611_442_640_554 * x * y * z,
            -0.457_045_799_464_465_8 * y * (4.0 * z * z - x * x - y * y),
            0.373_176_332_590_115_4 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y),
            -0.457_045_799_464_465_8 * x * (4.0 * z * z - x * x - y * y),
            1.445_305_721_320_277 * z * (x * x - y * y),
            -0.590_043_589_926_643_5 * x * (x * x - 3.0 * y * y),
            2.503_342_941_796_704_6 * x * y * (x * x - y * y),
            -1.770_130_769_779_930_4 * y * z * (3.0 * x * x - y * y),
            0.946_174_695_757_560_1 * x * y * (7.0 * z * z - 1.0),
            -0.669_046_543_557_289_2 * y * z * (7.0 * z * z - 3.0),
            0.105_785_546_915_204_3 * (z * z * (35.0 * z * z - 30.0) + 3.0),
            -0.669_046_543_557_289_2 * x * z * (7.0 * z * z - 3.0),
            0.473_087_347_878_780_05 * (x * x - y * y) * (7.0 * z * z - 1.0),
            -1.770_130_769_779_930_4 * x * z * (x * x - 3.0 * y * y),
            0.625_835_735_449_176_1 * (x * x * (x * x - 3.0 * y * y) - y * y * (3.0 * x * x - y * y)),
        ];
        for (k, (found, expected)) in basis(d).into_iter().zip(expected).enumerate() {
            assert!((found - expected).abs() < 1e-12, "{k}: {found} is not {expected}");
        }
    }

    #[test]
    fn turned_coefficients_have_the_colours_of_turned_directions() {
        let turn = DMat3::from_quat(DQuat::from_xyzw(0.3, -0.5, 0.7, 0.2).normalize());
        let swap = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
        let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        let half_turn = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        for map in [turn, swap, mirror, half_turn, mirror * turn, DMat3::IDENTITY] {
            for degree in 0..=MAX_SH_DEGREE {
                let old: Vec<[f32; 3]> = (0..sh_coefficients(degree))
                    .map(|k| [0.0, 1.0, 2.0].map(|c| ((k as f32 + 1.0) * 1.7 + c).sin()))
                    .collect();
                let mut new = old.clone();
                Turn::new(&map, degree).apply(&mut new);
                for step in 0..20 {
                    let d = DVec3::new(f64::from(step).sin(), f64::from(step * step).cos(), 0.3);
                    let d = d.normalize();
                    let colour =
                        |sh: &[[f32; 3]], d| -> f64 { basis(d).iter().zip(sh).map(|(y, c)| y * f64::from(c[1])).sum() };
                    let difference = colour(&old, d) - colour(&new, map * d);
                    assert!(difference.abs() < 1e-5, "{map}, degree {degree}: {difference}");
                }
            }
        }
        // Rotations of the axes onto each other are exact.
        assert!(matches!(Turn::new(&half_turn, 4), Turn::Signs(_)));
        assert!(matches!(Turn::new(&mirror, 4), Turn::Signs(_)));
    }
}
