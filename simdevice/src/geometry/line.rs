//! Lines whose pixels the edges of a rectangle alone do not decide: Bresenham's, smooth, and stippled ones (Vulkan 1.4, "Bresenham
//! Line Segment Rasterization", "Line Stipple", "Smooth Lines").
//!
//! Coordinates are in 1/256 pixels. The values of such a line, as depth, are those of the rectangle of the same line.

use super::primitive::cross;
use crate::simd::{both, three};
use crate::state::{LineMode, LineStipple};

/// The number of sub-pixel positions in a pixel, and half of it.
const ONE: i64 = 256;
const HALF: i64 = ONE / 2;

/// The distance, in 1/256 pixels, from a line of no width within which its pixels have all their samples.
const REACH: f64 = 1.5 * ONE as f64;

/// A line that is no plain rectangle.
#[derive(Clone, Debug)]
pub struct StyledLine {
    /// The number of its primitive in the segment, or of the next one if it has none.
    pub primitive: u32,
    /// The corners of its rectangle, as those of [`Primitive`](super::Primitive).
    pub rectangle: [[i32; 2]; 3],
    form: Form,
    stipple: Option<LineStipple>,
    /// True if it goes on where the line before it in a strip ends.
    continues: bool,
    /// The stipple counter at its beginning. A part of it is what the line before has left of a unit.
    counter: f64,
}

/// The form of a line, which decides its pixels.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// The edges of the rectangle, sample by sample.
    Rectangle(Axis),
    /// The area of the rectangle in a pixel.
    Smooth(Axis),
    /// The diamonds of pixels that the line leaves.
    Bresenham(PixelLine),
}

/// The middle line of a rectangle.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Its beginning in pixels.
    from: [f64; 2],
    /// Its direction, of length 1.
    direction: [f64; 2],
    /// Its length in pixels.
    length: f64,
}

impl Axis {
    /// The middle line of the rectangle of these corners, which has an area.
    fn of(rectangle: [[i32; 2]; 3]) -> Self {
        let [a, b, c] = three(rectangle, |corner| both(corner, |at| f64::from(at) / ONE as f64));
        let along = [c[0] - b[0], c[1] - b[1]];
        let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
        Self { from: [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])], direction: both(along, |part| part / length), length }
    }

    /// The corners of a parallelogram along the line, moved outwards on all sides by `reach`, in 1/256 pixels.
    fn grown(&self, [a, b, c]: [[i32; 2]; 3], reach: f64) -> [[i32; 2]; 3] {
        let along = self.direction;
        let across = [along[1], -along[0]];
        let moved = |corner: [i32; 2], by_across: f64, by_along: f64| {
            [0, 1].map(|axis| {
                (f64::from(corner[axis]) + reach * (by_across * across[axis] + by_along * along[axis])) as i32
            })
        };
        [moved(a, -1.0, -1.0), moved(b, 1.0, -1.0), moved(c, 1.0, 1.0)]
    }

    /// The distance along the line of a point in pixels.
    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        (x - self.from[0]) * self.direction[0] + (y - self.from[1]) * self.direction[1]
    }
}

impl StyledLine {
    /// The line from one vertex to another, of which `rectangle` is the rectangle of its width. None if it has no pixels.
    pub(super) fn new(
        ends: [[i32; 2]; 2],
        rectangle: [[i32; 2]; 3],
        mode: LineMode,
        stipple: Option<LineStipple>,
        width: f32,
    ) -> Option<Self> {
        if cross(rectangle) <= 0 {
            return None;
        }
        let form = match mode {
            LineMode::Rectangular => Form::Rectangle(Axis::of(rectangle)),
            LineMode::Smooth => Form::Smooth(Axis::of(rectangle)),
            LineMode::Bresenham => Form::Bresenham(PixelLine::new(ends, width)?),
        };
        Some(Self { primitive: 0, rectangle, form, stipple, continues: false, counter: 0.0 })
    }

