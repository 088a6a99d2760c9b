//! Triangles among a scene's Gaussians.

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, Vec3};

use crate::error::{Fault, Place, Reason};

/// The colour of vertices whose file gives none.
pub(crate) const PLAIN: [f32; 3] = [0.7; 3];

/// A vertex of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MeshVertex {
    /// The position, in the scene's units.
    pub position: [f32; 3],
    /// The normal, a unit vector; zero if the triangle has no area and the file no normal.
    pub normal: [f32; 3],
    /// The colour of the surface, sRGB from 0 to 1, without light.
    pub color: [f32; 3],
}

/// Triangles: three vertices each, visible from both sides.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    vertices: Vec<MeshVertex>,
}

/// The vertices and triangles of a file, before they become a [`Mesh`].
#[derive(Default)]
pub(crate) struct Indexed {
    pub(crate) positions: Vec<[f32; 3]>,
    /// A normal for each position, or nothing.
    pub(crate) normals: Vec<[f32; 3]>,
    /// A colour for each position, or nothing.
    pub(crate) colors: Vec<[f32; 3]>,
    /// Indices of positions.
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Indexed {
    /// The mesh. If there are no normals, a vertex's normal is the mean of its triangles', weighted by their areas.
    ///
    /// # Errors
    /// If an index is out of range, or memory is short. Messages name the indices `place`.
    pub(crate) fn into_mesh(self, place: Place) -> Result<Mesh, Fault> {
        let count = self.positions.len();
        if let Some(index) = (self.triangles.as_flattened().iter()).find(|index| **index as usize >= count) {
            let text = format!("vertex {index} is not one of the {count}");
            return Err(Reason::Unsupported(text).at(place));
        }
        let position = |index: u32| Vec3::from_array(self.positions[index as usize]);
        let mut normals = self.normals;
        if normals.is_empty() {
            let mut sums = vec![Vec3::ZERO; count];
            for [a, b, c] in &self.triangles {
                let normal = (position(*b) - position(*a)).cross(position(*c) - position(*a));
                for index in [a, b, c] {
                    sums[*index as usize] += normal;
                }
            }
            normals = sums.into_iter().map(|sum| sum.normalize_or_zero().to_array()).collect();
        }
        let mut vertices = Vec::new();
        let needed = 3 * self.triangles.len();
        let reserved = vertices.try_reserve_exact(needed);
        reserved.map_err(|_| Reason::Memory((needed * size_of::<MeshVertex>()) as u64).at(place))?;
        vertices.extend(self.triangles.as_flattened().iter().map(|index| MeshVertex {
            position: self.positions[*index as usize],
            normal: normals[*index as usize],
            color: self.colors.get(*index as usize).copied().unwrap_or(PLAIN),
        }));
        Ok(Mesh { vertices })
    }
}

impl Mesh {
    /// A mesh of triangles, three vertices each.
    ///
    /// # Panics
    /// If the last triangle lacks a vertex.
    pub fn new(vertices: Vec<MeshVertex>) -> Self {
        assert!(vertices.len().is_multiple_of(3), "three vertices a triangle");
        Self { vertices }
    }

    /// The vertices, three for each triangle.
    pub fn vertices(&self) -> &[MeshVertex] {
        &self.vertices
    }

    /// The number of triangles.
    pub fn triangles(&self) -> usize {
        self.vertices.len() / 3
    }

    /// True if there is no triangle.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// The least and the greatest finite coordinates; None if there are none.
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let positions = self.vertices.iter().map(|v| DVec3::from_array(v.position.map(f64::from)));
        let finite = positions.filter(|position| position.is_finite());
        finite
            .map(|position| (position, position))
            .reduce(|(min, max), (a, b)| (min.min(a), max.max(b)))
            .map(|(min, max)| (min.to_array(), max.to_array()))
    }

    /// Appends the triangles of `other`.
    pub fn append(&mut self, mut other: Self) {
        self.vertices.append(&mut other.vertices);
    }

    /// Maps each position x to `linear` x + `translation`. Normals stay perpendicular to their surfaces.
    pub(crate) fn apply(&mut self, linear: DMat3, translation: DVec3) {
        let normals = linear.inverse().transpose();
        for vertex in &mut self.vertices {
            let double = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
            vertex.position = (linear * double(vertex.position) + translation).as_vec3().to_array();
            vertex.normal = (normals * double(vertex.normal)).normalize_or_zero().as_vec3().to_array();
        }
    }
}

/// The triangles of a polygon, as a fan around its first vertex.
pub(crate) fn fan(polygon: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    polygon.windows(2).skip(1).map(|pair| [polygon[0], pair[0], pair[1]])
}

/// The sRGB value of linear light, both from 0 to 1.
pub(crate) fn srgb(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quad_is_two_triangles_with_the_quads_normal() {
        let quad = Indexed {
            positions: vec![[0., 0., 0.], [2., 0., 0.], [2., 2., 0.], [0., 2., 0.]],
            triangles: fan(&[0, 1, 2, 3]).collect(),
            ..Indexed::default()
        };
        assert_eq!(quad.triangles, [[0, 1, 2], [0, 2, 3]]);
        let mut mesh = quad.into_mesh(Place::File).expect("a mesh");
        assert_eq!(mesh.triangles(), 2);
        assert!(mesh.vertices().iter().all(|v| v.normal == [0., 0., 1.] && v.color == PLAIN));
        assert_eq!(mesh.bounds(), Some(([0.; 3], [2., 2., 0.])));
        // Squeezed along x and sheared, a normal is that of the surface's image.
        let shear = DMat3::from_cols(DVec3::new(0.5, 0., 1.), DVec3::Y, DVec3::Z);
        mesh.apply(shear, DVec3::X);
        let expected = Vec3::new(-2., 0., 1.).normalize();
        assert!(Vec3::from_array(mesh.vertices()[0].normal).abs_diff_eq(expected, 1e-6));
        assert_eq!(mesh.vertices()[1].position, [2., 0., 2.]);
    }

    #[test]
    fn an_index_out_of_range_is_refused() {
        let bad = Indexed { positions: vec![[0.; 3]; 3], triangles: vec![[0, 1, 3]], ..Indexed::default() };
        let fault = bad.into_mesh(Place::File).expect_err("vertex 3");
        assert!(fault.reason.to_string().contains("vertex 3 is not one of the 3"));
    }

    #[test]
    fn linear_light_becomes_srgb() {
        assert_eq!(srgb(0.0), 0.0);
        // 1.055 - 0.055 is rounded in binary32.
        assert!((srgb(2.0) - 1.0).abs() <= f32::EPSILON);
        assert!((srgb(0.214_041_14) - 0.5).abs() < 1e-5);
    }
}
