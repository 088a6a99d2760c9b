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
pub const TRACE_VERSION: u32 = 3;
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

/// The most pairs of a tile and a primitive, and the most tiles of a draw, in a frame of a trace: 19 times as many as
/// the paper's largest scene has.
pub const MAX_PAIRS: u64 = 1 << 28;

/// The most tiles of a picture across and down.
const MAX_TILES_ACROSS: u32 = 1 << 20;

/// The reason that a trace can't be one of a device.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum TraceError {
    /// The layout has another version.
    #[error("a trace of version {0}, not {TRACE_VERSION}")]
    Version(u32),
    /// The frame has more pairs than can be simulated in reasonable time.
    #[error("frame {frame} has {pairs} pairs of a tile and a primitive; it must be at most {MAX_PAIRS}")]
    TooLarge {
        /// The frame, from 0.
        frame: usize,
        /// Its pairs.
        pairs: u64,
    },
    /// A tile's numbers contradict each other.
    #[error("frame {frame}, tile {at:?}: {what}")]
    Tile {
        /// The frame, from 0.
        frame: usize,
        /// Column and row of the tile.
        at: [u32; 2],
        /// The contradiction.
        what: &'static str,
    },
    /// The frame's shader work has a count that is negative or not a number.
    #[error("frame {0}: work of shader cores is negative or no number")]
    ShaderWork(usize),
    /// The frame has a draw whose boxes touch numbers of tiles that no boxes touch.
    #[error("frame {0}: sized_pairs must not grow with the side of a tile, nor shrink by more than four")]
    SizedPairs(usize),
}

impl Trace {
    /// Checks a trace read from a file.
    ///
    /// # Errors
    /// Returns a [`TraceError`] that names the first problem.
    pub fn check(&self) -> Result<(), TraceError> {
        if self.version != TRACE_VERSION {
            return Err(TraceError::Version(self.version));
        }
        for (number, frame) in self.frames.iter().enumerate() {
            frame.check(number)?;
        }
        Ok(())
    }
}

impl FrameWork {
    fn check(&self, frame: usize) -> Result<(), TraceError> {
        let squares = |draw: &DrawWork| draw.boxed_pairs.max(draw.pairs());
        let pairs = self.draws.iter().map(squares).fold(0, u64::saturating_add);
        if pairs > MAX_PAIRS {
            return Err(TraceError::TooLarge { frame, pairs });
        }
        let draws = self.draws.iter();
        let works = draws.flat_map(|draw| [draw.preprocess, draw.sort, draw.shade]);
        if !works.chain([self.compute]).all(|work| work.is_valid()) {
            return Err(TraceError::ShaderWork(frame));
        }
        if !self.draws.iter().all(DrawWork::has_possible_boxes) {
            return Err(TraceError::SizedPairs(frame));
        }
        for tile in self.draws.iter().flat_map(|draw| &draw.tiles) {
            if let Some(what) = tile.contradiction() {
                let at = tile.at;
                return Err(TraceError::Tile { frame, at, what });
            }
        }
        Ok(())
    }
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
    /// touches, as in the original 3DGS code; 0 if unknown.
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
    /// Tiles whose list is not empty, in the order in which they are dispatched.
    pub tiles: Vec<TileWork>,
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
    fn is_valid(&self) -> bool {
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

    /// The contradiction between the tile's numbers, if there is one.
    fn contradiction(&self) -> Option<&'static str> {
        let sum = |of: fn(&Run) -> u32| self.runs.iter().map(|run| u64::from(of(run))).sum::<u64>();
        let groups = |run: &Run| u64::from(run.primitives) * u64::from(TILE_GROUPS);
        if sum(|run| run.primitives) > u64::from(self.listed) {
            return Some("its runs have more primitives than its list");
        }
        if self.runs.iter().any(|run| run.rows > 16 || run.blocks > 16) {
            return Some("a run has more than 16 rows or blocks");
        }
        let reached = |run: &Run| u64::from(run.reached) + u64::from(run.hidden_blocks);
        if self.runs.iter().any(|run| reached(run) > groups(run)) {
            return Some("a run reaches more blocks than its primitives have");
        }
        if self.runs.iter().any(|run| run.hidden > run.primitives) {
            return Some("a run hides more primitives than it has");
        }
        if self.contributions > u64::from(self.listed) * u64::from(TILE_PIXELS) {
            return Some("more pixels are changed than its primitives have");
        }
        if self.at.iter().any(|&at| at >= MAX_TILES_ACROSS) {
            return Some("it is in no picture");
        }
        None
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
            }
        });
        let rest =
            Segment { primitives: rest, groups: u64::from(rest) * u64::from(TILE_GROUPS), open: TILE_GROUPS.into() };
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
}

