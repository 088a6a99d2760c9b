//! Spherical harmonics: the view-dependent colour of a Gaussian, with the signs and order of 3DGS.

use fearless_simd::{Simd, f32x4, f32x16, prelude::*};
use isa::float::{self, FusedMultiply};

/// The number of coefficients of degrees 0 to 4.
pub(crate) const MAX_COEFFICIENTS: usize = 25;

/// Three floats for each of them, padded to whole vectors.
pub(crate) const COEFFICIENT_FLOATS: usize = 80;

const C0: f32 = 0.282_094_79;

const C1: f32 = 0.488_602_51;

const C2: [f32; 5] = [1.092_548_4, -1.092_548_4, 0.315_391_57, -1.092_548_4, 0.546_274_2];

const C3: [f32; 7] = [-0.590_043_6, 2.890_611_4, -0.457_045_8, 0.373_176_34, -0.457_045_8, 1.445_305_7, -0.590_043_6];

const C4: [f32; 9] = [
    2.503_343,
    -1.770_130_8,
    0.946_174_7,
    -0.669_046_5,
    0.105_785_55,
    -0.669_046_5,
    0.473_087_35,
    -1.770_130_8,
    0.625_835_7,
];

/// The number of coefficients of degrees 0 to `degree`.
pub fn coefficient_count(degree: u32) -> usize {
    (degree as usize + 1).pow(2)
}

/// The number of directions whose basis functions are evaluated together.
pub(crate) const DIRECTIONS: usize = 16;

/// The basis functions of degrees 0 to 4 in some directions: by function, then by direction.
pub(crate) struct Bases([[f32; DIRECTIONS]; MAX_COEFFICIENTS]);

impl Default for Bases {
    fn default() -> Self {
        Self([[0.0; DIRECTIONS]; MAX_COEFFICIENTS])
    }
}

impl Bases {
    /// Evaluates the functions of degrees 0 to `degree` (at most 4) in unit directions from the eye, given as arrays of
    /// x, y and z.
    #[inline(always)]
    pub(crate) fn find<S: Simd>(&mut self, simd: S, degree: u32, [x, y, z]: &[[f32; DIRECTIONS]; 3]) {
        let load = |lanes: &[f32; DIRECTIONS]| f32x16::from_slice(simd, lanes);
        let (x, y, z) = (load(x), load(y), load(z));
        let mut set = |k: usize, value: f32x16<S>| value.store_slice(&mut self.0[k]);
        set(0, f32x16::splat(simd, C0));
        if degree >= 1 {
            set(1, y * -C1);
            set(2, z * C1);
            set(3, x * -C1);
        }
        let (xx, yy, zz) = (x * x, y * y, z * z);
        if degree >= 2 {
            set(4, x * y * C2[0]);
            set(5, y * z * C2[1]);
            set(6, (zz * 2.0 - xx - yy) * C2[2]);
            set(7, x * z * C2[3]);
            set(8, (xx - yy) * C2[4]);
        }
        if degree >= 3 {
            set(9, y * C3[0] * (xx * 3.0 - yy));
            set(10, x * y * C3[1] * z);
            set(11, y * C3[2] * (zz * 4.0 - xx - yy));
            set(12, z * C3[3] * (zz * 2.0 - xx * 3.0 - yy * 3.0));
            set(13, x * C3[4] * (zz * 4.0 - xx - yy));
            set(14, z * C3[5] * (xx - yy));
            set(15, x * C3[6] * (xx - yy * 3.0));
        }
        if degree >= 4 {
            set(16, x * y * C4[0] * (xx - yy));
            set(17, y * z * C4[1] * (xx * 3.0 - yy));
            set(18, x * y * C4[2] * (zz * 7.0 - 1.0));
            set(19, y * z * C4[3] * (zz * 7.0 - 3.0));
            set(20, (zz * (zz * 35.0 - 30.0) + 3.0) * C4[4]);
            set(21, x * z * C4[5] * (zz * 7.0 - 3.0));
            set(22, (xx - yy) * C4[6] * (zz * 7.0 - 1.0));
            set(23, x * z * C4[7] * (xx - yy * 3.0));
            set(24, (xx * (xx - yy * 3.0) - yy * (xx * 3.0 - yy)) * C4[8]);
        }
    }

