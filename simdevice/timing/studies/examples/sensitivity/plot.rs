//! A sweep as a picture.

use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::error::Error;
use std::sync::Once;
use timing::simulate::Simulation;
use timing_studies::sensitivity::{Point, Sweep};

const SIZE: (u32, u32) = (640, 360);
const RASTER: RGBColor = RGBColor(31, 119, 180);
const FRAME: RGBColor = RGBColor(214, 96, 39);

type SpeedUp = fn(&Simulation) -> f64;

/// The raster stage's and the frame's speed-up over the number that is swept, each step of the same width.
///
/// # Errors
/// What plotters cannot do.
pub fn svg(sweep: &Sweep) -> Result<String, Box<dyn Error>> {
    static FONT: Once = Once::new();
    FONT.call_once(|| {
        // The font is one, since it is part of the program.
        let _ = register_font(
            "sans-serif",
            FontStyle::Normal,
            epaint_default_fonts::UBUNTU_LIGHT,
        );
    });
    let mut out = String::new();
    {
        let root = SVGBackend::with_string(&mut out, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let top = sweep
            .points
            .iter()
            .map(|point| point.simulation.raster_speedup)
            .fold(1.0, f64::max);
        let last = sweep.points.len() as f64 - 1.0;
        let mut chart = ChartBuilder::on(&root)
            .margin(12)
            .x_label_area_size(42)
            .y_label_area_size(52)
            .build_cartesian_2d(-0.25..last + 0.25, 0.0..top * 1.1)?;
        let name = |x: &f64| {
            let near = (x - x.round()).abs() < 0.01 && *x > -0.5;
            let point = sweep.points.get(x.round().max(0.0) as usize);
            point
                .filter(|_| near)
                .map_or(String::new(), |point| point.name.clone())
        };
        chart
            .configure_mesh()
            .x_labels(2 * sweep.points.len())
            .x_label_formatter(&name)
            .x_desc(sweep.axis)
            .y_desc("speed-up over the shader cores")
            .light_line_style(TRANSPARENT)
            .draw()?;
        let curves: [(&str, RGBColor, SpeedUp); 2] = [
            ("raster stage", RASTER, |result| result.raster_speedup),
            ("whole frame", FRAME, |result| result.speedup),
        ];
        for (label, color, of) in curves {
            let place = |(at, point): (usize, &Point)| (at as f64, of(&point.simulation));
            let curve: Vec<_> = sweep.points.iter().enumerate().map(place).collect();
            chart
                .draw_series(LineSeries::new(curve.clone(), color.stroke_width(2)))?
                .label(label)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color));
            chart.draw_series(
                curve
                    .into_iter()
                    .map(|at| Circle::new(at, 3, color.filled())),
            )?;
        }
        let knee = sweep.knee().filter(|_| sweep.file != "precision");
        let at = |wanted: f64| sweep.points.iter().position(|point| point.x == wanted);
        for (mark, color, x) in [
            ("knee", BLACK, knee.map(|point| point.x)),
            ("paper", RGBColor(120, 120, 120), Some(sweep.paper)),
        ] {
            if let Some(at) = x.and_then(at) {
                let line = [(at as f64, 0.0), (at as f64, top * 1.1)];
                chart
                    .draw_series(DashedLineSeries::new(line, 4, 4, color.stroke_width(1)))?
                    .label(mark)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color));
            }
        }
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .position(SeriesLabelPosition::LowerRight)
            .draw()?;
        root.present()?;
    }
    Ok(out)
}
