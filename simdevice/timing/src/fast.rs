//! The fast model: the times of each piece of a list, from its request to the end of its evaluation.
//!
//! Each of these times is the later one of a few earlier ones, by the rules of [`crate::ring`]: a piece is requested once a
//! place of the ring is free, comes when the port has moved its bytes, and is evaluated once it has come and the piece before
//! has ended. So a piece takes a fixed number of operations, however many cycles it takes.
//!
//! Only requests and writes concern other modules, because main memory answers them in the order of their times. So the
//! module whose next request or write is the first of all goes on by it; the rest of its state follows.

use crate::config::{Config, Rasterizer};
use crate::plan::{self, Division, Part, Rates, Task};
use crate::raster::RasterReport;
use crate::ring::{self, BEGIN, DISCARD, LEAVE, MainMemory, NEXT_LIST, NEXT_PIECE, REQUEST};
use crate::work::{FrameWork, Mode, Segment};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::ops::Range;

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
    rasterize_lists(&FrameLists::new(tasks, &config.rasterizer), config, others_gb_s)
}

/// Rasterizes the lists of a frame, as [`rasterize_tiles`] does. They must be of the configuration's rasterizer with any
/// number of modules.
pub(crate) fn rasterize_lists(frame: &FrameLists, config: &Config, others_gb_s: f64) -> (RasterReport, Vec<TileSpan>) {
    let rates = Rates::new(config, others_gb_s);
    let mut memory = MainMemory::new(&rates);
    let costs = Costs::new(&config.rasterizer, rates, &memory);
    let mut tiles = frame.tiles.iter();
    let mut modules: Vec<_> = (0..config.rasterizer.modules).map(|_| Module::new(frame, costs)).collect();
    // The next request or write of each module, the first one on top; modules of equal times in their own order.
    let mut next: BinaryHeap<_> =
        modules.iter().enumerate().map(|(index, module)| Reverse(Next::new(module.next(), index))).collect();
    while let Some(mut first) = next.peek_mut() {
        let (now, index) = (first.0.time(), first.0.module());
        if now == NEVER {
            break;
        }
        let module = &mut modules[index];
        module.go_on(now, &mut tiles, &mut memory);
        *first = Reverse(Next::new(module.next(), index));
    }
    let mut report = if modules.is_empty() { RasterReport::default() } else { frame.work.clone() };
    modules.iter().for_each(|module| module.spent.add_to(&mut report));
    let cycles = modules.iter().map(|module| module.end.max(module.written)).max().unwrap_or(0);
    report.cycles = cycles as f64;
    report.modules.idle = report.cycles * modules.len() as f64 - report.modules.total();
    let spans = |(number, module): (usize, Module)| {
        let span = move |span: TileSpan| TileSpan { module: number, ..span };
        module.spans.into_iter().map(span)
    };
    let spans = modules.into_iter().enumerate().flat_map(spans).collect();
    (report, spans)
}

/// The next time of a module, and the module's number in the lowest bits, so that one comparison orders them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Next(u64);

impl Next {
    /// Bits of a module's number.
    const BITS: u32 = 16;

    fn new(time: u64, module: usize) -> Self {
        Self(time << Self::BITS | module as u64)
    }

    fn time(self) -> u64 {
        self.0 >> Self::BITS
    }

    fn module(self) -> usize {
        (self.0 & ((1 << Self::BITS) - 1)) as usize
    }
}

/// A time that does not come.
const NEVER: u64 = u64::MAX >> Next::BITS;

/// Consecutive pieces of a list of the same cost.
#[derive(Clone, Copy, Debug)]
struct PieceRun {
    count: u32,
    /// Cycles of the evaluation of each.
    cycles: u32,
}

/// One draw in one tile, as a module sees it.
#[derive(Clone, Copy, Debug)]
struct List {
    mode: Mode,
    /// The tile's column and row.
    at: [u32; 2],
    /// Primitives, and the pieces of all of them and of those that are evaluated.
    primitives: u32,
    pieces: u32,
    needed: u32,
    /// The first run of its pieces.
    first_run: u32,
    first_of_tile: bool,
    last_of_tile: bool,
}

/// The lists of a frame's tasks. Rasterizers that differ in the number of modules, in the size of the buffers or in memory
/// share them.
#[derive(Debug, Default)]
pub(crate) struct FrameLists {
    /// The lists of each task.
    tiles: Vec<Range<u32>>,
    lists: Vec<List>,
    runs: Vec<PieceRun>,
    /// The work that does not depend on the modules that take the tasks.
    work: RasterReport,
}

