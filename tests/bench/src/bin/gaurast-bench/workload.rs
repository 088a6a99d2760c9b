//! The workloads of benchmarks: scenes and camera paths.

use std::fmt;
use std::path::{Path, PathBuf};

use gaurast_oracle::scenes;
use gaurast_scene::camera::{Camera, DEFAULT_FOV, DEFAULT_NEAR, Model};
use gaurast_scene::{Distortion, GaussianShape, Scene};
use serde::{Deserialize, Serialize};

use crate::error::BenchError;

/// Seed of everything that is generated.
const SEED: u64 = 1;

/// Gaussians that reach a tile of [`Source::Tiles`]. Their data fits into a first-level cache.
pub const TILE_GAUSSIANS: usize = 512;

/// The source of Gaussians and cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Source {
    /// `Scene::benchmark` and a path around it.
    Benchmark {
        /// The number of Gaussians.
        count: usize,
    },
    /// The generated garden and a path around it.
    Garden {
        /// The number of Gaussians.
        count: usize,
    },
    /// `Scene::captured`, seen by the cameras of a file or from an orbit.
    Captured {
        /// The number of Gaussians.
        count: usize,
        /// The camera file.
        cameras: Option<PathBuf>,
    },
    /// A scene file and a path around it.
    File {
        /// The scene file.
        path: PathBuf,
    },
    /// Tiles full of Gaussians, each of which covers the whole tile or one block of it.
    Tiles {
        /// True if each Gaussian covers the whole tile.
        whole: bool,
        /// The number of tiles, side by side.
        tiles: usize,
    },
    /// An opaque wall around the benchmark scene's centre.
    Wall,
}

/// Additional Gaussians that are not visible.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Extra {
    /// A benchmark scene outside the picture.
    Beside {
        /// The number of Gaussians.
        count: usize,
    },
    /// A smaller benchmark scene behind the wall.
    Behind {
        /// The number of Gaussians.
        count: usize,
    },
}

/// A scene, possibly modified, and the size of its pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Workload {
    /// The scene.
    pub source: Source,
    /// The factor of its standard deviations.
    pub scale: f32,
    /// The share of its Gaussians that is moved off the screen.
    pub away: f64,
    /// True if the scene's colours are the same from all directions.
    #[serde(default)]
    pub plain: bool,
    /// The Gaussians that are added, in shuffled order.
    pub extra: Option<Extra>,
    /// The pictures' size.
    pub size: [u32; 2],
}

impl Workload {
    /// The unmodified scene.
    pub fn new(source: Source, size: [u32; 2]) -> Self {
        Self { source, scale: 1.0, away: 0.0, plain: false, extra: None, size }
    }

    /// The scene.
    pub fn scene(&self) -> Result<Scene, BenchError> {
        let scene = match &self.source {
            Source::Benchmark { count } => scenes::synthetic(SEED, *count),
            Source::Garden { count } => gaurast_scene::garden::scene(SEED, *count),
            Source::Captured { count, .. } => scenes::trained_like(SEED, *count, &self.source.cameras(self.size)?),
            Source::File { path } => gaurast_scene::open(path)?,
            Source::Tiles { whole, tiles: count } => tiles(*whole, *count),
            Source::Wall => wall(),
        };
        let mut scene = scenes::partly_moved_away(&scenes::scaled(&scene, self.scale), self.away);
        if self.plain {
            scene = scenes::view_independent(&scene);
        }
        let unseen = match self.extra {
            None => return Ok(scene),
            Some(Extra::Beside { count }) => {
                scenes::moved(&scenes::synthetic(SEED, count), |[x, y, z]| [x, y + 30.0, z])
            }
            Some(Extra::Behind { count }) => {
                scenes::moved(&scenes::synthetic(SEED, count), |position| position.map(|at| 0.5 * at))
            }
        };
        Ok(scenes::shuffled_with(&scene, &unseen, SEED))
    }

    /// `count` different views, in the order of the path: a few degrees from frame to frame, so that no result of the
    /// last frame can be reused.
    pub fn views(&self, scene: &Scene, count: usize) -> Result<Vec<Camera>, BenchError> {
        self.turning_views(scene, count, 0.05)
    }

    /// `count` views, in the order of the path. A camera that turns around a scene turns by `step` radians from view to
    /// view.
    pub fn turning_views(&self, scene: &Scene, count: usize, step: f64) -> Result<Vec<Camera>, BenchError> {
        let size = self.size;
        let around = |camera: Camera, pivot: [f64; 3]| {
            (0..count).map(|frame| camera.turned(pivot, [0.0, 1.0, 0.0], step * frame as f64)).collect()
        };
        Ok(match &self.source {
            Source::Benchmark { .. } | Source::Wall => around(scenes::synthetic_camera(size), [0.0; 3]),
            Source::Garden { .. } => around(gaurast_scene::garden::camera(None, size)?, [0.0; 3]),
            Source::Captured { .. } => {
                let cameras = self.source.cameras(size)?;
                (0..count).map(|frame| cameras[frame * cameras.len() / count.max(1) % cameras.len()].clone()).collect()
            }
            Source::File { .. } => {
                let camera = gaurast_scene::frame_middle(scene, DEFAULT_FOV, size);
                // The path goes around a point ahead of the camera, at the distance of the scene's centre.
                let distance = distance_to(scene, &camera);
                let pivot = std::array::from_fn(|axis| camera.eye[axis] + distance * camera.rotation[2][axis]);
                around(camera, pivot)
            }
            Source::Tiles { .. } => vec![tiles_camera(self.size); count],
        })
    }
}

