//! Properties that hold for all pictures, tested on random scenes.

use gaurast::vk::{GaussianCameraGAURAST, GaussianOrderGAURAST, GaussianPrecisionGAURAST};
use gaurast_runner::{Case, Variant, simd_levels};
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target, over};
use gaurast_tests::scenes::{Gaussian, SceneBuffers};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE: [u32; 2] = [75, 53];
type Camera = GaussianCameraGAURAST<'static>;

fn camera() -> Camera {
    Camera::default().focal_length([60.0; 2]).principal_point([0.5 * SIZE[0] as f32, 0.5 * SIZE[1] as f32])
}

/// Gaussians at different depths. Their coordinates are multiples of 2^-10 below 16, so that a translation by up to
/// 2^12 is exact.
fn scene(seed: u64, count: usize) -> Vec<Gaussian> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut depths: Vec<i32> = (2 * 1024..9 * 1024).collect();
    depths.shuffle(&mut rng);
    let one = |depth: i32| {
        let z = depth as f32 / 1024.0;
        let mut coordinate = || (rng.random_range(-0.6..0.6) * z * 1024.0f32).round() / 1024.0;
        let position = [coordinate(), coordinate(), z];
        Gaussian {
            position,
            scale: [0; 3].map(|_| 10f32.powf(rng.random_range(-3.0..0.5))),
            rotation: [0; 4].map(|_| rng.random_range(-1.0..1.0)),
            opacity: rng.random_range(0.0..1.2),
            sh: vec![[0; 3].map(|_| rng.random_range(-1.7..1.7))],
        }
    };
    depths.into_iter().take(count).map(one).collect()
}

fn buffers(gaussians: &[Gaussian]) -> SceneBuffers {
    SceneBuffers::new(0, gaussians.iter().cloned())
}

/// Draws sets of Gaussians one after the other, each over the result of the earlier ones.
fn draw(gpu: &Gpu, sets: &[&[Gaussian]], options: &GaussianOptions, camera: &Camera) -> Vec<[f32; 4]> {
    let pipeline = GaussianPipeline::new(gpu, options);
    let on_device: Vec<_> = sets.iter().map(|set| GaussianScene::new(gpu, &buffers(set))).collect();
    let target = Target::floats(gpu, SIZE);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            for set in &on_device {
                set.bind(commands, &pipeline, camera);
                commands.draw(0..set.count);
            }
        });
    });
    target.read()
}

fn one(gpu: &Gpu, gaussians: &[Gaussian], camera: &Camera) -> Vec<[f32; 4]> {
    draw(gpu, &[gaussians], &GaussianOptions::new(0), camera)
}

/// Options without floors, because a floor makes whole contributions depend on rounding.
fn without_floors() -> GaussianOptions<'static> {
    let mut options = GaussianOptions::new(0);
    options.state = options.state.alpha_floor(0.0).transmittance_floor(0.0);
    options
}

/// Twice the distance that the contract allows from the exact result.
const TWO_PICTURES: f32 = 1e-5;

