//! The gain of skipping work in hardware: the same frame on the same configuration, with each skip of the device added
//! to those before it. The skips are exact tile tests instead of squares; lists that end with their tile, then finished
//! rows and blocks; exact block tests; for triangles the blocks that they cover instead of whole tiles; and
//! hierarchical depth. Each skip is also simulated alone.

use serde::Serialize;
use timing::config::{Config, Lists};
use timing::simulate::{Simulation, simulate};
use timing::work::{FrameWork, Mode, Saturation};

/// A variant of the hardware or of the work that reaches it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WhatIf {
    /// The name of the variant.
    pub name: &'static str,
    /// The configuration of the variant.
    pub config: Config,
    /// The simulation of the variant.
    pub simulation: Simulation,
}

/// The skips of a configuration.
#[derive(Clone, Copy)]
struct Skipping {
    saturation: Saturation,
    traversal: Saturation,
    hierarchical_depth: bool,
}

impl Skipping {
    /// The skip of finished pixels of Gaussian lists, and no other.
    fn of(saturation: Saturation) -> Self {
        Self { saturation, traversal: Saturation::Tile, hierarchical_depth: false }
    }

    /// Simulates a frame on a configuration with these skips.
    fn simulate(self, name: &'static str, frame: &FrameWork, config: &Config) -> WhatIf {
        let mut config = config.clone();
        // The frame already has the variant's lists.
        config.rasterizer.lists = Lists::Exact;
        config.rasterizer.saturation = self.saturation;
        config.rasterizer.triangle_traversal = self.traversal;
        config.rasterizer.hierarchical_depth = self.hierarchical_depth;
        WhatIf { name, simulation: simulate(frame, &config), config }
    }
}

/// The kinds of work in a frame that can be skipped.
struct Kinds {
    gaussians: bool,
    triangles: bool,
    hidden: bool,
}

impl Kinds {
    fn of(frame: &FrameWork) -> Self {
        let has = |mode| frame.draws.iter().any(|draw| draw.mode == mode);
        let mut tiles = frame.draws.iter().flat_map(|draw| &draw.tiles);
        Self {
            gaussians: has(Mode::Gaussian),
            triangles: has(Mode::Triangle),
            hidden: tiles.any(|tile| tile.hidden() > 0 || tile.hidden_blocks() > 0),
        }
    }
}

/// The variants, the least skipping first.
pub fn what_ifs(frame: &FrameWork, config: &Config) -> Vec<WhatIf> {
    let with = |name, frame: &FrameWork, saturation| Skipping::of(saturation).simulate(name, frame, config);
    let kinds = Kinds::of(frame);
    let mut variants = Vec::new();
    if kinds.gaussians {
        let boxed = frame.with_squares();
        variants.extend([
            with("3-sigma squares, no saturation (estimated)", &boxed, Saturation::None),
            with("3-sigma squares, tiles saturate (estimated)", &boxed, Saturation::Tile),
            with("exact tile tests, no saturation", frame, Saturation::None),
            with("exact tile tests, tiles saturate", frame, Saturation::Tile),
            with("exact tile tests, rows saturate", frame, Saturation::Row),
            with("exact tile tests, blocks saturate", frame, Saturation::Block),
        ]);
    }
    // With Gaussians, this is the variant of triangles in whole tiles, too.
    let blocks =
        if kinds.gaussians { "exact tile and block tests, blocks saturate" } else { "triangles in whole tiles" };
    if kinds.gaussians || kinds.triangles {
        variants.push(with(blocks, frame, Saturation::Reached));
    }
    let reached = Skipping { traversal: Saturation::Reached, ..Skipping::of(Saturation::Reached) };
    if kinds.triangles {
        let name = "triangles in the blocks they cover";
        variants.push(reached.simulate(name, frame, config));
    }
    if kinds.hidden {
        let depth = Skipping { hierarchical_depth: true, ..reached };
        let name = "all of these, and hierarchical depth";
        variants.push(depth.simulate(name, frame, config));
    }
    variants
}

