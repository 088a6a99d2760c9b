//! Destinations of pictures: files, numbered files, folders, videos, standard output.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};

use gaurast_picture::{Background, Colors, DepthFormat, DepthMap, Encoding, OutputError, Picture, PictureFormat};
use thiserror::Error;

use crate::args::OutputArguments;
use crate::cameras::View;
use crate::sources::stem;

/// Filters of videos whose chroma has half the resolution, so that sides must be even.
const EVEN: [&str; 4] = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"];

/// Filters of GIF files: a palette of all frames.
const PALETTE: [&str; 2] = ["-filter_complex", "split[a][b];[a]palettegen[p];[b][p]paletteuse"];

/// File extensions of videos, and ffmpeg's arguments for them: its filters, and those of the encoder.
const VIDEOS: [(&str, &[&str], &[&str]); 6] = [
    ("mp4", &EVEN, &["-c:v", "libx264", "-crf", "18", "-movflags", "+faststart"]),
    ("mov", &EVEN, &["-c:v", "libx264", "-crf", "18"]),
    ("mkv", &EVEN, &["-c:v", "libx264", "-crf", "18"]),
    ("webm", &EVEN, &["-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0"]),
    ("gif", &PALETTE, &["-loop", "0"]),
    ("webp", &[], &["-c:v", "libwebp_anim", "-loop", "0", "-quality", "70"]),
];

/// A failure to write pictures. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum WriteError {
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{}: it is there already: --force replaces it, --resume keeps it", path.display())]
    There { path: PathBuf },
    #[error(
        "{}: {views} views do not go to one file: give a pattern such as view_%04d.png, a folder with / at its end, or a \
         video",
        path.display()
    )]
    OneFile { path: PathBuf, views: usize },
    #[error("{}: two outputs are the same file", path.display())]
    Same { path: PathBuf },
    #[error("{}: a pattern has one number, such as %d or %04d", path.display())]
    Pattern { path: PathBuf },
    #[error("{}: JPEG files and videos cannot be transparent", path.display())]
    Transparent { path: PathBuf },
    #[error("{}: depths and linear light are for EXR files, and no output is one", path.display())]
    NoExr { path: PathBuf },
    #[error(
        "{}: videos are made by ffmpeg, and there is none on the PATH; view_%04d.png writes pictures instead",
        path.display()
    )]
    NoFfmpeg { path: PathBuf },
    #[error("{}: ffmpeg: {reason}", path.display())]
    Ffmpeg { path: PathBuf, reason: String },
    #[error("{}: a video has frames of one size, and the views have several: --size gives one", path.display())]
    Sizes { path: PathBuf },
    #[error("{}: a video cannot go on where it stopped, nor be shared: write numbered pictures instead", path.display())]
    Video { path: PathBuf },
    #[error("standard output: {0}")]
    Stdout(std::io::Error),
}

/// A destination of pictures.
#[derive(Clone, Debug, PartialEq)]
enum Place {
    /// A file for one picture.
    File(PathBuf),
    /// A pattern: the number of the view, with a minimum number of digits, between two texts.
    Numbered {
        before: String,
        digits: usize,
        after: String,
    },
    /// A folder for PNG files named after the views.
    Folder(PathBuf),
    Video(PathBuf),
    Stdout,
}

impl Place {
    /// The place of the pictures of `views` views.
    fn of(path: &Path, views: usize) -> Result<Self, WriteError> {
        let text = path.to_string_lossy();
        if text == "-" {
            return Ok(Self::Stdout);
        }
        if let Some(folder) = Self::of_folder(path) {
            return Ok(folder);
        }
        let format = PictureFormat::of(path);
        // A file that may have one picture is animated if there are several.
        if video_options(path).is_some() && (format.is_err() || views > 1 && !text.contains('%')) {
            return Ok(Self::Video(path.to_owned()));
        }
        format?;
        Self::of_files(path)
    }

    /// The place of depths.
    fn of_depths(path: &Path) -> Result<Self, WriteError> {
        if let Some(folder) = Self::of_folder(path) {
            return Ok(folder);
        }
        DepthFormat::of(path)?;
        Self::of_files(path)
    }

