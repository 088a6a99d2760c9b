//! `gaurast compare-drivers`: the pictures of a program on this driver and on another one.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{self, ExitStatus};

use clap::Args;
use gaurast_picture::{OutputError, Picture, ReadError, Statistics, write_atomically};
use serde::Serialize;
use serde_json::json;
use thiserror::Error;

use crate::compare;
use crate::report::write_json;

/// The folders in which the Vulkan loader looks for drivers' manifests.
const MANIFEST_FOLDERS: [&str; 4] =
    ["/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/etc/vulkan/icd.d"];

/// The shared library of this driver, which `cargo build --release` writes next to the command.
const LIBRARY: &str = "libvulkan_gaurast.so";

/// The text in the program's arguments that stands for the folder of a driver's pictures.
const PLACEHOLDER: &str = "{}";

/// The difference of two neighbouring pixels, in eight-bit colours, that counts as an edge.
const EDGE: f32 = 8.0 / 255.0;

/// A failure of the comparison. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    #[error(
        "{}: the driver's library is not there: `cargo build --release` makes it, and --driver names another manifest",
        path.display()
    )]
    NoLibrary { path: PathBuf },
    #[error(
        "--with {name}: no manifest of such a driver in {}; a path to one ends with .json",
        MANIFEST_FOLDERS.join(", ")
    )]
    NoDriver { name: String },
    #[error("{}: it is not empty: --force writes into it", path.display())]
    NotEmpty { path: PathBuf },
    #[error("{program}: {source}")]
    Start { program: String, source: std::io::Error },
    #[error("{program}: on {driver} it ended with {status}")]
    Failed { program: String, driver: String, status: ExitStatus },
    #[error("{program}: it wrote no picture; see compare-drivers --help for their places and kinds")]
    NoPicture { program: String },
    #[error(transparent)]
    Compare(#[from] compare::Error),
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{name}: the largest difference is {largest:.1} steps of 255, and {limit} are allowed")]
    Above { name: String, largest: f64, limit: f64 },
    #[error("output: {0}")]
    Stdout(std::io::Error),
}

/// The arguments of `gaurast compare-drivers`.
#[derive(Args)]
#[command(
    after_help = "The program runs once on each driver, through the system's Vulkan loader, in a folder of its own under \
    --out: what it writes into its working directory is compared, name by name (.png, .jpg, .webp, .ppm or .exr). Where an \
    argument has {}, that becomes the folder, and the program runs where you are. A pixel lies on an edge where one of its \
    eight neighbours differs from it by 8 steps of 255 or more on either driver. docs/compared-with-lavapipe.md lists what \
    may differ between two conformant drivers."
)]
pub struct CompareDriversArguments {
    /// The other driver: the name of an installed one, such as lavapipe, or its manifest, a .json file
    #[arg(long, value_name = "NAME|ICD.json", default_value = "lavapipe")]
    pub with: String,

    /// This driver's manifest [default: that of the library next to the command]
    #[arg(long, value_name = "ICD.json")]
    pub driver: Option<PathBuf>,

    /// The folder for the pictures, and for a page that shows them side by side
    #[arg(long, value_name = "FOLDER", default_value = "compared-drivers")]
    pub out: PathBuf,

    /// Write into the folder even if it is not empty
    #[arg(long)]
    pub force: bool,

    /// Fail if a picture has a difference of more than this many steps of 255
    #[arg(long, value_name = "STEPS")]
    pub fail_above: Option<f64>,

    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,

    /// The program and its arguments, after --
    #[arg(last = true, required = true, value_name = "COMMAND")]
    pub command: Vec<OsString>,
}

/// A driver on which the program runs.
struct Driver {
    name: String,
    manifest: PathBuf,
    /// The folder for its pictures.
    folder: PathBuf,
}

/// The differences of one picture between the drivers.
#[derive(Serialize)]
struct Compared {
    name: String,
    width: u32,
    height: u32,
    equal: bool,
    /// The number of pixels that differ.
    differing_pixels: usize,
    /// The number of differing pixels that are on an edge.
    differing_on_edges: usize,
    /// The largest difference of a channel, in steps of 255.
    largest: f64,
    /// The PSNR in dB; `None` if the pictures are equal.
    psnr: Option<f64>,
    flip: f64,
}

