//! `gaurast-bench frames`: whole frames of every contender, drawn in turns.

use std::io::{Write, stdout};

use gaurast_render::Settings;
use gaurast_scene::camera::Camera;
use serde::Serialize;

use super::judge::{Error, Judge, PictureFile};
use super::machine::Machine;
use super::output::{self, Rows, mebibytes, number};
use super::roofline::{Roofline, evaluations};
use super::worker::{Contender, Drawn, Ready, Worker};
use crate::arguments::FramesArguments;
use crate::error::BenchError;
use crate::median::median;
use crate::worker::CONTENDERS;
use crate::workload::{Source, Workload};

/// The results of the benchmark.
#[derive(Serialize)]
struct Results {
    machine: Machine,
    roofline: Roofline,
    scenes: Vec<SceneResults>,
}

#[derive(Serialize)]
struct SceneResults {
    scene: String,
    workload: Workload,
    gaussians: usize,
    series: Vec<Series>,
}

/// The frames of one contender on one number of threads.
#[derive(Serialize)]
struct Series {
    contender: Contender,
    threads: usize,
    ready: Ready,
    /// The first frame, with everything cold.
    first: Drawn,
    frames: Vec<Drawn>,
    /// The greatest error of all judged frames.
    error: Option<Error>,
}

impl Series {
    fn wall(&self) -> f64 {
        median(self.frames.iter().map(|frame| frame.wall))
    }

    fn processor(&self) -> f64 {
        median(self.frames.iter().filter_map(|frame| frame.processor))
    }

    fn memory(&self) -> Option<u64> {
        self.frames.iter().filter_map(|frame| frame.memory).max()
    }
}

/// Runs the benchmark.
pub(super) fn run(arguments: &FramesArguments) -> Result<(), BenchError> {
    let machine = Machine::this();
    let roofline = Roofline::measure()?;
    let sources = if arguments.scenes.is_empty() {
        vec![Source::Benchmark { count: arguments.count }]
    } else {
        let files = arguments.scenes.iter();
        files.map(|path| Source::File { path: path.clone() }).collect()
    };
    let mut results = Results { machine, roofline, scenes: Vec::new() };
    for source in sources {
        let workload = Workload::new(source, arguments.size.0);
        results.scenes.push(measure(workload, arguments)?);
    }
    // The reader of standard output may have gone; the files are written all the same.
    let _ = show(&results);
    if let Some(path) = &arguments.csv {
        output::write(path, &csv(&results))?;
    }
    if let Some(path) = &arguments.json {
        output::write_json(path, &results)?;
    }
    Ok(())
}

fn measure(workload: Workload, arguments: &FramesArguments) -> Result<SceneResults, BenchError> {
    let runs = arguments.runs as usize;
    let (judge, views, gaussians) = {
        let scene = workload.scene()?;
        let views = workload.views(&scene, runs + 1)?;
        (Judge::new(&scene), views, scene.len())
    };
    let mut series = Vec::new();
    for &threads in &arguments.threads {
        let mut contestants = start(&workload, threads, &views[0])?;
        // Contenders take turns, so that other load on the machine affects all of them equally.
        for view in &views[1..] {
            for (worker, series) in &mut contestants {
                let drawn = worker.draw(view, Settings::default(), None)?;
                series.frames.push(drawn);
            }
        }
        series.extend(judged(contestants, &judge, &views[1..], arguments.judged)?);
    }
    Ok(SceneResults { scene: workload.source.to_string(), workload, gaussians, series })
}

/// Starts every contender that is available, and draws its first frame.
fn start(workload: &Workload, threads: usize, view: &Camera) -> Result<Vec<(Worker, Series)>, BenchError> {
    let mut contestants = Vec::new();
    for contender in CONTENDERS {
        let Some(mut worker) = Worker::start(contender, workload, threads)? else {
            eprintln!("left out: {} (not installed)", contender.name());
            continue;
        };
        let series = Series {
            contender,
            threads,
            ready: worker.ready.clone(),
            first: worker.draw(view, Settings::default(), None)?,
            frames: Vec::new(),
            error: None,
        };
        contestants.push((worker, series));
    }
    Ok(contestants)
}

/// Compares `count` frames of each contestant, spread over the path, with the oracle.
fn judged(
    mut contestants: Vec<(Worker, Series)>,
    judge: &Judge,
    views: &[Camera],
    count: u32,
) -> Result<Vec<Series>, BenchError> {
    let file = PictureFile::new()?;
    let count = (count as usize).min(views.len());
    for judged in 0..count {
        let view = &views[judged * views.len() / count];
        let reference = judge.reference(view)?;
        for (worker, series) in &mut contestants {
            worker.draw(view, Settings::default(), Some(&file.path()))?;
            let error = reference.error(&file.read()?, [view.width, view.height]);
            series.error = Some(series.error.map_or(error, |worst| worst.worst(error)));
        }
    }
    Ok(contestants.into_iter().map(|(_, series)| series).collect())
}

