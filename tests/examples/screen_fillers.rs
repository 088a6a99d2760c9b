//! Draws a million Gaussians that each fill a target of 8192x8192 pixels: 2.6e11 pairs of tile and Gaussian, far more
//! than a list can hold. `screen_fillers [COUNT [SIDE]]` draws them once and prints the time and the peak memory of the
//! process.

use gaurast::vk::GaussianCameraGAURAST;
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::scenes::{Gaussian, SceneBuffers};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |otherwise: u32| arguments.next().map_or(Ok(otherwise), |text| text.parse());
    let (count, side) = (number(1_000_000)?, number(8192)?);
    let one = |index: u32| Gaussian {
        position: [0.0, 0.0, 2.0 + index as f32 * 1e-5],
        scale: [1e4; 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
        opacity: 0.05,
        sh: vec![[0, 1, 2].map(|c| (index * (3 + c) % 7) as f32 / 2.0 - 1.5)],
    };
    let scene = SceneBuffers::new(0, (0..count).map(one));
    let gpu = Gpu::embedded(&Settings::default()).expect("a device");
    let options = GaussianOptions::new(0);
    let pipeline = GaussianPipeline::new(&gpu, &options);
    let on_device = GaussianScene::new(&gpu, &scene);
    let target = Target::floats(&gpu, [side; 2]);
    let camera =
        GaussianCameraGAURAST::default().focal_length([side as f32; 2]).principal_point([0.5 * side as f32; 2]);
    let started = Instant::now();
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            on_device.bind(commands, &pipeline, &camera);
            commands.draw(0..on_device.count);
        });
    });
    println!("{count} Gaussians at {side}x{side}: {:.1} s", started.elapsed().as_secs_f64());
    // Only Linux has this file.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find(|line| line.starts_with("VmHWM"));
    println!("{}", peak.unwrap_or("the system does not tell the memory"));
    Ok(())
}
