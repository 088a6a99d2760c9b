//! `gaurast render`.

use std::io::{Write, stdout};
use std::sync::Arc;
use std::time::Instant;

use gaurast_picture::OutputError;
use gaurast_render::WorkTrace;
use gaurast_scene::Loaded;
use gaurast_scene::camera_path::Keyframe;
use thiserror::Error;
use timing::work::Trace;

use crate::args::{OutputArguments, RenderArguments};
use crate::cameras::{self, View, ViewError, Views};
use crate::devices;
use crate::drawing::{self, DrawError, Drawing};
use crate::heatmap::{self, HeatmapError};
use crate::limits;
use crate::outputs::{Outputs, WriteError};
use crate::progress::Progress;
use crate::report::{self, Contents, Summary};
use crate::sources::{self, Source, SourceError};

/// A failure of the command. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    View(#[from] ViewError),
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Heatmap(#[from] HeatmapError),
    #[error("--heatmap is of one view, and {0} are asked for")]
    HeatmapViews(usize),
    #[error("{0}")]
    Limit(String),
    #[error("the device's trace of its work: {0}")]
    Trace(timing::trace_file::FileError),
    #[error("the pictures are written, but not the report: {0}")]
    Report(std::io::Error),
}

impl Error {
    /// Returns true if the command line is invalid.
    pub fn is_misuse(&self) -> bool {
        matches!(self, Self::View(error) if error.is_misuse())
    }
}

/// Draws a scene and writes the pictures.
pub fn run(arguments: &RenderArguments) -> Result<(), Error> {
    let trace = arguments.output.heatmap.is_some().then(Arc::default);
    draw(arguments, trace.as_ref())
}

/// Draws a scene, writes the pictures, and returns the device's work.
pub fn work(arguments: &RenderArguments) -> Result<Trace, Error> {
    let trace = Arc::default();
    draw(arguments, Some(&trace))?;
    parse(&trace)
}

/// The work that the device has left; none if it has drawn nothing.
fn parse(trace: &WorkTrace) -> Result<Trace, Error> {
    timing::trace_file::from_bytes(&trace.take().unwrap_or_default()).map_err(Error::Trace)
}

