//! Scatter plots of points and lines as SVG, on linear or logarithmic axes.

use std::fmt::Write;

/// The margins around the axes in pixels: left, top, right, bottom.
const MARGINS: [f64; 4] = [68.0, 16.0, 24.0, 48.0];
/// The approximate number of marks on a linear axis.
const MARKS: f64 = 6.0;

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Its name.
    pub name: String,
    /// True if the axis is logarithmic: each mark is ten times the one before.
    pub logarithmic: bool,
}

/// A named point. The name is shown as a tooltip.
#[derive(Clone, Debug)]
pub struct Point {
    /// The horizontal and the vertical value.
    pub at: [f64; 2],
    /// Its name.
    pub name: String,
    /// True if the name is also written at the point, if there is room.
    pub labelled: bool,
    /// A colour of SVG.
    pub color: &'static str,
}

/// A line through points.
#[derive(Clone, Debug)]
pub struct Line {
    /// The points, each a horizontal and a vertical value.
    pub through: Vec<[f64; 2]>,
    /// Its name, written at its last point.
    pub name: String,
    /// A colour of SVG.
    pub color: &'static str,
}

/// A plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The horizontal and the vertical axis.
    pub axes: [Axis; 2],
    /// The points. Those with values that are not finite, or not positive on a logarithmic axis, are left out.
    pub points: Vec<Point>,
    /// The lines, below the points. Values are left out as for points.
    pub lines: Vec<Line>,
}

/// The least and the greatest position of an axis, and its marks with their names. Positions on a logarithmic axis are
/// logarithms.
struct Scale {
    range: [f64; 2],
    marks: Vec<(f64, String)>,
}

impl Axis {
    /// The position of a value, before it is scaled to pixels.
    fn place(&self, value: f64) -> f64 {
        if self.logarithmic { value.log10() } else { value }
    }

    fn scale(&self, values: impl Iterator<Item = f64>) -> Scale {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.map(|value| self.place(value)).filter(|value| value.is_finite()) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if self.logarithmic {
            let range = [low.floor(), high.ceil().max(low.floor() + 1.0)];
            let decades = range[0] as i32..=range[1] as i32;
            let mark = |power: i32| (f64::from(power), decade(power));
            return Scale { range, marks: decades.map(mark).collect() };
        }
        let margin = ((high - low) * 0.05).max(high.abs() * 1e-3).max(1e-9);
        let (low, high) = (low - margin, high + margin);
        let rough = (high - low) / MARKS;
        let power = 10f64.powf(rough.log10().floor());
        let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * power >= rough);
        let step = factor.unwrap_or(10.0) * power;
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let first = (low / step).ceil();
        let count = ((high / step).floor() - first).max(0.0) as usize + 1;
        let mark = |index: usize| {
            let value = (first + index as f64) * step;
            (value, format!("{value:.decimals$}"))
        };
        Scale { range: [low, high], marks: (0..count).map(mark).collect() }
    }
}

/// The name of a power of ten.
fn decade(power: i32) -> String {
    match power {
        0..=4 => format!("{}", 10i64.pow(power as u32)),
        -3..0 => format!("{}", 10f64.powi(power)),
        _ => format!("1e{power}"),
    }
}

/// Text with SVG's special characters escaped.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The approximate width of a letter and the height of a line of text, in pixels.
const LETTER: [f64; 2] = [6.4, 12.0];

/// A rectangle in pixels: left, top, right, bottom.
type Rectangle = [f64; 4];

/// The places of a plot that are taken, so that no text is written over them.
struct Taken {
    /// The rectangle between the axes, and to the right edge of the picture.
    within: Rectangle,
    rectangles: Vec<Rectangle>,
}

impl Taken {
    fn is_free(&self, [left, top, right, bottom]: Rectangle) -> bool {
        let [low, high, far, deep] = self.within;
        let apart = |&[a, b, c, d]: &Rectangle| right < a || c < left || bottom < b || d < top;
        left >= low && top >= high && right <= far && bottom <= deep && self.rectangles.iter().all(apart)
    }

    /// Takes the places of a line's pieces.
    fn line(&mut self, from: [f64; 2], to: [f64; 2]) {
        const PIECE: f64 = 6.0;
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let count = (dx.hypot(dy) / PIECE).ceil().clamp(1.0, 1000.0);
        for piece in 0..=count as u32 {
            let share = f64::from(piece) / count;
            self.around([from[0] + share * dx, from[1] + share * dy], 1.0);
        }
    }

    /// Takes the places within a distance of a point, across and up.
    fn around(&mut self, [x, y]: [f64; 2], distance: f64) {
        self.rectangles.push([x - distance, y - distance, x + distance, y + distance]);
    }

