//! Worker processes. A contender draws in a process of its own, so that it has its own threads, environment and memory,
//! and so that several can take turns. Parent and child exchange lines of JSON.

use std::ffi::CString;
use std::io::{BufRead, BufReader, Write, stdin, stdout};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use gaurast_bench::quads::QuadRenderer;
use gaurast_render::process_stats as usage;
use gaurast_render::{DeviceOptions, DeviceScene, Frame, Renderer, Settings};
use gaurast_scene::Scene;
use gaurast_scene::camera::Camera;
use serde::{Deserialize, Serialize};

use super::workload::Workload;
use crate::error::BenchError;

/// The hidden command that makes a process a worker.
pub const COMMAND: &str = "worker";

/// The folders in which distributions install lavapipe's manifest.
const LAVAPIPE_FOLDERS: [&str; 3] = ["/usr/share", "/etc", "/usr/local/share"];

/// A way to draw Gaussians, and the device that it uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Contender {
    /// The Gaussian topology on this driver.
    Gaurast,
    /// Quads on lavapipe.
    QuadsOnLavapipe,
    /// Quads on this driver's triangles.
    QuadsOnGaurast,
}

impl Contender {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gaurast => "gaurast",
            Self::QuadsOnLavapipe => "quads on lavapipe",
            Self::QuadsOnGaurast => "quads on gaurast",
        }
    }
}

/// All contenders, in the order of tables.
pub const CONTENDERS: [Contender; 3] = [Contender::Gaurast, Contender::QuadsOnLavapipe, Contender::QuadsOnGaurast];

/// The first message to a worker.
#[derive(Serialize, Deserialize)]
struct Setup {
    contender: Contender,
    workload: Workload,
    threads: usize,
    /// The driver's optimizations.
    optimizations: String,
}

impl Setup {
    /// The options of this driver's device.
    fn device_options(&self) -> Result<DeviceOptions, BenchError> {
        let optimizations = CString::new(self.optimizations.as_str());
        let optimizations = optimizations.map_err(|error| BenchError::Worker(error.to_string()))?;
        Ok(DeviceOptions {
            threads: self.threads as u32,
            optimizations: Some(optimizations),
            ..DeviceOptions::default()
        })
    }
}

/// Each further message to a worker.
#[derive(Serialize, Deserialize)]
struct Request {
    camera: Camera,
    settings: Settings,
    /// The file for the picture, if the picture is needed.
    picture: Option<PathBuf>,
    /// True if the frame may be drawn before it is measured, as a warm-up.
    #[serde(default)]
    is_independent: bool,
}

/// A worker's reply.
#[derive(Serialize, Deserialize)]
enum Reply {
    Ready(Ready),
    Drawn(Drawn),
    Failed(String),
}

/// A worker's state after it has loaded its scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Ready {
    /// The device's name.
    pub device: String,
    /// Milliseconds to make the device and copy the scene to it.
    pub upload: f64,
}

/// The cost of a frame. Times are in milliseconds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Drawn {
    /// The time from setting the camera until the picture is in host memory.
    pub wall: f64,
    /// The processor time of all threads, if known.
    pub processor: Option<f64>,
    /// The device's counters, or the steps of quads, each with name and value; times are in milliseconds.
    pub counters: Vec<(String, f64)>,
    /// Names of those counters that are times.
    pub stages: Vec<String>,
    /// The peak memory since the worker was ready, in bytes, if known.
    pub memory: Option<u64>,
}

impl Drawn {
    /// A counter's value, 0 if there is none.
    pub fn counter(&self, name: &str) -> f64 {
        let found = self.counters.iter().find(|(own, _)| own == name);
        found.map_or(0.0, |(_, value)| *value)
    }
}

/// The whole input of a worker that draws `views` one after the other, with the driver's `optimizations`, and exits.
///
/// # Errors
/// If it cannot be written as JSON.
pub fn input(workload: &Workload, optimizations: &str, views: &[Camera]) -> Result<Vec<u8>, BenchError> {
    let mut input = Vec::new();
    let setup = Setup {
        contender: Contender::Gaurast,
        workload: workload.clone(),
        threads: 1,
        optimizations: optimizations.to_owned(),
    };
    say(&mut input, &setup)?;
    for camera in views {
        let request =
            Request { camera: camera.clone(), settings: Settings::default(), picture: None, is_independent: false };
        say(&mut input, &request)?;
    }
    Ok(input)
}

/// Checks that a worker with this output drew everything that was requested.
///
/// # Errors
/// If it did not.
pub fn check(output: &str) -> Result<(), BenchError> {
    for line in output.lines() {
        if let Reply::Failed(reason) = serde_json::from_str(line)? {
            return Err(BenchError::Worker(reason));
        }
    }
    Ok(())
}

/// A worker process as its parent uses it.
pub struct Worker {
    child: Child,
    requests: Option<ChildStdin>,
    replies: BufReader<ChildStdout>,
    /// The worker's message at the end of its preparation.
    pub ready: Ready,
}

