//! `gaurast bench skips`: what each skip saves, and what Gaussians cost that nobody sees.

use std::io::{Write, stdout};

use gaurast_samples::camera::Camera;
use gaurast_samples::renderer::Settings;
use serde::Serialize;

use super::machine::Machine;
use super::output::{self, Rows, number};
use super::worker::{Contender, Drawn, SKIPS, Worker};
use super::{BenchError, Extra, Source, SweepArguments, Workload, median};

/// Skips of Gaussian draws, and the counter of each, as the device has them.
const COUNTERS: [(&str, &str); 11] = [
    ("chunks", "outside by chunks"),
    ("hidden-chunks", "hidden by others"),
    ("bounds", "outside by bounds"),
    ("ellipse", "tiles beside ellipse"),
    ("harmonics", "harmonics unread"),
    ("bands", "bands of zeros"),
    ("blocks", "blocks beside ellipse"),
    ("saturated", "blocks saturated"),
    ("empty-tiles", "tiles untouched"),
    (UNCHANGED, "sets unchanged"),
    (LAST_ORDER, "orders repaired"),
];

/// What only a still camera shows.
const UNCHANGED: &str = "unchanged";

/// What only a camera shows that does not turn.
const LAST_ORDER: &str = "last-order";

/// How a camera goes from frame to frame.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Path {
    /// As the workload says, which is far enough for nothing of the last frame to help.
    Own,
    Still,
    /// A hundredth of its distance from the origin to its right.
    Sliding,
}

impl Path {
    /// The one that shows a skip.
    fn of(skip: &str) -> Self {
        match skip {
            UNCHANGED => Self::Still,
            LAST_ORDER => Self::Sliding,
            _ => Self::Own,
        }
    }

    /// The view of a frame, of a workload's.
    fn view(self, views: &[Camera], frame: usize) -> Camera {
        let mut view = views[if self == Self::Own { frame } else { 0 }].clone();
        if self == Self::Sliding {
            let distance = view.eye.iter().map(|part| part * part).sum::<f64>().sqrt();
            for (eye, right) in view.eye.iter_mut().zip(view.rotation[0]) {
                *eye += 0.01 * distance * frame as f64 * right;
            }
        }
        view
    }
}

/// The pictures' size.
const SIZE: [u32; 2] = [1280, 720];

#[derive(Serialize)]
struct Results {
    machine: Machine,
    threads: usize,
    runs: usize,
    /// Each skip in each scene.
    skips: Vec<Saved>,
    unseen: Vec<Unseen>,
}

/// What a skip saves.
#[derive(Serialize)]
struct Saved {
    scene: String,
    skip: &'static str,
    /// What its counter says of a frame.
    counter: f64,
    /// Milliseconds of a frame with all skips, but those from frame to frame, of which this one alone is on.
    with: f64,
    /// Milliseconds of a frame with this one off, too.
    without: f64,
}

/// What Gaussians cost that nobody sees.
#[derive(Serialize)]
struct Unseen {
    kind: &'static str,
    /// How many.
    count: usize,
    /// Milliseconds of a frame with them, and without.
    with: f64,
    without: f64,
    /// Milliseconds to build chunks, once.
    chunks: f64,
}

impl Unseen {
    /// Nanoseconds of each in a frame.
    fn each(&self) -> f64 {
        (self.with - self.without) * 1e6 / self.count as f64
    }
}

/// Runs the comparison.
pub(super) fn run(arguments: &SweepArguments) -> Result<(), BenchError> {
    let runs = arguments
        .runs
        .unwrap_or(if arguments.quick { 3 } else { 9 }) as usize;
    let count = if arguments.quick { 100_000 } else { 300_000 };
    let mut results = Results {
        machine: Machine::this(),
        threads: arguments.threads,
        runs,
        skips: Vec::new(),
        unseen: Vec::new(),
    };
    let base = Workload::new(Source::Benchmark { count }, SIZE);
    let with = |extra| Workload {
        extra: Some(extra),
        ..base.clone()
    };
    let wall = Workload::new(Source::Wall, SIZE);
    let hidden = Workload {
        extra: Some(Extra::Behind { count }),
        ..wall.clone()
    };
    let plain = Workload {
        plain: true,
        ..base.clone()
    };
    let scenes = [
        (base.source.to_string(), base.clone()),
        (format!("{}, plain colours", base.source), plain),
        (
            format!("{}, as many beside the screen", base.source),
            with(Extra::Beside),
        ),
        (format!("{count} behind a wall"), hidden.clone()),
    ];
    for (name, workload) in scenes {
        results
            .skips
            .extend(saved(&name, &workload, arguments.threads, runs)?);
    }
    for (skip, camera) in [(UNCHANGED, "still"), (LAST_ORDER, "sliding")] {
        let name = format!("{}, {camera} camera", base.source);
        let saved = saved_by(skip, &name, &base, arguments.threads, runs)?;
        results.skips.push(saved);
    }
    let pairs = [
        ("off the screen", with(Extra::Beside), base),
        ("behind a wall", hidden, wall),
    ];
    for (kind, with, without) in pairs {
        let unseen = unseen(kind, count, [&with, &without], arguments.threads, runs)?;
        results.unseen.push(unseen);
    }
    let line = results.machine.line();
    let _ = writeln!(
        stdout(),
        "{line}\n{}\n{}",
        skip_rows(&results).table(),
        unseen_rows(&results).table()
    );
    let folder = &arguments.output;
    let about = format!(
        "{line}; {} threads, medians of {} frames; processor time",
        results.threads, results.runs
    );
    output::write(&folder.join("skips.csv"), &skip_rows(&results).csv(&about))?;
    output::write(
        &folder.join("unseen.csv"),
        &unseen_rows(&results).csv(&about),
    )?;
    output::write_json(&folder.join("skips.json"), &results)
}

