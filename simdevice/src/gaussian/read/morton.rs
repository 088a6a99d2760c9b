//! Morton order: an order of Gaussians in which neighbours are mostly near one another in space.

use super::attributes::{Attributes, Fetcher, GroupVertices};
use crate::gaussian::lanes::GROUP;
use crate::gaussian::sort::radix;
use crate::packet::GaussianAppend;
use devmem::host;
use rayon::prelude::*;

/// The bits of each axis in a Morton code.
const AXIS_BITS: u32 = 10;

/// The numbers of the draw's vertices in Morton order, in which neighbours are mostly near one another in space.
pub(crate) fn morton_order(append: &GaussianAppend) -> Vec<u32> {
    let mut positions: Vec<[f32; 3]> = host::zeroed(append.count as usize);
    positions.par_chunks_mut(GROUP).zip((0..append.count).into_par_iter().step_by(GROUP)).for_each_init(
        || (Fetcher::default(), Attributes::default()),
        |(fetcher, attributes), (positions, start)| {
            let group = GroupVertices::new(append, append.first_instance, start, positions.len());
            fetcher.read_positions(&append.attributes, &group, &mut attributes.position);
            let [x, y, z] = &attributes.position;
            for (at, position) in positions.iter_mut().enumerate() {
                *position = [x[at], y[at], z[at]];
            }
        },
    );
    let Grid { low, cell } = Grid::new(&positions);
    let cells = 1.0 / cell;
    let code = |&[x, y, z]: &[f32; 3]| {
        let cell = |position: f32, axis: usize| {
            // NaN becomes zero.
            let cell = (f64::from(position) - low[axis]) * cells;
            spread(cell.clamp(0.0, f64::from((1u32 << AXIS_BITS) - 1)) as u32) << axis
        };
        cell(x, 0) | cell(y, 1) | cell(z, 2)
    };
    let mut order: Vec<(u32, u32)> = host::collect(positions.iter().map(code).zip(0..));
    radix::sort_by_key(&mut order);
    host::collect(order.into_iter().map(|(_, number)| number))
}

/// A grid of cubic cells.
struct Grid {
    /// The lowest corner.
    low: [f64; 3],
    /// The side of a cell.
    cell: f64,
}

impl Grid {
    /// A grid that holds most positions. A few positions far away do not enlarge it much.
    fn new(positions: &[[f32; 3]]) -> Self {
        let finite = || {
            let all = positions.iter();
            all.filter(|position| position.iter().all(|value| value.is_finite()))
        };
        let count = finite().count().max(1) as f64;
        let [mut mean, mut variance] = [[0.0; 3]; 2];
        for position in finite() {
            for axis in 0..3 {
                mean[axis] += f64::from(position[axis]) / count;
            }
        }
        for position in finite() {
            for axis in 0..3 {
                let distance = f64::from(position[axis]) - mean[axis];
                variance[axis] += distance * distance / count;
            }
        }
        let deviation = variance.into_iter().fold(0.0, f64::max).sqrt();
        let half = (3.0 * deviation).clamp(f64::MIN_POSITIVE * 1e9, f64::MAX / 4.0);
        Self { low: mean.map(|mean| mean - half), cell: 2.0 * half / f64::from(1u32 << AXIS_BITS) }
    }
}

/// Puts two zeros after each of the [`AXIS_BITS`] bits of a number.
fn spread(value: u32) -> u32 {
    let value = (value | value << 16) & 0x030_000FF;
    let value = (value | value << 8) & 0x0300_F00F;
    let value = (value | value << 4) & 0x030C_30C3;
    (value | value << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn bits_are_spread() {
        for value in 0..1 << AXIS_BITS {
            let expected: u32 = (0..AXIS_BITS).map(|bit| (value >> bit & 1) << (3 * bit)).sum();
            assert_eq!(spread(value), expected, "{value:#b}");
        }
    }

    #[gaurast_runner::test]
    fn a_few_far_off_do_not_spoil_the_grid() {
        let mut positions = vec![[0.0, 0.0, 0.0]; 500];
        positions.extend(vec![[1.0, 0.0, 0.0]; 500]);
        positions.push([f32::NAN, 0.0, 0.0]);
        positions.push([5.0, 0.0, f32::INFINITY]);
        let Grid { low, cell } = Grid::new(&positions);
        assert!((low[0] - (0.5 - 1.5)).abs() < 1e-9, "{low:?}");
        assert!((cell - 3.0 / 1024.0).abs() < 1e-9, "{cell}");
    }
}
