//! The PLY layout of meshes: a `vertex` element with `x`, `y`, `z`, and a `face` element with lists of vertices.
//!
//! Positions are taken as they are, so that a mesh made from a scene of Gaussians lies where the scene does. Normals
//! `nx`, `ny`, `nz` and colours `red`, `green`, `blue` are optional. Polygons are triangulated as fans.

use glam::{DMat3, DVec3};

use super::inria::VERTEX;
use super::table::{Column, Table};
use crate::error::{Fault, Place, Reason};
use crate::mesh::{Indexed, fan};
use crate::scene::Scene;
use crate::transform::Motion;

const FACE: &str = "face";

/// The names of a face's list of vertices.
const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Returns true if the file has faces, and its vertices have no scales as Gaussians do.
pub(super) fn is_one(table: &Table<'_, '_>) -> bool {
    let has_scales = table.element(VERTEX).is_some_and(|vertex| vertex.properties.contains_key("scale_0"));
    table.element(FACE).is_some() && !has_scales
}

/// Reads the mesh, as a scene without Gaussians.
pub(super) fn load(mut table: Table<'_, '_>) -> Result<Scene, Fault> {
    let group = |table: &Table<'_, '_>, names: [&str; 3]| -> Result<Vec<Column>, Fault> {
        names.iter().map(|name| table.column(VERTEX, name)).collect()
    };
    let mut columns = group(&table, ["x", "y", "z"])?;
    let normals = group(&table, ["nx", "ny", "nz"]).ok();
    let colors = group(&table, ["red", "green", "blue"]).ok();
    // Integers are fractions of their greatest value.
    let full = (colors.iter().flatten().next()).map_or(1.0, |red| if red.is_float() { 1.0 } else { red.max() });
    let (has_normals, has_colors) = (normals.is_some(), colors.is_some());
    let is_wide = columns.iter().any(Column::is_double);
    let mut origin = None;
    columns.extend(normals.into_iter().chain(colors).flatten());

    let mut mesh = Indexed::default();
    table.read(VERTEX, &columns, |_, values| {
        let mut triples = values.chunks_exact(3).map(|v| [v[0], v[1], v[2]]);
        let mut next = || triples.next().unwrap_or_default();
        let position = next();
        // Of binary64, the first vertex is the origin, so that the others keep their digits.
        let origin = origin.get_or_insert(if is_wide { position.map(libm::round) } else { [0.0; 3] });
        mesh.positions.push(std::array::from_fn(|axis| (position[axis] - origin[axis]) as f32));
        if has_normals {
            mesh.normals.push(next().map(|x| x as f32));
        }
        if has_colors {
            mesh.colors.push(next().map(|x| (x / full) as f32));
        }
    })?;
    let property = (INDICES.into_iter())
        .find(|name| table.element(FACE).is_some_and(|face| face.properties.contains_key(*name)))
        .unwrap_or(INDICES[0]);
    let place = Place::Property { element: FACE.to_owned(), property: property.to_owned() };
    let mut fits = true;
    table.read_lists(FACE, property, |polygon| {
        fits &= mesh.triangles.try_reserve(polygon.len()).is_ok();
        if fits {
            mesh.triangles.extend(fan(polygon));
        }
    })?;
    if !fits {
        let bytes = 2 * size_of_val(&mesh.triangles[..]) as u64;
        return Err(Reason::Memory(bytes).at(place));
    }
    if mesh.triangles.is_empty() {
        return Err(Reason::Unsupported("it holds no triangle".to_owned()).at(Place::Element(FACE.to_owned())));
    }
    let mut scene = Scene::default();
    *scene.mesh_mut() = mesh.into_mesh(place)?;
    scene.apply(&Motion::new(DMat3::IDENTITY, DVec3::from_array(origin.unwrap_or_default()), 0));
    Ok(scene)
}
