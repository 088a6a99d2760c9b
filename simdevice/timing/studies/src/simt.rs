//! The paper's baseline as a SIMT machine: stage 3 of the original 3DGS code on shader cores. A tile is a block of 256
//! threads, in warps of 32 that wait for their slowest lane. The inputs are published microarchitecture and the
//! compiled kernel of that code (`baseline/counts.toml`), and none of the paper's times; [`MACHINE`] gives the source of
//! each number.

use serde::Serialize;
use timing::config::Config;
use timing::work::{DrawWork, FrameWork, Mode, Run, TILE_SIDE, TileWork};

/// A number of the machine, with its source.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its source; "assumed" if there is none.
    pub source: &'static str,
}

const fn parameter(name: &'static str, value: f64, source: &'static str) -> Parameter {
    Parameter { name, value, source }
}

const SCHEDULERS: Parameter = parameter(
    "warp schedulers of an SM",
    4.0,
    "CUDA C++ Programming Guide, compute capability 8.x, architecture: four, and each issues an instruction at a time",
);
const WARP: Parameter =
    parameter("lanes of a warp", 32.0, "CUDA C++ Programming Guide; a device query of an Orin NX prints it");
const BATCH: Parameter = parameter(
    "Gaussians of a batch",
    256.0,
    "the original 3DGS code (forward.cu, lines 314-320): a thread fetches one for its block",
);
const SPECIAL: Parameter = parameter(
    "lanes of special functions of an SM",
    16.0,
    "CUDA C++ Programming Guide, compute capability 8.x, architecture: 16 special function units",
);
const LOAD_STORE: Parameter = parameter(
    "lanes of loads and stores of an SM",
    32.0,
    "CUDA C++ Programming Guide, shared memory: 32 banks of 32 bits a cycle; that main memory's loads have as many lanes \
     is assumed",
);
const RESIDENT: Parameter = parameter(
    "blocks of 256 threads in an SM",
    6.0,
    "1536 threads in a multiprocessor, as a device query of an Orin NX prints; the compiled kernel's 33 registers a thread \
     allow them (baseline/counts.toml)",
);
const DEPENDENT: Parameter = parameter(
    "cycles between dependent instructions of a warp",
    4.0,
    "Abdelkhalik et al., \"Demystifying the Nvidia Ampere Architecture through Microbenchmarking and Instruction-level \
     Analysis\", 2022 (arXiv 2208.11174), as others quote it: an fp32 addition on A100; that Orin takes as many is \
     assumed",
);
// NVRTC's 11.8, 12.2, 12.6 and 12.9 agree on these three; `baseline/counts.toml` has their counts and those of 13.5.
const SKIPPED: Parameter = parameter(
    "instructions of a warp in which no lane blends",
    40.0,
    "the original 3DGS code (59f5f77), compiled by NVRTC 12.9.86 for sm_87 without flags (baseline/counts.toml): up to the \
     test of alpha; a power above zero would end after 26, but is an error of rounding",
);
const BLENDED: Parameter = parameter(
    "instructions more of a warp in which a lane blends",
    25.0,
    "the same compiled code; lanes that part add an instruction at each branch, which is left out",
);
const BATCH_INSTRUCTIONS: Parameter = parameter(
    "instructions of a warp for a batch",
    47.0,
    "the same compiled code: three loads, three stores, two barriers and a count of finished lanes",
);
/// Special functions of a warp in which no lane blends; one that blends has no more.
const SKIPPED_SPECIAL: f64 = 1.0;
/// Loads of a warp in which no lane blends: two from shared memory.
const SKIPPED_LOADS: f64 = 2.0;
/// Loads more of a warp in which a lane blends: an index from shared memory and three from main memory.
const BLENDED_LOADS: f64 = 4.0;
const BATCH_LATENCY: Parameter = parameter(
    "cycles until a batch's loads have come",
    600.0,
    "assumed: a miss of L2, twice one after the other would be an index and what it points at; other blocks hide it",
);
const CACHE: Parameter = parameter(
    "bytes of L2",
    2.0 * 1024.0 * 1024.0,
    "a device query of an Orin NX prints 2,097,152; AGX Orin has twice as many",
);
const ENTRY_BYTES: Parameter =
    parameter("bytes of a list's entry", 4.0, "the original 3DGS code (rasterizer_impl.h, line 61): an index");