/// Runs the program on both drivers, compares its pictures, and prints the results.
pub fn run(arguments: &CompareDriversArguments) -> Result<(), Error> {
    prepare(arguments)?;
    // The library's manifest is in this folder while the program runs.
    let temporary = tempfile::tempdir().map_err(|source| Error::Io { path: std::env::temp_dir(), source })?;
    let ours = match &arguments.driver {
        Some(path) => absolute(path)?,
        None => manifest_of_library(temporary.path())?,
    };
    let theirs = installed(&arguments.with)?;
    let other = match theirs.file_stem() {
        Some(stem) if arguments.with.ends_with(".json") => stem.to_string_lossy().into_owned(),
        _ => arguments.with.clone(),
    };
    let driver = |name: &str, manifest: PathBuf| {
        let folder = arguments.out.join(name);
        std::fs::create_dir_all(&folder)
            .and_then(|()| folder.canonicalize())
            .map(|folder| Driver { name: name.to_owned(), manifest, folder })
            .map_err(|source| Error::Io { path: arguments.out.join(name), source })
    };
    let drivers = [driver("gaurast", ours)?, driver(&other, theirs)?];
    for driver in &drivers {
        start(driver, &arguments.command)?;
    }
    let differences = arguments.out.join("differences");
    let shown = arguments.out.join("shown");
    let mut compared = Vec::new();
    for (name, a, b) in pairs(&drivers, &arguments.command)? {
        let pictures = [gaurast_picture::read(&a)?, gaurast_picture::read(&b)?];
        compare::check_sizes(&pictures[0], &a, &pictures[1], &b)?;
        let (one, difference) = compare_pictures(&name, &pictures);
        // Browsers show neither PPM nor EXR files.
        for (driver, picture) in drivers.iter().zip(&pictures) {
            write_picture(&shown.join(format!("{name}-{}.png", driver.name)), picture)?;
        }
        write_picture(&differences.join(format!("{name}.png")), &difference)?;
        compared.push(one);
    }
    let page = arguments.out.join("index.html");
    write_atomically(&page, page_of(&drivers, &compared).as_bytes())
        .map_err(|source| Error::Io { path: page.clone(), source })?;
    print(arguments, &compared, &page).map_err(Error::Stdout)?;
    if let Some(limit) = arguments.fail_above
        && let Some(worst) = compared.iter().find(|one| one.largest > limit)
    {
        return Err(Error::Above { name: worst.name.clone(), largest: worst.largest, limit });
    }
    Ok(())
}

/// The names of the program's pictures, with their paths on both drivers.
fn pairs(drivers: &[Driver; 2], command: &[OsString]) -> Result<Vec<(String, PathBuf, PathBuf)>, Error> {
    compare::pairs(&drivers[0].folder, &drivers[1].folder).map_err(|error| match error {
        compare::Error::NoPicture { .. } => {
            Error::NoPicture { program: command.first().map_or_else(String::new, |it| it.to_string_lossy().into()) }
        }
        other => other.into(),
    })
}

/// Creates the folder. It must be empty, unless `--force` is given.
fn prepare(arguments: &CompareDriversArguments) -> Result<(), Error> {
    let io = |source| Error::Io { path: arguments.out.clone(), source };
    std::fs::create_dir_all(&arguments.out).map_err(io)?;
    if !arguments.force && arguments.out.read_dir().map_err(io)?.next().is_some() {
        return Err(Error::NotEmpty { path: arguments.out.clone() });
    }
    Ok(())
}

fn absolute(path: &Path) -> Result<PathBuf, Error> {
    path.canonicalize().map_err(|source| Error::Io { path: path.to_owned(), source })
}

/// Writes a manifest of the library that is next to this program.
fn manifest_of_library(folder: &Path) -> Result<PathBuf, Error> {
    let beside = std::env::current_exe().map_err(|source| Error::Io { path: PathBuf::from(LIBRARY), source })?;
    let library = beside.with_file_name(LIBRARY);
    if !library.is_file() {
        return Err(Error::NoLibrary { path: library });
    }
    let manifest = folder.join("gaurast_icd.json");
    let text = json!({
        "file_format_version": "1.0.0",
        "ICD": {"library_path": library, "api_version": "1.3.281"},
    });
    std::fs::write(&manifest, text.to_string()).map_err(|source| Error::Io { path: manifest.clone(), source })?;
    Ok(manifest)
}