/// The idle time after which a worker is warmed up again.
const PAUSE: Duration = Duration::from_millis(100);

/// The counter of the time in which clusters are made.
const CLUSTER_TIME: &str = "clusters";

/// The driver's optimizations in benchmarks: all except those that save time only if two frames are equal.
pub const OPTIMIZATIONS: &str = "all,-temporal-reuse";

impl Worker {
    /// Starts a worker that uses `threads` threads; `None` if its device is not available.
    pub fn start(contender: Contender, workload: &Workload, threads: usize) -> Result<Option<Self>, BenchError> {
        Self::with_optimizations(contender, workload, threads, OPTIMIZATIONS)
    }

    /// Starts a worker as [`Worker::start`] does, with the driver's `optimizations`.
    pub fn with_optimizations(
        contender: Contender,
        workload: &Workload,
        threads: usize,
        optimizations: &str,
    ) -> Result<Option<Self>, BenchError> {
        let mut command = Command::new(std::env::current_exe()?);
        command
            .arg(COMMAND)
            // The number of rasterizer threads; the queue has one more, for vertices.
            .env("LP_NUM_THREADS", threads.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        if contender == Contender::QuadsOnLavapipe {
            let Some(manifest) = lavapipe() else {
                return Ok(None);
            };
            command.env("VK_DRIVER_FILES", &manifest);
            command.env("VK_ICD_FILENAMES", &manifest);
        }
        let mut child = command.spawn()?;
        let (Some(requests), Some(replies)) = (child.stdin.take(), child.stdout.take()) else {
            unreachable!("both are pipes");
        };
        let mut worker = Self {
            child,
            requests: Some(requests),
            replies: BufReader::new(replies),
            ready: Ready { device: String::new(), upload: 0.0 },
        };
        let setup = Setup { contender, workload: workload.clone(), threads, optimizations: optimizations.to_owned() };
        match worker.ask(&setup)? {
            Reply::Ready(ready) => worker.ready = ready,
            reply => return Err(reply.unexpected(contender)),
        }
        Ok(Some(worker))
    }

    /// Draws a frame, and leaves its pixels in the file `picture` if that is given.
    pub fn draw(&mut self, camera: &Camera, settings: Settings, picture: Option<&Path>) -> Result<Drawn, BenchError> {
        self.request(&Request {
            camera: camera.clone(),
            settings,
            picture: picture.map(Path::to_owned),
            is_independent: true,
        })
    }

    /// Draws a frame whose time depends on the frame before; it is never drawn twice.
    pub fn draw_next(&mut self, camera: &Camera) -> Result<Drawn, BenchError> {
        self.request(&Request {
            camera: camera.clone(),
            settings: Settings::default(),
            picture: None,
            is_independent: false,
        })
    }

    fn request(&mut self, request: &Request) -> Result<Drawn, BenchError> {
        match self.ask(request)? {
            Reply::Drawn(drawn) => Ok(drawn),
            Reply::Failed(reason) => Err(BenchError::Worker(reason)),
            Reply::Ready(_) => Err(BenchError::Worker("it is ready twice".to_owned())),
        }
    }

    fn ask(&mut self, message: &impl Serialize) -> Result<Reply, BenchError> {
        let requests = self.requests.as_mut().ok_or_else(|| std::io::Error::from(std::io::ErrorKind::BrokenPipe))?;
        say(requests, message)?;
        let mut line = String::new();
        self.replies.read_line(&mut line)?;
        if line.is_empty() {
            return Err(BenchError::Worker("it ended without a word".to_owned()));
        }
        Ok(serde_json::from_str(&line)?)
    }
}

impl Reply {
    fn unexpected(self, contender: Contender) -> BenchError {
        let reason = match self {
            Self::Failed(reason) => reason,
            Self::Ready(_) | Self::Drawn(_) => "it answers out of turn".to_owned(),
        };
        BenchError::Worker(format!("{}: {reason}", contender.name()))
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // The worker exits at the end of its input.
        self.requests = None;
        let _ = self.child.wait();
    }
}

/// The path of lavapipe's manifest, if it is installed.
pub fn lavapipe() -> Option<PathBuf> {
    LAVAPIPE_FOLDERS
        .iter()
        .map(|folder| Path::new(folder).join("vulkan/icd.d"))
        .flat_map(|folder| {
            let arch = std::env::consts::ARCH;
            [folder.join(format!("lvp_icd.{arch}.json")), folder.join("lvp_icd.json")]
        })
        .find(|path| path.exists())
}

/// Reads the pixels of a file that a worker wrote.
pub fn read_picture(path: &Path) -> Result<Vec<[f32; 4]>, BenchError> {
    Ok(bytemuck::pod_collect_to_vec(&std::fs::read(path)?))
}

fn say(to: &mut impl Write, message: &impl Serialize) -> Result<(), BenchError> {
    let mut line = serde_json::to_vec(message)?;
    line.push(b'\n');
    to.write_all(&line)?;
    Ok(to.flush()?)
}

/// The main loop of a worker process.
pub fn run() -> Result<(), BenchError> {
    let mut lines = stdin().lock().lines();
    let Some(setup) = lines.next() else {
        return Ok(());
    };
    let setup: Setup = serde_json::from_str(&setup?)?;
    let mut artist = match Artist::new(&setup) {
        Ok((artist, ready)) => {
            say(&mut stdout(), &Reply::Ready(ready))?;
            artist
        }
        Err(error) => return say(&mut stdout(), &Reply::Failed(error.to_string())),
    };
    usage::reset_peak_memory();
    let (mut last_size, mut last_end) = ([0; 2], Instant::now());
    let mut made_clusters = false;
    for (number, line) in lines.enumerate() {
        let request: Request = serde_json::from_str(&line?)?;
        let size = [request.camera.width, request.camera.height];
        // A frame is warmed up in three cases. A picture of another size has new memory, which one thread touches for
        // the first time. After a pause, schedulers keep threads together on one processor for as long as a frame
        // takes. The first two frames build clusters. None of these costs belongs to the time of a frame.
        let is_new = size != last_size || last_end.elapsed() > PAUSE || made_clusters;
        let warms_up = request.is_independent && number >= 2 && is_new;
        let reply = match artist.answer(&request, warms_up) {
            Ok(drawn) => {
                made_clusters = drawn.counter(CLUSTER_TIME) > 0.0;
                Reply::Drawn(drawn)
            }
            Err(error) => Reply::Failed(error.to_string()),
        };
        say(&mut stdout(), &reply)?;
        (last_size, last_end) = (size, Instant::now());
    }
    Ok(())
}

/// A renderer with its scene.
enum Artist {
    Gaussians(Box<(Renderer, DeviceScene, Settings)>),
    Quads(Box<(QuadRenderer, Scene)>),
}

impl Artist {
    fn new(setup: &Setup) -> Result<(Self, Ready), BenchError> {
        let scene = setup.workload.scene()?;
        let start = Instant::now();
        let (artist, device) = match setup.contender {
            Contender::Gaurast => {
                let mut renderer = Renderer::with_options(vulkan_gaurast::entry(), &setup.device_options()?)?;
                let uploaded = renderer.upload(&scene, None)?;
                let device = renderer.device_name().to_owned();
                let parts = (renderer, uploaded, Settings::default());
                (Self::Gaussians(Box::new(parts)), device)
            }
            Contender::QuadsOnLavapipe => {
                let renderer = QuadRenderer::through_the_loader("llvmpipe", setup.threads)?;
                let device = renderer.device_name().to_owned();
                (Self::Quads(Box::new((renderer, scene))), device)
            }
            Contender::QuadsOnGaurast => {
                let options = setup.device_options()?;
                let renderer = QuadRenderer::with_options(vulkan_gaurast::entry(), "", setup.threads, &options)?;
                let device = renderer.device_name().to_owned();
                (Self::Quads(Box::new((renderer, scene))), device)
            }
        };
        let upload = start.elapsed().as_secs_f64() * 1e3;
        Ok((artist, Ready { device, upload }))
    }

