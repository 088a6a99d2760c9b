//! The trace of work: the work of a device for a frame, in the units that hardware spends time and energy on. It does
//! not say how long the work takes; every model in this crate reads it and none changes it.

use serde::{Deserialize, Serialize};

/// The side in pixels of a trace's tiles, and the number of rows (or 4x4 blocks) of one.
pub const TILE_SIDE: u32 = 16;
/// Pixels of such a tile.
pub const TILE_PIXELS: u32 = TILE_SIDE * TILE_SIDE;
/// Groups of 16 pixels (rows, or 4x4 blocks) of such a tile.
pub const TILE_GROUPS: u32 = 16;
/// The version of [`Trace`]'s layout.
pub const TRACE_VERSION: u32 = 4;
/// The sides in pixels of the tiles that [`DrawWork::sized_pairs`] counts.
pub const TILE_SIDES: [u32; 4] = [8, 16, 32, 64];

/// The work of a program, as a list of frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trace {
    /// The layout's version, [`TRACE_VERSION`].
    pub version: u32,
    /// Frames, oldest first: render passes that drew something, with the dispatches before them. Dispatches after the
    /// last pass are a frame without draws.
    pub frames: Vec<FrameWork>,
}

/// The work of one frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameWork {
    /// Width and height of the render target, in pixels.
    pub size: [u32; 2],
    /// The work of compute programs since the pass before, all dispatches together.
    #[serde(default)]
    pub compute: ShaderWork,
    /// The number of these dispatches.
    #[serde(default)]
    pub dispatches: u64,
    /// Draws in submission order.
    pub draws: Vec<DrawWork>,
}

/// The mode of the rasterizer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Triangles: coverage, weights and depth.
    Triangle,
    /// Gaussians: front-to-back accumulation.
    #[default]
    Gaussian,
}

/// The work of one draw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawWork {
    /// The rasterizer's mode.
    pub mode: Mode,
    /// Primitives that the draw named.
    pub primitives: u64,
    /// Primitives that reached at least one tile.
    pub drawn: u64,
    /// Pairs of a tile and a Gaussian if each Gaussian is listed in all tiles that the square around its 3-sigma circle
    /// touches, as in the original 3DGS code; at least the pairs of the lists; 0 if unknown.
    pub boxed_pairs: u64,
    /// Pairs of a tile and a primitive whose bounding box touches it, for tiles of each of [`TILE_SIDES`]; 0 if
    /// unknown. Only their ratios are used, because lists are made by exact tests.
    #[serde(default)]
    pub sized_pairs: [u64; TILE_SIDES.len()],
    /// Stage 1, preprocessing: projection, spherical harmonics or vertex programs.
    pub preprocess: ShaderWork,
    /// Stage 2: making tile lists, of Gaussians in depth order.
    pub sort: ShaderWork,
    /// The work after rasterization: fragment programs.
    #[serde(default)]
    pub shade: ShaderWork,
    /// The places of the draw's records and lists in the memory of the simulated machine.
    #[serde(default)]
    pub places: Places,
    /// Tiles whose list is not empty, in the order in which they are dispatched.
    pub tiles: Vec<TileWork>,
}

/// Bytes of a primitive's record: nine numbers of 32 bits (GauRast, Table II).
pub const RECORD_BYTES: u64 = 36;
/// Bytes of an entry of a list.
pub const ENTRY_BYTES: u64 = 4;

/// Addresses in the memory of the simulated machine, in bytes. [`FrameWork::place`] sets them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Places {
    /// The record of id 0. Stage 1 writes it, and the rasterizer reads it; that of id `n` is `n` [`RECORD_BYTES`] on.
    pub records: u64,
    /// The first entry of the first tile's list. The lists follow each other in the order of the tiles, without gaps,
    /// and an entry has [`ENTRY_BYTES`].
    pub lists: u64,
}

/// The work of shader cores: operations, counted by single lanes, and bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShaderWork {
    /// 32-bit floating-point additions, multiplications and fused ones, comparisons and selections.
    pub float: f64,
    /// 32-bit integer operations.
    pub integer: f64,
    /// Divisions, roots, exponentials.
    pub special: f64,
    /// 64-bit operations.
    pub wide: f64,
    /// Loads, stores and atomics.
    pub memory: f64,
    /// Texture samples, image reads and writes.
    pub image: f64,
    /// Moves, conversions, control flow and exchanges between lanes, which take only issue slots.
    pub other: f64,
    /// Bytes moved to and from main memory.
    pub bytes: f64,
}

