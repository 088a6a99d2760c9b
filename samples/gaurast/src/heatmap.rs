//! A picture of the work in each tile: the Gaussians that contribute to a pixel, or the cycles of a rasterizer module.
//!
//! The numbers come from the device's trace of work, which has them by tile, so a tile has one colour.
//! The time that this processor needs for a tile is not shown: it changes from run to run. The modelled hardware's
//! cycles are the same each time.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use gaurast_picture::{OutputError, Picture};
use gaurast_scene::Camera;
use thiserror::Error;
use timing::config::{Config, ConfigError, DEFAULT_PRESET};
use timing::fast;
use timing::work::{FrameWork, TILE_SIDE, Trace};

/// The quantity that is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Quantity {
    /// The number of Gaussians that contribute to a pixel, as the mean of each tile
    #[default]
    Gaussians,
    /// The cycles that each tile spends in a rasterizer module of the paper's hardware, by the timing model
    Cycles,
}

impl Quantity {
    /// The unit of the numbers.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Gaussians => "Gaussians a pixel",
            Self::Cycles => "cycles a tile",
        }
    }

    /// The name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gaussians => "gaussians",
            Self::Cycles => "cycles",
        }
    }
}

/// A failure to make the picture of the work. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum HeatmapError {
    #[error("{}: the device left no trace of its work, which --heatmap is made of", path.display())]
    NoWork { path: PathBuf },
    #[error("{}: it is there already: --force replaces it", path.display())]
    There { path: PathBuf },
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Writes the picture of a `quantity` of the last frame in the device's `work`; returns the greatest value of a tile.
///
/// # Errors
/// See [`HeatmapError`].
pub fn write(path: &Path, quantity: Quantity, work: &Trace, camera: &Camera, force: bool) -> Result<f64, HeatmapError> {
    if path.is_file() && !force {
        return Err(HeatmapError::There { path: path.to_owned() });
    }
    let frame = work.frames.last().ok_or_else(|| HeatmapError::NoWork { path: path.to_owned() })?;
    let size = [camera.width, camera.height];
    let (picture, greatest) = match quantity {
        Quantity::Gaussians => picture(size, true, contributions(frame)),
        Quantity::Cycles => picture(size, false, cycles(frame)?),
    };
    gaurast_picture::write(path, &picture, None)?;
    Ok(greatest)
}

/// The pairs of a pixel and a Gaussian that changed it, by tile (column and row).
fn contributions(frame: &FrameWork) -> Vec<([u32; 2], f64)> {
    let tiles = frame.draws.iter().flat_map(|draw| &draw.tiles);
    tiles.map(|tile| (tile.at, tile.contributions as f64)).collect()
}

/// The cycles that each tile spends in a module of the default hardware, by the timing model.
fn cycles(frame: &FrameWork) -> Result<Vec<([u32; 2], f64)>, ConfigError> {
    let config = Config::preset(DEFAULT_PRESET, &[])?;
    let (_, spans) = fast::rasterize_tiles(frame, &config, 0.0);
    Ok(spans.iter().map(|span| (span.at, span.end - span.begin)).collect())
}

/// The picture of values by tile (column and row), and the greatest value. With `per_pixel` a tile's sum is divided by
/// its pixels.
fn picture(
    [width, height]: [u32; 2],
    per_pixel: bool,
    tiles: impl IntoIterator<Item = ([u32; 2], f64)>,
) -> (Picture, f64) {
    let columns = width.div_ceil(TILE_SIDE);
    let mut sums = vec![0.0; (columns * height.div_ceil(TILE_SIDE)) as usize];
    for ([column, row], value) in tiles {
        if let Some(sum) = sums.get_mut((row * columns + column) as usize) {
            *sum += value;
        }
    }
    let value = |index: usize| {
        let (column, row) = (index as u32 % columns, index as u32 / columns);
        let across = TILE_SIDE.min(width - column * TILE_SIDE);
        let down = TILE_SIDE.min(height - row * TILE_SIDE);
        let pixels = if per_pixel { across * down } else { 1 };
        sums[index] / f64::from(pixels)
    };
    let values: Vec<f64> = (0..sums.len()).map(value).collect();
    let greatest = values.iter().copied().fold(0.0, f64::max);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let picture = Picture {
        width,
        height,
        pixels: pixels
            .map(|(x, y)| {
                let index = (y / TILE_SIDE * columns + x / TILE_SIDE) as usize;
                let [r, g, b] = heat((values[index] / greatest.max(f64::MIN_POSITIVE)) as f32);
                [r, g, b, 1.0]
            })
            .collect(),
    };
    (picture, greatest)
}

