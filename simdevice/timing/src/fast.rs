//! The fast model: closed form from event to event.
//!
//! With two halves of a tile buffer, a module proceeds in steps: while one batch is evaluated, the next is fetched, and
//! the longer of the two is the step's length. Without contention for memory, `n` equal steps take `n max(c, b / h)`
//! cycles, for `c` cycles of evaluation and `b` bytes a step at `h` bytes per cycle, so they are not simulated one by
//! one. If the modules' ports together are wider than main memory, steps are simulated one by one: time advances to the
//! next end of an evaluation, a fetch or a write, each at a rate that is constant in between.

use crate::config::{Config, Rasterizer};
use crate::plan::{self, Part, Rates, Task};
use crate::raster::RasterReport;
use crate::work::{FrameWork, Mode, Segment};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

/// The time that a tile spends in a module, from its first evaluated primitive to its last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileSpan {
    /// The module, from 0.
    pub module: usize,
    /// Column and row of the tile.
    pub at: [u32; 2],
    /// The begin, in cycles from the frame's first fetch.
    pub begin: f64,
    /// The end, in the same cycles.
    pub end: f64,
}

/// Rasterizes a frame while others move `others_gb_s` to and from main memory.
pub fn rasterize(frame: &FrameWork, config: &Config, others_gb_s: f64) -> RasterReport {
    rasterize_tiles(frame, config, others_gb_s).0
}

/// Rasterizes like [`rasterize`], and returns also the tiles of each module in order, module after module.
pub fn rasterize_tiles(
    frame: &FrameWork,
    config: &Config,
    others_gb_s: f64,
) -> (RasterReport, Vec<TileSpan>) {
    let tasks = plan::tasks(frame, &config.rasterizer);
    let rates = Rates::new(config, others_gb_s);
    let mut report = RasterReport::default();
    let mut queue = tasks.iter();
    let raster = &config.rasterizer;
    let contended = rates.port * f64::from(raster.modules) > rates.memory;
    let mut modules: Vec<_> = (0..raster.modules)
        .map(|_| Module::new(rates, contended))
        .collect();
    for module in &mut modules {
        module.proceed(&mut queue, raster, &mut report);
    }
    let now = if contended {
        together(&mut modules, &mut queue, raster, &mut report)
    } else {
        apart(&mut modules, &mut queue, raster, &mut report)
    };
    report.cycles = now;
    // The part of the steps' time that exceeds evaluation is waiting for memory.
    let evaluation = report.modules.total();
    let lasted: f64 = modules.iter().map(|module| module.lasted).sum();
    report.modules.memory = (lasted - evaluation).max(0.0);
    report.modules.idle = now * modules.len() as f64 - report.modules.total();
    let spans = |(module, drawn): (usize, Module)| {
        let span = move |span: TileSpan| TileSpan { module, ..span };
        drawn.spans.into_iter().map(span)
    };
    let spans = modules.into_iter().enumerate().flat_map(spans).collect();
    (report, spans)
}

/// Runs modules that share main memory until the queue is empty, and returns the cycles. At each event the rates of all
/// ports may change.
fn together<'a>(
    modules: &mut [Module],
    queue: &mut impl Iterator<Item = &'a Task>,
    raster: &Rasterizer,
    report: &mut RasterReport,
) -> f64 {
    let mut now = 0.0;
    loop {
        let asking = modules.iter().filter(|module| module.asks()).count();
        let Some(rates) = modules.first().map(|module| module.rates) else {
            return now;
        };
        let share = rates.port.min(rates.memory / asking.max(1) as f64);
        let next = modules
            .iter()
            .map(|module| module.next_event(share))
            .fold(f64::INFINITY, f64::min);
        if !next.is_finite() {
            return now;
        }
        now += next;
        for module in modules.iter_mut() {
            module.advance(next, share);
            module.settle(queue, raster, report);
        }
    }
}

/// Runs modules that never wait for each other until the queue is empty, and returns the cycles. Each goes from event
/// to event alone, and tiles are claimed in the order of time.
fn apart<'a>(
    modules: &mut [Module],
    queue: &mut impl Iterator<Item = &'a Task>,
    raster: &Rasterizer,
    report: &mut RasterReport,
) -> f64 {
    // Times are not negative, so their bits have the same order.
    let event = |index: usize, module: &Module| {
        let next = module.now + module.next_event(module.rates.port);
        next.is_finite().then(|| Reverse((next.to_bits(), index)))
    };
    let first = modules.iter().enumerate();
    let mut events: BinaryHeap<_> = first
        .filter_map(|(index, module)| event(index, module))
        .collect();
    let mut now = 0.0;
    while let Some(Reverse((time, index))) = events.pop() {
        now = f64::from_bits(time);
        let module = &mut modules[index];
        module.advance(now - module.now, module.rates.port);
        module.now = now;
        module.settle(queue, raster, report);
        events.extend(event(index, module));
    }
    now
}

