//! Transforms of Gaussians: scaled, rotated and moved, with their view-dependent colours rotated.

use glam::{DMat3, DQuat, DVec3};

use crate::harmonics::Turn;
use crate::mesh::Mesh;
use crate::shape::GaussianShape;

/// The placement of a scene in another: it is scaled, then rotated, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// A positive factor.
    pub scale: f64,
    /// A rotation; it need not be normalised.
    pub rotation: DQuat,
    /// The translation, in units of the scene in which it is placed.
    pub translation: DVec3,
}

impl Default for Transform {
    /// The identity.
    fn default() -> Self {
        Self { scale: 1.0, rotation: DQuat::IDENTITY, translation: DVec3::ZERO }
    }
}

impl Transform {
    /// The transform prepared for many Gaussians of at most spherical harmonics degree `degree`.
    pub(crate) fn motion(&self, degree: u32) -> Motion {
        let rotation = DMat3::from_quat(self.rotation.normalize());
        Motion::new(self.scale * rotation, self.translation, degree)
    }
}

/// An affine map prepared for many Gaussians.
#[derive(Debug)]
pub(crate) struct Motion {
    linear: DMat3,
    translation: DVec3,
    shape: ShapeMotion,
    turn: Turn,
}

/// The effect of a map on scales and rotations.
#[derive(Debug)]
enum ShapeMotion {
    /// Axes are kept or negated. The vector has the signs for a quaternion's vector part.
    Flip(DVec3),
    /// All lengths are multiplied by one factor. A Gaussian is its own mirror image, so a map with a reflection uses
    /// the rotation of its negative.
    Similarity { rotation: DQuat, scale: f32 },
    /// Lengths change by different factors in different directions.
    General,
}

impl Motion {
    /// The map x -> `linear` x + `translation`, for Gaussians of at most spherical harmonics degree `degree`. Colours
    /// are rotated by the orthogonal factor of `linear`'s polar decomposition.
    pub(crate) fn new(linear: DMat3, translation: DVec3, degree: u32) -> Self {
        let diagonal = DVec3::new(linear.x_axis.x, linear.y_axis.y, linear.z_axis.z);
        let (shape, orthogonal) = if diagonal.abs() == DVec3::ONE && linear == DMat3::from_diagonal(diagonal) {
            let [x, y, z] = diagonal.to_array();
            (ShapeMotion::Flip(DVec3::new(y * z, x * z, x * y)), linear)
        } else if let Some((scale, orthogonal)) = similarity(linear) {
            let proper = orthogonal * orthogonal.determinant().signum();
            let rotation = DQuat::from_mat3(&proper).normalize();
            let scale = scale as f32;
            (ShapeMotion::Similarity { rotation, scale }, orthogonal)
        } else {
            (ShapeMotion::General, orthogonal_factor(linear))
        };
        Self { linear, translation, shape, turn: Turn::new(&orthogonal, degree) }
    }

    /// The image of a point.
    pub(crate) fn image(&self, point: DVec3) -> DVec3 {
        self.linear * point + self.translation
    }

    /// Transforms triangles, and moves them by `shift` instead of the translation.
    pub(crate) fn apply_to_mesh(&self, mesh: &mut Mesh, shift: DVec3) {
        mesh.apply(self.linear, shift);
    }

    /// Transforms a Gaussian: its centre, its shape and its coefficients, of which the constant one is first. The centre
    /// is moved by `shift` instead of the translation.
    pub(crate) fn apply(&self, shift: DVec3, position: &mut [f32; 3], shape: &mut GaussianShape, sh: &mut [[f32; 3]]) {
        let moved = self.linear * DVec3::from_array(position.map(f64::from)) + shift;
        *position = moved.as_vec3().to_array();
        match &self.shape {
            ShapeMotion::Flip(signs) => {
                for (component, sign) in shape.rotation[1..].iter_mut().zip(signs.to_array()) {
                    *component *= sign as f32;
                }
            }
            ShapeMotion::Similarity { rotation, scale } => {
                shape.scale = shape.scale.map(|axis| axis * scale);
                let [w, x, y, z] = shape.rotation.map(f64::from);
                let turned = rotation.mul_quat(DQuat::from_xyzw(x, y, z, w));
                shape.rotation = [turned.w, turned.x, turned.y, turned.z].map(|c| c as f32);
            }
            ShapeMotion::General => self.reshape(shape),
        }
        self.turn.apply(sh);
    }

