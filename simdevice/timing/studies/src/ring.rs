//! The cycles of one module with the ports of the module in SystemVerilog, from event to event: its tile buffers are a ring
//! of pieces, each of which is requested as soon as it is free and evaluated once it has come; its port moves bytes in one
//! direction at a time, those of pixels first.
//!
//! The models of `timing::fast` and [`crate::stepped`] fetch whole batches. This one has the module's pieces, so that it
//! holds for memories of any latency and for slow ports. It has the costs of primitives in common with them.

use std::collections::VecDeque;
use timing::config::{Config, Rasterizer};
use timing::plan::{self, Division, Part, Rates};
use timing::work::{FrameWork, Mode};

/// Primitives of a piece.
pub const PIECE: u32 = 8;

/// Cycles from the request of a piece to its first data, without memory's latency: two registers.
const REQUEST: f64 = 2.0;
/// Cycles from the end of a list's evaluation to its pixels, without the pipeline's latency.
const LEAVE: f64 = 2.0;
/// Cycles in which the controller begins the evaluation of a list, or of a piece that was waited for.
const BEGIN: f64 = 1.0;

/// Rasterizes a frame on one module. Returns the cycles.
pub fn rasterize(frame: &FrameWork, config: &Config) -> f64 {
    let raster = &config.rasterizer;
    let tasks = plan::tasks(frame, &Division::of(raster));
    let parts = tasks.iter().flat_map(|task| &task.parts);
    let lists: Vec<_> = parts.map(|part| List::of(part, raster)).collect();
    Module::new(&lists, config).run()
}

/// A list as the module sees it.
#[derive(Debug)]
struct List {
    mode: Mode,
    /// Primitives.
    count: u32,
    /// Cycles of evaluation of each piece that is needed.
    pieces: Vec<f64>,
    /// Cycles in which the module goes on before the pixels in its pipeline say that the list has ended.
    rest: f64,
}

impl List {
    fn of(part: &Part, raster: &Rasterizer) -> Self {
        let mode = part.mode;
        let mut pieces = vec![0.0; part.needed.div_ceil(PIECE) as usize];
        let mut at = 0;
        for segment in &part.segments {
            let n = u64::from(segment.primitives);
            let of = |k: u64, all: u64| (k + 1) * all / n - k * all / n;
            let known = raster.known_waiting_cycles(mode, segment);
            for k in 0..n {
                let groups = of(k, segment.groups);
                let waits = known.map_or_else(|| raster.waiting_cycles(mode, groups, segment.open), |all| of(k, all));
                let cycles = raster.busy_cycles(mode, groups) + Rasterizer::looking_cycles(groups) + waits;
                pieces[at / PIECE as usize] += cycles as f64;
                at += 1;
            }
        }
        // A pixel is finished at the end of its pipeline. Meanwhile the primitives after it begin, as far as there are.
        let each = pieces.iter().sum::<f64>() / f64::from(part.needed.max(1));
        let rest = f64::from(raster.latency(mode)).min(each * f64::from(part.left_over));
        Self { mode, count: part.needed + part.left_over, pieces, rest }
    }

    /// Primitives of a piece.
    fn size(&self, piece: u32) -> u32 {
        PIECE.min(self.count - piece * PIECE)
    }
}

/// A piece in the ring.
#[derive(Clone, Copy, Debug)]
struct Piece {
    list: usize,
    /// Its number in the list.
    number: u32,
    /// The bytes that have not come, and the time from which they may.
    bytes: f64,
    due: f64,
}

/// The module at a time.
#[derive(Debug)]
struct Module<'a> {
    lists: &'a [List],
    raster: &'a Rasterizer,
    rates: Rates,
    now: f64,
    /// The pieces that were requested and have not been left, the oldest first, and how many of them have come.
    ring: VecDeque<Piece>,
    come: usize,
    /// The next piece to request, and the time from which it may be.
    asking: [u32; 2],
    ask_from: f64,
    /// The time at which the evaluation of the oldest piece ends, if it has begun.
    ends: Option<f64>,
    /// The time from which the next evaluation may begin.
    begin_from: f64,
    /// The list that ended before its last piece was left.
    ended: Option<usize>,
    mode: Mode,
    /// The tiles whose pixels have not been written: times from which they may be, and bytes.
    pixels: VecDeque<[f64; 2]>,
    /// True if a list is being evaluated.
    drawing: bool,
}

impl<'a> Module<'a> {
    fn new(lists: &'a [List], config: &'a Config) -> Self {
        Self {
            lists,
            raster: &config.rasterizer,
            rates: Rates::new(config, 0.0),
            now: 0.0,
            ring: VecDeque::new(),
            come: 0,
            asking: [0, 0],
            ask_from: 1.0,
            ends: None,
            begin_from: 0.0,
            ended: None,
            mode: Mode::Gaussian,
            pixels: VecDeque::new(),
            drawing: false,
        }
    }

    /// Draws all lists. Returns the cycles.
    fn run(mut self) -> f64 {
        while self.act() {
            let next = self.next();
            if !next.is_finite() {
                break;
            }
            self.move_bytes(next - self.now);
            self.now = next;
        }
        self.now
    }

    /// Does all that can be done at this time. Returns false if nothing is left to do.
    fn act(&mut self) -> bool {
        while self.receive() || self.write() || self.evaluate() || self.ask() {}
        self.list_to_ask().is_some() || !self.ring.is_empty() || !self.pixels.is_empty()
    }

