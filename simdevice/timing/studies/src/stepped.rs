//! The cycle-stepped model: every module's fetch engine, buffers and PEs, one clock cycle at a time. It is slow and
//! simple, and the reference for the fast model.

use std::collections::VecDeque;
use timing::config::{Config, Rasterizer};
use timing::plan::{self, Division, Part, Rates, Task};
use timing::raster::{ModuleCycles, RasterReport};
use timing::work::{FrameWork, Mode};

/// Rasterizes a frame, cycle by cycle, while other units move `others_gb_s` to and from main memory.
pub fn rasterize(frame: &FrameWork, config: &Config, others_gb_s: f64) -> RasterReport {
    let tasks = plan::tasks(frame, &Division::of(&config.rasterizer));
    let rates = Rates::new(config, others_gb_s);
    let mut report = RasterReport::default();
    let mut queue = tasks.iter();
    let mut modules: Vec<_> = (0..config.rasterizer.modules).map(|_| Module::default()).collect();
    let mut cycles = 0u64;
    while !tasks.is_empty() {
        for module in &mut modules {
            module.claim(&mut queue, config, rates.latency, &mut report);
            let write = module.ended.take();
            module.port.extend(write);
        }
        if modules.iter().all(Module::is_done) {
            break;
        }
        for module in &mut modules {
            module.step(config, &mut report.modules);
        }
        // The arbiter gives every requesting port the same share.
        let asking = modules.iter().filter(|module| module.wants_memory()).count();
        let share = rates.port.min(rates.memory / asking.max(1) as f64);
        for module in &mut modules {
            module.transfer(share);
        }
        cycles += 1;
    }
    report.cycles = cycles as f64;
    report.switches = modules.iter().map(|module| f64::from(module.switches)).sum();
    report.modules.idle = report.cycles * modules.len() as f64 - report.modules.total();
    report
}

/// A batch of primitives in half of a tile buffer.
#[derive(Clone, Debug)]
struct Batch {
    mode: Mode,
    /// The groups of 16 pixels of each primitive; empty if the batch was fetched and is then discarded.
    groups: Vec<Groups>,
    bytes: f64,
    first_of_part: bool,
    first_of_tile: bool,
    last_of_tile: bool,
    /// True if the fetch could not be made ahead, so that the module waits for its latency.
    cold: bool,
}

/// The groups of 16 pixels of a primitive.
#[derive(Clone, Copy, Debug)]
struct Groups {
    /// The number of groups in which it is evaluated.
    evaluated: u64,
    /// The number of groups in which it may be evaluated.
    open: u64,
    /// The cycles that it waits for transmittances, if they are known.
    waiting: Option<u64>,
}

/// A transfer of a port. A port does its transfers in order.
#[derive(Debug)]
struct Request {
    latency: u32,
    bytes: f64,
    /// The fetched batch; None for a write.
    batch: Option<Batch>,
}

/// The state of the PEs.
#[derive(Debug)]
struct Computation {
    batch: Batch,
    /// The number of primitives begun.
    next: usize,
    /// The cycles left of each kind, spent in this order.
    switch: u32,
    controller: u32,
    busy: u64,
    dependency: u64,
}

#[derive(Debug, Default)]
struct Module {
    /// Batches that are claimed but not requested.
    claimed: VecDeque<Batch>,
    port: VecDeque<Request>,
    /// Batches in a buffer that have not begun.
    ready: VecDeque<Batch>,
    computing: Option<Computation>,
    mode: Option<Mode>,
    switches: u32,
    started: bool,
    after_waste: bool,
    out_of_tasks: bool,
    /// The write of a tile that ended in the last cycle.
    ended: Option<Request>,
}

impl Module {
    /// Requests the next batch as soon as half of the tile buffer is free.
    fn claim<'a>(
        &mut self,
        queue: &mut impl Iterator<Item = &'a Task>,
        config: &Config,
        latency: u32,
        report: &mut RasterReport,
    ) {
        let fetching = self.port.iter().filter(|request| request.batch.is_some()).count();
        let held = self.ready.len() + usize::from(self.computing.is_some());
        // One fetch at a time: the second begins when the first has ended.
        if fetching > 0 || held >= 2 {
            return;
        }
        if self.claimed.is_empty() {
            match queue.next() {
                Some(task) => self.claimed = batches(task, config, &mut self.after_waste, report),
                None => self.out_of_tasks = true,
            }
        }
        if let Some(batch) = self.claimed.pop_front() {
            let cold = batch.cold || !self.started;
            self.started = true;
            self.port.push_back(Request {
                latency: if cold { latency } else { 0 },
                bytes: batch.bytes,
                batch: Some(batch),
            });
        }
    }

    fn is_done(&self) -> bool {
        self.out_of_tasks
            && self.claimed.is_empty()
            && self.port.is_empty()
            && self.ready.is_empty()
            && self.computing.is_none()
    }

    fn wants_memory(&self) -> bool {
        self.port.front().is_some_and(|request| request.latency == 0)
    }

    /// Moves up to `share` bytes.
    fn transfer(&mut self, share: f64) {
        let Some(request) = self.port.front_mut() else {
            return;
        };
        if request.latency > 0 {
            request.latency -= 1;
            return;
        }
        request.bytes -= share;
        if request.bytes <= 1e-6
            && let Some(request) = self.port.pop_front()
        {
            self.ready.extend(request.batch);
        }
    }

    /// One cycle of the PEs.
    fn step(&mut self, config: &Config, spent: &mut ModuleCycles) {
        if self.computing.is_none() {
            self.begin(config);
        }
        let Some(work) = &mut self.computing else {
            if !(self.out_of_tasks
                && self.claimed.is_empty()
                && self.ready.is_empty()
                && self.port.iter().all(|r| r.batch.is_none()))
            {
                spent.memory += 1.0;
            }
            return;
        };
        work.spend(config, spent);
        if work.is_done() {
            let batch = &work.batch;
            if batch.last_of_tile {
                let latency = config.rasterizer.latency(batch.mode);
                let bytes = f64::from(config.rasterizer.tile_bytes());
                // The last pixels must leave the pipeline before they are written.
                self.ended = Some(Request { latency, bytes, batch: None });
            }
            self.computing = None;
        }
    }

    fn begin(&mut self, config: &Config) {
        let held = self.port.iter().filter(|request| request.batch.is_none()).count();
        while let Some(batch) = self.ready.pop_front() {
            // Two halves hold pixels: one is free once the tile before the last is written.
            if batch.first_of_tile && held > 1 {
                self.ready.push_front(batch);
                return;
            }
            if batch.groups.is_empty() {
                // The batch is discarded: the buffer is free again at once.
                continue;
            }
            let raster = &config.rasterizer;
            let mut switch = 0;
            if let Some(before) = self.mode.filter(|&mode| mode != batch.mode) {
                switch = raster.latency(before) + raster.mode_switch;
                self.switches += 1;
            }
            self.mode = Some(batch.mode);
            let mut work = Computation {
                switch,
                controller: if batch.first_of_part { raster.tile_overhead } else { 0 },
                next: 0,
                busy: 0,
                dependency: 0,
                batch,
            };
            work.advance(config);
            self.computing = Some(work);
            return;
        }
    }
}

