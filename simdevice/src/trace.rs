//! The trace of work, for those who ask for it: what every Gaussian draw did in every tile. Off unless a
//! [`Recorder`] is in the device's configuration; it reads what the tile engine has computed and changes no bit of it.

use crate::counters::{Counter, Counters};
use crate::gaussian::{TILE_SIZE, project::Splat};
use crate::packet::Rect;
use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use timing::stages::{self, GaussianCounts};
pub use timing::work::{DrawWork, FrameWork, Mode, Run, TRACE_VERSION, TileWork, Trace};

/// Render passes that are kept; older ones make room for newer ones.
const MAX_FRAMES: usize = 64;

/// Who takes the trace in the end.
type Sink = Box<dyn FnOnce(Trace) + Send>;

/// Gathers the work of a device's render passes, and hands it over when the device and all its draws are gone.
#[derive(Default)]
pub struct Recorder {
    frames: Mutex<VecDeque<Frame>>,
    sink: Mutex<Option<Sink>>,
}

#[derive(Default)]
struct Frame {
    size: [u32; 2],
    draws: Vec<Arc<DrawRecord>>,
}

/// A draw's work, as far as it has been done.
#[derive(Debug, Default)]
pub struct DrawRecord(Mutex<DrawWork>);

impl fmt::Debug for Recorder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Recorder").finish_non_exhaustive()
    }
}

impl Recorder {
    /// A recorder that gives the whole trace to `sink` when it is dropped.
    pub fn new(sink: impl FnOnce(Trace) + Send + 'static) -> Self {
        Self {
            frames: Mutex::default(),
            sink: Mutex::new(Some(Box::new(sink))),
        }
    }

    /// What was done so far. Passes that drew nothing are left out.
    pub fn trace(&self) -> Trace {
        let frames = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        let frames = frames.iter().filter(|frame| !frame.draws.is_empty());
        let frames = frames.map(|frame| FrameWork {
            size: frame.size,
            draws: frame.draws.iter().map(|draw| draw.finished()).collect(),
        });
        Trace {
            version: TRACE_VERSION,
            frames: frames.collect(),
        }
    }

    /// Begins a render pass over `area`.
    pub(crate) fn begin_frame(&self, area: Rect) {
        let mut frames = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        if frames.len() >= MAX_FRAMES {
            frames.pop_front();
        }
        frames.push_back(Frame {
            size: [area.width, area.height],
            draws: Vec::new(),
        });
    }

    /// Begins a draw of the last render pass.
    pub(crate) fn begin_draw(&self, work: DrawWork) -> Arc<DrawRecord> {
        let record = Arc::new(DrawRecord(Mutex::new(work)));
        let mut frames = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(frame) = frames.back_mut() {
            frame.draws.push(Arc::clone(&record));
        }
        record
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        let sink = self
            .sink
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some(sink) = sink {
            sink(self.trace());
        }
    }
}

impl DrawRecord {
    /// Adds a tile.
    pub(crate) fn add(&self, tile: TileWork) {
        let mut work = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        work.tiles.push(tile);
    }

    /// The draw with its tiles row by row, whichever worker was first.
    fn finished(&self) -> DrawWork {
        let mut work = self
            .0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        work.tiles
            .sort_unstable_by_key(|tile| [tile.at[1], tile.at[0]]);
        work
    }
}

/// Adds a run to a tile's, or lengthens the last one if nothing finished in between.
pub(crate) fn push_run(runs: &mut Vec<Run>, run: Run) {
    match runs.last_mut() {
        Some(last) if (last.rows, last.blocks) == (run.rows, run.blocks) => {
            last.primitives += run.primitives;
            last.reached += run.reached;
        }
        _ => runs.push(run),
    }
}

/// What is known of a Gaussian draw before its tiles are rendered. `counters` are those of its preprocessing.
pub(crate) fn gaussian_draw(
    counters: &Counters,
    splats: &[Vec<Splat>],
    pairs: u64,
    degree: u32,
    bounds: Rect,
) -> DrawWork {
    let read = counters.get(Counter::GaussiansRead);
    let early = [
        Counter::SkippedNonFinite,
        Counter::SkippedFaint,
        Counter::SkippedNear,
        Counter::SkippedFar,
    ];
    let skipped: u64 = early.iter().map(|&counter| counters.get(counter)).sum();
    let drawn = splats.iter().map(|batch| batch.len() as u64).sum();
    let tiles = |side: u32| u64::from(side.div_ceil(TILE_SIZE));
    let counts = GaussianCounts {
        read,
        projected: read.saturating_sub(skipped),
        drawn,
        degree,
        pairs,
        tiles: tiles(bounds.width) * tiles(bounds.height),
    };
    let [preprocess, sort] = stages::gaussian(&counts);
    DrawWork {
        mode: Mode::Gaussian,
        primitives: read,
        drawn,
        boxed_pairs: splats
            .iter()
            .flatten()
            .map(|splat| boxed_tiles(splat, bounds))
            .sum(),
        preprocess,
        sort,
        tiles: Vec::new(),
    }
}