/// Frames of workers that take turns; the first, cold frame of each comes first.
fn frames(
    workers: &mut [(Workload, Worker)],
    runs: usize,
    path: Path,
) -> Result<Vec<Vec<Drawn>>, BenchError> {
    let mut frames: Vec<Vec<Drawn>> = workers.iter().map(|_| Vec::new()).collect();
    let mut views = Vec::new();
    for (workload, _) in workers.iter() {
        views.push(workload.views(&workload.scene()?, runs + 1)?);
    }
    for run in 0..=runs {
        let of_workers = workers.iter_mut().zip(&views).zip(&mut frames);
        for (((_, worker), views), frames) in of_workers {
            let view = path.view(views, run);
            frames.push(match path {
                Path::Own => worker.draw(&view, Settings::default(), None)?,
                Path::Still | Path::Sliding => worker.draw_next(&view)?,
            });
        }
    }
    Ok(frames)
}

fn start(
    workload: &Workload,
    threads: usize,
    skips: &str,
) -> Result<(Workload, Worker), BenchError> {
    let worker = Worker::with_skips(Contender::Gaurast, workload, threads, skips)?;
    let worker = worker.ok_or_else(|| BenchError::Worker("this driver is not there".to_owned()))?;
    Ok((workload.clone(), worker))
}

/// Processor time of a warm frame, or its wall time where the system does not tell.
fn time(frames: &[Drawn]) -> f64 {
    let warm = frames.iter().skip(1);
    median(warm.map(|frame| frame.processor.unwrap_or(frame.wall)))
}

/// What each skip saves while the camera moves.
fn saved(
    scene: &str,
    workload: &Workload,
    threads: usize,
    runs: usize,
) -> Result<Vec<Saved>, BenchError> {
    let names = COUNTERS.iter().map(|(name, _)| *name);
    names
        .filter(|&name| Path::of(name) == Path::Own)
        .map(|name| saved_by(name, scene, workload, threads, runs))
        .collect()
}

/// What a skip saves, on the path that shows it.
fn saved_by(
    skip: &'static str,
    scene: &str,
    workload: &Workload,
    threads: usize,
    runs: usize,
) -> Result<Saved, BenchError> {
    let counter = COUNTERS.iter().find(|(name, _)| *name == skip);
    let counter = counter.map_or("", |(_, counter)| *counter);
    let path = Path::of(skip);
    // What saves from frame to frame is on alone, where that is asked for: it would hide what others save.
    let [with, without] = match path {
        Path::Own => [SKIPS.to_owned(), format!("{SKIPS},-{skip}")],
        Path::Still | Path::Sliding => [SKIPS.replace(&format!(",-{skip}"), ""), SKIPS.to_owned()],
    };
    let mut workers = [
        start(workload, threads, &with)?,
        start(workload, threads, &without)?,
    ];
    let frames = frames(&mut workers, runs, path)?;
    Ok(Saved {
        scene: scene.to_owned(),
        skip,
        counter: median(frames[0][1..].iter().map(|frame| frame.counter(counter))),
        with: time(&frames[0]),
        without: time(&frames[1]),
    })
}

fn unseen(
    kind: &'static str,
    count: usize,
    workloads: [&Workload; 2],
    threads: usize,
    runs: usize,
) -> Result<Unseen, BenchError> {
    let [with, without] = workloads;
    let mut workers = [
        start(with, threads, SKIPS)?,
        start(without, threads, SKIPS)?,
    ];
    let frames = frames(&mut workers, runs, Path::Own)?;
    let chunks = frames[0].iter().map(|frame| frame.counter("chunks"));
    Ok(Unseen {
        kind,
        count,
        with: time(&frames[0]),
        without: time(&frames[1]),
        chunks: chunks.fold(0.0, f64::max),
    })
}

fn skip_rows(results: &Results) -> Rows {
    let mut rows = Rows::new(&[
        "scene",
        "skip",
        "counted",
        "ms with",
        "ms without",
        "saved %",
    ]);
    for saved in &results.skips {
        rows.rows.push(vec![
            saved.scene.clone(),
            saved.skip.to_owned(),
            number(saved.counter),
            number(saved.with),
            number(saved.without),
            format!("{:.1}", 100.0 * (1.0 - saved.with / saved.without)),
        ]);
    }
    rows
}

fn unseen_rows(results: &Results) -> Rows {
    let mut rows = Rows::new(&[
        "Gaussians",
        "count",
        "ms with",
        "ms without",
        "ns each",
        "ms for chunks, once",
    ]);
    for unseen in &results.unseen {
        rows.rows.push(vec![
            unseen.kind.to_owned(),
            unseen.count.to_string(),
            number(unseen.with),
            number(unseen.without),
            number(unseen.each()),
            number(unseen.chunks),
        ]);
    }
    rows
}
