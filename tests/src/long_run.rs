//! Thousands of frames of small, recurring scenes on one device. Memory must not grow, and every picture must be the
//! same to the bit each time.

use gaurast::vk::{GaussianAntialiasingGAURAST, GaussianCameraGAURAST, GaussianOrderGAURAST};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::scenes::{Gaussian, SceneBuffers};
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target, over};

/// The number of scenes.
pub const SCENES: usize = 24;

/// A scene and its draw parameters.
struct Scene {
    buffers: SceneBuffers,
    camera: GaussianCameraGAURAST<'static>,
    options: GaussianOptions<'static>,
    size: [u32; 2],
    /// The number of times it is drawn over itself in one pass.
    draws: u32,
}

impl Scene {
    fn new(number: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(number as u64);
        let size = [0; 2].map(|_| rng.random_range(1..70));
        let degree = rng.random_range(0..=2);
        let mut gaussian = |_| {
            let z = rng.random_range(1.0..6.0f32);
            Gaussian {
                position: [z * rng.random_range(-0.8..0.8), z * rng.random_range(-0.8..0.8), z],
                scale: [0; 3].map(|_| rng.random_range(-7.0..0.5f32).exp()),
                rotation: [0; 4].map(|_| rng.random_range(-1.0..1.0)),
                opacity: rng.random_range(0.0..1.1),
                sh: (0..(degree + 1) * (degree + 1)).map(|_| [0; 3].map(|_| rng.random_range(-1.0..1.5))).collect(),
            }
        };
        let count = 1 + number * 37 % 700;
        let buffers = SceneBuffers::new(degree, (0..count).map(&mut gaussian));
        let mut options = GaussianOptions::new(degree);
        options.state = options
            .state
            .order(
                [
                    GaussianOrderGAURAST::VIEW_DEPTH,
                    GaussianOrderGAURAST::RADIAL_DISTANCE,
                    GaussianOrderGAURAST::PRIMITIVE,
                ][number % 3],
            )
            .antialiasing(
                [GaussianAntialiasingGAURAST::DILATE, GaussianAntialiasingGAURAST::OPACITY_COMPENSATED][number % 2],
            )
            .transmittance_floor([1e-4, 0.0][number / 2 % 2]);
        options.blend = vec![over()];
        Self {
            buffers,
            camera: GaussianCameraGAURAST::default()
                .focal_length([0.8 * size[0] as f32; 2])
                .principal_point(size.map(|side| 0.5 * side as f32)),
            options,
            size,
            draws: 1 + number as u32 % 3,
        }
    }

    /// Draws it with objects that are all destroyed afterwards.
    fn draw(&self, gpu: &Gpu) -> Vec<[f32; 4]> {
        let pipeline = GaussianPipeline::new(gpu, &self.options);
        let scene = GaussianScene::new(gpu, &self.buffers);
        let target = Target::floats(gpu, self.size);
        gpu.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                scene.bind(commands, &pipeline, &self.camera);
                for _ in 0..self.draws {
                    commands.draw(0..scene.count);
                }
            });
        });
        target.read()
    }
}

/// The results of a long run.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// Frames that were drawn.
    pub frames: usize,
    /// Bytes of memory that the process used before the first frame, after each quarter, and at most. `None` if the
    /// system does not report it.
    pub memory: Option<[u64; 6]>,
}

/// Draws `frames` frames, and calls `progress` with the number of each.
///
/// # Panics
/// If a scene's picture differs from its first one, or if memory grows by more than 16 MiB.
pub fn run(frames: usize, mut progress: impl FnMut(usize)) -> Report {
    let gpu = Gpu::embedded(&Settings { threads: Some(2), ..Settings::default() }).expect("a device");
    let scenes: Vec<_> = (0..SCENES).map(Scene::new).collect();
    let first: Vec<_> = scenes.iter().map(|scene| scene.draw(&gpu)).collect();
    assert!(first.iter().flatten().any(|pixel| pixel[3] > 0.0));
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut held = vec![memory("VmRSS:")];
    for frame in 0..frames {
        let number = rng.random_range(0..SCENES);
        let drawn = scenes[number].draw(&gpu);
        let same = drawn.iter().zip(&first[number]);
        let same = same.clone().all(|(a, b)| a.map(f32::to_bits) == b.map(f32::to_bits));
        assert!(same, "scene {number} is another in frame {frame}");
        if (1..=4).any(|quarter| frame + 1 == quarter * frames / 4) {
            held.push(memory("VmRSS:"));
        }
        progress(frame);
    }
    held.push(memory("VmHWM:"));
    let held: Option<Vec<_>> = held.into_iter().collect();
    let memory = held.and_then(|held| <[u64; 6]>::try_from(held).ok());
    if let Some([_, early, .., late, _]) = memory {
        assert!(late <= early + (16 << 20), "memory grew from {early} to {late} bytes");
    }
    assert!(gpu.messages().is_empty(), "nothing went wrong");
    Report { frames, memory }
}

/// Bytes of memory that the process holds (`VmRSS:`) or has held at most (`VmHWM:`), as Linux tells.
pub fn memory(what: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(what))?;
    let kibibytes: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kibibytes * 1024)
}
