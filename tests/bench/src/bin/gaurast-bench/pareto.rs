//! `gaurast-bench pareto`: run time against error over settings, peers and scenes.

use std::io::{Write, stdout};
use std::path::{Path, PathBuf};

use gaurast_render::{Precision, Settings};
use gaurast_scene::camera::Camera;
use serde::Serialize;

use super::judge::{Error, Judge, PictureFile};
use super::machine::Machine;
use super::output::{self, Rows, number};
use super::plot::{self, Panel, Series};
use super::worker::{Contender, Drawn, Worker};
use crate::arguments::{ParetoArguments, SweepArguments};
use crate::error::BenchError;
use crate::median::median;
use crate::worker::CONTENDERS;
use crate::workload::{Source, Workload};

/// A way to draw: a contender, its settings, and the part of the resolution that it draws.
#[derive(Clone, Debug, Serialize)]
struct Variant {
    contender: Contender,
    name: String,
    settings: Settings,
    /// The divisor of width and height; the picture is scaled up again before it is judged.
    divisor: u32,
}

/// The time and the error of a variant.
#[derive(Serialize)]
struct Point {
    variant: Variant,
    /// The median frame's milliseconds.
    wall: f64,
    /// The median frame's milliseconds of processor time.
    processor: f64,
    error: Error,
    /// True if no other point is both faster and closer to the reference.
    on_front: bool,
}

impl Point {
    /// The cost of the point: processor time, which depends least on other load on the machine, or wall time if
    /// processor time is unknown.
    fn cost(&self) -> f64 {
        if self.processor.is_nan() { self.wall } else { self.processor }
    }
}

#[derive(Serialize)]
struct SceneResults {
    scene: String,
    workload: Workload,
    gaussians: usize,
    points: Vec<Point>,
}

#[derive(Serialize)]
struct Results {
    machine: Machine,
    threads: usize,
    scenes: Vec<SceneResults>,
}

/// Runs the sweep.
pub(super) fn run(arguments: &ParetoArguments) -> Result<(), BenchError> {
    let variants = variants(arguments)?;
    let data = (arguments.data.clone()).or_else(|| std::env::var_os(DATA).map(PathBuf::from));
    let arguments = &arguments.sweep;
    let mut results = Results { machine: Machine::this(), threads: arguments.threads, scenes: Vec::new() };
    let runs = arguments.runs.unwrap_or(if arguments.quick { 3 } else { 9 }) as usize;
    let _ = writeln!(stdout(), "{}", results.machine.line());
    for workload in workloads(arguments, data.as_deref()) {
        let scene = measure(workload, arguments.threads, runs, &variants)?;
        let _ = writeln!(stdout(), "\n{}: {} Gaussians\n{}", scene.scene, scene.gaussians, table(&scene).table());
        results.scenes.push(scene);
        // The results so far are kept if a later scene fails.
        save(&arguments.output, &results)?;
    }
    Ok(())
}

/// The environment variable of the folder of test data.
const DATA: &str = "GAURAST_TEST_DATA";