const GAUSSIAN_BYTES: Parameter = parameter(
    "bytes of a Gaussian that a batch reads",
    24.0,
    "the original 3DGS code (forward.cu, lines 319-320): centre, conic and opacity",
);
const COLOR_BYTES: Parameter = parameter(
    "bytes of a colour, in a sector of L2",
    32.0,
    "the original 3DGS code (forward.cu, lines 354-355) reads 12 bytes where a warp blends; a sector has 32 (NVIDIA's \
     forum, topic 312884)",
);

/// The machine's numbers. The preset gives the number of SMs, clock and bandwidth.
pub const MACHINE: [Parameter; 16] = [
    SCHEDULERS,
    WARP,
    BATCH,
    SPECIAL,
    LOAD_STORE,
    RESIDENT,
    DEPENDENT,
    SKIPPED,
    BLENDED,
    BATCH_INSTRUCTIONS,
    BATCH_LATENCY,
    CACHE,
    ENTRY_BYTES,
    GAUSSIAN_BYTES,
    COLOR_BYTES,
    WARPS_OF_A_BLOCK,
];
const WARPS_OF_A_BLOCK: Parameter = parameter(
    "warps of a block",
    8.0,
    "the original 3DGS code (auxiliary.h, lines 18-19): 16x16 threads, so that a warp is two rows of a tile",
);

/// The time of stage 3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Simt {
    /// Milliseconds of all blocks.
    pub compute_ms: f64,
    /// The part of `compute_ms` in which some SMs have run out of blocks.
    pub tail_ms: f64,
    /// Milliseconds of main memory.
    pub memory_ms: f64,
    /// Pairs of a warp and a Gaussian that were evaluated.
    pub warps: f64,
    /// The share of those pairs in which a lane blends.
    pub blended: f64,
}

impl Simt {
    /// Milliseconds of stage 3.
    pub fn milliseconds(&self) -> f64 {
        self.compute_ms.max(self.memory_ms)
    }
}

/// The work of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    /// Cycles of the block alone on an SM, as limited by the rates of its units.
    cycles: f64,
    /// The least cycles of the block, as limited by its latencies.
    least: f64,
    warps: f64,
    blended: f64,
}

/// Warps with an unfinished lane. Neighbouring rows are taken to finish together, which is a lower bound.
fn open_warps(run: &Run) -> f64 {
    f64::from(run.rows.div_ceil(2))
}

/// The share of open warps in which a primitive reaches a pixel. Blocks of 4x4 pixels that it reaches are taken to be a
/// square, of which each row is two warps. It is an estimate, because the trace has blocks and not rows.
fn blending(run: &Run) -> f64 {
    let primitives = f64::from(run.primitives.max(1));
    let blocks = (f64::from(run.reached) + f64::from(run.hidden_blocks)) / primitives;
    let rows = blocks.sqrt().min(4.0);
    (2.0 * rows / open_warps(run).max(1.0)).min(1.0)
}

impl Block {
    fn of(tile: &TileWork) -> Self {
        let mut block = Self::default();
        for run in &tile.runs {
            let warps = open_warps(run) * f64::from(run.primitives);
            block.warps += warps;
            block.blended += warps * blending(run);
        }
        // All threads take part in a batch, and a block ends only after a batch.
        let batches = (f64::from(tile.needed()) / BATCH.value).ceil();
        let instructions = block.warps * SKIPPED.value
            + block.blended * BLENDED.value
            + batches * WARPS_OF_A_BLOCK.value * BATCH_INSTRUCTIONS.value;
        let issue = instructions / SCHEDULERS.value;
        let special = SKIPPED_SPECIAL * block.warps * WARP.value / SPECIAL.value;
        let loads = (SKIPPED_LOADS * block.warps + BLENDED_LOADS * block.blended) * WARP.value / LOAD_STORE.value;
        block.cycles = issue.max(special).max(loads);
        // A warp issues at most one instruction in `DEPENDENT` cycles.
        block.least = instructions / WARPS_OF_A_BLOCK.value * DEPENDENT.value + batches * BATCH_LATENCY.value;
        block
    }
}

