//! The data set of a training: its photographs, cameras and settings, found in the folders of the model and of the data.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use gaurast_picture::Background;
use gaurast_scene::Camera;
use gaurast_scene::camera_files::{self, CameraFileOptions};
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::arguments::{EvalArguments, Values};
use super::error::Error;
use super::gsplat_world::Worlds;
use super::split::Split;
use crate::cameras::{self, DEFAULT_SIZE, View};
use crate::cfg_args::CfgArgs;
use crate::photographs::{self, Photographs, SizeRule, stem};
use crate::sources::Source;

/// The background with which nerfstudio's splatfacto evaluates: the grey of its viewer.
const NERFSTUDIO_BACKGROUND: [f32; 3] = [0.1490, 0.1647, 0.2157];

/// The side above which nerfstudio takes smaller photographs, if there are any.
const NERFSTUDIO_MAX_SIDE: f64 = 1600.0;

/// The most names that a message has.
const NAMED: usize = 4;

/// A program that trains models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Trainer {
    Inria,
    Nerfstudio,
    Gsplat,
}

/// A matrix and an offset of colours, row by row, which 3DGS trains for each photograph.
pub type Exposure = [[f32; 4]; 3];

/// A view that is measured.
#[derive(Debug)]
pub struct Measured {
    /// The view, in the size of the comparison.
    pub view: View,
    /// The photograph's path in its folder, without extension.
    pub name: String,
    pub photograph: PathBuf,
    pub mask: Option<PathBuf>,
    pub exposure: Option<Exposure>,
}

/// The measured views and how they are compared.
#[derive(Debug)]
pub struct Dataset {
    pub views: Vec<Measured>,
    pub background: [f32; 3],
    pub values: Values,
    /// True if only the right halves are compared, as 3DGS does if the left ones train exposures.
    pub right_half: bool,
    /// gsplat's worlds, of which the model's is one, if it was trained in a world of its own.
    pub worlds: Option<Worlds>,
    /// The choices that were made, each with its subject.
    pub choices: BTreeMap<&'static str, String>,
    /// Facts that a reader should know, a sentence each.
    pub notes: Vec<String>,
}

/// The folders and files that were found.
struct Found {
    trainer: Option<Trainer>,
    /// The folder that the trainer has written.
    model: PathBuf,
    cfg_args: CfgArgs,
    /// The folder of the data set.
    data: PathBuf,
    /// The lines of gsplat's cfg.yml.
    cfg_yml: BTreeMap<String, String>,
}

/// The parts of a transforms.json that list views.
#[derive(Default, Deserialize)]
struct Lists {
    test_filenames: Option<Vec<String>>,
    val_filenames: Option<Vec<String>>,
    #[serde(default)]
    frames: Vec<ListedFrame>,
}

/// A view of a transforms.json.
#[derive(Deserialize)]
struct ListedFrame {
    mask_path: Option<IgnoredAny>,
}

impl Lists {
    /// The lists of the file `path`, whose form the reader of cameras has checked.
    fn of(path: &Path) -> Self {
        std::fs::read_to_string(path).ok().and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
    }

    /// Returns true if a view has a mask.
    fn has_masks(&self) -> bool {
        self.frames.iter().any(|frame| frame.mask_path.is_some())
    }
}

