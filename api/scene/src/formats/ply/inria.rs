//! The PLY layout of the original 3DGS code (INRIA's): one `vertex` element, with a property for each number.
//!
//! Scales are logarithms, opacities logits, quaternions w, x, y, z and not normalised. `f_dc_*` are the constant
//! coefficients; `f_rest_*` the others, channel by channel: all of red, then of green, then of blue. Properties may be
//! in any order, and unknown ones are ignored.

use super::table::{Column, Table};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::{MAX_SH_DEGREE, sh_coefficients};
use crate::metadata::Geometry;
use crate::scene::Scene;
use crate::shape::{GaussianShape, sigmoid};

/// The element of Gaussians, and of the vertices of a mesh.
pub(super) const VERTEX: &str = "vertex";

/// The properties that every file has; `gaussian` unpacks them in this order.
const REQUIRED: [&str; 13] =
    ["x", "y", "z", "scale_0", "scale_1", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0", "f_dc_1", "f_dc_2"];

/// The property that follows those, except in files of 2DGS.
const THIRD_SCALE: &str = "scale_2";

/// The most columns of a Gaussian: those, the third scale, and 24 other coefficients of three channels.
const MAX_COLUMNS: usize = REQUIRED.len() + 1 + 3 * 24;

/// Reads the scene.
pub(super) fn load(mut table: Table<'_, '_>) -> Result<Scene, Fault> {
    let mut columns = REQUIRED.iter().map(|property| table.column(VERTEX, property)).collect::<Result<Vec<_>, _>>()?;
    let flat = !table.element(VERTEX).is_some_and(|vertex| vertex.properties.contains_key(THIRD_SCALE));
    if !flat {
        columns.push(table.column(VERTEX, THIRD_SCALE)?);
    }
    let (degree, rest) = rest_columns(&table, VERTEX)?;
    columns.extend(rest);
    let count = table.count(VERTEX)?;
    if count == 0 {
        return Err(Reason::Empty.at(Place::Element(VERTEX.to_owned())));
    }
    let mut scene = Scene::try_with_capacity(degree, count)?;
    if flat {
        scene.metadata_mut().geometry = Some(Geometry::Surfel);
    }
    table.read_blocks(VERTEX, &columns, |rows| {
        scene.extend(rows.count, |row, sh| {
            let mut values = [0.0; MAX_COLUMNS];
            let values = &mut values[..columns.len()];
            rows.get(row, values);
            gaussian(values, flat, sh)
        });
    })?;
    Ok(scene)
}

/// Decodes a row's `values`. Returns its position and shape, and writes its colour to `sh`.
fn gaussian(values: &[f64], flat: bool, sh: &mut [[f32; 3]]) -> ([f32; 3], GaussianShape) {
    let (required, rest) = values.split_at(REQUIRED.len());
    let (third, rest) = rest.split_at(usize::from(!flat));
    let shape = GaussianShape {
        scale: [
            libm::exp(required[3]) as f32,
            libm::exp(required[4]) as f32,
            third.first().map_or(0.0, |&log| libm::exp(log) as f32),
        ],
        rotation: std::array::from_fn(|i| required[5 + i] as f32),
        opacity: sigmoid(required[9]),
    };
    sh[0] = std::array::from_fn(|channel| required[10 + channel] as f32);
    unpack_rest(rest, &mut sh[1..]);
    (std::array::from_fn(|axis| required[axis] as f32), shape)
}

/// Transposes channel-major `rest` into RGB triples.
pub(super) fn unpack_rest(rest: &[f64], sh: &mut [[f32; 3]]) {
    let per_channel = sh.len();
    for (k, rgb) in sh.iter_mut().enumerate() {
        *rgb = std::array::from_fn(|channel| rest[channel * per_channel + k] as f32);
    }
}

/// The degree of `element`, and its columns `f_rest_0`, `f_rest_1`, ...
pub(super) fn rest_columns(table: &Table<'_, '_>, element: &str) -> Result<(u32, Vec<Column>), Fault> {
    let count = table
        .element(element)
        .map_or(0, |definition| definition.properties.keys().filter(|name| name.starts_with("f_rest_")).count());
    // A gap in the numbering is reported as a missing property.
    let columns = (0..count).map(|i| table.column(element, &format!("f_rest_{i}"))).collect::<Result<Vec<_>, _>>()?;
    let degree = (0..=MAX_SH_DEGREE)
        .find(|degree| 3 * (sh_coefficients(*degree) - 1) == count)
        .ok_or_else(|| Reason::ShCount(count).at(Place::Element(element.to_owned())))?;
    Ok((degree, columns))
}
