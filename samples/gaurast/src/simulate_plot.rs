//! A sweep as a picture: speed-ups and energy, each machine a step of the same width.

use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use timing::simulate::Simulation;

/// A panel's size in pixels.
const PANEL: (u32, u32) = (560, 380);

/// Colours of the curves, for eyes of all kinds (Okabe and Ito).
const COLORS: [RGBColor; 3] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
];

/// A number of a simulation, and its name.
type Curve = (&'static str, fn(&Simulation) -> f64);

const SPEED: [Curve; 2] = [
    ("raster stage", |result| result.raster_speedup),
    ("whole frame", |result| result.speedup),
];
const ENERGY: [Curve; 3] = [
    ("all", |result| result.energy.total()),
    ("modules", |result| result.energy.modules()),
    ("memory", |result| result.energy.memory),
];

/// An SVG of the machines' results; `swept` names what differs between them, which are named by its values.
///
/// # Errors
/// What plotters cannot do, in words.
pub fn svg(swept: &str, results: &[(String, Simulation)]) -> Result<String, String> {
    static FONT: Once = Once::new();
    FONT.call_once(|| {
        let font = epaint_default_fonts::UBUNTU_LIGHT;
        // The font is one, since it is part of the program.
        let _ = register_font("sans-serif", FontStyle::Normal, font);
    });
    let mut out = String::new();
    {
        let root = SVGBackend::with_string(&mut out, (2 * PANEL.0, PANEL.1)).into_drawing_area();
        let failed = |error: DrawingAreaErrorKind<std::io::Error>| error.to_string();
        root.fill(&WHITE).map_err(failed)?;
        let (left, right) = root.split_horizontally(PANEL.0);
        panel(
            &left,
            [swept, "speed-up over the shader cores"],
            &SPEED,
            results,
        )
        .map_err(failed)?;
        panel(&right, [swept, "mJ a frame"], &ENERGY, results).map_err(failed)?;
        root.present().map_err(failed)?;
    }
    Ok(out)
}

fn panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    [across, up]: [&str; 2],
    curves: &[Curve],
    results: &[(String, Simulation)],
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let values = (curves.iter()).flat_map(|(_, of)| results.iter().map(|(_, result)| of(result)));
    let top = values
        .filter(|value| value.is_finite())
        .fold(1e-9, f64::max)
        * 1.1;
    let last = results.len() as f64 - 1.0;
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(58)
        .build_cartesian_2d(-0.25..last + 0.25, 0.0..top)?;
    let name = |x: &f64| {
        let near = (x - x.round()).abs() < 0.01 && *x > -0.5;
        let result = results.get(x.round().max(0.0) as usize);
        let (_, value) = result
            .filter(|_| near)
            .map(|(name, _)| name.split_once('=').unwrap_or(("", name.as_str())))
            .unwrap_or_default();
        value.to_owned()
    };
    chart
        .configure_mesh()
        .x_labels((2 * results.len()).min(24))
        .x_label_formatter(&name)
        .x_desc(across)
        .y_desc(up)
        .light_line_style(TRANSPARENT)
        .draw()?;
    for ((label, of), color) in curves.iter().zip(COLORS) {
        let place = |(at, (_, result)): (usize, &(String, Simulation))| (at as f64, of(result));
        let curve: Vec<_> = results.iter().enumerate().map(place).collect();
        chart
            .draw_series(LineSeries::new(curve.clone(), color.stroke_width(2)))?
            .label(*label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color));
        let points = curve
            .into_iter()
            .map(|at| Circle::new(at, 3, color.filled()));
        chart.draw_series(points)?;
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .position(SeriesLabelPosition::UpperLeft)
        .draw()
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::config::Config;
    use timing::simulate::{even_frame, simulate};

    #[test]
    fn every_machine_is_a_step_of_every_curve() {
        let frame = even_frame([64, 64], 1000, 0.3);
        let results: Vec<_> = ["saturation=none", "saturation=tile", "saturation=row"]
            .map(|setting| {
                let config = Config::preset("paper-15x16", &[setting.to_owned()]);
                let result = simulate(&frame, &config.expect("a preset"));
                (setting.to_owned(), result)
            })
            .into();
        let svg = svg("saturation", &results).expect("a plot");
        assert_eq!(
            svg.matches("<circle").count(),
            3 * (SPEED.len() + ENERGY.len())
        );
        for word in ["none", "tile", "row", "modules", "whole frame"] {
            assert!(svg.contains(word), "{word}");
        }
    }
}
