//! The PLY layout of the original 3DGS code (INRIA's): one `vertex` element, with a property for each number.
//!
//! Scales are logarithms, opacities logits, quaternions w, x, y, z and not normalised. `f_dc_*` are the constant
//! coefficients; `f_rest_*` the others, channel by channel: all of red, then of green, then of blue. Properties may be
//! in any order, and unknown ones are ignored, which a warning says.
//!
//! Mip-Splatting's `filter_3D` is the standard deviation of a smoothing filter, with which scales and opacities are fused.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::columns;
use super::table::{Column, Rows, Table};
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

/// The columns of the logarithms of the first two scales in [`REQUIRED`]; the third one follows it.
const SCALES: std::ops::Range<usize> = 3..5;

/// The beginning of the properties that hold the coefficients of degrees above 0.
const OTHER_COEFFICIENTS: &str = "f_rest_";

/// The property that follows those, except in files of 2DGS.
const THIRD_SCALE: &str = "scale_2";

/// Mip-Splatting's property, which follows those.
const FILTER: &str = "filter_3D";

/// The most columns of a Gaussian: those, the third scale, the filter, and 24 other coefficients of three channels.
const MAX_COLUMNS: usize = REQUIRED.len() + 2 + 3 * 24;

/// The properties of a file that are optional.
#[derive(Clone, Copy)]
struct Layout {
    /// True if there is no third scale.
    is_flat: bool,
    /// True if there is a filter.
    is_filtered: bool,
}

/// Reads the scene.
pub(super) fn load(mut table: Table<'_, '_>) -> Result<Scene, Fault> {
    let mut columns = REQUIRED.iter().map(|property| table.column(VERTEX, property)).collect::<Result<Vec<_>, _>>()?;
    let has = |property: &str| table.element(VERTEX).is_some_and(|vertex| vertex.properties.contains_key(property));
    let layout = Layout { is_flat: !has(THIRD_SCALE), is_filtered: has(FILTER) };
    let optional = [(THIRD_SCALE, !layout.is_flat), (FILTER, layout.is_filtered)];
    for (property, _) in optional.into_iter().filter(|(_, is_there)| *is_there) {
        columns.push(table.column(VERTEX, property)?);
    }
    let (degree, rest) = rest_columns(&table, VERTEX)?;
    columns.extend(rest);
    let count = table.count(VERTEX)?;
    if count == 0 {
        return Err(Reason::Empty.at(Place::Element(VERTEX.to_owned())));
    }
    let mut scene = Scene::try_with_capacity(degree, count)?;
    if layout.is_flat {
        scene.metadata_mut().geometry = Some(Geometry::Surfel);
    }
    let is_known = |name: &str| {
        REQUIRED.contains(&name) || [THIRD_SCALE, FILTER].contains(&name) || name.starts_with(OTHER_COEFFICIENTS)
    };
    if let Some(warning) = columns::warning(&table, VERTEX, is_known) {
        scene.metadata_mut().warn(warning);
    }
    let mut wide = WidePositions::of(&columns[..3]);
    let without_size = AtomicUsize::new(0);
    table.read_blocks(VERTEX, &columns, |rows| {
        scene.extend(rows.count, |row, sh| {
            let mut values = [0.0; MAX_COLUMNS];
            let values = &mut values[..columns.len()];
            rows.get(row, values);
            let third = if layout.is_flat { 0.0 } else { values[REQUIRED.len()] };
            if values[SCALES].contains(&f64::NEG_INFINITY) || third == f64::NEG_INFINITY {
                without_size.fetch_add(1, Ordering::Relaxed);
            }
            gaussian(values, layout, sh)
        });
        wide.add(rows);
    })?;
    wide.recentre(&mut scene)?;
    let without_size = without_size.into_inner();
    if without_size > 0 {
        let metadata = scene.metadata_mut();
        metadata.warn(format!("{without_size} Gaussians have a scale of -inf, and no extent along an axis"));
    }
    Ok(scene)
}