impl ShaderWork {
    /// Reports whether every count is a number and not negative.
    pub(crate) fn is_valid(&self) -> bool {
        let counts =
            [self.float, self.integer, self.special, self.wide, self.memory, self.image, self.other, self.bytes];
        counts.iter().all(|count| (0.0..1e18).contains(count))
    }

    /// The sum of two.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            float: self.float + other.float,
            integer: self.integer + other.integer,
            special: self.special + other.special,
            wide: self.wide + other.wide,
            memory: self.memory + other.memory,
            image: self.image + other.image,
            other: self.other + other.other,
            bytes: self.bytes + other.bytes,
        }
    }

    /// The work times `factor`.
    pub fn times(&self, factor: f64) -> Self {
        Self {
            float: self.float * factor,
            integer: self.integer * factor,
            special: self.special * factor,
            wide: self.wide * factor,
            memory: self.memory * factor,
            image: self.image * factor,
            other: self.other * factor,
            bytes: self.bytes * factor,
        }
    }

    /// All operations.
    pub fn operations(&self) -> f64 {
        self.float + self.integer + self.special + self.wide + self.memory + self.image + self.other
    }
}

/// The work of one draw in one 16x16 tile.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TileWork {
    /// Column and row in tiles.
    pub at: [u32; 2],
    /// Primitives in the tile's list.
    pub listed: u32,
    /// The list from its front, cut where the number of unfinished pixels changes. Primitives after the last run were
    /// not fetched, because the tile was finished.
    pub runs: Vec<Run>,
    /// Pairs of a pixel and a primitive that changed the pixel.
    pub contributions: u64,
    /// Pixels that were finished before the list's end.
    pub terminated: u32,
    /// Primitives at the end of the last run that all depths of the tile hide, if the list's depths only grow or only
    /// shrink. Hierarchical depth ends the list before them.
    #[serde(default)]
    pub hidden_rest: u32,
    /// Quads of 2x2 pixels that fragment programs shaded.
    #[serde(default)]
    pub quads: u32,
    /// Quads that were covered but failed early tests in every pixel. Quads of hidden primitives are not counted.
    #[serde(default)]
    pub killed: u32,
    /// The number of the tile among those of its place in the draw: layers, views, and parts of the draw that are
    /// rendered one after the other.
    #[serde(default)]
    pub layer: u32,
    /// The ids of the list's primitives, in its order: numbers of their records. Empty if unknown. Draws of Gaussians
    /// have them in the last frame that was recorded.
    #[serde(default)]
    pub ids: Vec<u32>,
}

/// Consecutive primitives of a tile's list, between two changes of the number of unfinished pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Primitives.
    pub primitives: u32,
    /// Rows of 16 pixels with an unfinished pixel, 0 to 16.
    pub rows: u8,
    /// Blocks of 4x4 pixels with an unfinished pixel, 0 to 16.
    pub blocks: u8,
    /// Pairs of a primitive and an unfinished 4x4 block that it reaches, summed over the primitives; without
    /// `hidden_blocks`.
    pub reached: u32,
    /// The number of primitives that all of the tile's depths hide.
    #[serde(default)]
    pub hidden: u32,
    /// Pairs of a primitive and an unfinished 4x4 block that it reaches, if all of the block's depths hide it. For
    /// triangles, only those that the whole tile hides are counted; for Gaussians, all.
    #[serde(default)]
    pub hidden_blocks: u32,
    /// Statistics of the intervals between evaluations in a block, from [`BlockIntervals`]; none if unknown, and of
    /// triangles.
    #[serde(default)]
    pub waits: Option<[u32; INTERVALS]>,
}

/// The intervals that [`Run::waits`] is of: 2 to 9 evaluations.
pub const INTERVALS: usize = 8;

/// The cycles that a module waits for pixels' transmittances, if it evaluates a block in a cycle, in the order of the
/// list and of the blocks' numbers, and evaluates no block again before an interval has passed.
#[derive(Clone, Debug)]
pub struct BlockIntervals {
    machines: [Intervals; INTERVALS],
}

/// The cycles of one interval.
#[derive(Clone, Copy, Debug, Default)]
struct Intervals {
    now: u64,
    /// The cycle from which each block may be evaluated again.
    free: [u64; TILE_GROUPS as usize],
    waited: u32,
}

impl Default for BlockIntervals {
    fn default() -> Self {
        Self { machines: [Intervals::default(); INTERVALS] }
    }
}