/// Draws a scene and writes the pictures. `trace` receives the device's work.
fn draw(arguments: &RenderArguments, trace: Option<&Arc<WorkTrace>>) -> Result<(), Error> {
    if devices::list(&arguments.modes).map_err(DrawError::Device)? {
        return Ok(());
    }
    let source = Source::of(&arguments.scene)?;
    // The camera file is read first, so that its errors are reported before a large scene is read.
    let mut known = cameras::read(&arguments.camera, &source)?;
    let background = known.background().or(source.background);
    let outputs = Outputs::new(&arguments.output, &source.name, background, known.count(&arguments.camera))?;
    if let Some(path) = &arguments.output.heatmap {
        gaurast_picture::check(path)?;
    }
    let quiet = arguments.report.quiet;
    let progress = Progress { quiet };
    let (loaded, loading) = source.load_as_it_lies(progress)?;
    // A compressed scene is drawn as it lies; the rest of the program looks at its Gaussians without their harmonics.
    let (mut scene, encoded) = match loaded {
        Loaded::Encoded(encoded) if !known.crops() && !arguments.decode => {
            (encoded.outline().map_err(SourceError::from)?, Some(encoded))
        }
        loaded => (loaded.decode().map_err(SourceError::from)?, None),
    };
    let sh_degree = encoded.as_ref().map_or(scene.sh_degree(), |encoded| encoded.sh_degree);
    if arguments.report.strict {
        sources::check_strictly(&scene)?;
    }
    known.crop(&mut scene);
    let outputs = outputs.with_colors(drawing::has_linear_colors(&scene));
    let garden = source.is_garden();
    let camera = arguments.modes.cameras(&arguments.camera);
    let Views { views, mut notes, framing, .. } = cameras::of_scene(known, &camera, &scene, garden)?;
    if arguments.camera.frame {
        if !quiet && views.iter().any(|view| !view.camera.distortion.is_none()) {
            eprintln!("gaurast: keyframes have ideal lenses: the distortion of the file's is left out");
        }
        return print_keyframes(&cameras::keyframes(&views, &scene)).map_err(Error::Report);
    }
    notes.extend(source.notes.iter().cloned());
    notes.extend(drawing::notes(&arguments.modes, &scene, sh_degree));
    if !quiet && !arguments.report.json {
        for note in &notes {
            eprintln!("gaurast: {note}");
        }
    }
    let mut settings = drawing::settings(&arguments.modes, &scene, views.iter().map(|view| &view.camera));
    settings.depth = arguments.output.depth || !arguments.output.depth_output.is_empty();
    for view in &views {
        settings.check(&view.camera).map_err(DrawError::Render)?;
        if !scene.mesh().is_empty() {
            settings.check_mesh(&view.camera).map_err(DrawError::Render)?;
        }
    }
    let indices = chosen(&views, arguments, &outputs)?;
    let largest = indices.iter().map(|index| &views[*index].camera);
    if let Some(camera) = largest.max_by_key(|c| u64::from(c.width) * u64::from(c.height)) {
        let encoding = outputs.bytes_per_pixel();
        limits::check_memory(camera, settings.depth, encoding, indices.len()).map_err(Error::Limit)?;
    }
    if arguments.output.heatmap.is_some() && indices.len() != 1 {
        return Err(Error::HeatmapViews(indices.len()));
    }

    let contents = Contents::of(&scene, sh_degree);
    let start = Instant::now();
    let drawn = if indices.is_empty() {
        Vec::new()
    } else {
        let step = progress.step("uploading");
        let scene = match encoded {
            Some(encoded) => {
                drop(scene);
                Loaded::Encoded(encoded)
            }
            None => scene.into(),
        };
        let mut drawing = Drawing::new(
            scene,
            settings,
            arguments.modes.device.as_deref(),
            arguments.report.counters,
            trace.cloned(),
        )?;
        step.finish_and_clear();
        drawing.all(&views, &indices, &outputs, arguments.report.strict, progress)?
    };
    let OutputArguments { heatmap, heatmap_of, force, .. } = &arguments.output;
    let heat = match (heatmap, trace, indices.first()) {
        (Some(path), Some(trace), Some(index)) => {
            let camera = &views[*index].camera;
            Some(heatmap::write(path, *heatmap_of, &parse(trace)?, camera, *force)?)
        }
        _ => None,
    };
    let summary = Summary {
        contents,
        files: &arguments.scene.scenes,
        loading,
        drawing: start.elapsed(),
        views: &views,
        drawn: &drawn,
        kept: views_of_shard(&views, arguments).len() - indices.len(),
        outputs: &outputs,
        framing: framing.as_deref(),
        notes: &notes,
        heatmap: (arguments.output.heatmap.as_deref().zip(heat))
            .map(|(path, greatest)| (path, arguments.output.heatmap_of, greatest)),
        stats: arguments.report.stats || arguments.report.counters,
    };
    if quiet && !arguments.report.json {
        return Ok(());
    }
    for drawn in &drawn {
        if let Some(reason) = drawn.nothing.as_deref().filter(|_| !quiet) {
            let files = outputs.describe(&views, drawn.index, drawn.index);
            eprintln!("gaurast: {files}: {reason}");
        }
    }
    if arguments.report.json {
        let value = summary.json();
        return if outputs.use_stdout() {
            eprintln!("{value}");
            Ok(())
        } else {
            print_json(&value).map_err(Error::Report)
        };
    }
    // The reader of standard output may have gone. Scripts should get an error, although the pictures are written.
    let text = summary.text();
    if outputs.use_stdout() {
        eprint!("{text}");
        return Ok(());
    }
    let mut stdout = stdout().lock();
    (stdout.write_all(text.as_bytes())).and_then(|()| stdout.flush()).map_err(Error::Report)
}

/// The indices of the views in this process's share.
fn views_of_shard(views: &[View], arguments: &RenderArguments) -> Vec<usize> {
    let of_share = |index: &usize| {
        let shard = arguments.output.shard;
        shard.is_none_or(|shard| index % shard.count == shard.index)
    };
    (0..views.len()).filter(of_share).collect()
}

/// The indices of the views that must be drawn.
fn chosen(views: &[View], arguments: &RenderArguments, outputs: &Outputs) -> Result<Vec<usize>, WriteError> {
    let wanted = views_of_shard(views, arguments);
    outputs.missing(views, wanted, &arguments.output)
}

/// Prints a list for `--path`, one line per view.
fn print_keyframes(keyframes: &[Keyframe]) -> std::io::Result<()> {
    let lines = keyframes.iter().map(serde_json::to_string);
    let lines = lines.collect::<Result<Vec<_>, _>>()?.join(",\n ");
    let mut stdout = stdout().lock();
    writeln!(stdout, "[{lines}]")?;
    stdout.flush()
}

/// Prints a value as JSON.
fn print_json(value: &impl serde::Serialize) -> std::io::Result<()> {
    let mut stdout = stdout().lock();
    report::write_json(&mut stdout, value)?;
    stdout.flush()
}