fn show(results: &Results) -> std::io::Result<()> {
    let mut out = stdout().lock();
    writeln!(out, "{}", results.machine.line())?;
    writeln!(
        out,
        "one thread: tile kernel in L1 {:.1} M pairs/s (one block each), {:.0} M pixel evaluations/s; {:.1} GFLOP/s fused",
        results.roofline.pairs * 1e-6,
        results.roofline.pixels * 1e-6,
        results.roofline.operations * 1e-9
    )?;
    for scene in &results.scenes {
        let [width, height] = scene.workload.size;
        writeln!(out, "\n{}: {} Gaussians, {width}x{height}; medians, ms", scene.scene, scene.gaussians)?;
        writeln!(out, "{}", summary(scene).table())?;
        writeln!(out, "{}", stages(scene).table())?;
        writeln!(out, "{}", rasterization(scene, results.roofline).table())?;
    }
    Ok(())
}

fn summary(scene: &SceneResults) -> Rows {
    let mut rows = Rows::new(&[
        "contender",
        "threads",
        "frame",
        "ratio",
        "CPU",
        "CPU ratio",
        "first",
        "max error",
        "p99.9",
        "PSNR",
        "FLIP",
        "peak MiB",
    ]);
    for series in &scene.series {
        // Relative to this driver's Gaussians on the same number of threads.
        let own =
            scene.series.iter().find(|other| other.threads == series.threads && other.contender == Contender::Gaurast);
        let ratio = |figure: &dyn Fn(&Series) -> f64| own.map_or(f64::NAN, |own| figure(series) / figure(own));
        let error = |figure: &dyn Fn(&Error) -> f64| {
            series.error.as_ref().map_or("-".to_owned(), |error| number(figure(error)))
        };
        rows.rows.push(vec![
            series.contender.name().to_owned(),
            series.threads.to_string(),
            number(series.wall()),
            number(ratio(&Series::wall)),
            number(series.processor()),
            number(ratio(&Series::processor)),
            number(series.first.wall),
            error(&|error| error.max),
            error(&|error| error.p999),
            error(&|error| error.psnr),
            error(&|error| error.flip),
            mebibytes(series.memory()),
        ]);
    }
    rows
}

/// The times of the stages of a frame.
fn stages(scene: &SceneResults) -> Rows {
    let mut rows = Rows::new(&["contender", "threads", "stage", "ms"]);
    for series in &scene.series {
        let Some(last) = series.frames.last() else {
            continue;
        };
        for stage in &last.stages {
            rows.rows.push(vec![
                series.contender.name().to_owned(),
                series.threads.to_string(),
                stage.clone(),
                number(median(series.frames.iter().map(|frame| frame.counter(stage)))),
            ]);
        }
    }
    rows
}

/// The work of this driver's rasterization: evaluations of a Gaussian at a pixel, those that contribute (useful),
/// evaluations per second, and the share of the roofline that this is.
fn rasterization(scene: &SceneResults, roofline: Roofline) -> Rows {
    let mut rows = Rows::new(&[
        "threads",
        "tile pairs M",
        "evaluated M",
        "useful M",
        "useful M/s",
        "evaluated/useful",
        "of L1 roof",
        "of FMA peak",
    ]);
    let own = (scene.series.iter()).filter(|series| series.contender == Contender::Gaurast);
    for series in own {
        let of = |figure: &dyn Fn(&Drawn) -> f64| median(series.frames.iter().map(figure));
        let useful = |frame: &Drawn| frame.counter("pixel contributions");
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        rows.rows.push(vec![
            series.threads.to_string(),
            number(of(&|frame| frame.counter("tile pairs evaluated") * 1e-6)),
            number(of(&|frame| evaluations(frame) * 1e-6)),
            number(of(&|frame| useful(frame) * 1e-6)),
            number(of(&|frame| useful(frame) * 1e-3 / frame.counter("raster"))),
            number(of(&|frame| evaluations(frame) / useful(frame))),
            percent(of(&|frame| roofline.share(frame, series.threads))),
            percent(of(&|frame| roofline.share_of_operations(frame, series.threads))),
        ]);
    }
    rows
}

fn csv(results: &Results) -> String {
    let mut rows =
        Rows::new(&["scene", "gaussians", "width", "height", "contender", "threads", "frame", "wall_ms", "cpu_ms"]);
    for scene in &results.scenes {
        for series in &scene.series {
            let frames = std::iter::once(&series.first).chain(&series.frames);
            for (index, frame) in frames.enumerate() {
                rows.rows.push(vec![
                    scene.scene.clone(),
                    scene.gaussians.to_string(),
                    scene.workload.size[0].to_string(),
                    scene.workload.size[1].to_string(),
                    series.contender.name().to_owned(),
                    series.threads.to_string(),
                    index.to_string(),
                    format!("{:.3}", frame.wall),
                    frame.processor.map_or(String::new(), |time| format!("{time:.3}")),
                ]);
            }
        }
    }
    rows.csv(&format!("{}; frame 0 is cold", results.machine.line()))
}
