//! A contender draws in a process of its own, so that its threads, environment and memory are its own, and so that
//! several can take turns. Parent and child speak lines of JSON.

use std::io::{BufRead, BufReader, Write, stdin, stdout};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use gaurast_bench::quads::QuadRenderer;
use gaurast_render::process_stats as usage;
use gaurast_render::{DeviceScene, Frame, Renderer, Settings};
use gaurast_scene::Scene;
use gaurast_scene::camera::Camera;
use serde::{Deserialize, Serialize};

use super::workload::Workload;
use crate::error::BenchError;

/// The hidden command that makes a process a worker.
pub const COMMAND: &str = "worker";

/// lavapipe's manifest, where distributions put it.
const LAVAPIPE_FOLDERS: [&str; 3] = ["/usr/share", "/etc", "/usr/local/share"];

/// What draws, and on what.
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
pub const CONTENDERS: [Contender; 3] = [
    Contender::Gaurast,
    Contender::QuadsOnLavapipe,
    Contender::QuadsOnGaurast,
];

/// What a worker is told first.
#[derive(Serialize, Deserialize)]
struct Setup {
    contender: Contender,
    workload: Workload,
    threads: usize,
}

/// What it is told then, again and again.
#[derive(Serialize, Deserialize)]
struct Request {
    camera: Camera,
    settings: Settings,
    /// Where the picture goes, if it is wanted.
    picture: Option<PathBuf>,
    /// Whether it may be drawn unmeasured before.
    #[serde(default)]
    is_independent: bool,
}

/// What it answers.
#[derive(Serialize, Deserialize)]
enum Reply {
    Ready(Ready),
    Drawn(Drawn),
    Failed(String),
}

/// What a worker is, once it has its scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Ready {
    /// The device's name.
    pub device: String,
    /// Milliseconds to make the device and copy the scene to it.
    pub upload: f64,
}

/// What a frame took. Times are in milliseconds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Drawn {
    /// From the camera to the picture in host memory.
    pub wall: f64,
    /// Of all threads, if known.
    pub processor: Option<f64>,
    /// The device's counters, or the steps of quads: name, value; times in milliseconds.
    pub counters: Vec<(String, f64)>,
    /// Names of those counters that are times.
    pub stages: Vec<String>,
    /// The most memory since the worker was ready, in bytes, if known.
    pub memory: Option<u64>,
}

impl Drawn {
    /// A counter's value, 0 if there is none.
    pub fn counter(&self, name: &str) -> f64 {
        let found = self.counters.iter().find(|(own, _)| own == name);
        found.map_or(0.0, |(_, value)| *value)
    }
}

/// The whole input of a worker that draws `views` one after the other and ends.
///
/// # Errors
/// If it cannot be written as JSON.
pub fn input(workload: &Workload, views: &[Camera]) -> Result<Vec<u8>, BenchError> {
    let mut input = Vec::new();
    let setup = Setup {
        contender: Contender::Gaurast,
        workload: workload.clone(),
        threads: 1,
    };
    say(&mut input, &setup)?;
    for camera in views {
        let request = Request {
            camera: camera.clone(),
            settings: Settings::default(),
            picture: None,
            is_independent: false,
        };
        say(&mut input, &request)?;
    }
    Ok(input)
}

/// Checks that a worker with this output drew all that it was asked to.
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

/// A worker as its parent sees it.
pub struct Worker {
    child: Child,
    requests: Option<ChildStdin>,
    replies: BufReader<ChildStdout>,
    /// What it said when it was ready.
    pub ready: Ready,
}

/// A worker that was not asked for so long is warmed up again.
const PAUSE: Duration = Duration::from_millis(100);

/// The counter of the time in which clusters are made.
const CLUSTER_TIME: &str = "clusters";

/// What this driver leaves out in benchmarks: all but what only saves where two frames are the same.
pub const OPTIMIZATIONS: &str = "all,-temporal-reuse";

impl Worker {
    /// Starts a worker that shares its work among `threads`; `None` if its device is not there.
    pub fn start(
        contender: Contender,
        workload: &Workload,
        threads: usize,
    ) -> Result<Option<Self>, BenchError> {
        let optimizations = std::env::var("GAURAST_OPTIMIZATIONS");
        let optimizations = optimizations.unwrap_or_else(|_| OPTIMIZATIONS.to_owned());
        Self::with_optimizations(contender, workload, threads, &optimizations)
    }

    /// As [`Worker::start`]; `optimizations` says what this driver leaves out.
    pub fn with_optimizations(
        contender: Contender,
        workload: &Workload,
        threads: usize,
        optimizations: &str,
    ) -> Result<Option<Self>, BenchError> {
        let mut command = Command::new(std::env::current_exe()?);
        command
            .arg(COMMAND)
            .env("GAURAST_OPTIMIZATIONS", optimizations)
            .env("GAURAST_THREADS", threads.to_string())
            // The threads that rasterize; the queue has one more, for vertices.
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
            ready: Ready {
                device: String::new(),
                upload: 0.0,
            },
        };
        let setup = Setup {
            contender,
            workload: workload.clone(),
            threads,
        };
        match worker.ask(&setup)? {
            Reply::Ready(ready) => worker.ready = ready,
            reply => return Err(reply.unexpected(contender)),
        }
        Ok(Some(worker))
    }

    /// Draws a frame, and leaves its pixels in the file `picture` if that is given.
    pub fn draw(
        &mut self,
        camera: &Camera,
        settings: Settings,
        picture: Option<&Path>,
    ) -> Result<Drawn, BenchError> {
        self.request(&Request {
            camera: camera.clone(),
            settings,
            picture: picture.map(Path::to_owned),
            is_independent: true,
        })
    }

    /// Draws a frame of which the time depends on the one before: it is never drawn twice.
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
        let requests = self
            .requests
            .as_mut()
            .ok_or_else(|| std::io::Error::from(std::io::ErrorKind::BrokenPipe))?;
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
        // Without further requests, it ends.
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
            [
                folder.join(format!("lvp_icd.{arch}.json")),
                folder.join("lvp_icd.json"),
            ]
        })
        .find(|path| path.exists())
}

/// The pixels in a file that a worker left.
pub fn read_picture(path: &Path) -> Result<Vec<[f32; 4]>, BenchError> {
    Ok(bytemuck::pod_collect_to_vec(&std::fs::read(path)?))
}

fn say(to: &mut impl Write, message: &impl Serialize) -> Result<(), BenchError> {
    let mut line = serde_json::to_vec(message)?;
    line.push(b'\n');
    to.write_all(&line)?;
    Ok(to.flush()?)
}

/// A worker's life.
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
        // A picture of another size than the last one has new memory, which one thread touches for the first time; and after a
        // pause, as when others had their turn, schedulers leave threads together on one processor for as long as a frame
        // takes. Neither is part of what a frame takes, nor are the clusters that a frame makes, but of the first two: the cold
        // one, and the first that makes some.
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
                let mut renderer = Renderer::new(vulkan_gaurast::entry())?;
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
                let renderer = QuadRenderer::new(vulkan_gaurast::entry(), "", setup.threads)?;
                let device = renderer.device_name().to_owned();
                (Self::Quads(Box::new((renderer, scene))), device)
            }
        };
        let upload = start.elapsed().as_secs_f64() * 1e3;
        Ok((artist, Ready { device, upload }))
    }

    /// Draws what is asked for; if it is to `warm_up`, also before, until a frame makes no clusters.
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
                let scale = if in_time(&counter.category) {
                    1e-6
                } else {
                    1.0
                };
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