/// The rest of a module's current step, except for its port's transfers.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Cycles of evaluation.
    cycles: f64,
    /// True if evaluation begins a tile: a half of the buffer must be free for its pixels.
    first_of_tile: bool,
}

/// A transfer of a port. A port does its transfers in order.
#[derive(Clone, Copy, Debug)]
struct Request {
    /// Cycles until the first byte, counted from when the port begins the transfer.
    latency: f64,
    bytes: f64,
    /// True for a write of pixels, which no step waits for.
    write: bool,
}

/// A remainder of bytes that counts as zero, because of rounding.
const SLACK: f64 = 1e-6;

/// Batches of the same cost.
#[derive(Clone, Copy, Debug)]
struct Batches {
    mode: Mode,
    count: f64,
    cycles: f64,
    bytes: f64,
    /// True if they are fetched and then discarded. The fetch after them can't be made ahead.
    wasted: bool,
    first_of_tile: bool,
    last_of_tile: bool,
}

#[derive(Debug)]
struct Module {
    /// The time, in cycles from the frame's first fetch.
    now: f64,
    /// Tiles that were claimed and whose evaluation has not begun.
    places: VecDeque<[u32; 2]>,
    /// Tiles whose evaluation has begun. The last may not have ended.
    spans: Vec<TileSpan>,
    rates: Rates,
    contended: bool,
    claimed: VecDeque<Batches>,
    current: Option<Batches>,
    started: bool,
    mode: Option<Mode>,
    step: Option<Step>,
    port: VecDeque<Request>,
    /// Cycles spent in steps.
    lasted: f64,
    /// The mode of the tile whose last batch the step evaluates, if it does.
    tile_ended: Option<Mode>,
}

impl Module {
    fn new(rates: Rates, contended: bool) -> Self {
        Self {
            now: 0.0,
            places: VecDeque::new(),
            spans: Vec::new(),
            rates,
            contended,
            claimed: VecDeque::new(),
            current: None,
            started: false,
            mode: None,
            step: None,
            port: VecDeque::new(),
            lasted: 0.0,
            tile_ended: None,
        }
    }

    /// True if the port moves bytes.
    fn asks(&self) -> bool {
        self.port
            .front()
            .is_some_and(|request| request.latency <= 0.0)
    }

    /// True if evaluation waits for pixels to be written: two halves hold pixels.
    fn is_blocked(&self, step: &Step) -> bool {
        // A step whose evaluation has ended does not wait for a free half.
        step.first_of_tile
            && step.cycles > 0.0
            && self.port.iter().filter(|request| request.write).count() > 1
    }

    /// True if the step has ended, with all transfers that it waits for.
    fn is_done(&self) -> bool {
        self.step
            .is_some_and(|step| step.cycles <= 0.0 && self.port.iter().all(|request| request.write))
    }

    /// Cycles until the next end of an evaluation, a latency or a transfer.
    fn next_event(&self, share: f64) -> f64 {
        let mut next = f64::INFINITY;
        if let Some(step) = &self.step
            && step.cycles > 0.0
            && !self.is_blocked(step)
        {
            next = step.cycles;
        }
        match self.port.front() {
            Some(request) if request.latency > 0.0 => next.min(request.latency),
            // A port moves one request in a cycle: the rest of the request's last cycle is lost.
            Some(request) => next.min(((request.bytes - SLACK) / share).ceil().max(1.0)),
            None => next,
        }
    }

    /// Advances the time by `cycles`.
    fn advance(&mut self, cycles: f64, share: f64) {
        self.now += cycles;
        let blocked = self.step.is_some_and(|step| self.is_blocked(&step));
        if let Some(step) = &mut self.step {
            self.lasted += cycles;
            if !blocked {
                step.cycles -= cycles;
            }
        }
        if let Some(request) = self.port.front_mut() {
            if request.latency > 0.0 {
                request.latency -= cycles;
                return;
            }
            request.bytes -= cycles * share;
            if request.bytes <= SLACK {
                self.port.pop_front();
            }
        }
    }

