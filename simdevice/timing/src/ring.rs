//! The tile buffers of a module as the module in SystemVerilog has them: a ring of pieces of a list. A piece is requested as
//! soon as it is free, and evaluated once it has come. Both models of the rasterizer have these sizes and cycles, and
//! this main memory.

use crate::config::Rasterizer;
use crate::plan::{Part, Rates};

/// Cycles from the request of a piece to its first data, without memory's latency: two registers.
pub const REQUEST: u64 = 2;
/// Cycles from the request of a piece to that of the next one, and to that of the next list's first one.
pub const NEXT_PIECE: u64 = 1;
/// See [`NEXT_PIECE`]: a list is taken in a cycle of its own.
pub const NEXT_LIST: u64 = 2;
/// Cycles in which the controller begins a piece that was waited for.
pub const BEGIN: u64 = 1;
/// Cycles in which the controller discards a piece of a list that has ended.
pub const DISCARD: u64 = 1;
/// Cycles from the end of a tile's evaluation to the write of its pixels, without the pipeline's latency.
pub const LEAVE: u64 = 2;
/// Bytes of a word of memory: a piece begins and ends at a multiple of it.
const WORD: u32 = 16;

/// Bytes of a piece, by its number in a list of some primitives.
pub fn piece_bytes(raster: &Rasterizer, number: u32, primitives: u32) -> u32 {
    let size = raster.piece().min(primitives - number * raster.piece());
    (size * raster.primitive_bytes()).next_multiple_of(WORD)
}

/// Cycles in which a module goes on after the end of a list of which a part is not needed, when evaluation of its needed
/// primitives took `cycles`: a pixel is finished at the end of its pipeline, and the primitives after it begin meanwhile, as far
/// as there are any.
pub fn rest_cycles(part: &Part, cycles: u64, raster: &Rasterizer) -> u64 {
    let left_over = cycles * u64::from(part.left_over) / u64::from(part.needed.max(1));
    u64::from(raster.latency(part.mode)).min(left_over)
}

/// Main memory: it answers all modules in the order in which they ask. Its times are in parts of a cycle.
#[derive(Clone, Copy, Debug)]
pub struct MainMemory {
    /// Parts of a cycle that a byte takes.
    byte_parts: f64,
    /// The time at which it has moved all that was asked for.
    free: u64,
}

impl MainMemory {
    /// The logarithm of the parts of a cycle.
    const PARTS: u32 = 20;

    /// A memory of which nobody has asked anything.
    pub fn new(rates: &Rates) -> Self {
        Self { byte_parts: f64::from(1 << Self::PARTS) / rates.memory, free: 0 }
    }

    /// The parts of a cycle that it takes to move bytes.
    pub fn parts(&self, bytes: u32) -> u64 {
        (f64::from(bytes) * self.byte_parts) as u64
    }

    /// Moves bytes that take some parts of a cycle, and are asked for at a time. Returns the time at which the last of them has
    /// moved, without latency.
    pub fn serve(&mut self, now: u64, parts: u64) -> u64 {
        self.free = self.free.max(now << Self::PARTS) + parts;
        self.free.div_ceil(1 << Self::PARTS)
    }
}

/// Cycles of a port for some bytes.
pub fn port_cycles(bytes: u32, rates: &Rates) -> u64 {
    (f64::from(bytes) / rates.port).ceil() as u64
}