/// The time of stage 3 of a frame's Gaussians.
pub fn simulate(frame: &FrameWork, config: &Config) -> Simt {
    let draws = || frame.draws.iter().filter(|draw| draw.mode == Mode::Gaussian);
    let blocks: Vec<_> = draws().flat_map(|draw| &draw.tiles).map(Block::of).collect();
    let shader = &config.shader;
    let sms = shader.sms as usize;
    let cycles = schedule(&blocks, sms);
    let even = blocks.iter().map(|block| block.cycles).sum::<f64>() / sms as f64;
    let to_ms = 1e-6 / shader.clock_ghz;
    let bytes: f64 = draws().map(bytes).sum();
    let warps: f64 = blocks.iter().map(|block| block.warps).sum();
    let blended: f64 = blocks.iter().map(|block| block.blended).sum();
    Simt {
        compute_ms: cycles * to_ms,
        tail_ms: (cycles - even).max(0.0) * to_ms,
        memory_ms: bytes / (config.memory.bandwidth_gb_s * config.memory.efficiency * 1e6),
        warps,
        blended: if warps > 0.0 { blended / warps } else { 0.0 },
    }
}

/// Bytes of a draw that are read from main memory or written to it.
fn bytes(draw: &DrawWork) -> f64 {
    let needed = draw.needed_pairs() as f64;
    // Repeated reads hit the L2 cache as far as all drawn Gaussians fit in it.
    let set = draw.drawn as f64 * (GAUSSIAN_BYTES.value + COLOR_BYTES.value);
    let again = (needed - draw.drawn as f64).max(0.0);
    let misses = again * (1.0 - CACHE.value / set.max(CACHE.value));
    let first = draw.drawn as f64;
    let pixels = draw.tiles.len() as f64 * f64::from(TILE_SIDE * TILE_SIDE);
    needed * ENTRY_BYTES.value + (first + misses) * (GAUSSIAN_BYTES.value + COLOR_BYTES.value) + pixels * 20.0
}

