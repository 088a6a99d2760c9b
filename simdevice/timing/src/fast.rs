//! The fast model: closed form from event to event.
//!
//! With two halves of a tile buffer, a module proceeds in steps: while one batch is evaluated, the next is fetched, and
//! the longer of the two is the step's length. Without contention for memory, `n` equal steps take `n max(c, b / h)`
//! cycles, for `c` cycles of evaluation and `b` bytes a step at `h` bytes per cycle, so they are not simulated one by
//! one. If the modules' ports together are wider than main memory, steps are simulated one by one: time advances to the
//! next end of an evaluation, a fetch or a write, each at a rate that is constant in between.
//!
//! All ports that move bytes have the same rate. Therefore the ends of transfers are known as they begin, on a clock
//! that counts the bytes that each of these ports has moved: rates change the speed of that clock, and not the order of
//! the ends. An event concerns one module, and the next ends of all modules are kept in order.

use crate::config::{Config, Rasterizer};
use crate::plan::{self, Division, Part, Rates, Task};
use crate::raster::RasterReport;
use crate::work::{FrameWork, Mode, Segment};
use std::collections::VecDeque;

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
pub fn rasterize_tiles(frame: &FrameWork, config: &Config, others_gb_s: f64) -> (RasterReport, Vec<TileSpan>) {
    let tasks = plan::tasks(frame, &Division::of(&config.rasterizer));
    rasterize_tasks(&tasks, config, others_gb_s)
}

/// Rasterizes the tasks of a frame, as [`rasterize_tiles`] does.
pub fn rasterize_tasks(tasks: &[Task], config: &Config, others_gb_s: f64) -> (RasterReport, Vec<TileSpan>) {
    rasterize_batches(&FrameBatches::new(tasks, &config.rasterizer), config, others_gb_s)
}