    /// Computes scales and rotation of the map's image of an ellipsoid. A shape that is not finite is kept.
    fn reshape(&self, shape: &mut GaussianShape) {
        let [w, x, y, z] = shape.rotation.map(f64::from);
        let rotation = DQuat::from_xyzw(x, y, z, w);
        let scale = DVec3::from_array(shape.scale.map(f64::from));
        let length = rotation.length();
        if !(length.is_finite() && length > 0.0 && scale.is_finite()) {
            return;
        }
        let axes = DMat3::from_quat(rotation / length) * DMat3::from_diagonal(scale);
        let (image, _) = orthogonal_columns(self.linear * axes);
        let lengths = [image.x_axis, image.y_axis, image.z_axis].map(DVec3::length);
        shape.scale = lengths.map(|length| length as f32);
        let turned = DQuat::from_mat3(&frame(image)).normalize();
        shape.rotation = [turned.w, turned.x, turned.y, turned.z].map(|c| c as f32);
    }
}

/// The factor and the orthogonal matrix whose product is `linear`. None if it is no such product.
fn similarity(linear: DMat3) -> Option<(f64, DMat3)> {
    let scale = libm::cbrt(linear.determinant().abs());
    let orthogonal = linear * scale.recip();
    let error = orthogonal.transpose() * orthogonal - DMat3::IDENTITY;
    let small = error.to_cols_array().into_iter().all(|entry| entry.abs() < 1e-6);
    (scale > 0.0 && small).then_some((scale, orthogonal))
}

/// The orthogonal factor of the polar decomposition of `linear`.
fn orthogonal_factor(linear: DMat3) -> DMat3 {
    let (image, turned) = orthogonal_columns(linear);
    let frame = frame(image) * turned.transpose();
    // `frame` is a proper rotation; the factor of a map with a reflection is not.
    frame * (frame.determinant() * linear.determinant()).signum()
}

/// An orthonormal basis of positive determinant along the orthogonal columns of `matrix`, some of which may be zero.
fn frame(matrix: DMat3) -> DMat3 {
    let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let longest =
        (0..3).fold(0, |best, i| if axes[i].length_squared() > axes[best].length_squared() { i } else { best });
    let first = axes[longest].try_normalize().unwrap_or(DVec3::X);
    let [next, last] = [(longest + 1) % 3, (longest + 2) % 3];
    let second = axes[next]
        .try_normalize()
        .or_else(|| Some(axes[last].try_normalize()?.cross(first)))
        .unwrap_or_else(|| first.any_orthonormal_vector());
    let mut basis = [DVec3::ZERO; 3];
    basis[longest] = first;
    basis[next] = second;
    basis[last] = first.cross(second);
    DMat3::from_cols(basis[0], basis[1], basis[2])
}

