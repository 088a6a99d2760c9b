//! The cycle-stepped model: every module's requests, port, ring of pieces and PEs, one clock cycle at a time. It is slow and
//! simple, and the reference for the fast model.

use std::collections::VecDeque;
use timing::config::{Config, Rasterizer};
use timing::plan::{self, Division, Part, Rates, Task};
use timing::raster::{ModuleCycles, RasterReport};
use timing::ring::{self, BEGIN, DISCARD, LEAVE, MainMemory, NEXT_LIST, NEXT_PIECE, REQUEST};
use timing::work::{FrameWork, Mode};

/// Rasterizes a frame, cycle by cycle, while other units move `others_gb_s` to and from main memory.
pub fn rasterize(frame: &FrameWork, config: &Config, others_gb_s: f64) -> RasterReport {
    let tasks = plan::tasks(frame, &Division::of(&config.rasterizer));
    let rates = Rates::new(config, others_gb_s);
    let mut shared = SharedState {
        raster: &config.rasterizer,
        rates,
        memory: MainMemory::new(&rates),
        tiles: tasks.iter().map(|task| lists(task, &config.rasterizer)).collect(),
        report: RasterReport::default(),
    };
    for part in tasks.iter().flat_map(|task| &task.parts) {
        shared.report.pairs += f64::from(part.needed);
        let groups: u64 = part.segments.iter().map(|segment| segment.groups).sum();
        shared.report.add_evaluations(part.mode, (groups * 16) as f64);
    }
    if config.rasterizer.modules == 0 {
        return RasterReport::default();
    }
    let mut modules: Vec<_> = (0..config.rasterizer.modules).map(|_| Module::default()).collect();
    let mut cycles = 0;
    for now in 0.. {
        for module in &mut modules {
            while module.acts(now, &mut shared) {}
        }
        if modules.iter().all(|module| module.is_done(now, &shared)) {
            break;
        }
        for module in &mut modules {
            cycles = cycles.max(now + u64::from(!module.is_idle(now)));
            module.move_bytes(now, rates.port);
        }
    }
    let mut report = shared.report;
    report.cycles = cycles as f64;
    report.modules.idle = report.cycles * modules.len() as f64 - report.modules.total();
    report
}

/// The state that modules share.
struct SharedState<'a> {
    raster: &'a Rasterizer,
    rates: Rates,
    memory: MainMemory,
    /// Tiles that no module has claimed.
    tiles: VecDeque<VecDeque<List>>,
    report: RasterReport,
}

/// One draw in one tile.
#[derive(Clone, Debug, Default)]
struct List {
    mode: Mode,
    primitives: u32,
    /// Cycles of each piece that is evaluated.
    pieces: Vec<ModuleCycles>,
    first_of_tile: bool,
    last_of_tile: bool,
}

/// The lists of a tile.
fn lists(task: &Task, raster: &Rasterizer) -> VecDeque<List> {
    let mut lists: VecDeque<_> = task.parts.iter().map(|part| List::of(part, raster)).collect();
    if let Some(list) = lists.front_mut() {
        list.first_of_tile = true;
    }
    if let Some(list) = lists.back_mut() {
        list.last_of_tile = true;
    }
    lists
}

impl List {
    /// The groups of a segment are spread evenly over its primitives, and so are known waits.
    fn of(part: &Part, raster: &Rasterizer) -> Self {
        let mode = part.mode;
        let mut pieces = vec![ModuleCycles::default(); part.needed.div_ceil(raster.piece()) as usize];
        let mut at = 0;
        for segment in &part.segments {
            let n = u64::from(segment.primitives);
            let of = |k: u64, all: u64| (k + 1) * all / n - k * all / n;
            let known = raster.known_waiting_cycles(mode, segment);
            for k in 0..n {
                let groups = of(k, segment.groups);
                let waits = known.map_or_else(|| raster.waiting_cycles(mode, groups, segment.open), |all| of(k, all));
                let piece = &mut pieces[at / raster.piece() as usize];
                piece.busy += raster.busy_cycles(mode, groups) as f64;
                piece.dependency += waits as f64;
                piece.controller += Rasterizer::looking_cycles(groups) as f64;
                at += 1;
            }
        }
        let all: f64 = pieces.iter().map(ModuleCycles::total).sum();
        if let Some(last) = pieces.last_mut() {
            last.busy += ring::rest_cycles(part, all as u64, raster) as f64;
        }
        if let Some(first) = pieces.first_mut() {
            first.controller += f64::from(raster.tile_overhead);
        }
        let primitives = part.needed + part.left_over;
        Self { mode, primitives, pieces, first_of_tile: false, last_of_tile: false }
    }
}

