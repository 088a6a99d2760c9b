//! Measures the growth of the error of Gaussian draws with the difficulty of the scene. `error_growth [FOLDER]` writes
//! a table (`error_growth.csv`) and a plot (`error_growth.svg`), into the current folder by default.
//!
//! The error is the greatest distance of a channel of any pixel from the binary64 oracle's envelope, over several
//! scenes, at the simplest and at the best SIMD level.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use gaurast::vk::{GaussianCameraGAURAST, PipelineGaussianStateCreateInfoGAURAST};
use gaurast_testkit::for_levels::levels;
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::compare::{Accuracy, Limits};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::{Gaussian, SceneBuffers};
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE: [u32; 2] = [131, 97];
/// The number of scenes at each point of a sweep.
const SEEDS: u64 = 4;

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// A scene and its camera.
struct View {
    gaussians: Vec<Gaussian>,
    camera: GaussianCameraGAURAST<'static>,
    state: State,
}

/// A sweep: its name, its values, and a function that makes the view of a value.
struct Sweep {
    name: &'static str,
    values: Vec<f64>,
    view: fn(&mut ChaCha8Rng, f64) -> View,
}

fn camera(focal: f32) -> GaussianCameraGAURAST<'static> {
    GaussianCameraGAURAST::default()
        .focal_length([focal; 2])
        .principal_point([0.5 * SIZE[0] as f32, 0.5 * SIZE[1] as f32])
}

/// Gaussians of ordinary shapes in front of the camera.
fn cloud(rng: &mut ChaCha8Rng, count: usize) -> Vec<Gaussian> {
    let mut one = || {
        let z = rng.random_range(2.0..9.0f32);
        Gaussian {
            position: [z * rng.random_range(-0.6..0.6), z * rng.random_range(-0.5..0.5), z],
            scale: [0; 3].map(|_| rng.random_range(0.01..0.3)),
            rotation: [0; 4].map(|_| rng.random_range(-1.0..1.0)),
            opacity: rng.random_range(0.05..1.0),
            sh: vec![[0; 3].map(|_| rng.random_range(-1.7..1.7))],
        }
    };
    (0..count).map(|_| one()).collect()
}

fn plain(gaussians: Vec<Gaussian>) -> View {
    View { gaussians, camera: camera(105.0), state: State::default() }
}

fn layers(rng: &mut ChaCha8Rng, count: f64) -> View {
    let count = count as usize;
    let one = |index: usize| Gaussian {
        position: [rng.random_range(-1.0..1.0), 0.0, 2.0 + index as f32 * 1e-3],
        scale: [20.0; 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
        // All of them together let half of the light pass.
        opacity: (1.0 - 0.5f64.powf(1.0 / count as f64)).max(0.004) as f32,
        sh: vec![[0; 3].map(|_| rng.random_range(-1.7..1.7))],
    };
    let gaussians = (0..count).map(one).collect();
    let view = plain(gaussians);
    View { state: view.state.transmittance_floor(0.0), ..view }
}

fn far_away(rng: &mut ChaCha8Rng, distance: f64) -> View {
    let mut view = plain(cloud(rng, 200));
    for gaussian in &mut view.gaussians {
        for p in &mut gaussian.position {
            *p += distance as f32;
        }
    }
    view.camera = view.camera.eye([f64::from(distance as f32); 3]);
    view
}

fn needles(rng: &mut ChaCha8Rng, ratio: f64) -> View {
    let mut gaussians = cloud(rng, 200);
    for gaussian in &mut gaussians {
        let length = rng.random_range(0.3..3.0f32);
        gaussian.scale = [length, length / ratio as f32, length / ratio as f32];
    }
    plain(gaussians)
}

fn filterless(rng: &mut ChaCha8Rng, thinness: f64) -> View {
    let mut gaussians = cloud(rng, 400);
    for gaussian in &mut gaussians {
        // In pixels, the deviation across is the reciprocal of the thinness.
        let across = gaussian.position[2] / 105.0 / thinness as f32;
        gaussian.scale = [rng.random_range(0.3..3.0), across, across];
    }
    let view = plain(gaussians);
    View { state: view.state.low_pass_variance(0.0), ..view }
}

fn field_of_view(rng: &mut ChaCha8Rng, degrees: f64) -> View {
    let focal = 0.5 * f64::from(SIZE[0]) / (0.5 * degrees.to_radians()).tan();
    let mut view = plain(cloud(rng, 200));
    view.camera = camera(focal as f32);
    view
}

fn opacities(rng: &mut ChaCha8Rng, opacity: f64) -> View {
    let mut gaussians = cloud(rng, 60);
    for gaussian in &mut gaussians {
        gaussian.opacity = opacity as f32;
    }
    plain(gaussians)
}

fn sweeps() -> Vec<Sweep> {
    let powers =
        |base: f64, exponents: std::ops::RangeInclusive<i32>| exponents.map(|exponent| base.powi(exponent)).collect();
    vec![
        Sweep { name: "layers", values: powers(4.0, 0..=7), view: layers },
        Sweep { name: "distance from the origin", values: powers(10.0, 0..=7), view: far_away },
        Sweep { name: "ratio of axes", values: powers(10.0, 0..=7), view: needles },
        Sweep { name: "1 / deviation in pixels, no filter", values: powers(10.0, 0..=6), view: filterless },
        Sweep {
            name: "field of view in degrees",
            values: vec![1.0, 5.0, 20.0, 45.0, 90.0, 130.0, 160.0, 170.0],
            view: field_of_view,
        },
        Sweep { name: "opacity", values: powers(1e3, 0..=10), view: opacities },
    ]
}

/// The greatest distance from the envelope at each level.
fn errors(gpus: &[Gpu], view: &View) -> Vec<f64> {
    let scene = SceneBuffers::new(0, view.gaussians.iter().cloned());
    let camera = OracleCamera::new(&view.camera, SIZE).expect("a camera that the oracle has");
    let state = OracleState::from(&view.state);
    let reference = render_bounded(&scene.as_oracle(), &camera, &state);
    let of = |gpu: &Gpu| {
        let options = GaussianOptions { state: view.state, ..GaussianOptions::new(0) };
        let pipeline = GaussianPipeline::new(gpu, &options);
        let on_device = GaussianScene::new(gpu, &scene);
        let target = Target::floats(gpu, SIZE);
        gpu.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                on_device.bind(commands, &pipeline, &view.camera);
                commands.draw(0..on_device.count);
            });
        });
        Accuracy::of(&target.read::<[f32; 4]>(), &reference, Limits::ENVELOPE_ONLY).max_distance
    };
    gpus.iter().map(of).collect()
}