    /// The line with its place: the number of its primitive, and whether it goes on where the line before it ends.
    pub(super) fn placed(self, primitive: u32, continues: bool) -> Self {
        Self { primitive, continues, ..self }
    }

    /// Sets the stipple counter of a line after lines that end at `counter`, and returns that at its own end.
    pub(super) fn count(&mut self, counter: f64) -> f64 {
        self.counter = if self.continues { counter } else { 0.0 };
        self.counter
            + match &self.form {
                Form::Rectangle(axis) | Form::Smooth(axis) => axis.length,
                Form::Bresenham(pixels) => pixels.count() as f64,
            }
    }

    /// The corners of a parallelogram that has all samples of its pixels.
    pub(super) fn outline(&self) -> [[i32; 2]; 3] {
        match &self.form {
            Form::Rectangle(_) => self.rectangle,
            Form::Smooth(axis) => axis.grown(self.rectangle, REACH),
            Form::Bresenham(pixels) => {
                let [from, to] = pixels.ends;
                pixels.axis.grown([from, from, to], REACH + 0.5 * (pixels.width * ONE) as f64)
            }
        }
    }

    /// True if it covers the sample at `position` of a pixel, which is within the outline.
    pub fn covers(&self, pixel: [i32; 2], position: [i32; 2]) -> bool {
        match &self.form {
            Form::Rectangle(axis) => {
                let at = |axis: usize| f64::from(pixel[axis]) + f64::from(position[axis]) / ONE as f64;
                self.is_on(axis.distance([at(0), at(1)]).max(0.0))
            }
            Form::Smooth(_) => self.coverage(pixel) > 0.0,
            Form::Bresenham(pixels) => pixels.number(pixel).is_some_and(|number| self.is_on(number as f64)),
        }
    }

    /// The share of a pixel that it covers, by which alpha is multiplied. 1 for lines that are not smooth.
    pub fn coverage(&self, pixel: [i32; 2]) -> f32 {
        let Form::Smooth(axis) = &self.form else {
            return 1.0;
        };
        let square = Polygon::pixel(pixel).cut_to(self.rectangle);
        if self.stipple.is_none() {
            return square.area() as f32;
        }
        // The units of the pattern that the pixel may meet.
        let middle = axis.distance(both(pixel, |at| f64::from(at) + 0.5));
        let unit = |distance: f64| (self.counter + distance.clamp(0.0, axis.length)) as u64;
        let mut area = 0.0;
        for number in unit(middle - 1.0)..=unit(middle + 1.0) {
            let start = number as f64 - self.counter;
            if self.is_on((start + 0.5).max(0.0)) {
                area += square.between(axis, start, start + 1.0).area();
            }
        }
        area as f32
    }

    /// True if the stipple draws what is at a distance from the beginning, in pixels.
    fn is_on(&self, distance: f64) -> bool {
        self.stipple.is_none_or(|LineStipple { factor, pattern }| {
            let bit = (self.counter + distance) as u64 / u64::from(factor.max(1)) % 16;
            pattern >> bit & 1 == 1
        })
    }
}

/// The pixels of a line by the diamond-exit rule, of ends that are moved by (-e, -e^2), where e is as small as can be.
#[derive(Clone, Copy, Debug)]
struct PixelLine {
    /// The middle line, for the outline.
    axis: Axis,
    ends: [[i32; 2]; 2],
    /// The ends of the line through the first pixel of each column, if it is x-major.
    from: [i64; 2],
    to: [i64; 2],
    /// The axis along which it has one group of pixels in each column or row: 0 for x, 1 for y.
    major: usize,
    /// The pixels of a group.
    width: i64,
    /// The first and the last column or row, in the line's direction.
    first: i64,
    last: i64,
}

