//! `gaurast info`: the contents of a scene.

use std::io::Write;

use clap::Args;
use gaurast_scene::Subject;
use gaurast_scene::info::{Bar, Info};
use serde_json::json;
use thiserror::Error;

use crate::args::SceneArguments;
use crate::progress::Progress;
use crate::report::{grouped, write_json};
use crate::sources::{Source, SourceError, axes_and_reason};

/// The number of characters of the longest bar.
const BAR: usize = 40;

/// A failure to read the scene. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error("output: {0}")]
    Stdout(#[from] std::io::Error),
}

/// The arguments of `gaurast info`.
#[derive(Args)]
pub struct InfoArguments {
    #[command(flatten)]
    pub scene: SceneArguments,

    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,
}

/// Reads the scene and prints its contents.
pub fn run(arguments: &InfoArguments) -> Result<(), Error> {
    let source = Source::of(&arguments.scene)?;
    let progress = Progress { quiet: arguments.json };
    let (scene, _) = source.load(progress)?;
    let (info, subject) = (Info::new(&scene), Subject::of(&scene));
    let extent = subject.extent;
    let mut stdout = std::io::stdout().lock();
    if arguments.json {
        let mut value = serde_json::to_value(&info).map_err(std::io::Error::from)?;
        value["framed"] = json!({
            "object": subject.is_object(),
            "centre": extent.centre,
            "half": extent.half,
        });
        value["files"] = json!(source.files.iter().map(|file| &file.path).collect::<Vec<_>>());
        value["notes"] = json!(source.notes);
        write_json(&mut stdout, &value)?;
    } else {
        let notes = source.notes.iter().chain(&info.metadata.notes);
        stdout.write_all(text(&info, &subject).as_bytes())?;
        for warning in &info.metadata.warnings {
            writeln!(stdout, "warning     {warning}")?;
        }
        for note in notes {
            writeln!(stdout, "note        {note}")?;
        }
    }
    Ok(stdout.flush()?)
}

/// The numbers for people.
fn text(info: &Info, subject: &Subject<'_>) -> String {
    let extent = subject.extent;
    let mut text = String::new();
    let mut line = |name: &str, value: &str| {
        text += &format!("{name:<11} {value}\n");
    };
    line("Gaussians", &grouped(info.gaussians as f64));
    line("SH degree", &info.sh_degree.to_string());
    if info.triangles > 0 {
        line("triangles", &grouped(info.triangles as f64));
    }
    let mebibytes = info.bytes as f64 / f64::from(1 << 20);
    line("memory", &format!("{mebibytes:.1} MiB"));
    if info.non_finite > 0 {
        let count = grouped(info.non_finite as f64);
        line("not finite", &format!("{count}, which are not drawn"));
    }
    if let Some(bounds) = info.bounds {
        let axis = |axis: usize| format!("{:.4} to {:.4}", bounds.min[axis], bounds.max[axis]);
        line("x, y, z", &[axis(0), axis(1), axis(2)].join(", "));
    }
    if info.origin != [0.0; 3] {
        let [x, y, z] = info.origin;
        line("origin", &format!("{x}, {y}, {z} of the positions in memory"));
    }
    if let Some(file_axes) = &info.metadata.axes {
        line("axes", &axes_and_reason(file_axes));
    }
    let [x, y, z] = extent.centre;
    line("middle", &format!("{x:.4}, {y:.4}, {z:.4} of what is opaque"));
    let [x, y, z] = extent.half.map(|half| 2.0 * half);
    line("size", &format!("{x:.4} x {y:.4} x {z:.4} of what is opaque"));
    line("framed", if subject.is_object() { "as an object" } else { "as surroundings, by the size of the middle" });
    let metadata = &info.metadata;
    let said = [
        ("antialiasing", metadata.antialiasing.map(|said| format!("{said:?}"))),
        ("geometry", metadata.geometry.map(|said| format!("{said:?}"))),
        ("colour space", metadata.color_space.map(|said| format!("{said:?}"))),
        ("order", metadata.order.map(|said| format!("{said:?}"))),
    ];
    let said: Vec<String> = (said.into_iter()).filter_map(|(name, value)| Some(format!("{name} {}", value?))).collect();
    let said = if said.is_empty() { "nothing of how it is drawn".to_owned() } else { said.join(", ") };
    line("says", &said);
    for (title, bars) in [("opacity", &info.opacities), ("scale", &info.scales)] {
        text += &histogram(title, bars);
    }
    text
}

/// A line for each bar, without the empty ones at both ends.
fn histogram(title: &str, bars: &[Bar]) -> String {
    let greatest = bars.iter().map(|bar| bar.count).max().unwrap_or(0).max(1);
    let first = bars.iter().position(|bar| bar.count > 0).unwrap_or(0);
    let last = bars.iter().rposition(|bar| bar.count > 0).unwrap_or(0);
    bars[first..=last]
        .iter()
        .enumerate()
        .map(|(index, bar)| {
            let title = if index == 0 { title } else { "" };
            let length = (BAR * bar.count).div_ceil(greatest);
            let line = "#".repeat(length);
            format!("{title:<11} from {:<7} {line:<BAR$} {}\n", bar.from, grouped(bar.count as f64))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_they_are_large() {
        let bars = [(0.0, 0), (0.1, 10), (0.2, 0), (0.3, 40), (0.4, 0)].map(|(from, count)| Bar { from, count });
        let text = histogram("opacity", &bars);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        let length = |line: &str| line.chars().filter(|c| *c == '#').count();
        assert_eq!([length(lines[0]), length(lines[1]), length(lines[2])], [10, 0, 40]);
        assert!(lines[0].starts_with("opacity     from 0.1"), "{}", lines[0]);
    }
}
