//! Plots as PNG and SVG.

use std::path::Path;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use crate::error::BenchError;

/// A panel's size in pixels.
const PANEL: [u32; 2] = [560, 420];

/// The number of panels in a row.
const COLUMNS: usize = 2;

/// The colours of the series, which people with colour blindness can tell apart (Okabe and Ito).
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Points of one series.
pub struct Series {
    pub name: String,
    /// Coordinates x, y, both more than 0.
    pub points: Vec<[f64; 2]>,
    /// True if a line joins the points.
    pub joined: bool,
}

/// Axes with series, both logarithmic.
pub struct Panel {
    pub title: String,
    pub axes: [&'static str; 2],
    pub series: Vec<Series>,
    /// The points of a line that is drawn over everything, such as the Pareto front.
    pub front: Vec<[f64; 2]>,
}

/// Draws the panels to `stem`.svg and `stem`.png.
pub fn write(stem: &Path, caption: &str, panels: &[Panel]) -> Result<(), BenchError> {
    static FONT: Once = Once::new();
    FONT.call_once(|| {
        let font = epaint_default_fonts::UBUNTU_LIGHT;
        // Registering the font cannot fail, since it is part of the program.
        let _ = register_font("sans-serif", FontStyle::Normal, font);
    });
    if let Some(folder) = stem.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let rows = panels.len().div_ceil(COLUMNS).max(1);
    let size = (PANEL[0] * COLUMNS as u32, PANEL[1] * rows as u32 + 30);
    let svg = stem.with_extension("svg");
    draw(&SVGBackend::new(&svg, size).into_drawing_area(), caption, rows, panels)?;
    let mut pixels = vec![0; size.0 as usize * size.1 as usize * 3];
    draw(&BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area(), caption, rows, panels)?;
    image::save_buffer(stem.with_extension("png"), &pixels, size.0, size.1, image::ExtendedColorType::Rgb8)?;
    Ok(())
}

fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    caption: &str,
    rows: usize,
    panels: &[Panel],
) -> Result<(), BenchError> {
    let failed = |error: DrawingAreaErrorKind<B::ErrorType>| BenchError::Plot(error.to_string());
    area.fill(&WHITE).map_err(failed)?;
    let (head, body) = area.split_vertically(30);
    let style = ("sans-serif", 13).into_text_style(&head).color(&BLACK);
    head.draw_text(caption, &style, (10, 8)).map_err(failed)?;
    for (part, panel) in body.split_evenly((rows, COLUMNS)).iter().zip(panels) {
        draw_panel(part, panel).map_err(failed)?;
    }
    area.present().map_err(failed)
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let range = |axis: usize| {
        let values = panel.series.iter().flat_map(|series| &series.points).map(|point| point[axis]);
        let (least, greatest) =
            values.fold((f64::INFINITY, 0.0_f64), |(least, greatest), value| (least.min(value), greatest.max(value)));
        if least <= greatest { least / 1.5..greatest * 1.5 } else { 0.1..10.0 }
    };
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 16))
        .margin(10)
        .x_label_area_size(36)
        .y_label_area_size(60)
        .build_cartesian_2d(range(0).log_scale(), range(1).log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_desc(panel.axes[0])
        .y_desc(panel.axes[1])
        .y_label_formatter(&|value| format!("{value:.0e}"))
        .x_label_formatter(&|value| tick(*value))
        // More labels would overlap on a logarithmic axis.
        .x_labels(5)
        .y_labels(6)
        .label_style(("sans-serif", 12))
        .draw()?;
    let line = |points: &[[f64; 2]]| -> Vec<(f64, f64)> { points.iter().map(|point| (point[0], point[1])).collect() };
    if !panel.front.is_empty() {
        chart
            .draw_series(LineSeries::new(line(&panel.front), BLACK.stroke_width(1)))?
            .label("Pareto front")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], BLACK));
    }
    for (series, color) in panel.series.iter().zip(COLORS.iter().cycle().copied()) {
        if series.joined {
            chart.draw_series(LineSeries::new(line(&series.points), color))?;
        }
        chart
            .draw_series(line(&series.points).into_iter().map(|point| Circle::new(point, 4, color.filled())))?
            .label(&series.name)
            .legend(move |(x, y)| Circle::new((x + 8, y), 4, color.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 12))
        .draw()
}

/// The label of a tick, as short as possible: 0.5, 300, 6M.
fn tick(value: f64) -> String {
    match value {
        1e6.. => format!("{}M", value / 1e6),
        1e4.. => format!("{}k", value / 1e3),
        _ => format!("{value}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_short() {
        let shown = [0.25, 300.0, 30_000.0, 6e6].map(tick);
        assert_eq!(shown, ["0.25", "300", "30k", "6M"]);
    }

    #[test]
    fn a_plot_is_a_picture_and_a_drawing_with_its_words() {
        let folder = tempfile::tempdir().expect("a folder");
        let stem = folder.path().join("new/plot");
        let panel = |title: &str, points: Vec<[f64; 2]>| Panel {
            title: title.to_owned(),
            axes: ["time", "error"],
            front: points.clone(),
            series: vec![Series { name: "contender".to_owned(), points, joined: true }],
        };
        let panels = [
            panel("first", vec![[1.0, 1e-3], [10.0, 1e-7]]),
            panel("one point", vec![[5.0, 2.0]]),
            panel("nothing", Vec::new()),
        ];
        write(&stem, "machine", &panels).expect("plots");
        let svg = std::fs::read_to_string(stem.with_extension("svg")).expect("a drawing");
        for word in ["machine", "first", "one point", "contender", "Pareto front"] {
            assert!(svg.contains(word), "{word}");
        }
        let png = image::open(stem.with_extension("png")).expect("a picture").into_rgb8();
        assert_eq!(png.dimensions(), (2 * PANEL[0], 2 * PANEL[1] + 30));
        let blue = COLORS[0];
        assert!(png.pixels().any(|pixel| pixel.0 == [blue.0, blue.1, blue.2]));
    }
}