/// Rasterizes the batches of a frame, as [`rasterize_tiles`] does. They must be of the configuration's rasterizer with
/// any number of modules.
pub(crate) fn rasterize_batches(
    frame: &FrameBatches,
    config: &Config,
    others_gb_s: f64,
) -> (RasterReport, Vec<TileSpan>) {
    let rates = Rates::new(config, others_gb_s);
    let mut report = frame.work.clone();
    let mut queue = frame.tiles();
    let raster = &config.rasterizer;
    let contended = rates.port * f64::from(raster.modules) > rates.memory;
    let mut modules: Vec<_> = (0..raster.modules).map(|_| Module::new(rates, contended)).collect();
    if modules.is_empty() {
        report = RasterReport::default();
    }
    let now = run(&mut modules, rates, &mut queue, raster, &mut report);
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

/// The bytes after which the clock of bytes begins anew, so that its numbers keep their digits.
const NEW_CLOCK: f64 = 65_536.0;

/// Runs modules until the queue is empty, and returns the cycles. At each event the rates of all ports may change.
fn run<'a>(
    modules: &mut [Module<'a>],
    rates: Rates,
    queue: &mut impl Iterator<Item = Tile<'a>>,
    raster: &Rasterizer,
    report: &mut RasterReport,
) -> f64 {
    let mut clock = Clock::default();
    let mut ends = Ends::new(modules.len());
    let mut asking = 0;
    for (index, module) in modules.iter_mut().enumerate() {
        module.begin(&clock, queue, raster, report);
        asking += usize::from(module.asks());
        ends.set(index, module.ends());
    }
    loop {
        let share = rates.port.min(rates.memory / asking.max(1) as f64);
        let [time, moved] = ends.first();
        // A port moves one request in a cycle: the rest of the request's last cycle is lost.
        let transfers = clock.now + whole_cycles((moved - clock.moved) / share);
        let next = time.min(transfers);
        if !next.is_finite() {
            return clock.now;
        }
        if asking > 0 {
            clock.moved += (next - clock.now) * share;
        }
        clock.now = next;
        // Modules claim tiles in their own order if they end one at the same time.
        while let Some(index) = ends.due([clock.now, clock.moved]) {
            let module = &mut modules[index];
            asking -= usize::from(module.asks());
            module.end(&clock, queue, raster, report);
            asking += usize::from(module.asks());
            ends.set(index, module.ends());
        }
        if clock.moved > NEW_CLOCK {
            for (index, module) in modules.iter_mut().enumerate() {
                module.restart_clock(clock.moved);
                ends.set(index, module.ends());
            }
            clock.moved = 0.0;
        }
    }
}

/// The time on two clocks.
#[derive(Clone, Copy, Debug, Default)]
struct Clock {
    /// Cycles from the frame's first fetch.
    now: f64,
    /// The bytes that a port would have moved if it had always asked.
    moved: f64,
}

/// The next ends of each module on both clocks.
#[derive(Debug)]
struct Ends {
    /// The ends of each module.
    of: Vec<[f64; 2]>,
    /// On each clock, the finite ends and their modules, in order, with the first at the back. Equal ends are in the order
    /// of modules.
    queues: [Vec<(f64, usize)>; 2],
}

impl Ends {
    fn new(count: usize) -> Self {
        let queue = || Vec::with_capacity(count);
        Self { of: vec![[f64::INFINITY; 2]; count], queues: [queue(), queue()] }
    }

    /// The first ends of all modules.
    fn first(&self) -> [f64; 2] {
        let first = |queue: &Vec<(f64, usize)>| queue.last().map_or(f64::INFINITY, |&(end, _)| end);
        let [times, moved] = &self.queues;
        [first(times), first(moved)]
    }

    fn set(&mut self, index: usize, ends: [f64; 2]) {
        let before = std::mem::replace(&mut self.of[index], ends);
        for ((queue, before), end) in self.queues.iter_mut().zip(before).zip(ends) {
            if before == end {
                continue;
            }
            if before.is_finite()
                && let Some(place) = queue.iter().rposition(|&(_, module)| module == index)
            {
                queue.remove(place);
            }
            if end.is_finite() {
                let place = queue.iter().position(|&(other, module)| (other, module) < (end, index));
                queue.insert(place.unwrap_or(queue.len()), (end, index));
            }
        }
    }

    /// The first module, by its number, with an end that is not after `now`.
    fn due(&self, now: [f64; 2]) -> Option<usize> {
        let mut first = usize::MAX;
        for (queue, now) in self.queues.iter().zip(now) {
            for &(end, module) in queue.iter().rev() {
                if end > now {
                    break;
                }
                first = first.min(module);
            }
        }
        (first < usize::MAX).then_some(first)
    }
}

/// The least whole number of cycles that is not less than a number of at most 2^53, or infinity.
fn whole_cycles(cycles: f64) -> f64 {
    if cycles > (1u64 << 53) as f64 {
        return cycles;
    }
    let whole = cycles as i64 as f64;
    if whole < cycles { whole + 1.0 } else { whole }
}

/// A module's current step, except for its port's transfers.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// The time at which the step begins.
    begin: f64,
    /// Cycles of evaluation.
    cycles: f64,
    /// The time at which evaluation ends; infinite while it waits for pixels to be written.
    end: f64,
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

/// The state of a port's first transfer.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Transfer {
    /// There is none, or it has not begun.
    None,
    /// Its first byte comes at this time.
    Waiting(f64),
    /// Bytes move until a port has moved this many.
    Moving(f64),
    /// Bytes move until this time, since nobody else takes a part of the rate.
    Alone(f64),
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
    first_of_part: bool,
    first_of_tile: bool,
    last_of_tile: bool,
}

/// The batches of a frame's tasks. Rasterizers that differ in the number of modules, or in memory, share them.
#[derive(Debug, Default)]
pub(crate) struct FrameBatches {
    /// Place of each task, and the end of its batches in `batches`.
    tasks: Vec<([u32; 2], usize)>,
    batches: Vec<Batches>,
    /// The work that does not depend on the modules that take the tasks.
    work: RasterReport,
}

/// The batches of a task, and its place.
#[derive(Clone, Copy, Debug)]
struct Tile<'a> {
    at: [u32; 2],
    batches: &'a [Batches],
}

impl FrameBatches {
    /// The batches of tasks for a rasterizer.
    pub(crate) fn new(tasks: &[Task], raster: &Rasterizer) -> Self {
        let mut all = Self::default();
        for task in tasks {
            let begin = all.batches.len();
            for part in &task.parts {
                part_batches(part, raster, &mut all.work, &mut all.batches);
            }
            let of_task = &mut all.batches[begin..];
            if let Some(first) = of_task.first_mut() {
                first.first_of_tile = true;
            }
            if let Some(last) = of_task.iter_mut().rfind(|batches| !batches.wasted) {
                last.last_of_tile = true;
            }
            all.tasks.push((task.at, all.batches.len()));
        }
        all
    }

