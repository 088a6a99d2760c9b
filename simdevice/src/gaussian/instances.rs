//! Models: matrices that place Gaussians in the world, usually one for each instance.
//!
//! The matrix [A b] takes a mean p to A p + b and a covariance S to A S A^T. Spherical harmonics stay in the Gaussians'
//! own space: the viewing direction is transformed to it by the inverse of A.

use super::attributes::{Fetcher, Group};
use super::lanes::{Bits, F32_LANES, GROUP, GroupF64};
use crate::packet::{AttributeStream, GaussianAppend};

/// The matrices of a group's Gaussians as they are read, an element per lane.
#[derive(Clone, Debug)]
pub(super) struct Matrices {
    pub(super) rows: [[[f32; F32_LANES]; 4]; 3],
    /// True if all lanes have the same matrix.
    is_uniform: bool,
}

/// The rows of a matrix without its translation.
pub(super) type Linear = [[f64; 3]; 3];

/// The matrices of the kept Gaussians of a group in binary64, and the viewing directions in the Gaussians' own space.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) matrix: [[GroupF64; 4]; 3],
    /// A vector from the eye in the Gaussians' space, of any length.
    pub(super) toward: [GroupF64; 3],
}

/// The model of an instance whose model attributes are per instance.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InstanceTransform {
    /// The rows of the matrix, and its translation.
    pub(super) matrix: Option<(Linear, [f64; 3])>,
    opacity: Option<f32>,
}

impl InstanceTransform {
    /// Reads the model of an instance. Its attributes must be per instance.
    pub(super) fn read(append: &GaussianAppend, instance: u32) -> Self {
        let mut fetcher = Fetcher::default();
        let group = Group::new(append, instance, 0, 1);
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
    pub(super) fn greatest_opacity(&self, opacity: f32) -> f32 {
        match self.opacity {
            None => opacity,
            Some(factor) if factor >= 0.0 => opacity * factor,
            // With a negative factor the least opacity becomes the greatest, and it is unknown.
            Some(_) => f32::INFINITY,
        }
    }
}

/// A matrix is singular if its determinant is not greater than this times the product of its rows' lengths.
const SINGULAR: f64 = 1.0 / (1u64 << 40) as f64;

impl Default for Matrices {
    fn default() -> Self {
        Self { rows: [[[0.0; F32_LANES]; 4]; 3], is_uniform: false }
    }
}

impl Matrices {
    /// Reads a group's matrices.
    pub(super) fn read(&mut self, fetcher: &mut Fetcher, rows: &[AttributeStream; 3], group: &Group<'_>) {
        self.is_uniform = rows.iter().all(|stream| stream.instance_divisor.is_some());
        for (stream, row) in rows.iter().zip(&mut self.rows) {
            fetcher.read(stream, group, row.each_mut());
        }
    }

    /// The matrix of all lanes and its translation; `None` if lanes may differ.
    pub(super) fn uniform(&self) -> Option<(Linear, [f64; 3])> {
        let element = |row: usize, column: usize| f64::from(self.rows[row][column][0]);
        let linear = [0, 1, 2].map(|row| [0, 1, 2].map(|column| element(row, column)));
        self.is_uniform.then(|| (linear, [0, 1, 2].map(|row| element(row, 3))))
    }

    /// The lanes among the first `len` whose matrices are finite.
    pub(super) fn find_finite(&self, len: usize) -> Bits {
        let mut finite = Bits::default();
        for lane in 0..len.min(GROUP) {
            let elements = self.rows.as_flattened();
            finite.set_one(lane, elements.iter().all(|lanes| lanes[lane].is_finite()));
        }
        finite
    }
}

impl Placed {
    /// A kept Gaussian's matrix, without the translation.
    pub(super) fn linear(&self, at: usize) -> Linear {
        [0, 1, 2].map(|row| [0, 1, 2].map(|column| self.matrix[row][column][at]))
    }

    /// A vector in the axes of a kept Gaussian's space, transformed to the axes of the world.
    pub(super) fn to_world(&self, at: usize, vector: [f64; 3]) -> [f64; 3] {
        self.linear(at).map(|row| dot(row, vector))
    }

    /// A row vector in the world's axes, transformed to the axes of a kept Gaussian's space. NaN if the matrix is
    /// singular.
    pub(super) fn row_from_world(&self, at: usize, row: [f64; 3]) -> [f64; 3] {
        let a = self.linear(at);
        if is_singular(a) {
            return [f64::NAN; 3];
        }
        [0, 1, 2].map(|column| row[0] * a[0][column] + row[1] * a[1][column] + row[2] * a[2][column])
    }
}

fn is_singular(a: Linear) -> bool {
    let determinant = dot(a[0], cofactors(a)[0]).abs();
    let lengths = a.map(|row| dot(row, row).sqrt());
    let regular = determinant > SINGULAR * lengths[0] * lengths[1] * lengths[2];
    !regular
}

/// The inverse of a matrix and its condition number, the product of both matrices' Frobenius norms. Neither is finite
/// for a matrix of determinant zero.
pub(super) fn inverse(a: Linear) -> (Linear, f64) {
    let columns = cofactors(a);
    let determinant = dot(a[0], columns[0]);
    let inverse = [0, 1, 2].map(|row| columns.map(|column| column[row] / determinant));
    let norm = |a: Linear| a.map(|row| dot(row, row)).iter().sum::<f64>().sqrt();
    (inverse, norm(a) * norm(inverse))
}

/// The columns of the inverse, times the determinant.
pub(super) fn cofactors(a: Linear) -> Linear {
    [cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn matrices_that_flatten_space_are_singular() {
        assert!(!is_singular([[1e-9, 0.0, 0.0], [0.0, 1e9, 0.0], [3.0, 0.0, -2.0]]));
        assert!(is_singular([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]]));
        let third = 1.0f32 / 3.0;
        let row = [0.1f32, 0.7, third].map(f64::from);
        assert!(is_singular([row, row.map(|x| 3.0 * x), [0.3, 0.2, 0.9]]));
        assert!(is_singular([[f64::NAN; 3]; 3]));
    }

    #[gaurast_runner::test]
    fn cofactors_are_the_inverse() {
        let a = [[1.0, 2.0, 0.5], [-1.0, 3.0, 0.25], [0.0, 4.0, -2.0]];
        let columns = cofactors(a);
        let determinant = dot(a[0], columns[0]);
        for (row, of_a) in a.into_iter().enumerate() {
            for (column, of_inverse) in columns.into_iter().enumerate() {
                let expected = if row == column { determinant } else { 0.0 };
                assert!((dot(of_a, of_inverse) - expected).abs() < 1e-12);
            }
        }
    }
}