/// Cycles until all blocks have ended. A block goes to the first SM with a free slot; those on an SM share its issue
/// slots.
fn schedule(blocks: &[Block], sms: usize) -> f64 {
    let mut waiting = blocks.iter();
    // For each block on an SM: the cycles left of its share of the SM, and of its least cycles.
    let mut resident: Vec<Vec<[f64; 2]>> = vec![Vec::new(); sms];
    let mut now = 0.0;
    loop {
        // The SM with the fewest blocks is first.
        while let Some(place) =
            (0..sms).filter(|&sm| resident[sm].len() < RESIDENT.value as usize).min_by_key(|&sm| resident[sm].len())
            && let Some(block) = waiting.next()
        {
            let pace = if block.cycles > 0.0 { (block.least / block.cycles).max(1.0) } else { 1.0 };
            resident[place].push([block.cycles, pace]);
        }
        // The pace of a block is its share of the SM, or its own if that is slower.
        let slowness = |blocks: &[[f64; 2]], pace: f64| pace.max(blocks.len() as f64);
        let ends = resident.iter().flat_map(|blocks| {
            let until = |[left, pace]: &[f64; 2]| left * slowness(blocks, *pace);
            blocks.iter().map(until)
        });
        let next = ends.fold(f64::INFINITY, f64::min);
        if !next.is_finite() {
            return now;
        }
        now += next;
        for blocks in &mut resident {
            let count = blocks.len() as f64;
            for [left, pace] in blocks.iter_mut() {
                *left -= next / pace.max(count);
            }
            blocks.retain(|[left, _]| *left > 1e-6);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::simulate::even_frame;

    fn config() -> Config {
        Config::preset("orin-nx-10w", &[]).unwrap()
    }

    #[test]
    fn warps_wait_for_their_slowest_lane() {
        let mut frame = even_frame([320, 320], 400_000, 0.2);
        let whole = simulate(&frame, &config());
        assert!((whole.warps - 8.0 * 400_000.0).abs() < 1e-6);
        // Half of the rows finish, one of each two: all warps continue.
        let set = |frame: &mut FrameWork, rows| {
            for tile in &mut frame.draws[0].tiles {
                tile.runs[0].rows = rows;
            }
        };
        set(&mut frame, 15);
        assert_eq!(simulate(&frame, &config()).warps, whole.warps);
        set(&mut frame, 8);
        let half = simulate(&frame, &config());
        assert!(half.warps == whole.warps / 2.0 && half.compute_ms < 0.6 * whole.compute_ms);
    }

    #[test]
    fn skipped_pairs_cost_less_than_blended_ones() {
        let mut frame = even_frame([320, 320], 400_000, 0.2);
        let all = simulate(&frame, &config());
        assert_eq!(all.blended, 1.0);
        for tile in &mut frame.draws[0].tiles {
            tile.runs[0].reached = tile.listed;
        }
        let few = simulate(&frame, &config());
        assert!((few.blended - 0.25).abs() < 1e-9);
        let ratio = (SKIPPED.value + BLENDED.value) / (SKIPPED.value + 0.25 * BLENDED.value);
        assert!((all.compute_ms / few.compute_ms / ratio - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_long_block_is_a_tail() {
        let even = even_frame([320, 320], 400_000, 0.2);
        assert!(simulate(&even, &config()).tail_ms < 0.05 * simulate(&even, &config()).compute_ms);
        let mut one = even.clone();
        let last = one.draws[0].tiles.len() - 1;
        let tile = &mut one.draws[0].tiles[last];
        *tile = TileWork::open(tile.at, 60_000);
        let result = simulate(&one, &config());
        assert!(result.tail_ms > 0.2 * result.compute_ms, "{result:?}");
    }

    #[test]
    fn instructions_are_those_of_the_compiled_kernel() {
        let counts: toml::Table = toml::from_str(include_str!("../baseline/counts.toml")).unwrap();
        let build = &counts["build"][0];
        assert_eq!(counts["commit"].as_str(), Some("59f5f77"));
        assert_eq!(build["version"].as_str(), Some("12.9.86"));
        assert!(build["flags"].as_array().unwrap().is_empty());
        let count = |path: &str, kind: &str| build[path].get(kind).map_or(0, |count| count.as_integer().unwrap());
        let more = |kind: &str| count("blended", kind) - count("skipped_alpha", kind);
        let loads = |count: &dyn Fn(&str) -> i64| count("shared_loads") + count("global_loads");
        let skipped = |kind: &str| count("skipped_alpha", kind);
        let expected = [
            (SKIPPED.value, skipped("instructions")),
            (BLENDED.value, more("instructions")),
            (BATCH_INSTRUCTIONS.value, count("batch", "instructions")),
            (SKIPPED_SPECIAL, skipped("special")),
            (0.0, more("special")),
            (SKIPPED_LOADS, loads(&skipped)),
            (BLENDED_LOADS, loads(&more)),
        ];
        for (value, counted) in expected {
            assert_eq!(value, counted as f64);
        }
        // Registers are given to warps by eight a thread, and an SM has 65,536.
        let registers = build["registers"].as_integer().unwrap() as u64;
        let threads = (RESIDENT.value * WARPS_OF_A_BLOCK.value * WARP.value) as u64;
        assert!(registers.next_multiple_of(8) * threads <= 65_536);
    }

    #[test]
    fn every_number_has_a_source() {
        assert!(MACHINE.iter().all(|parameter| parameter.source.len() > 10));
    }
}
