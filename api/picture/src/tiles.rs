//! Tiles of a picture, and the filters that metrics correlate them with. A tile and all that is computed of it fit into a cache.
//!
//! All of it is inlined into the callers' vectorized code. A function that is not, and a closure without the attribute, is
//! compiled for the least processor.

use std::ops::{Add, Mul, Range, Sub};

/// The width of tiles, a multiple of [`LANES`], and their height, in pixels.
const SIZE: [usize; 2] = [256, 128];

/// The pixels that are filtered together.
const LANES: usize = 16;

/// A rectangle of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    pub(crate) left: usize,
    pub(crate) top: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

/// The tiles of a picture, row by row.
pub(crate) fn tiles(width: usize, height: usize) -> Vec<Tile> {
    let tops = (0..height).step_by(SIZE[1]);
    let of_row = |top: usize| {
        (0..width).step_by(SIZE[0]).map(move |left| Tile {
            left,
            top,
            width: SIZE[0].min(width - left),
            height: SIZE[1].min(height - top),
        })
    };
    tops.flat_map(of_row).collect()
}

impl Tile {
    /// The columns that are computed: those of the tile, rounded up to whole groups.
    pub(crate) fn columns(self) -> usize {
        self.width.next_multiple_of(LANES)
    }

    /// The values of a picture in the tile and `border` pixels around its columns and rows. `value` receives the place of each,
    /// which may lie outside of the picture.
    #[inline(always)]
    pub(crate) fn bordered<T>(self, border: usize, mut value: impl FnMut(isize, isize) -> T) -> Vec<T> {
        let (stride, rows) = (self.columns() + 2 * border, self.height + 2 * border);
        let mut values = Vec::with_capacity(stride * rows);
        for row in 0..rows {
            let y = (self.top + row) as isize - border as isize;
            for column in 0..stride {
                values.push(value((self.left + column) as isize - border as isize, y));
            }
        }
        values
    }

    /// The sum of a plane's values over some of the tile's rows and columns, row by row. The plane has the tile's columns.
    #[inline(always)]
    pub(crate) fn sum<T: Copy + Into<f64>>(self, plane: &[T], rows: Range<usize>, columns: Range<usize>) -> f64 {
        let mut sum = 0.0;
        for row in rows {
            for value in &plane[row * self.columns()..][columns.clone()] {
                sum += (*value).into();
            }
        }
        sum
    }
}

/// The numbers of a filter.
pub(crate) trait Number: Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}

impl Number for f32 {}
impl Number for f64 {}

/// The form of a filter, by which values at equal distances from the middle share a multiplication.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// The weights of both sides are equal.
    Even,
    /// The same, and all weights add up to 0, so that equal values have no sum.
    Balanced,
    /// The weights of the two sides have opposite signs.
    Odd,
}

/// A filter: the weights of the middle and of one side of it.
#[derive(Clone, Debug)]
pub(crate) struct Filter<T> {
    pub(crate) form: Form,
    /// The weight at each distance to the right, or below. That of the middle is the first one.
    pub(crate) weights: Vec<T>,
}

/// The direction of a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Along {
    Rows,
    Columns,
}

impl<T: Number> Filter<T> {
    /// Correlates a plane that has `border` values on both sides of what is computed, along rows or columns.
    #[inline(always)]
    pub(crate) fn correlate(&self, plane: &[T], tile: Tile, border: usize, along: Along) -> Vec<T> {
        let columns = tile.columns();
        let (stride, step, rows) = match along {
            Along::Rows => (columns + 2 * border, 1, tile.height + 2 * border),
            Along::Columns => (columns, columns, tile.height),
        };
        let mut output = vec![T::default(); columns * rows];
        for (row, output) in output.chunks_exact_mut(columns).enumerate() {
            let middle = row * stride + border * step;
            for (group, output) in output.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
                *output = self.correlate_group(plane, middle + group * LANES, step);
            }
        }
        output
    }

    /// Correlates a plane with `border` values around the tile along rows, then along columns.
    #[inline(always)]
    pub(crate) fn correlate_both(&self, plane: &[T], tile: Tile, border: usize) -> Vec<T> {
        let along_rows = self.correlate(plane, tile, border, Along::Rows);
        self.correlate(&along_rows, tile, border, Along::Columns)
    }

    /// Correlates a group of values, of which the first is at `middle`.
    #[inline(always)]
    fn correlate_group(&self, plane: &[T], middle: usize, step: usize) -> [T; LANES] {
        let centre = group(plane, middle);
        let mut sums = [T::default(); LANES];
        if self.form == Form::Even {
            for lane in 0..LANES {
                sums[lane] = self.weights[0] * centre[lane];
            }
        }
        for (distance, &weight) in self.weights.iter().enumerate().skip(1) {
            let (before, after) = (group(plane, middle - distance * step), group(plane, middle + distance * step));
            match self.form {
                Form::Even => {
                    for lane in 0..LANES {
                        sums[lane] = sums[lane] + weight * (before[lane] + after[lane]);
                    }
                }
                Form::Balanced => {
                    for lane in 0..LANES {
                        let both = (before[lane] - centre[lane]) + (after[lane] - centre[lane]);
                        sums[lane] = sums[lane] + weight * both;
                    }
                }
                Form::Odd => {
                    for lane in 0..LANES {
                        sums[lane] = sums[lane] + weight * (after[lane] - before[lane]);
                    }
                }
            }
        }
        sums
    }
}

/// The values of a plane from `at` on.
#[inline(always)]
fn group<T>(plane: &[T], at: usize) -> &[T; LANES] {
    plane[at..].first_chunk().expect("a plane has whole groups")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_each_pixel_once() {
        let (width, height) = (700, 300);
        let mut covered = vec![0; width * height];
        for tile in tiles(width, height) {
            for y in tile.top..tile.top + tile.height {
                for x in tile.left..tile.left + tile.width {
                    covered[y * width + x] += 1;
                }
            }
        }
        assert!(covered.iter().all(|count| *count == 1));
    }

    #[test]
    fn filters_are_the_sums_of_their_weights() {
        let tile = Tile { left: 5, top: 3, width: 21, height: 9 };
        let value = |x: isize, y: isize| ((x * 31 + y * 17 + x * y) % 23) as f64;
        for form in [Form::Even, Form::Balanced, Form::Odd] {
            let mut weights = vec![0.5, 0.25, -0.125, 2.0];
            if form == Form::Balanced {
                weights[0] = -2.0 * weights[1..].iter().sum::<f64>();
            }
            let filter = Filter { form, weights };
            let border = 4;
            let both = filter.correlate_both(&tile.bordered(border, value), tile, border);
            let weight = |at: isize| {
                let weight = filter.weights.get(at.unsigned_abs()).copied().unwrap_or(0.0);
                match (form, at.signum()) {
                    (Form::Odd, sign) => weight * sign as f64,
                    _ => weight,
                }
            };
            for row in 0..tile.height {
                for column in 0..tile.width {
                    let (x, y) = ((tile.left + column) as isize, (tile.top + row) as isize);
                    let mut expected = 0.0;
                    for dy in -3..=3 {
                        for dx in -3..=3 {
                            expected += weight(dx) * weight(dy) * value(x + dx, y + dy);
                        }
                    }
                    assert_eq!(both[row * tile.columns() + column], expected, "{form:?} {column} {row}");
                }
            }
        }
    }
}
