//! Model matrices.

use super::inputs::OracleInstance;
use super::vectors::dot;

/// The model matrix of an instance in binary64.
pub struct Model {
    /// The matrix without its translation.
    pub linear: [[f64; 3]; 3],
    /// Its fourth column.
    pub translation: [f64; 3],
}

impl Model {
    pub fn new(instance: &OracleInstance) -> Self {
        let matrix = instance.matrix.map(|row| row.map(f64::from));
        Self { linear: matrix.map(|[x, y, z, _]| [x, y, z]), translation: matrix.map(|row| row[3]) }
    }

    /// A p + b.
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| dot(self.linear[i], p) + self.translation[i])
    }

    /// A v.
    pub fn vector(&self, v: [f64; 3]) -> [f64; 3] {
        self.linear.map(|row| dot(row, v))
    }

    /// Row vector times A.
    pub fn row(&self, v: [f64; 3]) -> [f64; 3] {
        let a = &self.linear;
        std::array::from_fn(|k| v[0] * a[0][k] + v[1] * a[1][k] + v[2] * a[2][k])
    }

    /// True if |det A| is greater than 2^-40 times the product of the lengths of its rows.
    pub fn is_regular(&self) -> bool {
        let lengths: f64 = self.linear.map(|row| dot(row, row).sqrt()).iter().product();
        self.determinant().abs() > lengths / 2f64.powi(40)
    }

    /// The solution x of A x = v, by Cramer's rule.
    pub fn solve(&self, v: [f64; 3]) -> [f64; 3] {
        let determinant = self.determinant();
        std::array::from_fn(|k| {
            let mut replaced = self.linear;
            for (row, value) in replaced.iter_mut().zip(v) {
                row[k] = value;
            }
            determinant3(&replaced) / determinant
        })
    }

    fn determinant(&self) -> f64 {
        determinant3(&self.linear)
    }
}

fn determinant3(a: &[[f64; 3]; 3]) -> f64 {
    let minor = |i: usize, j: usize| a[1][i] * a[2][j] - a[1][j] * a[2][i];
    a[0][0] * minor(1, 2) - a[0][1] * minor(0, 2) + a[0][2] * minor(0, 1)
}

#[test]
fn solving_undoes_the_matrix() {
    let model = Model::new(&OracleInstance {
        matrix: [[1.0, 2.0, 0.5, 9.0], [-1.0, 3.0, 0.25, 8.0], [0.0, 4.0, -2.0, 7.0]],
        opacity: 1.0,
    });
    let p = [0.3, -0.7, 1.9];
    let moved = model.point(p);
    let back = model.solve(std::array::from_fn(|i| moved[i] - model.translation[i]));
    assert!(back.iter().zip(p).all(|(a, b)| (a - b).abs() < 1e-12), "{back:?}");
    assert!(model.is_regular());
}
