//! The order in which rasterizer modules take the tiles of a frame: every draw of a tile before the next tile, as the
//! device does. Both models of the rasterizer use this order; apart from it they share only the cost of one primitive and [`crate::ring`].

use crate::config::{Config, Rasterizer};
use crate::work::{DrawWork, FrameWork, Mode, Saturation, Segment, TILE_GROUPS, TILE_SIDE, TILE_SIDES, TileWork};
use std::collections::{BTreeMap, HashMap};

/// The work that one module does without interruption: all draws of a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Column and row of the tile, in tiles of the hardware's size.
    pub at: [u32; 2],
    /// Draws, in order.
    pub parts: Vec<Part>,
}

/// One draw in one tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The mode that it needs.
    pub mode: Mode,
    /// The primitives that are evaluated, with their groups of 16 pixels.
    pub segments: Vec<Segment>,
    /// The number of primitives that are fetched: evaluated or at least checked.
    pub needed: u32,
    /// The number of the list's primitives that are not fetched.
    pub left_over: u32,
}

/// The settings of a rasterizer that its tasks depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Division {
    /// The side of a tile in pixels.
    pub tile_side: u32,
    /// The granularity at which finished pixels are skipped, for Gaussians.
    pub gaussians: Saturation,
    /// The same for triangles.
    pub triangles: Saturation,
    /// True if hidden primitives are dropped.
    pub hierarchical_depth: bool,
}

impl Division {
    /// The settings of a rasterizer.
    pub fn of(raster: &Rasterizer) -> Self {
        Self {
            tile_side: raster.tile_side,
            gaussians: raster.granularity(Mode::Gaussian),
            triangles: raster.granularity(Mode::Triangle),
            hierarchical_depth: raster.hierarchical_depth,
        }
    }

    /// The granularity at which pixels are skipped in a mode.
    pub fn granularity(&self, mode: Mode) -> Saturation {
        match mode {
            Mode::Triangle => self.triangles,
            Mode::Gaussian => self.gaussians,
        }
    }
}

/// The tasks of a frame in the order in which modules take them.
pub fn tasks(frame: &FrameWork, division: &Division) -> Vec<Task> {
    let mut places = HashMap::new();
    let mut tasks: Vec<Task> = Vec::new();
    for draw in &frame.draws {
        let tiles = draw.tiles.iter().map(|tile| (tile.at, part(draw.mode, tile, division)));
        let parts: Vec<_> =
            if division.tile_side == TILE_SIDE { tiles.collect() } else { resized(draw, tiles, division) };
        for (at, part) in parts {
            if part.needed == 0 {
                continue;
            }
            let place = *places.entry(at).or_insert_with(|| {
                let parts = Vec::new();
                tasks.push(Task { at, parts });
                tasks.len() - 1
            });
            if let Some(task) = tasks.get_mut(place) {
                task.parts.push(part);
            }
        }
    }
    tasks
}

/// One draw in a tile of the trace, with the primitives that the hardware fetches.
fn part(mode: Mode, tile: &TileWork, division: &Division) -> Part {
    // Hidden primitives are fetched, too, and so are triangles of which only the bounding box reaches the tile.
    let segments: Vec<_> = tile.segments(division.granularity(mode), division.hierarchical_depth).collect();
    let needed: u32 = segments.iter().map(|segment| segment.primitives).sum();
    Part { mode, segments, needed, left_over: tile.listed.saturating_sub(needed) }
}

