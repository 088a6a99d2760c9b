//! `gaurast-bench skips`: what each skip saves, and what Gaussians cost that nobody sees.

use std::io::{Write, stdout};

use gaurast_scene::camera::Camera;
use serde::Serialize;

use super::machine::Machine;
use super::output::{self, Rows, number};
use super::pair::{Draws, Pair, time};
use super::worker::SKIPS;
use super::{BenchError, Extra, Source, SweepArguments, Workload};

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

    /// The views of so many frames.
    fn views(self, workload: &Workload, frames: usize) -> Result<Vec<Camera>, BenchError> {
        let own = workload.views(&workload.scene()?, frames)?;
        let view = |frame: usize| {
            let mut view = own[if self == Self::Own { frame } else { 0 }].clone();
            if self == Self::Sliding {
                let distance = view.eye.iter().map(|part| part * part).sum::<f64>().sqrt();
                for (eye, right) in view.eye.iter_mut().zip(view.rotation[0]) {
                    *eye += 0.01 * distance * frame as f64 * right;
                }
            }
            view
        };
        Ok((0..frames).map(view).collect())
    }

    /// How its views are drawn.
    fn draws(self) -> Draws {
        match self {
            Self::Own => Draws::Again(DRAWS),
            Self::Still | Self::Sliding => Draws::Once,
        }
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
    /// Percent of the latter that it saves: the lower quartile of views, the median and the upper quartile.
    share: [f64; 3],
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
    /// Nanoseconds of each in a frame: the lower quartile of views, the median and the upper quartile.
    each: [f64; 3],
    /// Of these, what preprocessing takes, which varies less than a frame.
    to_preprocess: [f64; 3],
    /// Milliseconds to build chunks, once.
    chunks: f64,
}

/// How many times as many Gaussians are unseen as there are in the scene: what one costs is far less than what a frame's time
/// varies by.
const UNSEEN_PER_SEEN: usize = 10;

/// How many times as many views their cost is found from as what a skip saves.
const UNSEEN_VIEWS_PER_RUN: usize = 2;

/// How often a view is drawn, if that changes nothing.
const DRAWS: usize = 3;

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
    let behind = |count| Workload {
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
            with(Extra::Beside { count }),
        ),
        (format!("{count} behind a wall"), behind(count)),
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
    let (count, runs) = (UNSEEN_PER_SEEN * count, UNSEEN_VIEWS_PER_RUN * runs);
    let beside = with(Extra::Beside { count });
    let pairs = [
        ("off the screen", beside, base),
        ("behind a wall", behind(count), wall.clone()),
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
    let about = |views: usize| {
        let threads = results.threads;
        format!("{line}; {threads} threads, medians of {views} views; processor time")
    };
    let skips = skip_rows(&results).csv(&about(results.runs));
    output::write(&folder.join("skips.csv"), &skips)?;
    let unseen = unseen_rows(&results).csv(&about(runs));
    output::write(&folder.join("unseen.csv"), &unseen)?;
    output::write_json(&folder.join("skips.json"), &results)
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
    let setups = [(workload, &*with), (workload, &*without)];
    let pair = Pair::draw(
        setups,
        threads,
        &path.views(workload, runs + 1)?,
        path.draws(),
    )?;
    let [with, without] = pair.medians(time);
    let [counted, _] = pair.medians(|frame| frame.counter(counter));
    Ok(Saved {
        scene: scene.to_owned(),
        skip,
        counter: counted,
        with,
        without,
        share: pair.quartiles(time, |with, without| 100.0 * (1.0 - with / without)),
    })
}

fn unseen(
    kind: &'static str,
    count: usize,
    workloads: [&Workload; 2],
    threads: usize,
    runs: usize,
) -> Result<Unseen, BenchError> {
    let views = Path::Own.views(workloads[1], runs + 1)?;
    let setups = workloads.map(|workload| (workload, SKIPS));
    let pair = Pair::draw(setups, threads, &views, Draws::Again(DRAWS))?;
    let each = |with: f64, without: f64| (with - without) * 1e6 / count as f64;
    let [with, without] = pair.medians(time);
    Ok(Unseen {
        kind,
        count,
        with,
        without,
        each: pair.quartiles(time, each),
        to_preprocess: pair.quartiles(|frame| frame.counter("preprocess"), each),
        chunks: pair.most(|frame| frame.counter("chunks")),
    })
}

fn middle([_, median, _]: [f64; 3]) -> String {
    format!("{median:.2}")
}

fn spread([lower, _, upper]: [f64; 3]) -> String {
    format!("{lower:.2} to {upper:.2}")
}

fn skip_rows(results: &Results) -> Rows {
    let mut rows = Rows::new(&[
        "scene",
        "skip",
        "counted",
        "ms with",
        "ms without",
        "saved %",
        "quartiles",
    ]);
    for saved in &results.skips {
        rows.rows.push(vec![
            saved.scene.clone(),
            saved.skip.to_owned(),
            number(saved.counter),
            number(saved.with),
            number(saved.without),
            middle(saved.share),
            spread(saved.share),
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
        "quartiles",
        "to preprocess",
        "their quartiles",
        "ms for chunks, once",
    ]);
    for unseen in &results.unseen {
        rows.rows.push(vec![
            unseen.kind.to_owned(),
            unseen.count.to_string(),
            number(unseen.with),
            number(unseen.without),
            middle(unseen.each),
            spread(unseen.each),
            middle(unseen.to_preprocess),
            spread(unseen.to_preprocess),
            number(unseen.chunks),
        ]);
    }
    rows
}