/// `matrix` times a rotation that makes its columns orthogonal, and that rotation (one-sided Jacobi method).
fn orthogonal_columns(matrix: DMat3) -> (DMat3, DMat3) {
    let mut columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let mut turned = [DVec3::X, DVec3::Y, DVec3::Z];
    // Convergence is quadratic; a fifth sweep no longer changes anything.
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (a, b) = (columns[p].length_squared(), columns[q].length_squared());
            let product = columns[p].dot(columns[q]);
            if product.abs() <= f64::EPSILON * (a * b).sqrt() {
                continue;
            }
            let zeta = (b - a) / (2.0 * product);
            let tangent = zeta.signum() / (zeta.abs() + libm::hypot(zeta, 1.0));
            let cosine = libm::hypot(tangent, 1.0).recip();
            let sine = cosine * tangent;
            for pair in [&mut columns, &mut turned] {
                let (first, second) = (pair[p], pair[q]);
                pair[p] = cosine * first - sine * second;
                pair[q] = sine * first + cosine * second;
            }
        }
    }
    let matrix = |columns: [DVec3; 3]| DMat3::from_cols(columns[0], columns[1], columns[2]);
    (matrix(columns), matrix(turned))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covariance(shape: &GaussianShape) -> DMat3 {
        let [w, x, y, z] = shape.rotation.map(f64::from);
        let scale = DVec3::from_array(shape.scale.map(f64::from));
        let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize()) * DMat3::from_diagonal(scale);
        axes * axes.transpose()
    }

    fn maps() -> Vec<DMat3> {
        let turn = DMat3::from_quat(DQuat::from_xyzw(0.3, -0.5, 0.7, 0.2).normalize());
        let stretch = DMat3::from_diagonal(DVec3::new(0.5, 2.0, 3.0));
        let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
        vec![
            DMat3::IDENTITY,
            mirror,
            DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)),
            -DMat3::IDENTITY,
            turn,
            2.5 * turn,
            mirror * turn,
            turn * stretch,
            stretch * turn,
            mirror * stretch * turn,
            turn * DMat3::from_diagonal(DVec3::new(2.0, 0.0, 1.0)),
        ]
    }

    #[test]
    fn covariances_become_those_of_the_map() {
        let shapes = [[0.1, 0.2, 0.7], [0.3, 0.3, 0.3], [0.5, 0.25, 0.0]].map(|scale| GaussianShape {
            scale,
            rotation: [0.9, 0.3, -0.2, 0.1],
            opacity: 0.5,
        });
        let translation = DVec3::new(1.0, -2.0, 3.0);
        for linear in maps() {
            let motion = Motion::new(linear, translation, 0);
            for shape in &shapes {
                let (mut position, mut moved) = ([0.25, -4.0, 1.5], *shape);
                motion.apply(translation, &mut position, &mut moved, &mut [[0.5; 3]]);
                let expected = linear * DVec3::new(0.25, -4.0, 1.5) + translation;
                assert!(expected.abs_diff_eq(DVec3::from_array(position.map(f64::from)), 1e-5));
                let expected = linear * covariance(shape) * linear.transpose();
                let found = covariance(&moved);
                assert!(expected.abs_diff_eq(found, 1e-5), "{linear}: {found} is not {expected}");
                assert_eq!(moved.opacity, 0.5);
            }
        }
    }

    #[test]
    fn a_flat_gaussian_keeps_its_third_axis() {
        let mut shape = GaussianShape { scale: [0.5, 0.25, 0.0], rotation: [0.9, 0.3, -0.2, 0.1], opacity: 1.0 };
        let stretch = DMat3::from_diagonal(DVec3::new(0.5, 2.0, 3.0));
        Motion::new(stretch, DVec3::ZERO, 0).apply(DVec3::ZERO, &mut [0.0; 3], &mut shape, &mut [[0.0; 3]]);
        assert_eq!(shape.scale[2], 0.0);
        assert!(shape.scale[0] > 0.0 && shape.scale[1] > 0.0);
    }

    #[test]
    fn what_is_not_finite_is_no_trouble() {
        for linear in maps() {
            let motion = Motion::new(linear, DVec3::ZERO, 4);
            for bad in [f32::NAN, f32::INFINITY, 0.0] {
                let mut shape = GaussianShape { scale: [bad; 3], rotation: [bad; 4], opacity: bad };
                motion.apply(DVec3::ZERO, &mut [bad; 3], &mut shape, &mut [[bad; 3]; 25]);
            }
        }
    }
}
