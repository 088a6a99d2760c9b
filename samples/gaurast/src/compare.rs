//! `gaurast compare`: the difference of pictures.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use gaurast_picture::{Background, OutputError, Picture, PictureFormat, ReadError, Size};
use serde_json::json;
use thiserror::Error;

use crate::args::{CameraArguments, ModeArguments, SceneArguments};
use crate::cameras::{self, View, ViewError};
use crate::compliance;
use crate::drawing::{self, DrawError, Drawing};
use crate::measures::{Means, Measures, difference, in_eight_bits, shown};
use crate::progress::Progress;
use crate::report::write_json;
use crate::sources::{Source, SourceError, stem};

/// A failure of the comparison. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    View(#[from] ViewError),
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error("{}: {a}, but {}: {b}: pictures of one size are compared", path.display(), other.display())]
    Size { path: PathBuf, a: String, other: PathBuf, b: String },
    #[error("{}: there is no picture called {name} here, as in {}", folder.display(), other.display())]
    Missing { folder: PathBuf, other: PathBuf, name: String },
    #[error("{}: there is no picture in the folder", folder.display())]
    NoPicture { folder: PathBuf },
    #[error("{}: a folder of pictures is compared with another one", folder.display())]
    Folder { folder: PathBuf },
    #[error("a picture is compared with one view of a scene, and {0} are asked for")]
    Views(usize),
    #[error("--difference {}: it is there already: --force replaces it", path.display())]
    There { path: PathBuf },
    #[error("{name}: the PSNR of {psnr:.2} dB is below {limit}")]
    Below { name: String, psnr: f64, limit: f64 },
    #[error(transparent)]
    Compliance(#[from] compliance::Error),
    #[error("a picture is compared with another one, or with a scene")]
    Nothing,
    #[error("output: {0}")]
    Stdout(std::io::Error),
}

impl Error {
    /// Returns true if the command line is invalid.
    pub fn is_misuse(&self) -> bool {
        matches!(self, Self::View(error) if error.is_misuse())
    }
}

/// The arguments of `gaurast compare`.
#[derive(Args)]
#[command(
    after_help = "PSNR is over red, green and blue, the peak being 1; SSIM is as 3DGS's own evaluation computes \
    it; FLIP is the mean error of the LDR evaluator, 0 to 1. Colours are compared as they are shown, over the background. \
    Folders are compared file by file, by their names without extensions. The PSNR of equal pictures is infinite, and so is a \
    mean with one of them; JSON has null for it, and says how many pictures are equal. JSON also has torchmetrics' SSIM, \
    which reflects the picture at its border, and pytorch-msssim's, which leaves the border out."
)]
pub struct CompareArguments {
    /// A picture, or a folder of pictures: .png, .jpg, .webp, .ppm or .exr
    pub a: PathBuf,

    /// The reference: a picture, a folder of pictures, or a scene, which is drawn
    #[arg(required_unless_present = "compliance")]
    pub b: Option<PathBuf>,

    /// Compare a renderer's pictures of the cases in FOLDER, such as tests/compliance, with the exact ones
    ///
    /// FOLDER has a manifest.json with scenes, cameras and clauses; A is a folder of pictures that are named after its cases.
    /// A table by clause is printed. The exit code is 1 if a normative picture differs.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["b", "difference", "fail_below", "background"])]
    pub compliance: Option<PathBuf>,

    #[command(flatten)]
    pub camera: CameraArguments,

    #[command(flatten)]
    pub modes: ModeArguments,

    /// The background of the scene and of transparent pictures
    #[arg(long, value_name = "COLOUR")]
    pub background: Option<Background>,

    /// Write the absolute differences as a picture, scaled so that the largest is white; a folder if folders are
    /// compared
    #[arg(long, value_name = "FILE")]
    pub difference: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    pub force: bool,