    /// Takes the nearest free place for a text at a point, and returns its anchor and the begin of its baseline or, if
    /// it is to the left of the point, the end. None if there is no room.
    fn text(&mut self, [x, y]: [f64; 2], letters: usize) -> Option<(&'static str, [f64; 2])> {
        let [width, height] = [LETTER[0] * letters as f64, LETTER[1]];
        for line in 0..4 {
            let further = 15.0 * f64::from(line);
            for baseline in [y - 6.0 - further, y + 15.0 + further] {
                for (anchor, begin, end) in [("start", x + 6.0, x + 6.0 + width), ("end", x - 6.0 - width, x - 6.0)] {
                    let rectangle = [begin, baseline - height + 2.0, end, baseline + 3.0];
                    if self.is_free(rectangle) {
                        self.rectangles.push(rectangle);
                        let at = if anchor == "start" { begin } else { end };
                        return Some((anchor, [at, baseline]));
                    }
                }
            }
        }
        None
    }
}

impl Plot {
    /// The plot as SVG.
    pub fn svg(&self) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut out);
        out
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let [width, height] = self.size;
        writeln!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>"
        )?;
        let [width, height] = self.size.map(f64::from);
        let values = |axis: usize| {
            let points = self.points.iter().map(move |point| point.at[axis]);
            let lines = self.lines.iter().flat_map(|line| &line.through);
            points.chain(lines.map(move |place| place[axis]))
        };
        let scales = [self.axes[0].scale(values(0)), self.axes[1].scale(values(1))];
        let [left, top, right, bottom] = MARGINS;
        let (base, end) = (height - bottom, width - right);
        let share = |axis: usize, place: f64| {
            let [low, high] = scales[axis].range;
            (place - low) / (high - low)
        };
        let x = |place: f64| left + share(0, place) * (end - left);
        let y = |place: f64| base - share(1, place) * (base - top);
        for (place, name) in &scales[0].marks {
            let (x, below) = (x(*place), base + 17.0);
            writeln!(out, "<path d=\"M{x:.1} {top:.1}V{base:.1}\" stroke=\"#ddd\"/>")?;
            writeln!(out, "<text x=\"{x:.1}\" y=\"{below:.1}\" text-anchor=\"middle\">{name}</text>")?;
        }
        for (place, name) in &scales[1].marks {
            let (y, before) = (y(*place), left - 6.0);
            writeln!(out, "<path d=\"M{left:.1} {y:.1}H{end:.1}\" stroke=\"#ddd\"/>")?;
            let below = y + 4.0;
            writeln!(out, "<text x=\"{before:.1}\" y=\"{below:.1}\" text-anchor=\"end\">{name}</text>")?;
        }
        writeln!(out, "<path d=\"M{left:.1} {top:.1}V{base:.1}H{end:.1}\" stroke=\"black\" fill=\"none\"/>")?;
        let place = |at: [f64; 2]| {
            let [across, up] = [self.axes[0].place(at[0]), self.axes[1].place(at[1])];
            (across.is_finite() && up.is_finite()).then(|| [x(across), y(up)])
        };
        let mut taken = Taken { within: [left, 0.0, width, base], rectangles: Vec::new() };
        for point in self.points.iter().filter_map(|point| place(point.at)) {
            taken.around(point, 4.0);
        }
        for Line { through, name, color } in &self.lines {
            let places: Vec<_> = through.iter().filter_map(|&at| place(at)).collect();
            let text: Vec<_> = places.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            writeln!(
                out,
                "<polyline points=\"{}\" stroke=\"{color}\" stroke-width=\"2\" fill=\"none\"/>",
                text.join(" ")
            )?;
            for pair in places.windows(2) {
                taken.line(pair[0], pair[1]);
            }
            if let Some(&[x, y]) = places.last() {
                let y = y - 6.0;
                let letters = name.chars().count() as f64;
                let begin = x - LETTER[0] * letters;
                taken.rectangles.push([begin, y - LETTER[1], x, y + 3.0]);
                let name = escaped(name);
                writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\" fill=\"{color}\">{name}</text>")?;
            }
        }
        for point in &self.points {
            let Some([x, y]) = place(point.at) else {
                continue;
            };
            let (color, name) = (point.color, escaped(&point.name));
            writeln!(
                out,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{color}\"><title>{name}</title></circle>"
            )?;
            let letters = point.name.chars().count();
            if point.labelled
                && let Some((anchor, [x, y])) = taken.text([x, y], letters)
            {
                writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{name}</text>")?;
            }
        }
        let (middle, low) = ((left + end) / 2.0, height - 10.0);
        let [across, up] = self.axes.each_ref().map(|axis| escaped(&axis.name));
        writeln!(out, "<text x=\"{middle:.1}\" y=\"{low:.1}\" text-anchor=\"middle\">{across}</text>")?;
        let middle = (top + base) / 2.0;
        writeln!(
            out,
            "<text transform=\"translate(16,{middle:.1}) rotate(-90)\" text-anchor=\"middle\">{up}</text>\n</svg>"
        )
    }
}