impl FrameLists {
    /// The lists of tasks for a rasterizer.
    pub(crate) fn new(tasks: &[Task], raster: &Rasterizer) -> Self {
        let mut all = Self::default();
        for task in tasks {
            let first = all.lists.len() as u32;
            for part in &task.parts {
                all.push(part, task.at, raster);
            }
            let of_task = &mut all.lists[first as usize..];
            if let Some(list) = of_task.first_mut() {
                list.first_of_tile = true;
            }
            if let Some(list) = of_task.last_mut() {
                list.last_of_tile = true;
            }
            all.tiles.push(first..all.lists.len() as u32);
        }
        all
    }

    /// Appends the list of a draw in a tile, with equal pieces grouped.
    fn push(&mut self, part: &Part, at: [u32; 2], raster: &Rasterizer) {
        let piece = raster.piece();
        let primitives = part.needed + part.left_over;
        self.lists.push(List {
            mode: part.mode,
            at,
            primitives,
            pieces: primitives.div_ceil(piece),
            needed: part.needed.div_ceil(piece),
            first_run: self.runs.len() as u32,
            first_of_tile: false,
            last_of_tile: false,
        });
        let Self { runs, work, .. } = self;
        work.pairs += f64::from(part.needed);
        work.modules.controller += f64::from(raster.tile_overhead);
        let (mut cycles, mut filled, mut all) = (0.0, 0, 0.0);
        for segment in &part.segments {
            let mut spend = |range: [u32; 2]| {
                let [busy, dependency, controller] = cycles_of(segment, range, part.mode, raster);
                work.modules.busy += busy;
                work.modules.dependency += dependency;
                work.modules.controller += controller;
                busy + dependency + controller
            };
            let waiting = raster.known_waiting_cycles(part.mode, segment).unwrap_or(0);
            let count = u64::from(segment.primitives);
            let is_even = segment.groups.is_multiple_of(count) && waiting.is_multiple_of(count);
            let mut at = 0;
            while at < segment.primitives {
                let left = segment.primitives - at;
                let whole = left / piece;
                if filled == 0 && whole >= 1 && is_even {
                    let total = spend([at, at + whole * piece]);
                    runs.push(PieceRun { count: whole, cycles: (total / f64::from(whole)) as u32 });
                    all += total;
                    at += whole * piece;
                    continue;
                }
                let taken = left.min(piece - filled);
                cycles += spend([at, at + taken]);
                filled += taken;
                at += taken;
                if filled == piece {
                    runs.push(PieceRun { count: 1, cycles: cycles as u32 });
                    all += cycles;
                    (cycles, filled) = (0.0, 0);
                }
            }
            work.add_evaluations(part.mode, (segment.groups * 16) as f64);
        }
        let rest = ring::rest_cycles(part, (all + cycles) as u64, raster) as u32;
        work.modules.busy += f64::from(rest);
        if filled > 0 {
            runs.push(PieceRun { count: 1, cycles: cycles as u32 });
        }
        // The last piece takes longer than those that it is grouped with.
        if rest > 0
            && let Some(PieceRun { count, cycles }) = runs.pop()
        {
            runs.extend((count > 1).then_some(PieceRun { count: count - 1, cycles }));
            runs.push(PieceRun { count: 1, cycles: cycles + rest });
        }
    }
}

/// Costs of a machine that all its modules have in common.
#[derive(Clone, Copy, Debug)]
struct Costs<'a> {
    raster: &'a Rasterizer,
    rates: Rates,
    /// Bytes of a whole piece, cycles of a port for them, and parts of a cycle of main memory.
    piece_bytes: u32,
    piece_cycles: u64,
    piece_parts: u64,
    /// The same of a tile's pixels.
    tile_bytes: u32,
    tile_cycles: u64,
    tile_parts: u64,
}

impl<'a> Costs<'a> {
    fn new(raster: &'a Rasterizer, rates: Rates, memory: &MainMemory) -> Self {
        let (piece_bytes, tile_bytes) = (ring::piece_bytes(raster, 0, raster.piece()), raster.tile_bytes());
        let cycles = |bytes| ring::port_cycles(bytes, &rates);
        Self {
            raster,
            rates,
            piece_bytes,
            piece_cycles: cycles(piece_bytes),
            piece_parts: memory.parts(piece_bytes),
            tile_bytes,
            tile_cycles: cycles(tile_bytes),
            tile_parts: memory.parts(tile_bytes),
        }
    }
}