/// The path of a file of test data. If it is missing, prints that it is and what is done `instead`, and returns `None`.
fn present(data: Option<&Path>, name: &str, instead: &str) -> Option<PathBuf> {
    let Some(data) = data else {
        eprintln!("{name}: {instead}, since neither --data nor {DATA} is given");
        return None;
    };
    let path = data.join(name);
    if !path.exists() {
        eprintln!("{name}: {instead}, since {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// The scenes, the smallest first, with the files of the folder `data`.
fn workloads(arguments: &SweepArguments, data: Option<&Path>) -> Vec<Workload> {
    let size = if arguments.quick { [640, 360] } else { [1280, 720] };
    let captured = |count, name: &str| Source::Captured {
        count,
        cameras: present(data, &format!("cameras/{name}.json"), "an orbit takes its place"),
    };
    let mut sources = vec![
        captured(10_000, "room"),
        captured(100_000, "bonsai"),
        Source::Benchmark { count: 300_000 },
        Source::Garden { count: 300_000 },
        captured(1_000_000, "garden"),
    ];
    let files = ["skull.ply", "playbot-125k.ply", "guitar.compressed.ply"];
    for path in files.into_iter().filter_map(|name| present(data, &format!("splats/{name}"), "left out")) {
        sources.insert(2, Source::File { path });
        if arguments.quick {
            break;
        }
    }
    if !arguments.quick {
        sources.push(captured(6_000_000, "bicycle"));
    }
    sources.into_iter().map(|source| Workload::new(source, size)).collect()
}

/// All variants, or those that the arguments select.
fn variants(arguments: &ParetoArguments) -> Result<Vec<Variant>, BenchError> {
    let (only, without) = (&arguments.only, &arguments.without);
    let all = all_variants();
    if let Some(name) = only.iter().find(|&name| all.iter().all(|variant| variant.name != *name)) {
        return Err(BenchError::NoSuchSetting(name.clone()));
    }
    let wanted =
        |variant: &Variant| (only.is_empty() || only.contains(&variant.name)) && !without.contains(&variant.contender);
    Ok(all.into_iter().filter(wanted).collect())
}

fn all_variants() -> Vec<Variant> {
    let exact = Settings::default();
    let floor = |alpha: f32| Settings { alpha_floor: alpha / 255.0, ..exact };
    let finish = |transmittance_floor: f32| Settings { transmittance_floor, ..exact };
    let degree = |sh_degree: u32| Settings { sh_degree, ..exact };
    let mixed = |sh_degree: u32, alpha: f32, transmittance_floor: f32| Settings {
        sh_degree,
        alpha_floor: alpha / 255.0,
        transmittance_floor,
        ..exact
    };
    let budget = |levels: f32| Settings { contribution_budget: levels / 255.0, ..exact };
    let powers = |exponential_error: f32| Settings { exponential_error, ..exact };
    let half = Settings { precision: Precision::Fp16, ..exact };
    let all = [
        ("as meant", exact, 1),
        ("alpha 2/255", floor(2.0), 1),
        ("alpha 4/255", floor(4.0), 1),
        ("alpha 8/255", floor(8.0), 1),
        ("alpha 16/255", floor(16.0), 1),
        ("T 1e-3", finish(1e-3), 1),
        ("T 1e-2", finish(1e-2), 1),
        ("T 5e-2", finish(5e-2), 1),
        ("degree 2", degree(2), 1),
        ("degree 1", degree(1), 1),
        ("degree 0", degree(0), 1),
        ("alpha 2/255, T 1e-3", mixed(4, 2.0, 1e-3), 1),
        ("alpha 4/255, T 1e-2", mixed(4, 4.0, 1e-2), 1),
        ("alpha 8/255, T 5e-2, degree 1", mixed(1, 8.0, 5e-2), 1),
        ("binary16", half, 1),
        ("exponential 1e-4", powers(1e-4), 1),
        ("exponential 2e-3", powers(2e-3), 1),
        ("budget 1/255", budget(1.0), 1),
        ("budget 4/255", budget(4.0), 1),
        ("budget 16/255", budget(16.0), 1),
        (
            "budget 4/255, exponential 2e-3, degree 1",
            Settings { exponential_error: 2e-3, sh_degree: 1, ..budget(4.0) },
            1,
        ),
        ("half size", exact, 2),
        ("half size, alpha 8/255, T 5e-2, degree 1", mixed(1, 8.0, 5e-2), 2),
        ("quarter size", exact, 4),
    ];
    // With quads no pixel is finished early.
    let of_quads = ["as meant", "alpha 4/255", "alpha 16/255", "degree 0", "half size", "quarter size"];
    CONTENDERS
        .iter()
        .flat_map(|&contender| {
            all.iter()
                .filter(move |(name, ..)| contender == Contender::Gaurast || of_quads.contains(name))
                .map(move |&(name, settings, divisor)| Variant { contender, name: name.to_owned(), settings, divisor })
        })
        // Quads on this driver are drawn with the default settings only, since quads on lavapipe show the sweep.
        .filter(|variant| variant.contender != Contender::QuadsOnGaurast || variant.name == "as meant")
        .collect()
}

fn measure(workload: Workload, threads: usize, runs: usize, variants: &[Variant]) -> Result<SceneResults, BenchError> {
    let (judge, views, gaussians) = {
        let scene = workload.scene()?;
        let views = workload.views(&scene, runs)?;
        (Judge::new(&scene), views, scene.len())
    };
    let mut workers = Vec::new();
    let contenders = CONTENDERS.into_iter().filter(|&contender| variants.iter().any(|one| one.contender == contender));
    for contender in contenders {
        if let Some(worker) = Worker::start(contender, &workload, threads)? {
            workers.push((contender, worker));
        } else {
            eprintln!("left out: {} (not installed)", contender.name());
        }
    }
    let mut draws: Vec<(Variant, usize, Vec<Drawn>)> = variants
        .iter()
        .filter_map(|variant| {
            let worker = workers.iter().position(|(contender, _)| *contender == variant.contender)?;
            Some((variant.clone(), worker, Vec::new()))
        })
        .collect();
    let smaller =
        |view: &Camera, divisor: u32| view.resized([view.width, view.height].map(|side| (side / divisor).max(1)));
    // One view of each is a warm-up; then all take turns.
    for (index, view) in views.iter().take(1).chain(&views).enumerate() {
        for (variant, worker, frames) in &mut draws {
            let camera = smaller(view, variant.divisor);
            let drawn = workers[*worker].1.draw(&camera, variant.settings, None)?;
            if index > 0 {
                frames.push(drawn);
            }
        }
    }
    let (file, view) = (PictureFile::new()?, &views[runs / 2]);
    let reference = judge.reference(view)?;
    let mut points = Vec::new();
    for (variant, worker, frames) in draws {
        let camera = smaller(view, variant.divisor);
        workers[worker].1.draw(&camera, variant.settings, Some(&file.path()))?;
        points.push(Point {
            wall: median(frames.iter().map(|frame| frame.wall)),
            processor: median(frames.iter().filter_map(|frame| frame.processor)),
            error: reference.error(&file.read()?, [camera.width, camera.height]),
            variant,
            on_front: false,
        });
    }
    mark_front(&mut points);
    Ok(SceneResults { scene: workload.source.to_string(), workload, gaussians, points })
}

fn mark_front(points: &mut [Point]) {
    let places: Vec<[f64; 2]> = points.iter().map(|point| [point.cost(), point.error.rmse]).collect();
    for (point, on_front) in points.iter_mut().zip(front(&places)) {
        point.on_front = on_front;
    }
}

/// For each point, true if no other point is better in one coordinate without being worse in the other.
fn front(places: &[[f64; 2]]) -> Vec<bool> {
    let beats = |a: [f64; 2], b: [f64; 2]| a[0] <= b[0] && a[1] <= b[1] && a != b;
    places.iter().map(|&place| !places.iter().any(|&other| beats(other, place))).collect()
}

fn table(scene: &SceneResults) -> Rows {
    let mut rows = Rows::new(&["contender", "settings", "ms", "CPU ms", "RMSE", "PSNR", "max", "FLIP", "front"]);
    for point in &scene.points {
        rows.rows.push(vec![
            point.variant.contender.name().to_owned(),
            point.variant.name.clone(),
            number(point.wall),
            number(point.processor),
            number(point.error.rmse),
            number(point.error.psnr),
            number(point.error.max),
            number(point.error.flip),
            if point.on_front { "*" } else { "" }.to_owned(),
        ]);
    }
    rows
}

fn save(folder: &Path, results: &Results) -> Result<(), BenchError> {
    let mut rows = Rows::new(&[
        "scene",
        "gaussians",
        "width",
        "height",
        "contender",
        "settings",
        "threads",
        "wall_ms",
        "cpu_ms",
        "rmse",
        "psnr_db",
        "max",
        "p999",
        "flip",
        "on_front",
    ]);
    for scene in &results.scenes {
        for point in &scene.points {
            let error = point.error;
            let [width, height] = scene.workload.size;
            rows.rows.push(vec![
                scene.scene.clone(),
                scene.gaussians.to_string(),
                width.to_string(),
                height.to_string(),
                point.variant.contender.name().to_owned(),
                point.variant.name.clone(),
                results.threads.to_string(),
                format!("{:.3}", point.wall),
                format!("{:.3}", point.processor),
                format!("{:.3e}", error.rmse),
                format!("{:.2}", error.psnr),
                format!("{:.3e}", error.max),
                format!("{:.3e}", error.p999),
                format!("{:.3e}", error.flip),
                point.on_front.to_string(),
            ]);
        }
    }
    let line = results.machine.line();
    output::write(&folder.join("pareto.csv"), &rows.csv(&line))?;
    output::write_json(&folder.join("pareto.json"), results)?;
    let panels: Vec<Panel> = results.scenes.iter().map(panel).collect();
    plot::write(&folder.join("pareto"), &line, &panels)
}

fn panel(scene: &SceneResults) -> Panel {
    // A logarithmic axis has no zero, so equal pictures get a small error.
    let place = |point: &Point| [point.cost(), point.error.rmse.max(1e-9)];
    let series = CONTENDERS.iter().map(|&contender| Series {
        name: contender.name().to_owned(),
        points: scene.points.iter().filter(|point| point.variant.contender == contender).map(place).collect(),
        joined: false,
    });
    let mut front: Vec<[f64; 2]> = scene.points.iter().filter(|point| point.on_front).map(place).collect();
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Panel {
        title: scene.scene.clone(),
        axes: ["milliseconds of processor time a frame", "root mean square error"],
        series: series.collect(),
        front,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let places = [[1.0, 5.0], [2.0, 2.0], [3.0, 3.0], [4.0, 1.0], [4.0, 1.0], [2.0, 4.0]];
        assert_eq!(front(&places), [true, true, false, true, true, false]);
    }
}