    /// Begins the next steps and writes after the end of a step or a tile.
    fn settle<'a>(
        &mut self,
        queue: &mut impl Iterator<Item = &'a Task>,
        raster: &Rasterizer,
        report: &mut RasterReport,
    ) {
        // Steps of no length are followed at once.
        while self.is_done() {
            self.proceed(queue, raster, report);
        }
        // A tile may end while the next batch is still being fetched.
        if self.step.is_some_and(|step| step.cycles <= 0.0) {
            let write = self.end_tile(raster, report);
            self.port.extend(write);
        }
    }

    /// Goes on to the next step, or to a run of equal steps, if there is any.
    fn proceed<'a>(
        &mut self,
        queue: &mut impl Iterator<Item = &'a Task>,
        raster: &Rasterizer,
        report: &mut RasterReport,
    ) {
        self.step = None;
        let write = self.end_tile(raster, report);
        if let Some(current) = &mut self.current
            && current.count > 1.0
        {
            let Batches {
                count,
                cycles,
                bytes,
                ..
            } = *current;
            let first_of_tile = false;
            if self.contended || write.is_some() || !self.port.is_empty() {
                current.count -= 1.0;
                self.port.push_back(Request {
                    latency: 0.0,
                    bytes,
                    write: false,
                });
                self.port.extend(write);
                self.step = Some(Step {
                    cycles,
                    first_of_tile,
                });
                return;
            }
            // A run of equal steps, in closed form.
            current.count = 1.0;
            let each = cycles.max(((bytes - SLACK) / self.rates.port).ceil());
            let cycles = (count - 1.0) * each;
            self.step = Some(Step {
                cycles,
                first_of_tile,
            });
            return;
        }
        if self.claimed.is_empty()
            && let Some(task) = queue.next()
        {
            self.claimed = self.batches(task, raster, report);
            self.places.push_back(task.at);
        }
        let next = self.claimed.pop_front();
        let before = std::mem::replace(&mut self.current, next);
        if let Some(next) = next {
            let cold = before.map_or(!self.started, |batch| batch.wasted);
            let latency = if cold {
                f64::from(self.rates.latency)
            } else {
                0.0
            };
            self.port.push_back(Request {
                latency,
                bytes: next.bytes,
                write: false,
            });
        }
        self.started = true;
        self.port.extend(write);
        self.tile_ended = before
            .filter(|batch| batch.last_of_tile)
            .map(|batch| batch.mode);
        if before.is_some_and(|batch| batch.first_of_tile)
            && let Some(at) = self.places.pop_front()
        {
            let (module, begin, end) = (0, self.now, self.now);
            self.spans.push(TileSpan {
                module,
                at,
                begin,
                end,
            });
        }
        if before.is_some() || next.is_some() {
            self.step = Some(Step {
                cycles: before.map_or(0.0, |batch| batch.cycles),
                first_of_tile: before.is_some_and(|batch| batch.first_of_tile),
            });
        }
    }

    /// The write of a tile whose last batch has just been evaluated.
    fn end_tile(&mut self, raster: &Rasterizer, report: &mut RasterReport) -> Option<Request> {
        let mode = self.tile_ended.take()?;
        if let Some(span) = self.spans.last_mut() {
            span.end = self.now;
        }
        let bytes = f64::from(raster.tile_bytes());
        report.bytes_out += bytes;
        // The last pixels must leave the pipeline before they are written.
        let latency = f64::from(raster.latency(mode));
        Some(Request {
            latency,
            bytes,
            write: true,
        })
    }

    /// The batches of a tile, with equal ones grouped.
    fn batches(
        &mut self,
        task: &Task,
        raster: &Rasterizer,
        report: &mut RasterReport,
    ) -> VecDeque<Batches> {
        let mut out = VecDeque::new();
        for part in &task.parts {
            let mut begin = f64::from(raster.tile_overhead);
            report.modules.controller += begin;
            if let Some(before) = self.mode.filter(|&mode| mode != part.mode) {
                let switch = f64::from(raster.latency(before) + raster.mode_switch);
                report.modules.mode_switch += switch;
                report.switches += 1.0;
                begin += switch;
            }
            self.mode = Some(part.mode);
            part_batches(part, raster, begin, report, &mut out);
        }
        if let Some(first) = out.front_mut() {
            first.first_of_tile = true;
        }
        if let Some(last) = out.iter_mut().rfind(|batches| !batches.wasted) {
            last.last_of_tile = true;
        }
        out
    }
}