/// A piece in the ring.
#[derive(Clone, Debug)]
struct Piece {
    /// Its mode, and its place in its list.
    mode: Mode,
    number: u32,
    is_last_needed: bool,
    first_of_tile: bool,
    last_of_tile: bool,
    /// Cycles of its evaluation; none if it is discarded.
    cycles: Option<ModuleCycles>,
    /// The bytes that the port has not moved, the time from which they may come, and that at which memory has moved them.
    bytes: f64,
    due: u64,
    answered: u64,
}

/// Pixels of a tile that are not written.
#[derive(Clone, Debug)]
struct Pixels {
    from: u64,
    bytes: f64,
    /// The time at which memory has moved them, if it was asked.
    answered: Option<u64>,
}

/// A module at a time.
#[derive(Debug, Default)]
struct Module {
    /// Lists of the claimed tile that are not requested whole, and the next piece of the first of them.
    claimed: VecDeque<List>,
    number: u32,
    /// The cycle before which no piece is requested.
    ask_from: u64,
    is_out_of_work: bool,
    /// The pieces that were requested and have not been left, the oldest first, and how many of them have come.
    ring: VecDeque<Piece>,
    come: usize,
    /// The time at which the evaluation of the oldest piece ends, if it has begun.
    ends: Option<u64>,
    /// The end of the last evaluation, and the time from which the next may begin.
    begin_from: u64,
    mode: Option<Mode>,
    /// The tiles that were evaluated and whose pixels are not written.
    pixels: VecDeque<Pixels>,
}

impl Module {
    /// Does something that can be done at this time. Returns false if there is nothing.
    fn acts(&mut self, now: u64, shared: &mut SharedState) -> bool {
        self.receives(now) || self.writes(now, shared) || self.evaluates(now, shared) || self.asks(now, shared)
    }

    /// True if the module has nothing to evaluate or to write.
    fn is_idle(&self, now: u64) -> bool {
        self.ring.is_empty() && self.pixels.is_empty() && self.begin_from <= now
    }

    fn is_done(&self, now: u64, shared: &SharedState) -> bool {
        self.is_idle(now) && self.claimed.is_empty() && (self.is_out_of_work || shared.tiles.is_empty())
    }

    /// Ends the transfer of a piece.
    fn receives(&mut self, now: u64) -> bool {
        let has_come = |piece: &Piece| piece.bytes <= 0.0 && piece.answered <= now;
        let comes = self.ring.get(self.come).is_some_and(has_come);
        self.come += usize::from(comes);
        comes
    }

    /// Begins or ends the write of a tile.
    fn writes(&mut self, now: u64, shared: &mut SharedState) -> bool {
        let bytes = shared.raster.tile_bytes();
        let next = self.pixels.iter_mut().find(|pixels| pixels.bytes > 0.0);
        if let Some(pixels) = next
            && pixels.answered.is_none()
            && pixels.from <= now
        {
            pixels.answered = Some(shared.memory.serve(now, shared.memory.parts(bytes)));
            return true;
        }
        let is_written = |pixels: &Pixels| pixels.bytes <= 0.0 && pixels.answered.is_some_and(|time| time <= now);
        let written = self.pixels.front().is_some_and(is_written);
        if written {
            self.pixels.pop_front();
        }
        written
    }

    /// Begins or ends the evaluation of the oldest piece, or discards it.
    fn evaluates(&mut self, now: u64, shared: &mut SharedState) -> bool {
        let Some(piece) = self.ring.front().filter(|_| self.come > 0).cloned() else { return false };
        let spent = &mut shared.report.modules;
        match (self.ends, piece.cycles) {
            (Some(end), _) if end <= now => {
                self.leave(&piece, now, shared);
                true
            }
            (Some(_), _) => false,
            (None, None) if self.begin_from <= now => {
                spent.memory += (now - self.begin_from) as f64;
                spent.controller += DISCARD as f64;
                self.begin_from = now + DISCARD;
                self.drop_piece();
                true
            }
            (None, Some(cycles)) => self.begins(&piece, &cycles, now, shared),
            _ => false,
        }
    }