    /// Draws a requested frame. With `warm_up`, it first draws it unmeasured until a frame builds no clusters.
    fn answer(&mut self, request: &Request, warm_up: bool) -> Result<Drawn, BenchError> {
        let mut is_cold = warm_up;
        while is_cold {
            let before = self.draw(&request.camera, request.settings)?;
            is_cold = describe(&before).counter(CLUSTER_TIME) != 0.0;
        }
        let frame = self.draw(&request.camera, request.settings)?;
        if let Some(path) = &request.picture {
            std::fs::write(path, bytemuck::cast_slice(&frame.picture.pixels))?;
        }
        Ok(describe(&frame))
    }

    fn draw(&mut self, camera: &Camera, settings: Settings) -> Result<Frame, BenchError> {
        Ok(match self {
            Self::Gaussians(parts) => {
                let (renderer, scene, current) = &mut **parts;
                if *current != settings {
                    renderer.set(scene, settings)?;
                    *current = settings;
                }
                renderer.render(scene, camera)?
            }
            Self::Quads(parts) => {
                let (renderer, scene) = &mut **parts;
                renderer.render(scene, camera, settings.sh_degree, settings.alpha_floor)?
            }
        })
    }
}

fn describe(frame: &Frame) -> Drawn {
    let in_time = |category: &str| category == "time";
    Drawn {
        wall: frame.time.as_secs_f64() * 1e3,
        processor: frame.processor_time.map(|time| time.as_secs_f64() * 1e3),
        counters: frame
            .counters
            .iter()
            .map(|counter| {
                let scale = if in_time(&counter.category) { 1e-6 } else { 1.0 };
                (counter.name.clone(), counter.value * scale)
            })
            .collect(),
        stages: frame
            .counters
            .iter()
            .filter(|counter| in_time(&counter.category) && counter.value > 0.0)
            .map(|counter| counter.name.clone())
            .collect(),
        memory: usage::peak_memory(),
    }
}
