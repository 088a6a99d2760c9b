//! The report of a rendering: a line, a table of the device's counters, or JSON.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use ash::vk::PerformanceCounterUnitKHR as Unit;
use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};
use gaurast_render::Counter;
use gaurast_scene::Scene;
use serde_json::json;

use crate::cameras::View;
use crate::drawing::Drawn;
use crate::heatmap::Quantity;
use crate::outputs::Outputs;

/// The contents of a scene, in numbers.
#[derive(Clone, Copy)]
pub struct Contents {
    gaussians: usize,
    sh_degree: u32,
    triangles: usize,
}

impl Contents {
    /// The contents of `scene`, whose file has spherical harmonics of `sh_degree`.
    pub fn of(scene: &Scene, sh_degree: u32) -> Self {
        Self { gaussians: scene.len(), sh_degree, triangles: scene.mesh().triangles() }
    }
}

/// The results of a rendering.
pub struct Summary<'a> {
    pub contents: Contents,
    /// The scene's files; the garden if there is none.
    pub files: &'a [PathBuf],
    pub loading: Duration,
    /// The time of drawing and writing.
    pub drawing: Duration,
    pub views: &'a [View],
    pub drawn: &'a [Drawn],
    /// The number of views whose files existed.
    pub kept: usize,
    pub outputs: &'a Outputs,
    /// The options that give the same view again.
    pub framing: Option<&'a str>,
    pub notes: &'a [String],
    /// The file of the picture of the counts, and the greatest count.
    pub heatmap: Option<(&'a Path, Quantity, f64)>,
    /// True if tables are requested.
    pub stats: bool,
}

impl Summary<'_> {
    /// The report for people.
    pub fn text(&self) -> String {
        let mut text = String::new();
        if self.stats {
            for drawn in self.drawn {
                text += &format!("{}\n", self.table(drawn));
            }
        }
        text += &self.line();
        if let Some(framing) = self.framing {
            text += &format!("; {framing}");
        }
        text.push('\n');
        if let Some((path, quantity, greatest)) = self.heatmap {
            text += &format!("wrote {}: 0 (black) to {greatest:.1} (white) {}\n", path.display(), quantity.unit());
        }
        text
    }

    /// A line with the written files and the time.
    fn line(&self) -> String {
        let kept = match self.kept {
            0 => String::new(),
            kept => format!("; {kept} were there"),
        };
        let (Some(first), Some(last)) = (self.drawn.first(), self.drawn.last()) else {
            return format!("wrote nothing{kept}");
        };
        let places = self.outputs.describe(self.views, first.index, last.index);
        let camera = &self.views[first.index].camera;
        let size = format!("{}x{}", camera.width, camera.height);
        let counted = |count: usize, name: &str| match count {
            1 => format!("1 {name}"),
            count => format!("{} {name}s", grouped(count as f64)),
        };
        let mut contents = counted(self.contents.gaussians, "Gaussian");
        match self.contents.triangles {
            0 => {}
            triangles => contents += &format!(" and {}", counted(triangles, "triangle")),
        }
        let time = if self.drawn.len() == 1 {
            format!("drawn in {}", duration(first.time))
        } else {
            format!("{} pictures in {}", self.drawn.len(), duration(self.drawing))
        };
        format!("wrote {places}: {size}, {contents} read in {}, {time}{kept}", duration(self.loading))
    }

    /// The table of a view: the host's values, then the device's counters in their groups.
    fn table(&self, drawn: &Drawn) -> Table {
        let mut table = Table::new();
        table.load_style(UTF8_FULL_CONDENSED);
        let mut row = {
            let mut last = String::new();
            let table = &mut table;
            move |group: &str, name: &str, value: String| {
                // A group's name is in its first row.
                let shown = if group == last { "" } else { group };
                table.add_row([shown, name, &value]);
                group.clone_into(&mut last);
            }
        };
        let camera = &self.views[drawn.index].camera;
        row("picture", "size", format!("{} x {}", camera.width, camera.height));
        row("scene", "Gaussians", grouped(self.contents.gaussians as f64));
        row("scene", "SH degree", self.contents.sh_degree.to_string());
        for counter in drawn.counters.iter().filter(|counter| counter.value != 0.0) {
            row(&counter.category, &counter.name, value(counter));
        }
        row("host time", "load", duration(self.loading));
        row("host time", "render", duration(drawn.time));
        if let Some(column) = table.column_mut(2) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table
    }

    /// The whole report as JSON.
    pub fn json(&self) -> serde_json::Value {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        let pictures: Vec<_> = (self.drawn.iter())
            .map(|drawn| {
                let view = &self.views[drawn.index];
                let counters: Vec<_> = (drawn.counters.iter())
                    .filter(|counter| counter.value != 0.0)
                    .map(|counter| {
                        json!({
                            "group": counter.category,
                            "name": counter.name,
                            "unit": format!("{:?}", counter.unit).to_lowercase(),
                            "value": counter.value,
                        })
                    })
                    .collect();
                json!({
                    "index": drawn.index,
                    "view": view.name,
                    "files": self.outputs.files(drawn.index, view),
                    "width": view.camera.width,
                    "height": view.camera.height,
                    "camera": view.camera,
                    "milliseconds": milliseconds(drawn.time),
                    "nothing": drawn.nothing,
                    "counters": counters,
                })
            })
            .collect();
        json!({
            "scenes": self.files,
            "gaussians": self.contents.gaussians,
            "sh_degree": self.contents.sh_degree,
            "triangles": self.contents.triangles,
            "load_milliseconds": milliseconds(self.loading),
            "milliseconds": milliseconds(self.drawing),
            "kept": self.kept,
            "framing": self.framing,
            "notes": self.notes,
            "heatmap": self.heatmap.map(|(path, quantity, greatest)| {
                json!({"file": path, "of": quantity.name(), "greatest": greatest})
            }),
            "pictures": pictures,
        })
    }
}

