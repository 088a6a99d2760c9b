//! `gaurast-bench optimizations --instructions`: instructions of a frame with and without each optimization.

use std::collections::HashMap;
use std::io::{Write, stdout};

use super::path::{Path, TEMPORAL_REUSE, settings};
use crate::arguments::OptimizationsArguments;
use crate::callgrind;
use crate::counts;
use crate::error::BenchError;
use crate::output::{self, Rows, number};
use crate::worker;
use crate::workload::{Extra, Source, Workload};

/// The pictures' size.
const SIZE: [u32; 2] = [640, 360];

/// Gaussians of a scene.
const COUNT: usize = 20_000;

/// The number of the counted frame. The second frame builds clusters of Gaussians.
const WARM: usize = 3;

/// The work of a scene.
#[derive(Clone)]
enum Work {
    /// Gaussians, seen from the views of a path.
    Gaussians(Box<Workload>, Path),
    /// A workload of the counts.
    Counted(&'static str),
}

/// A frame whose instructions are counted.
#[derive(Clone)]
struct Scene {
    name: String,
    work: Work,
    /// The number of the counted frame, from 1 on.
    frame: usize,
}

impl Scene {
    fn gaussians(name: &str, workload: &Workload, path: Path, frame: usize) -> Self {
        Self { name: name.to_owned(), work: Work::Gaussians(Box::new(workload.clone()), path), frame }
    }

    fn counted(name: &str, workload: &'static str) -> Self {
        Self { name: name.to_owned(), work: Work::Counted(workload), frame: WARM }
    }

    /// The instructions of the frame. It is the difference of two processes: one draws the frame, and the other stops
    /// before it.
    fn instructions(&self, optimizations: &str) -> Result<u64, BenchError> {
        let all = self.process(optimizations, self.frame)?;
        Ok(all.saturating_sub(self.process(optimizations, self.frame - 1)?))
    }

    /// The instructions of a process that draws `frames` frames.
    fn process(&self, optimizations: &str, frames: usize) -> Result<u64, BenchError> {
        let counted = match &self.work {
            Work::Gaussians(workload, path) => {
                let views = path.views(workload, self.frame)?;
                let input = worker::input(workload, optimizations, &views[..frames])?;
                let counted = callgrind::count(&[worker::COMMAND], &[], &input)?;
                worker::check(&counted.output)?;
                counted
            }
            Work::Counted(name) => {
                let frames = frames.to_string();
                let arguments = [counts::WORKER, "--frames", &frames, name];
                callgrind::count(&arguments, &[("GAURAST_OPTIMIZATIONS", optimizations)], &[])?
            }
        };
        Ok(counted.instructions)
    }
}

/// Every optimization, with scenes in which it may save something.
fn cases() -> Vec<(&'static str, Scene)> {
    let base = Workload::new(Source::Benchmark { count: COUNT }, SIZE);
    let beside = Workload { extra: Some(Extra::Beside { count: COUNT }), ..base.clone() };
    let behind = Workload { extra: Some(Extra::Behind { count: COUNT }), ..Workload::new(Source::Wall, SIZE) };
    let whole = |workload: &Workload, name: &str| Scene::gaussians(name, workload, Path::Own, WARM);
    let room = || whole(&base, "20,000 Gaussians");
    let half_seen = || whole(&beside, "20,000 Gaussians, as many beside the picture");
    let first = Scene::gaussians(
        "20,000 Gaussians, as many beside the picture, drawn for the first time",
        &beside,
        Path::Own,
        1,
    );
    let object =
        Scene::gaussians("20,000 Gaussians from afar: an object on an empty background", &base, Path::Afar, WARM);
    let still = Scene::gaussians("20,000 Gaussians, a camera at rest", &base, Path::Still, WARM);
    let small = || Scene::counted("small triangles", "small-triangles");
    let layers = || Scene::counted("layers that hide one another", "layered-triangles");
    let floor = || Scene::counted("a textured floor", "textured-triangles");
    vec![
        ("cluster-culling", half_seen()),
        ("occlusion-culling", whole(&behind, "20,000 Gaussians behind a wall")),
        (TEMPORAL_REUSE, still),
        ("bounds", room()),
        ("bounds", half_seen()),
        ("bounds", first),
        ("ellipse", room()),
        ("harmonics", half_seen()),
        ("blocks", room()),
        ("early-termination", room()),
        ("early-termination", whole(&behind, "20,000 Gaussians behind a wall")),
        ("empty-tiles", object),
        ("overwritten-tiles", floor()),
        ("overwritten-tiles", Scene::counted("a layer that fills the picture", "one-layer")),
        ("masked-quads", small()),
        ("affine", small()),
        ("affine", layers()),
        ("overwritten-quads", layers()),
        ("hierarchical-depth", layers()),
    ]
}

/// Counts the instructions, prints them and writes them to files.
///
/// # Errors
/// If Callgrind is not installed, or a process fails.
pub(super) fn run(arguments: &OptimizationsArguments) -> Result<(), BenchError> {
    let mut rows = Rows::new(&["optimization", "scene", "with", "without", "saved %"]);
    let mut known = HashMap::new();
    let only = &arguments.only;
    let is_wanted = |optimization: &str| only.is_empty() || only.iter().any(|name| name == optimization);
    for (optimization, scene) in cases() {
        if !is_wanted(optimization) {
            continue;
        }
        let mut count = |optimizations: String| -> Result<u64, BenchError> {
            let key = (scene.name.clone(), optimizations);
            if let Some(&count) = known.get(&key) {
                return Ok(count);
            }
            let count = scene.instructions(&key.1)?;
            known.insert(key, count);
            Ok(count)
        };
        let [with, without] = settings(optimization);
        let (with, without) = (count(with)?, count(without)?);
        rows.rows.push(vec![
            optimization.to_owned(),
            scene.name.clone(),
            with.to_string(),
            without.to_string(),
            number(100.0 * (1.0 - with as f64 / without as f64)),
        ]);
        let _ = writeln!(stdout(), "{}", rows.rows.last().map_or(String::new(), |row| row.join("; ")));
    }
    let _ = writeln!(stdout(), "{}", rows.table());
    let csv = rows.csv("Instructions of a frame of 640x360 at AVX2 on one thread");
    output::write(&arguments.sweep.output.join("optimization_instructions.csv"), &csv)
}