    /// The colour `max(0, 0.5 + SH)` in one of the directions, clamped to the greatest finite number; `None` if a
    /// coefficient of degrees 0 to `degree` is not finite.
    ///
    /// `coefficients` holds red, green and blue of each coefficient in turn, and at least one more number. Numbers
    /// after the coefficients are ignored. The fourth number of the colour is undefined.
    #[inline(always)]
    pub(crate) fn color<S: Simd>(
        &self,
        simd: S,
        degree: u32,
        direction: usize,
        coefficients: &[f32],
    ) -> Option<[f32; 4]> {
        let color = match degree {
            0 => self.color_of::<S, 1>(simd, direction, coefficients),
            1 => self.color_of::<S, 4>(simd, direction, coefficients),
            2 => self.color_of::<S, 9>(simd, direction, coefficients),
            3 => self.color_of::<S, 16>(simd, direction, coefficients),
            _ => self.color_of::<S, MAX_COEFFICIENTS>(simd, direction, coefficients),
        };
        color.map(|color| color.to_array())
    }

    /// The colour that [`Bases::color`] returns, for `COUNT` coefficients.
    #[inline(always)]
    pub(crate) fn color_of<S: Simd, const COUNT: usize>(
        &self,
        simd: S,
        direction: usize,
        coefficients: &[f32],
    ) -> Option<f32x4<S>> {
        let at = direction % DIRECTIONS;
        let sum = self.sum::<S, COUNT>(simd, at, coefficients);
        // Coefficients that are not finite make the sum so, whatever they are multiplied by. The sum may also overflow.
        // The fourth lane is ignored.
        if (sum * 0.0).simd_eq(0.0).to_bitmask() & 7 != 7 {
            let color = self.wide_color(COUNT, at, coefficients)?;
            return Some(f32x4::from_slice(simd, &color));
        }
        Some(sum.max(0.0))
    }

    /// The colour where the binary32 sum is not finite. The sum is in binary64, which cannot overflow here.
    #[cold]
    fn wide_color(&self, count: usize, direction: usize, coefficients: &[f32]) -> Option<[f32; 4]> {
        if !coefficients[..3 * count].iter().all(|k| k.is_finite()) {
            return None;
        }
        let mut sum = [0.5f64; 3];
        for (lanes, of_function) in self.0[..count].iter().zip(coefficients.chunks(3)) {
            for (sum, k) in sum.iter_mut().zip(of_function) {
                *sum += f64::from(lanes[direction]) * f64::from(*k);
            }
        }
        let [red, green, blue] = sum.map(|value| float::least(float::greatest(value, 0.0), f32::MAX.into()) as f32);
        Some([red, green, blue, 0.0])
    }

    /// The sum of 0.5 and `COUNT` coefficients times their functions.
    #[inline(always)]
    fn sum<S: Simd, const COUNT: usize>(&self, simd: S, at: usize, coefficients: &[f32]) -> f32x4<S> {
        let coefficients = &coefficients[..3 * COUNT + 1];
        // Two sums shorten the chain of dependent additions. The largest terms, the constant one and 0.5, are added
        // last.
        let (mut even, mut odd) = (f32x4::splat(simd, 0.0), f32x4::splat(simd, 0.0));
        let mut k = 1;
        while k < COUNT {
            odd = self.term(simd, at, coefficients, k, odd);
            if k + 1 < COUNT {
                even = self.term(simd, at, coefficients, k + 1, even);
            }
            k += 2;
        }
        self.term(simd, at, coefficients, 0, even + odd) + 0.5
    }

