//! A picture of the number of Gaussians that contribute to each pixel.
//!
//! The numbers come from the device's trace of work (`GAURAST_TRACE`). The trace has one number per tile, so a tile has
//! one colour, that of its pixels' mean.

use std::path::{Path, PathBuf};

use gaurast_picture::{OutputError, Picture};
use gaurast_scene::Camera;
use tempfile::TempDir;
use thiserror::Error;
use timing::work::{TILE_SIDE, Trace};

/// The variable that makes the device write a trace.
const TRACE: &str = "GAURAST_TRACE";

/// A failure to make the picture of the counts. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum HeatmapError {
    #[error("{}: {source}", path.display())]
    Trace {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{}: the device left no trace of its work, which --heatmap is made of", path.display())]
    NoTrace { path: PathBuf },
    #[error("{}: it is there already: --force replaces it", path.display())]
    There { path: PathBuf },
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Makes devices write their traces to a file from now on, unless the environment requests a trace already. The
/// returned folder, if there is one, must exist until the trace is read.
pub fn trace_from_now_on() -> std::io::Result<Option<TempDir>> {
    if std::env::var_os(TRACE).is_some_and(|file| !file.is_empty()) {
        return Ok(None);
    }
    let folder = tempfile::tempdir()?;
    // SAFETY: this is called before another thread is started.
    unsafe { std::env::set_var(TRACE, folder.path().join("work.json")) };
    Ok(Some(folder))
}

/// Writes the picture of the last frame that the device drew, after the device is destroyed; returns the greatest
/// count.
///
/// # Errors
/// See [`HeatmapError`].
pub fn write(path: &Path, camera: &Camera, force: bool) -> Result<f64, HeatmapError> {
    if path.is_file() && !force {
        return Err(HeatmapError::There {
            path: path.to_owned(),
        });
    }
    let file = PathBuf::from(std::env::var_os(TRACE).unwrap_or_default());
    let failed = |source| HeatmapError::Trace {
        path: file.clone(),
        source,
    };
    let text = std::fs::read_to_string(&file).map_err(failed)?;
    let trace: Trace = serde_json::from_str(&text).map_err(|error| failed(error.into()))?;
    let frame = trace
        .frames
        .last()
        .ok_or_else(|| HeatmapError::NoTrace { path: file.clone() })?;
    let tiles = frame.draws.iter().flat_map(|draw| &draw.tiles);
    let counts = tiles.map(|tile| (tile.at, tile.contributions));
    let (picture, greatest) = picture([camera.width, camera.height], counts);
    gaurast_picture::write(path, &picture, None)?;
    Ok(greatest)
}

/// The picture of the contributions by tile (column and row), and the greatest mean.
fn picture(
    [width, height]: [u32; 2],
    tiles: impl Iterator<Item = ([u32; 2], u64)>,
) -> (Picture, f64) {
    let columns = width.div_ceil(TILE_SIDE);
    let mut counts = vec![0; (columns * height.div_ceil(TILE_SIDE)) as usize];
    for ([column, row], contributions) in tiles {
        if let Some(count) = counts.get_mut((row * columns + column) as usize) {
            *count += contributions;
        }
    }
    let mean = |index: usize| {
        let (column, row) = (index as u32 % columns, index as u32 / columns);
        let across = TILE_SIDE.min(width - column * TILE_SIDE);
        let down = TILE_SIDE.min(height - row * TILE_SIDE);
        counts[index] as f64 / f64::from(across * down)
    };
    let means: Vec<f64> = (0..counts.len()).map(mean).collect();
    let greatest = means.iter().copied().fold(0.0, f64::max);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let picture = Picture {
        width,
        height,
        pixels: pixels
            .map(|(x, y)| {
                let index = (y / TILE_SIDE * columns + x / TILE_SIDE) as usize;
                let [r, g, b] = heat((means[index] / greatest.max(f64::MIN_POSITIVE)) as f32);
                [r, g, b, 1.0]
            })
            .collect(),
    };
    (picture, greatest)
}

/// The colour of a value from 0 to 1: black, blue, red, yellow, white, with increasing brightness.
pub fn heat(part: f32) -> [f32; 3] {
    const COLORS: [[f32; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [0.15, 0.1, 0.6],
        [0.85, 0.2, 0.25],
        [1.0, 0.8, 0.2],
        [1.0, 1.0, 1.0],
    ];
    let at = part.clamp(0.0, 1.0) * (COLORS.len() - 1) as f32;
    let below = (at as usize).min(COLORS.len() - 2);
    let share = at - below as f32;
    std::array::from_fn(|c| COLORS[below][c] * (1.0 - share) + COLORS[below + 1][c] * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_as_bright_as_they_are_full() {
        // Two tiles of 16x16 and two of 4x16: 256 and 64 pixels.
        let tiles = [([0, 0], 512), ([1, 1], 640)];
        let (picture, greatest) = picture([20, 32], tiles.into_iter());
        assert_eq!(greatest, 10.0);
        assert_eq!(picture.pixels[20 * 31 + 19], [1.0; 4]);
        assert_eq!(picture.pixels[19], [0.0, 0.0, 0.0, 1.0]);
        let [r, g, b] = heat(0.2);
        assert_eq!(picture.pixels[0], [r, g, b, 1.0]);
    }

    #[test]
    fn more_is_brighter() {
        let brightness = |part: f32| heat(part).iter().sum::<f32>();
        let steps: Vec<f32> = (0..=20_u8)
            .map(|i| brightness(f32::from(i) / 20.0))
            .collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
    }
}
