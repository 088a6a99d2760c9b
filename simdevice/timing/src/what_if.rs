//! What skipping would bring as hardware: the same frame on the same machine, with each skip of the device added to
//! those before it: exact tile tests instead of squares, lists that end with their tile, then finished rows and blocks,
//! exact block tests; for triangles the blocks that they cover instead of whole tiles; and hierarchical depth.

use crate::config::Config;
use crate::simulate::{Simulation, simulate};
use crate::work::{FrameWork, Mode, Saturation};
use serde::Serialize;

/// A variant of the hardware or of the work that reaches it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WhatIf {
    /// What is different.
    pub name: &'static str,
    /// What comes of it.
    pub simulation: Simulation,
}

/// The variants, the least skipping first.
pub fn what_ifs(frame: &FrameWork, config: &Config) -> Vec<WhatIf> {
    let variant = |name, frame: &FrameWork, granularity: [Saturation; 2], hierarchical_depth| {
        let [saturation, traversal] = granularity;
        let mut config = config.clone();
        config.rasterizer.saturation = saturation;
        config.rasterizer.triangle_traversal = traversal;
        config.rasterizer.hierarchical_depth = hierarchical_depth;
        WhatIf {
            name,
            simulation: simulate(frame, &config),
        }
    };
    let has = |mode| frame.draws.iter().any(|draw| draw.mode == mode);
    let with = |name, frame: &FrameWork, saturation| {
        variant(name, frame, [saturation, Saturation::Tile], false)
    };
    let boxed = boxed(frame);
    let gaussians = [
        with(
            "3-sigma squares, no saturation (estimated)",
            &boxed,
            Saturation::None,
        ),
        with(
            "3-sigma squares, tiles saturate (estimated)",
            &boxed,
            Saturation::Tile,
        ),
        with("exact tile tests, no saturation", frame, Saturation::None),
        with("exact tile tests, tiles saturate", frame, Saturation::Tile),
        with("exact tile tests, rows saturate", frame, Saturation::Row),
        with(
            "exact tile tests, blocks saturate",
            frame,
            Saturation::Block,
        ),
        with(
            "exact tile and block tests, blocks saturate",
            frame,
            Saturation::Reached,
        ),
    ];
    let reached = [Saturation::Reached; 2];
    let triangles = [
        with("triangles in whole tiles", frame, Saturation::Reached),
        variant("triangles in the blocks they cover", frame, reached, false),
    ];
    let tiles = || frame.draws.iter().flat_map(|draw| &draw.tiles);
    let depth = [variant(
        "all of these, and hierarchical depth",
        frame,
        reached,
        true,
    )];
    let gaussians = gaussians.into_iter().filter(|_| has(Mode::Gaussian));
    // With Gaussians the variant before is that of whole tiles.
    let triangles = triangles.into_iter().skip(usize::from(has(Mode::Gaussian)));
    let triangles = triangles.filter(|_| has(Mode::Triangle));
    let hidden = tiles().any(|tile| tile.hidden() > 0 || tile.hidden_blocks() > 0);
    let depth = depth.into_iter().filter(|_| hidden);
    gaussians.chain(triangles).chain(depth).collect()
}

/// The frame with as many pairs as 3-sigma squares give. Which tiles they are in is not known: every list is lengthened
/// alike, so what comes of it is an estimate.
fn boxed(frame: &FrameWork) -> FrameWork {
    let mut frame = frame.clone();
    for draw in &mut frame.draws {
        let pairs = draw.pairs();
        if pairs == 0 || draw.boxed_pairs <= pairs {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::even_frame;
    use crate::work::Run;

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
        let cycles: Vec<_> = what_ifs(&frame, &config)
            .iter()
            .map(|what_if| what_if.simulation.raster.cycles)
            .collect();
        assert!(cycles[0] > 1.9 * cycles[2]);
        assert!(cycles[2..].is_sorted_by(|a, b| a > b), "{cycles:?}");
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