/// The indices of the points on the Pareto front, ordered by the first value: no other point is at most as large in
/// both values and smaller in one.
pub fn pareto(places: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<_> = (0..places.len()).collect();
    order.sort_by(|&a, &b| {
        let by = |axis: usize| places[a][axis].total_cmp(&places[b][axis]);
        by(0).then(by(1))
    });
    let mut least = f64::INFINITY;
    order.retain(|&index| {
        let better = places[index][1] < least;
        if better {
            least = places[index][1];
        }
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_has_what_nothing_beats() {
        let places = [[1.0, 5.0], [2.0, 5.0], [2.0, 3.0], [3.0, 4.0], [4.0, 1.0], [1.0, 6.0]];
        assert_eq!(pareto(&places), [0, 2, 4]);
        assert!(pareto(&[]).is_empty());
    }

    #[test]
    fn points_and_lines_are_where_the_axes_say() {
        let axis = |name: &str, logarithmic| Axis { name: name.to_owned(), logarithmic };
        let point = |at| Point { at, name: "a < b".to_owned(), labelled: true, color: "red" };
        let plot = Plot {
            size: [400, 300],
            axes: [axis("operations a byte", true), axis("time", false)],
            points: vec![point([1.0, 0.0]), point([100.0, 2.0]), point([0.0, 1.0])],
            lines: vec![Line { through: vec![[1.0, 0.0], [1000.0, 1.0]], name: "roof".to_owned(), color: "blue" }],
        };
        let svg = plot.svg();
        // A point at zero has no position on a logarithmic axis.
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains("<circle cx=\"68.0\"") && svg.contains(">a &lt; b</text>"));
        for mark in ["1", "10", "100", "1000"] {
            assert!(svg.contains(&format!(">{mark}</text>")), "{mark}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn names_are_not_written_over_each_other_nor_over_points() {
        let axis = || Axis { name: String::new(), logarithmic: false };
        let point = |index: u32| Point {
            at: [f64::from(index / 4), f64::from(index % 4) * 1e-3],
            name: format!("machine {index}"),
            labelled: true,
            color: "red",
        };
        let plot =
            Plot { size: [500, 300], axes: [axis(), axis()], points: (0..40).map(point).collect(), lines: Vec::new() };
        let svg = plot.svg();
        let numbers = |line: &str, names: [&str; 2]| {
            names.map(|name| -> f64 {
                let (_, rest) = line.split_once(&format!(" {name}=\"")).expect("a number");
                let (number, _) = rest.split_once('"').expect("a quote");
                number.parse().expect("a number")
            })
        };
        let circles: Vec<_> =
            svg.lines().filter(|line| line.starts_with("<circle")).map(|line| numbers(line, ["cx", "cy"])).collect();
        assert_eq!(circles.len(), 40);
        let texts: Vec<_> = svg
            .lines()
            .filter(|line| line.contains(">machine") && line.starts_with("<text"))
            .map(|line| {
                let [x, y] = numbers(line, ["x", "y"]);
                let letters = line.split(['<', '>']).nth(2).map_or(0, str::len);
                let width = LETTER[0] * letters as f64;
                let left = if line.contains("\"end\"") { x - width } else { x };
                [left, y - 9.0, left + width, y]
            })
            .collect();
        // There is room for some, and not for all.
        assert!((5..40).contains(&texts.len()), "{}", texts.len());
        let meet = |a: &[f64; 4], b: &[f64; 4]| a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
        for (index, text) in texts.iter().enumerate() {
            assert!(!texts[..index].iter().any(|other| meet(text, other)));
            let on = |&[x, y]: &[f64; 2]| meet(text, &[x - 3.0, y - 3.0, x + 3.0, y + 3.0]);
            assert!(!circles.iter().any(on));
        }
    }

    #[test]
    fn small_powers_of_ten_are_written_out() {
        let names = [-4, -3, -1, 0, 4, 5].map(decade);
        assert_eq!(names, ["1e-4", "0.001", "0.1", "1", "10000", "1e5"]);
    }
}