/// A piece that was requested and has not been left.
#[derive(Clone, Copy, Debug)]
struct Piece {
    list: u32,
    /// Its number in the list.
    number: u32,
    /// Cycles of the port for it.
    port_cycles: u64,
    /// The time from which its data may come, and that from which memory has moved all of them.
    due: u64,
    answered: u64,
}

/// The write of a tile's pixels that memory has not been asked for.
#[derive(Clone, Copy, Debug)]
struct Write {
    from: u64,
    /// The time at which the port has moved them.
    moved: u64,
}

/// The bytes of a module, and its cycles by activity as in [`ModuleCycles`](crate::raster::ModuleCycles), without the work
/// that does not depend on when it is done.
#[derive(Clone, Copy, Debug, Default)]
struct Spent {
    bytes_in: u64,
    bytes_wasted: u64,
    bytes_out: u64,
    memory: u64,
    controller: u64,
    mode_switch: u64,
    switches: u64,
}

impl Spent {
    fn add_to(&self, report: &mut RasterReport) {
        report.bytes_in += self.bytes_in as f64;
        report.bytes_wasted += self.bytes_wasted as f64;
        report.bytes_out += self.bytes_out as f64;
        report.modules.memory += self.memory as f64;
        report.modules.controller += self.controller as f64;
        report.modules.mode_switch += self.mode_switch as f64;
        report.switches += self.switches as f64;
    }
}

#[derive(Debug)]
struct Module<'a> {
    frame: &'a FrameLists,
    costs: Costs<'a>,
    /// Lists of the claimed tile that are not requested whole, and the next piece of the first of them.
    claimed: Range<u32>,
    number: u32,
    /// The time from which the next piece may be requested.
    ask_from: u64,
    /// Times from which places of the ring are free.
    free: VecDeque<u64>,
    /// Pieces that were requested and whose evaluation is not known.
    requested: VecDeque<Piece>,
    /// The time at which the port has moved the last of the other pieces.
    came: u64,
    /// The times from and to which the port writes pixels, as far as pieces may meet them.
    writing: VecDeque<[u64; 2]>,
    /// The end of the last of them.
    port_written: u64,
    /// Writes that memory has not been asked for.
    writes: VecDeque<Write>,
    /// Times from which there is room for a tile's pixels: two tiles have some.
    room: VecDeque<u64>,
    /// The time at which the last pixels are written.
    written: u64,
    mode: Option<Mode>,
    /// The run of the next piece, and those of its pieces that were evaluated.
    run: u32,
    of_run: u32,
    /// The end of what is known of the evaluation.
    end: u64,
    /// The last list whose evaluation has ended, and its end.
    ended: Option<(u32, u64)>,
    spans: Vec<TileSpan>,
    spent: Spent,
}

impl<'a> Module<'a> {
    fn new(frame: &'a FrameLists, costs: Costs<'a>) -> Self {
        Self {
            frame,
            costs,
            claimed: 0..0,
            number: 0,
            ask_from: 1,
            free: std::iter::repeat_n(0, costs.raster.pieces() as usize).collect(),
            requested: VecDeque::with_capacity(costs.raster.pieces() as usize),
            came: 0,
            writing: VecDeque::new(),
            port_written: 0,
            writes: VecDeque::new(),
            room: VecDeque::from([0, 0]),
            written: 0,
            mode: None,
            run: 0,
            of_run: 0,
            end: 0,
            ended: None,
            spans: Vec::new(),
            spent: Spent::default(),
        }
    }

    /// The time of the next request or write.
    fn next(&self) -> u64 {
        self.next_request().min(self.next_write())
    }

    /// The time of the next request; [`NEVER`] if evaluation must go on before.
    fn next_request(&self) -> u64 {
        self.free.front().map_or(NEVER, |&free| free.max(self.ask_from))
    }

    fn next_write(&self) -> u64 {
        self.writes.front().map_or(NEVER, |write| write.from)
    }

    /// Makes the next request or write, whose time it is.
    fn go_on(&mut self, now: u64, tiles: &mut impl Iterator<Item = &'a Range<u32>>, memory: &mut MainMemory) {
        if self.next_write() <= now {
            self.write(memory);
        } else if self.claim(tiles) {
            self.request(now, memory);
        } else {
            // No work is left.
            self.ask_from = NEVER;
        }
        while self.evaluate() {}
        self.skip_what_ended();
    }

    /// Claims a tile if no list is left. Returns false if there is none.
    fn claim(&mut self, tiles: &mut impl Iterator<Item = &'a Range<u32>>) -> bool {
        if self.claimed.is_empty()
            && let Some(tile) = tiles.next()
        {
            self.claimed = tile.clone();
        }
        !self.claimed.is_empty()
    }

