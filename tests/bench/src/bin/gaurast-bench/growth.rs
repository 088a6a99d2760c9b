//! `gaurast-bench growth`: the growth of time and memory with the size of the input.

use std::io::{Write, stdout};
use std::path::Path;

use gaurast_render::Settings;
use serde::Serialize;

use super::machine::Machine;
use super::output::{self, Rows, mebibytes, number};
use super::plot::{self, Panel, Series};
use super::worker::{Contender, Worker};
use crate::arguments::SweepArguments;
use crate::error::BenchError;
use crate::median::median;
use crate::worker::CONTENDERS;
use crate::workload::{Source, Workload};

/// The number of Gaussians, unless they are the axis.
const COUNT: usize = 100_000;

/// The pictures' size, unless it is the axis.
const SIZE: [u32; 2] = [1280, 720];

/// A measurement in which one quantity grows and all others are constant.
#[derive(Serialize)]
struct Axis {
    name: &'static str,
    steps: Vec<Step>,
    fits: Vec<Fit>,
}

/// The cost of one amount.
#[derive(Serialize)]
struct Step {
    amount: f64,
    contender: Contender,
    wall: f64,
    processor: f64,
    memory: Option<u64>,
}

/// Exponents of the growth of time and memory with the amount, by least squares of logarithms.
#[derive(Serialize)]
struct Fit {
    contender: Contender,
    time: f64,
    memory: f64,
}

#[derive(Serialize)]
struct Results {
    machine: Machine,
    threads: usize,
    axes: Vec<Axis>,
}

/// Runs the sweep.
pub(super) fn run(arguments: &SweepArguments) -> Result<(), BenchError> {
    let mut results = Results { machine: Machine::this(), threads: arguments.threads, axes: Vec::new() };
    let runs = arguments.runs.unwrap_or(if arguments.quick { 3 } else { 9 });
    let _ = writeln!(stdout(), "{}", results.machine.line());
    for (name, amounts) in axes(arguments.quick) {
        let axis = measure(name, amounts, arguments.threads, runs as usize)?;
        let _ = writeln!(stdout(), "\n{name}\n{}\n{}", steps(&axis).table(), fits(&axis).table());
        results.axes.push(axis);
        save(&arguments.output, &results)?;
    }
    Ok(())
}

/// The axes by name, each with its amounts and the workload of each amount.
fn axes(quick: bool) -> Vec<(&'static str, Vec<(f64, Workload)>)> {
    let base = |count: usize, size| Workload::new(Source::Benchmark { count }, size);
    let counts: &[usize] = if quick {
        &[10_000, 30_000, 100_000, 300_000]
    } else {
        &[10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000]
    };
    let widths: &[u32] = if quick { &[320, 640, 1280, 1920] } else { &[320, 640, 1280, 1920, 3840] };
    let of_scale = |scale: f32| Workload { scale, ..base(COUNT, SIZE) };
    let of_share = |share: f64| Workload { away: 1.0 - share, ..base(COUNT, SIZE) };
    vec![
        ("Gaussians", counts.iter().map(|&count| (count as f64, base(count, SIZE))).collect()),
        (
            "pixels",
            widths
                .iter()
                .map(|&width| {
                    let size = [width, width * 9 / 16];
                    (f64::from(size[0] * size[1]), base(COUNT, size))
                })
                .collect(),
        ),
        (
            "overlap (area of each Gaussian, relative)",
            [1.0, 2.0, 4.0, 8.0].map(|scale: f32| (f64::from(scale * scale), of_scale(scale))).into(),
        ),
        (
            "share of Gaussians not moved off the screen",
            [0.1, 0.25, 0.5, 1.0].map(|share| (share, of_share(share))).into(),
        ),
    ]
}