impl PixelLine {
    /// The pixels of a line of a whole `width`. None if there are none.
    fn new(ends: [[i32; 2]; 2], width: f32) -> Option<Self> {
        let [a, b] = both(ends, |end| both(end, i64::from));
        let by = [b[0] - a[0], b[1] - a[1]];
        if by == [0, 0] {
            return None;
        }
        let major = usize::from(by[0].abs() < by[1].abs());
        let width = width as i64;
        let moved = |mut end: [i64; 2]| {
            end[1 - major] -= (width - 1) * HALF;
            end
        };
        let along = both(by, |part| part as f64 / ONE as f64);
        let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
        let axis =
            Axis { from: both(a, |at| at as f64 / ONE as f64), direction: both(along, |part| part / length), length };
        let mut line = Self { axis, ends, from: moved(a), to: moved(b), major, width, first: 0, last: 0 };
        // The pixels of the ends, and those next to them, are all in doubt.
        let step = line.step();
        let pixel = |end: [i64; 2]| end[major].div_euclid(ONE);
        let (start, end) = (pixel(line.from) - step, pixel(line.to) + step);
        let count = (end - start) * step + 1;
        let places = |from: i64, step: i64| (0..count.min(4)).map(move |number| from + number * step);
        line.first = places(start, step).find(|place| line.has(*place))?;
        line.last = places(end, -step).find(|place| line.has(*place))?;
        Some(line)
    }

    /// The direction along the major axis.
    fn step(&self) -> i64 {
        if self.to[self.major] > self.from[self.major] { 1 } else { -1 }
    }

    /// The number of columns or rows.
    fn count(&self) -> i64 {
        (self.last - self.first).abs() + 1
    }

    /// The first pixel across the line at a place along the major axis.
    fn across(&self, place: i64) -> i64 {
        let (major, minor) = (self.major, 1 - self.major);
        let [from, to] = [self.from, self.to].map(|end| both(end, i128::from));
        let length = (to[major] - from[major]).abs();
        let rise = (to[minor] - from[minor]) * i128::from(self.step());
        let centre = i128::from(place * ONE + HALF);
        // The place across times the length, in 1/256 pixels.
        let at = from[minor] * length + rise * (centre - from[major]);
        let pixel = length * i128::from(ONE);
        let row = at.div_euclid(pixel);
        // On the boundary of two pixels, moving the ends decides: by e along x, times the slope, then by e^2.
        let is_less = at.rem_euclid(pixel) == 0 && (major == 1 || rise <= 0);
        (row - i128::from(is_less)) as i64
    }

    /// True if the line leaves the diamond of the pixel at a place along the major axis, and does not end in it.
    fn has(&self, place: i64) -> bool {
        let mut pixel = [0; 2];
        pixel[self.major] = place;
        pixel[1 - self.major] = self.across(place);
        let centre = place * ONE + HALF;
        let is_right = self.step() > 0;
        // An end on the centre lies before it, since it is moved by less than nothing.
        let is_beyond = |end: [i64; 2]| if is_right { centre >= end[self.major] } else { centre < end[self.major] };
        (is_beyond(self.from) || in_diamond(self.from, pixel)) && !is_beyond(self.to) && !in_diamond(self.to, pixel)
    }

    /// The number of a pixel's column or row from the beginning; none if the pixel is not one of the line.
    fn number(&self, pixel: [i32; 2]) -> Option<i64> {
        let [place, across] = [pixel[self.major], pixel[1 - self.major]].map(i64::from);
        let number = (place - self.first) * self.step();
        ((0..self.count()).contains(&number) && (0..self.width).contains(&(across - self.across(place))))
            .then_some(number)
    }
}

/// True if a point that is moved by (-e, -e^2) lies in the diamond about the centre of a pixel.
fn in_diamond(point: [i64; 2], pixel: [i64; 2]) -> bool {
    let [u, v] = [0, 1].map(|axis: usize| point[axis] - (pixel[axis] * ONE + HALF));
    let distance = u.abs() + v.abs();
    distance < HALF || distance == HALF && u > 0
}

/// The most corners of a square after six cuts.
const MOST_CORNERS: usize = 10;

/// A convex polygon, in pixels from the corner of a pixel.
#[derive(Clone, Copy, Debug)]
struct Polygon {
    corner: [i32; 2],
    points: [[f64; 2]; MOST_CORNERS],
    count: usize,
}

