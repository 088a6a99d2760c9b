//! Line charts as SVG, whose steps along the horizontal axis all have the same width. Text uses the reader's fonts, so
//! that no font is embedded.

use std::fmt::Write;

/// The margins around the axes in pixels: left, top, right, bottom.
const MARGINS: [f64; 4] = [62.0, 14.0, 14.0, 48.0];
/// The height of a line of the legend in pixels; below, the approximate width of a letter.
const LINE: f64 = 16.0;
const LETTER: f64 = 6.5;
/// The margin beyond the first and last steps, in steps.
const MARGIN: f64 = 0.25;
/// The most names along the axis.
const MAX_NAMES: usize = 12;

/// A line through one value per step.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Its name in the legend.
    pub label: &'static str,
    /// A colour of SVG.
    pub color: &'static str,
    /// A value for each step.
    pub values: Vec<f64>,
}

/// A vertical dashed line at a step.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Its name in the legend.
    pub label: &'static str,
    /// A colour of SVG.
    pub color: &'static str,
    /// The step, from 0.
    pub step: usize,
}

/// A corner of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corner {
    /// The upper left.
    UpperLeft,
    /// The lower right.
    LowerRight,
}

/// A chart of curves over steps.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The names of the horizontal and the vertical axis.
    pub axes: [String; 2],
    /// The steps' names.
    pub steps: Vec<String>,
    /// The curves. Values that are not finite are left out.
    pub curves: Vec<Curve>,
    /// Marks.
    pub marks: Vec<Mark>,
    /// The legend's place.
    pub legend_corner: Corner,
}

/// Charts next to each other, as SVG.
pub fn svg(charts: &[Chart]) -> String {
    let width: u32 = charts.iter().map(|chart| chart.size[0]).sum();
    let height = charts.iter().map(|chart| chart.size[1]).max().unwrap_or(0);
    let mut body = String::new();
    let mut left = 0;
    for chart in charts {
        body += &format!("<g transform=\"translate({left},0)\">\n{}</g>\n", chart.body());
        left += chart.size[0];
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n{body}</svg>\n"
    )
}

/// Text with SVG's special characters escaped.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A round step that divides `top` into a few.
fn round_step(top: f64) -> f64 {
    let rough = top / 6.0;
    let power = 10f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|&factor| factor * power >= rough);
    factor.unwrap_or(10.0) * power
}

impl Chart {
    /// The upper end of the vertical axis: above the largest value.
    fn top(&self) -> f64 {
        let values = self.curves.iter().flat_map(|curve| &curve.values);
        let finite = values.copied().filter(|value| value.is_finite());
        finite.fold(1e-9, f64::max) * 1.1
    }

    /// The position of a step and a value, in pixels.
    fn place(&self, step: f64, value: f64) -> [f64; 2] {
        let [left, top, right, bottom] = MARGINS;
        let [width, height] = self.size.map(f64::from);
        let last = self.steps.len().saturating_sub(1) as f64;
        let across = (step + MARGIN) / (last + 2.0 * MARGIN);
        let up = value / self.top();
        [left + across * (width - left - right), height - bottom - up * (height - top - bottom)]
    }

