//! What a rendering did, as a table.

use std::time::Duration;

use ash::vk::PerformanceCounterUnitKHR as Unit;
use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};
use gaurast_render::{Counter, Frame};
use gaurast_scene::Scene;

/// The table: what the host knows, then everything that the device counted, in its groups.
pub fn table(scene: &Scene, loading: Duration, frame: &Frame) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    let mut row = {
        let mut last = String::new();
        let table = &mut table;
        move |group: &str, name: &str, value: String| {
            // A group's name stands in its first row.
            let shown = if group == last { "" } else { group };
            table.add_row([shown, name, &value]);
            group.clone_into(&mut last);
        }
    };
    let picture = &frame.picture;
    row(
        "picture",
        "size",
        format!("{} x {}", picture.width, picture.height),
    );
    row("scene", "Gaussians", grouped(scene.len() as f64));
    row("scene", "SH degree", scene.sh_degree().to_string());
    for counter in &frame.counters {
        row(&counter.category, &counter.name, value(counter));
    }
    row(
        "host time",
        "load",
        milliseconds(loading.as_secs_f64() * 1e3),
    );
    row(
        "host time",
        "render",
        milliseconds(frame.time.as_secs_f64() * 1e3),
    );
    if let Some(column) = table.column_mut(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
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
        _ if counter.value.fract() == 0.0 => grouped(counter.value),
        _ => format!("{:.3}", counter.value),
    }
}

fn milliseconds(value: f64) -> String {
    format!("{value:.2} ms")
}

/// A whole number with a space between groups of three digits.
fn grouped(value: f64) -> String {
    let digits = format!("{:.0}", value.abs());
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    if value < 0.0 {
        format!("-{text}")
    } else {
        text
    }
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
    fn the_table_shows_every_counter() {
        let frame = Frame {
            picture: gaurast_picture::Picture {
                width: 2,
                height: 1,
                pixels: vec![[0.0; 4]; 2],
            },
            time: Duration::from_millis(5),
            processor_time: None,
            counters: vec![counter(Unit::GENERIC, 4321.0)],
        };
        let text = table(&Scene::default(), Duration::ZERO, &frame).to_string();
        for part in ["2 x 1", "tile pairs", "4 321", "5.00 ms"] {
            assert!(text.contains(part), "{text}");
        }
    }
}