    fn list_to_ask(&self) -> Option<&'a List> {
        self.lists.get(self.asking[0] as usize)
    }

    fn pieces(&self) -> usize {
        (2 * self.raster.batch / PIECE) as usize
    }

    /// Requests a piece, if one is free.
    fn ask(&mut self) -> bool {
        let Some(list) = self.list_to_ask() else { return false };
        if self.ring.len() >= self.pieces() || self.ask_from > self.now {
            return false;
        }
        let [index, number] = self.asking;
        let bytes = list.size(number) * self.raster.primitive_bytes();
        // Data come in words of 16 bytes.
        let bytes = f64::from(bytes.next_multiple_of(16));
        let due = self.now + REQUEST + f64::from(self.rates.latency);
        self.ring.push_back(Piece { list: index as usize, number, bytes, due });
        self.ask_from = self.now + 1.0;
        self.asking[1] += 1;
        if (number + 1) * PIECE >= list.count {
            self.ask_next_list();
        }
        true
    }

    /// The next list is taken in a cycle of its own.
    fn ask_next_list(&mut self) {
        self.asking = [self.asking[0] + 1, 0];
        self.ask_from = self.now + 2.0;
    }

    /// The pixels that are written now.
    fn leaving(&self) -> bool {
        self.pixels.front().is_some_and(|&[from, _]| from <= self.now)
    }

    /// Ends the transfer of a piece.
    fn receive(&mut self) -> bool {
        let has_come = self.ring.get(self.come).is_some_and(|piece| piece.due <= self.now && piece.bytes <= SLACK);
        self.come += usize::from(has_come);
        has_come
    }

    /// Ends the transfer of a tile's pixels.
    fn write(&mut self) -> bool {
        let is_written = self.leaving() && self.pixels.front().is_some_and(|&[_, bytes]| bytes <= SLACK);
        if is_written {
            self.pixels.pop_front();
        }
        is_written
    }

    /// Begins or ends the evaluation of the oldest piece.
    fn evaluate(&mut self) -> bool {
        let Some(&piece) = self.ring.front().filter(|_| self.come > 0) else { return false };
        match self.ends {
            Some(end) if end <= self.now => self.leave(piece),
            Some(_) => return false,
            None if self.begin_from > self.now => return false,
            None if self.ended == Some(piece.list) => {
                // It is discarded in a cycle.
                self.drop_piece();
                self.begin_from = self.now + 1.0;
            }
            None => return self.begin(piece),
        }
        true
    }

    fn drop_piece(&mut self) {
        self.ring.pop_front();
        self.come -= 1;
        self.ask_from = self.ask_from.max(self.now);
    }

    /// Begins the evaluation of a piece.
    fn begin(&mut self, piece: Piece) -> bool {
        let list = &self.lists[piece.list];
        if piece.number == 0 && !self.drawing {
            // Two tiles have room for their pixels.
            if self.pixels.len() > 1 {
                return false;
            }
            if self.mode != list.mode {
                // The pipeline drains.
                let drained = self.begin_from + f64::from(self.raster.latency(self.mode) + self.raster.mode_switch);
                self.mode = list.mode;
                self.begin_from = drained;
                if drained > self.now {
                    return true;
                }
            }
            self.drawing = true;
        }
        self.ends = Some(self.now + BEGIN + self.cycles(piece));
        true
    }

    /// Cycles of a piece's evaluation.
    fn cycles(&self, piece: Piece) -> f64 {
        let list = &self.lists[piece.list];
        let cycles = list.pieces.get(piece.number as usize).copied().unwrap_or(0.0);
        let is_last = piece.number as usize + 1 == list.pieces.len();
        if is_last { cycles + list.rest } else { cycles }
    }

    /// Leaves a piece whose evaluation has ended.
    fn leave(&mut self, piece: Piece) {
        let list = &self.lists[piece.list];
        self.drop_piece();
        self.ends = None;
        self.begin_from = self.now;
        if piece.number as usize + 1 < list.pieces.len() {
            // A piece that has come is begun without a cycle of its own.
            if let Some(&next) = self.ring.front().filter(|_| self.come > 0) {
                self.ends = Some(self.now + self.cycles(next));
            }
            return;
        }
        self.drawing = false;
        let from = self.now + f64::from(self.raster.latency(list.mode)) + LEAVE;
        let before = self.pixels.back().map_or(0.0, |&[from, _]| from);
        self.pixels.push_back([from.max(before), f64::from(self.raster.tile_bytes())]);
        if (piece.number + 1) * PIECE < list.count {
            // The rest of the list is discarded.
            self.ended = Some(piece.list);
            if self.asking[0] as usize == piece.list {
                self.ask_next_list();
            }
        }
    }

    /// The time of the next event.
    fn next(&self) -> f64 {
        let mut next = f64::INFINITY;
        let mut at = |time: f64| {
            if time > self.now {
                next = next.min(time);
            }
        };
        self.ends.into_iter().for_each(&mut at);
        at(self.begin_from);
        if self.list_to_ask().is_some() {
            at(self.ask_from);
        }
        let rate = self.rates.port;
        if let Some(&[from, bytes]) = self.pixels.front() {
            at(from);
            if self.leaving() {
                at(self.now + bytes / rate);
            }
        }
        if let Some(piece) = self.ring.get(self.come) {
            at(piece.due);
            if piece.due <= self.now && !self.leaving() {
                at(self.now + piece.bytes / rate);
            }
        }
        next
    }

    /// Moves the bytes of some cycles.
    fn move_bytes(&mut self, cycles: f64) {
        let moved = cycles * self.rates.port;
        if self.leaving() {
            if let Some([_, bytes]) = self.pixels.front_mut() {
                *bytes -= moved;
            }
        } else if let Some(piece) = self.ring.get_mut(self.come)
            && piece.due <= self.now
        {
            piece.bytes -= moved;
        }
    }
}

/// A remainder of bytes that counts as zero, because of rounding.
const SLACK: f64 = 1e-6;