    /// The batches of each task, in order.
    fn tiles(&self) -> impl Iterator<Item = Tile<'_>> {
        let mut begin = 0;
        self.tasks
            .iter()
            .map(move |&(at, end)| Tile { at, batches: &self.batches[std::mem::replace(&mut begin, end)..end] })
    }
}

#[derive(Debug)]
struct Module<'a> {
    /// The time, in cycles from the frame's first fetch.
    now: f64,
    /// Tiles that were claimed and whose evaluation has not begun.
    places: VecDeque<[u32; 2]>,
    /// Tiles whose evaluation has begun. The last may not have ended.
    spans: Vec<TileSpan>,
    rates: Rates,
    contended: bool,
    claimed: &'a [Batches],
    current: Option<Batches>,
    started: bool,
    mode: Option<Mode>,
    step: Option<Step>,
    port: VecDeque<Request>,
    /// The number of writes in `port`.
    writes: usize,
    transfer: Transfer,
    /// Cycles spent in steps.
    lasted: f64,
    /// The mode of the tile whose last batch the step evaluates, if it does.
    tile_ended: Option<Mode>,
}

impl<'a> Module<'a> {
    fn new(rates: Rates, contended: bool) -> Self {
        Self {
            now: 0.0,
            places: VecDeque::new(),
            spans: Vec::new(),
            rates,
            contended,
            claimed: &[],
            current: None,
            started: false,
            mode: None,
            step: None,
            port: VecDeque::new(),
            writes: 0,
            transfer: Transfer::None,
            lasted: 0.0,
            tile_ended: None,
        }
    }

    /// True if the port takes a part of the memory's rate.
    fn asks(&self) -> bool {
        matches!(self.transfer, Transfer::Moving(_))
    }

    /// True if the step has ended, with all transfers that it waits for.
    fn is_done(&self) -> bool {
        self.step.is_some_and(|step| step.end <= self.now && self.port.len() == self.writes)
    }

    /// The next end on each clock: of an evaluation, of a latency or of a transfer.
    fn ends(&self) -> [f64; 2] {
        let evaluation = match self.step {
            Some(step) if step.end > self.now => step.end,
            _ => f64::INFINITY,
        };
        match self.transfer {
            Transfer::None => [evaluation, f64::INFINITY],
            Transfer::Waiting(time) | Transfer::Alone(time) => [evaluation.min(time), f64::INFINITY],
            Transfer::Moving(bytes) => [evaluation, bytes],
        }
    }

    /// Claims the first tile.
    fn begin(
        &mut self,
        clock: &Clock,
        queue: &mut impl Iterator<Item = Tile<'a>>,
        raster: &Rasterizer,
        report: &mut RasterReport,
    ) {
        self.proceed(queue, raster, report);
        self.transfer_next(clock);
    }

    /// Takes note that the clock of bytes begins anew after `moved`.
    fn restart_clock(&mut self, moved: f64) {
        if let Transfer::Moving(until) = &mut self.transfer {
            *until -= moved;
        }
    }

    /// Ends what ends at this time, and goes on.
    fn end(
        &mut self,
        clock: &Clock,
        queue: &mut impl Iterator<Item = Tile<'a>>,
        raster: &Rasterizer,
        report: &mut RasterReport,
    ) {
        self.now = clock.now;
        let moved = match self.transfer {
            Transfer::None => false,
            Transfer::Waiting(time) => {
                if time <= clock.now {
                    self.move_bytes(clock);
                }
                false
            }
            Transfer::Moving(until) => until <= clock.moved,
            Transfer::Alone(time) => time <= clock.now,
        };
        if moved {
            self.transfer = Transfer::None;
            let request = self.port.pop_front();
            self.writes -= usize::from(request.is_some_and(|request| request.write));
        }
        // Steps of no length are followed at once.
        while self.is_done() {
            self.proceed(queue, raster, report);
        }
        // A tile may end while the next batch is still being fetched.
        if self.step.is_some_and(|step| step.end <= self.now) {
            let write = self.end_tile(raster, report);
            self.ask(write);
        }
        // A half of the buffer may be free now for the pixels of a tile that waits.
        if moved
            && self.writes <= 1
            && let Some(step) = &mut self.step
            && step.end == f64::INFINITY
        {
            step.end = self.now + step.cycles;
        }
        self.transfer_next(clock);
    }

