//! Draws many views of one scene on one device. A picture is written while the next one is drawn.

use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use gaurast_render::{DeviceOptions, Frame, RenderError, Renderer, Settings, WorkTrace};
use gaurast_scene::{
    Antialiasing, Axes, AxesReason, Camera, ColorSpace, Geometry, Loaded, MAX_SH_DEGREE, Scene, SceneError,
};
use thiserror::Error;

use crate::args::{Choice, ModeArguments, chosen};
use crate::cameras::{View, short};
use crate::devices::{self, DeviceError};
use crate::messages;
use crate::outputs::{Finished, Outputs, WriteError};
use crate::progress::Progress;
use crate::sources::axes_and_reason;

/// A failure of drawing. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum DrawError {
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error("the thread that writes pictures cannot start: {0}")]
    Thread(std::io::Error),
    #[error("{0}")]
    Nothing(String),
    #[error(transparent)]
    Device(#[from] DeviceError),
    #[error("only this driver records its work: --device goes with neither --heatmap nor simulate")]
    Trace,
}

/// The settings from the command line and the scene's file, for `cameras`.
pub fn settings<'a>(modes: &ModeArguments, scene: &Scene, cameras: impl IntoIterator<Item = &'a Camera>) -> Settings {
    let order_of_file = match modes.renderer {
        Some(renderer) => renderer.order(scene.metadata().order),
        None => scene.metadata().order.unwrap_or_default(),
    };
    let settings = Settings {
        sh_degree: modes.sh_degree.unwrap_or(MAX_SH_DEGREE),
        order: chosen(modes.order, order_of_file),
        geometry: chosen(modes.geometry, scene.geometry()),
        antialiasing: chosen(modes.antialiasing, scene.antialiasing()),
        precision: modes.precision.into(),
        exponential_error: modes.exponential_error,
        contribution_budget: modes.contribution_budget,
        ..Settings::default()
    };
    match modes.renderer {
        Some(renderer) => renderer.settings(settings, cameras),
        None => settings,
    }
}

/// Returns true if the colours in the scene's file are linear light.
pub fn has_linear_colors(scene: &Scene) -> bool {
    scene.metadata().color_space == Some(ColorSpace::LinearRec709Display)
}

/// Notes for the user about settings in the scene's file, a sentence each. The file has spherical harmonics of `sh_degree`.
pub fn notes(modes: &ModeArguments, scene: &Scene, sh_degree: u32) -> Vec<String> {
    let metadata = scene.metadata();
    let mut notes = metadata.warnings.clone();
    notes.extend(metadata.notes.iter().cloned());
    if let Some(axes) = &metadata.axes {
        let is_guess = axes.reason == AxesReason::Format && axes.axes == Axes::RIGHT_UP_BACK;
        let option = if is_guess { "--axes rdf if it stands on its head" } else { "--axes" };
        notes.push(format!("the file's axes are {} ({option})", axes_and_reason(axes)));
    }
    let origin = scene.origin();
    if origin != [0.0; 3] {
        let [x, y, z] = origin;
        notes.push(format!(
            "positions are kept relative to {x},{y},{z}, so that they keep their digits; cameras are in the file's coordinates"
        ));
    }
    if modes.geometry == Choice::Auto && scene.geometry() == Geometry::Surfel {
        notes.push("flat Gaussians are drawn (--geometry 2d), as the file says".to_owned());
    }
    if modes.antialiasing == Choice::Auto && scene.antialiasing() == Antialiasing::Compensated {
        let note = "opacity makes up for dilation (--antialiasing compensated), as the file says";
        notes.push(note.to_owned());
    }
    if metadata.color_space == Some(ColorSpace::LinearRec709Display) {
        let note = "the file's colours are linear light, and are written without a transfer function";
        notes.push(note.to_owned());
    }
    if let Some(degree) = modes.sh_degree.filter(|degree| *degree > sh_degree) {
        notes.push(format!("--sh-degree {degree} is of no account: the scene has degree {sh_degree}"));
    }
    notes
}

/// A device with a scene on it.
pub struct Drawing {
    renderer: Renderer,
    scene: gaurast_render::DeviceScene,
}

/// The result of drawing a view.
pub struct Drawn {
    /// The index among all views.
    pub index: usize,
    pub time: Duration,
    pub counters: Vec<gaurast_render::Counter>,
    /// The reason for which the picture is empty, if it is.
    pub nothing: Option<String>,
}

