//! A sweep as a picture: speed-ups and energy, each machine a step of the same width.

use timing::simulate::Simulation;
use timing_studies::chart::{self, Chart, Corner, Curve};

/// A panel's size in pixels.
const PANEL: [u32; 2] = [560, 380];

/// Colours of the curves, for eyes of all kinds (Okabe and Ito).
const COLORS: [&str; 3] = ["#0072b2", "#d55e00", "#009e73"];

/// A number of a simulation, and its name.
type Number = (&'static str, fn(&Simulation) -> f64);

const SPEED: [Number; 2] = [
    ("raster stage", |result| result.raster_speedup),
    ("whole frame", |result| result.speedup),
];
const ENERGY: [Number; 3] = [
    ("all", |result| result.energy.total()),
    ("modules", |result| result.energy.modules()),
    ("memory", |result| result.energy.memory),
];

/// An SVG of the machines' results; `swept` names what differs between them, which are named by its values.
pub fn svg(swept: &str, results: &[(String, Simulation)]) -> String {
    chart::svg(&[
        panel([swept, "speed-up over the shader cores"], &SPEED, results),
        panel([swept, "mJ a frame"], &ENERGY, results),
    ])
}

fn panel(axes: [&str; 2], numbers: &[Number], results: &[(String, Simulation)]) -> Chart {
    let value = |name: &str| {
        name.split_once('=')
            .map_or(name, |(_, value)| value)
            .to_owned()
    };
    let curve = |(&(label, of), color): (&Number, &'static str)| Curve {
        label,
        color,
        values: results.iter().map(|(_, result)| of(result)).collect(),
    };
    Chart {
        size: PANEL,
        axes: axes.map(str::to_owned),
        steps: results.iter().map(|(name, _)| value(name)).collect(),
        curves: numbers.iter().zip(COLORS).map(curve).collect(),
        marks: Vec::new(),
        legend: Corner::UpperLeft,
    }
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
        let svg = svg("saturation", &results);
        assert_eq!(
            svg.matches("<circle").count(),
            3 * (SPEED.len() + ENERGY.len())
        );
        for word in ["none", "tile", "row", "modules", "whole frame"] {
            assert!(svg.contains(&format!(">{word}</text>")), "{word}");
        }
    }
}
