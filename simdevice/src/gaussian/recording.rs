//! The record of a Gaussian draw's work before its tiles are rendered.

use super::splats::splat::Splat;
use crate::limits::TILE_SIZE;
use crate::state::Rect;
use crate::stats::counters::{Counter, Counters};
use crate::stats::recorder::{shader_work, sized_tiles};
use timing::stages;
use timing::stages::GaussianCounts;
use timing::work::{DrawWork, Mode, TILE_SIDES};

/// The Gaussians of a set that either the device or vertex programs projected: their counters, and the splats that are
/// drawn.
pub(crate) struct Projected<'a> {
    pub(crate) counters: &'a Counters,
    pub(crate) splats: &'a [Vec<Splat>],
}

impl Projected<'_> {
    /// The number of Gaussians that were read.
    fn read(&self) -> u64 {
        self.counters.get(Counter::GaussiansRead)
    }

    /// The number of Gaussians that are finite, bright enough and between the near and far planes.
    fn kept(&self) -> u64 {
        let early = [Counter::SkippedNonFinite, Counter::SkippedFaint, Counter::SkippedNear, Counter::SkippedFar];
        let skipped: u64 = early.iter().map(|&counter| self.counters.get(counter)).sum();
        self.read().saturating_sub(skipped)
    }

    fn drawn(&self) -> u64 {
        self.splats.iter().map(|group| group.len() as u64).sum()
    }
}

/// The work of a Gaussian draw before its tiles are rendered. `fixed` has the Gaussians that the device projected, and
/// `by_program` those of vertex programs, which moved `program_bytes` in addition to the accesses of their
/// instructions.
pub(crate) fn gaussian_draw(
    fixed: &Projected<'_>,
    by_program: &Projected<'_>,
    program_bytes: u64,
    pairs: u64,
    degree: u32,
    bounds: Rect,
) -> DrawWork {
    let tiles = |side: u32| u64::from(side.div_ceil(TILE_SIZE));
    let counts = GaussianCounts {
        read: fixed.read(),
        projected: fixed.kept(),
        drawn: fixed.drawn(),
        shaded: by_program.kept(),
        degree,
        pairs,
        tiles: tiles(bounds.width) * tiles(bounds.height),
    };
    let mut program = shader_work(by_program.counters);
    program.bytes += program_bytes as f64;
    let splats = || fixed.splats.iter().chain(by_program.splats).flatten();
    let [preprocess, sort] = stages::gaussian(&counts);
    DrawWork {
        mode: Mode::Gaussian,
        primitives: fixed.read() + by_program.read(),
        drawn: fixed.drawn() + by_program.drawn(),
        boxed_pairs: splats().map(|splat| boxed_tiles(splat, bounds)).sum(),
        sized_pairs: splats()
            .map(|splat| sized_boxes(splat, bounds))
            .fold([0; TILE_SIDES.len()], |sum, tiles| std::array::from_fn(|index| sum[index] + tiles[index])),
        preprocess: preprocess.plus(&program),
        sort,
        ..DrawWork::default()
    }
}

/// The binary logarithm of 1 / 255.
const LOG2_FLOOR: f64 = -7.994_353_436_858_858;

/// The number of tiles of each size that the bounding box of a Gaussian's ellipse touches, out to an alpha of 1 / 255.
fn sized_boxes(splat: &Splat, bounds: Rect) -> [u64; TILE_SIDES.len()] {
    let [xx, _, yy] = covariance(splat);
    let octaves = f64::from(splat.log2_opacity) - LOG2_FLOOR;
    let reach = (2.0 * std::f64::consts::LN_2 * octaves.max(0.0)).sqrt();
    let [x, y] = splat.mean;
    let (dx, dy) = (reach * xx.sqrt(), reach * yy.sqrt());
    sized_tiles([x - dx, y - dy], [x + dx, y + dy], bounds)
}

/// The covariance of a splat in px^2: xx, xy, yy.
fn covariance(splat: &Splat) -> [f64; 3] {
    let [a, b, c] = splat.factor;
    // The conic is 2 ln 2 times the factor's square, and the covariance is its inverse.
    let scale = 1.0 / (2.0 * std::f64::consts::LN_2 * a * a * c * c);
    [c * c * scale, -b * c * scale, (a * a + b * b) * scale]
}

/// The number of tiles of `bounds` that the square around the circle of three standard deviations touches, rounded up
/// to pixels: the tiles to which the original 3DGS code bins.
fn boxed_tiles(splat: &Splat, bounds: Rect) -> u64 {
    let [xx, xy, yy] = covariance(splat);
    let middle = 0.5 * (xx + yy);
    let spread = (middle * middle - (xx * yy - xy * xy)).max(0.1).sqrt();
    let radius = libm::ceil(3.0 * (middle + spread).sqrt());
    let tiles = |mean: f64, start: i32, length: u32| {
        let size = f64::from(TILE_SIZE);
        let (start, end) = (f64::from(start), f64::from(start) + f64::from(length));
        let (first, last) = (libm::floor(start / size), libm::ceil(end / size));
        let low = libm::floor((mean - radius) / size).clamp(first, last);
        let high = libm::floor((mean + radius + size - 1.0) / size).clamp(first, last);
        (high - low) as u64
    };
    let [x, y] = splat.mean;
    tiles(x, bounds.x, bounds.width) * tiles(y, bounds.y, bounds.height)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Rect = Rect { x: 0, y: 0, width: 160, height: 80 };

    fn splat(mean: [f64; 2], deviation: f64) -> Splat {
        let factor = 1.0 / (deviation * (2.0 * std::f64::consts::LN_2).sqrt());
        Splat { mean, factor: [factor, 0.0, factor], ..Splat::default() }
    }

    #[gaurast_runner::test]
    fn boxes_are_of_three_standard_deviations() {
        assert_eq!(boxed_tiles(&splat([40.0, 40.0], 1.0), BOUNDS), 1);
        assert_eq!(boxed_tiles(&splat([33.0, 40.0], 1.0), BOUNDS), 2);
        // A radius of about 30 pixels gives 5 by 5 tiles, and there are 5 rows of tiles.
        assert_eq!(boxed_tiles(&splat([88.0, 40.0], 10.0), BOUNDS), 25);
        assert_eq!(boxed_tiles(&splat([-500.0, 40.0], 10.0), BOUNDS), 0);
        assert_eq!(boxed_tiles(&splat([80.0, 40.0], 1000.0), BOUNDS), 50);
    }
}
