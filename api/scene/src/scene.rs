//! A set of 3D Gaussians, as parallel arrays.

use bytemuck::{Pod, Zeroable};

use crate::metadata::{Antialiasing, Geometry, Metadata};

/// The value of the constant spherical harmonic, 1 / (2 sqrt(pi)).
pub const SH_C0: f64 = 0.282_094_791_773_878_14;

/// The highest spherical harmonics degree that a [`Scene`] holds.
pub const MAX_SH_DEGREE: u32 = 4;

/// What one Gaussian is, apart from its position and its colour: 32 bytes, as a vertex buffer
/// holds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GaussianShape {
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
    shapes: Vec<GaussianShape>,
    sh_degree: u32,
    sh: Vec<[f32; 3]>,
    metadata: Metadata,
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
            metadata: Metadata::default(),
        }
    }

    /// What the scene's file says of itself.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// The same, for changes.
    pub fn metadata_mut(&mut self) -> &mut Metadata {
        &mut self.metadata
    }

    /// How the scene wants Gaussians to be filtered: what its file says, or as 3DGS does.
    pub fn antialiasing(&self) -> Antialiasing {
        self.metadata.antialiasing.unwrap_or_default()
    }

    /// What the scene's Gaussians are: what its file says, or volumes.
    pub fn geometry(&self) -> Geometry {
        self.metadata.geometry.unwrap_or_default()
    }

    /// Appends a Gaussian. `sh` holds its spherical harmonics coefficients, (degree + 1)^2 RGB
    /// triples with the constant one first.
    ///
    /// # Panics
    /// If `sh` is of any other length.
    pub fn push(&mut self, position: [f32; 3], shape: GaussianShape, sh: &[[f32; 3]]) {
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
    pub fn shapes(&self) -> &[GaussianShape] {
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
    pub(crate) fn sh_of_mut(&mut self, index: usize) -> &mut [[f32; 3]] {
        let stride = self.sh_stride();
        &mut self.sh[index * stride..][..stride]
    }
}

/// The number of coefficients of all degrees up to `degree`.
pub(crate) fn sh_coefficients(degree: u32) -> usize {
    (degree as usize + 1).pow(2)
}

/// The logistic function, evaluated in binary64 and rounded once.
pub fn sigmoid(logit: f64) -> f32 {
    (1.0 / (1.0 + (-logit).exp())) as f32
}
