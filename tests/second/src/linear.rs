//! Vectors of three and matrices of three rows, in binary64.

pub(crate) type Vector = [f64; 3];
pub(crate) type Matrix = [Vector; 3];

pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn subtract(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn scaled(a: Vector, factor: f64) -> Vector {
    a.map(|component| component * factor)
}

/// The matrix times a column.
pub(crate) fn apply(matrix: &Matrix, column: Vector) -> Vector {
    [dot(matrix[0], column), dot(matrix[1], column), dot(matrix[2], column)]
}

/// A row times the matrix.
pub(crate) fn row_times(row: Vector, matrix: &Matrix) -> Vector {
    [0, 1, 2].map(|column| row[0] * matrix[0][column] + row[1] * matrix[1][column] + row[2] * matrix[2][column])
}

pub(crate) fn widened<const N: usize>(values: [f32; N]) -> [f64; N] {
    values.map(f64::from)
}