/// Writes a value as indented JSON with a final newline.
pub fn write_json(writer: &mut dyn Write, value: &impl serde::Serialize) -> std::io::Result<()> {
    let text = serde_json::to_string_pretty(value)?;
    writeln!(writer, "{text}")
}

/// A time for people.
pub fn duration(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    if seconds < 1.0 { milliseconds(seconds * 1e3) } else { format!("{seconds:.2} s") }
}

fn value(counter: &Counter) -> String {
    match counter.unit {
        Unit::NANOSECONDS => milliseconds(counter.value * 1e-6),
        Unit::PERCENTAGE => format!("{:.1} %", counter.value),
        Unit::BYTES => format!("{} B", grouped(counter.value)),
        Unit::BYTES_PER_SECOND => format!("{} B/s", grouped(counter.value)),
        Unit::CYCLES => format!("{} cycles", grouped(counter.value)),
        Unit::HERTZ => format!("{} Hz", grouped(counter.value)),
        Unit::WATTS => format!("{:.3} W", counter.value),
        Unit::KELVIN => format!("{:.1} K", counter.value),
        Unit::VOLTS => format!("{:.3} V", counter.value),
        Unit::AMPS => format!("{:.3} A", counter.value),
        _ if counter.value % 1.0 == 0.0 => grouped(counter.value),
        _ => format!("{:.3}", counter.value),
    }
}

fn milliseconds(value: f64) -> String {
    format!("{value:.2} ms")
}

/// An integer with a space between groups of three digits.
pub fn grouped(value: f64) -> String {
    let digits = format!("{:.0}", value.abs());
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    if value < 0.0 { format!("-{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counter(unit: Unit, value: f64) -> Counter {
        Counter {
            category: "raster".to_owned(),
            name: "tile pairs".to_owned(),
            description: String::new(),
            unit,
            value,
        }
    }

    #[test]
    fn values_are_readable() {
        assert_eq!(value(&counter(Unit::GENERIC, 1_234_567.0)), "1 234 567");
        assert_eq!(value(&counter(Unit::GENERIC, 12.0)), "12");
        assert_eq!(value(&counter(Unit::GENERIC, 0.5)), "0.500");
        assert_eq!(value(&counter(Unit::NANOSECONDS, 12_345_678.0)), "12.35 ms");
        assert_eq!(value(&counter(Unit::CYCLES, -1000.0)), "-1 000 cycles");
    }

    #[test]
    fn times_are_readable() {
        assert_eq!(duration(Duration::from_millis(5)), "5.00 ms");
        assert_eq!(duration(Duration::from_millis(12_345)), "12.35 s");
    }
}
