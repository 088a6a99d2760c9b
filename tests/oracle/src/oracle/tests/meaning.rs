//! Values of single Gaussians and of a few on top of each other.

use super::*;

#[test]
fn one_gaussian_at_its_centre_and_at_a_distance() {
    let picture = render(&[sphere()], &camera(), &unfiltered());
    // Colour 0.5 without coefficients, alpha o at the mean.
    assert_close(at(&picture, 32, 32), [0.25, 0.25, 0.25, 0.5], 1e-15);
    // 3 px right, 1 px up: q = 10 / 4. On the axis M is diagonal and the third axis drops out.
    let alpha = 0.5 * (-0.5_f64 * 10.0 / 4.0).exp();
    let expected = [0.5 * alpha, 0.5 * alpha, 0.5 * alpha, alpha];
    assert_close(at(&picture, 35, 31), expected, 1e-15);
    // Alpha falls to 1/255 where q = 2 ln 127.5 = 9.7, 6.23 px away: no 3-sigma box (6 px).
    assert!(at(&picture, 38, 32)[3] > 1.0 / 255.0);
    assert!(at(&picture, 38, 33)[3] > 1.0 / 255.0);
    assert_eq!(at(&picture, 39, 32), [0.0; 4]);
}

#[test]
fn the_low_pass_filter_adds_to_the_variance() {
    let state = OracleState { low_pass: 0.25, ..OracleState::default() };
    let picture = render(&[sphere()], &camera(), &state);
    let alpha = 0.5 * (-0.5_f64 * 4.0 / 4.25).exp();
    assert_close(at(&picture, 34, 32), [0.5 * alpha, 0.5 * alpha, 0.5 * alpha, alpha], 1e-15);
}

#[test]
fn compensation_keeps_the_integral() {
    let state = OracleState { low_pass: 0.25, opacity_compensated: true, ..OracleState::default() };
    let picture = render(&[sphere()], &camera(), &state);
    // |m0 x m1| = 4 and det S = 4.25^2.
    assert!((at(&picture, 32, 32)[3] - 0.5 * 4.0 / 4.25).abs() < 1e-15);
    // A Gaussian that compensation puts below the floor isn't counted as skipped: the comparison
    // comes before.
    let tiny = Gaussian { scale: [1e-6; 3], ..sphere() };
    let picture = render(&[tiny], &camera(), &state);
    assert_eq!(picture.skips.total(), 0);
    assert!(picture.nominal.iter().all(|rgba| *rgba == [0.0; 4]));
}

#[test]
fn covariance_follows_the_rotation() {
    // Long axis x turned by 45 degrees about +z: towards +y, which is down.
    let half = std::f32::consts::FRAC_PI_8;
    let needle = Gaussian {
        scale: [1.0 / 32.0, 1.0 / 128.0, 1.0 / 128.0],
        rotation: [half.cos(), 0.0, 0.0, half.sin()],
        ..sphere()
    };
    let picture = render(std::slice::from_ref(&needle), &camera(), &unfiltered());
    // Along the axis sigma is 4 px, across it 1 px.
    let along = 0.5 * (-0.5_f64 * 8.0 / 16.0).exp();
    let across = 0.5 * (-0.5_f64 * 8.0).exp();
    assert!((at(&picture, 34, 34)[3] - along).abs() < 1e-7);
    assert!((at(&picture, 34, 30)[3] - across).abs() < 1e-7);
    // The quaternion's length doesn't matter, however small or large.
    for factor in [1e-37, 3.0, 1e37] {
        let scaled = Gaussian { rotation: needle.rotation.map(|c| c * factor), ..needle.clone() };
        let other = render(&[scaled], &camera(), &unfiltered());
        assert_close(at(&other, 34, 34), at(&picture, 34, 34), 1e-7);
    }
}