/// Finds the views that `arguments` ask for.
///
/// # Errors
/// If a part is missing, or the parts do not fit.
pub fn find(arguments: &EvalArguments, source: &Source) -> Result<Dataset, Error> {
    let found = Found::of(arguments)?;
    let mut notes = source.notes.clone();
    let mut choices = BTreeMap::new();
    let cameras_path = found.cameras(arguments, source)?;
    let is_transforms = file_name(&cameras_path).starts_with("transforms");
    let dataparser = arguments.dataparser.clone().or_else(|| source.dataparser.clone().filter(|_| is_transforms));
    if let Some(path) = &dataparser {
        notes.push(format!("the cameras are taken to the model by {}", path.display()));
    }
    let options = CameraFileOptions { size: DEFAULT_SIZE, dataparser, undistorted: arguments.undistorted };
    let file = camera_files::read(&cameras_path, &options)?;
    notes.extend(file.ignored);
    choices.insert("cameras", cameras_path.display().to_string());
    let worlds = if found.is_normalized() {
        let cameras: Vec<Camera> = file.views.iter().map(|view| view.camera.clone()).collect();
        let worlds = Worlds::new(&cameras, &camera_files::colmap_points(&cameras_path)?);
        Some(worlds.ok_or_else(|| Error::NoPoints { path: cameras_path.clone() })?)
    } else {
        None
    };

    let folder = found.photographs(arguments, &cameras_path)?;
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| Error::Io { path, source }
    };
    let photographs = Photographs::of(&folder).map_err(io(&folder))?;
    if photographs.is_empty() {
        return Err(Error::NoPhotographs { folder });
    }
    choices.insert("photographs", folder.display().to_string());
    let masks = match &arguments.masks {
        Some(folder) => Some(Photographs::of(folder).map_err(io(folder))?),
        None => None,
    };
    let masked = match &arguments.masks {
        Some(folder) => format!("{}: black pixels are black in both pictures", folder.display()),
        None => "none".to_owned(),
    };
    choices.insert("masks", masked);
    if arguments.masks.is_none() && found.data.join("masks").is_dir() {
        notes.push(format!("the masks in {} are not used: --masks names them", found.data.join("masks").display()));
    }
    if arguments.masks.is_none() && is_transforms && Lists::of(&cameras_path).has_masks() {
        notes.push(format!("the masks that {} names are not used: --masks does", cameras_path.display()));
    }

    // In the order of the photographs' names; a camera without one has its own.
    let named = |view: camera_files::View| {
        let photograph = photographs.find(&view.name).map(Path::to_owned);
        let key = match &photograph {
            Some(path) => path.strip_prefix(&folder).unwrap_or(path).to_string_lossy().into_owned(),
            None => view.name.clone(),
        };
        (key, photograph, view)
    };
    let mut all: Vec<_> = file.views.into_iter().map(named).collect();
    all.sort_by(|(a, ..), (b, ..)| a.cmp(b));
    let used: Vec<&Path> = all.iter().filter_map(|(_, photograph, _)| photograph.as_deref()).collect();
    let others = photographs.others(&used);
    if !others.is_empty() {
        notes.push(format!("{} without a camera left out: {}", counted(others.len()), listed(&others)));
    }

    let names: Vec<String> = all.iter().map(|(key, ..)| key.clone()).collect();
    let split = match &arguments.split {
        Some(split) => split.clone().read().map_err(|(path, source)| Error::Io { path, source })?,
        None => found.split(&cameras_path),
    };
    let chosen = split
        .choose(&names)
        .map_err(|missing| Error::NoViews { names: listed(&missing), cameras: cameras_path.clone() })?;
    if chosen.is_empty() {
        return Err(Error::Nothing { split: split.describe(), count: names.len() });
    }
    choices.insert("views", format!("{} of {}: {}", chosen.len(), names.len(), split.describe()));

    let rule = found.size_rule(arguments);
    choices.insert("sizes", rule.describe());
    let exposures = found.exposures()?;
    if found.has_exposures() {
        choices.insert("exposures", "those of exposure.json; the right halves are compared, as 3DGS does".to_owned());
    }
    let missing: Vec<String> = chosen.iter().filter(|at| all[**at].1.is_none()).map(|at| all[*at].0.clone()).collect();
    if !missing.is_empty() {
        return Err(Error::MissingPhotographs { count: counted(missing.len()), names: listed(&missing), folder });
    }
    let mut views = Vec::new();
    for (at, (key, photograph, view)) in all.into_iter().enumerate() {
        let Some(photograph) = photograph.filter(|_| chosen.contains(&at)) else {
            continue;
        };
        let size = imagesize::size(&photograph)
            .map_err(|error| Error::Size { path: photograph.clone(), reason: error.to_string() })?;
        let size = [size.width, size.height].map(|side| side as u32);
        let camera = &view.camera;
        let stretch = f64::from(size[0]) / f64::from(size[1]) * f64::from(camera.height) / f64::from(camera.width);
        if (stretch - 1.0).abs() > MAX_STRETCH {
            let of_camera = [camera.width, camera.height];
            return Err(Error::Shape { path: photograph, size, of_camera });
        }
        let mask = match &masks {
            Some(masks) => {
                Some(masks.find(&key).or_else(|| masks.find(&stem(&key))).map(Path::to_owned).ok_or_else(|| {
                    Error::NoMask { name: key.clone(), folder: arguments.masks.clone().unwrap_or_default() }
                })?)
            }
            None => None,
        };
        let exposure = exposures.get(&stem(photographs::file_name(&key))).copied();
        let camera = camera.resized(rule.of(size));
        let view = View { name: Some(view.name), camera };
        views.push(Measured { view, name: stem(&key), photograph, mask, exposure });
    }
    let values = arguments.values.unwrap_or(match found.trainer {
        Some(Trainer::Gsplat | Trainer::Nerfstudio) => Values::Float,
        Some(Trainer::Inria) | None => Values::EightBits,
    });
    choices.insert("values", values.describe().to_owned());
    let background = found.background(arguments, source);
    if let Some(lenses) = cameras::lenses(views.iter().map(|measured| &measured.view.camera)) {
        choices.insert("lenses", lenses);
    }
    choices.insert("background", background.map(|channel| channel.to_string()).join(", "));
    Ok(Dataset { views, background, values, right_half: found.has_exposures(), worlds, choices, notes })
}

