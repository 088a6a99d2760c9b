//! `gaurast-bench path`: a viewer's frames. The first frames of a scene, the slowest frame of a camera that moves a little
//! from frame to frame, and the parts of a cold picture.

use std::io::{Write, stdout};
use std::path::Path;
use std::time::Instant;

use gaurast_picture::Picture;
use gaurast_render::Settings;

use crate::arguments::PathArguments;
use crate::error::BenchError;
use crate::judge::PictureFile;
use crate::machine::Machine;
use crate::median::median;
use crate::output::{self, Rows, mebibytes, number};
use crate::ply;
use crate::worker::{Contender, Drawn, Worker};
use crate::workload::{Source, Workload};

/// The rotation of the camera from frame to frame, in radians: a turn takes 1,440 frames.
const STEP: f64 = std::f64::consts::TAU / 1440.0;

/// The frames in which clusters may be built. They are not among the frames whose median is the time of a warm one.
const COLD: usize = 12;

/// The figures of a scene. Times are in milliseconds.
struct Measured {
    scene: String,
    gaussians: usize,
    /// The time to read the scene's file.
    read: f64,
    /// The time to make the device and copy the scene to it.
    upload: f64,
    frames: Vec<Drawn>,
    /// The time to encode and write a PNG file.
    png: f64,
}

impl Measured {
    /// The frames' times as cells: the first, the second, the slowest of the others in which clusters may be built, the
    /// median and the slowest of the warm ones, and the ratio of these two.
    fn cells(&self, time: impl Fn(&Drawn) -> f64) -> [String; 6] {
        let times: Vec<f64> = self.frames.iter().map(time).collect();
        let (cold, warm) = times.split_at(COLD.min(times.len()));
        let slowest = |times: &[f64]| times.iter().copied().fold(f64::NAN, f64::max);
        let (median, most) = (median(warm.iter().copied()), slowest(warm));
        [cold[0], cold[1], slowest(&cold[2..]), median, most, most / median].map(number)
    }

    fn memory(&self) -> Option<u64> {
        self.frames.iter().filter_map(|frame| frame.memory).max()
    }
}

/// Measures the scenes, and prints the figures.
pub(super) fn run(arguments: &PathArguments) -> Result<(), BenchError> {
    let folder = tempfile::tempdir()?;
    let mut measured = Vec::new();
    for path in &arguments.scenes {
        let source = Source::File { path: path.clone() };
        measured.push(measure(source.to_string(), path, arguments)?);
    }
    for &count in &arguments.counts {
        let source = Source::Benchmark { count };
        let path = folder.path().join("scene.ply");
        let scene = Workload::new(source.clone(), arguments.size.0).scene()?;
        ply::write(&path, &scene)?;
        drop(scene);
        measured.push(measure(source.to_string(), &path, arguments)?);
    }
    // The reader of standard output may have gone.
    let _ = show(&measured, arguments);
    if let Some(path) = &arguments.csv {
        let comment = format!("{}; milliseconds", Machine::this().line());
        output::write(path, &frames(&measured).csv(&comment))?;
    }
    Ok(())
}

fn measure(scene: String, path: &Path, arguments: &PathArguments) -> Result<Measured, BenchError> {
    let source = Source::File { path: path.to_owned() };
    let workload = Workload::new(source, arguments.size.0);
    let (views, gaussians, read) = {
        let start = Instant::now();
        let scene = workload.scene()?;
        let read = milliseconds(start);
        (workload.turning_views(&scene, arguments.frames as usize, STEP)?, scene.len(), read)
    };
    let missing = || BenchError::Worker("there is no device".to_owned());
    let mut worker = Worker::start(Contender::Gaurast, &workload, arguments.threads)?.ok_or_else(missing)?;
    let mut frames = Vec::new();
    for view in &views {
        frames.push(worker.draw_next(view)?);
    }
    let file = PictureFile::new()?;
    worker.draw(&views[0], Settings::default(), Some(&file.path()))?;
    let [width, height] = workload.size;
    let picture = Picture { width, height, pixels: file.read()? };
    let start = Instant::now();
    let png = tempfile::Builder::new().suffix(".png").tempfile()?;
    gaurast_picture::write(png.path(), &picture, None).map_err(|error| BenchError::Worker(error.to_string()))?;
    Ok(Measured { scene, gaussians, read, upload: worker.ready.upload, frames, png: milliseconds(start) })
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn show(measured: &[Measured], arguments: &PathArguments) -> std::io::Result<()> {
    let mut out = stdout().lock();
    writeln!(out, "{}", Machine::this().line())?;
    let [width, height] = arguments.size.0;
    writeln!(out, "{} frames of {width}x{height}, threads: {}; ms", arguments.frames, arguments.threads)?;
    let mut path = Rows::new(&[
        "scene",
        "Gaussians",
        "time",
        "first",
        "second",
        "slowest of 3 to 12",
        "warm, median",
        "warm, slowest",
        "slowest/median",
        "peak MiB",
    ]);
    let mut picture = Rows::new(&["scene", "read file", "upload", "frame", "PNG", "together"]);
    for one in measured {
        let wall = one.cells(|frame| frame.wall);
        let processor = one.cells(|frame| frame.processor.unwrap_or(f64::NAN));
        for (time, cells) in [("wall", wall), ("processor", processor)] {
            let head = [one.scene.clone(), one.gaussians.to_string(), time.to_owned()];
            let row = head.into_iter().chain(cells);
            path.rows.push(row.chain([mebibytes(one.memory())]).collect());
        }
        let first = one.frames.first().map_or(f64::NAN, |frame| frame.wall);
        let parts = [one.read, one.upload, first, one.png];
        let sum = parts.iter().sum();
        let cells = parts.into_iter().chain([sum]).map(number);
        let row = std::iter::once(one.scene.clone()).chain(cells);
        picture.rows.push(row.collect());
    }
    writeln!(out, "\nframes of a path\n{}", path.table())?;
    writeln!(out, "\na cold picture by part\n{}", picture.table())
}

/// A row for each frame.
fn frames(measured: &[Measured]) -> Rows {
    let mut rows = Rows::new(&["scene", "frame", "wall", "processor"]);
    for one in measured {
        for (frame, drawn) in one.frames.iter().enumerate() {
            rows.rows.push(vec![
                one.scene.clone(),
                frame.to_string(),
                format!("{:.3}", drawn.wall),
                drawn.processor.map_or(String::new(), |time| format!("{time:.3}")),
            ]);
        }
    }
    rows
}