impl Drawing {
    /// Creates a device for `scene` and `settings`: this driver's, or the one with `device` in its name. The scene's copy in
    /// host memory is freed. `work_trace` receives the device's work when the drawing is dropped.
    ///
    /// # Errors
    /// If there is no device, or not enough memory.
    pub fn new(
        scene: Loaded,
        settings: Settings,
        device: Option<&str>,
        counters: bool,
        work_trace: Option<Arc<WorkTrace>>,
    ) -> Result<Self, DrawError> {
        if device.is_some() && work_trace.is_some() {
            return Err(DrawError::Trace);
        }
        let entry = if device.is_some() { devices::entry()? } else { devices::own_driver()? };
        let options = DeviceOptions {
            work_trace,
            device: device.unwrap_or_default().to_owned(),
            on_message: Some(Arc::new(messages::receive)),
            ..DeviceOptions::default()
        };
        let mut renderer = Renderer::with_options(entry, &options)?;
        if counters {
            renderer.count_everything()?;
        }
        let degree = Some(settings.sh_degree);
        let mut uploaded = match scene {
            Loaded::Encoded(scene) if renderer.draws_encoded() && !settings.by_z => {
                renderer.upload_encoded(*scene, degree)?
            }
            scene => renderer.upload_and_free(scene.decode()?, degree)?,
        };
        renderer.set(&mut uploaded, settings)?;
        Ok(Self { renderer, scene: uploaded })
    }

    /// Draws one view.
    ///
    /// # Errors
    /// If the device fails.
    pub fn frame(&mut self, view: &View) -> Result<Frame, DrawError> {
        Ok(self.renderer.render(&self.scene, &view.camera)?)
    }

    /// Draws the views with these indices and writes them. An empty picture is an error if `strict`.
    ///
    /// # Errors
    /// The first error. The pictures before it are written.
    pub fn all(
        &mut self,
        views: &[View],
        indices: &[usize],
        outputs: &Outputs,
        strict: bool,
        progress: Progress,
    ) -> Result<Vec<Drawn>, DrawError> {
        let Some(first) = indices.first() else {
            return Ok(Vec::new());
        };
        let size = [views[*first].camera.width, views[*first].camera.height];
        let mut writer = outputs.writer(size)?;
        let bar = progress.pictures(indices.len() as u64);
        let mut drawn = Vec::new();
        std::thread::scope(|scope| {
            // The channel has no buffer: one picture is written while the next one is drawn.
            let (send, receive) = sync_channel::<Finished<'_>>(0);
            let write = move || {
                for finished in receive {
                    writer.write(&finished)?;
                }
                writer.finish()
            };
            let writing = std::thread::Builder::new().spawn_scoped(scope, write).map_err(DrawError::Thread)?;
            let mut failed = None;
            for &index in indices {
                let frame = match self.frame(&views[index]) {
                    Ok(frame) => frame,
                    Err(error) => {
                        failed = Some(error);
                        break;
                    }
                };
                let nothing = reasons(&frame, &views[index]);
                if let Some(reason) = nothing.clone().filter(|_| strict) {
                    failed = Some(DrawError::Nothing(reason));
                    break;
                }
                let Frame { picture, time, counters, depth, .. } = frame;
                drawn.push(Drawn { index, time, counters, nothing });
                let finished = Finished { index, view: &views[index], picture, depth };
                // The writer reports the error that ended it.
                if send.send(finished).is_err() {
                    break;
                }
                bar.inc(1);
            }
            drop(send);
            let written = writing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            bar.finish_and_clear();
            written?;
            failed.map_or(Ok(()), Err)
        })?;
        Ok(drawn)
    }
}

/// The reason for which the picture is empty, if it is, with counts of the skipped Gaussians.
fn reasons(frame: &Frame, view: &View) -> Option<String> {
    if frame.picture.pixels.iter().any(|pixel| pixel[3] > 0.0) {
        return None;
    }
    let counted = |name: &str| {
        let counter = frame.counters.iter().find(|counter| counter.name == name);
        counter.map_or(0.0, |counter| counter.value)
    };
    let mut parts: Vec<String> = frame
        .counters
        .iter()
        .filter(|counter| counter.category == "gaussians skipped" && counter.value > 0.0)
        .map(|counter| {
            let plane = match counter.name.as_str() {
                "before near plane" => format!(" (--near {})", short(view.camera.near)),
                "beyond far plane" => format!(" (--far {})", short(view.camera.far)),
                _ => String::new(),
            };
            format!("{} {}{plane}", counter.value, counter.name)
        })
        .collect();
    if frame.counters.is_empty() {
        return Some("there is nothing in the picture".to_owned());
    }
    let reached = counted("gaussians drawn");
    if reached > 0.0 {
        parts.push(format!("{reached} too faint at every pixel"));
    }
    let read = counted("gaussians read");
    let parts = if parts.is_empty() { "none is in the picture".to_owned() } else { parts.join(", ") };
    Some(format!("there is nothing in the picture: of {read} Gaussian{}: {parts}", if read == 1.0 { "" } else { "s" }))
}
