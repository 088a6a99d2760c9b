//! Vectors and matrices of binary64.

pub(super) fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Matrix (row-major) times column.
pub(super) fn transform(matrix: &[f64; 9], v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|row| dot([matrix[3 * row], matrix[3 * row + 1], matrix[3 * row + 2]], v))
}

/// Row times matrix (row-major).
pub(super) fn multiply_row(v: [f64; 3], matrix: &[f64; 9]) -> [f64; 3] {
    std::array::from_fn(|column| dot(v, [matrix[column], matrix[3 + column], matrix[6 + column]]))
}
