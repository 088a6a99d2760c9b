//! `gaurast-bench optimizations`: the time that each optimization saves, and the cost of Gaussians that are not
//! visible.

mod instructions;
mod path;

use std::io::{Write, stdout};

use serde::Serialize;

use self::path::DRAWS;
use super::machine::Machine;
use super::output::{self, Rows, number};
use super::pair::{Draws, Pair, time};
use super::worker::OPTIMIZATIONS;
use crate::arguments::OptimizationsArguments;
use crate::error::BenchError;
use crate::workload::{Extra, Source, Workload};
use path::{Path, TEMPORAL_REUSE, settings};

/// Optimizations of Gaussian draws, and the device's counter of each.
const COUNTERS: [(&str, &str); 9] = [
    ("cluster-culling", "outside by clusters"),
    ("occlusion-culling", "hidden by others"),
    ("bounds", "outside by bounds"),
    ("ellipse", "tiles beside ellipse"),
    ("harmonics", "harmonics unread"),
    ("blocks", "blocks beside ellipse"),
    ("early-termination", "blocks saturated"),
    ("empty-tiles", "tiles untouched"),
    (TEMPORAL_REUSE, "sets unchanged"),
];

/// The pictures' size.
const SIZE: [u32; 2] = [1280, 720];

#[derive(Serialize)]
struct Results {
    machine: Machine,
    threads: usize,
    runs: usize,
    /// Each optimization in each scene.
    optimizations: Vec<Saved>,
    unseen: Vec<Unseen>,
}

/// The saving of an optimization.
#[derive(Serialize)]
struct Saved {
    scene: String,
    optimization: &'static str,
    /// The value of its counter in a frame.
    counter: f64,
    /// Milliseconds of a frame with all optimizations within a frame. Of the optimizations between frames, only this
    /// one is on.
    with: f64,
    /// Milliseconds of a frame in which this one is off, too.
    without: f64,
    /// The saving in percent of `without`: lower quartile over the views, median and upper quartile.
    share: [f64; 3],
}

/// The cost of Gaussians that are not visible.
#[derive(Serialize)]
struct Unseen {
    kind: &'static str,
    /// The number of these Gaussians.
    count: usize,
    /// Milliseconds of a frame with them, and without.
    with: f64,
    without: f64,
    /// Nanoseconds of each in a frame: lower quartile over the views, median and upper quartile.
    each: [f64; 3],
    /// The part of `each` in preprocessing, which varies less than a whole frame.
    to_preprocess: [f64; 3],
    /// Milliseconds to build chunks, which happens once.
    chunks: f64,
}

/// The ratio of Gaussians that are not visible to the others. It is large because the cost of one is far below the
/// variation of a frame's time.
const UNSEEN_PER_SEEN: usize = 10;

/// The factor by which this measurement has more views than the measurement of an optimization.
const UNSEEN_VIEWS_PER_RUN: usize = 2;

/// Runs the comparison.
pub(super) fn run(arguments: &OptimizationsArguments) -> Result<(), BenchError> {
    if arguments.instructions {
        return instructions::run(arguments);
    }
    let arguments = &arguments.sweep;
    let runs = arguments.runs.unwrap_or(if arguments.quick { 3 } else { 9 }) as usize;
    let count = if arguments.quick { 100_000 } else { 300_000 };
    let mut results = Results {
        machine: Machine::this(),
        threads: arguments.threads,
        runs,
        optimizations: Vec::new(),
        unseen: Vec::new(),
    };
    let base = Workload::new(Source::Benchmark { count }, SIZE);
    let with = |extra| Workload { extra: Some(extra), ..base.clone() };
    let wall = Workload::new(Source::Wall, SIZE);
    let behind = |count| Workload { extra: Some(Extra::Behind { count }), ..wall.clone() };
    let plain = Workload { plain: true, ..base.clone() };
    let scenes = [
        (base.source.to_string(), base.clone()),
        (format!("{}, plain colours", base.source), plain),
        (format!("{}, as many beside the screen", base.source), with(Extra::Beside { count })),
        (format!("{count} behind a wall"), behind(count)),
    ];
    for (name, workload) in scenes {
        results.optimizations.extend(saved(&name, &workload, arguments.threads, runs)?);
    }
    let name = format!("{}, still camera", base.source);
    let saved = saved_by(TEMPORAL_REUSE, &name, &base, arguments.threads, runs)?;
    results.optimizations.push(saved);
    let (count, runs) = (UNSEEN_PER_SEEN * count, UNSEEN_VIEWS_PER_RUN * runs);
    let beside = with(Extra::Beside { count });
    let pairs = [("off the screen", beside, base), ("behind a wall", behind(count), wall.clone())];
    for (kind, with, without) in pairs {
        let unseen = unseen(kind, count, [&with, &without], arguments.threads, runs)?;
        results.unseen.push(unseen);
    }
    let line = results.machine.line();
    let _ = writeln!(stdout(), "{line}\n{}\n{}", optimization_rows(&results).table(), unseen_rows(&results).table());
    let folder = &arguments.output;
    let about = |views: usize| {
        let threads = results.threads;
        format!("{line}; {threads} threads, medians of {views} views; processor time")
    };
    let optimizations = optimization_rows(&results).csv(&about(results.runs));
    output::write(&folder.join("optimizations.csv"), &optimizations)?;
    let unseen = unseen_rows(&results).csv(&about(runs));
    output::write(&folder.join("unseen.csv"), &unseen)?;
    output::write_json(&folder.join("optimizations.json"), &results)
}

/// The saving of each optimization while the camera moves.
fn saved(scene: &str, workload: &Workload, threads: usize, runs: usize) -> Result<Vec<Saved>, BenchError> {
    let names = COUNTERS.iter().map(|(name, _)| *name);
    names
        .filter(|&name| Path::of(name) == Path::Own)
        .map(|name| saved_by(name, scene, workload, threads, runs))
        .collect()
}

/// The saving of an optimization, on the path that shows it.
fn saved_by(
    optimization: &'static str,
    scene: &str,
    workload: &Workload,
    threads: usize,
    runs: usize,
) -> Result<Saved, BenchError> {
    let counter = COUNTERS.iter().find(|(name, _)| *name == optimization);
    let counter = counter.map_or("", |(_, counter)| *counter);
    let path = Path::of(optimization);
    let [with, without] = settings(optimization);
    let setups = [(workload, &*with), (workload, &*without)];
    let pair = Pair::draw(setups, threads, &path.views(workload, runs + 1)?, path.draws())?;
    let [with, without] = pair.medians(time);
    let [counted, _] = pair.medians(|frame| frame.counter(counter));
    Ok(Saved {
        scene: scene.to_owned(),
        optimization,
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
    let setups = workloads.map(|workload| (workload, OPTIMIZATIONS));
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
        chunks: pair.most(|frame| frame.counter("clusters")),
    })
}

fn middle([_, median, _]: [f64; 3]) -> String {
    format!("{median:.2}")
}

fn spread([lower, _, upper]: [f64; 3]) -> String {
    format!("{lower:.2} to {upper:.2}")
}

fn optimization_rows(results: &Results) -> Rows {
    let mut rows = Rows::new(&["scene", "optimization", "counted", "ms with", "ms without", "saved %", "quartiles"]);
    for saved in &results.optimizations {
        rows.rows.push(vec![
            saved.scene.clone(),
            saved.optimization.to_owned(),
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