impl BlockIntervals {
    /// Evaluates a primitive in blocks, a bit each.
    pub fn evaluate(&mut self, blocks: u16) {
        for (index, machine) in self.machines.iter_mut().enumerate() {
            let interval = index as u64 + 2;
            let mut left = blocks;
            while left != 0 {
                let free = &mut machine.free[left.trailing_zeros() as usize];
                left &= left - 1;
                let begin = machine.now.max(*free);
                machine.waited = machine.waited.saturating_add((begin - machine.now) as u32);
                *free = begin + interval;
                machine.now = begin + 1;
            }
        }
    }

    /// The cycles waited since the last call, for each interval.
    pub fn take(&mut self) -> [u32; INTERVALS] {
        std::array::from_fn(|index| std::mem::take(&mut self.machines[index].waited))
    }
}

impl Run {
    /// Groups of 16 pixels that hardware of this saturation, with or without hierarchical depth, evaluates.
    fn groups(&self, saturation: Saturation, hierarchical_depth: bool) -> u64 {
        let evaluated = if hierarchical_depth { self.primitives.saturating_sub(self.hidden) } else { self.primitives };
        let open = match saturation {
            Saturation::None | Saturation::Tile => TILE_GROUPS,
            Saturation::Row => self.rows.into(),
            Saturation::Block => self.blocks.into(),
            Saturation::Reached if hierarchical_depth => return self.reached.into(),
            Saturation::Reached => {
                return u64::from(self.reached) + u64::from(self.hidden_blocks);
            }
        };
        u64::from(evaluated) * u64::from(open)
    }

    /// Groups of 16 pixels in which hardware of this saturation may evaluate a primitive.
    fn open(&self, saturation: Saturation) -> u64 {
        match saturation {
            Saturation::None | Saturation::Tile => TILE_GROUPS.into(),
            Saturation::Row => self.rows.into(),
            Saturation::Block | Saturation::Reached => self.blocks.into(),
        }
    }

    /// The run without its last `rest` primitives, which are hidden.
    fn without(&self, rest: u32) -> Self {
        Self { primitives: self.primitives.saturating_sub(rest), hidden: self.hidden.saturating_sub(rest), ..*self }
    }
}

/// The granularity at which finished pixels are skipped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Saturation {
    /// Nothing is skipped: every primitive of the list is evaluated at every pixel.
    None,
    /// The tile's list ends once all its pixels are finished.
    #[default]
    Tile,
    /// Also, finished rows of 16 pixels are skipped.
    Row,
    /// Also, finished blocks of 4x4 pixels are skipped.
    Block,
    /// Finished blocks of 4x4 pixels are skipped, and a primitive is evaluated only in blocks that it reaches.
    Reached,
}

impl Saturation {
    /// Every granularity, the coarsest first.
    pub const ALL: [Self; 5] = [Self::None, Self::Tile, Self::Row, Self::Block, Self::Reached];
}

impl TileWork {
    /// A tile of which all pixels stay unfinished and that every primitive covers.
    pub fn open(at: [u32; 2], listed: u32) -> Self {
        Self {
            at,
            listed,
            runs: vec![Run {
                primitives: listed,
                rows: 16,
                blocks: 16,
                reached: listed * TILE_GROUPS,
                ..Run::default()
            }],
            contributions: u64::from(listed) * u64::from(TILE_PIXELS),
            ..Self::default()
        }
    }

    /// Primitives before the end of the last run: those that an unfinished pixel needs, or would need without depth
    /// tests.
    pub fn needed(&self) -> u32 {
        self.runs.iter().map(|run| run.primitives).sum()
    }

    /// Primitives that all of the tile's depths hide.
    pub fn hidden(&self) -> u32 {
        self.runs.iter().map(|run| run.hidden).sum()
    }

    /// Pairs of a primitive and a 4x4 block whose depths hide it; see [`Run::hidden_blocks`].
    pub fn hidden_blocks(&self) -> u32 {
        let blocks = self.runs.iter().map(|run| run.hidden_blocks);
        blocks.fold(0, u32::saturating_add)
    }