fn measure(name: &'static str, amounts: Vec<(f64, Workload)>, threads: usize, runs: usize) -> Result<Axis, BenchError> {
    let mut steps = Vec::new();
    for (amount, workload) in amounts {
        let views = workload.views(&workload.scene()?, runs + 1)?;
        let mut workers = Vec::new();
        for contender in [Contender::Gaurast, Contender::QuadsOnLavapipe] {
            if let Some(worker) = Worker::start(contender, &workload, threads)? {
                workers.push((contender, worker, Vec::new()));
            }
        }
        for (index, view) in views.iter().enumerate() {
            for (_, worker, frames) in &mut workers {
                let drawn = worker.draw(view, Settings::default(), None)?;
                if index > 0 {
                    frames.push(drawn);
                }
            }
        }
        for (contender, _, frames) in workers {
            steps.push(Step {
                amount,
                contender,
                wall: median(frames.iter().map(|frame| frame.wall)),
                processor: median(frames.iter().filter_map(|frame| frame.processor)),
                memory: frames.iter().filter_map(|frame| frame.memory).max(),
            });
        }
    }
    let fits = CONTENDERS
        .iter()
        .filter(|contender| steps.iter().any(|step| step.contender == **contender))
        .map(|&contender| {
            let of = |value: &dyn Fn(&Step) -> f64| {
                let own = steps.iter().filter(|step| step.contender == contender);
                exponent(&own.map(|step| [step.amount, value(step)]).collect::<Vec<_>>())
            };
            Fit {
                contender,
                time: of(&|step| step.wall),
                memory: of(&|step| step.memory.map_or(f64::NAN, |bytes| bytes as f64)),
            }
        })
        .collect();
    Ok(Axis { name, steps, fits })
}

/// The exponent of x in the growth of y.
fn exponent(points: &[[f64; 2]]) -> f64 {
    let count = points.len() as f64;
    let logs = || points.iter().map(|point| point.map(f64::ln));
    let mean = |axis: usize| logs().map(|point| point[axis]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let (mut xx, mut xy) = (0.0, 0.0);
    for point in logs() {
        xx += (point[0] - x).powi(2);
        xy += (point[0] - x) * (point[1] - y);
    }
    xy / xx
}

fn steps(axis: &Axis) -> Rows {
    let mut rows = Rows::new(&["amount", "contender", "ms", "CPU ms", "peak MiB"]);
    for step in &axis.steps {
        rows.rows.push(vec![
            number(step.amount),
            step.contender.name().to_owned(),
            number(step.wall),
            number(step.processor),
            mebibytes(step.memory),
        ]);
    }
    rows
}

fn fits(axis: &Axis) -> Rows {
    let mut rows = Rows::new(&["contender", "exponent of time", "exponent of memory"]);
    for fit in &axis.fits {
        rows.rows.push(vec![fit.contender.name().to_owned(), format!("{:.2}", fit.time), format!("{:.2}", fit.memory)]);
    }
    rows
}

fn save(folder: &Path, results: &Results) -> Result<(), BenchError> {
    let mut rows = Rows::new(&["axis", "amount", "contender", "threads", "wall_ms", "cpu_ms", "peak_bytes"]);
    for axis in &results.axes {
        for step in &axis.steps {
            rows.rows.push(vec![
                axis.name.to_owned(),
                step.amount.to_string(),
                step.contender.name().to_owned(),
                results.threads.to_string(),
                format!("{:.3}", step.wall),
                format!("{:.3}", step.processor),
                step.memory.map_or(String::new(), |bytes| bytes.to_string()),
            ]);
        }
    }
    let line = results.machine.line();
    output::write(&folder.join("growth.csv"), &rows.csv(&line))?;
    output::write_json(&folder.join("growth.json"), results)?;
    let panels: Vec<Panel> = results.axes.iter().map(panel).collect();
    plot::write(&folder.join("growth"), &line, &panels)
}

fn panel(axis: &Axis) -> Panel {
    let series = axis.fits.iter().map(|fit| Series {
        name: format!("{}, exponent {:.2}", fit.contender.name(), fit.time),
        points: axis
            .steps
            .iter()
            .filter(|step| step.contender == fit.contender)
            .map(|step| [step.amount, step.wall])
            .collect(),
        joined: true,
    });
    Panel {
        title: axis.name.to_owned(),
        axes: [axis.name, "milliseconds a frame"],
        series: series.collect(),
        front: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_of_powers() {
        let points = [1.0, 2.0, 5.0, 9.0_f64].map(|x| [x, 3.0 * x.powf(1.25)]);
        assert!((exponent(&points) - 1.25).abs() < 1e-12);
    }
}
