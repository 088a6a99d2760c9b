//! Tiles of a picture, and the filters that metrics correlate them with.
//!
//! A metric computes a tile row by row, from the rows around it, so that what it computes of a row stays in the first caches. The
//! memory for that is used again for the next tile.
//!
//! Sums are inlined into the callers' vectorized code. A function that is not, and a closure without the attribute, is compiled for the
//! least processor.

use fearless_simd::{Simd, f32x16, f64x8, prelude::*};

/// The width of tiles, a multiple of [`LANES`], and their height, in pixels.
const SIZE: [usize; 2] = [256, 128];

/// The columns that are computed together, of which rows have whole groups.
const LANES: usize = 32;

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

    /// The values of a row of a plane with at least `border` columns on both sides of those that are computed: whole groups.
    pub(crate) fn stride(self, border: usize) -> usize {
        (self.columns() + 2 * border).next_multiple_of(LANES)
    }

    /// The rows of a plane with `border` rows above and below the tile.
    pub(crate) fn rows(self, border: usize) -> usize {
        self.height + 2 * border
    }
}

/// The sum of a row's values, in the order of its groups.
#[inline(always)]
pub(crate) fn sum<T: Copy + Into<f64>>(values: &[T]) -> f64 {
    let (groups, rest) = values.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for group in groups {
        for lane in 0..LANES {
            sums[lane] += group[lane].into();
        }
    }
    let mut sum: f64 = sums.iter().sum();
    for value in rest {
        sum += (*value).into();
    }
    sum
}

/// The numbers of a filter.
pub(crate) trait Number: SimdElement + Default {
    /// As many as are filtered together, which divide a group.
    type Vector<S: Simd>: SimdBase<S, Element = Self>;
}

impl Number for f32 {
    type Vector<S: Simd> = f32x16<S>;
}

impl Number for f64 {
    type Vector<S: Simd> = f64x8<S>;
}

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

impl<T: Number> Filter<T> {
    /// Correlates as many values as `output` has, whole groups. The first is at `middle`, and neighbours are `step` apart: 1 along
    /// rows, and a row's length along columns.
    ///
    /// It is a function of its own for each level, since it is called in many places, with a row each.
    pub(crate) fn correlate<S: Simd>(&self, simd: S, values: &[T], middle: usize, step: usize, output: &mut [T]) {
        let pass = Pass { values, middle, step, count: output.len() };
        simd.vectorize(
            #[inline(always)]
            || match self.form {
                Form::Even => self.run(
                    simd,
                    pass,
                    output,
                    #[inline(always)]
                    |before, _, after| before + after,
                ),
                Form::Balanced => self.run(
                    simd,
                    pass,
                    output,
                    #[inline(always)]
                    |before, centre, after| (before - centre) + (after - centre),
                ),
                Form::Odd => self.run(
                    simd,
                    pass,
                    output,
                    #[inline(always)]
                    |before, _, after| after - before,
                ),
            },
        );
    }

    /// Correlates some weights after the others, so that their loops go along rows. `both` makes what a weight multiplies of the
    /// values before, those in the middle and those after.
    #[inline(always)]
    fn run<S: Simd>(
        &self,
        simd: S,
        pass: Pass<'_, T>,
        output: &mut [T],
        both: impl Fn(T::Vector<S>, T::Vector<S>, T::Vector<S>) -> T::Vector<S> + Copy,
    ) {
        let middle = if self.form == Form::Even { self.weights[0] } else { T::default() };
        let middle = T::Vector::<S>::splat(simd, middle);
        for (output, centre) in output.as_chunks_mut::<LANES>().0.iter_mut().zip(pass.groups(0)) {
            for part in 0..LANES / T::Vector::<S>::LEN {
                (load(simd, centre, part) * middle).store_slice(place::<T, S>(output, part));
            }
        }
        let (fours, rest) = self.weights[1..].as_chunks::<4>();
        for (number, weights) in fours.iter().enumerate() {
            pass.add(simd, 1 + 4 * number, weights, output, both);
        }
        for (number, weight) in rest.iter().enumerate() {
            pass.add(simd, 1 + 4 * fours.len() + number, std::array::from_ref(weight), output, both);
        }
    }
}

