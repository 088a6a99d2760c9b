//! Known errors of other renderers of Gaussians. Each test shows first that the usual formula fails on its scene, and
//! then that the driver is correct, at every SIMD level.

use gaurast::vk::{GaussianAntialiasingGAURAST, GaussianCameraGAURAST, PipelineGaussianStateCreateInfoGAURAST};
use gaurast_runner::{Case, simd_levels};
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::{Gaussian, SceneBuffers};

type Camera = GaussianCameraGAURAST<'static>;
type State = PipelineGaussianStateCreateInfoGAURAST<'static>;
type Image = Vec<[f32; 4]>;

const SIZE: [u32; 2] = [64, 48];
const FOCAL: f32 = 50.0;

fn camera() -> Camera {
    Camera::default().focal_length([FOCAL; 2]).principal_point([32.0, 24.0])
}

/// An ordinary Gaussian in the middle.
fn ordinary() -> Gaussian {
    Gaussian {
        position: [0.1, -0.2, 4.0],
        scale: [0.5, 0.3, 0.2],
        rotation: [0.9, 0.1, -0.3, 0.2],
        opacity: 0.8,
        sh: vec![[0.5, -0.3, 1.0]],
    }
}

/// Draws at the case's SIMD level, and checks the picture with the oracle.
fn checked(case: &Case, gaussians: &[Gaussian], camera: &Camera, state: &State) -> Image {
    let scene = SceneBuffers::new(0, gaussians.iter().cloned());
    let view = OracleCamera::new(camera, SIZE).expect("a camera");
    let reference = render_bounded(&scene.as_oracle(), &view, &OracleState::from(state));
    let gpu = Gpu::embedded(&Settings { simd: Some(case.variant()), threads: Some(2), ..Settings::default() })
        .expect("a device");
    let options = GaussianOptions { state: *state, ..GaussianOptions::new(0) };
    let pipeline = GaussianPipeline::new(&gpu, &options);
    let on_device = GaussianScene::new(&gpu, &scene);
    let target = Target::floats(&gpu, SIZE);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            on_device.bind(commands, &pipeline, camera);
            commands.draw(0..on_device.count);
        });
    });
    let image: Image = target.read();
    let name = case.name().replace("::", " ");
    assert_contract(&name, &image, &reference, Limits::ENVELOPE_ONLY);
    image
}

/// Checks that a Gaussian is invisible and does not affect another one.
fn assert_invisible(case: &Case, what: Gaussian) {
    let state = State::default();
    let alone = checked(case, &[ordinary()], &camera(), &state);
    assert!(alone.iter().any(|rgba| rgba[3] > 0.5));
    let both = checked(case, &[what, ordinary()], &camera(), &state);
    assert!(alone == both);
}

/// The logarithm of a scale in a file may be any number. Its exponential may be infinite, and the radius infinity minus
/// infinity.
#[gaurast_runner::test(each = simd_levels())]
fn an_infinite_scale_is_no_radius_of_nan(case: &Case) {
    let scale = 100.0f32.exp();
    let (xx, xy, yy) = (scale * scale, scale * scale, scale * scale);
    assert!((xx * yy - xy * xy).is_nan(), "the usual determinant");
    assert_invisible(case, Gaussian { scale: [scale, 0.3, 0.2], ..ordinary() });
}

/// The distance at which alpha reaches its floor is the deviation times the root of `2 ln(opacity / floor)`, which
/// fails if the opacity is below the floor.
#[gaurast_runner::test(each = simd_levels())]
fn an_opacity_below_the_floor_enters_no_logarithm(case: &Case) {
    for opacity in [1.0 / 256.0, 1e-30, 0.0] {
        let radius = (2.0 * (255.0f32 * opacity).ln()).sqrt();
        assert!(radius.is_nan(), "the usual radius");
        assert_invisible(case, Gaussian { opacity, ..ordinary() });
    }
}

/// For a sphere, the usual formula of an eigenvector, (xy, lambda - xx), gives zero.
#[gaurast_runner::test(each = simd_levels())]
fn a_sphere_has_axes_too(case: &Case) {
    let sphere = Gaussian { position: [0.0, 0.0, 4.0], scale: [0.5; 3], rotation: [1.0, 0.0, 0.0, 0.0], ..ordinary() };
    let deviation = FOCAL * 0.5 / 4.0;
    let ([xx, xy, yy], lambda) = ([deviation.powi(2), 0.0f32, deviation.powi(2)], deviation.powi(2));
    assert_eq!(xx, yy);
    assert!((xy / xy.hypot(lambda - xx)).is_nan(), "the usual axis");
    let image = checked(case, &[sphere], &camera(), &State::default());
    // The picture of a sphere is round.
    let at = |x: usize, y: usize| image[y * SIZE[0] as usize + x][3];
    for by in 1..20 {
        assert!((at(32 + by, 24) - at(32, 24 + by)).abs() < 1e-6);
    }
}