/// The lists of a draw in tiles of another size: an estimate. Lists grow in the ratio of the bounding boxes' pairs; a
/// larger tile is finished when the last of its parts is; the number of evaluations by 4x4 blocks does not change.
fn resized(
    draw: &DrawWork,
    tiles: impl Iterator<Item = ([u32; 2], Part)>,
    division: &Division,
) -> Vec<([u32; 2], Part)> {
    let pairs = |side: u32| {
        let index = TILE_SIDES.iter().position(|&known| known == side)?;
        Some(draw.sized_pairs[index] as f64).filter(|&pairs| pairs > 0.0)
    };
    // Without counts, a primitive is taken to be in all pieces of a tile that is divided, and in one of the tiles that
    // are joined.
    let unknown = f64::from(TILE_SIDE / division.tile_side.min(TILE_SIDE)).powi(2);
    let ratio = match (pairs(division.tile_side), pairs(TILE_SIDE)) {
        (Some(these), Some(known)) => these / known,
        _ => unknown,
    };
    let per_pixel = matches!(division.granularity(draw.mode), Saturation::Reached);
    if division.tile_side > TILE_SIDE {
        let factor = division.tile_side / TILE_SIDE;
        let mut joined: BTreeMap<[u32; 2], Vec<Part>> = BTreeMap::new();
        for ([x, y], part) in tiles {
            let at = [y / factor, x / factor];
            joined.entry(at).or_default().push(part);
        }
        let groups = u64::from(TILE_GROUPS * factor * factor);
        let of = |([y, x], parts): ([u32; 2], Vec<Part>)| ([x, y], join(draw.mode, &parts, ratio, groups, per_pixel));
        return joined.into_iter().map(of).collect();
    }
    let factor = TILE_SIDE / division.tile_side;
    let pieces = factor * factor;
    let share = ratio / f64::from(pieces);
    let mut out = Vec::new();
    for ([x, y], part) in tiles {
        let groups = u64::from(TILE_GROUPS / pieces);
        let piece = join(draw.mode, &[part], share, groups, per_pixel);
        for number in 0..pieces {
            let mut piece = piece.clone();
            for segment in &mut piece.segments {
                // The groups of the tile are divided among its pieces.
                if per_pixel {
                    let (n, k) = (u64::from(pieces), u64::from(number));
                    segment.groups = (k + 1) * segment.groups / n - k * segment.groups / n;
                }
            }
            out.push(([x * factor + number % factor, y * factor + number / factor], piece));
        }
    }
    out
}

/// Joins lists into one that is `ratio` times as long as all of them. Each primitive takes `groups` groups, unless
/// `per_pixel` says that it is evaluated only in groups that it reaches.
fn join(mode: Mode, parts: &[Part], ratio: f64, groups: u64, per_pixel: bool) -> Part {
    let listed = |part: &Part| f64::from(part.needed + part.left_over);
    let longest = parts.iter().map(listed).fold(0.0, f64::max) * ratio.min(1.0);
    let all = parts.iter().map(listed).sum::<f64>() * ratio;
    let all = all.max(longest).round().max(1.0) as u32;
    let finished = parts.iter().map(|part| f64::from(part.needed) / listed(part).max(1.0)).fold(0.0, f64::max);
    let needed = ((f64::from(all) * finished).ceil() as u32).min(all);
    let reached = parts.iter().flat_map(|part| &part.segments).map(|segment| segment.groups).sum();
    let segment = Segment {
        primitives: needed,
        groups: if per_pixel { reached } else { u64::from(needed) * groups },
        open: groups,
        waits: None,
    };
    Part { mode, segments: vec![segment; usize::from(needed > 0)], needed, left_over: all - needed }
}

/// Rates in cycles of the rasterizer's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Bytes per cycle of one module's port.
    pub port: f64,
    /// Bytes per cycle of main memory, for all modules together.
    pub memory: f64,
    /// Cycles from a request to its first byte.
    pub latency: u32,
}

