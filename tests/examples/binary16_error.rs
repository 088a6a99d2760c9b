//! Prints a table of the errors of binary16 rasterization: `cargo run --release -p gaurast-tests --example
//! binary16_error [SCENE FILE...]`.
//!
//! Each scene is drawn in binary16 and in binary32, and both are compared with the binary64 oracle.

use gaurast::vk::{GaussianPrecisionGAURAST, PipelineGaussianStateCreateInfoGAURAST};
use gaurast_scene::camera::DEFAULT_FOV;
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::{self, SceneBuffers};
use std::error::Error;
use std::path::Path;

const SIZE: [u32; 2] = [640, 480];

/// Differences of a picture from the oracle's, over all channels.
struct Figures {
    greatest: f64,
    mean: f64,
    /// The PSNR in dB, for a peak of 1.
    psnr: f64,
    /// The percentage of pixels that differ by a level of 8 bits or more.
    visible: f64,
}

fn figures(picture: &[[f32; 4]], exact: &[[f64; 4]]) -> Figures {
    let difference =
        |(a, b): (&[f32; 4], &[f64; 4])| [0, 1, 2, 3].map(|channel| (f64::from(a[channel]) - b[channel]).abs());
    let differences: Vec<[f64; 4]> = picture.iter().zip(exact).map(difference).collect();
    let all = differences.as_flattened();
    let (count, pixels) = (all.len() as f64, differences.len() as f64);
    let is_visible = |pixel: &&[f64; 4]| pixel.iter().any(|d| *d >= 1.0 / 255.0);
    Figures {
        greatest: all.iter().fold(0.0, |a, &b| a.max(b)),
        mean: all.iter().sum::<f64>() / count,
        psnr: -10.0 * (all.iter().map(|d| d * d).sum::<f64>() / count).log10(),
        visible: 100.0 * differences.iter().filter(is_visible).count() as f64 / pixels,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut subjects = Vec::new();
    for (name, count, enlarged) in [("a cloud of 20,000", 20_000, 1.0), ("4,000 large ones", 4_000, 6.0)] {
        let mut scene = scenes::cloud(70, count, 1);
        for scale in scene.scales.as_flattened_mut() {
            *scale *= enlarged;
        }
        let camera = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
        subjects.push((name.to_owned(), scene, camera));
    }
    let garden = gaurast_scene::garden::scene(1, 100_000);
    let camera = gaurast_scene::garden::camera(None, SIZE)?.to_vulkan();
    subjects.push(("a garden of 100,000".to_owned(), SceneBuffers::from(&garden), camera));
    for file in std::env::args().skip(1) {
        let path = Path::new(&file);
        let scene = gaurast_scene::open(path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let camera = gaurast_scene::frame_middle(&scene, DEFAULT_FOV, SIZE).to_vulkan();
        subjects.push((name, SceneBuffers::from(&scene), camera));
    }

    println!("# Errors of binary16 rasterization\n");
    println!(
        "Pictures of {}x{} pixels, compared with the binary64 oracle in all channels of (C, 1 - T). \
         `cargo run --release -p gaurast-tests --example binary16_error` prints this page.\n",
        SIZE[0], SIZE[1]
    );
    println!("| scene | precision | greatest error | mean error | PSNR, dB | pixels off by 1/255 or more |");
    println!("|---|---|---:|---:|---:|---:|");
    let gpu = Gpu::embedded(&Settings::default()).expect("a device");
    for (name, scene, camera) in &subjects {
        let on_device = GaussianScene::new(&gpu, scene);
        let view = OracleCamera::new(camera, SIZE).ok_or("a camera that the oracle lacks")?;
        let reference = render_bounded(&scene.as_oracle(), &view, &OracleState::default());
        for (precision_name, precision) in
            [("binary16", GaussianPrecisionGAURAST::FLOAT16), ("binary32", GaussianPrecisionGAURAST::FLOAT32)]
        {
            let options = GaussianOptions {
                state: PipelineGaussianStateCreateInfoGAURAST::default().precision(precision),
                ..GaussianOptions::new(scene.degree)
            };
            let pipeline = GaussianPipeline::new(&gpu, &options);
            let target = Target::floats(&gpu, SIZE);
            gpu.run(|commands| {
                commands.pass(&target, &Pass::clear([0.0; 4]), || {
                    on_device.bind(commands, &pipeline, camera);
                    commands.draw(0..on_device.count);
                });
            });
            let Figures { greatest, mean, psnr, visible } = figures(&target.read(), &reference.nominal);
            println!("| {name} | {precision_name} | {greatest:.2e} | {mean:.2e} | {psnr:.1} | {visible:.3} % |");
        }
    }
    Ok(())
}
