//! The PLY layout of point clouds: a `vertex` element with `x`, `y`, `z`, and neither scales nor rotations.
//!
//! Points are drawn as round Gaussians. Colours `red`, `green`, `blue` are optional, and so are constant coefficients
//! `f_dc_*` instead.

use super::inria::{VERTEX, WidePositions};
use super::table::{Column, Table};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::SH_C0;
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// The diameter of a round Gaussian at half of its height, in standard deviations: 2 sqrt(2 ln 2).
const WIDTH_AT_HALF: f64 = 2.354_820_045_030_949_4;

/// The colour of points whose file gives none.
const PLAIN: f64 = 0.7;

/// Returns true if the file has vertices at positions, and neither scales nor rotations.
pub(super) fn is_one(table: &Table<'_, '_>) -> bool {
    table.element(VERTEX).is_some_and(|vertex| {
        let has = |name: &str| vertex.properties.contains_key(name);
        ["x", "y", "z"].into_iter().all(has) && !["scale_0", "scale_1", "rot_0", "opacity"].into_iter().any(has)
    })
}

/// Reads the points as Gaussians of diameter `size`, in the scene's units. An error if there is no size.
pub(super) fn load(mut table: Table<'_, '_>, size: Option<f64>) -> Result<Scene, Fault> {
    let place = || Place::Element(VERTEX.to_owned());
    let size = size.ok_or_else(|| Reason::PointCloud.at(place()))?;
    let group = |table: &Table<'_, '_>, names: [&str; 3]| -> Result<Vec<Column>, Fault> {
        names.iter().map(|name| table.column(VERTEX, name)).collect()
    };
    let mut columns = group(&table, ["x", "y", "z"])?;
    let coefficients = group(&table, ["f_dc_0", "f_dc_1", "f_dc_2"]).ok();
    let colors = group(&table, ["red", "green", "blue"]).or_else(|_| group(&table, ["r", "g", "b"])).ok();
    // Integers are fractions of their greatest value.
    let full = (colors.iter().flatten().next()).map_or(1.0, |red| if red.is_float() { 1.0 } else { red.max() });
    let are_coefficients = coefficients.is_some();
    columns.extend(coefficients.or(colors).unwrap_or_default());
    let count = table.count(VERTEX)?;
    if count == 0 {
        return Err(Reason::Empty.at(place()));
    }
    let shape =
        GaussianShape { scale: [(size / WIDTH_AT_HALF) as f32; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity: 1.0 };
    let mut scene = Scene::try_with_capacity(0, count)?;
    let mut wide = WidePositions::of(&columns[..3]);
    table.read_blocks(VERTEX, &columns, |rows| {
        scene.extend(rows.count, |row, sh| {
            let mut values = [PLAIN; 6];
            rows.get(row, &mut values[..columns.len()]);
            let coefficient = |value: f64| if are_coefficients { value } else { (value / full - 0.5) / SH_C0 };
            sh[0] = std::array::from_fn(|channel| coefficient(values[3 + channel]) as f32);
            (std::array::from_fn(|axis| values[axis] as f32), shape)
        });
        wide.add(rows);
    })?;
    wide.recentre(&mut scene)?;
    scene.metadata_mut().note(format!("points without scales are drawn as round Gaussians of diameter {size}"));
    Ok(scene)
}