/// The most that the shapes of a photograph and of its camera's picture may differ: photographs of a quarter of the size are
/// rounded.
const MAX_STRETCH: f64 = 0.02;

impl Found {
    fn of(arguments: &EvalArguments) -> Result<Self, Error> {
        let model = model_folder(&arguments.model);
        let text = |name: &str| std::fs::read_to_string(model.join(name)).ok();
        let cfg_args = text("cfg_args");
        let is_gsplat = model.join("ply").is_dir() || model.join("ckpts").is_dir();
        let cfg_yml = text("cfg.yml").filter(|_| is_gsplat);
        let holds = |name: &str| model.join(name).is_file();
        let trainer = if cfg_args.is_some() {
            Some(Trainer::Inria)
        } else if cfg_yml.is_some() {
            Some(Trainer::Gsplat)
        } else if holds("config.yml") || holds("dataparser_transforms.json") {
            Some(Trainer::Nerfstudio)
        } else {
            None
        };
        let cfg_args = CfgArgs::parse(&cfg_args.unwrap_or_default());
        let cfg_yml: BTreeMap<String, String> = cfg_yml
            .iter()
            .flat_map(|text| text.lines())
            .filter_map(|line| line.split_once(": "))
            .map(|(name, value)| (name.to_owned(), value.trim().trim_matches(['\'', '"']).to_owned()))
            .collect();
        let told = cfg_args.text("source_path").or(cfg_yml.get("data_dir").map(String::as_str)).map(PathBuf::from);
        let data = match (&arguments.photographs, told) {
            (Some(folder), _) => folder.clone(),
            (None, Some(told)) => {
                let beside = model.join(&told);
                if !told.is_dir() && !beside.is_dir() {
                    return Err(Error::DataGone { model, data: told });
                }
                if told.is_dir() { told } else { beside }
            }
            (None, None) => return Err(Error::NoData { model }),
        };
        if !data.is_dir() {
            let missing = std::io::Error::from(std::io::ErrorKind::NotADirectory);
            return Err(Error::Io { path: data, source: missing });
        }
        Ok(Self { trainer, model, cfg_args, data, cfg_yml })
    }

    /// The file or folder of the cameras.
    fn cameras(&self, arguments: &EvalArguments, source: &Source) -> Result<PathBuf, Error> {
        if let Some(path) = &arguments.cameras {
            return Ok(path.clone());
        }
        let there = |names: &[&str]| names.iter().map(|name| self.data.join(name)).find(|path| path.is_file());
        let test = there(&["transforms_test.json"]);
        // 3DGS's list has the cameras as they were trained.
        let own = source.cameras.clone().filter(|_| self.trainer == Some(Trainer::Inria));
        let colmap = ["", "sparse/0", "sparse", "colmap/sparse/0"]
            .iter()
            .map(|inner| self.data.join(inner))
            .find(|path| ["cameras.bin", "cameras.txt"].iter().any(|name| path.join(name).is_file()));
        let found = test.or(own).or_else(|| there(&["transforms.json"])).or(colmap);
        found.or_else(|| source.cameras.clone()).ok_or_else(|| Error::NoCameras { data: self.data.clone() })
    }

    /// The folder of the photographs.
    fn photographs(&self, arguments: &EvalArguments, cameras: &Path) -> Result<PathBuf, Error> {
        let named = |name: &str| {
            let path = self.data.join(name);
            if path.is_dir() { Ok(path) } else { Err(Error::NoPhotographs { folder: path }) }
        };
        let is_there = |name: &str| self.data.join(name).is_dir();
        if let Some(name) = &arguments.images {
            return named(name);
        }
        if file_name(cameras) == "transforms_test.json" && is_there("test") {
            return named("test");
        }
        if !is_there("images") && self.cfg_args.text("images").is_none_or(|name| !is_there(name)) {
            return Ok(self.data.clone());
        }
        match self.trainer {
            Some(Trainer::Inria) => named(self.cfg_args.text("images").unwrap_or("images")),
            Some(Trainer::Gsplat) => match self.cfg_yml.get("data_factor").map_or("1", String::as_str) {
                "1" => named("images"),
                // gsplat makes PNG files of JPEG ones, which it trains with.
                factor if is_there(&format!("images_{factor}_png")) => named(&format!("images_{factor}_png")),
                factor => named(&format!("images_{factor}")),
            },
            Some(Trainer::Nerfstudio) => named(&self.images_of_nerfstudio()),
            None => named("images"),
        }
    }