impl DrawWork {
    /// True if boxes can touch so many tiles of each size: a tile of the next size has four of the size before. Numbers
    /// of 0 are unknown.
    fn has_possible_boxes(&self) -> bool {
        let pairs = self.sized_pairs.windows(2);
        let known = pairs.filter(|pair| pair.iter().all(|&count| count > 0));
        known.into_iter().all(|pair| pair[1] <= pair[0] && pair[0] <= pair[1].saturating_mul(4))
    }

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
                for run in &mut tile.runs {
                    run.primitives = longer(run.primitives);
                    run.hidden = longer(run.hidden).min(run.primitives);
                }
                tile.hidden_rest = longer(tile.hidden_rest);
                tile.listed = longer(tile.listed).max(tile.needed());
            }
        }
        frame
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
        assert_eq!(segments[2], Segment { primitives: 3, groups: 48, open: 16 });
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
    fn what_no_device_does_is_refused() {
        let check = |change: fn(&mut TileWork)| {
            let mut tile = tile();
            change(&mut tile);
            let draw = DrawWork { tiles: vec![tile], ..DrawWork::default() };
            let frame = FrameWork { draws: vec![draw], ..FrameWork::default() };
            let (version, frames) = (TRACE_VERSION, vec![frame]);
            Trace { version, frames }.check()
        };
        assert_eq!(check(|_| ()), Ok(()));
        let pairs = 4_000_000_000;
        assert_eq!(check(|tile| tile.listed = 4_000_000_000), Err(TraceError::TooLarge { frame: 0, pairs }));
        for wrong in [
            (|tile| tile.runs[0].primitives = 10) as fn(&mut TileWork),
            |tile| tile.runs[0].rows = 17,
            |tile| tile.runs[1].reached = 65,
            |tile| tile.runs[1].hidden = 5,
            |tile| tile.contributions = 10 * 256 + 1,
            |tile| tile.contributions = u64::MAX,
            |tile| tile.at = [0, u32::MAX],
        ] {
            assert!(matches!(check(wrong), Err(TraceError::Tile { .. })));
        }
    }

    #[test]
    fn boxes_that_no_primitives_have_are_refused() {
        let check = |sized_pairs| {
            let draw = DrawWork { sized_pairs, ..DrawWork::default() };
            let frame = FrameWork { draws: vec![draw], ..FrameWork::default() };
            let (version, frames) = (TRACE_VERSION, vec![frame]);
            Trace { version, frames }.check()
        };
        for right in [[0; 4], [400, 100, 25, 25], [0, 7, 0, 9]] {
            assert_eq!(check(right), Ok(()), "{right:?}");
        }
        for wrong in [[401, 100, 25, 25], [u64::MAX, 1, 1, 1], [7, 8, 8, 8]] {
            assert_eq!(check(wrong), Err(TraceError::SizedPairs(0)), "{wrong:?}");
        }
    }

    #[test]
    fn shader_work_that_is_no_number_is_refused() {
        for wrong in [f64::NAN, f64::INFINITY, -1.0, 1e18] {
            let work = ShaderWork { bytes: wrong, ..ShaderWork::default() };
            let frame = FrameWork { compute: work, ..FrameWork::default() };
            let (version, frames) = (TRACE_VERSION, vec![frame]);
            let checked = Trace { version, frames }.check();
            assert_eq!(checked, Err(TraceError::ShaderWork(0)), "{wrong}");
        }
    }

    #[test]
    fn traces_survive_json() {
        let trace = Trace {
            version: TRACE_VERSION,
            frames: vec![FrameWork {
                size: [16, 16],
                draws: vec![DrawWork { tiles: vec![tile()], ..DrawWork::default() }],
                ..FrameWork::default()
            }],
        };
        let text = serde_json::to_string(&trace).unwrap();
        assert_eq!(serde_json::from_str::<Trace>(&text).unwrap(), trace);
    }
}