    /// Fail if a picture's PSNR is below this
    #[arg(long, value_name = "DB")]
    pub fail_below: Option<f64>,

    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Two pictures to compare.
struct Pair {
    name: String,
    a: Picture,
    b: Picture,
    /// The file for their difference.
    difference: Option<PathBuf>,
}

/// The result of comparing two pictures.
struct Compared {
    name: String,
    measures: Measures,
}

/// Compares and prints the results.
pub fn run(arguments: &CompareArguments) -> Result<(), Error> {
    let mut compared = Vec::new();
    let b = match (&arguments.b, &arguments.compliance) {
        (Some(b), _) => b,
        (None, Some(cases)) => {
            let theirs = pictures(&arguments.a)?;
            return Ok(compliance::run(cases, &arguments.a, &theirs, arguments.json, arguments.quiet)?);
        }
        (None, None) => return Err(Error::Nothing),
    };
    if arguments.a.is_dir() {
        for (name, a, b) in pairs(&arguments.a, b)? {
            let difference = arguments.difference.as_ref().map(|folder| folder.join(format!("{name}.png")));
            if let Some(path) = &difference {
                let folder = gaurast_picture::folder(path);
                std::fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.to_owned(), source })?;
            }
            let pair = Pair { a: gaurast_picture::read(&a)?, b: gaurast_picture::read(&b)?, name, difference };
            check_sizes(&pair.a, &a, &pair.b, &b)?;
            compared.push(compare(pair, arguments)?);
        }
    } else {
        let a = gaurast_picture::read(&arguments.a)?;
        let is_picture = PictureFormat::of(b).is_ok();
        let second = if is_picture {
            gaurast_picture::read(b)?
        } else {
            let drawn = draw(arguments, b, [a.width, a.height])?;
            let floats = matches!(PictureFormat::of(&arguments.a), Ok(PictureFormat::Exr));
            if floats { drawn } else { in_eight_bits(drawn) }
        };
        check_sizes(&a, &arguments.a, &second, b)?;
        let name = arguments.a.display().to_string();
        let pair = Pair { name, a, b: second, difference: arguments.difference.clone() };
        compared.push(compare(pair, arguments)?);
    }
    if !arguments.quiet || arguments.json {
        print(arguments, &compared).map_err(Error::Stdout)?;
    }
    if let Some(limit) = arguments.fail_below
        && let Some(worst) = compared.iter().find(|one| one.measures.decibels() < limit)
    {
        return Err(Error::Below { name: worst.name.clone(), psnr: worst.measures.decibels(), limit });
    }
    Ok(())
}

/// Checks that two pictures have the same size.
pub fn check_sizes(a: &Picture, path: &Path, b: &Picture, other: &Path) -> Result<(), Error> {
    if (a.width, a.height) == (b.width, b.height) {
        return Ok(());
    }
    Err(Error::Size {
        path: path.to_owned(),
        a: format!("{}x{}", a.width, a.height),
        other: other.to_owned(),
        b: format!("{}x{}", b.width, b.height),
    })
}

fn compare(pair: Pair, arguments: &CompareArguments) -> Result<Compared, Error> {
    let behind = arguments.background.map_or([0.0; 3], Background::color);
    let (a, b) = (shown(pair.a, behind), shown(pair.b, behind));
    let measures = Measures::of(&a, &b);
    if let Some(path) = &pair.difference {
        if path.is_file() && !arguments.force {
            return Err(Error::There { path: path.clone() });
        }
        gaurast_picture::write(path, &difference(&a, &b, measures.largest), None)?;
    }
    Ok(Compared { name: pair.name, measures })
}

