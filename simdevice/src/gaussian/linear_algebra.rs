//! Vectors and matrices of three dimensions in binary64, without fused operations.

/// A map of space: a matrix, and the translation after it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Affine {
    pub(crate) linear: Linear,
    pub(crate) translation: [f64; 3],
}

/// The inverse of a matrix.
pub(crate) struct Inverse {
    pub(crate) matrix: Linear,
    /// The condition number: the product of both matrices' Frobenius norms.
    pub(crate) condition: f64,
}

/// The rows of a matrix without its translation.
pub(crate) type Linear = [[f64; 3]; 3];

/// A matrix is singular if its determinant is not greater than this times the product of its rows' lengths.
const SINGULAR: f64 = 1.0 / (1u64 << 40) as f64;

/// The dot product.
#[inline]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The cross product.
#[inline]
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The length of a vector.
#[inline]
pub(crate) fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// True if a matrix is singular, or almost.
#[inline]
pub(crate) fn is_singular(a: Linear) -> bool {
    let determinant = dot(a[0], cofactors(a)[0]).abs();
    let lengths = a.map(|row| dot(row, row).sqrt());
    let regular = determinant > SINGULAR * lengths[0] * lengths[1] * lengths[2];
    !regular
}

/// The inverse of a matrix. Neither it nor its condition number is finite for a matrix of determinant zero.
#[inline]
pub(crate) fn inverse(a: Linear) -> Inverse {
    let columns = cofactors(a);
    let determinant = dot(a[0], columns[0]);
    let inverse = [0, 1, 2].map(|row| columns.map(|column| column[row] / determinant));
    let norm = |a: Linear| a.map(|row| dot(row, row)).iter().sum::<f64>().sqrt();
    Inverse { matrix: inverse, condition: norm(a) * norm(inverse) }
}

/// The columns of the inverse, times the determinant.
#[inline]
pub(crate) fn cofactors(a: Linear) -> Linear {
    [cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])]
}

/// The axes of a quaternion's rotation in the world: the columns of its matrix.
#[inline]
pub(crate) fn axes(rotation: [f64; 4]) -> [[f64; 3]; 3] {
    let largest = rotation.iter().fold(0.0f64, |a, c| a.max(c.abs()));
    let scaled = rotation.map(|c| c / largest);
    let norm = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
    let [w, x, y, z] = scaled.map(|c| c / norm);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
        [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
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