    fn body(&self) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_axes(&mut out);
        let _ = self.write_curves(&mut out);
        let _ = self.write_legend(&mut out);
        out
    }

    fn write_axes(&self, out: &mut String) -> std::fmt::Result {
        let [left, top, right, bottom] = MARGINS;
        let [width, height] = self.size.map(f64::from);
        let (base, end) = (height - bottom, width - right);
        let step = round_step(self.top());
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let mut value = 0.0;
        while value <= self.top() {
            let [_, y] = self.place(0.0, value);
            writeln!(out, "<path d=\"M{left:.1} {y:.1}H{end:.1}\" stroke=\"#ddd\"/>")?;
            let (x, below) = (left - 6.0, y + 4.0);
            writeln!(out, "<text x=\"{x:.1}\" y=\"{below:.1}\" text-anchor=\"end\">{value:.decimals$}</text>")?;
            value += step;
        }
        writeln!(out, "<path d=\"M{left:.1} {top:.1}V{base:.1}H{end:.1}\" stroke=\"black\" fill=\"none\"/>")?;
        let every = self.steps.len().div_ceil(MAX_NAMES).max(1);
        for (step, name) in self.steps.iter().enumerate().step_by(every) {
            let [x, _] = self.place(step as f64, 0.0);
            let (y, name) = (base + 17.0, escaped(name));
            writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{name}</text>")?;
        }
        let [across, up] = self.axes.each_ref().map(|axis| escaped(axis));
        let (middle, y) = ((left + end) / 2.0, height - 10.0);
        writeln!(out, "<text x=\"{middle:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{across}</text>")?;
        let y = (top + base) / 2.0;
        writeln!(out, "<text transform=\"translate(16,{y:.1}) rotate(-90)\" text-anchor=\"middle\">{up}</text>")
    }

    fn write_curves(&self, out: &mut String) -> std::fmt::Result {
        for mark in &self.marks {
            let ([x, low], [_, high]) = (self.place(mark.step as f64, 0.0), self.place(mark.step as f64, self.top()));
            let color = mark.color;
            writeln!(out, "<path d=\"M{x:.1} {low:.1}V{high:.1}\" stroke=\"{color}\" stroke-dasharray=\"4\"/>")?;
        }
        for Curve { color, values, .. } in &self.curves {
            let finite = values.iter().enumerate().filter(|(_, value)| value.is_finite());
            let places: Vec<_> = finite.map(|(step, &value)| self.place(step as f64, value)).collect();
            let points: Vec<_> = places.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let points = points.join(" ");
            writeln!(out, "<polyline points=\"{points}\" stroke=\"{color}\" stroke-width=\"2\" fill=\"none\"/>")?;
            for [x, y] in places {
                writeln!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{color}\"/>")?;
            }
        }
        Ok(())
    }

    fn write_legend(&self, out: &mut String) -> std::fmt::Result {
        let curves = self.curves.iter().map(|curve| (curve.label, curve.color));
        let marks = self.marks.iter().map(|mark| (mark.label, mark.color));
        let entries: Vec<_> = curves.chain(marks).collect();
        let longest = entries.iter().map(|(label, _)| label.len()).max().unwrap_or(0);
        let [width, height] = [longest as f64 * LETTER + 40.0, entries.len() as f64 * LINE + 8.0];
        let [left, top, right, bottom] = MARGINS;
        let [x, y] = match self.legend_corner {
            Corner::UpperLeft => [left + 8.0, top + 4.0],
            Corner::LowerRight => {
                [f64::from(self.size[0]) - right - width - 8.0, f64::from(self.size[1]) - bottom - height - 8.0]
            }
        };
        writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"white\" fill-opacity=\"0.8\" \
             stroke=\"#bbb\"/>"
        )?;
        for (line, (label, color)) in entries.into_iter().enumerate() {
            let middle = y + 12.0 + line as f64 * LINE;
            let (x, below) = (x + 6.0, middle + 4.0);
            writeln!(out, "<path d=\"M{x:.1} {middle:.1}h16\" stroke=\"{color}\" stroke-width=\"2\"/>")?;
            let x = x + 22.0;
            writeln!(out, "<text x=\"{x:.1}\" y=\"{below:.1}\">{}</text>", escaped(label))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> Chart {
        Chart {
            size: [400, 300],
            axes: ["modules & more".to_owned(), "speed-up".to_owned()],
            steps: ["1", "2", "4"].map(str::to_owned).into(),
            curves: vec![Curve { label: "raster", color: "red", values: vec![0.0, 10.0, f64::NAN] }],
            marks: vec![Mark { label: "paper", color: "gray", step: 1 }],
            legend_corner: Corner::UpperLeft,
        }
    }

    #[test]
    fn values_are_where_the_axes_say() {
        let chart = chart();
        let [_, base] = chart.place(0.0, 0.0);
        assert_eq!(base, 300.0 - MARGINS[3]);
        let [right, top] = chart.place(2.0 + MARGIN, 11.0);
        assert!((right - (400.0 - MARGINS[2])).abs() < 1e-9 && (top - MARGINS[1]).abs() < 1e-9);
        let text = svg(&[chart.clone(), chart]);
        // The third value is not a number.
        assert_eq!(text.matches("<circle").count(), 2 * 2);
        assert_eq!(text.matches("modules &amp; more</text>").count(), 2);
        assert_eq!(text.matches("stroke-dasharray").count(), 2);
        assert!(text.starts_with("<svg") && text.contains("width=\"800\" height=\"300\""));
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn steps_of_the_axis_are_round_and_few() {
        for top in [1e-9, 0.07, 1.0, 29.0, 1234.0] {
            let step = round_step(top);
            assert!((2.0..=6.0).contains(&(top / step)), "{top} {step}");
        }
    }
}