    /// The sum of `sum` and coefficient `k` times its function. A vector holds the coefficient's three components and
    /// the first one of the next coefficient, which is ignored.
    #[inline(always)]
    fn term<S: Simd>(&self, simd: S, at: usize, coefficients: &[f32], k: usize, sum: f32x4<S>) -> f32x4<S> {
        let coefficient = f32x4::from_slice(simd, &coefficients[3 * k..3 * k + 4]);
        coefficient.fused_add(f32x4::splat(simd, self.0[k][at]), sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use devmem::dispatch;
    use fearless_simd::Level;

    fn bases(degree: u32, direction: [f32; 3]) -> Bases {
        let mut bases = Bases::default();
        let directions = direction.map(|part| [part; DIRECTIONS]);
        dispatch!(Level::new(), simd => bases.find(simd, degree, &directions));
        bases
    }

    fn color(degree: u32, direction: [f32; 3], sh: &[f32; COEFFICIENT_FLOATS]) -> Option<[f32; 3]> {
        let bases = bases(degree, direction);
        let color = dispatch!(Level::new(), simd => bases.color(simd, degree, 5, sh));
        color.map(|[red, green, blue, _]| [red, green, blue])
    }

    fn coefficients(values: &[(usize, [f32; 3])]) -> [f32; COEFFICIENT_FLOATS] {
        let mut out = [0.0; COEFFICIENT_FLOATS];
        for &(k, rgb) in values {
            out[3 * k..3 * k + 3].copy_from_slice(&rgb);
        }
        out
    }

    #[gaurast_runner::test]
    fn degree_zero_is_the_same_from_everywhere() {
        let sh = coefficients(&[(0, [1.0, 0.0, -9.0])]);
        let seen = color(0, [0.0, 0.6, 0.8], &sh).unwrap();
        assert_eq!(seen, [0.5 + C0, 0.5, 0.0], "negative sums are clamped");
    }

    #[gaurast_runner::test]
    fn degree_one_has_the_signs_of_3dgs() {
        let sh = coefficients(&[(1, [1.0, 0.0, 0.0]), (2, [0.0, 1.0, 0.0]), (3, [0.0, 0.0, 1.0])]);
        let from = |direction| color(1, direction, &sh).unwrap();
        assert_eq!(from([0.0, 1.0, 0.0])[0], 0.5 - C1);
        assert_eq!(from([0.0, 0.0, 1.0])[1], 0.5 + C1);
        assert_eq!(from([-1.0, 0.0, 0.0])[2], 0.5 + C1);
    }

    #[gaurast_runner::test]
    fn coefficients_that_are_not_finite_are_found_at_the_degree_drawn_only() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let sh = coefficients(&[(3, [0.0, bad, 0.0])]);
            assert_eq!(color(1, [0.0, 1.0, 0.0], &sh), None);
            assert!(color(0, [0.0, 1.0, 0.0], &sh).is_some());
        }
    }

    #[gaurast_runner::test]
    fn sums_beyond_the_greatest_number_are_that() {
        const MAX: f32 = f32::MAX;
        let sh = coefficients(&[(0, [MAX, -MAX, -MAX]), (2, [MAX, MAX, -MAX]), (6, [MAX, MAX, -MAX])]);
        let [red, green, blue] = color(2, [0.0, 0.0, 1.0], &sh).unwrap();
        assert_eq!((red, blue), (MAX, 0.0));
        // Intermediate overflow does not matter.
        let expected = f64::from(C1) + 2.0 * f64::from(C2[2]) - f64::from(C0);
        assert!((f64::from(green) / f64::from(MAX) - expected).abs() < 1e-6, "{green:e}");
    }

    #[gaurast_runner::test]
    fn the_basis_is_orthonormal() {
        // A midpoint rule over the sphere is accurate enough to detect any wrong constant.
        let (rows, columns) = (200u32, 400u32);
        let mut products = vec![[0.0f64; MAX_COEFFICIENTS]; MAX_COEFFICIENTS];
        for row in 0..rows {
            let z = -1.0 + (f64::from(row) + 0.5) * 2.0 / f64::from(rows);
            let radius = (1.0 - z * z).sqrt();
            for column in 0..columns {
                let angle = (f64::from(column) + 0.5) * std::f64::consts::TAU / f64::from(columns);
                let direction = [radius * angle.cos(), radius * angle.sin(), z].map(|v| v as f32);
                let b = bases(4, direction).0.map(|lanes| lanes[0]);
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
                assert!((product * area - expected).abs() < 1e-3, "{i} {j}: {}", product * area);
            }
        }
    }
}
