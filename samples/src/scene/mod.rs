//! Scenes of 3D Gaussians: reading them from files, generating them, and holding them as the
//! device takes them.
//!
//! Every [`Scene`] is in the frame of the original 3D Gaussian splatting code and its PLY files:
//! +x right, +y **down**, +z forward. PLY, compressed PLY and `.splat` files are kept as they are;
//! SPZ files, which are right-up-back, are turned half around x.

mod benchmark;
mod captured;
mod edit;
mod error;
mod format;
mod generate;

mod ply;
mod splat;
mod spz;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use bytemuck::{Pod, Zeroable};

pub use error::{Place, Reason, SceneError};
use format::Input;
pub use format::known_extensions;
use gaurast_oracle::scenes::SceneBuffers;
pub use generate::DEFAULT_COUNT;

/// The value of the constant spherical harmonic, 1 / (2 sqrt(pi)).
pub(crate) const SH_C0: f64 = 0.282_094_791_773_878_14;

/// The highest spherical harmonics degree that a [`Scene`] holds.
pub const MAX_SH_DEGREE: u32 = 4;

/// What one Gaussian is, apart from its position and its colour: 32 bytes, as a vertex buffer
/// holds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Shape {
    /// Standard deviations along the Gaussian's own axes, in the scene's units (not logarithms).
    pub scale: [f32; 3],
    /// Rotation from the Gaussian's own axes to the scene's: a quaternion w, x, y, z as the file
    /// stores it. It need not be normalised; the device does that.
    pub rotation: [f32; 4],
    /// Opacity at the centre, 0 to 1 (not a logit).
    pub opacity: f32,
}

/// A set of 3D Gaussians, held as parallel arrays ready for upload.
///
/// Values may be non-finite where a file says so: the device skips and counts such Gaussians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    positions: Vec<[f32; 3]>,
    shapes: Vec<Shape>,
    sh_degree: u32,
    sh: Vec<[f32; 3]>,
}

impl Scene {
    /// An empty scene of spherical harmonics degree `sh_degree`, with room for `count` Gaussians.
    ///
    /// # Panics
    /// If `sh_degree` exceeds [`MAX_SH_DEGREE`].
    pub fn with_capacity(sh_degree: u32, count: usize) -> Self {
        assert!(
            sh_degree <= MAX_SH_DEGREE,
            "spherical harmonics degree {sh_degree} exceeds {MAX_SH_DEGREE}"
        );
        Self {
            positions: Vec::with_capacity(count),
            shapes: Vec::with_capacity(count),
            sh_degree,
            sh: Vec::with_capacity(count.saturating_mul(sh_coefficients(sh_degree))),
        }
    }

    /// Reads the scene file at `path`.
    ///
    /// # Errors
    /// If the file cannot be opened or read, is of no known kind, or is malformed.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_through(path, |file, _| file)
    }

    /// As [`Scene::load`], reading through what `wrap` makes of the file and its size in bytes: a
    /// reader that shows progress, say.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load_through<R: Read>(
        path: &Path,
        wrap: impl FnOnce(File, u64) -> R,
    ) -> Result<Self, SceneError> {
        let io = |source| SceneError::Io {
            path: path.to_owned(),
            source,
        };
        let file = File::open(path).map_err(io)?;
        let metadata = file.metadata().map_err(io)?;
        if metadata.is_dir() {
            return Err(io(std::io::ErrorKind::IsADirectory.into()));
        }
        let len = metadata.len();
        let mut reader = BufReader::with_capacity(1 << 20, wrap(file, len));
        Self::read(path, &mut reader, len)
    }

    /// Reads a scene of `len` bytes from `reader`; `path` picks the format and names the file in
    /// errors.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn read(path: &Path, reader: &mut dyn BufRead, len: u64) -> Result<Self, SceneError> {
        let start = reader.fill_buf().map_err(|source| SceneError::Io {
            path: path.to_owned(),
            source,
        })?;
        let format = format::choose(path, start).ok_or_else(|| SceneError::UnknownFormat {
            path: path.to_owned(),
        })?;
        log::debug!("reading {} as {}", path.display(), format.name());
        format
            .load(&mut Input::new(reader, len))
            .map_err(|fault| fault.of(path))
    }

    /// Appends a Gaussian. `sh` holds its spherical harmonics coefficients, (degree + 1)^2 RGB
    /// triples with the constant one first.
    ///
    /// # Panics
    /// If `sh` is of any other length.
    pub fn push(&mut self, position: [f32; 3], shape: Shape, sh: &[[f32; 3]]) {
        assert_eq!(sh.len(), self.sh_stride(), "coefficients of one Gaussian");
        self.positions.push(position);
        self.shapes.push(shape);
        self.sh.extend_from_slice(sh);
    }

    /// The number of Gaussians.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Centres, in the scene's units.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// Scale, rotation and opacity of each Gaussian.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The spherical harmonics degree stored, 0 to [`MAX_SH_DEGREE`].
    pub fn sh_degree(&self) -> u32 {
        self.sh_degree
    }

    /// The number of coefficients (RGB triples) of each Gaussian, (degree + 1)^2.
    pub fn sh_stride(&self) -> usize {
        sh_coefficients(self.sh_degree)
    }

    /// The coefficients of all Gaussians, [`Scene::sh_stride`] RGB triples each, in 3DGS's order
    /// and signs; a colour is 0.5 plus their sum weighted by the basis functions.
    pub fn sh(&self) -> &[[f32; 3]] {
        &self.sh
    }

    /// The coefficients of Gaussian `index`, for a reader that meets them after the rest.
    fn sh_of_mut(&mut self, index: usize) -> &mut [[f32; 3]] {
        let stride = self.sh_stride();
        &mut self.sh[index * stride..][..stride]
    }
}

impl From<&Scene> for SceneBuffers {
    /// The scene as the oracle takes it.
    fn from(scene: &Scene) -> Self {
        let shapes = scene.shapes();
        Self {
            positions: scene.positions().to_vec(),
            scales: shapes.iter().map(|shape| shape.scale).collect(),
            rotations: shapes.iter().map(|shape| shape.rotation).collect(),
            opacities: shapes.iter().map(|shape| shape.opacity).collect(),
            sh: scene.sh().to_vec(),
            degree: scene.sh_degree(),
        }
    }
}

/// The number of coefficients of all degrees up to `degree`.
fn sh_coefficients(degree: u32) -> usize {
    (degree as usize + 1).pow(2)
}

/// The logistic function, evaluated in binary64 and rounded once.
fn sigmoid(logit: f64) -> f32 {
    (1.0 / (1.0 + (-logit).exp())) as f32
}