    /// The folder `path`, if it is one.
    fn of_folder(path: &Path) -> Option<Self> {
        let is_folder = path.to_string_lossy().ends_with('/') || path.is_dir();
        is_folder.then(|| Self::Folder(path.to_owned()))
    }

    /// The file `path`, or the files of its pattern.
    fn of_files(path: &Path) -> Result<Self, WriteError> {
        let text = path.to_string_lossy();
        let Some((before, rest)) = text.split_once('%') else {
            return Ok(Self::File(path.to_owned()));
        };
        let wrong = || WriteError::Pattern { path: path.to_owned() };
        let (digits, after) = rest.split_once('d').ok_or_else(wrong)?;
        let digits = match digits.strip_prefix('0') {
            Some(digits) => digits.parse().ok().filter(|digits| *digits < 20),
            None => digits.is_empty().then_some(1),
        };
        if after.contains('%') {
            return Err(wrong());
        }
        Ok(Self::Numbered { before: before.to_owned(), digits: digits.ok_or_else(wrong)?, after: after.to_owned() })
    }

    /// The file of view `index`, if each view has one.
    fn file(&self, index: usize, view: &View) -> Option<PathBuf> {
        match self {
            Self::File(path) => Some(path.clone()),
            Self::Numbered { before, digits, after } => Some(format!("{before}{index:0digits$}{after}").into()),
            Self::Folder(folder) => {
                let name = match &view.name {
                    Some(name) => stem(Path::new(name)),
                    None => format!("{index:05}"),
                };
                Some(folder.join(name + ".png"))
            }
            Self::Video(_) | Self::Stdout => None,
        }
    }
}

/// ffmpeg's arguments for a video: its filters, and then those of the encoder.
fn video_options(path: &Path) -> Option<[&'static [&'static str]; 2]> {
    let extension = path.extension()?.to_string_lossy().to_lowercase();
    let video = VIDEOS.iter().find(|(name, ..)| *name == extension);
    video.map(|(_, filters, options)| [*filters, *options])
}

/// The destinations of all pictures, checked before anything is drawn.
pub struct Outputs {
    places: Vec<Place>,
    depth_places: Vec<Place>,
    /// The unit of depths in PNG files.
    depth_step: f64,
    /// True if the command line names no place. The default one is replaced without asking.
    is_default: bool,
    background: Option<Background>,
    quality: u8,
    linear: bool,
    colors: Colors,
    fps: f64,
    raw: bool,
}

/// The encoder and its input.
struct Video {
    path: PathBuf,
    /// The file that ffmpeg writes; it is renamed to `path` when it is complete.
    temporary: PathBuf,
    child: Child,
    input: ChildStdin,
}

/// Writes pictures in the order of their views.
pub struct Writer<'a> {
    outputs: &'a Outputs,
    videos: Vec<Video>,
}

/// A picture that is ready to be written.
pub struct Finished<'a> {
    pub index: usize,
    pub view: &'a View,
    pub picture: Picture,
    pub depth: Option<Vec<[f32; 2]>>,
}

