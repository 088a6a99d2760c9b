//! `gaurast render`.

use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use std::time::Instant;

use gaurast_picture::OutputError;
use gaurast_render::{RenderError, Renderer, Settings};
use gaurast_scene::camera::{Camera, CameraError, DEFAULT_FOV};
use gaurast_scene::camera_files::CameraFileError;
use gaurast_scene::{MAX_SH_DEGREE, Scene, SceneError};
use thiserror::Error;

use crate::args::{CameraModel, RenderArguments};
use crate::progress::Progress;
use crate::report;

/// The picture's size where nothing says otherwise.
const DEFAULT_SIZE: [u32; 2] = [1280, 720];

/// The generated garden's seed.
const SEED: u64 = 1;

/// Why there is no picture. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    CameraFile(#[from] CameraFileError),
    #[error(transparent)]
    Camera(#[from] CameraError),
    #[error("{}: view {view}: there are {count} views, counted from 0", path.display())]
    NoView {
        path: PathBuf,
        view: usize,
        count: usize,
    },
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("the pictures are written, but not the report: {0}")]
    Report(std::io::Error),
}

/// Draws a scene and writes the picture.
pub fn run(arguments: &RenderArguments) -> Result<(), Error> {
    for path in &arguments.output {
        gaurast_picture::check(path)?;
    }
    // A camera file is read first: its mistakes should not wait for a large scene.
    let view = match &arguments.cameras {
        Some(path) => Some(file_camera(path, arguments)?),
        None => None,
    };
    let progress = Progress {
        quiet: arguments.quiet,
    };
    let start = Instant::now();
    let scene = match &arguments.scene {
        Some(path) => load(path, progress)?,
        None => {
            let _step = progress.step("generating");
            gaurast_scene::garden::scene(SEED, gaurast_scene::garden::DEFAULT_COUNT)
        }
    };
    let loading = start.elapsed();
    let camera = match view {
        Some(camera) => camera,
        None => scene_camera(&scene, arguments)?,
    };
    let camera = match arguments.camera {
        CameraModel::Pinhole => camera,
        CameraModel::Fisheye => camera.fisheye(arguments.fov.unwrap_or(180.0)),
        CameraModel::Equirectangular => camera.panorama(),
    };

    let step = progress.step("rendering");
    let mut renderer = Renderer::new(vulkan_gaurast::entry())?;
    if arguments.counters {
        renderer.count_everything()?;
    }
    let mut uploaded = renderer.upload(&scene, arguments.sh_degree)?;
    let settings = Settings {
        sh_degree: arguments.sh_degree.unwrap_or(MAX_SH_DEGREE),
        order: arguments.order.into(),
        geometry: arguments.geometry.into(),
        precision: arguments.precision.into(),
        exponential_error: arguments.exponential_error,
        contribution_budget: arguments.contribution_budget,
        ..Settings::default()
    };
    renderer.set(&mut uploaded, settings)?;
    let frame = renderer.render(&uploaded, &camera)?;
    step.finish_and_clear();

    let step = progress.step("writing");
    let background = arguments
        .background
        .map(|background| background.0.map(|c| c as f32));
    for path in &arguments.output {
        gaurast_picture::write(path, &frame.picture, background)?;
    }
    step.finish_and_clear();
    if !arguments.quiet {
        // Whoever reads this may have gone, and scripts should know; the pictures are there all the same.
        print(&report::table(&scene, loading, &frame), &arguments.output).map_err(Error::Report)?;
    }
    Ok(())
}

fn print(table: &comfy_table::Table, outputs: &[PathBuf]) -> std::io::Result<()> {
    let mut stdout = stdout().lock();
    writeln!(stdout, "{table}")?;
    for path in outputs {
        writeln!(stdout, "wrote {}", path.display())?;
    }
    stdout.flush()
}

fn load(path: &Path, progress: Progress) -> Result<Scene, Error> {
    let bar = progress.bytes("reading", 0);
    let scene = gaurast_scene::open_with(path, &gaurast_scene::Options::default(), |file, len| {
        bar.set_length(len);
        bar.wrap_read(file)
    })?;
    bar.finish_and_clear();
    Ok(scene)
}

/// The camera of a camera file, at the size asked for.
fn file_camera(path: &Path, arguments: &RenderArguments) -> Result<Camera, Error> {
    let size = arguments.size.map(|size| size.0);
    let mut views = gaurast_scene::camera_files::load(path, size.unwrap_or(DEFAULT_SIZE))?;
    let (view, count) = (arguments.view, views.len());
    if view >= count {
        return Err(Error::NoView {
            path: path.to_owned(),
            view,
            count,
        });
    }
    let camera = views.swap_remove(view).camera;
    Ok(size.map_or(camera.clone(), |size| camera.resized(size)))
}

/// The camera given by hand, or one that suits the scene.
fn scene_camera(scene: &Scene, arguments: &RenderArguments) -> Result<Camera, Error> {
    let size = arguments.size.map_or(DEFAULT_SIZE, |size| size.0);
    let fov = arguments.fov;
    Ok(match (arguments.eye, arguments.target) {
        (Some(eye), Some(target)) => {
            let up = arguments.up.map_or([0.0, -1.0, 0.0], |up| up.0);
            Camera::look_at(eye.0, target.0, up, fov.unwrap_or(DEFAULT_FOV), size)?
        }
        _ if arguments.scene.is_none() => gaurast_scene::garden::camera(fov, size)?,
        _ => gaurast_scene::frame(scene, fov.unwrap_or(DEFAULT_FOV), size),
    })
}