    /// The parts of the list that hardware of this saturation, with or without hierarchical depth, fetches, in order.
    /// Each has its primitives and the groups of 16 pixels in which they are evaluated.
    pub fn segments(&self, saturation: Saturation, hierarchical_depth: bool) -> impl Iterator<Item = Segment> {
        let all = matches!(saturation, Saturation::None);
        let rest = if all { self.listed.saturating_sub(self.needed()) } else { 0 };
        let last = self.runs.len().wrapping_sub(1);
        let ends_early = hierarchical_depth && !all;
        let runs = self.runs.iter().enumerate().map(move |(index, run)| {
            let run = if ends_early && index == last { run.without(self.hidden_rest) } else { *run };
            Segment {
                primitives: run.primitives,
                groups: run.groups(saturation, hierarchical_depth),
                open: run.open(saturation),
                waits: if saturation == Saturation::Reached { run.waits } else { None },
            }
        });
        let rest = Segment {
            primitives: rest,
            groups: u64::from(rest) * u64::from(TILE_GROUPS),
            open: TILE_GROUPS.into(),
            waits: None,
        };
        runs.chain([rest]).filter(|segment| segment.primitives > 0)
    }

    /// Pairs of a pixel and a primitive that such hardware evaluates; see [`Self::segments`].
    pub fn evaluations(&self, saturation: Saturation, hierarchical_depth: bool) -> u64 {
        self.segments(saturation, hierarchical_depth)
            .map(|segment| segment.groups * u64::from(TILE_PIXELS / TILE_GROUPS))
            .sum()
    }
}

/// Consecutive primitives of the same cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Primitives.
    pub primitives: u32,
    /// Groups of 16 pixels that they are evaluated in, summed over the primitives.
    pub groups: u64,
    /// Groups of 16 pixels in which each of them may be evaluated.
    pub open: u64,
    /// The waits of the run, if its primitives are evaluated in the blocks that they reach.
    pub waits: Option<[u32; INTERVALS]>,
}

impl DrawWork {
    /// Pairs of a tile and a primitive in the lists.
    pub fn pairs(&self) -> u64 {
        self.tiles.iter().map(|tile| u64::from(tile.listed)).sum()
    }

    /// Pairs of a tile and a primitive that unfinished pixels needed.
    pub fn needed_pairs(&self) -> u64 {
        self.tiles.iter().map(|tile| u64::from(tile.needed())).sum()
    }

    /// Pairs of a pixel and a primitive that are evaluated; see [`TileWork::evaluations`].
    pub fn evaluations(&self, saturation: Saturation, hierarchical_depth: bool) -> u64 {
        self.tiles.iter().map(|tile| tile.evaluations(saturation, hierarchical_depth)).sum()
    }
}

impl FrameWork {
    /// Pairs of a tile and a primitive in the lists.
    pub fn pairs(&self) -> u64 {
        self.draws.iter().map(DrawWork::pairs).sum()
    }

    /// The work of the shader cores: dispatches, stages 1 and 2 of all draws, and fragment programs.
    pub fn shader(&self) -> [ShaderWork; 4] {
        let zero = ShaderWork::default();
        self.draws.iter().fold([self.compute, zero, zero, zero], |[compute, one, two, after], draw| {
            [compute, one.plus(&draw.preprocess), two.plus(&draw.sort), after.plus(&draw.shade)]
        })
    }

    /// The frame with as many pairs as 3-sigma squares give, and the sorting work for them. The trace does not say in
    /// which tiles they are: every list grows by the same factor, so the result is an estimate.
    pub fn with_squares(&self) -> Self {
        let mut frame = self.clone();
        for draw in &mut frame.draws {
            let pairs = draw.pairs();
            if draw.mode != Mode::Gaussian || pairs == 0 || draw.boxed_pairs <= pairs {
                continue;
            }
            let factor = draw.boxed_pairs as f64 / pairs as f64;
            let longer = |count: u32| (f64::from(count) * factor).round() as u32;
            draw.sort = draw.sort.times(factor);
            draw.boxed_pairs = 0;
            for tile in &mut draw.tiles {
                tile.ids = Vec::new();
                for run in &mut tile.runs {
                    run.primitives = longer(run.primitives);
                    run.waits = run.waits.map(|waits| waits.map(longer));
                    run.hidden = longer(run.hidden).min(run.primitives);
                }
                tile.hidden_rest = longer(tile.hidden_rest);
                tile.listed = longer(tile.listed).max(tile.needed());
            }
        }
        frame
    }

    /// Gives the draws places in memory: from address 0 on, each draw's records, then its lists, each aligned to 64
    /// bytes.
    pub fn place(&mut self) {
        let aligned = |address: u64| address.next_multiple_of(64);
        let mut address = 0;
        for draw in &mut self.draws {
            let last = draw.tiles.iter().flat_map(|tile| &tile.ids).max();
            let records = last.map_or(draw.drawn, |&last| u64::from(last) + 1);
            draw.places.records = address;
            draw.places.lists = aligned(address + records * RECORD_BYTES);
            address = aligned(draw.places.lists + draw.pairs() * ENTRY_BYTES);
        }
    }

