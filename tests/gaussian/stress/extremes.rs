//! Extreme sizes, counts and values, and applications that change the rounding mode of their threads.

use ash::vk;
use gaurast::vk::{GaussianCameraGAURAST, GaussianOrderGAURAST, GaussianPrecisionGAURAST};
use gaurast_testkit::{
    GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target, TargetOptions, opaque, over,
};
use gaurast_tests::compare::{Accuracy, Limits};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::{Gaussian, SceneBuffers};

type Camera = GaussianCameraGAURAST<'static>;

fn gpu() -> Gpu {
    Gpu::embedded(&Settings { threads: Some(2), ..Settings::default() }).expect("a device")
}

fn camera([width, height]: [u32; 2]) -> Camera {
    Camera::default().focal_length([width as f32; 2]).principal_point([0.5 * width as f32, 0.5 * height as f32])
}

fn gaussian(z: f32, scale: f32, opacity: f32, color: [f32; 3]) -> Gaussian {
    Gaussian { position: [0.0, 0.0, z], scale: [scale; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity, sh: vec![color] }
}

/// Draws instances of a scene to a target.
fn draw(
    gpu: &Gpu,
    scene: &SceneBuffers,
    options: &GaussianOptions,
    target: &Target,
    clear: Option<[f32; 4]>,
    instances: u32,
) {
    let size = target.options.size;
    let pipeline = GaussianPipeline::new(gpu, options);
    let on_device = GaussianScene::new(gpu, scene);
    let pass = clear.map_or_else(Pass::load, Pass::clear);
    gpu.run(|commands| {
        commands.pass(target, &pass, || {
            on_device.bind(commands, &pipeline, &camera(size));
            commands.draw_instances(0..on_device.count, 0..instances);
        });
    });
}

/// Draws more primitives than binary32 has consecutive integers. The visible ones are the last of each instance and
/// have the same depth, so that their order is that of their indices.
#[gaurast_runner::test]
fn more_than_2_to_the_24_primitives_keep_their_order() {
    const UNSEEN: usize = 32_766;
    const INSTANCES: u32 = 513;
    let size = [20, 18];
    let unseen = (0..UNSEEN).map(|_| gaussian(-1.0, 0.1, 1.0, [0.0; 3]));
    let colors = [[1.5, -1.5, 0.2], [-1.0, 1.0, 1.7]];
    let seen = colors.map(|color| gaussian(2.0, 50.0, 1.0 / 128.0, color));
    let scene = SceneBuffers::new(0, unseen.chain(seen.clone()));
    assert!(scene.positions.len() as u64 * u64::from(INSTANCES) > 1 << 24);
    let gpu = gpu();
    let options = GaussianOptions::new(0);
    let target = Target::floats(&gpu, size);
    draw(&gpu, &scene, &options, &target, Some([0.0; 4]), INSTANCES);
    let image: Vec<[f32; 4]> = target.read();
    let alone = SceneBuffers::new(0, seen.iter().cycle().take(2 * INSTANCES as usize).cloned());
    let view = OracleCamera::new(&camera(size), size).expect("a camera");
    let reference = render_bounded(&alone.as_oracle(), &view, &OracleState::default());
    let accuracy = Accuracy::of(&image, &reference, Limits::ENVELOPE_ONLY);
    assert!(accuracy.holds(), "{accuracy}");
}

/// Complete tile lists would have 3.3e8 entries, more than their limit, so tiles search the sorted sequence instead.
/// `cargo run -p gaurast-tests --example screen_fillers` draws a million at 8192x8192.
#[gaurast_runner::test]
fn thousands_that_fill_a_large_screen_take_bounded_memory() {
    const COUNT: usize = 20_000;
    let size = [2048, 2048];
    let one = |index: usize| {
        let color = [0, 1, 2].map(|c| ((index * (3 + c)) % 7) as f32 / 2.0 - 1.5);
        // Faint enough for tiles to read several parts of the sequence.
        gaussian(2.0 + index as f32 * 1e-3, 1e4, 1.0 / 200.0, color)
    };
    let scene = SceneBuffers::new(0, (0..COUNT).map(one));
    let gpu = gpu();
    let options = GaussianOptions::new(0);
    let target = Target::floats(&gpu, size);
    draw(&gpu, &scene, &options, &target, Some([0.0; 4]), 1);
    let image: Vec<[f32; 4]> = target.read();
    // All pixels have the same colour, so the oracle draws only one.
    let view = OracleCamera::new(&camera(size).principal_point([0.5; 2]), [1, 1]).expect("a camera");
    let reference = render_bounded(&scene.as_oracle(), &view, &OracleState::default());
    let middle = image[1024 * 2048 + 1024];
    let accuracy = Accuracy::of(&[middle], &reference, Limits::ENVELOPE_ONLY);
    assert!(accuracy.holds(), "{accuracy}");
    let far = |pixel: &[f32; 4]| (0..4).any(|c| (pixel[c] - middle[c]).abs() > 1e-5);
    assert_eq!(image.iter().position(far), None);
}

/// Half-float targets get colours above their greatest number, alone and blended, and never hold NaN.
#[gaurast_runner::test]
fn half_float_targets_overflow_to_infinity_at_most() {
    let size = [48, 40];
    let color = [4e5, 1e38, -2e5];
    let scene = SceneBuffers::new(0, (0..3).map(|z| gaussian(2.0 + z as f32, 0.3, 0.99, color)));
    let gpu = gpu();
    for blend in [opaque(), over()] {
        let half = TargetOptions { size, ..TargetOptions::of(vk::Format::R16G16B16A16_SFLOAT) };
        let target = Target::new(&gpu, &half);
        let options = GaussianOptions { blend: vec![blend], ..GaussianOptions::over(0, &target) };
        draw(&gpu, &scene, &options, &target, Some([0.0; 4]), 1);
        draw(&gpu, &scene, &options, &target, None, 1);
        let texels: Vec<[u16; 4]> = target.read();
        let magnitudes = texels.as_flattened().iter().map(|bits| bits & 0x7fff);
        assert!(magnitudes.clone().all(|bits| bits <= 0x7c00), "no NaN");
        assert!(magnitudes.clone().any(|bits| bits >= 0x7bff), "too bright");
    }
}

/// Colours whose sums overflow are drawn behind opaque Gaussians and with alphas that underflow, where infinity times
/// zero would give NaN.
#[gaurast_runner::test]
fn colors_beyond_every_number_leave_numbers() {
    const MOST: f32 = f32::MAX;
    let size = [48, 40];
    let colors =
        [[[MOST; 3]; 9], [[MOST, -MOST, 7e4]; 9], std::array::from_fn(|k| [if k % 2 == 0 { MOST } else { -MOST }; 3])];
    let opaque = gaussian(2.0, 50.0, 1.0, [1.0; 3]);
    let mut gaussians = vec![Gaussian { sh: vec![[1.0; 3]; 9], ..opaque }];
    for (index, color) in (0u8..).zip(colors) {
        let z = 1.0 + f32::from(index);
        for scale in [1e-3, 0.3, 50.0] {
            gaussians.push(Gaussian { sh: color.to_vec(), ..gaussian(z, scale, 0.5, [0.0; 3]) });
        }
    }
    let scene = SceneBuffers::new(2, gaussians);
    let gpu = gpu();
    for precision in [GaussianPrecisionGAURAST::FLOAT32, GaussianPrecisionGAURAST::FLOAT16] {
        for order in
            [GaussianOrderGAURAST::VIEW_DEPTH, GaussianOrderGAURAST::PRIMITIVE, GaussianOrderGAURAST::PER_PIXEL]
        {
            if order == GaussianOrderGAURAST::PER_PIXEL && precision == GaussianPrecisionGAURAST::FLOAT16 {
                continue;
            }
            let mut options = GaussianOptions::new(2);
            options.state = options
                .state
                .precision(precision)
                .order(order)
                .alpha_floor(0.0)
                .alpha_ceiling(1.0)
                .transmittance_floor(0.0);
            let target = Target::floats(&gpu, size);
            draw(&gpu, &scene, &options, &target, Some([0.0; 4]), 1);
            let image: Vec<[f32; 4]> = target.read();
            assert!(image.as_flattened().iter().all(|c| !c.is_nan()), "{precision:?} {order:?}");
            // In the order of the draw, the opaque one may hide them.
            let is_bright = image.iter().any(|rgba| rgba[0] > 3e4);
            assert!(is_bright || order == GaussianOrderGAURAST::PRIMITIVE);
        }
    }
}

/// The application's own floating-point control register does not affect the device: denormals in a target are
/// preserved.
#[cfg(target_arch = "x86_64")]
#[gaurast_runner::test]
fn flushing_to_zero_changes_nothing() {
    /// The control bits that flush denormal results, and denormal operands, to zero.
    const FLUSH: u32 = 1 << 15 | 1 << 6;

    /// Sets bits of the thread's control register until it is dropped.
    struct Control(u32);

    impl Control {
        fn with(bits: u32) -> Self {
            let before = Self::read();
            Self::write(before | bits);
            Self(before)
        }

        fn read() -> u32 {
            let mut control = 0u32;
            // SAFETY: the instruction stores the register to a variable of its size.
            unsafe {
                std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack, preserves_flags));
            }
            control
        }

        fn write(control: u32) {
            // SAFETY: only two bits change, and no exception is unmasked. Nothing in this test but the device computes
            // with denormals.
            unsafe {
                std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack, preserves_flags));
            }
        }
    }

    impl Drop for Control {
        fn drop(&mut self) {
            Self::write(self.0);
        }
    }

    let size = [40, 36];
    let black = [-4.0; 3];
    let scene = SceneBuffers::new(0, [gaussian(2.0, 0.2, 0.7, black)]);
    let options = GaussianOptions { blend: vec![over()], ..GaussianOptions::new(0) };
    let picture = || {
        let gpu = gpu();
        let target = Target::floats(&gpu, size);
        draw(&gpu, &scene, &options, &target, Some([1e-39; 4]), 1);
        target.read::<[u32; 4]>()
    };
    let expected = picture();
    let middle = expected[18 * 40 + 20];
    assert!(middle[0] > 0 && f32::from_bits(middle[0]) < 1e-39, "{middle:?}");
    let flushed = {
        let _control = Control::with(FLUSH);
        picture()
    };
    assert!(flushed == expected);
}