impl Outputs {
    /// The destinations in `arguments`, or `default`, of the pictures of `views` views; nothing is written yet.
    ///
    /// # Errors
    /// Errors that can be found before there are pictures.
    pub fn new(
        arguments: &OutputArguments,
        default: &str,
        trained: Option<Background>,
        views: usize,
    ) -> Result<Self, WriteError> {
        let default = [PathBuf::from(format!("{default}.png"))];
        let paths = if arguments.output.is_empty() { &default[..] } else { &arguments.output };
        let outputs = Self {
            places: paths.iter().map(|path| Place::of(path, views)).collect::<Result<_, _>>()?,
            depth_places: arguments.depth_output.iter().map(|path| Place::of_depths(path)).collect::<Result<_, _>>()?,
            depth_step: arguments.depth_step,
            is_default: arguments.output.is_empty(),
            background: arguments.background.or(trained),
            quality: arguments.quality,
            linear: arguments.linear,
            colors: Colors::Srgb,
            fps: arguments.fps,
            raw: arguments.raw,
        };
        let exr = |path: &PathBuf| matches!(PictureFormat::of(path), Ok(PictureFormat::Exr));
        if (arguments.depth || arguments.linear) && !paths.iter().any(exr) {
            return Err(WriteError::NoExr { path: paths[0].clone() });
        }
        for (path, place) in paths.iter().chain(&arguments.depth_output).zip(outputs.all_places()) {
            match place {
                Place::File(_) | Place::Video(_) => gaurast_picture::check_place(path)?,
                Place::Numbered { before, .. } => {
                    gaurast_picture::check_place(Path::new(&format!("{before}0")))?;
                }
                Place::Folder(_) | Place::Stdout => {}
            }
        }
        for (path, place) in paths.iter().zip(&outputs.places) {
            let opaque = match place {
                Place::Video(_) => true,
                Place::Stdout => arguments.raw,
                Place::Folder(_) => false,
                _ => !PictureFormat::of(path)?.has_alpha(),
            };
            if opaque && outputs.background == Some(Background::Transparent) {
                return Err(WriteError::Transparent { path: path.clone() });
            }
            let video = matches!(place, Place::Video(_));
            if video && (arguments.resume || arguments.shard.is_some()) {
                return Err(WriteError::Video { path: path.clone() });
            }
            if let (Place::Video(path), None) = (place, program("ffmpeg")) {
                return Err(WriteError::NoFfmpeg { path: path.clone() });
            }
        }
        Ok(outputs)
    }

    /// The places of pictures and of depths.
    fn all_places(&self) -> impl Iterator<Item = &Place> {
        self.places.iter().chain(&self.depth_places)
    }

    /// The same destinations for a scene whose colours are linear or not.
    pub fn with_colors(self, linear: bool) -> Self {
        let colors = if linear { Colors::Linear } else { Colors::Srgb };
        Self { colors, ..self }
    }

    /// Returns true if pictures are written to standard output.
    pub fn use_stdout(&self) -> bool {
        self.places.contains(&Place::Stdout)
    }

    /// The greatest number of bytes per pixel that encoding needs.
    pub fn bytes_per_pixel(&self) -> u64 {
        let bytes = |place: &Place| match place {
            Place::File(path) => PictureFormat::of(path).map_or(8, PictureFormat::bytes_per_pixel),
            Place::Numbered { after, .. } => {
                PictureFormat::of(Path::new(after)).map_or(48, PictureFormat::bytes_per_pixel)
            }
            Place::Folder(_) | Place::Video(_) | Place::Stdout => 8,
        };
        self.places.iter().map(bytes).max().unwrap_or(8)
    }

    /// The views in `wanted`, indices of `views`, that must be drawn. With `resume`, these are the views without a
    /// file. Without `force` and `resume`, none of their files may exist, unless it is the
    /// default one.
    ///
    /// # Errors
    /// If the number of views does not fit the destinations, or a file exists.
    pub fn missing(
        &self,
        views: &[View],
        wanted: Vec<usize>,
        arguments: &OutputArguments,
    ) -> Result<Vec<usize>, WriteError> {
        let is_file = |path: &Path| path.metadata().is_ok_and(|metadata| metadata.is_file());
        let mut taken = std::collections::HashSet::new();
        for (index, view) in views.iter().enumerate() {
            for place in self.all_places() {
                match place {
                    Place::File(path) if views.len() > 1 => {
                        let (path, views) = (path.clone(), views.len());
                        return Err(WriteError::OneFile { path, views });
                    }
                    _ => {}
                }
                let file = place.file(index, view);
                if let Some(path) = file.filter(|path| !taken.insert(path.clone())) {
                    return Err(WriteError::Same { path });
                }
            }
        }
        let sizes = |view: &View| [view.camera.width, view.camera.height];
        for place in &self.places {
            if let Place::Video(path) = place {
                if views.iter().any(|view| sizes(view) != sizes(&views[0])) {
                    return Err(WriteError::Sizes { path: path.clone() });
                }
                if is_file(path) && !arguments.force {
                    return Err(WriteError::There { path: path.clone() });
                }
            }
        }
        let mut missing = Vec::new();
        for index in wanted {
            let files = self.files(index, &views[index]);
            let there = files.iter().find(|path| is_file(path));
            if arguments.resume {
                let streams = self.all_places().count() > files.len();
                if streams || !files.iter().all(|path| is_file(path)) {
                    missing.push(index);
                }
            } else if let Some(path) = there.filter(|_| !arguments.force && !self.is_default) {
                return Err(WriteError::There { path: path.clone() });
            } else {
                missing.push(index);
            }
        }
        Ok(missing)
    }