/// Positions in binary64, of a file that has them so.
pub(super) struct WidePositions {
    /// None if the file has them in no more digits than a scene.
    positions: Option<Vec<[f64; 3]>>,
    /// False if there was not enough memory for them.
    fits: bool,
}

impl WidePositions {
    /// No positions yet, of the columns x, y and z.
    pub(super) fn of(columns: &[Column]) -> Self {
        Self { positions: columns.iter().any(Column::is_double).then(Vec::new), fits: true }
    }

    /// Adds the positions of `rows`, whose first columns are x, y and z.
    pub(super) fn add(&mut self, rows: &Rows<'_>) {
        let Some(positions) = self.positions.as_mut().filter(|_| self.fits) else {
            return;
        };
        self.fits = positions.try_reserve(rows.count).is_ok();
        if self.fits {
            positions.extend((0..rows.count).map(|row| {
                let mut position = [0.0; 3];
                rows.get(row, &mut position);
                position
            }));
        }
    }

    /// Moves the origin of `scene` to where its positions keep their digits.
    ///
    /// # Errors
    /// If there was not enough memory.
    pub(super) fn recentre(self, scene: &mut Scene) -> Result<(), Fault> {
        if !self.fits {
            return Err(Reason::Memory((size_of::<[f64; 3]>() * scene.len()) as u64).at(Place::File));
        }
        if let Some(positions) = self.positions {
            scene.recentre(&positions);
        }
        Ok(())
    }
}

/// Decodes a row's `values`. Returns its position and shape, and writes its colour to `sh`.
fn gaussian(values: &[f64], layout: Layout, sh: &mut [[f32; 3]]) -> ([f32; 3], GaussianShape) {
    let (required, rest) = values.split_at(REQUIRED.len());
    let (third, rest) = rest.split_at(usize::from(!layout.is_flat));
    let (filter, rest) = rest.split_at(usize::from(layout.is_filtered));
    let scale = [required[3], required[4], third.first().copied().unwrap_or(f64::NEG_INFINITY)].map(libm::exp);
    let mut shape = GaussianShape {
        scale: scale.map(|scale| scale as f32),
        rotation: std::array::from_fn(|i| required[5 + i] as f32),
        opacity: sigmoid(required[9]),
    };
    if let Some(filter) = filter.first() {
        let opacity = 1.0 / (1.0 + libm::exp(-required[9]));
        fuse(scale, opacity, *filter, layout, &mut shape);
    }
    sh[0] = std::array::from_fn(|channel| required[10 + channel] as f32);
    unpack_rest(rest, &mut sh[1..]);
    (std::array::from_fn(|axis| required[axis] as f32), shape)
}

/// Fuses Mip-Splatting's filter: variances grow by that of the filter, and the opacity shrinks by the ratio of the
/// volumes.
fn fuse(scale: [f64; 3], opacity: f64, filter: f64, layout: Layout, shape: &mut GaussianShape) {
    let axes = if layout.is_flat { 2 } else { 3 };
    let mut ratio = 1.0;
    for (fused, scale) in shape.scale.iter_mut().zip(scale).take(axes) {
        let filtered = (scale * scale + filter * filter).sqrt();
        ratio *= if filtered > 0.0 { scale / filtered } else { 1.0 };
        *fused = filtered as f32;
    }
    shape.opacity = (opacity * ratio) as f32;
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
    let count = table.element(element).map_or(0, |definition| {
        definition.properties.keys().filter(|name| name.starts_with(OTHER_COEFFICIENTS)).count()
    });
    // A gap in the numbering is reported as a missing property.
    let columns = (0..count).map(|i| table.column(element, &format!("f_rest_{i}"))).collect::<Result<Vec<_>, _>>()?;
    let degree = (0..=MAX_SH_DEGREE)
        .find(|degree| 3 * (sh_coefficients(*degree) - 1) == count)
        .ok_or_else(|| Reason::ShCount(count).at(Place::Element(element.to_owned())))?;
    Ok((degree, columns))
}