#[test]
fn camera_rotation_and_eye_move_the_gaussian() {
    // The camera stands at (3, 4, 5) and looks along world +x; camera right is world -z (seen
    // from above, +y down), so row-major rows are right, down, forward.
    let camera =
        OracleCamera { rotation: [0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0], eye: [3.0, 4.0, 5.0], ..camera() };
    let gaussian = Gaussian { position: [5.0, 4.125, 4.75], ..sphere() };
    let picture = render(&[gaussian], &camera, &unfiltered());
    // t = (0.25, 0.125, 2): 16 px right, 8 px down.
    assert_close(at(&picture, 48, 40), [0.25, 0.25, 0.25, 0.5], 1e-15);
    // fx / z s = 1; u = 1/8 is in the third column: S_xx = 1 + 1/64.
    let alpha = 0.5 * (-0.5_f64 * quadratic_form([1.0, 0.0], [1.015625, 0.0078125, 1.00390625])).exp();
    assert!((at(&picture, 49, 40)[3] - alpha).abs() < 1e-15);
}

/// `d^T S^-1 d` by Cramer's rule.
fn quadratic_form([x, y]: [f64; 2], [xx, xy, yy]: [f64; 3]) -> f64 {
    (x * x * yy - 2.0 * x * y * xy + y * y * xx) / (xx * yy - xy * xy)
}

#[test]
fn a_principal_point_off_centre_moves_the_clamp() {
    // cx = 16.5: u is kept between -(16.5 + 9.6) / 128 and (47.5 + 9.6) / 128. The mean isn't.
    let camera = OracleCamera { principal: [16.5, 32.5], ..camera() };
    for (tan, u) in [(-0.25, -26.1 / 128.0), (0.5, 57.1 / 128.0), (0.25, 0.25)] {
        let gaussian = Gaussian { position: [tan, 0.0, 1.0], scale: [0.25; 3], opacity: 0.75, ..sphere() };
        let picture = render(&[gaussian], &camera, &unfiltered());
        let mean = 128.0 * f64::from(tan) + 16.5;
        // M = 32 [1, 0, -u; 0, 1, 0].
        let q = (40.5 - mean).powi(2) / (1024.0 * (1.0 + u * u));
        let alpha = 0.75 * (-0.5 * q).exp();
        assert!((at(&picture, 40, 32)[3] - alpha).abs() < 1e-14, "{tan}");
    }
}

#[test]
fn two_gaussians_blend_front_to_back_whatever_their_order() {
    let near = Gaussian { sh: vec![[dc(1.0), dc(0.0), dc(0.0)]], ..sphere() };
    let far = Gaussian { position: [0.0, 0.0, 2.0], opacity: 0.25, sh: vec![[dc(0.0), dc(0.0), dc(1.0)]], ..sphere() };
    for order in [[near.clone(), far.clone()], [far, near]] {
        let picture = render(&order, &camera(), &unfiltered());
        assert_close(at(&picture, 32, 32), [0.5, 0.0, 0.125, 0.625], 1e-7);
    }
}

#[test]
fn ties_of_depth_keep_primitive_order() {
    let red = Gaussian { sh: vec![[dc(1.0), dc(0.0), dc(0.0)]], ..sphere() };
    let blue = Gaussian { sh: vec![[dc(0.0), dc(0.0), dc(1.0)]], ..sphere() };
    let picture = render(&[red.clone(), blue.clone()], &camera(), &unfiltered());
    assert_close(at(&picture, 32, 32), [0.5, 0.0, 0.25, 0.75], 1e-7);
    let picture = render(&[blue.clone(), red.clone()], &camera(), &unfiltered());
    assert_close(at(&picture, 32, 32), [0.25, 0.0, 0.5, 0.75], 1e-7);
    // Depths that differ in binary64 alone are a tie as well: the key is binary32.
    let camera = OracleCamera { eye: [0.0, 0.0, 1.0 - 1e-9], ..camera() };
    let behind = Gaussian { position: [0.0, 0.0, 2.0], ..red };
    let front = Gaussian { position: [0.0, 0.0, 2.0 - 1e-10], ..blue };
    let picture = render(&[behind, front], &camera, &unfiltered());
    assert!(at(&picture, 32, 32)[0] > 0.4);
}