/// The greatest difference of a channel.
fn distance(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Few cases, each a whole picture; a failure prints its seed.
fn cases() -> ProptestConfig {
    ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases())]

    /// The order of the draw affects only ties.
    #[gaurast_runner::test]
    fn order_does_not_matter(seed: u64, count in 1..150usize) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let mut gaussians = scene(seed, count);
        let sorted = one(&gpu, &gaussians, &camera());
        gaussians.shuffle(&mut ChaCha8Rng::seed_from_u64(!seed));
        prop_assert!(sorted == one(&gpu, &gaussians, &camera()));
    }

    /// A common translation of scene and camera changes no bit, if no coordinate is rounded.
    #[gaurast_runner::test]
    fn place_does_not_matter(seed: u64, count in 1..150usize, offset in prop::array::uniform3(-4096..4096i32)) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let mut gaussians = scene(seed, count);
        let here = one(&gpu, &gaussians, &camera());
        let offset = offset.map(|o| o as f32);
        for gaussian in &mut gaussians {
            for (p, o) in gaussian.position.iter_mut().zip(offset) {
                *p += o;
            }
        }
        let there = one(&gpu, &gaussians, &camera().eye(offset.map(f64::from)));
        prop_assert!(here == there);
    }

    /// A mirrored scene gives the mirrored picture, up to rounding.
    #[gaurast_runner::test]
    fn mirrors_agree(seed: u64, count in 1..60usize) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let mut gaussians = scene(seed, count);
        let options = without_floors();
        let straight = draw(&gpu, &[&gaussians], &options, &camera());
        for gaussian in &mut gaussians {
            gaussian.position[0] *= -1.0;
            // Mirroring x reverses rotations about y and z.
            gaussian.rotation[2] *= -1.0;
            gaussian.rotation[3] *= -1.0;
        }
        let mut mirrored = draw(&gpu, &[&gaussians], &options, &camera());
        mirrored.chunks_mut(SIZE[0] as usize).for_each(<[_]>::reverse);
        let distance = distance(&straight, &mirrored);
        prop_assert!(distance <= TWO_PICTURES, "{distance:e}");
    }

    /// A draw can be split by depth and the near part blended over the far part, if no transmittance ends a pixel.
    #[gaurast_runner::test]
    fn a_draw_may_be_cut_by_depth(seed: u64, count in 2..150usize, share in 0.0..1.0f64) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let mut gaussians = scene(seed, count);
        gaussians.sort_by(|a, b| a.position[2].total_cmp(&b.position[2]));
        let mut options = GaussianOptions::new(0);
        options.state = options.state.transmittance_floor(0.0);
        options.blend = vec![over()];
        let whole = draw(&gpu, &[&gaussians], &options, &camera());
        let (near, far) = gaussians.split_at((share * count as f64) as usize);
        let parts = draw(&gpu, &[far, near], &options, &camera());
        let distance = distance(&whole, &parts);
        prop_assert!(distance <= TWO_PICTURES, "{distance:e}");
    }

    /// With a floor, each part begins with a transmittance of 1. The far part may then contribute as much as the floor
    /// divided by the least transmittance of a layer.
    #[gaurast_runner::test]
    fn a_cut_shows_no_more_than_the_floor(seed: u64, count in 2..150usize, share in 0.0..1.0f64) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let mut gaussians = scene(seed, count);
        gaussians.sort_by(|a, b| a.position[2].total_cmp(&b.position[2]));
        let mut options = GaussianOptions::new(0);
        options.blend = vec![over()];
        let whole = draw(&gpu, &[&gaussians], &options, &camera());
        let (near, far) = gaussians.split_at((share * count as f64) as usize);
        let parts = draw(&gpu, &[far, near], &options, &camera());
        // The bound is 1e-4 / (1 - 0.99), times 1 in alpha and less in colours: at most 0.5 + 1.7 / (2 sqrt(pi)).
        let bound = 1e-2 + 1e-5;
        let distance = distance(&whole, &parts);
        prop_assert!(distance <= bound, "{distance:e}");
    }

    /// The number of threads changes no bit.
    #[gaurast_runner::test]
    fn threads_do_not_matter(seed: u64, count in 1..150usize, threads in 2..9usize) {
        let picture = |threads| {
            let settings = Settings { threads: Some(threads), ..Settings::default() };
            one(&Gpu::embedded(&settings).expect("a device"), &scene(seed, count), &camera())
        };
        prop_assert!(picture(1) == picture(threads));
    }

    /// The position of tile boundaries has no effect: the picture is the same wherever the viewport is in a larger
    /// target.
    #[gaurast_runner::test]
    fn tiles_do_not_matter(seed: u64, count in 1..100usize, corner in prop::array::uniform2(0..70u32)) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let options = without_floors();
        let scene = scene(seed, count);
        let whole = draw(&gpu, &[&scene], &options, &camera());
        let pipeline = GaussianPipeline::new(&gpu, &options);
        let on_device = GaussianScene::new(&gpu, &buffers(&scene));
        let size = [0, 1].map(|axis| SIZE[axis] + corner[axis]);
        let target = Target::floats(&gpu, size);
        let [x, y] = corner.map(|c| c as f32);
        let viewport = [x, y, SIZE[0] as f32, SIZE[1] as f32];
        gpu.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                on_device.bind(commands, &pipeline, &camera());
                commands.viewport(viewport, [0.0, 1.0]);
                commands.draw(0..on_device.count);
            });
        });
        let moved: Vec<[f32; 4]> = target.read();
        let rows = moved.chunks(size[0] as usize).skip(corner[1] as usize);
        let moved: Vec<[f32; 4]> = rows.flat_map(|row| &row[corner[0] as usize..]).copied().collect();
        let distance = distance(&whole, &moved);
        prop_assert!(distance <= TWO_PICTURES, "{distance:e}");
    }

    /// Several draws in one sorted set give the same bits as one draw.
    #[gaurast_runner::test]
    fn draws_may_be_merged(seed: u64, count in 1..150u32, cuts in prop::array::uniform2(0.0..1.0f64)) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let options = GaussianOptions::new(0);
        let mut gaussians = scene(seed, count as usize);
        gaussians.shuffle(&mut ChaCha8Rng::seed_from_u64(!seed));
        let whole = one(&gpu, &gaussians, &camera());
        let mut cuts = cuts.map(|cut| (cut * f64::from(count)) as u32);
        cuts.sort_unstable();
        let pipeline = GaussianPipeline::new(&gpu, &options);
        let on_device = GaussianScene::new(&gpu, &buffers(&gaussians));
        let target = Target::floats(&gpu, SIZE);
        gpu.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                on_device.bind(commands, &pipeline, &camera());
                commands.gaussian_set(|| {
                    for [from, to] in [[0, cuts[0]], cuts, [cuts[1], count]] {
                        commands.draw(from..to);
                    }
                });
            });
        });
        prop_assert!(whole == target.read::<[f32; 4]>());
    }

    /// Colours are finite and not negative, and alpha is in [0, 1], in both precisions, with floors and without.
    #[gaurast_runner::test]
    fn pictures_are_sane(seed: u64, count in 1..60usize, binary16: bool, floors: bool, per_pixel: bool) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let scene = gaurast_tests::scenes::awkward(seed, count, 1);
        let mut options = GaussianOptions::new(1);
        if binary16 {
            options.state = options.state.precision(GaussianPrecisionGAURAST::FLOAT16);
        }
        if !floors {
            options.state = options.state.alpha_floor(0.0).alpha_ceiling(1.0).transmittance_floor(0.0);
        }
        if per_pixel && !binary16 {
            options.state = options.state.order(GaussianOrderGAURAST::PER_PIXEL);
        }
        let pipeline = GaussianPipeline::new(&gpu, &options);
        let on_device = GaussianScene::new(&gpu, &scene);
        let target = Target::floats(&gpu, SIZE);
        gpu.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                on_device.bind(commands, &pipeline, &camera());
                commands.draw(0..on_device.count);
            });
        });
        for pixel in target.read::<[f32; 4]>() {
            prop_assert!(pixel.iter().all(|c| c.is_finite() && *c >= 0.0), "{pixel:?}");
            prop_assert!(pixel[3] <= 1.0, "{pixel:?}");
        }
    }
}

/// All SIMD levels except the simplest.
fn other_levels() -> Vec<Variant> {
    simd_levels().split_off(1)
}

/// A SIMD level differs from the simplest only by rounding.
#[gaurast_runner::test(each = other_levels())]
fn levels_agree(case: &Case) {
    let levels = [gaurast_runner::SIMD_LEVELS[0], case.variant()];
    let property = |(seed, count)| {
        let scene = scene(seed, count);
        let [simplest, other] = levels.map(|level| {
            let settings = Settings { simd: Some(level), ..Settings::default() };
            let gpu = Gpu::embedded(&settings).expect("a device");
            draw(&gpu, &[&scene], &without_floors(), &camera())
        });
        let distance = distance(&simplest, &other);
        prop_assert!(distance <= TWO_PICTURES, "{distance:e}");
        Ok(())
    };
    let held = TestRunner::new(cases()).run(&(any::<u64>(), 1..100usize), property);
    held.unwrap_or_else(|error| panic!("{error}"));
}
