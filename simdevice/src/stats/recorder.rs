//! The recorder of work: the work of every draw before tiles and in every tile, and the work of dispatches. It is off
//! unless a [`Recorder`] is in the device's configuration, timestamps are simulated or a query listens. It only reads
//! data that the device has computed and counted, so that it changes no image.

use crate::state::Rect;
use crate::stats::counters::{Counter, Counters};
use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use timing::work::TILE_SIDES;
pub use timing::work::{DrawWork, FrameWork, Mode, Run, ShaderWork, TRACE_VERSION, TileWork, Trace};

/// The number of render passes that are kept. A new pass then replaces the oldest.
const MAX_FRAMES: usize = 64;

/// The function that receives the whole trace at the end.
type Sink = Box<dyn FnOnce(Trace) + Send>;

/// Records the work of a device's render passes. It gives the trace to its sink when the device and all its draws are
/// gone.
#[derive(Default)]
pub struct Recorder {
    frames: Mutex<Frames>,
    sink: Mutex<Option<Sink>>,
    /// The number of queries that listen.
    listeners: AtomicU32,
}

/// The number of a command processor, which tells its work from that of the device's other command processors.
pub(crate) type Owner = u64;

#[derive(Default)]
struct Frames {
    kept: VecDeque<Frame>,
    /// The number of frames that were begun so far.
    begun: u64,
    /// The dispatches of each owner since its last pass began.
    dispatched: BTreeMap<Owner, Dispatched>,
}

#[derive(Clone, Copy, Default)]
struct Dispatched {
    work: ShaderWork,
    count: u64,
}

#[derive(Default)]
struct Frame {
    owner: Owner,
    /// The number of frames that were begun before it.
    number: u64,
    size: [u32; 2],
    before: Dispatched,
    draws: Vec<Arc<DrawRecord>>,
}

impl Frame {
    fn work(&self) -> Option<FrameWork> {
        let some = !self.draws.is_empty() || self.before.count > 0;
        some.then(|| {
            let mut frame = FrameWork {
                size: self.size,
                compute: self.before.work,
                dispatches: self.before.count,
                draws: self.draws.iter().map(|draw| draw.finished()).collect(),
            };
            frame.place();
            frame
        })
    }
}

/// The work of a draw so far, and the counters of fragment programs that ran after Gaussians were rasterized. All are
/// sums of whole numbers, so that the order of the tiles does not change them.
#[derive(Debug, Default)]
pub struct DrawRecord(Mutex<DrawWork>, Mutex<Counters>);

impl fmt::Debug for Recorder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Recorder").finish_non_exhaustive()
    }
}

impl Recorder {
    /// Makes a recorder that gives the whole trace to `sink` when it is dropped.
    pub fn new(sink: impl FnOnce(Trace) + Send + 'static) -> Self {
        Self { frames: Mutex::default(), sink: Mutex::new(Some(Box::new(sink))), listeners: AtomicU32::default() }
    }

    /// The work so far. Passes that drew nothing are omitted.
    pub fn trace(&self) -> Trace {
        let frames = self.lock();
        let last = frames.dispatched.values().map(|&before| Frame { before, ..Frame::default() });
        let kept = frames.kept.iter().filter_map(Frame::work);
        Trace { version: TRACE_VERSION, frames: kept.chain(last.filter_map(|frame| frame.work())).collect() }
    }

