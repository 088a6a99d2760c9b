//! The results of a rasterizer module without its timing: a tile's list goes through a processing element, pixel by
//! pixel. It gives the bits that `rtl/raster_module.sv` writes, and the tile's work for the timing models.

use crate::exponential::Exponential;
use crate::number::Format;
use crate::pe::{Gaussian, Pe, Pixel, Thresholds, Triangle};
use timing::work::{BlockIntervals, INTERVALS, Mode, Run, TILE_GROUPS, TILE_SIDE, TileWork};

const GROUPS: usize = TILE_GROUPS as usize;
/// Pixels of a group, and PEs of a module.
const LANES: usize = 16;

/// The shape of a group of 16 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Groups {
    /// Rows of a tile.
    Rows,
    /// Blocks of 4x4 pixels.
    Blocks,
}

impl Groups {
    /// The centre of a group's pixel, in pixels from the tile's corner.
    pub fn centre(self, group: usize, lane: usize) -> [f32; 2] {
        let [x, y] = match self {
            Self::Rows => [lane, group],
            Self::Blocks => [group % 4 * 4 + lane % 4, group / 4 * 4 + lane / 4],
        };
        [x as f32 + 0.5, y as f32 + 0.5]
    }
}

/// A primitive of a tile's list: the groups in which it is evaluated, a bit each, and its nine numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// A triangle.
    Triangle(u16, Triangle),
    /// A Gaussian.
    Gaussian(u16, Gaussian),
}

impl Primitive {
    /// The groups in which it is evaluated, a bit each.
    pub fn groups(&self) -> u16 {
        match self {
            Self::Triangle(groups, _) | Self::Gaussian(groups, _) => *groups,
        }
    }

    /// Its numbers in the order of memory.
    pub fn numbers(&self) -> [u32; 9] {
        match self {
            Self::Triangle(_, triangle) => triangle.numbers(),
            Self::Gaussian(_, gaussian) => gaussian.numbers(),
        }
    }
}

/// A tile's list, of primitives of one mode.
#[derive(Clone, Debug, PartialEq)]
pub struct List {
    /// The mode.
    pub mode: Mode,
    /// The primitives in order, at least one.
    pub primitives: Vec<Primitive>,
}

/// The parameters of a module that its results depend on.
#[derive(Clone, Debug)]
pub struct Module {
    /// The format of its numbers.
    pub format: Format,
    /// The design of its exponential units.
    pub exponential: Exponential,
    /// The shape of its groups.
    pub groups: Groups,
    /// True if groups of finished pixels are skipped.
    pub skips_groups: bool,
    /// Thresholds of the draw.
    pub thresholds: Thresholds,
    /// The depth's two coefficients: depth is the first plus the second over w.
    pub depth: [u32; 2],
}

/// The result of drawing a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Three numbers for each pixel, by group and lane: a colour, or u, v and depth.
    pub pixels: Vec<[u32; 3]>,
    /// The work of the tile. Its runs are cut between any two primitives whose numbers differ. A primitive reaches the
    /// groups in which it is evaluated.
    pub work: TileWork,
}

impl Module {
    /// A module with the thresholds of the original 3DGS code, and depth equal to 1/w.
    pub fn new(format: Format, exponential: Exponential, groups: Groups) -> Self {
        Self {
            format,
            exponential,
            groups,
            skips_groups: false,
            thresholds: Thresholds::new(format),
            depth: [0, format.one()],
        }
    }

    /// Draws a tile.
    pub fn draw(&self, list: &List) -> Drawn {
        match list.mode {
            Mode::Gaussian => self.draw_gaussians(list),
            Mode::Triangle => self.draw_triangles(list),
        }
    }

    fn centres(&self) -> Vec<[u32; 2]> {
        let centre = |index| {
            let [x, y] = self.groups.centre(index / LANES, index % LANES);
            [self.format.number(x), self.format.number(y)]
        };
        (0..GROUPS * LANES).map(centre).collect()
    }