/// Cycles of the primitives `from..to` of a segment. The segment's groups are spread evenly.
fn cycles_of(segment: &Segment, [from, to]: [u32; 2], mode: Mode, raster: &Rasterizer) -> [f64; 3] {
    let n = u64::from(segment.primitives);
    let low = segment.groups / n;
    let before = |k: u32| u64::from(k) * segment.groups / n;
    let count = u64::from(to - from);
    let high = before(to) - before(from) - count * low;
    let [mut busy, mut dependency, mut controller] = [0.0; 3];
    for (groups, count) in [(low, count - high), (low + 1, high)] {
        busy += (raster.busy_cycles(mode, groups) * count) as f64;
        dependency += (raster.waiting_cycles(mode, groups, segment.open) * count) as f64;
        controller += (Rasterizer::looking_cycles(groups) * count) as f64;
    }
    [busy, dependency, controller]
}

/// The batches of one draw in a tile. The first takes `begin` cycles more.
fn part_batches(
    part: &Part,
    raster: &Rasterizer,
    begin: f64,
    report: &mut RasterReport,
    out: &mut VecDeque<Batches>,
) {
    let size = raster.batch;
    let bytes_each = f64::from(raster.primitive_bytes());
    let mut listed = part.needed + part.left_over;
    report.pairs += f64::from(part.needed);
    let mut fetched = 0.0;
    let mut push = |count: u32, cycles: f64| {
        let primitives = listed.min(size * count);
        listed -= primitives;
        let bytes = f64::from(primitives) * bytes_each;
        fetched += bytes;
        out.push_back(Batches {
            mode: part.mode,
            count: f64::from(count),
            cycles,
            bytes: bytes / f64::from(count),
            wasted: false,
            first_of_tile: false,
            last_of_tile: false,
        });
    };
    let mut cycles = begin;
    let mut filled = 0;
    // A draw's first batch is not grouped: it takes longer, and may have to wait for pixels to be written.
    let mut alone = true;
    for segment in &part.segments {
        let mut spend = |range: [u32; 2]| {
            let [busy, dependency, controller] = cycles_of(segment, range, part.mode, raster);
            report.modules.busy += busy;
            report.modules.dependency += dependency;
            report.modules.controller += controller;
            busy + dependency + controller
        };
        let even = segment.groups.is_multiple_of(u64::from(segment.primitives));
        let mut at = 0;
        while at < segment.primitives {
            let left = segment.primitives - at;
            let whole = left / size;
            // The last batch of a list may be partly filled.
            if filled == 0 && !alone && whole >= 1 && even {
                let total = spend([at, at + whole * size]);
                push(whole, total / f64::from(whole));
                at += whole * size;
                continue;
            }
            let taken = left.min(size - filled);
            cycles += spend([at, at + taken]);
            filled += taken;
            at += taken;
            if filled == size {
                push(1, cycles);
                (cycles, filled, alone) = (0.0, 0, false);
            }
        }
        report.add_evaluations(part.mode, (segment.groups * 16) as f64);
    }
    if filled > 0 {
        push(1, cycles);
    }
    report.bytes_in += fetched;
    if listed > 0 {
        let bytes = f64::from(listed.min(size)) * bytes_each;
        report.bytes_in += bytes;
        report.bytes_wasted += bytes;
        out.push_back(Batches {
            mode: part.mode,
            count: 1.0,
            cycles: 0.0,
            bytes,
            wasted: true,
            first_of_tile: false,
            last_of_tile: false,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::even_frame;
    use std::collections::HashSet;

    #[test]
    fn every_tile_is_in_one_module_at_a_time() {
        let frame = even_frame([320, 200], 20_000, 0.3);
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let (report, spans) = rasterize_tiles(&frame, &config, 0.0);
        assert_eq!(report, rasterize(&frame, &config, 0.0));
        let places: HashSet<_> = spans.iter().map(|span| span.at).collect();
        assert_eq!((spans.len(), places.len()), (260, 260));
        for pair in spans
            .windows(2)
            .filter(|pair| pair[0].module == pair[1].module)
        {
            assert!(pair[0].end <= pair[1].begin);
        }
        let in_tiles: f64 = spans.iter().map(|span| span.end - span.begin).sum();
        let modules = &report.modules;
        assert!(in_tiles >= modules.busy && in_tiles <= modules.total() + 1e-6);
        assert!(spans.iter().all(|span| span.end <= report.cycles + 1e-6));
    }
}