impl Source {
    fn cameras(&self, size: [u32; 2]) -> Result<Vec<Camera>, BenchError> {
        let Self::Captured { cameras: Some(path), .. } = self else {
            return Ok(Camera::orbit(90, size));
        };
        let views = gaurast_scene::camera_files::load(path, size)?;
        if views.is_empty() {
            return Err(BenchError::NoCamera(path.clone()));
        }
        Ok(views.into_iter().map(|view| view.camera.resized(size)).collect())
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match self {
            Self::Benchmark { count } => write!(f, "synthetic {}", short(*count)),
            Self::Garden { count } => write!(f, "garden {}", short(*count)),
            Self::Captured { count, cameras } => {
                let path = cameras.as_deref().map_or("orbit".to_owned(), stem);
                write!(f, "{path}-like {}", short(*count))
            }
            Self::File { path } => write!(f, "{}", stem(path)),
            Self::Wall => write!(f, "wall"),
            Self::Tiles { whole: true, .. } => write!(f, "tiles, covered"),
            Self::Tiles { whole: false, .. } => write!(f, "tiles, dust"),
        }
    }
}

/// The count in short form, such as 300k or 6M.
fn short(count: usize) -> String {
    match count {
        1_000_000.. => format!("{}M", count as f64 / 1e6),
        1000.. => format!("{}k", count as f64 / 1e3),
        _ => count.to_string(),
    }
}

/// The distance of the centre of the scene's Gaussians along the line of sight.
fn distance_to(scene: &Scene, camera: &Camera) -> f64 {
    let mut depths: Vec<f64> = scene
        .positions()
        .iter()
        .map(|position| {
            (0..3).map(|axis| camera.rotation[2][axis] * (f64::from(position[axis]) - camera.eye[axis])).sum()
        })
        .filter(|depth: &f64| depth.is_finite())
        .collect();
    depths.sort_by(f64::total_cmp);
    depths.get(depths.len() / 2).copied().unwrap_or(1.0)
}

/// Tiles in a row, each with [`TILE_GAUSSIANS`] Gaussians that are too faint to saturate it.
fn tiles(whole: bool, tiles: usize) -> Scene {
    let copies = if whole { 1 } else { tiles };
    let mut scene = Scene::with_capacity(0, TILE_GAUSSIANS * copies);
    for index in 0..TILE_GAUSSIANS {
        // The Gaussian is in the middle of a block and too small to reach another block.
        let block = |i: usize| (4 * (i % 4)) as f32 - 6.0;
        let (scale, opacity) = if whole { (40.0 * tiles as f32, 0.009) } else { (0.01, 0.05) };
        let shape = GaussianShape { scale: [scale; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity };
        let depth = 100.0 + 0.001 * index as f32;
        for tile in 0..copies {
            let x = block(index) + (16 * tile) as f32;
            scene.push([x, block(index / 4), depth], shape, &[[0.5; 3]]);
        }
    }
    scene
}

/// A cylinder of opaque Gaussians about the y axis, between the benchmark's camera and the origin.
fn wall() -> Scene {
    const RADIUS: f32 = 4.5;
    const LAYERS: u32 = 4;
    let (columns, rows) = (96, 40);
    let count = (LAYERS * columns * rows) as usize;
    let mut scene = Scene::with_capacity(3, count);
    let mut sh = [[0.0; 3]; 16];
    for layer in 0..LAYERS {
        for column in 0..columns {
            for row in 0..rows {
                let angle = std::f32::consts::TAU * (column as f32 + 0.25 * layer as f32) / columns as f32;
                let radius = RADIUS + 0.01 * layer as f32;
                let y = 0.25 * (row as f32 - 0.5 * rows as f32);
                sh[0] = [0.3 + 0.4 * (column % 2) as f32, 0.1, 0.3 * (row % 2) as f32];
                let shape = GaussianShape { scale: [0.4; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity: 0.99 };
                scene.push([radius * angle.sin(), y, radius * angle.cos()], shape, &sh);
            }
        }
    }
    scene
}

/// A camera that shows one unit at a distance of 100 as one pixel.
fn tiles_camera([width, height]: [u32; 2]) -> Camera {
    Camera {
        model: Model::Pinhole,
        rotation: [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
        eye: [0.0; 3],
        focal: [100.0; 2],
        principal: [8.0; 2],
        distortion: Distortion::default(),
        width,
        height,
        near: DEFAULT_NEAR,
        far: f64::INFINITY,
    }
}
