//! Counts the work that the techniques of other accelerators would have in scenes: `rival_work [NAME=SCENE]... >
//! simdevice/timing/studies/rival_work.json`. A SCENE is a file, or the number of Gaussians of a generated garden.
//!
//! The device draws each scene and gives a trace of its work. The projected Gaussians are those of the reference
//! renderer, which the device's are tested against.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use gaurast_oracle::oracle::project::project;
use gaurast_oracle::oracle::{OracleCamera, OracleState};
use gaurast_oracle::scenes::SceneBuffers;
use gaurast_render::{DeviceOptions, Renderer, WorkTrace};
use gaurast_scene::camera::DEFAULT_FOV;
use gaurast_scene::{Camera, DEFAULT_UP, Framing, Scene, Subject, garden};
use simdevice::timing::trace_file;
use simdevice::timing::work::FrameWork;
use timing_studies::techniques::footprint::Footprint;
use timing_studies::techniques::measured::{Stored, measure};
use timing_studies::techniques::order_reuse::{OrderReuse, ReuseFigures};
use timing_studies::techniques::tile::View;

const SIZE: [u32; 2] = [1280, 720];
/// Degrees by which the camera turns around the middle of the picture between two frames: 15, 60 and 240 degrees a
/// second at 60 frames a second.
const STEPS: [f64; 3] = [0.25, 1.0, 4.0];
/// Pairs of frames of a path.
const FRAMES: u32 = 8;

const COMMAND: &str = "cargo run --release -p gaurast-bench --example rival_work -- playbot-125k=playbot-125k.ply \
                       skull=skull.ply garden=300000 > simdevice/timing/studies/rival_work.json";

fn main() -> Result<(), Box<dyn Error>> {
    let mut stored = Stored { command: COMMAND.to_owned(), scenes: Vec::new() };
    for argument in std::env::args().skip(1) {
        let (name, source) = argument.split_once('=').ok_or("NAME=SCENE")?;
        let (scene, camera, middle) = opened(source)?;
        let buffers = SceneBuffers::from(&scene);
        let frame = drawn(&scene, &camera)?;
        let mut measured = measure(&view(&buffers, &camera)?, &frame)?.ok_or("the trace has no Gaussians with ids")?;
        measured.scene = name.to_owned();
        measured.degree = buffers.degree;
        for step in STEPS {
            measured.reuse.push(path(&buffers, &camera, middle, step)?);
        }
        stored.scenes.push(measured);
    }
    println!("{}", serde_json::to_string_pretty(&stored)?);
    Ok(())
}

/// A scene, its camera, and the point in the middle of its picture.
fn opened(source: &str) -> Result<(Scene, Camera, [f64; 3]), Box<dyn Error>> {
    if let Ok(count) = source.parse() {
        let camera = garden::camera(None, SIZE)?;
        let ahead = 6.08;
        let middle = [0, 1, 2].map(|axis| camera.eye[axis] + ahead * camera.rotation[2][axis]);
        return Ok((garden::scene(1, count), camera, middle));
    }
    let scene = gaurast_scene::open(Path::new(source))?;
    let framed = Framing::new(DEFAULT_FOV, SIZE).framed(&Subject::of(&scene))?;
    Ok((scene, framed.camera, framed.target))
}

/// The trace of the device that draws a scene.
fn drawn(scene: &Scene, camera: &Camera) -> Result<FrameWork, Box<dyn Error>> {
    let work_trace = Arc::new(WorkTrace::default());
    let options = DeviceOptions { work_trace: Some(work_trace.clone()), ..DeviceOptions::default() };
    let mut renderer = Renderer::with_options(vulkan_gaurast::entry(), &options)?;
    let uploaded = renderer.upload(scene, None)?;
    renderer.render(&uploaded, camera)?;
    drop((uploaded, renderer));
    let mut trace = trace_file::from_bytes(&work_trace.take().ok_or("the device gave no trace")?)?;
    Ok(trace.frames.pop().ok_or("a frame")?)
}

/// The projected Gaussians in depth order.
fn view(buffers: &SceneBuffers, camera: &Camera) -> Result<View, Box<dyn Error>> {
    let camera = OracleCamera::new(&camera.to_vulkan(), SIZE).ok_or("a camera")?;
    let (scene, state) = (buffers.as_oracle(), OracleState::default());
    let mut splats: Vec<_> =
        (0..scene.len()).filter_map(|index| project(&scene, &camera, &state, index).ok()).collect();
    splats.sort_by(|a, b| a.key.total_cmp(&b.key));
    let footprint = |splat: &gaurast_oracle::oracle::splat::Splat| Footprint {
        id: splat.index as u32,
        mean: splat.mean,
        covariance: splat.covariance,
        opacity: splat.opacity,
    };
    Ok(View {
        size: SIZE,
        footprints: splats.iter().map(footprint).filter(|footprint| footprint.cut() >= 0.0).collect(),
    })
}

/// The reuse of lists along a path around the middle of the picture.
fn path(buffers: &SceneBuffers, camera: &Camera, middle: [f64; 3], step: f64) -> Result<ReuseFigures, Box<dyn Error>> {
    let mut reuse = OrderReuse::default();
    let mut before = view(buffers, camera)?;
    let mut lists_before = before.exact_lists();
    for frame in 1..=FRAMES {
        let after = view(buffers, &camera.turned(middle, DEFAULT_UP, (f64::from(frame) * step).to_radians()))?;
        let lists_after = after.exact_lists();
        reuse.add_frames([&before, &after], [&lists_before, &lists_after]);
        (before, lists_before) = (after, lists_after);
    }
    Ok(reuse.figures(step, FRAMES))
}