    /// Requests a piece.
    fn request(&mut self, now: u64, memory: &mut MainMemory) {
        let (list, number) = (self.claimed.start, self.number);
        let &List { primitives, pieces, needed, .. } = &self.frame.lists[list as usize];
        let Costs { raster, rates, mut piece_bytes, piece_cycles: mut port_cycles, piece_parts: mut parts, .. } =
            self.costs;
        let is_last = number + 1 == pieces;
        if is_last {
            piece_bytes = ring::piece_bytes(raster, number, primitives);
            port_cycles = ring::port_cycles(piece_bytes, &rates);
            parts = memory.parts(piece_bytes);
        }
        self.spent.bytes_in += u64::from(piece_bytes);
        if number >= needed {
            self.spent.bytes_wasted += u64::from(piece_bytes);
        }
        let latency = REQUEST + u64::from(rates.latency);
        let answered = memory.serve(now, parts) + latency;
        self.requested.push_back(Piece { list, number, port_cycles, due: now + latency, answered });
        self.free.pop_front();
        self.number += 1;
        self.ask_from = now + NEXT_PIECE;
        if is_last {
            self.next_list(now);
        }
    }

    /// Goes on with the next list after a time.
    fn next_list(&mut self, now: u64) {
        self.claimed.start += 1;
        self.number = 0;
        self.ask_from = self.ask_from.max(now + NEXT_LIST);
    }

    /// Leaves out the pieces of a list that ends before they are requested.
    fn skip_what_ended(&mut self) {
        if let Some((list, end)) = self.ended
            && list == self.claimed.start
            && !self.claimed.is_empty()
            && self.next_request() >= end
        {
            self.next_list(end);
        }
    }

    /// Asks memory for the next write of pixels.
    fn write(&mut self, memory: &mut MainMemory) {
        if let Some(Write { from, moved }) = self.writes.pop_front() {
            self.written = memory.serve(from, self.costs.tile_parts).max(moved);
            self.room.push_back(self.written);
        }
    }

    /// Evaluates the next piece that was requested. Returns false if there is none, or if it waits for a write.
    fn evaluate(&mut self) -> bool {
        let Some(&piece) = self.requested.front() else { return false };
        let list = &self.frame.lists[piece.list as usize];
        let is_first = piece.number == 0;
        let mut room = 0;
        if is_first && list.first_of_tile {
            let Some(from) = self.room.pop_front() else { return false };
            room = from;
        }
        self.requested.pop_front();
        let came = self.receive(piece);
        if piece.number >= list.needed {
            self.discard(came);
            return true;
        }
        if is_first {
            self.begin_list(list);
        }
        let begin = self.end.max(came).max(room);
        if is_first && list.first_of_tile {
            let (module, at, begin) = (0, list.at, begin as f64);
            self.spans.push(TileSpan { module, at, begin, end: begin });
        }
        let waited = begin - self.end;
        let mut controller = 0;
        if is_first {
            controller = u64::from(self.costs.raster.tile_overhead);
        } else if waited > 0 {
            controller = BEGIN;
            self.spent.controller += BEGIN;
        }
        self.spent.memory += waited;
        self.end = begin + controller + u64::from(self.next_cycles());
        self.free.push_back(self.end);
        if piece.number + 1 == list.needed {
            self.end_list(piece.list);
        }
        true
    }

    /// Discards a piece of a list that has ended, once it has come.
    fn discard(&mut self, came: u64) {
        let left = came.max(self.end);
        self.spent.memory += left - self.end;
        self.spent.controller += DISCARD;
        self.end = left + DISCARD;
        self.free.push_back(left);
    }

    /// Begins a list: of another mode once the pipeline has drained.
    fn begin_list(&mut self, list: &List) {
        self.run = list.first_run;
        self.of_run = 0;
        if let Some(before) = self.mode.filter(|&mode| mode != list.mode) {
            let raster = self.costs.raster;
            let switch = u64::from(raster.latency(before) + raster.mode_switch);
            self.spent.mode_switch += switch;
            self.spent.switches += 1;
            self.end += switch;
        }
        self.mode = Some(list.mode);
    }

    /// Moves a piece through the port, around writes of pixels. Returns the time at which it has come.
    fn receive(&mut self, piece: Piece) -> u64 {
        let mut at = piece.due.max(self.came);
        let mut left = piece.port_cycles;
        while let Some(&[from, to]) = self.writing.front()
            && from < at + left
        {
            left -= from.saturating_sub(at);
            at = at.max(to);
            self.writing.pop_front();
        }
        self.came = (at + left).max(piece.answered);
        self.came
    }