/// The manifest of the driver `name`: a path to one, or an installed one whose name contains `name`.
fn installed(name: &str) -> Result<PathBuf, Error> {
    if name.ends_with(".json") {
        return absolute(Path::new(name));
    }
    // Mesa's manifests have short names.
    let pattern = match name {
        "lavapipe" => "lvp",
        name => name,
    };
    let mut found: Vec<PathBuf> = MANIFEST_FOLDERS
        .iter()
        .filter_map(|folder| Path::new(folder).read_dir().ok())
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            file.contains(pattern) && file.ends_with(".json")
        })
        .collect();
    found.sort();
    // A manifest for this processor comes before those for others, which Debian installs in the same folder.
    let suits = |path: &&PathBuf| path.to_string_lossy().contains(std::env::consts::ARCH);
    let suitable = found.iter().find(suits).or(found.first());
    suitable.cloned().ok_or_else(|| Error::NoDriver { name: name.to_owned() })
}

/// Runs the program on a driver and waits for its end.
fn start(driver: &Driver, command: &[OsString]) -> Result<(), Error> {
    let has_placeholder = |word: &OsString| word.to_string_lossy().contains(PLACEHOLDER);
    let placed = |word: &OsString| {
        if has_placeholder(word) {
            let folder = driver.folder.to_string_lossy();
            word.to_string_lossy().replace(PLACEHOLDER, &folder).into()
        } else {
            word.clone()
        }
    };
    let program = command.first().cloned().unwrap_or_default();
    let name = program.to_string_lossy().into_owned();
    // A path is relative to the caller's folder; a bare name is searched on the PATH.
    let program = match Path::new(&program) {
        path if path.components().count() > 1 => path.canonicalize().unwrap_or_else(|_| path.into()),
        path => path.to_owned(),
    };
    let words = &command[1.min(command.len())..];
    let mut process = process::Command::new(program);
    process
        .args(words.iter().map(placed))
        .env("VK_DRIVER_FILES", &driver.manifest)
        .env("VK_ICD_FILENAMES", &driver.manifest)
        .env_remove("VK_ADD_DRIVER_FILES")
        // The program's output is not this command's output.
        .stdout(process::Stdio::from(std::io::stderr()));
    if !words.iter().any(has_placeholder) {
        process.current_dir(&driver.folder);
    }
    let status = process.status().map_err(|source| Error::Start { program: name.clone(), source })?;
    if !status.success() {
        return Err(Error::Failed { program: name, driver: driver.name.clone(), status });
    }
    Ok(())
}

/// Compares two pictures of the same size, and makes a picture of their differences, scaled so that the largest is
/// white.
fn compare_pictures(name: &str, [a, b]: &[Picture; 2]) -> (Compared, Picture) {
    let (width, height) = (a.width as usize, a.height as usize);
    let apart = |a: [f32; 4], b: [f32; 4]| {
        let channel = |c: usize| match (a[c], b[c]) {
            // Equal values, also infinities.
            (a, b) if a.to_bits() == b.to_bits() => 0.0,
            (a, b) if a.is_nan() && b.is_nan() => 0.0,
            (a, b) if a.is_nan() || b.is_nan() => f32::INFINITY,
            (a, b) => (a - b).abs(),
        };
        (0..4).map(channel).fold(0.0, f32::max)
    };
    let is_edge = |index: usize| {
        let (x, y) = (index % width, index / width);
        let neighbours = (y.saturating_sub(1)..=(y + 1).min(height - 1))
            .flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |x| y * width + x));
        [a, b]
            .into_iter()
            .any(|picture| (neighbours.clone()).any(|near| apart(picture.pixels[index], picture.pixels[near]) >= EDGE))
    };
    let differences: Vec<f32> = (a.pixels.iter().zip(&b.pixels)).map(|(a, b)| apart(*a, *b)).collect();
    let differing: Vec<usize> = (0..differences.len()).filter(|&index| differences[index] > 0.0).collect();
    let largest = differences.iter().copied().fold(0.0, f32::max);
    let statistics = Statistics::new(&a.pixels, &b.pixels, a.width);
    let scale = 1.0 / largest.max(f32::MIN_POSITIVE);
    let grey = |&difference: &f32| {
        let grey = (difference * scale).min(1.0);
        [grey, grey, grey, 1.0]
    };
    let compared = Compared {
        name: name.to_owned(),
        width: a.width,
        height: a.height,
        equal: differing.is_empty(),
        differing_pixels: differing.len(),
        differing_on_edges: differing.into_iter().filter(|&index| is_edge(index)).count(),
        largest: 255.0 * f64::from(largest),
        psnr: statistics.psnr.is_finite().then_some(statistics.psnr),
        flip: statistics.flip,
    };
    let picture = Picture { pixels: differences.iter().map(grey).collect(), ..*a };
    (compared, picture)
}