impl Polygon {
    /// A pixel.
    fn pixel(corner: [i32; 2]) -> Self {
        let mut points = [[0.0; 2]; MOST_CORNERS];
        points[..4].copy_from_slice(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        Self { corner, points, count: 4 }
    }

    /// The part where `distance` is at least 0.
    fn cut(&self, distance: impl Fn([f64; 2]) -> f64) -> Self {
        let mut part = Self { count: 0, ..*self };
        let mut push = |point: [f64; 2]| {
            if part.count < MOST_CORNERS {
                part.points[part.count] = point;
                part.count += 1;
            }
        };
        for number in 0..self.count {
            let (a, b) = (self.points[number], self.points[(number + 1) % self.count]);
            let (of_a, of_b) = (distance(a), distance(b));
            if of_a >= 0.0 {
                push(a);
            }
            if (of_a >= 0.0) != (of_b >= 0.0) {
                let t = of_a / (of_a - of_b);
                push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        part
    }

    /// The part in the parallelogram of these corners.
    fn cut_to(&self, corners: [[i32; 2]; 3]) -> Self {
        let [a, b, c] = three(corners, |corner| {
            [0, 1].map(|axis: usize| f64::from(corner[axis]) / ONE as f64 - f64::from(self.corner[axis]))
        });
        let d = [a[0] + c[0] - b[0], a[1] + c[1] - b[1]];
        // The parallelogram is to the right of its edges, y being down.
        let edge = |from: [f64; 2], to: [f64; 2]| {
            move |[x, y]: [f64; 2]| (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0])
        };
        self.cut(edge(a, b)).cut(edge(b, c)).cut(edge(c, d)).cut(edge(d, a))
    }

    /// The part between two distances along a line.
    fn between(&self, axis: &Axis, first: f64, last: f64) -> Self {
        let at = |[x, y]: [f64; 2]| axis.distance([x + f64::from(self.corner[0]), y + f64::from(self.corner[1])]);
        self.cut(|point| at(point) - first).cut(|point| last - at(point))
    }

    fn area(&self) -> f64 {
        let of = |number: usize| {
            let (a, b) = (self.points[number], self.points[(number + 1) % self.count]);
            a[0] * b[1] - a[1] * b[0]
        };
        0.5 * (0..self.count).map(of).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small whole numbers, one after the other.
    struct Random(u64);

    impl Random {
        fn below(&mut self, limit: u64) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) % limit
        }
    }

    /// The pixels of a line by the text of the rule: its ends are moved by a number so small that no other decision
    /// depends on it, and the line is cut with each pixel's diamond.
    fn by_the_rule(a: [i64; 2], b: [i64; 2]) -> Vec<[i32; 2]> {
        // In units of 2^-40 of 1/256 pixels; e is 2^-15, and e^2 is 2^-30.
        const UNIT: i128 = 1 << 40;
        let moved = |p: [i64; 2]| [i128::from(p[0]) * UNIT - (UNIT >> 15), i128::from(p[1]) * UNIT - (UNIT >> 30)];
        let (from, to) = (moved(a), moved(b));
        let inside = |p: [i128; 2], pixel: [i32; 2]| {
            let part = |axis: usize| (p[axis] - (i128::from(pixel[axis]) * 256 + 128) * UNIT).abs();
            part(0) + part(1) < 128 * UNIT
        };
        // The segment meets the open diamond if an end lies in it, or it crosses one of the diamond's diagonals within.
        let meets = |pixel: [i32; 2]| {
            let [x, y] = [0, 1].map(|axis: usize| (i128::from(pixel[axis]) * 256 + 128) * UNIT);
            let by = [to[0] - from[0], to[1] - from[1]];
            let crosses = |axis: usize, at: i128, centre: i128| {
                let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
                if by[axis] == 0 || at <= low || at >= high {
                    return false;
                }
                // The other coordinate times the length along this one.
                let other = 1 - axis;
                let (length, sign) = (by[axis].abs(), by[axis].signum());
                let off = (from[other] - centre) * length + by[other] * sign * (at - from[axis]);
                off.abs() < 128 * UNIT * length
            };
            inside(from, pixel) || inside(to, pixel) || crosses(0, x, y) || crosses(1, y, x)
        };
        let low = |axis: usize| (a[axis].min(b[axis]).div_euclid(256) - 1) as i32;
        let high = |axis: usize| (a[axis].max(b[axis]).div_euclid(256) + 1) as i32;
        let mut pixels = Vec::new();
        for y in low(1)..=high(1) {
            for x in low(0)..=high(0) {
                if meets([x, y]) && !inside(to, [x, y]) {
                    pixels.push([x, y]);
                }
            }
        }
        pixels
    }

    fn found(line: &PixelLine) -> Vec<[i32; 2]> {
        let ends = [line.from, line.to];
        let low = |axis: usize| (ends[0][axis].min(ends[1][axis]).div_euclid(256) - 3) as i32;
        let high = |axis: usize| (ends[0][axis].max(ends[1][axis]).div_euclid(256) + 3) as i32 + line.width as i32;
        (low(1)..=high(1))
            .flat_map(|y| (low(0)..=high(0)).map(move |x| [x, y]))
            .filter(|pixel| line.number(*pixel).is_some())
            .collect()
    }

    #[gaurast_runner::test]
    fn bresenham_lines_are_those_of_the_diamond_exit_rule() {
        let mut random = Random(1);
        let mut counts = [0; 2];
        for round in 0..6000 {
            // Ends on corners, edges and centres of pixels, and anywhere.
            let grid = [256, 128, 64, 1][round % 4];
            let end = |random: &mut Random| [0, 1].map(|_| (random.below(8 * 256 / grid) * grid) as i32);
            let ends = [end(&mut random), end(&mut random)];
            let [a, b] = both(ends, |end| both(end, i64::from));
            let expected = by_the_rule(a, b);
            let line = PixelLine::new(ends, 1.0);
            let found = line.as_ref().map_or_else(Vec::new, found);
            assert_eq!(found, expected, "{a:?} to {b:?}");
            counts[usize::from(found.is_empty())] += 1;
        }
        assert!(counts[0] > 5000 && counts[1] > 20, "{counts:?}");
    }

    #[gaurast_runner::test]
    fn wide_bresenham_lines_repeat_pixels_across() {
        let ends = [[128, 128], [128 + 2048, 128 + 700]];
        let narrow = found(&PixelLine::new(ends, 1.0).expect("a line"));
        let wide = PixelLine::new(ends, 3.0).expect("a line");
        let mut expected: Vec<[i32; 2]> =
            narrow.iter().flat_map(|[x, y]| [[*x, y - 1], [*x, *y], [*x, y + 1]]).collect();
        expected.sort_unstable_by_key(|[x, y]| (*y, *x));
        assert_eq!(found(&wide), expected);
        assert_eq!(wide.count(), narrow.len() as i64);
    }

    fn rectangle(from: [f64; 2], to: [f64; 2], width: f64) -> [[i32; 2]; 3] {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let half = 0.5 * width / (dx * dx + dy * dy).sqrt();
        let at = |[x, y]: [f64; 2], side: f64| [x - dy * half * side, y + dx * half * side].map(|v| (v * 256.0) as i32);
        [at(from, 1.0), at(from, -1.0), at(to, -1.0)]
    }

    fn line(mode: LineMode, stipple: Option<LineStipple>, width: f32) -> StyledLine {
        let corners = rectangle([2.3, 3.1], [23.9, 11.7], width.into());
        StyledLine::new([[588, 793], [6118, 2995]], corners, mode, stipple, width).expect("a line")
    }

    #[gaurast_runner::test]
    fn smooth_coverage_is_the_area_of_the_rectangle_in_the_pixel() {
        const SAMPLES: i32 = 64;
        for stipple in [None, Some(LineStipple { factor: 2, pattern: 0b0110_1101_0011_0101 })] {
            let mut smooth = line(LineMode::Smooth, stipple, 2.5);
            smooth.continues = true;
            let end = smooth.count(3.25);
            let sharp = StyledLine { form: Form::Rectangle(Axis::of(smooth.rectangle)), ..smooth.clone() };
            let mut sum = 0.0;
            for y in 0..16 {
                for x in 0..28 {
                    let mut count = 0;
                    for sample in 0..SAMPLES * SAMPLES {
                        let within = [sample % SAMPLES, sample / SAMPLES].map(|at| at * 256 / SAMPLES + 2);
                        let point = [0, 1].map(|axis: usize| f64::from([x, y][axis]) + f64::from(within[axis]) / 256.0);
                        count += u32::from(in_rectangle(smooth.rectangle, point) && sharp.covers([x, y], within));
                    }
                    let expected = f64::from(count) / f64::from(SAMPLES * SAMPLES);
                    let coverage = f64::from(smooth.coverage([x, y]));
                    assert!((coverage - expected).abs() < 0.03, "({x}, {y}): {coverage} {expected}");
                    assert_eq!(smooth.covers([x, y], [0, 0]), coverage > 0.0);
                    sum += coverage;
                }
            }
            if stipple.is_none() {
                assert!((sum - 2.5 * (end - 3.25)).abs() < 0.1, "{sum}");
            }
        }
    }

    fn in_rectangle(corners: [[i32; 2]; 3], [x, y]: [f64; 2]) -> bool {
        let [a, b, c] = three(corners, |corner| both(corner, |at| f64::from(at) / 256.0));
        let d = [a[0] + c[0] - b[0], a[1] + c[1] - b[1]];
        [(a, b), (b, c), (c, d), (d, a)]
            .iter()
            .all(|(p, q)| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) >= 0.0)
    }