    /// Cycles of the next piece of the list in evaluation.
    fn next_cycles(&mut self) -> u32 {
        let PieceRun { count, cycles } = self.frame.runs[self.run as usize];
        self.of_run += 1;
        if self.of_run >= count {
            self.run += 1;
            self.of_run = 0;
        }
        cycles
    }

    /// Ends a list, and its tile if it is the last of it.
    fn end_list(&mut self, number: u32) {
        self.ended = Some((number, self.end));
        let list = &self.frame.lists[number as usize];
        if !list.last_of_tile {
            return;
        }
        if let Some(span) = self.spans.last_mut() {
            span.end = self.end as f64;
        }
        let Costs { raster, tile_bytes, tile_cycles, .. } = self.costs;
        self.spent.bytes_out += u64::from(tile_bytes);
        // The last pixels must leave the pipeline before they are written.
        let complete = self.end + u64::from(raster.latency(list.mode)) + LEAVE;
        let from = complete.max(self.port_written);
        let moved = from + tile_cycles;
        self.port_written = moved;
        self.writing.push_back([from, moved]);
        self.writes.push_back(Write { from, moved });
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::even_frame;
    use crate::work::{DrawWork, TileWork};
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
    /// The cycles of one module for lists of some Gaussians, each in a tile of its own of which all pixels are evaluated.
    fn cycles(lists: &[u32], settings: &[&str]) -> f64 {
        let settings: Vec<_> = ["modules=1"].iter().chain(settings).map(|&setting| setting.to_owned()).collect();
        let config = Config::preset("paper-15x16", &settings).unwrap();
        let tiles = lists.iter().enumerate().map(|(x, &listed)| TileWork::open([x as u32, 0], listed));
        let draw = DrawWork { tiles: tiles.collect(), ..DrawWork::default() };
        rasterize(&FrameWork { size: [16, 16], draws: vec![draw], ..FrameWork::default() }, &config, 0.0).cycles
    }

    #[test]
    fn a_list_takes_its_latency_its_primitives_and_its_pixels() {
        // A request in cycle 1, two registers and 100 ns; eight records of 40 bytes by 16; the controller's cycle; 16 cycles a
        // primitive; the pipeline and two cycles; 3072 bytes of pixels by 16.
        let first = 1 + 2 + 100 + 20 + 1;
        assert_eq!(cycles(&[24], &[]), f64::from(first + 24 * 16 + 37 + 2 + 192));
        // Pixels are written while the next tile is evaluated, whose pieces have come.
        assert_eq!(cycles(&[24, 24], &[]), f64::from(first + 24 * 16 + 1 + 24 * 16 + 37 + 2 + 192));
        // The third tile of one Gaussian waits for the pixels of the first to be written, by a port of half the width.
        let narrow = ["port_bytes_per_cycle=8"];
        let written = |count: u32| f64::from(1 + 2 + 100 + 6 + 1 + 16 + 37 + 2 + count * 384);
        assert_eq!([cycles(&[1], &narrow), cycles(&[1; 2], &narrow)], [written(1), written(2)]);
        assert_eq!(cycles(&[1; 3], &narrow), written(3));
    }

    #[test]
    fn a_small_ring_does_not_hide_the_latency() {
        // Eight pieces of 128 cycles hide 100 ns, and not 2000: the ring goes round once in the latency and one of them.
        let [long, short] = [8000, 800].map(|count| cycles(&[count], &["memory.latency_ns=2000"]));
        let each = (2.0 + 2000.0 + 20.0 + 1.0 + 128.0) / 64.0;
        assert!(((long - short) / 7200.0 / each - 1.0).abs() < 0.01, "{} {each}", (long - short) / 7200.0);
        let [long, short] = [8000, 800].map(|count| cycles(&[count], &[]));
        assert_eq!(long - short, 7200.0 * 16.0);
    }

    #[test]
    fn main_memory_limits_modules_whose_ports_are_wider() {
        // 15 ports ask for more than 18 bytes a cycle.
        let settings = ["bandwidth_gb_s=20", "batch=64"].map(str::to_owned);
        let config = Config::preset("paper-15x16", &settings).unwrap();
        let report = rasterize(&even_frame([240, 16], 15 * 64_000, 0.3), &config, 0.0);
        let least = (report.bytes_in + report.bytes_out) / 18.0;
        assert!(report.cycles >= least && report.cycles < 1.01 * least, "{} {least}", report.cycles);
    }
}