    /// Begins the port's next transfer, if it has one and none has begun.
    fn transfer_next(&mut self, clock: &Clock) {
        if self.transfer != Transfer::None {
            return;
        }
        match self.port.front() {
            Some(request) if request.latency > 0.0 => {
                self.transfer = Transfer::Waiting(self.now + request.latency);
            }
            Some(_) => self.move_bytes(clock),
            None => {}
        }
    }

    /// Begins to move the bytes of the port's first transfer.
    fn move_bytes(&mut self, clock: &Clock) {
        let bytes = self.port.front().map_or(0.0, |request| request.bytes);
        // Every transfer takes some time.
        let bytes = (bytes - SLACK).max(SLACK);
        self.transfer = if self.contended {
            Transfer::Moving(clock.moved + bytes)
        } else {
            Transfer::Alone(self.now + (bytes / self.rates.port).ceil())
        };
    }

    /// Puts a request, if there is one, into the port's queue.
    fn ask(&mut self, request: Option<Request>) {
        self.writes += usize::from(request.is_some_and(|request| request.write));
        if let Some(request) = request {
            self.port.push_back(request);
        }
    }

    /// Begins a step. The first of a tile waits until a half of the buffer is free for its pixels: two halves hold
    /// pixels.
    fn begin_step(&mut self, cycles: f64, first_of_tile: bool) {
        let is_blocked = first_of_tile && cycles > 0.0 && self.writes > 1;
        let end = if is_blocked { f64::INFINITY } else { self.now + cycles };
        self.step = Some(Step { begin: self.now, cycles, end });
    }

    /// Goes on to the next step, or to a run of equal steps, if there is any.
    fn proceed(&mut self, queue: &mut impl Iterator<Item = Tile<'a>>, raster: &Rasterizer, report: &mut RasterReport) {
        if let Some(step) = self.step.take() {
            self.lasted += self.now - step.begin;
        }
        let write = self.end_tile(raster, report);
        if let Some(current) = &mut self.current
            && current.count > 1.0
        {
            let Batches { count, cycles, bytes, .. } = *current;
            if self.contended || write.is_some() || !self.port.is_empty() {
                current.count -= 1.0;
                self.ask(Some(Request { latency: 0.0, bytes, write: false }));
                self.ask(write);
                self.begin_step(cycles, false);
                return;
            }
            // A run of equal steps, in closed form.
            current.count = 1.0;
            let each = cycles.max(((bytes - SLACK) / self.rates.port).ceil());
            self.begin_step((count - 1.0) * each, false);
            return;
        }
        if self.claimed.is_empty()
            && let Some(tile) = queue.next()
        {
            self.places.push_back(tile.at);
            self.claimed = tile.batches;
        }
        let next = self.claim(raster, report);
        let before = std::mem::replace(&mut self.current, next);
        if let Some(next) = next {
            let cold = before.map_or(!self.started, |batch| batch.wasted);
            let latency = if cold { f64::from(self.rates.latency) } else { 0.0 };
            self.ask(Some(Request { latency, bytes: next.bytes, write: false }));
        }
        self.started = true;
        self.ask(write);
        self.tile_ended = before.filter(|batch| batch.last_of_tile).map(|batch| batch.mode);
        if before.is_some_and(|batch| batch.first_of_tile)
            && let Some(at) = self.places.pop_front()
        {
            let (module, begin, end) = (0, self.now, self.now);
            self.spans.push(TileSpan { module, at, begin, end });
        }
        if before.is_some() || next.is_some() {
            let cycles = before.map_or(0.0, |batch| batch.cycles);
            self.begin_step(cycles, before.is_some_and(|batch| batch.first_of_tile));
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
        Some(Request { latency, bytes, write: true })
    }

    /// The next batches of the claimed tile.
    fn claim(&mut self, raster: &Rasterizer, report: &mut RasterReport) -> Option<Batches> {
        let (&first, rest) = self.claimed.split_first()?;
        self.claimed = rest;
        let mut next = first;
        if next.first_of_part {
            if let Some(before) = self.mode.filter(|&mode| mode != next.mode) {
                let switch = f64::from(raster.latency(before) + raster.mode_switch);
                report.modules.mode_switch += switch;
                report.switches += 1.0;
                next.cycles += switch;
            }
            self.mode = Some(next.mode);
        }
        Some(next)
    }
}

/// Cycles of the primitives `from..to` of a segment. The segment's groups and its known waits are spread evenly.
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
    if let Some(waiting) = raster.known_waiting_cycles(mode, segment) {
        let before = |k: u32| u64::from(k) * waiting / n;
        dependency = (before(to) - before(from)) as f64;
    }
    [busy, dependency, controller]
}