    /// The frame with only the draws of one mode, and without dispatches.
    pub fn of_mode(&self, mode: Mode) -> Self {
        let draws = self.draws.iter().filter(|draw| draw.mode == mode);
        Self { size: self.size, draws: draws.cloned().collect(), ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile() -> TileWork {
        let run = |primitives, rows, blocks, reached| Run { primitives, rows, blocks, reached, ..Run::default() };
        TileWork {
            at: [0, 0],
            listed: 10,
            runs: vec![run(3, 16, 16, 20), run(4, 9, 7, 8)],
            contributions: 100,
            terminated: 256,
            ..TileWork::default()
        }
    }

    #[test]
    fn finer_saturation_evaluates_less() {
        let evaluations = Saturation::ALL.map(|saturation| tile().evaluations(saturation, false));
        assert_eq!(evaluations, [10 * 256, 7 * 256, (48 + 36) * 16, (48 + 28) * 16, 28 * 16]);
    }

    #[test]
    fn what_was_not_needed_is_a_segment_without_saturation() {
        let segments: Vec<_> = tile().segments(Saturation::None, false).collect();
        assert_eq!(segments.len(), 3);
        assert_eq!(segments[2], Segment { primitives: 3, groups: 48, open: 16, waits: None });
        assert_eq!(tile().segments(Saturation::Row, false).count(), 2);
    }

    #[test]
    fn hierarchical_depth_spares_what_is_hidden() {
        let mut tile = tile();
        // Of the last run's four primitives, the tile hides one, two more are behind everything, and a block hides the
        // fourth.
        tile.runs[1] = Run { hidden: 3, hidden_blocks: 6, reached: 2, ..tile.runs[1] };
        tile.hidden_rest = 2;
        let groups = |hierarchical| Saturation::ALL.map(|saturation| tile.evaluations(saturation, hierarchical) / 16);
        assert_eq!(groups(false), [160, 112, 84, 76, 28]);
        // Without saturation the list is fetched to its end, and primitives beyond the runs are evaluated, too.
        assert_eq!(groups(true), [112, 64, 57, 55, 22]);
        let fetched = |saturation, hierarchical| -> u32 {
            let segments = tile.segments(saturation, hierarchical);
            segments.map(|segment| segment.primitives).sum()
        };
        assert_eq!(Saturation::ALL.map(|s| fetched(s, false)), [10, 7, 7, 7, 7]);
        assert_eq!(Saturation::ALL.map(|s| fetched(s, true)), [10, 5, 5, 5, 5]);
        assert_eq!((tile.hidden(), tile.hidden_blocks()), (3, 6));
    }

    #[test]
    fn blocks_wait_for_their_last_evaluation() {
        let waits = |masks: &[u16]| {
            let mut intervals = BlockIntervals::default();
            masks.iter().for_each(|&mask| intervals.evaluate(mask));
            intervals.take()
        };
        // The same block again waits for the rest of each interval.
        assert_eq!(waits(&[1, 1]), [1, 2, 3, 4, 5, 6, 7, 8]);
        // Of two blocks in turn, the second has waited with the first.
        assert_eq!(waits(&[0b100, 0b1000, 0b100, 0b1000]), [0, 1, 2, 3, 4, 5, 6, 7]);
        // 16 blocks hide all intervals.
        assert_eq!(waits(&[u16::MAX, u16::MAX]), [0; INTERVALS]);
        // A longer interval waits for more, in a list that has both.
        assert!(waits(&[0b11, 0b110, 0b1, 0b1000, 0b11]).is_sorted());
    }

    #[test]
    fn records_and_lists_have_places_of_their_own() {
        let draw = |ids: &[u32]| DrawWork {
            drawn: 3,
            tiles: vec![TileWork { listed: 5, ids: ids.to_vec(), ..TileWork::default() }],
            ..DrawWork::default()
        };
        let mut frame = FrameWork { draws: vec![draw(&[0, 2, 1, 9, 4]), draw(&[])], ..FrameWork::default() };
        frame.place();
        // Ten records of 36 bytes end at 360, and five entries of four bytes at 404.
        assert_eq!(frame.draws[0].places, Places { records: 0, lists: 384 });
        assert_eq!(frame.draws[1].places, Places { records: 448, lists: 576 });
    }
}
