//! `gaurast compare --compliance`: pictures of any renderer against a folder of scenes with exact pictures.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};
use gaurast_picture::{Picture, PictureFormat, ReadError};
use serde::{Deserialize, Serialize};
use serde_json::json;
use thiserror::Error;

use crate::report::write_json;

/// The version of manifests that are read.
const VERSION: u32 = 1;

/// Half a step of eight bits.
const HALF_STEP: f64 = 0.5 / 255.0;

/// The greatest slope of sRGB's decoding, by which it widens a step.
const STEEPEST: f64 = 2.4 / 1.055;

/// A failure. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Picture(#[from] ReadError),
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", path.display())]
    Manifest { path: PathBuf, source: serde_json::Error },
    #[error("{}: version {version} is not known", path.display())]
    Version { path: PathBuf, version: u32 },
    #[error("{}: the pictures have other names than the cases, such as {name}", folder.display())]
    NoPicture { folder: PathBuf, name: String },
    #[error("{}: {}x{}, but the picture of the case has {}x{}", path.display(), size[0], size[1], expected[0], expected[1])]
    Size { path: PathBuf, size: [u32; 2], expected: [u32; 2] },
    #[error("{0} of the normative pictures differ or are missing")]
    Failed(usize),
    #[error("output: {0}")]
    Stdout(std::io::Error),
}

/// The force of a case's clause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum Level {
    Normative,
    Recommended,
    Choice,
}

impl Level {
    fn name(self) -> &'static str {
        match self {
            Self::Normative => "normative",
            Self::Recommended => "recommended",
            Self::Choice => "our choice",
        }
    }
}

#[derive(Deserialize)]
struct Manifest {
    version: u32,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    /// The renderer whose rules the picture has.
    #[serde(rename = "as")]
    renderer: String,
    level: Level,
    clause: String,
    scene: PathBuf,
    picture: PathBuf,
    #[serde(rename = "colorSpace")]
    color_space: String,
    tolerance: f64,
    mistake: Option<Mistake>,
}

/// A misreading and the difference of its picture.
#[derive(Deserialize)]
struct Mistake {
    what: String,
    difference: f64,
}

/// The outcome of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Verdict {
    Holds,
    Differs,
    /// There is no picture of the case.
    Missing,
}

/// A case that was compared.
#[derive(Serialize)]
struct Outcome<'a> {
    name: &'a str,
    #[serde(rename = "as")]
    renderer: &'a str,
    level: Level,
    clause: &'a str,
    verdict: Verdict,
    /// The greatest difference of red, green or blue, over black.
    difference: Option<f64>,
    tolerance: f64,
    #[serde(skip)]
    mistake: Option<&'a Mistake>,
}

impl Outcome<'_> {
    fn is_failure(&self) -> bool {
        self.level == Level::Normative && self.verdict != Verdict::Holds
    }
}

/// Compares the pictures of `folder`, by their names, with those of the cases in `cases`, and prints a table by clause.
///
/// # Errors
/// If a file can't be read, or a normative picture differs or is missing. Cases of a renderer's rules in a format of which there
/// is no picture are left out.
pub fn run(
    cases: &Path,
    folder: &Path,
    pictures: &BTreeMap<String, PathBuf>,
    is_json: bool,
    is_quiet: bool,
) -> Result<(), Error> {
    let path = cases.join("manifest.json");
    let text = std::fs::read(&path).map_err(|source| Error::Io { path: path.clone(), source })?;
    let manifest: Manifest =
        serde_json::from_slice(&text).map_err(|source| Error::Manifest { path: path.clone(), source })?;
    if manifest.version != VERSION {
        return Err(Error::Version { path, version: manifest.version });
    }
    let is_drawn = |of: &Case| {
        let is_alike = |case: &Case| case.renderer == of.renderer && case.scene.extension() == of.scene.extension();
        manifest.cases.iter().any(|case| is_alike(case) && pictures.contains_key(&case.name))
    };
    let mut outcomes = Vec::new();
    for case in manifest.cases.iter().filter(|case| is_drawn(case)) {
        outcomes.push(outcome(case, cases, pictures.get(&case.name))?);
    }
    if outcomes.is_empty() {
        let name = manifest.cases.first().map(|case| case.name.clone()).unwrap_or_default();
        return Err(Error::NoPicture { folder: folder.to_owned(), name });
    }
    let failed = outcomes.iter().filter(|outcome| outcome.is_failure()).count();
    if is_json || !is_quiet {
        let mut stdout = std::io::stdout().lock();
        let printed = if is_json {
            write_json(&mut stdout, &json!({"cases": outcomes, "failed": failed}))
        } else {
            stdout.write_all(tables(&outcomes).as_bytes())
        };
        printed.and_then(|()| stdout.flush()).map_err(Error::Stdout)?;
    }
    if failed > 0 { Err(Error::Failed(failed)) } else { Ok(()) }
}