/// The batches of one draw in a tile, with equal ones grouped.
fn part_batches(part: &Part, raster: &Rasterizer, report: &mut RasterReport, out: &mut Vec<Batches>) {
    let first = out.len();
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
        out.push(Batches {
            mode: part.mode,
            count: f64::from(count),
            cycles,
            bytes: bytes / f64::from(count),
            wasted: false,
            first_of_part: false,
            first_of_tile: false,
            last_of_tile: false,
        });
    };
    let mut cycles = f64::from(raster.tile_overhead);
    report.modules.controller += cycles;
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
        let waiting = raster.known_waiting_cycles(part.mode, segment).unwrap_or(0);
        let primitives = u64::from(segment.primitives);
        let even = segment.groups.is_multiple_of(primitives) && waiting.is_multiple_of(primitives);
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
        out.push(Batches {
            mode: part.mode,
            count: 1.0,
            cycles: 0.0,
            bytes,
            wasted: true,
            first_of_part: false,
            first_of_tile: false,
            last_of_tile: false,
        });
    }
    if let Some(batches) = out.get_mut(first) {
        batches.first_of_part = true;
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
        for pair in spans.windows(2).filter(|pair| pair[0].module == pair[1].module) {
            assert!(pair[0].end <= pair[1].begin);
        }
        let in_tiles: f64 = spans.iter().map(|span| span.end - span.begin).sum();
        let modules = &report.modules;
        assert!(in_tiles >= modules.busy && in_tiles <= modules.total() + 1e-6);
        assert!(spans.iter().all(|span| span.end <= report.cycles + 1e-6));
    }
    #[test]
    fn ends_come_in_the_order_of_time_and_then_of_modules() {
        for count in [1, 2, 3, 15, 16, 33] {
            let mut ends = Ends::new(count);
            let mut all = vec![[f64::INFINITY; 2]; count];
            assert_eq!(ends.due([1e300; 2]), None);
            for step in 0..2000_usize {
                // Multiplication by an odd number scatters the steps.
                let scattered = step.wrapping_mul(2_654_435_761) >> 7;
                let index = scattered % count;
                let end = |shift: usize| match scattered >> shift & 31 {
                    0..8 => f64::INFINITY,
                    number => number as f64,
                };
                all[index] = [end(8), end(13)];
                ends.set(index, all[index]);
                let least = |clock: usize| {
                    let of = all.iter().map(|ends| ends[clock]);
                    of.fold(f64::INFINITY, f64::min)
                };
                assert_eq!(ends.first(), [least(0), least(1)]);
                let now = [(step % 29) as f64, (step % 31) as f64];
                let is_due = |ends: &[f64; 2]| ends[0] <= now[0] || ends[1] <= now[1];
                assert_eq!(ends.due(now), all.iter().position(is_due));
            }
        }
    }

    #[test]
    fn a_new_clock_of_bytes_changes_no_cycle() {
        // Transfers of this size begin the clock anew many times; 15 ports ask for more than there is.
        let settings = ["bandwidth_gb_s=20", "batch=64"].map(str::to_owned);
        let config = Config::preset("paper-15x16", &settings).unwrap();
        let short = rasterize(&even_frame([240, 16], 15 * 640, 0.3), &config, 0.0);
        let long = rasterize(&even_frame([240, 16], 15 * 640_000, 0.3), &config, 0.0);
        assert!(long.bytes_in / 15.0 > 100.0 * NEW_CLOCK);
        // The port of each module moves a fifteenth of 18 bytes a cycle.
        let cycles = |report: &RasterReport| report.bytes_in / 18.0;
        let rest = long.cycles - short.cycles - (cycles(&long) - cycles(&short));
        // Each transfer may lose a part of its last cycle.
        assert!((0.0..=9990.0).contains(&rest), "{rest}");
    }
}
