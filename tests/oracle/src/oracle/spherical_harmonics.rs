//! Real spherical harmonics with the signs and the order of 3DGS.
//!
//! The basis is orthonormal over the sphere. Within degree l the functions run from order m = -l
//! to l, and the Condon-Shortley phase is kept, so the functions of odd m have a minus sign:
//! degree 1 is `-y, z, -x`.

/// The number of coefficients that a colour channel has up to `degree`.
pub fn coefficient_count(degree: u32) -> usize {
    (degree as usize + 1).pow(2)
}

/// The first `(degree + 1)^2` basis functions at the unit vector `direction`; the rest are 0.
///
/// Degrees above 4 are treated as 4.
pub fn basis(degree: u32, direction: [f64; 3]) -> [f64; 25] {
    let [x, y, z] = direction;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let mut b = [0.0; 25];
    b[0] = 0.28209479177387814;
    if degree >= 1 {
        const C: f64 = 0.4886025119029199;
        b[1] = -C * y;
        b[2] = C * z;
        b[3] = -C * x;
    }
    if degree >= 2 {
        b[4] = 1.0925484305920792 * x * y;
        b[5] = -1.0925484305920792 * y * z;
        b[6] = 0.31539156525252005 * (2.0 * zz - xx - yy);
        b[7] = -1.0925484305920792 * x * z;
        b[8] = 0.5462742152960396 * (xx - yy);
    }
    if degree >= 3 {
        b[9] = -0.5900435899266435 * y * (3.0 * xx - yy);
        b[10] = 2.890611442640554 * x * y * z;
        b[11] = -0.4570457994644658 * y * (4.0 * zz - xx - yy);
        b[12] = 0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
        b[13] = -0.4570457994644658 * x * (4.0 * zz - xx - yy);
        b[14] = 1.445305721320277 * z * (xx - yy);
        b[15] = -0.5900435899266435 * x * (xx - 3.0 * yy);
    }
    if degree >= 4 {
        b[16] = 2.5033429417967046 * x * y * (xx - yy);
        b[17] = -1.7701307697799304 * y * z * (3.0 * xx - yy);
        b[18] = 0.9461746957575601 * x * y * (7.0 * zz - 1.0);
        b[19] = -0.6690465435572892 * y * z * (7.0 * zz - 3.0);
        b[20] = 0.10578554691520431 * (zz * (35.0 * zz - 30.0) + 3.0);
        b[21] = -0.6690465435572892 * x * z * (7.0 * zz - 3.0);
        b[22] = 0.47308734787878004 * (xx - yy) * (7.0 * zz - 1.0);
        b[23] = -1.7701307697799304 * x * z * (xx - 3.0 * yy);
        b[24] = 0.6258357354491761 * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy));
    }
    b
}

/// Step 5: `max(0, 0.5 + SH(direction) . k)` for each of red, green and blue, at most the greatest binary32 number.
///
/// `coefficients` has `(degree + 1)^2` entries.
pub fn color(degree: u32, direction: [f64; 3], coefficients: &[[f32; 3]]) -> [f64; 3] {
    let basis = basis(degree, direction);
    std::array::from_fn(|channel| {
        let sum: f64 = basis.iter().zip(coefficients).map(|(b, k)| b * f64::from(k[channel])).sum();
        (0.5 + sum).max(0.0).min(f32::MAX.into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// An exact quadrature for polynomials of degree 8: Gauss-Legendre (5 nodes, exact to degree
    /// 9) in z, 16 equal steps in azimuth.
    fn integrate(f: impl Fn([f64; 3]) -> f64) -> f64 {
        let a = (10.0_f64 / 7.0).sqrt();
        let (inner, outer) = ((5.0 - 2.0 * a).sqrt() / 3.0, (5.0 + 2.0 * a).sqrt() / 3.0);
        let r = 13.0 * 70.0_f64.sqrt();
        let nodes = [
            (0.0, 128.0 / 225.0),
            (inner, (322.0 + r) / 900.0),
            (-inner, (322.0 + r) / 900.0),
            (outer, (322.0 - r) / 900.0),
            (-outer, (322.0 - r) / 900.0),
        ];
        let mut sum = 0.0;
        for (z, weight) in nodes {
            for step in 0..16 {
                let (sin, cos) = (PI * f64::from(step) / 8.0).sin_cos();
                let radius = (1.0 - z * z).sqrt();
                sum += weight * PI / 8.0 * f([radius * cos, radius * sin, z]);
            }
        }
        sum
    }

    #[test]
    fn basis_is_orthonormal() {
        for i in 0..25 {
            for j in 0..25 {
                let product = integrate(|d| basis(4, d)[i] * basis(4, d)[j]);
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((product - expected).abs() < 1e-14, "{i} {j} {product}");
            }
        }
    }

    #[test]
    fn signs_and_order_are_those_of_3dgs() {
        // Each function is tested in a direction that tells it from the others: its sign in the octant where x > y > z
        // > 0, which the Condon-Shortley phase decides.
        let d = [0.8, 0.52, (1.0_f64 - 0.64 - 0.2704).sqrt()];
        let signs: Vec<f64> = basis(3, d)[..16].iter().map(|b| b.signum()).collect();
        assert_eq!(signs[..4], [1.0, -1.0, 1.0, -1.0]);
        assert_eq!(signs[4..9], [1.0, -1.0, -1.0, -1.0, 1.0]);
        assert_eq!(signs[9..], [-1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0]);
        // Degree 1 along the axes.
        assert!(basis(1, [1.0, 0.0, 0.0])[3] < 0.0);
        assert!(basis(1, [0.0, 1.0, 0.0])[1] < 0.0);
        assert!(basis(1, [0.0, 0.0, 1.0])[2] > 0.0);
    }

    #[test]
    fn color_is_clamped_below_only() {
        let k = [[-10.0, 0.0, 10.0]];
        let [r, g, b] = color(0, [0.0, 0.0, 1.0], &k);
        assert_eq!([r, g], [0.0, 0.5]);
        assert_eq!(b, 0.5 + 2.8209479177387814);
    }
}