    fn draw_gaussians(&self, list: &List) -> Drawn {
        let mut pe = Pe::new(self.format, self.exponential);
        let mut pixels = vec![Pixel::new(self.format); GROUPS * LANES];
        let centres = self.centres();
        let mut work = TileWork { listed: list.primitives.len() as u32, ..TileWork::default() };
        let mut intervals = BlockIntervals::default();
        for primitive in &list.primitives {
            let open = open_groups(&pixels);
            if open == 0 {
                break;
            }
            let (open, rows) = match self.skips_groups {
                true => (open, self.open_rows(&pixels)),
                false => (u16::MAX, TILE_SIDE as u8),
            };
            let reached = primitive.groups() & open;
            intervals.evaluate(reached);
            let (blocks, reached_count) = (open.count_ones() as u8, reached.count_ones());
            let waits = Some(intervals.take());
            push(&mut work.runs, Run { primitives: 1, rows, blocks, reached: reached_count, waits, ..Run::default() });
            let Primitive::Gaussian(_, gaussian) = primitive else {
                continue;
            };
            for group in (0..GROUPS).filter(|group| reached >> group & 1 == 1) {
                for index in group * LANES..(group + 1) * LANES {
                    let pixel = &mut pixels[index];
                    let blended = pe.gaussian(gaussian, centres[index], &self.thresholds, pixel);
                    work.contributions += u64::from(blended);
                }
            }
        }
        work.terminated = pixels.iter().filter(|pixel| pixel.finished).count() as u32;
        Drawn { pixels: pixels.iter().map(|pixel| pixel.color).collect(), work }
    }

    fn draw_triangles(&self, list: &List) -> Drawn {
        let mut pe = Pe::new(self.format, self.exponential);
        let centres = self.centres();
        let mut pixels = vec![[0, 0, self.format.greatest()]; GROUPS * LANES];
        let mut work = TileWork { listed: list.primitives.len() as u32, ..TileWork::default() };
        for primitive in &list.primitives {
            let groups = primitive.groups();
            let (side, reached) = (TILE_SIDE as u8, groups.count_ones());
            push(&mut work.runs, Run { primitives: 1, rows: side, blocks: side, reached, ..Run::default() });
            let Primitive::Triangle(_, triangle) = primitive else {
                continue;
            };
            for group in (0..GROUPS).filter(|group| groups >> group & 1 == 1) {
                for index in group * LANES..(group + 1) * LANES {
                    let Some(fragment) = pe.triangle(triangle, centres[index], self.depth) else {
                        continue;
                    };
                    if self.is_nearer(fragment.depth, pixels[index][2]) {
                        pixels[index] = [fragment.u, fragment.v, fragment.depth];
                        work.contributions += 1;
                    }
                }
            }
        }
        Drawn { pixels, work }
    }

    /// Compares depths by sign and magnitude, so that -0 is nearer than 0.
    fn is_nearer(&self, depth: u32, than: u32) -> bool {
        let [a, b] = [depth, than].map(|depth| self.format.is_negative(depth));
        match (a, b) {
            (false, false) => depth < than,
            (true, true) => depth > than,
            _ => a,
        }
    }

    /// Rows with a pixel that is not finished.
    fn open_rows(&self, pixels: &[Pixel]) -> u8 {
        let mut rows = 0u16;
        for (index, pixel) in pixels.iter().enumerate() {
            let [_, y] = self.groups.centre(index / LANES, index % LANES);
            rows |= u16::from(!pixel.finished) << y as u32;
        }
        rows.count_ones() as u8
    }
}

/// Groups with a pixel that is not finished, a bit each.
fn open_groups(pixels: &[Pixel]) -> u16 {
    let groups = pixels.chunks(LANES).enumerate();
    let open = groups.filter(|(_, pixels)| pixels.iter().any(|pixel| !pixel.finished));
    open.fold(0, |open, (group, _)| open | 1 << group)
}

/// Appends a primitive to the runs; it extends the last run if that is equal to it.
fn push(runs: &mut Vec<Run>, primitive: Run) {
    match runs.last_mut() {
        Some(run)
            if (run.rows, run.blocks) == (primitive.rows, primitive.blocks)
                && run.reached == primitive.reached * run.primitives
                && [run.waits, primitive.waits].iter().flatten().all(|waits| waits[INTERVALS - 1] == 0) =>
        {
            run.primitives += 1;
            run.reached += primitive.reached;
        }
        _ => runs.push(primitive),
    }
}