    /// The files of view `index`, those of depths last.
    pub fn files(&self, index: usize, view: &View) -> Vec<PathBuf> {
        self.all_places().filter_map(|place| place.file(index, view)).collect()
    }

    /// Describes the destinations of views `first` to `last`.
    pub fn describe(&self, views: &[View], first: usize, last: usize) -> String {
        let describe = |place: &Place| match place {
            Place::Stdout => "standard output".to_owned(),
            Place::Video(path) => path.display().to_string(),
            _ => {
                let of = |index: usize| {
                    let file = place.file(index, &views[index]).unwrap_or_default();
                    file.display().to_string()
                };
                let (first, last) = (of(first), of(last));
                if first == last { first } else { format!("{first} to {last}") }
            }
        };
        self.places.iter().map(describe).collect::<Vec<_>>().join(", ")
    }

    /// Creates a writer: creates folders and starts encoders for frames of `size`.
    ///
    /// # Errors
    /// If that fails.
    pub fn writer(&self, size: [u32; 2]) -> Result<Writer<'_>, WriteError> {
        let mut videos = Vec::new();
        for place in self.all_places() {
            match place {
                Place::Folder(folder) => {
                    std::fs::create_dir_all(folder)
                        .map_err(|source| OutputError::Io { path: folder.clone(), source })?;
                }
                Place::Video(path) => videos.push(Video::start(path, size, self.fps)?),
                _ => {}
            }
        }
        Ok(Writer { outputs: self, videos })
    }
}