#[test]
fn a_pixel_finishes_without_the_gaussian_that_finishes_it() {
    // Alpha 15/16 leaves 1/16 each time, and the layers behind the third would leave too little.
    let layers: Vec<Gaussian> = (0..6)
        .map(|i| Gaussian {
            position: [0.0, 0.0, 1.0 + i as f32],
            opacity: 0.9375,
            sh: vec![[dc(1.0), dc(1.0), dc(1.0)]],
            ..sphere()
        })
        .collect();
    let picture = render(&layers, &camera(), &unfiltered());
    // 1/16^3 = 2.4e-4 stays; 1/16^4 = 1.5e-5 would be below 1e-4.
    let t = 1.0 / 4096.0;
    assert_close(at(&picture, 32, 32), [1.0 - t, 1.0 - t, 1.0 - t, 1.0 - t], 1e-7);
    assert_eq!(at(&picture, 32, 32)[3], 1.0 - t);
    // The fainter Gaussian behind it would fit, but the pixel is finished.
    let mut with_faint = layers;
    with_faint.push(Gaussian { position: [0.0, 0.0, 9.0], opacity: 0.125, ..sphere() });
    let picture = render(&with_faint, &camera(), &unfiltered());
    assert_eq!(at(&picture, 32, 32)[3], 1.0 - t);
}

#[test]
fn alpha_has_a_ceiling_and_opacity_may_exceed_one() {
    let strong = Gaussian { opacity: 8.0, ..sphere() };
    let picture = render(std::slice::from_ref(&strong), &camera(), &unfiltered());
    let ceiling = f64::from(0.99_f32);
    assert_eq!(at(&picture, 32, 32)[3], ceiling);
    // Still clamped at 4 px (8 e^-2 = 1.08), no longer at 5 px.
    assert_eq!(at(&picture, 36, 32)[3], ceiling);
    let alpha = 8.0 * (-0.5_f64 * 25.0 / 4.0).exp();
    assert!((at(&picture, 37, 32)[3] - alpha).abs() < 1e-15);
    let state = OracleState { alpha_ceiling: 0.5, ..unfiltered() };
    assert_eq!(at(&render(&[strong], &camera(), &state), 32, 32)[3], 0.5);
}

#[test]
fn degree_one_points_where_3dgs_has_it() {
    const C: f64 = 0.4886025119029199;
    let picture = |position, k: usize| {
        let mut sh = vec![[0.0; 3]; 4];
        sh[k] = [0.5, 0.25, -0.25];
        let gaussian = Gaussian { position, opacity: 0.5, sh, ..sphere() };
        at(&render(&[gaussian], &camera(), &unfiltered()), 32, 32)
    };
    // Straight ahead only the function of z counts, and with a plus sign.
    let expected = [0.25 + 0.25 * C, 0.25 + 0.125 * C, 0.25 - 0.125 * C, 0.5];
    assert_close(picture([0.0, 0.0, 1.0], 2), expected, 1e-15);
    assert_close(picture([0.0, 0.0, 1.0], 1), [0.25, 0.25, 0.25, 0.5], 1e-15);
    // Off to the right and down the functions of x and y count, with minus signs.
    let right = picture([0.0078125, 0.0, 1.0], 3);
    assert!(right[0] < right[3] * 0.5 && right[2] > right[3] * 0.5);
    let down = picture([0.0, 0.0078125, 1.0], 1);
    assert!(down[0] < down[3] * 0.5 && down[2] > down[3] * 0.5);
}

#[test]
fn the_lower_of_the_two_degrees_is_drawn() {
    let mut sh = vec![[0.0; 3]; 4];
    sh[2] = [0.5; 3];
    let scene = SceneBuffers::new(1, [Gaussian { sh, ..sphere() }]);
    let mut input = scene.as_oracle();
    input.requested_degree = 3;
    assert!(at(&render_literal(&input, &camera(), &unfiltered()), 32, 32)[0] > 0.3);
    input.requested_degree = 0;
    assert_eq!(at(&render_literal(&input, &camera(), &unfiltered()), 32, 32)[0], 0.25);
}

#[test]
fn the_eye_may_be_far_from_the_origin() {
    // 2^24 units out, where binary32 positions are whole numbers.
    let far = 16_777_216.0;
    let camera = OracleCamera { eye: [0.0, 0.0, far - 1.0], ..camera() };
    let gaussian = Gaussian { position: [0.0, 0.0, far as f32], ..sphere() };
    let picture = render(&[gaussian], &camera, &unfiltered());
    assert_close(at(&picture, 32, 32), [0.25, 0.25, 0.25, 0.5], 1e-15);
}