    /// The folder that nerfstudio chooses: half the size until the larger side is at most 1600, as far as there are folders.
    fn images_of_nerfstudio(&self) -> String {
        let folder = |factor: u32| if factor == 1 { "images".to_owned() } else { format!("images_{factor}") };
        let first = self
            .data
            .join("images")
            .read_dir()
            .ok()
            .and_then(|entries| entries.flatten().find_map(|entry| imagesize::size(entry.path()).ok()));
        let side = first.map_or(0.0, |size| size.width.max(size.height) as f64);
        let mut factor = 1;
        while side / f64::from(factor) > NERFSTUDIO_MAX_SIDE && self.data.join(folder(2 * factor)).is_dir() {
            factor *= 2;
        }
        folder(factor)
    }

    /// The split with which the trainer evaluates.
    fn split(&self, cameras: &Path) -> Split {
        if file_name(cameras) == "transforms_test.json" {
            return Split::All;
        }
        let is_transforms = file_name(cameras).starts_with("transforms");
        match self.trainer {
            Some(Trainer::Inria) if self.cfg_args.flag("eval") == Some(false) => Split::All,
            Some(Trainer::Gsplat) => {
                Split::Every(self.cfg_yml.get("test_every").and_then(|n| n.parse().ok()).unwrap_or(8))
            }
            _ if is_transforms => {
                let Lists { test_filenames, val_filenames, .. } = Lists::of(cameras);
                match test_filenames.or(val_filenames) {
                    Some(names) => Split::Names {
                        names: names.iter().map(|name| stem(name)).collect(),
                        from: cameras.display().to_string(),
                    },
                    None => Split::of_nerfstudio(),
                }
            }
            _ => Split::Every(8),
        }
    }

    /// Returns true if gsplat has moved the cameras to a world of its own.
    fn is_normalized(&self) -> bool {
        let is_told = |value: &String| value == "true";
        self.trainer == Some(Trainer::Gsplat) && self.cfg_yml.get("normalize_world_space").is_none_or(is_told)
    }

    fn size_rule(&self, arguments: &EvalArguments) -> SizeRule {
        match (arguments.scale, self.trainer) {
            (Some(divisor), _) => SizeRule::Divided(divisor),
            (None, Some(Trainer::Inria)) => {
                SizeRule::Inria { resolution: self.cfg_args.number("resolution").unwrap_or(-1.0) }
            }
            (None, _) => SizeRule::Own,
        }
    }

    fn background(&self, arguments: &EvalArguments, source: &Source) -> [f32; 3] {
        let trained = source.background.map(Background::color);
        let of_trainer = match self.trainer {
            Some(Trainer::Nerfstudio) => NERFSTUDIO_BACKGROUND,
            _ => [0.0; 3],
        };
        arguments.background.map(Background::color).or(trained).unwrap_or(of_trainer)
    }

    /// Returns true if the pictures are compared with trained exposures.
    fn has_exposures(&self) -> bool {
        self.cfg_args.flag("train_test_exp") == Some(true) && self.model.join("exposure.json").is_file()
    }

    fn exposures(&self) -> Result<BTreeMap<String, Exposure>, Error> {
        if !self.has_exposures() {
            return Ok(BTreeMap::new());
        }
        let path = self.model.join("exposure.json");
        let text = std::fs::read_to_string(&path).map_err(|source| Error::Io { path: path.clone(), source })?;
        let exposures: BTreeMap<String, Exposure> =
            serde_json::from_str(&text).map_err(|source| Error::Json { path, source })?;
        Ok(exposures.into_iter().map(|(name, exposure)| (stem(&name), exposure)).collect())
    }
}

/// The folder that a trainer has written: `model`, or that in which the file lies, up to three folders above.
fn model_folder(model: &Path) -> PathBuf {
    let known = ["cfg_args", "cfg.yml", "config.yml", "dataparser_transforms.json"];
    let is_of_trainer = |folder: &&Path| known.iter().any(|name| folder.join(name).is_file());
    let first = if model.is_dir() { model } else { gaurast_picture::folder(model) };
    first.ancestors().take(3).find(is_of_trainer).unwrap_or(first).to_owned()
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A number of photographs in words.
fn counted(photographs: usize) -> String {
    if photographs == 1 { "1 photograph".to_owned() } else { format!("{photographs} photographs") }
}

/// Some of the names, and the number of the others.
fn listed(names: &[String]) -> String {
    let mut shown: Vec<String> = names.iter().take(NAMED).cloned().collect();
    if names.len() > NAMED {
        shown.push(format!("and {} more", names.len() - NAMED));
    }
    shown.join(", ")
}
