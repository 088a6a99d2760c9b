//! The workloads that are counted, and the process that draws them.
//!
//! Scenes are generated, by additions, multiplications and functions of the crate `libm`, so that they are the same on every machine.

use ash::Entry;
use clap::{Args, ValueEnum};
use gaurast_bench::quads::QuadRenderer;
use gaurast_exact::hash;
use gaurast_render::Renderer;
use gaurast_scene::Scene;
use gaurast_scene::camera::Camera;

use super::compute::Bodies;
use super::error::CountsError;
use super::triangles::Triangles;

/// The pictures' size in pixels.
const SIZE: [u32; 2] = [640, 360];

/// Gaussians of the scenes.
const GAUSSIANS: usize = 20_000;

/// Layers of triangles, which fill the picture.
const LAYERS: u32 = 8;

/// Quads, each of which is two triangles of many pixels.
const QUADS: usize = 3000;

/// The alpha at which a quad ends.
const ALPHA_FLOOR: f32 = 1.0 / 255.0;

/// The work that is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Workload {
    /// The synthetic scene that performance is measured on
    GaussiansSynthetic,
    /// A scene with the statistics of a captured one
    GaussiansCaptured,
    /// Triangles of about four pixels, with depth
    SmallTriangles,
    /// A floor with a filtered texture of several levels
    TexturedTriangles,
    /// Layers that hide one another
    LayeredTriangles,
    /// One layer that fills the picture, as of post-processing
    OneLayer,
    /// A smaller synthetic scene as sorted, blended quads
    BlendedQuads,
    /// A dispatch with workgroup memory
    Compute,
}

/// The hidden command that makes a process a worker.
pub const WORKER: &str = "counts-worker";

/// Arguments of a worker.
#[derive(Args)]
pub struct WorkerArguments {
    /// The workload
    #[arg(value_enum, required = true)]
    workloads: Vec<Workload>,

    /// Frames of each
    #[arg(long)]
    frames: u32,

    /// Draws on the loader's first device instead of the embedded one
    #[arg(long)]
    through_the_loader: bool,
}

impl Workload {
    /// The workloads whose counts are stored. The others only show what an optimization saves.
    pub(super) fn stored() -> impl Iterator<Item = Self> {
        let all = Self::value_variants().iter().copied();
        all.filter(|&workload| workload != Self::OneLayer)
    }

    /// The name, as in the stored tables.
    pub(super) fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Draws `frames` equal frames on the first device of `entry`, and returns the hash of the last one's pixels.
    fn draw(self, entry: Entry, frames: u32) -> Result<u64, CountsError> {
        match self {
            Self::GaussiansSynthetic => {
                let scene = gaurast_oracle::scenes::synthetic(1, GAUSSIANS);
                gaussians(entry, frames, &scene, &gaurast_oracle::scenes::synthetic_camera(SIZE))
            }
            Self::GaussiansCaptured => {
                let cameras = Camera::orbit(8, SIZE);
                let scene = gaurast_oracle::scenes::trained_like(1, GAUSSIANS, &cameras);
                gaussians(entry, frames, &scene, &cameras[0])
            }
            Self::SmallTriangles => triangles(Triangles::small(entry, SIZE)?, frames),
            Self::TexturedTriangles => triangles(Triangles::textured(entry, SIZE)?, frames),
            Self::LayeredTriangles => triangles(Triangles::layered(entry, SIZE, LAYERS)?, frames),
            Self::OneLayer => triangles(Triangles::layered(entry, SIZE, 1)?, frames),
            Self::BlendedQuads => quads(entry, frames),
            Self::Compute => {
                let mut bodies = Bodies::new(entry)?;
                for _ in 0..frames {
                    bodies.run()?;
                }
                Ok(hash(bytemuck::cast_slice(&bodies.result()?)))
            }
        }
    }
}

fn gaussians(entry: Entry, frames: u32, scene: &Scene, camera: &Camera) -> Result<u64, CountsError> {
    let mut renderer = Renderer::new(entry)?;
    let scene = renderer.upload(scene, None)?;
    let mut pixels = Vec::new();
    for _ in 0..frames {
        pixels = renderer.render(&scene, camera)?.picture.pixels;
    }
    Ok(hash(bytemuck::cast_slice(&pixels)))
}

fn triangles(mut triangles: Triangles, frames: u32) -> Result<u64, CountsError> {
    for _ in 0..frames {
        triangles.draw()?;
    }
    Ok(hash(bytemuck::cast_slice(&triangles.picture()?)))
}

fn quads(entry: Entry, frames: u32) -> Result<u64, CountsError> {
    let scene = gaurast_oracle::scenes::synthetic(1, QUADS);
    let mut renderer = QuadRenderer::new(entry, "", 1)?;
    let mut prepared = renderer.prepare(&scene, &gaurast_oracle::scenes::synthetic_camera(SIZE), 3, ALPHA_FLOOR)?;
    for _ in 0..frames {
        prepared.draw()?;
    }
    Ok(hash(bytemuck::cast_slice(&prepared.picture()?.pixels)))
}

/// Draws as `arguments` say, and prints a line for each workload: its name and the hash of its last picture.
pub(super) fn run(arguments: &WorkerArguments) -> Result<(), CountsError> {
    for workload in &arguments.workloads {
        let entry = if arguments.through_the_loader {
            // SAFETY: the system's loader is sound.
            unsafe { Entry::load() }.map_err(|error| CountsError::NoLoader(error.to_string()))?
        } else {
            vulkan_gaurast::entry()
        };
        let hash = workload.draw(entry, arguments.frames)?;
        println!("{} {hash:016x}", workload.name());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_workload_draws_the_same_again() {
        for workload in Workload::value_variants() {
            let draw = |frames| workload.draw(vulkan_gaurast::entry(), frames);
            let (once, twice) = (draw(1).expect("drawn"), draw(2).expect("drawn"));
            assert_eq!(once, twice, "{workload:?}");
        }
    }
}