    #[gaurast_runner::test]
    fn the_outline_has_all_samples() {
        for mode in [LineMode::Rectangular, LineMode::Smooth, LineMode::Bresenham] {
            for width in [1.0, 4.0, 9.0] {
                let line = line(mode, None, width);
                let outline = line.outline();
                assert!(cross(outline) > 0);
                for (x, y) in (-12..32).flat_map(|y| (-12..40).map(move |x| (x, y))) {
                    let own = |position: [i32; 2]| match mode {
                        LineMode::Rectangular => false,
                        _ => line.covers([x, y], position),
                    };
                    for position in [[0, 0], [255, 0], [0, 255], [255, 255]].into_iter().filter(|at| own(*at)) {
                        let point =
                            [0, 1].map(|axis: usize| f64::from([x, y][axis]) + f64::from(position[axis]) / 256.0);
                        assert!(in_rectangle(outline, point), "{mode:?} {width} ({x}, {y})");
                    }
                }
            }
        }
    }

    #[gaurast_runner::test]
    fn the_pattern_goes_on_along_strips_alone() {
        let stipple = Some(LineStipple { factor: 3, pattern: 0b1 });
        let mut first = line(LineMode::Bresenham, stipple, 1.0).placed(0, false);
        let end = first.count(5.0);
        assert_eq!(first.counter, 0.0);
        let pixels: i64 = match &first.form {
            Form::Bresenham(pixels) => pixels.count(),
            _ => unreachable!("it is a line of pixels"),
        };
        assert_eq!(end, pixels as f64);
        let mut next = line(LineMode::Bresenham, stipple, 1.0).placed(1, true);
        assert_eq!(next.count(end), 2.0 * end);
        // Three of 48 pixels are drawn.
        let drawn = |line: &StyledLine| (0..pixels).filter(|number| line.is_on(*number as f64)).count();
        assert_eq!(drawn(&first), 3);
        let expected = (0..pixels).filter(|number| (pixels + number) / 3 % 16 == 0).count();
        assert_eq!(drawn(&next), expected);
    }
}
