//! `gaurast-bench exact`: hashes of pictures and buffers that are the same on every machine.

use std::path::{Path, PathBuf};

use clap::Args;
use gaurast_exact::{Device, Line, all, stored};
use thiserror::Error;

/// Arguments of the hashes.
#[derive(Args)]
pub struct ExactArguments {
    /// Makes the pictures and buffers of these chapters only
    #[arg(long, value_name = "CHAPTER,CHAPTER", value_delimiter = ',')]
    only: Vec<String>,

    /// Makes every Nth of them only, for slow machines
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,

    /// The SIMD level: `best`, `avx512`, `avx2` or `sse2`
    #[arg(long, value_name = "LEVEL", default_value = "best", value_parser = ["best", "avx512", "avx2", "sse2"])]
    level: String,

    /// The number of worker threads; 0 is one per processor
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: u32,

    /// Compares the lines with those of FILE, by default the stored ones, and prints the others only
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = STORED)]
    check: Option<PathBuf>,
}

/// The stored lines.
const STORED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/stored/exact.tsv");

/// A failure of the hashes.
#[derive(Debug, Error)]
pub enum ExactError {
    #[error(transparent)]
    Device(#[from] gaurast_testkit::OpenError),
    #[error("{}: {error}", path.display())]
    File { path: PathBuf, error: std::io::Error },
    #[error("{}: line {line} is not a hash, a chapter and a name, separated by tabs", path.display())]
    Line { path: PathBuf, line: usize },
    #[error("--only: there is no chapter {0}")]
    NoChapter(String),
    #[error("{0} of {1} cannot be made or differ")]
    Differ(usize, usize),
}

/// Makes pictures and buffers, and prints their lines or compares them.
pub fn run(arguments: &ExactArguments) -> Result<(), ExactError> {
    let cases = all();
    if let Some(unknown) = arguments.only.iter().find(|only| cases.iter().all(|case| case.chapter != **only)) {
        return Err(ExactError::NoChapter(unknown.clone()));
    }
    let expected = arguments.check.as_deref().map(read).transpose()?;
    let device = Device::open(&arguments.level, arguments.threads)?;
    let wanted =
        cases.iter().filter(|case| arguments.only.is_empty() || arguments.only.iter().any(|it| it == case.chapter));
    let (mut made, mut failures) = (0, 0);
    for case in wanted.step_by(arguments.every as usize) {
        made += 1;
        let line = match case.line(&device) {
            Ok(line) => line,
            Err(failure) => {
                eprintln!("{}: {}: {failure}", case.chapter, case.name);
                failures += 1;
                continue;
            }
        };
        match &expected {
            None => println!("{line}"),
            Some(expected) => {
                if !expected.contains(&line) {
                    println!("{line}\t{}", was(expected, &line));
                    failures += 1;
                }
            }
        }
    }
    if failures > 0 {
        return Err(ExactError::Differ(failures, made));
    }
    if expected.is_some() {
        println!("{made} pictures and buffers are the expected ones");
    }
    Ok(())
}

/// The words on a case whose line is not among the expected ones.
fn was(expected: &[Line], line: &Line) -> String {
    let found = expected.iter().find(|other| (&other.chapter, &other.name) == (&line.chapter, &line.name));
    found.map_or_else(|| "is new".to_owned(), |line| format!("was {:016x}", line.hash))
}

/// The lines of a file.
fn read(path: &Path) -> Result<Vec<Line>, ExactError> {
    let failed = |error| ExactError::File { path: path.to_owned(), error };
    let text = std::fs::read_to_string(path).map_err(failed)?;
    stored(&text).map_err(|line| ExactError::Line { path: path.to_owned(), line })
}
