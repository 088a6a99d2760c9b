//! Models: matrices that place Gaussians in the world, usually one for each instance.
//!
//! The matrix [A b] takes a mean p to A p + b and a covariance S to A S A^T. Spherical harmonics stay in the Gaussians'
//! own space: the viewing direction is transformed to it by the inverse of A.

use super::attributes::{Fetcher, GroupVertices};
use crate::gaussian::lanes::{Bits, F32_LANES, GROUP};
use crate::gaussian::linear_algebra::Affine;
use crate::packet::{AttributeStream, GaussianAppend};

/// The matrices of a group's Gaussians as they are read, an element per lane.
#[derive(Clone, Debug)]
pub(crate) struct Matrices {
    pub(crate) rows: [[[f32; F32_LANES]; 4]; 3],
    /// True if all lanes have the same matrix.
    is_uniform: bool,
}

impl Default for Matrices {
    fn default() -> Self {
        Self { rows: [[[0.0; F32_LANES]; 4]; 3], is_uniform: false }
    }
}

impl Matrices {
    /// Reads a group's matrices.
    pub(crate) fn read(&mut self, fetcher: &mut Fetcher, rows: &[AttributeStream; 3], group: &GroupVertices<'_>) {
        self.is_uniform = rows.iter().all(|stream| group.is_uniform(stream));
        for (stream, row) in rows.iter().zip(&mut self.rows) {
            fetcher.read(stream, group, row.each_mut());
        }
    }

    /// The matrix of all lanes and its translation; `None` if lanes may differ.
    pub(crate) fn uniform(&self) -> Option<Affine> {
        let element = |row: usize, column: usize| f64::from(self.rows[row][column][0]);
        let linear = [0, 1, 2].map(|row| [0, 1, 2].map(|column| element(row, column)));
        self.is_uniform.then(|| Affine { linear, translation: [0, 1, 2].map(|row| element(row, 3)) })
    }

    /// The lanes among the first `len` whose matrices are finite.
    pub(crate) fn find_finite(&self, len: usize) -> Bits {
        let mut finite = Bits::default();
        for lane in 0..len.min(GROUP) {
            let elements = self.rows.as_flattened();
            finite.set_one(lane, elements.iter().all(|lanes| lanes[lane].is_finite()));
        }
        finite
    }
}

/// The model of an instance whose model attributes are per instance.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct InstanceTransform {
    /// The matrix and the translation.
    pub(crate) matrix: Option<Affine>,
    opacity: Option<f32>,
}

impl InstanceTransform {
    /// Reads the model of an instance. Its attributes must be per instance.
    pub(crate) fn read(append: &GaussianAppend, instance: u32) -> Self {
        let mut fetcher = Fetcher::default();
        let group = GroupVertices::new(append, instance, 0, 1);
        let model = &append.attributes.model;
        let matrix = model.matrix.as_ref().and_then(|rows| {
            let mut matrices = Matrices::default();
            matrices.read(&mut fetcher, rows, &group);
            matrices.uniform()
        });
        let opacity = model.opacity.as_ref().map(|stream| {
            let mut factor = [0.0; F32_LANES];
            fetcher.read(stream, &group, [&mut factor]);
            factor[0]
        });
        Self { matrix, opacity }
    }

    /// An upper bound of opacities with the model, if they are at most `opacity` without it.
    pub(crate) fn greatest_opacity(&self, opacity: f32) -> f32 {
        match self.opacity {
            None => opacity,
            Some(factor) if factor >= 0.0 => opacity * factor,
            // With a negative factor the least opacity becomes the greatest, and it is unknown.
            Some(_) => f32::INFINITY,
        }
    }
}