/// Tiles of `bounds` under the square around the circle of three standard deviations, rounded up to pixels: what the
/// original 3DGS code bins.
fn boxed_tiles(splat: &Splat, bounds: Rect) -> u64 {
    let [a, b, c] = splat.factor;
    // The covariance is the inverse of 2 ln 2 times the factor's square.
    let scale = 1.0 / (2.0 * std::f64::consts::LN_2 * a * a * c * c);
    let (xx, yy) = (c * c * scale, (a * a + b * b) * scale);
    let xy = -b * c * scale;
    let middle = 0.5 * (xx + yy);
    let spread = (middle * middle - (xx * yy - xy * xy)).max(0.1).sqrt();
    let radius = (3.0 * (middle + spread).sqrt()).ceil();
    let tiles = |mean: f64, start: i32, length: u32| {
        let size = f64::from(TILE_SIZE);
        let (start, end) = (f64::from(start), f64::from(start) + f64::from(length));
        let (first, last) = ((start / size).floor(), (end / size).ceil());
        let low = ((mean - radius) / size).floor().clamp(first, last);
        let high = ((mean + radius + size - 1.0) / size)
            .floor()
            .clamp(first, last);
        (high - low) as u64
    };
    let [x, y] = splat.mean;
    tiles(x, bounds.x, bounds.width) * tiles(y, bounds.y, bounds.height)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Rect = Rect {
        x: 0,
        y: 0,
        width: 160,
        height: 80,
    };

    fn splat(mean: [f64; 2], deviation: f64) -> Splat {
        let factor = 1.0 / (deviation * (2.0 * std::f64::consts::LN_2).sqrt());
        Splat {
            mean,
            factor: [factor, 0.0, factor],
            ..Splat::default()
        }
    }

    #[test]
    fn boxes_are_of_three_standard_deviations() {
        assert_eq!(boxed_tiles(&splat([40.0, 40.0], 1.0), BOUNDS), 1);
        assert_eq!(boxed_tiles(&splat([33.0, 40.0], 1.0), BOUNDS), 2);
        // A radius of 30 pixels or so about (80, 40) is 5 by 5 tiles, of which there are 5 rows.
        assert_eq!(boxed_tiles(&splat([88.0, 40.0], 10.0), BOUNDS), 25);
        assert_eq!(boxed_tiles(&splat([-500.0, 40.0], 10.0), BOUNDS), 0);
        assert_eq!(boxed_tiles(&splat([80.0, 40.0], 1000.0), BOUNDS), 50);
    }

    #[test]
    fn the_sink_gets_the_trace_in_the_order_of_tiles() {
        let (send, receive) = std::sync::mpsc::channel();
        let recorder = Recorder::new(move |trace| send.send(trace).unwrap());
        recorder.begin_frame(BOUNDS);
        recorder.begin_frame(BOUNDS);
        let draw = recorder.begin_draw(DrawWork::default());
        for at in [[1, 1], [0, 1], [3, 0]] {
            draw.add(TileWork {
                at,
                ..TileWork::default()
            });
        }
        drop(recorder);
        let trace = receive.recv().unwrap();
        assert_eq!((trace.version, trace.frames.len()), (TRACE_VERSION, 1));
        let order: Vec<_> = trace.frames[0].draws[0]
            .tiles
            .iter()
            .map(|tile| tile.at)
            .collect();
        assert_eq!(order, [[3, 0], [0, 1], [1, 1]]);
    }

    #[test]
    fn runs_grow_until_something_finishes() {
        let run = |rows, blocks| Run {
            primitives: 32,
            rows,
            blocks,
            reached: 5,
        };
        let mut runs = Vec::new();
        for next in [run(16, 16), run(16, 16), run(12, 9), run(12, 8)] {
            push_run(&mut runs, next);
        }
        assert_eq!(runs.len(), 3);
        assert_eq!((runs[0].primitives, runs[0].reached), (64, 10));
    }
}