fn outcome<'a>(case: &'a Case, cases: &Path, theirs: Option<&PathBuf>) -> Result<Outcome<'a>, Error> {
    let mut outcome = Outcome {
        name: &case.name,
        renderer: &case.renderer,
        level: case.level,
        clause: &case.clause,
        verdict: Verdict::Missing,
        difference: None,
        tolerance: case.tolerance,
        mistake: case.mistake.as_ref(),
    };
    let Some(path) = theirs else { return Ok(outcome) };
    let expected = gaurast_picture::read(&cases.join(&case.picture))?;
    let picture = gaurast_picture::read(path)?;
    let sizes = [[picture.width, picture.height], [expected.width, expected.height]];
    if sizes[0] != sizes[1] {
        return Err(Error::Size { path: path.clone(), size: sizes[0], expected: sizes[1] });
    }
    let is_linear = case.color_space.starts_with("lin");
    let is_rounded = !matches!(PictureFormat::of(path), Ok(PictureFormat::Exr));
    if is_rounded {
        outcome.tolerance += HALF_STEP * if is_linear { STEEPEST } else { 1.0 };
    }
    let difference = difference(&picture, &expected, is_rounded, is_rounded && is_linear);
    outcome.difference = Some(difference);
    outcome.verdict = if difference <= outcome.tolerance { Verdict::Holds } else { Verdict::Differs };
    Ok(outcome)
}

/// The greatest difference of red, green or blue over black. Colours of a picture that `is_rounded` are at most 1; those that
/// are `shown` as sRGB are taken to linear light.
fn difference(picture: &Picture, expected: &Picture, is_rounded: bool, shown: bool) -> f64 {
    let of_channel = |theirs: f32, expected: f32| {
        let expected = if is_rounded { expected.clamp(0.0, 1.0) } else { expected };
        let theirs = if shown { linear(theirs) } else { f64::from(theirs) };
        let apart = (theirs - f64::from(expected)).abs();
        // A number that is not one is as far away as can be.
        if apart.is_nan() { f64::INFINITY } else { apart }
    };
    let pairs = picture.pixels.iter().zip(&expected.pixels);
    let channels = pairs.flat_map(|(a, b)| (0..3).map(move |channel| (a[channel], b[channel])));
    channels.map(|(theirs, expected)| of_channel(theirs, expected)).fold(0.0, f64::max)
}

/// The linear light of an sRGB value.
fn linear(value: f32) -> f64 {
    let value = f64::from(value);
    if value <= 0.040_45 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
}

/// A table by clause, and a line for each case that differs or is missing.
fn tables(outcomes: &[Outcome<'_>]) -> String {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(["as", "clause", "", "cases", "hold", "differ", "missing", "greatest difference"]);
    let mut groups: BTreeMap<(&str, &str, Level), Vec<&Outcome<'_>>> = BTreeMap::new();
    for outcome in outcomes {
        groups.entry((outcome.renderer, outcome.clause, outcome.level)).or_default().push(outcome);
    }
    for ((renderer, clause, level), group) in &groups {
        let count = |verdict: Verdict| group.iter().filter(|outcome| outcome.verdict == verdict).count().to_string();
        let greatest = group.iter().filter_map(|outcome| outcome.difference).fold(0.0, f64::max);
        table.add_row([
            (*renderer).to_owned(),
            (*clause).to_owned(),
            level.name().to_owned(),
            group.len().to_string(),
            count(Verdict::Holds),
            count(Verdict::Differs),
            count(Verdict::Missing),
            format!("{greatest:.4}"),
        ]);
    }
    for column in 3..8 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let mut text = format!("{table}\n");
    for outcome in outcomes.iter().filter(|outcome| outcome.verdict != Verdict::Holds) {
        text += &line(outcome);
        text.push('\n');
    }
    for level in [Level::Normative, Level::Recommended, Level::Choice] {
        let of_level: Vec<_> = outcomes.iter().filter(|outcome| outcome.level == level).collect();
        let holding = of_level.iter().filter(|outcome| outcome.verdict == Verdict::Holds).count();
        text += &format!("{}: {holding} of {} hold\n", level.name(), of_level.len());
    }
    text
}

/// The sentence about a case that doesn't hold.
fn line(outcome: &Outcome<'_>) -> String {
    let Outcome { name, level, tolerance, .. } = outcome;
    let level = level.name();
    let Some(difference) = outcome.difference else { return format!("{name} ({level}): there is no picture") };
    let hint = outcome.mistake.map_or_else(String::new, |Mistake { what, difference }| {
        format!("; the picture of \"{what}\" is {difference:.4} away")
    });
    format!("{name} ({level}): {difference:.4} away, {tolerance:.4} are granted{hint}")
}