impl Writer<'_> {
    /// Writes a picture to all destinations.
    ///
    /// # Errors
    /// If one fails.
    pub fn write(&mut self, finished: &Finished<'_>) -> Result<(), WriteError> {
        let outputs = self.outputs;
        let encoding = Encoding {
            background: outputs.background,
            depth: finished.depth.as_deref(),
            quality: outputs.quality,
            linear: outputs.linear,
            colors: outputs.colors,
        };
        let files = |places: &[Place]| -> Vec<PathBuf> {
            places.iter().filter_map(|place| place.file(finished.index, finished.view)).collect()
        };
        for path in files(&outputs.places) {
            gaurast_picture::write_encoded(&path, &finished.picture, &encoding)?;
        }
        if let Some(depth) = finished.depth.as_ref().filter(|_| !outputs.depth_places.is_empty()) {
            let medians: Vec<f32> = depth.iter().map(|[_, median]| *median).collect();
            let Picture { width, height, .. } = finished.picture;
            let map = DepthMap { width, height, depths: &medians };
            for path in files(&outputs.depth_places) {
                gaurast_picture::write_depths(&path, &map, outputs.depth_step)?;
            }
        }
        if outputs.use_stdout() {
            let bytes = if outputs.raw {
                gaurast_picture::rgb(&finished.picture, &encoding)
            } else {
                gaurast_picture::encode(PictureFormat::Png, &finished.picture, &encoding)
                    .map_err(|reason| WriteError::Stdout(std::io::Error::other(reason)))?
            };
            let mut stdout = std::io::stdout().lock();
            (stdout.write_all(&bytes).and_then(|()| stdout.flush())).map_err(WriteError::Stdout)?;
        }
        if !self.videos.is_empty() {
            let bytes = gaurast_picture::rgb(&finished.picture, &encoding);
            for video in &mut self.videos {
                // ffmpeg's message about the error is reported at the end.
                if video.input.write_all(&bytes).is_err() {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Completes the videos.
    ///
    /// # Errors
    /// If an encoder failed.
    pub fn finish(self) -> Result<(), WriteError> {
        self.videos.into_iter().try_for_each(Video::finish)
    }
}

impl Video {
    fn start(path: &Path, [width, height]: [u32; 2], fps: f64) -> Result<Self, WriteError> {
        let options = video_options(path).unwrap_or_default();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let temporary = gaurast_picture::folder(path).join(format!(".gaurast-{}-{name}", std::process::id()));
        let failed = |source: std::io::Error| {
            let path = path.to_owned();
            if source.kind() == std::io::ErrorKind::NotFound {
                WriteError::NoFfmpeg { path }
            } else {
                WriteError::Ffmpeg { path, reason: source.to_string() }
            }
        };
        let mut child = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"])
            .args(["-s", &format!("{width}x{height}"), "-r", &fps.to_string()])
            .args(["-i", "pipe:0", "-an"])
            .args(options.concat())
            .arg("-y")
            .arg(&temporary)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        let input = child
            .stdin
            .take()
            .ok_or_else(|| WriteError::Ffmpeg { path: path.to_owned(), reason: "it has no input".to_owned() })?;
        Ok(Self { path: path.to_owned(), temporary, child, input })
    }

    fn finish(self) -> Result<(), WriteError> {
        drop(self.input);
        let failed = |reason: String| {
            // The file may not exist.
            let _ = std::fs::remove_file(&self.temporary);
            WriteError::Ffmpeg { path: self.path.clone(), reason }
        };
        let output = (self.child.wait_with_output()).map_err(|error| failed(error.to_string()))?;
        if !output.status.success() {
            let message = String::from_utf8_lossy(&output.stderr);
            let line = message.lines().last().unwrap_or("it failed").to_owned();
            return Err(failed(line));
        }
        std::fs::rename(&self.temporary, &self.path).map_err(|error| failed(error.to_string()))
    }
}

/// The program `name` on the `PATH`.
fn program(name: &str) -> Option<PathBuf> {
    let paths = std::env::var_os("PATH")?;
    std::env::split_paths(&paths).map(|folder| folder.join(name)).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(name: Option<&str>) -> View {
        View { name: name.map(str::to_owned), camera: gaurast_scene::garden::camera(None, [8, 8]).expect("a camera") }
    }

    #[test]
    fn places_name_their_files() {
        let file = |place: &str, name| {
            let place = Place::of(Path::new(place), 1).expect(place);
            let file = place.file(7, &view(name)).expect("a file");
            file.to_str().expect("text").to_owned()
        };
        assert_eq!(file("a.png", None), "a.png");
        assert_eq!(file("a_%04d.png", None), "a_0007.png");
        assert_eq!(file("%d.exr", None), "7.exr");
        assert_eq!(file("out/", None), "out/00007.png");
        assert_eq!(file("out/", Some("images/DSC1.JPG")), "out/DSC1.png");
        assert_eq!(Place::of(Path::new("-"), 1).expect("stdout"), Place::Stdout);
        for bad in ["a_%x.png", "a_%4d.png", "%d%d.png", "a.bmp"] {
            assert!(Place::of(Path::new(bad), 1).is_err(), "{bad}");
        }
    }

    #[test]
    fn webp_is_animated_if_there_are_several_views() {
        let of = |path: &str, views: usize| Place::of(Path::new(path), views).expect(path);
        assert_eq!(of("a.webp", 1), Place::File("a.webp".into()));
        assert_eq!(of("a.webp", 2), Place::Video("a.webp".into()));
        assert_eq!(of("a.gif", 1), Place::Video("a.gif".into()));
        assert!(matches!(of("a_%d.webp", 2), Place::Numbered { .. }));
    }

    #[test]
    fn depths_go_to_files_and_folders() {
        let of = |path: &str| Place::of_depths(Path::new(path));
        assert_eq!(of("a.npy").expect("a file"), Place::File("a.npy".into()));
        assert!(matches!(of("a_%d.png").expect("files"), Place::Numbered { .. }));
        assert!(matches!(of("depths/").expect("a folder"), Place::Folder(_)));
        assert!(of("a.exr").is_err() && of("-").is_err());
    }
}
