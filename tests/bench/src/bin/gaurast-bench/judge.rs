//! The errors of pictures against the binary64 oracle with 3DGS's settings. Every pixel counts.

use std::path::{Path, PathBuf};

use gaurast_oracle::compare::Statistics;
use gaurast_oracle::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_oracle::scenes::SceneBuffers;
use gaurast_scene::Scene;
use gaurast_scene::camera::Camera;
use serde::Serialize;

use super::worker::read_picture;
use crate::error::BenchError;

/// Differences of a picture from the oracle's.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Error {
    /// The greatest difference of a channel.
    pub max: f64,
    /// The 99.9th percentile of the pixels' differences.
    pub p999: f64,
    /// The PSNR in decibels, over red, green and blue.
    pub psnr: f64,
    /// The mean of FLIP.
    pub flip: f64,
    /// The root of the mean square over red, green and blue.
    pub rmse: f64,
}

impl Error {
    fn of(statistics: Statistics) -> Self {
        Self {
            max: statistics.max,
            p999: statistics.p999,
            psnr: statistics.psnr,
            flip: statistics.flip,
            rmse: 10.0_f64.powf(-statistics.psnr / 20.0),
        }
    }

    /// The greatest of each error, and the least PSNR, of both.
    pub fn worst(self, other: Self) -> Self {
        Self {
            max: self.max.max(other.max),
            p999: self.p999.max(other.p999),
            psnr: self.psnr.min(other.psnr),
            flip: self.flip.max(other.flip),
            rmse: self.rmse.max(other.rmse),
        }
    }
}

/// The oracle, prepared for a scene.
pub struct Judge {
    scene: SceneBuffers,
}

impl Judge {
    pub fn new(scene: &Scene) -> Self {
        Self { scene: scene.into() }
    }

    /// The reference picture of the scene, seen by `camera`.
    pub fn reference(&self, camera: &Camera) -> Result<Reference, BenchError> {
        let size = [camera.width, camera.height];
        let oracle = OracleCamera::new(&camera.to_vulkan(), size).ok_or(BenchError::NoOracle)?;
        let drawn = render_bounded(&self.scene.as_oracle(), &oracle, &OracleState::default());
        Ok(Reference { pixels: drawn.to_f32(), size })
    }
}

/// The reference picture of one view.
pub struct Reference {
    pixels: Vec<[f32; 4]>,
    size: [u32; 2],
}

impl Reference {
    /// The error of a picture of `size`. If it is smaller than the reference, it is scaled up first.
    pub fn error(&self, pixels: &[[f32; 4]], size: [u32; 2]) -> Error {
        let stretched;
        let pixels = if size == self.size {
            pixels
        } else {
            stretched = stretch(pixels, size, self.size);
            &stretched
        };
        Error::of(Statistics::new(pixels, &self.pixels, self.size[0]))
    }
}

/// Scales the picture to another size, bilinearly.
fn stretch(pixels: &[[f32; 4]], from: [u32; 2], to: [u32; 2]) -> Vec<[f32; 4]> {
    // The two neighbours along an axis and the weight of the second.
    let neighbours = |axis: usize, place: u32| {
        let at = (f64::from(place) + 0.5) * f64::from(from[axis]) / f64::from(to[axis]) - 0.5;
        let at = at.clamp(0.0, f64::from(from[axis] - 1));
        let first = at.floor();
        let second = (first + 1.0).min(f64::from(from[axis] - 1));
        (first as usize, second as usize, (at - first) as f32)
    };
    let mut out = Vec::with_capacity(to[0] as usize * to[1] as usize);
    for y in 0..to[1] {
        let (top, bottom, down) = neighbours(1, y);
        for x in 0..to[0] {
            let (left, right, along) = neighbours(0, x);
            let mix =
                |a: [f32; 4], b: [f32; 4], t: f32| -> [f32; 4] { std::array::from_fn(|c| a[c] + t * (b[c] - a[c])) };
            let row = |y: usize| {
                let at = |x: usize| pixels[y * from[0] as usize + x];
                mix(at(left), at(right), along)
            };
            out.push(mix(row(top), row(bottom), down));
        }
    }
    out
}

/// A file for a worker's picture. It is deleted with its folder.
pub struct PictureFile {
    folder: tempfile::TempDir,
}

impl PictureFile {
    pub fn new() -> Result<Self, BenchError> {
        Ok(Self { folder: tempfile::tempdir()? })
    }

    pub fn path(&self) -> PathBuf {
        self.folder.path().join("picture")
    }

    pub fn read(&self) -> Result<Vec<[f32; 4]>, BenchError> {
        read_picture(Path::new(&self.path()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretching_keeps_what_is_linear() {
        let ramp = |width: u32| -> Vec<[f32; 4]> {
            (0..width * 2).map(|i| [(i % width) as f32 + 0.5; 4].map(|x| x / width as f32)).collect()
        };
        let stretched = stretch(&ramp(8), [8, 2], [16, 4]);
        assert_eq!(stretched.len(), 64);
        for x in 1..15 {
            assert!((stretched[16 + x][0] - ramp(16)[x][0]).abs() < 1e-6);
        }
        assert_eq!(stretch(&ramp(8), [8, 2], [8, 2]), ramp(8));
    }
}