impl Rates {
    /// The rates of the rasterizer while other units move `others_gb_s`. It has at least half of main memory's rate,
    /// because the arbiter is fair.
    pub fn new(config: &Config, others_gb_s: f64) -> Self {
        let memory = &config.memory;
        let whole = memory.bandwidth_gb_s * memory.efficiency;
        let clock = config.rasterizer.clock_ghz;
        Self {
            port: config.rasterizer.port_bytes_per_cycle,
            memory: (whole - others_gb_s).max(whole / 2.0) / clock,
            latency: (memory.latency_ns * clock).ceil() as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_of_a_tile_are_one_task() {
        let draw = |mode, tiles: &[[u32; 2]]| DrawWork {
            mode,
            tiles: tiles.iter().map(|&at| TileWork::open(at, 5)).collect(),
            ..DrawWork::default()
        };
        let frame = FrameWork {
            size: [64, 16],
            draws: vec![draw(Mode::Triangle, &[[0, 0], [1, 0]]), draw(Mode::Gaussian, &[[2, 0], [1, 0]])],
            ..FrameWork::default()
        };
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let tasks = tasks(&frame, &Division::of(&config.rasterizer));
        let modes: Vec<Vec<_>> = tasks.iter().map(|task| task.parts.iter().map(|part| part.mode).collect()).collect();
        let (t, g) = (Mode::Triangle, Mode::Gaussian);
        assert_eq!(modes, [vec![t], vec![t, g], vec![g]]);
    }

    #[test]
    fn others_take_at_most_half_of_main_memory() {
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let alone = Rates::new(&config, 0.0).memory;
        assert!((alone - 68.3 * 0.9).abs() < 1e-9);
        assert!((Rates::new(&config, 1e3).memory - alone / 2.0).abs() < 1e-9);
        assert!((Rates::new(&config, 10.0).memory - (alone - 10.0)).abs() < 1e-9);
    }

    /// Pairs of a pixel and a primitive that are evaluated.
    fn evaluations(tasks: &[Task]) -> u64 {
        let parts = tasks.iter().flat_map(|task| &task.parts);
        let segments = parts.flat_map(|part| &part.segments);
        segments.map(|segment| segment.groups * 16).sum()
    }

    #[test]
    fn hidden_primitives_cost_what_the_hardware_cannot_skip() {
        let tile = TileWork {
            listed: 10,
            runs: vec![crate::work::Run {
                primitives: 10,
                rows: 16,
                blocks: 16,
                reached: 40,
                hidden: 4,
                hidden_blocks: 24,
                waits: None,
            }],
            ..TileWork::default()
        };
        let frame = FrameWork {
            draws: vec![DrawWork { mode: Mode::Triangle, tiles: vec![tile], ..DrawWork::default() }],
            ..FrameWork::default()
        };
        let with = |traversal: &str, hierarchical: bool| {
            let settings = [format!("triangle_traversal={traversal}"), format!("hierarchical_depth={hierarchical}")];
            let config = Config::preset("paper-15x16", &settings).unwrap();
            evaluations(&tasks(&frame, &Division::of(&config.rasterizer))) / 16
        };
        assert_eq!([with("reached", false), with("reached", true)], [64, 40]);
        assert_eq!([with("tile", false), with("tile", true)], [160, 96]);
    }

    #[test]
    fn other_tile_sizes_keep_the_pixels_and_change_the_lists() {
        let draw = DrawWork {
            sized_pairs: [3200, 1600, 800, 400],
            tiles: (0..16).map(|k| TileWork::open([k % 4, k / 4], 100)).collect(),
            ..DrawWork::default()
        };
        let frame = FrameWork { draws: vec![draw], ..FrameWork::default() };
        for (side, tiles, listed) in [(8u32, 64, 50), (16, 16, 100), (32, 4, 200), (64, 1, 400)] {
            let setting = format!("tile_side={side}");
            let config = Config::preset("paper-15x16", &[setting]).unwrap();
            let tasks = tasks(&frame, &Division::of(&config.rasterizer));
            assert_eq!(tasks.len(), tiles, "{side}");
            assert!(tasks.iter().all(|task| task.parts[0].needed == listed));
            let pixels = u64::from(side * side);
            let all = tiles as u64 * u64::from(listed) * pixels;
            assert_eq!(evaluations(&tasks), all, "{side}");
        }
    }
}
