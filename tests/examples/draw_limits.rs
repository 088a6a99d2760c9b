//! Times and memory of draws near the limits of Gaussian draws. `draw_limits [COUNT]` draws COUNT Gaussians (3,000,000 by default)
//! as vertices and as small instances, and a few of which an indirect draw claims that they are 2^32 - 1, and prints a table.
//! `draw_limits 67108864` draws as many as `maxGaussiansPerDraw` says, and takes 12 GB of memory and seven minutes.

use std::time::Instant;

use ash::vk;
use gaurast_render::process_stats::{peak_memory, reset_peak_memory};
use gaurast_testkit::{
    Buffer, Commands, GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Pipeline, Settings, Target,
};
use gaurast_tests::scenes::{self, SceneBuffers};

const SIZE: [u32; 2] = [640, 360];
/// Gaussians that exist, of those that an indirect draw claims.
const FEW: usize = 1200;
const FRAMES: usize = 3;

/// A number from 0 to 1 that belongs to two indices.
fn random(index: usize, which: u32) -> f32 {
    let mut bits = (index as u32).wrapping_mul(0x9E37_79B9) ^ which.wrapping_mul(0x85EB_CA6B);
    bits ^= bits >> 15;
    bits = bits.wrapping_mul(0x2C1B_3C6D);
    bits ^= bits >> 12;
    bits = bits.wrapping_mul(0x297A_2D39);
    bits ^= bits >> 15;
    bits as f32 / 4_294_967_296.0
}

/// Small Gaussians in front of the camera.
fn scene(count: usize) -> SceneBuffers {
    let position = |index| {
        let z = 2.0 + 6.0 * random(index, 0);
        [z * (random(index, 1) - 0.5), z * (random(index, 2) - 0.5) * 0.6, z]
    };
    SceneBuffers {
        positions: (0..count).map(position).collect(),
        scales: vec![[0.004; 3]; count],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; count],
        opacities: vec![0.6; count],
        sh: (0..count).map(|index| [3, 4, 5].map(|which| random(index, which) - 0.5)).collect(),
        degree: 0,
    }
}

/// A pipeline whose attributes all advance by instance.
fn by_instance(gpu: &Gpu) -> Pipeline {
    let options = GaussianOptions::new(0);
    let mut graphics = options.graphics();
    for binding in &mut graphics.bindings {
        binding.input_rate = vk::VertexInputRate::INSTANCE;
    }
    graphics.create(gpu).expect("a pipeline")
}

/// Prints the seconds of the first frame and the least of the others, and the greatest memory that they needed.
fn measure(gpu: &Gpu, name: &str, target: &Target, record: impl Fn(&Commands)) -> Vec<[f32; 4]> {
    reset_peak_memory();
    let seconds = [(); FRAMES].map(|()| {
        let started = Instant::now();
        gpu.run(|commands| commands.pass(target, &Pass::clear([0.0; 4]), || record(commands)));
        started.elapsed().as_secs_f64()
    });
    let least = seconds[1..].iter().copied().fold(f64::INFINITY, f64::min);
    let mebibytes = peak_memory().map_or(f64::NAN, |bytes| bytes as f64 / f64::from(1 << 20));
    println!("| {name} | {:.2} | {least:.2} | {mebibytes:.0} |", seconds[0]);
    for text in gpu.message_texts() {
        println!("  {text}");
    }
    target.read()
}

fn main() {
    let count = std::env::args().nth(1).map_or(3_000_000, |count| count.parse().expect("a number of Gaussians"));
    let gpu = Gpu::embedded(&Settings::default()).expect("a device");
    let target = Target::floats(&gpu, SIZE);
    let camera = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
    let pipeline = GaussianPipeline::new(&gpu, &GaussianOptions::new(0));
    let instanced = by_instance(&gpu);
    println!("| {count} Gaussians | first frame, s | others, s | peak of memory, MiB |\n|---|---|---|---|");
    let few = GaussianScene::new(&gpu, &scene(FEW));
    let claimed = Buffer::of(&gpu, &[[u32::MAX, 1, 0, 0]]);
    let drawn = measure(&gpu, "1,200", &target, |commands| few.draw(commands, &pipeline, &camera));
    let found = measure(&gpu, "1,200, of which an indirect draw claims 2^32 - 1", &target, |commands| {
        few.bind(commands, &pipeline, &camera);
        commands.draw_indirect(&claimed, 1);
    });
    assert_eq!(drawn, found, "what is beyond a buffer draws nothing");
    let all = GaussianScene::new(&gpu, &scene(count));
    let drawn = measure(&gpu, "as vertices", &target, |commands| all.draw(commands, &pipeline, &camera));
    let found = measure(&gpu, "one an instance", &target, |commands| {
        commands.bind(&instanced);
        all.bind_buffers(commands);
        commands.camera(&camera);
        commands.draw_instances(0..1, 0..all.count);
    });
    assert_eq!(drawn, found, "instances are the same Gaussians");
}
