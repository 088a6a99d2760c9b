//! A generated scene for sweeps: round Gaussians in front of each other, composited by the definition, so that lists
//! end and blocks finish as in real pictures. It needs no device, and is the same on every machine.

use timing::stages::{self, GaussianCounts};
use timing::work::{DrawWork, FrameWork, Run, TILE_GROUPS, TILE_SIDE, TILE_SIDES, TileWork};

/// The number of Gaussians after which finished pixels are looked for, as in the device.
const CHUNK: usize = 32;
/// The least alpha that contributes, the greatest alpha, the least transmittance.
const THRESHOLDS: [f64; 3] = [1.0 / 255.0, 0.99, 1e-4];

/// A Gaussian on the screen.
#[derive(Clone, Copy, Debug)]
struct Round {
    mean: [f64; 2],
    /// 1 / (2 sigma^2).
    falloff: f64,
    opacity: f64,
    /// The radius at which alpha falls below its floor.
    reach: f64,
    sigma: f64,
}

/// A generator of random numbers (a 64-bit linear congruential generator, upper bits).
struct Chance(u64);

impl Chance {
    /// A number from 0 to below 1.
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A nearly normally distributed number: the sum of twelve.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.number()).sum::<f64>() - 6.0
    }
}

/// A frame of `count` Gaussians over a picture, denser in its middle, in the order of their generation, which is depth
/// order.
pub fn gaussians(size: [u32; 2], count: usize, seed: u64) -> FrameWork {
    let mut chance = Chance(seed);
    let [width, height] = size.map(f64::from);
    let all: Vec<_> = (0..count)
        .map(|_| {
            let opacity = 0.02 + 0.97 * chance.number().powi(2);
            let sigma = (1.1 + 0.8 * chance.normal()).exp().clamp(0.55, 60.0);
            let dense = chance.number() < 0.6;
            let mean = if dense {
                [width * (0.5 + 0.16 * chance.normal()), height * (0.55 + 0.16 * chance.normal())]
            } else {
                [width * chance.number(), height * chance.number()]
            };
            Round {
                mean,
                falloff: 0.5 / (sigma * sigma),
                opacity,
                reach: sigma * (2.0 * (opacity / THRESHOLDS[0]).ln()).max(0.0).sqrt(),
                sigma,
            }
        })
        .collect();
    let [columns, rows] = size.map(|side| side.div_ceil(TILE_SIDE));
    let tiles: Vec<_> = (0..columns * rows)
        .map(|number| tile(&all, [number % columns, number / columns]))
        .filter(|tile| tile.listed > 0)
        .collect();
    let pairs = tiles.iter().map(|tile| u64::from(tile.listed)).sum();
    let counts = GaussianCounts {
        read: count as u64,
        projected: count as u64,
        drawn: count as u64,
        shaded: 0,
        degree: 3,
        pairs,
        tiles: u64::from(columns * rows),
    };
    let [preprocess, sort] = stages::gaussian(&counts);
    let boxes = |side: u32, reach: fn(&Round) -> f64| {
        all.iter().map(|g| boxed(g, reach(g), f64::from(side), [width, height])).sum()
    };
    let draw = DrawWork {
        primitives: count as u64,
        drawn: count as u64,
        boxed_pairs: boxes(TILE_SIDE, |g| (3.0 * g.sigma).ceil()),
        sized_pairs: TILE_SIDES.map(|side| boxes(side, |g| g.reach)),
        preprocess,
        sort,
        tiles,
        ..DrawWork::default()
    };
    FrameWork { size, draws: vec![draw], ..FrameWork::default() }
}

/// The number of tiles, `side` pixels wide, that the square around a Gaussian touches.
fn boxed(g: &Round, reach: f64, side: f64, size: [f64; 2]) -> u64 {
    let along = |axis: usize| {
        let low = (g.mean[axis] - reach).max(0.0);
        let high = (g.mean[axis] + reach).min(size[axis]);
        if low < high { ((high / side).ceil() - (low / side).floor()) as u64 } else { 0 }
    };
    along(0) * along(1)
}