    /// Begins the evaluation of a piece, if it may.
    fn begins(&mut self, piece: &Piece, cycles: &ModuleCycles, now: u64, shared: &mut SharedState) -> bool {
        let (raster, spent) = (shared.raster, &mut shared.report.modules);
        if let Some(before) = self.mode.filter(|&mode| mode != piece.mode) {
            // The pipeline drains.
            let switch = raster.latency(before) + raster.mode_switch;
            spent.mode_switch += f64::from(switch);
            shared.report.switches += 1.0;
            self.begin_from += u64::from(switch);
        }
        self.mode = Some(piece.mode);
        // Two tiles have room for their pixels.
        if self.begin_from > now || (piece.first_of_tile && self.pixels.len() > 1) {
            return false;
        }
        let waited = now - self.begin_from;
        spent.memory += waited as f64;
        let begin = if piece.number > 0 && waited > 0 { BEGIN } else { 0 };
        spent.controller += begin as f64 + cycles.controller;
        spent.busy += cycles.busy;
        spent.dependency += cycles.dependency;
        self.ends = Some(now + begin + cycles.total() as u64);
        true
    }

    fn drop_piece(&mut self) {
        self.ring.pop_front();
        self.come -= 1;
    }

    /// Leaves a piece whose evaluation has ended.
    fn leave(&mut self, piece: &Piece, now: u64, shared: &mut SharedState) {
        self.drop_piece();
        self.ends = None;
        self.begin_from = now;
        if !piece.is_last_needed {
            return;
        }
        if piece.last_of_tile {
            // The last pixels must leave the pipeline before they are written.
            let from = now + u64::from(shared.raster.latency(piece.mode)) + LEAVE;
            let bytes = shared.raster.tile_bytes();
            shared.report.bytes_out += f64::from(bytes);
            self.pixels.push_back(Pixels { from, bytes: f64::from(bytes), answered: None });
        }
        let is_of_asked = self.ring.iter().all(|piece| piece.cycles.is_none());
        if is_of_asked && self.number > 0 {
            // The rest of the list is left out.
            self.next_list(now);
        }
    }

    fn next_list(&mut self, now: u64) {
        self.claimed.pop_front();
        self.number = 0;
        self.ask_from = self.ask_from.max(now + NEXT_LIST);
    }

    /// Requests a piece, if one is free.
    fn asks(&mut self, now: u64, shared: &mut SharedState) -> bool {
        let raster = shared.raster;
        if self.is_out_of_work || self.ring.len() >= raster.pieces() as usize || self.ask_from.max(1) > now {
            return false;
        }
        if self.claimed.is_empty() {
            match shared.tiles.pop_front() {
                Some(lists) => self.claimed = lists,
                None => self.is_out_of_work = true,
            }
        }
        let Some(list) = self.claimed.front() else { return false };
        let bytes = ring::piece_bytes(raster, self.number, list.primitives);
        let number = self.number as usize;
        let latency = REQUEST + u64::from(shared.rates.latency);
        let cycles = list.pieces.get(number).copied();
        shared.report.bytes_in += f64::from(bytes);
        if cycles.is_none() {
            shared.report.bytes_wasted += f64::from(bytes);
        }
        self.ring.push_back(Piece {
            mode: list.mode,
            number: self.number,
            is_last_needed: number + 1 == list.pieces.len(),
            first_of_tile: list.first_of_tile && number == 0,
            last_of_tile: list.last_of_tile,
            cycles,
            bytes: f64::from(bytes),
            due: now + latency,
            answered: shared.memory.serve(now, shared.memory.parts(bytes)) + latency,
        });
        self.ask_from = now + NEXT_PIECE;
        self.number += 1;
        if self.number * raster.piece() >= list.primitives {
            self.next_list(now);
        }
        true
    }

    /// Moves the bytes of a cycle: those of pixels first.
    fn move_bytes(&mut self, now: u64, most: f64) {
        if let Some(pixels) = self.pixels.iter_mut().find(|pixels| pixels.bytes > 0.0)
            && pixels.from <= now
        {
            pixels.bytes -= most;
        } else if let Some(piece) = self.ring.get_mut(self.come)
            && piece.due <= now
        {
            piece.bytes -= most;
        }
    }
}