/// The vector of a number in a group.
#[inline(always)]
fn load<T: Number, S: Simd>(simd: S, group: &[T; LANES], number: usize) -> T::Vector<S> {
    T::Vector::<S>::from_slice(simd, &group[number * T::Vector::<S>::LEN..][..T::Vector::<S>::LEN])
}

/// The place of a vector in a group.
#[inline(always)]
fn place<T: Number, S: Simd>(group: &mut [T; LANES], number: usize) -> &mut [T] {
    &mut group[number * T::Vector::<S>::LEN..][..T::Vector::<S>::LEN]
}

/// The values that are filtered, of which the first one is at `middle`, with neighbours that are `step` apart.
#[derive(Clone, Copy, Debug)]
struct Pass<'a, T> {
    values: &'a [T],
    middle: usize,
    step: usize,
    /// The number of values.
    count: usize,
}

impl<'a, T: Number> Pass<'a, T> {
    /// The groups of the neighbours at a distance, which is negative before the middle.
    #[inline(always)]
    fn groups(&self, distance: isize) -> &'a [[T; LANES]] {
        let first = self.middle.wrapping_add_signed(distance * self.step as isize);
        self.values[first..][..self.count].as_chunks().0
    }

    /// Adds what consecutive weights multiply, of which the first is at `distance`. There are several of them, so that sums are
    /// loaded and stored less often.
    #[inline(always)]
    fn add<S: Simd, const COUNT: usize>(
        self,
        simd: S,
        distance: usize,
        weights: &[T; COUNT],
        output: &mut [T],
        both: impl Fn(T::Vector<S>, T::Vector<S>, T::Vector<S>) -> T::Vector<S>,
    ) {
        let neighbours = |sign: isize| -> [&[[T; LANES]]; COUNT] {
            std::array::from_fn(|number| self.groups(sign * (distance + number) as isize))
        };
        let (before, centre, after) = (neighbours(-1), self.groups(0), neighbours(1));
        let weights: [T::Vector<S>; COUNT] = std::array::from_fn(|number| T::Vector::<S>::splat(simd, weights[number]));
        for (at, output) in output.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            for part in 0..LANES / T::Vector::<S>::LEN {
                let mut sum = load(simd, output, part);
                let centre = load(simd, &centre[at], part);
                for number in 0..COUNT {
                    let (before, after) = (load(simd, &before[number][at], part), load(simd, &after[number][at], part));
                    sum += weights[number] * both(before, centre, after);
                }
                sum.store_slice(place::<T, S>(output, part));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

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
            let (stride, columns) = (tile.stride(border), tile.columns());
            let place = |at: usize| {
                let (x, y) = (tile.left + at % stride, tile.top + at / stride);
                value(x as isize - border as isize, y as isize - border as isize)
            };
            let plane: Vec<f64> = (0..stride * tile.rows(border)).map(place).collect();
            let (mut down, mut both) = (vec![0.0; stride], vec![0.0; columns * tile.height]);
            for (row, both) in both.chunks_exact_mut(columns).enumerate() {
                dispatch!(Level::new(), simd => {
                    filter.correlate(simd, &plane, (row + border) * stride, stride, &mut down);
                    filter.correlate(simd, &down, border, 1, both);
                });
            }
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
                    assert_eq!(both[row * columns + column], expected, "{form:?} {column} {row}");
                }
            }
        }
    }

    #[test]
    fn a_sum_has_every_value() {
        let values: Vec<f32> = (1..=37_u16).map(f32::from).collect();
        assert_eq!(sum(&values), f64::from(37 * 38 / 2));
        assert_eq!(sum::<f64>(&[]), 0.0);
    }
}
