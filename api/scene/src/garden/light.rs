//! The garden's light: a low sun, the sky, and the shading of surfaces.

use std::f64::consts::PI;

use glam::DVec3;

/// The direction towards the sun.
pub(super) fn sun() -> DVec3 {
    DVec3::new(-0.66, 0.36, -0.60).normalize()
}

const SUNLIGHT: DVec3 = DVec3::new(1.25, 0.86, 0.52);
const SKYLIGHT: DVec3 = DVec3::new(0.62, 0.66, 0.80);
const GROUNDLIGHT: DVec3 = DVec3::new(0.46, 0.38, 0.26);

/// The sky's colour in `direction`.
pub(super) fn sky(direction: DVec3) -> DVec3 {
    let height = direction.y.max(0.0);
    let zenith = DVec3::new(0.16, 0.27, 0.50);
    let middle = DVec3::new(0.48, 0.48, 0.62);
    let horizon = DVec3::new(0.98, 0.66, 0.44);
    let sky = horizon.lerp(middle, smooth(height / 0.22)).lerp(zenith, smooth((height - 0.12) / 0.75));
    let towards = direction.dot(sun()).max(0.0);
    let glow = DVec3::new(0.55, 0.32, 0.10) * libm::pow(towards, 6.0) * 0.6;
    sky + glow + DVec3::new(1.0, 0.85, 0.55) * libm::pow(towards, 90.0) * 0.9
}

/// The colour of a matte surface, lit by sun, sky and ground. `open` is the share of light that reaches it, 0 to 1.
pub(super) fn matte(albedo: DVec3, normal: DVec3, open: f64) -> DVec3 {
    let upwards = 0.5 + 0.5 * normal.y;
    let ambient = GROUNDLIGHT.lerp(SKYLIGHT, upwards);
    let direct = SUNLIGHT * normal.dot(sun()).max(0.0);
    albedo * (ambient * (0.35 + 0.65 * open) + direct * open)
}

/// The colour of a leaf, which also lets light from behind through.
pub(super) fn leaf(albedo: DVec3, normal: DVec3, open: f64) -> DVec3 {
    let through = albedo * SUNLIGHT * 0.8 * (-normal.dot(sun())).max(0.0) * open;
    matte(albedo, normal, open) + through
}

/// A smooth step: 0 below 0, 1 above 1, smooth between.
pub(super) fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// The strength of bands 0 to 3 of a lobe, a brightness that depends only on the angle to an axis and is greatest along
/// it: the reflection of a bright spot by a polished surface.
const LOBE: [f64; 4] = [0.22, 0.44, 0.36, 0.22];

/// The 16 spherical harmonics coefficients of a lobe of `colour` around `axis`, a direction from the eye.
pub(super) fn lobe(axis: DVec3, colour: DVec3) -> [DVec3; 16] {
    // By the addition theorem, band l of a lobe is the basis at its axis times this factor.
    let basis = basis(axis);
    std::array::from_fn(|k| {
        let l = k.isqrt();
        colour * (LOBE[l] * 4.0 * PI / (2 * l + 1) as f64 * basis[k])
    })
}

/// `direction` reflected by a surface with `normal`.
pub(super) fn mirror(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

/// The real spherical harmonics of degree 0 to 3, with 3DGS's order and signs.
pub(super) fn basis(direction: DVec3) -> [f64; 16] {
    let DVec3 { x, y, z } = direction;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        0.282_094_791_773_878_14,
        -0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        -0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079_2 * x * y,
        -1.092_548_430_592_079_2 * y * z,
        0.315_391_565_252_520_05 * (2.0 * zz - xx - yy),
        -1.092_548_430_592_079_2 * x * z,
        0.546_274_215_296_039_6 * (xx - yy),
        -0.590_043_589_926_643_5 * y * (3.0 * xx - yy),
        2.890_611_442_640_554 * x * y * z,
        -0.457_045_799_464_465_8 * y * (4.0 * zz - xx - yy),
        0.373_176_332_590_115_4 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -0.457_045_799_464_465_8 * x * (4.0 * zz - xx - yy),
        1.445_305_721_320_277 * z * (xx - yy),
        -0.590_043_589_926_643_5 * x * (xx - 3.0 * yy),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests that the basis is orthonormal: a sum over many even directions approximates the integral.
    #[test]
    fn the_basis_is_orthonormal() {
        let count = 20_000;
        let mut products = [[0.0; 16]; 16];
        for i in 0..count {
            let values = basis(super::super::directions::spread(i, count));
            for (row, a) in products.iter_mut().zip(values) {
                for (sum, b) in row.iter_mut().zip(values) {
                    *sum += a * b * 4.0 * PI / count as f64;
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!((value - expected).abs() < 1e-3, "{i} {j}: {value}");
            }
        }
    }

    #[test]
    fn a_lobe_is_brightest_towards_its_axis() {
        let axis = DVec3::new(0.3, -0.8, 0.5).normalize();
        let coefficients = lobe(axis, DVec3::ONE);
        let towards = |direction: DVec3| {
            let basis = basis(direction);
            coefficients.iter().zip(basis).map(|(c, b)| c.x * b).sum::<f64>()
        };
        assert!((towards(axis) - LOBE.iter().sum::<f64>()).abs() < 1e-9);
        let brightest = (0..500)
            .map(|i| super::super::directions::spread(i, 500))
            .max_by(|a, b| towards(*a).total_cmp(&towards(*b)));
        assert!(brightest.expect("there are directions").dot(axis) > 0.98);
    }
}