fn write_picture(path: &Path, picture: &Picture) -> Result<(), Error> {
    let folder = gaurast_picture::folder(path);
    std::fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.to_owned(), source })?;
    Ok(gaurast_picture::write(path, picture, Some([0.0; 3]))?)
}

/// The sentence about a picture for people.
fn sentence(one: &Compared) -> String {
    if one.equal {
        return "equal".to_owned();
    }
    format!(
        "{} of {} pixels differ, {} of them on edges; largest difference {:.1} of 255, PSNR {}, FLIP {:.4}",
        one.differing_pixels,
        u64::from(one.width) * u64::from(one.height),
        one.differing_on_edges,
        one.largest,
        one.psnr.map_or_else(|| "infinite".to_owned(), |psnr| format!("{psnr:.2} dB")),
        one.flip
    )
}

/// A page that shows the pictures side by side, and their differences.
fn page_of(drivers: &[Driver; 2], compared: &[Compared]) -> String {
    let text = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    let [ours, theirs] = [0, 1].map(|index| text(&drivers[index].name));
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{ours} and {theirs}</title>\n\
         <style>body{{font:16px sans-serif;margin:2em}}figure{{display:inline-block;margin:0 1em 1em 0}}\
         img{{max-width:30vw;image-rendering:pixelated;background:#000}}</style></head><body>\n\
         <h1>{ours} and {theirs}</h1>\n"
    );
    for one in compared {
        let name = text(&one.name);
        let _ = writeln!(page, "<h2>{name}</h2>\n<p>{}</p>", sentence(one));
        let mut figure = |source: String, caption: &str| {
            let _ = writeln!(
                page,
                "<figure><a href=\"{source}\"><img src=\"{source}\" alt=\"{caption}\"></a>\
                 <figcaption>{caption}</figcaption></figure>"
            );
        };
        figure(format!("shown/{name}-{ours}.png"), &ours);
        figure(format!("shown/{name}-{theirs}.png"), &theirs);
        figure(
            format!("differences/{name}.png"),
            if one.equal { "no difference" } else { "difference, the largest being white" },
        );
    }
    page.push_str("</body></html>\n");
    page
}

fn print(arguments: &CompareDriversArguments, compared: &[Compared], page: &Path) -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    if arguments.json {
        let report = json!({"pictures": compared, "page": page});
        write_json(&mut stdout, &report)?;
        return stdout.flush();
    }
    for one in compared {
        writeln!(stdout, "{}: {}", one.name, sentence(one))?;
    }
    writeln!(stdout, "side by side: {}", page.display())?;
    stdout.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(pixel: impl Fn(u32, u32) -> f32) -> Picture {
        let pixels = (0..16)
            .flat_map(|y| (0..16).map(move |x| (x, y)))
            .map(|(x, y)| {
                let grey = pixel(x, y);
                [grey, grey, grey, 1.0]
            })
            .collect();
        Picture { width: 16, height: 16, pixels }
    }

    #[test]
    fn differences_on_edges_are_told_from_others() {
        let square = |x: u32, y: u32| f32::from(u8::from((4..12).contains(&x) && (4..12).contains(&y)));
        let a = picture(square);
        let same = compare_pictures("same", &[a.clone(), a.clone()]).0;
        assert!(same.equal && same.psnr.is_none() && same.largest == 0.0);
        // One pixel of the square's border and one of its inside differ by a step.
        let b = picture(|x, y| match (x, y) {
            (4, 4) => 0.0,
            (8, 8) => 254.0 / 255.0,
            _ => square(x, y),
        });
        let (one, difference) = compare_pictures("apart", &[a, b]);
        assert_eq!((one.differing_pixels, one.differing_on_edges), (2, 1));
        assert!((one.largest - 255.0).abs() < 1e-3);
        assert_eq!(difference.pixels[4 * 16 + 4], [1.0; 4]);
    }
}