/// A sweep's points: the value and the error at each level.
type Points = Vec<(f64, Vec<f64>)>;

fn plot(path: &Path, results: &[(Sweep, Points)], levels: &[&str]) -> Result<(), Box<dyn Error>> {
    // Registering the font cannot fail, since it is part of the program.
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    let _ = register_font("sans-serif", FontStyle::Normal, font);
    let root = SVGBackend::new(path, (1200, 700)).into_drawing_area();
    root.fill(&WHITE)?;
    let cells = root.split_evenly((2, 3));
    for ((sweep, points), cell) in results.iter().zip(&cells) {
        let (first, last) = (sweep.values[0], sweep.values[sweep.values.len() - 1]);
        let mut chart = ChartBuilder::on(cell)
            .caption(sweep.name, ("sans-serif", 18))
            .margin(8)
            .x_label_area_size(30)
            .y_label_area_size(60)
            .build_cartesian_2d((first..last).log_scale(), (1e-9..1e-4f64).log_scale())?;
        chart
            .configure_mesh()
            .y_desc("error")
            .x_label_formatter(&|x| format!("{x:.0e}"))
            .y_label_formatter(&|y| format!("{y:.0e}"))
            .draw()?;
        chart.draw_series(LineSeries::new([(first, 5e-6), (last, 5e-6)], &RED))?;
        for (level, color) in [BLUE, GREEN].iter().enumerate().take(levels.len()) {
            let line = points.iter().map(|(value, errors)| (*value, errors[level].max(1e-9)));
            chart.draw_series(LineSeries::new(line, color))?;
        }
    }
    root.present()?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(PathBuf::new, PathBuf::from);
    let all = levels();
    let levels = [all[0], all[all.len() - 1]];
    let gpus = levels.map(|simd| {
        Gpu::embedded(&Settings { simd: Some(simd), threads: None, ..Settings::default() }).expect("a device")
    });
    let mut csv = format!("sweep,value,{}\n", levels.join(","));
    let mut results = Vec::new();
    for sweep in sweeps() {
        println!("{}", sweep.name);
        let mut points = Points::new();
        for &value in &sweep.values {
            let mut worst = vec![0.0f64; levels.len()];
            for seed in 0..SEEDS {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                let found = errors(&gpus, &(sweep.view)(&mut rng, value));
                worst.iter_mut().zip(found).for_each(|(worst, found)| *worst = worst.max(found));
            }
            let cells: Vec<_> = worst.iter().map(|error| format!("{error:.2e}")).collect();
            println!("  {value:9.3e}  {}", cells.join("  "));
            writeln!(csv, "\"{}\",{value},{}", sweep.name, cells.join(","))?;
            points.push((value, worst));
        }
        results.push((sweep, points));
    }
    std::fs::write(folder.join("error_growth.csv"), csv)?;
    plot(&folder.join("error_growth.svg"), &results, &levels)
}