impl Computation {
    /// Begins the next primitive if the last one has ended.
    fn advance(&mut self, config: &Config) {
        if self.busy > 0 || self.dependency > 0 {
            return;
        }
        let Some(&groups) = self.batch.groups.get(self.next) else {
            return;
        };
        self.next += 1;
        let (raster, mode) = (&config.rasterizer, self.batch.mode);
        if groups.evaluated == 0 {
            self.controller += 1;
            self.dependency = groups.waiting.unwrap_or(0);
            return;
        }
        self.busy = raster.busy_cycles(mode, groups.evaluated);
        let estimate = || raster.waiting_cycles(mode, groups.evaluated, groups.open);
        self.dependency = groups.waiting.unwrap_or_else(estimate);
    }

    fn spend(&mut self, config: &Config, spent: &mut ModuleCycles) {
        if self.switch > 0 {
            self.switch -= 1;
            spent.mode_switch += 1.0;
            return;
        }
        if self.controller > 0 {
            self.controller -= 1;
            spent.controller += 1.0;
        } else if self.busy > 0 {
            self.busy -= 1;
            spent.busy += 1.0;
        } else if self.dependency > 0 {
            self.dependency -= 1;
            spent.dependency += 1.0;
        }
        if self.controller == 0 {
            self.advance(config);
        }
    }

    fn is_done(&self) -> bool {
        self.switch == 0
            && self.controller == 0
            && self.busy == 0
            && self.dependency == 0
            && self.next == self.batch.groups.len()
    }
}

/// Divides a tile's lists into batches.
fn batches(task: &Task, config: &Config, after_waste: &mut bool, report: &mut RasterReport) -> VecDeque<Batch> {
    let raster = &config.rasterizer;
    let mut out = VecDeque::new();
    for part in &task.parts {
        let groups = groups_of_each(part, raster);
        let pixels = groups.iter().map(|groups| groups.evaluated).sum::<u64>() * 16;
        report.add_evaluations(part.mode, pixels as f64);
        report.pairs += f64::from(part.needed);
        let mut left = part.needed + part.left_over;
        for (index, groups) in groups.chunks(raster.batch as usize).enumerate() {
            let fetched = left.min(raster.batch);
            left -= fetched;
            out.push_back(Batch {
                mode: part.mode,
                groups: groups.to_vec(),
                bytes: f64::from(fetched * raster.primitive_bytes()),
                first_of_part: index == 0,
                first_of_tile: false,
                last_of_tile: false,
                cold: std::mem::take(after_waste),
            });
        }
        if left > 0 {
            // The next batch was requested before the tile was found to be finished.
            let bytes = f64::from(left.min(raster.batch) * raster.primitive_bytes());
            report.bytes_wasted += bytes;
            *after_waste = true;
            out.push_back(Batch {
                mode: part.mode,
                groups: Vec::new(),
                bytes,
                first_of_part: false,
                first_of_tile: false,
                last_of_tile: false,
                cold: false,
            });
        }
    }
    if let Some(first) = out.front_mut() {
        first.first_of_tile = true;
    }
    report.bytes_in += out.iter().map(|batch| batch.bytes).sum::<f64>();
    if let Some(last) = out.iter_mut().rfind(|batch| !batch.groups.is_empty()) {
        last.last_of_tile = true;
        report.bytes_out += f64::from(raster.tile_bytes());
    }
    out
}

/// The groups of 16 pixels of each primitive: those of a segment are spread evenly, and so are known waits.
fn groups_of_each(part: &Part, raster: &Rasterizer) -> Vec<Groups> {
    let mut out = Vec::with_capacity(part.needed as usize);
    for segment in &part.segments {
        let n = u64::from(segment.primitives);
        let of = |k: u64, all: u64| (k + 1) * all / n - k * all / n;
        let waiting = raster.known_waiting_cycles(part.mode, segment);
        out.extend((0..n).map(|k| Groups {
            evaluated: of(k, segment.groups),
            open: segment.open,
            waiting: waiting.map(|waiting| of(k, waiting)),
        }));
    }
    out
}