/// Each skip alone, on a machine without the others. That machine uses the lists of 3-sigma squares, ends the lists of
/// finished tiles, evaluates whole tiles, and has no hierarchical depth: it is the first variant of [`what_ifs`].
pub fn each_alone(frame: &FrameWork, config: &Config) -> Vec<WhatIf> {
    let kinds = Kinds::of(frame);
    let (squares, plain) = (frame.with_squares(), Skipping::of(Saturation::Tile));
    let mut variants = vec![plain.simulate("none of them (estimated)", &squares, config)];
    let mut alone = |name, frame: &FrameWork, skipping: Skipping| {
        variants.push(skipping.simulate(name, frame, config));
    };
    if kinds.gaussians {
        alone("exact tile tests", frame, plain);
        let blocks = Skipping::of(Saturation::Block);
        alone("blocks saturate (estimated)", &squares, blocks);
        let tests = Skipping::of(Saturation::Reached);
        alone("exact block tests, blocks saturate (estimated)", &squares, tests);
    }
    if kinds.triangles {
        let covered = Skipping { traversal: Saturation::Reached, ..plain };
        alone("triangles in the blocks they cover (estimated)", &squares, covered);
    }
    if kinds.hidden {
        let depth = Skipping { hierarchical_depth: true, ..plain };
        alone("hierarchical depth (estimated)", &squares, depth);
    }
    variants
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::simulate::even_frame;
    use timing::work::Run;

    #[test]
    fn each_skip_saves_cycles() {
        let mut frame = even_frame([640, 480], 800_000, 0.2);
        let draw = &mut frame.draws[0];
        draw.boxed_pairs = 2 * draw.pairs();
        for tile in &mut draw.tiles {
            let n = tile.listed;
            let run = |primitives, rows, blocks| Run {
                primitives,
                rows,
                blocks,
                reached: primitives * u32::from(blocks) / 2,
                ..Run::default()
            };
            tile.runs = vec![run(n / 4, 16, 16), run(n / 4, 13, 9), run(n / 4, 8, 7)];
        }
        let config = Config::preset("single-module", &[]).unwrap();
        let cycles: Vec<_> = what_ifs(&frame, &config).iter().map(|what_if| what_if.simulation.raster.cycles).collect();
        assert!(cycles[0] > 1.9 * cycles[2]);
        assert!(cycles[2..].is_sorted_by(|a, b| a > b), "{cycles:?}");
    }

    #[test]
    fn each_skip_alone_is_less_than_all_together() {
        let mut frame = even_frame([320, 160], 60_000, 0.2);
        let mut triangles = frame.draws[0].clone();
        triangles.mode = Mode::Triangle;
        for tile in &mut triangles.tiles {
            tile.runs[0].reached /= 2;
        }
        let draw = &mut frame.draws[0];
        draw.boxed_pairs = 2 * draw.pairs();
        for tile in &mut draw.tiles {
            let run = &mut tile.runs[0];
            (run.hidden, run.reached) = (run.primitives / 3, run.reached / 3);
            (run.blocks, tile.hidden_rest) = (12, run.hidden / 2);
        }
        frame.draws.insert(0, triangles);
        let config = Config::preset("single-module", &[]).unwrap();
        let cycles = |variants: Vec<WhatIf>| -> Vec<f64> {
            let cycles = |variant: &WhatIf| variant.simulation.raster.cycles;
            variants.iter().map(cycles).collect()
        };
        let alone = cycles(each_alone(&frame, &config));
        let together = cycles(what_ifs(&frame, &config));
        assert_eq!((alone.len(), together.len()), (6, 9));
        // The second of the cumulative variants has only the first skip, and so equals the first skip alone.
        assert_eq!(alone[0], together[1]);
        let last = together[together.len() - 1];
        assert!(alone[1..].iter().all(|&cycles| last < cycles && cycles < alone[0]));
    }

    #[test]
    fn triangles_have_skips_of_their_own() {
        let mut frame = even_frame([320, 160], 60_000, 0.2);
        frame.draws[0].mode = Mode::Triangle;
        for tile in &mut frame.draws[0].tiles {
            tile.runs[0].reached /= 2;
            tile.runs[0].hidden = tile.listed / 3;
            tile.runs[0].hidden_blocks = 8 * (tile.listed / 3);
        }
        let config = Config::preset("single-module", &[]).unwrap();
        let variants = what_ifs(&frame, &config);
        assert_eq!(variants.len(), 3);
        let spent = |what_if: &WhatIf| {
            let simulation = &what_if.simulation;
            [simulation.raster.cycles, simulation.energy.modules()]
        };
        for pair in variants.windows(2) {
            let (more, less) = (spent(&pair[0]), spent(&pair[1]));
            assert!(less[0] < more[0] && less[1] < more[1], "{}", pair[1].name);
        }
    }
}