    /// The work of an owner in frames from number `from` on, as far as they are kept. `from` becomes the number of the
    /// next frame. Dispatches since the owner's last pass become a frame of their own.
    pub(crate) fn work_since(&self, owner: Owner, from: &mut u64) -> Vec<FrameWork> {
        let mut frames = self.lock();
        if frames.dispatched.contains_key(&owner) {
            frames.begin(owner, [0; 2]);
        }
        let first = std::mem::replace(from, frames.begun);
        let kept = frames.kept.iter();
        kept.filter(|frame| frame.owner == owner && frame.number >= first).filter_map(Frame::work).collect()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Frames> {
        self.frames.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// True if a query listens.
    pub(crate) fn has_listeners(&self) -> bool {
        self.listeners.load(Relaxed) > 0
    }

    /// Adds a listener: work is recorded from now on.
    pub(crate) fn listen(&self) {
        self.listeners.fetch_add(1, Relaxed);
    }

    /// Removes a listener that [`Recorder::listen`] added.
    pub(crate) fn stop_listening(&self) {
        self.listeners.fetch_sub(1, Relaxed);
    }

    /// Forgets all work of an owner.
    pub(crate) fn clear(&self, owner: Owner) {
        let mut frames = self.lock();
        frames.kept.retain(|frame| frame.owner != owner);
        frames.dispatched.remove(&owner);
    }

    /// Begins an owner's render pass over `area`. The ids of the owner's frames before it are forgotten, since a large
    /// frame has many.
    pub(crate) fn begin_frame(&self, owner: Owner, area: Rect) {
        // A render area lies inside its attachments, so that it begins at zero or later.
        let side = |from: i32, length: u32| u32::try_from(from).unwrap_or(0).saturating_add(length);
        let mut frames = self.lock();
        for frame in frames.kept.iter().filter(|frame| frame.owner == owner) {
            frame.draws.iter().for_each(|draw| draw.forget_ids());
        }
        frames.begin(owner, [side(area.x, area.width), side(area.y, area.height)]);
    }

    /// Adds a draw to the last render pass of its owner.
    pub(crate) fn add_draw(&self, owner: Owner, record: &Arc<DrawRecord>) {
        let mut frames = self.lock();
        let mut last_first = frames.kept.iter_mut().rev();
        if let Some(frame) = last_first.find(|frame| frame.owner == owner) {
            frame.draws.push(Arc::clone(record));
        }
    }

    /// Adds a dispatch, whose work is in `counters`.
    pub(crate) fn add_dispatch(&self, owner: Owner, counters: &Counters) {
        let mut frames = self.lock();
        let dispatched = frames.dispatched.entry(owner).or_default();
        dispatched.work = dispatched.work.plus(&shader_work(counters));
        dispatched.count += 1;
    }
}

impl Frames {
    fn begin(&mut self, owner: Owner, size: [u32; 2]) {
        if self.kept.len() >= MAX_FRAMES {
            self.kept.pop_front();
        }
        let before = self.dispatched.remove(&owner).unwrap_or_default();
        self.kept.push_back(Frame { owner, number: self.begun, size, before, draws: Vec::new() });
        self.begun += 1;
    }
}

/// The work of shader cores, in operations of single lanes. Counters tell instructions of each kind, but active lanes
/// only in total, so that all kinds are assumed to have the same mean number of active lanes. An operation for all
/// lanes of a batch at once counts once. Every load, store and image access is assumed to move 32 bits that no cache
/// holds.
pub(crate) fn shader_work(counters: &Counters) -> ShaderWork {
    let count = |wanted: &[Counter]| -> u64 { wanted.iter().map(|&c| counters.get(c)).sum() };
    let instructions = count(&[
        Counter::ShaderFloat,
        Counter::ShaderInteger,
        Counter::ShaderSpecial,
        Counter::ShaderWide,
        Counter::ShaderMove,
        Counter::ShaderCrossLane,
        Counter::ShaderMemory,
        Counter::ShaderAtomic,
        Counter::ShaderImage,
        Counter::ShaderControl,
    ]);
    if instructions == 0 {
        return ShaderWork::default();
    }
    let operations = count(&[Counter::ShaderActiveLanes, Counter::ShaderUniform]);
    let lanes = operations as f64 / instructions as f64;
    let of = |wanted: &[Counter]| count(wanted) as f64 * lanes;
    let memory = of(&[Counter::ShaderMemory, Counter::ShaderAtomic]);
    let image = of(&[Counter::ShaderImage]);
    ShaderWork {
        float: of(&[Counter::ShaderFloat]),
        integer: of(&[Counter::ShaderInteger]),
        special: of(&[Counter::ShaderSpecial]),
        wide: of(&[Counter::ShaderWide]),
        memory,
        image,
        other: of(&[Counter::ShaderMove, Counter::ShaderCrossLane, Counter::ShaderControl]),
        bytes: 4.0 * (memory + image),
    }
}

/// The number of tiles, for each of [`TILE_SIDES`], that the box from `low` to `high` touches within `bounds`, in
/// pixels. The corner of `bounds` must not be negative.
pub(crate) fn sized_tiles(low: [f64; 2], high: [f64; 2], bounds: Rect) -> [u64; TILE_SIDES.len()] {
    // Whole pixels are used, because rounding floats for every size is slow.
    let pixels = |axis: usize| {
        let (start, length) = match axis {
            0 => (bounds.x, bounds.width),
            _ => (bounds.y, bounds.height),
        };
        let (start, end) = (f64::from(start), f64::from(start) + f64::from(length));
        let (low, high) = (low[axis].max(start), high[axis].min(end));
        let last = high as u64;
        let end = last + u64::from(last as f64 != high);
        (low < high).then_some((low as u64, end))
    };
    let (Some((left, right)), Some((top, bottom))) = (pixels(0), pixels(1)) else {
        return [0; TILE_SIDES.len()];
    };
    TILE_SIDES.map(|side| {
        let side = u64::from(side);
        let along = |low: u64, end: u64| end.div_ceil(side) - low / side;
        along(left, right) * along(top, bottom)
    })
}

impl Drop for Recorder {
    fn drop(&mut self) {
        let sink = self.sink.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(sink) = sink {
            sink(self.trace());
        }
    }
}

impl DrawRecord {
    /// Makes a record of a draw whose work before tiles is known.
    pub(crate) fn new(work: DrawWork) -> Arc<Self> {
        Arc::new(Self(Mutex::new(work), Mutex::default()))
    }

    /// Changes the recorded work.
    pub(crate) fn update(&self, change: impl FnOnce(&mut DrawWork)) {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Forgets the ids of the lists.
    fn forget_ids(&self) {
        self.update(|work| work.tiles.iter_mut().for_each(|tile| tile.ids = Vec::new()));
    }

    /// Adds the work of a tile.
    pub(crate) fn add(&self, tile: TileWork) {
        self.update(|work| work.tiles.push(tile));
    }

    /// Adds the work of fragment programs in a tile; `counters` are those of the tile alone.
    pub(crate) fn add_shading(&self, counters: &Counters) {
        let mut shading = self.1.lock().unwrap_or_else(PoisonError::into_inner);
        shading.add_all(counters);
    }

    /// The draw's work, with its tiles in order of rows, then columns.
    fn finished(&self) -> DrawWork {
        let mut work = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let shading = self.1.lock().unwrap_or_else(PoisonError::into_inner);
        work.shade = work.shade.plus(&shader_work(&shading));
        work.tiles.sort_by_key(|tile| [tile.at[1], tile.at[0]]);
        for index in 1..work.tiles.len() {
            let before = &work.tiles[index - 1];
            if before.at == work.tiles[index].at {
                work.tiles[index].layer = before.layer + 1;
            }
        }
        if work.mode == Mode::Gaussian {
            if work.tiles.is_empty() {
                work.drawn = 0;
            }
            // A Gaussian reaches beyond its square where it is most opaque.
            work.boxed_pairs = work.boxed_pairs.max(work.pairs());
        }
        work
    }
}

/// Appends a run to a tile's runs, or adds it to the last run if no row or block finished in between. Where all rows
/// are finished, primitives are not needed, and are in no run.
pub(crate) fn push_run(runs: &mut Vec<Run>, run: Run) {
    if run.rows == 0 {
        return;
    }
    match runs.last_mut() {
        Some(last) if (last.rows, last.blocks) == (run.rows, run.blocks) => {
            last.primitives += run.primitives;
            last.reached += run.reached;
            last.hidden += run.hidden;
            last.hidden_blocks += run.hidden_blocks;
            last.waits = last.waits.zip(run.waits).map(|(a, b)| std::array::from_fn(|k| a[k].saturating_add(b[k])));
        }
        _ => runs.push(run),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::work::INTERVALS;

    const BOUNDS: Rect = Rect { x: 0, y: 0, width: 160, height: 80 };

    #[gaurast_runner::test]
    fn boxes_touch_tiles_of_every_size() {
        let tiles = |low, high| sized_tiles(low, high, BOUNDS);
        assert_eq!(tiles([16.0, 8.0], [32.0, 16.5]), [4, 2, 1, 1]);
        assert_eq!(tiles([-50.0, 79.5], [0.25, 500.0]), [1; 4]);
        assert_eq!(tiles([-9.0; 2], [1e9; 2]), [200, 50, 15, 6]);
        assert_eq!(tiles([20.0, 5.0], [20.0, 9.0]), [0; 4]);
        assert_eq!(tiles([f64::NAN, 5.0], [20.0, -9.0]), [0; 4]);
    }

    #[gaurast_runner::test]
    fn the_sink_gets_the_trace_in_the_order_of_tiles() {
        let (send, receive) = std::sync::mpsc::channel();
        let recorder = Recorder::new(move |trace| send.send(trace).unwrap());
        recorder.begin_frame(0, BOUNDS);
        recorder.begin_frame(0, BOUNDS);
        let draw = DrawRecord::new(DrawWork::default());
        recorder.add_draw(0, &draw);
        for at in [[1, 1], [0, 1], [3, 0], [1, 1]] {
            draw.add(TileWork { at, ..TileWork::default() });
        }
        drop(recorder);
        let trace = receive.recv().unwrap();
        assert_eq!((trace.version, trace.frames.len()), (TRACE_VERSION, 1));
        let order: Vec<_> = trace.frames[0].draws[0].tiles.iter().map(|tile| (tile.at, tile.layer)).collect();
        assert_eq!(order, [([3, 0], 0), ([0, 1], 0), ([1, 1], 0), ([1, 1], 1)]);
    }

    #[gaurast_runner::test]
    fn owners_have_frames_and_dispatches_of_their_own() {
        let recorder = Recorder::default();
        let draw = |primitives| DrawRecord::new(DrawWork { primitives, ..DrawWork::default() });
        recorder.begin_frame(1, BOUNDS);
        recorder.begin_frame(2, BOUNDS);
        recorder.add_dispatch(1, &Counters::default());
        recorder.add_draw(1, &draw(10));
        recorder.add_draw(2, &draw(20));
        let mut from = [0; 2];
        let mut since = |owner: Owner| recorder.work_since(owner, &mut from[owner as usize - 1]);
        let (one, two) = (since(1), since(2));
        assert_eq!(one[0].draws[0].primitives, 10);
        assert_eq!((one.len(), one[1].dispatches), (2, 1));
        assert_eq!((two.len(), two[0].draws[0].primitives), (1, 20));
        assert!(since(1).is_empty() && since(2).is_empty(), "counted once");
        recorder.clear(1);
        let left = recorder.trace().frames;
        assert_eq!((left.len(), left[0].draws[0].primitives), (1, 20));
    }

    #[gaurast_runner::test]
    fn runs_grow_until_something_finishes() {
        let waits = Some([1; INTERVALS]);
        let run = |rows, blocks| Run { primitives: 32, rows, blocks, reached: 5, hidden: 2, hidden_blocks: 1, waits };
        let mut runs = Vec::new();
        for next in [run(16, 16), run(16, 16), run(12, 9), run(12, 8), run(0, 8)] {
            push_run(&mut runs, next);
        }
        assert_eq!(runs.len(), 3);
        assert_eq!((runs[0].primitives, runs[0].reached), (64, 10));
        assert_eq!((runs[0].hidden, runs[0].hidden_blocks), (4, 2));
        assert_eq!(runs[0].waits, Some([2; INTERVALS]));
    }
}