/// Draws the scene at `path` for a picture of `size`.
fn draw(arguments: &CompareArguments, path: &Path, size: [u32; 2]) -> Result<Picture, Error> {
    let progress = Progress { quiet: arguments.quiet || arguments.json };
    let source = Source::of(&SceneArguments { scenes: vec![path.to_owned()], ..SceneArguments::default() })?;
    let camera = CameraArguments {
        size: Some(arguments.camera.size.unwrap_or(Size(size))),
        ..arguments.modes.cameras(&arguments.camera)
    };
    let mut known = cameras::read(&camera, &source)?;
    let (mut scene, _) = source.load(progress)?;
    known.crop(&mut scene);
    let trained = known.background().or(source.background);
    let views = cameras::of_scene(known, &camera, &scene, false)?.views;
    if !arguments.quiet && !arguments.json {
        for note in drawing::notes(&arguments.modes, &scene, scene.sh_degree()) {
            eprintln!("gaurast: {note}");
        }
    }
    let [view]: [View; 1] = views.try_into().map_err(|views: Vec<View>| Error::Views(views.len()))?;
    let settings = drawing::settings(&arguments.modes, &scene, [&view.camera]);
    let mut drawing = Drawing::new(scene.into(), settings, arguments.modes.device.as_deref(), false, None)?;
    let frame = drawing.frame(&view)?;
    let background = arguments.background.or(trained);
    Ok(frame.picture.over(background.map_or([0.0; 3], Background::color)))
}

/// The pictures in a folder, by name without extension.
fn pictures(folder: &Path) -> Result<BTreeMap<String, PathBuf>, Error> {
    let io = |source| Error::Io { path: folder.to_owned(), source };
    let mut found = BTreeMap::new();
    for entry in folder.read_dir().map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.is_file() && PictureFormat::of(&path).is_ok() {
            found.insert(stem(&path), path);
        }
    }
    if found.is_empty() {
        return Err(Error::NoPicture { folder: folder.to_owned() });
    }
    Ok(found)
}

/// The names that both folders have, each with both files.
pub fn pairs(a: &Path, b: &Path) -> Result<Vec<(String, PathBuf, PathBuf)>, Error> {
    if !b.is_dir() {
        return Err(Error::Folder { folder: a.to_owned() });
    }
    let (first, mut second) = (pictures(a)?, pictures(b)?);
    let missing = |folder: &Path, other: &Path, name: &str| Error::Missing {
        folder: folder.to_owned(),
        other: other.to_owned(),
        name: name.to_owned(),
    };
    let mut pairs = Vec::new();
    for (name, path) in first {
        let other = second.remove(&name).ok_or_else(|| missing(b, a, &name))?;
        pairs.push((name, path, other));
    }
    match second.keys().next() {
        Some(name) => Err(missing(a, b, name)),
        None => Ok(pairs),
    }
}

fn print(arguments: &CompareArguments, compared: &[Compared]) -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    let means = Means::of(compared.iter().map(|one| &one.measures));
    if arguments.json {
        let one = |one: &Compared| {
            let Measures { psnr, ssim, ssim_torchmetrics, ssim_valid, flip, largest, equal } = one.measures;
            json!({
                "name": one.name,
                "psnr": psnr,
                "ssim": ssim,
                "ssim_torchmetrics": ssim_torchmetrics,
                "ssim_valid": ssim_valid,
                "flip": flip,
                "largest": largest,
                "equal": equal,
            })
        };
        let pictures: Vec<_> = compared.iter().map(one).collect();
        write_json(&mut stdout, &json!({"pictures": pictures, "mean": means}))?;
        return stdout.flush();
    }
    for one in compared {
        let Measures { ssim, flip, largest, .. } = one.measures;
        writeln!(
            stdout,
            "{}: PSNR {:.2} dB, SSIM {ssim:.4}, FLIP {flip:.4}, largest difference {:.1} of 255",
            one.name,
            one.measures.decibels(),
            255.0 * largest
        )?;
    }
    if compared.len() > 1 {
        let (count, psnr) = (compared.len(), means.decibels());
        writeln!(stdout, "mean of {count}: PSNR {psnr:.2} dB, SSIM {:.4}, FLIP {:.4}", means.ssim, means.flip)?;
    }
    stdout.flush()
}