/// The colour of a value from 0 to 1: black, blue, red, yellow, white, with increasing brightness.
pub fn heat(part: f32) -> [f32; 3] {
    const COLORS: [[f32; 3]; 5] =
        [[0.0, 0.0, 0.0], [0.15, 0.1, 0.6], [0.85, 0.2, 0.25], [1.0, 0.8, 0.2], [1.0, 1.0, 1.0]];
    let at = part.clamp(0.0, 1.0) * (COLORS.len() - 1) as f32;
    let below = (at as usize).min(COLORS.len() - 2);
    let share = at - below as f32;
    std::array::from_fn(|c| COLORS[below][c] * (1.0 - share) + COLORS[below + 1][c] * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::work::{DrawWork, Mode, Run, TileWork};

    #[test]
    fn tiles_are_as_bright_as_they_are_full() {
        // Two tiles of 16x16 and two of 4x16: 256 and 64 pixels.
        let tiles = [([0, 0], 512.0), ([1, 1], 640.0)];
        let [(means, ten), (sums, all)] = [true, false].map(|per_pixel| picture([20, 32], per_pixel, tiles));
        assert_eq!([ten, all], [10.0, 640.0]);
        for (picture, share) in [(means, 0.2), (sums, 0.8)] {
            assert_eq!(picture.pixels[20 * 31 + 19], [1.0; 4]);
            assert_eq!(picture.pixels[19], [0.0, 0.0, 0.0, 1.0]);
            let [r, g, b] = heat(share);
            assert_eq!(picture.pixels[0], [r, g, b, 1.0]);
        }
    }

    /// A tile's cycles are those that it costs by the paper's numbers: 16 PEs take 16 pixels a cycle.
    #[test]
    fn cycles_grow_with_the_list_of_a_tile() {
        let tile = |column: u32, primitives: u32| TileWork {
            at: [column, 0],
            listed: primitives,
            runs: vec![Run { primitives, rows: 16, blocks: 16, reached: 16 * primitives, ..Run::default() }],
            ..TileWork::default()
        };
        let draw = DrawWork { tiles: vec![tile(0, 1000), tile(1, 3000)], ..DrawWork::default() };
        let frame = FrameWork { size: [48, 16], draws: vec![draw], ..FrameWork::default() };
        let tiles = cycles(&frame).expect("the default hardware");
        let of = |column: u32| {
            let found = tiles.iter().find(|(at, _)| *at == [column, 0]);
            found.map_or(0.0, |(_, cycles)| *cycles)
        };
        let rasterizer = Config::preset(DEFAULT_PRESET, &[]).expect("the default hardware").rasterizer;
        let busy = rasterizer.busy_cycles(Mode::Gaussian, 16) as f64;
        assert!(of(0) >= 1000.0 * busy && of(1) >= 3000.0 * busy, "{tiles:?}");
        assert!((of(1) - of(0)) < 2100.0 * busy, "{tiles:?}");
        assert_eq!(of(2), 0.0);
    }

    #[test]
    fn more_is_brighter() {
        let brightness = |part: f32| heat(part).iter().sum::<f32>();
        let steps: Vec<f32> = (0..=20_u8).map(|i| brightness(f32::from(i) / 20.0)).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
    }
}