/// Perspective divides by the depth, which is zero here.
#[gaurast_runner::test(each = simd_levels())]
fn a_gaussian_at_the_camera_divides_by_nothing(case: &Case) {
    for z in [0.0, -0.0, 1e-45, 0.2] {
        assert_invisible(case, Gaussian { position: [0.0, 0.0, z], ..ordinary() });
    }
}

/// The compensation of opacity is the ratio of two determinants, the first of which is the small difference of two
/// large products.
#[gaurast_runner::test(each = simd_levels())]
fn the_ratio_of_determinants_keeps_its_digits(case: &Case) {
    // A deviation of 2500 pixels along a diagonal, and of 1/4 across it and in depth.
    let (long, thin) = (200.0f32, 0.02f32);
    let half_turn = std::f32::consts::FRAC_PI_8;
    let needle = Gaussian {
        position: [0.0, 0.0, 4.0],
        scale: [long, thin, thin],
        rotation: [half_turn.cos(), 0.0, 0.0, half_turn.sin()],
        ..ordinary()
    };
    let [a, b] = [long, thin].map(|scale| (FOCAL * scale / 4.0).powi(2));
    // The values are rounded to binary32, as in a shader.
    let (xx, xy) = (0.5 * (a + b), 0.5 * (a - b));
    let (usual, exact) = (xx * xx - xy * xy, a * b);
    assert!((usual / exact - 1.0).abs() > 0.1, "{usual} {exact}");
    let compensated = State::default().antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED);
    let image = checked(case, &[needle], &camera(), &compensated);
    let greatest = image.iter().fold(0.0f32, |most, rgba| most.max(rgba[3]));
    assert!((0.2..0.8).contains(&greatest), "{greatest}");
}

/// Far outside the picture and near the eye's plane, the derivative of perspective has no bound. It must be clamped
/// about the principal point, or else streaks cross the picture.
#[gaurast_runner::test(each = simd_levels())]
fn what_is_far_beside_the_picture_casts_no_fan(case: &Case) {
    let beside = |side: f32| Gaussian {
        position: [side * 6.0, 0.1, 0.3],
        scale: [0.05; 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
        opacity: 0.99,
        ..ordinary()
    };
    let (deviation, distance) = (FOCAL * 0.05 * 6.0 / (0.3 * 0.3), FOCAL * 6.0 / 0.3 - SIZE[0] as f32);
    assert!(3.0 * deviation > 0.5 * distance, "the usual derivative reaches");
    let gaussians = [beside(1.0), beside(-1.0), ordinary()];
    for principal in [[32.0, 24.0], [2.0, 40.0]] {
        let camera = camera().principal_point(principal);
        let state = State::default();
        let alone = checked(case, &[ordinary()], &camera, &state);
        let all = checked(case, &gaussians, &camera, &state);
        assert!(alone == all, "nothing of them is seen");
    }
}

/// A sort key with fewer bits than the depth would leave neighbours in the order of the draw.
#[gaurast_runner::test(each = simd_levels())]
fn depths_a_bit_apart_are_in_order(case: &Case) {
    let depth = |steps: u32| f32::from_bits(4.0f32.to_bits() + steps);
    let key = |z: f32| (z * 1000.0) as u32;
    assert_eq!(key(depth(0)), key(depth(1)), "the usual key");
    let of_color =
        |steps, sh| Gaussian { position: [0.0, 0.0, depth(steps)], opacity: 0.99, sh: vec![sh], ..ordinary() };
    let (red, blue) = ([1.5, -1.7, -1.7], [-1.7, -1.7, 1.5]);
    let gaussians = [of_color(1, red), of_color(0, blue)];
    let image = checked(case, &gaussians, &camera(), &State::default());
    let [r, _, b, _] = image[24 * SIZE[0] as usize + 32];
    assert!(b > 10.0 * r && r > 0.0, "blue is in front: {r} {b}");
}

/// Exponentials that are made by shifting bits wrap around if the exponent overflows.
#[gaurast_runner::test(each = simd_levels())]
fn exponentials_have_a_range(case: &Case) {
    /// 2^x by Schraudolph's method.
    fn usual(x: f32) -> f32 {
        f32::from_bits(((x + 127.0) * (1 << 23) as f32) as i64 as u32)
    }
    assert!((usual(-3.0) - 0.125).abs() < 1e-6);
    assert!(usual(-700.0).abs() > 1.0, "the usual exponential");
    let point = Gaussian { scale: [1e-3; 3], ..ordinary() };
    let state = State::default().low_pass_variance(0.0).alpha_floor(0.0).transmittance_floor(0.0);
    let image = checked(case, &[point], &camera(), &state);
    let far = &image[..10 * SIZE[0] as usize];
    assert!(far.iter().all(|rgba| *rgba == [0.0; 4]));
}