/// True if a Gaussian reaches the pixel centres of a square of `side` pixels.
fn reaches(g: &Round, corner: [f64; 2], side: f64) -> bool {
    let square: f64 = [0, 1]
        .map(|axis| {
            let low = corner[axis] + 0.5;
            let nearest = g.mean[axis].clamp(low, low + side - 1.0);
            (g.mean[axis] - nearest).powi(2)
        })
        .iter()
        .sum();
    square < g.reach * g.reach
}

/// The work in a tile.
fn tile(all: &[Round], at: [u32; 2]) -> TileWork {
    const BLOCKS: usize = TILE_GROUPS as usize;
    let corner = at.map(|at| f64::from(at * TILE_SIDE));
    let list: Vec<_> = all.iter().filter(|g| reaches(g, corner, f64::from(TILE_SIDE))).collect();
    // Transmittance of each block's pixels; negative if a pixel is finished.
    let mut transmittance = [[1.0f64; 16]; BLOCKS];
    let mut work = TileWork { at, listed: list.len() as u32, ..TileWork::default() };
    for chunk in list.chunks(CHUNK) {
        let open: Vec<_> = (0..BLOCKS).filter(|&block| transmittance[block].iter().any(|&t| t > 0.0)).collect();
        if open.is_empty() {
            break;
        }
        let open_row = |row: &usize| {
            (0..4).any(|column| (0..4).any(|x| transmittance[row / 4 * 4 + column][row % 4 * 4 + x] > 0.0))
        };
        let rows = (0..16).filter(open_row).count() as u8;
        let mut reached = 0;
        for g in chunk {
            for &block in &open {
                let place = [corner[0] + (block % 4 * 4) as f64, corner[1] + (block / 4 * 4) as f64];
                if reaches(g, place, 4.0) {
                    reached += 1;
                    work.contributions += blend(g, place, &mut transmittance[block]);
                }
            }
        }
        work.runs.push(Run {
            primitives: chunk.len() as u32,
            rows,
            blocks: open.len() as u8,
            reached,
            ..Run::default()
        });
    }
    let finished = transmittance.iter().flatten().filter(|&&t| t < 0.0);
    work.terminated = finished.count() as u32;
    work
}

/// Blends a Gaussian into a block. Returns the number of pixels to which it contributed.
fn blend(g: &Round, place: [f64; 2], block: &mut [f64; 16]) -> u64 {
    let [floor, ceiling, least] = THRESHOLDS;
    let mut contributions = 0;
    for (index, t) in block.iter_mut().enumerate().filter(|(_, t)| **t > 0.0) {
        let dx = place[0] + (index % 4) as f64 + 0.5 - g.mean[0];
        let dy = place[1] + (index / 4) as f64 + 0.5 - g.mean[1];
        let alpha = (g.opacity * (-g.falloff * (dx * dx + dy * dy)).exp()).min(ceiling);
        if alpha < floor {
            continue;
        }
        let rest = *t * (1.0 - alpha);
        if rest < least {
            *t = -*t;
        } else {
            *t = rest;
            contributions += 1;
        }
    }
    contributions
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::work::Saturation;

    #[test]
    fn a_generated_scene_has_what_a_picture_has() {
        let frame = gaussians([160, 96], 3000, 1);
        let draw = &frame.draws[0];
        assert_eq!(draw.tiles.len(), 60);
        assert!(draw.sized_pairs.is_sorted_by(|a, b| a > b));
        // Exact tests find fewer pairs than boxes do.
        assert!(draw.pairs() < draw.sized_pairs[1]);
        assert!(draw.needed_pairs() < draw.pairs());
        let evaluations = Saturation::ALL.map(|saturation| draw.evaluations(saturation, false));
        assert!(evaluations.is_sorted_by(|a, b| a > b), "{evaluations:?}");
        let contributions: u64 = draw.tiles.iter().map(|tile| tile.contributions).sum();
        assert!(contributions > 0 && contributions < evaluations[4]);
        assert!(draw.tiles.iter().any(|tile| tile.terminated > 128));
        assert_eq!(frame, gaussians([160, 96], 3000, 1));
    }
}
