//! A prim of type `ParticleField3DGaussianSplat` as Gaussians, in the prim's own frame.

use super::layer::{Array, Prim, Value};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::{MAX_SH_DEGREE, SH_C0, sh_coefficients};
use crate::metadata::{Geometry, SortOrder};
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// The type's name.
pub(super) const TYPE: &str = "ParticleField3DGaussianSplat";

/// The type of fields of particles whose kernel is a schema of its own.
pub(super) const FIELD: &str = "ParticleField";

/// The kernels of such fields that are Gaussians: volumes, and discs across their third axis.
const ELLIPSOID: &str = "ParticleFieldKernelGaussianEllipsoidAPI";
const SURFLET: &str = "ParticleFieldKernelGaussianSurfletAPI";

/// The shape of the Gaussians that `prim` has; None if it has none.
pub(super) fn geometry(prim: &Prim) -> Option<Geometry> {
    let has = |schema: &str| prim.schemas.iter().any(|applied| applied == schema);
    match prim.kind.as_str() {
        TYPE => Some(Geometry::Volume),
        FIELD if has(SURFLET) => Some(Geometry::Surfel),
        FIELD if has(ELLIPSOID) => Some(Geometry::Volume),
        _ => None,
    }
}

const COEFFICIENTS: &str = "radiance:sphericalHarmonicsCoefficients";
const DEGREE: &str = "radiance:sphericalHarmonicsDegree";

/// The degree of harmonics of a prim that names none.
const DEFAULT_DEGREE: f64 = 3.0;

/// The Gaussians of `prim`, of this shape.
pub(super) fn scene(prim: &Prim, geometry: Geometry) -> Result<Scene, Fault> {
    let positions = required(prim, "positions", 3)?;
    let count = positions.values.len() / 3;
    let of_each = |name: &str, width: usize| {
        let array = required(prim, name, width)?;
        expect_count(prim, name, array, count)?;
        Ok::<_, Fault>(array)
    };
    let scales = of_each("scales", 3)?;
    let rotations = of_each("orientations", 4)?;
    let opacities = of_each("opacities", 1)?;
    let colors = Colors::of(prim, count)?;
    let degree = colors.degree;
    let vector = |array: &Array, i: usize| std::array::from_fn(|axis| array.values[3 * i + axis]);
    let mut scene = Scene::try_generate(degree, count, |i, sh| {
        let [x, y, z] = vector(scales, i).map(f32::abs);
        let shape = GaussianShape {
            scale: [x, y, if geometry == Geometry::Surfel { 0.0 } else { z }],
            rotation: std::array::from_fn(|c| rotations.values[4 * i + c]),
            opacity: opacities.values[i].clamp(0.0, 1.0),
        };
        colors.fill(i, sh);
        (vector(positions, i), shape)
    })?;
    let metadata = scene.metadata_mut();
    if opacities.values.iter().any(|opacity| !(0.0..=1.0).contains(opacity)) {
        metadata.note("opacities lie outside 0 to 1, and are clamped");
    }
    if scales.values.iter().any(|scale| *scale < 0.0) {
        metadata.note("scales are negative, and their magnitudes are taken");
    }
    if geometry == Geometry::Surfel {
        metadata.geometry = Some(geometry);
    }
    if prim.is_animated {
        metadata.warn("values that vary with time are ignored but for the first ones");
    }
    metadata.notes.extend(colors.note);
    let token = |name: &str| prim.value(name).and_then(Value::text);
    metadata.order = match token("sortingModeHint") {
        None => None,
        Some("zDepth") => Some(SortOrder::Depth),
        Some("cameraDistance") => Some(SortOrder::Distance),
        Some("rayHitDistance") => Some(SortOrder::PerPixel),
        Some(mode) => {
            metadata.note(format!("the sorting mode {mode:?} is unknown and ignored"));
            None
        }
    };
    match token("projectionModeHint") {
        None | Some("perspective") => {}
        Some(mode) => metadata.note(format!("the projection mode {mode:?} is ignored, and perspective is drawn")),
    }
    Ok(scene)
}

/// The place of attribute `name` in messages.
fn place(prim: &Prim, name: &str) -> Place {
    Place::Part(format!("prim {}, {name}", prim.path))
}

/// The array `name` of elements of `width` numbers; the one of binary16 if there is no other. None if there is neither.
fn array<'a>(prim: &'a Prim, name: &str, width: usize) -> Result<Option<&'a Array>, Fault> {
    let half = format!("{name}h");
    for name in [name, &half] {
        match prim.value(name) {
            None => {}
            Some(Value::Array(array)) if array.values.is_empty() => {}
            Some(Value::Array(array)) if array.width == width => return Ok(Some(array)),
            Some(_) => {
                let text = format!("it is no array of {width} numbers each");
                return Err(Reason::Unsupported(text).at(place(prim, name)));
            }
        }
    }
    Ok(None)
}

fn required<'a>(prim: &'a Prim, name: &str, width: usize) -> Result<&'a Array, Fault> {
    array(prim, name, width)?.ok_or_else(|| Reason::Missing.at(place(prim, name)))
}

fn expect_count(prim: &Prim, name: &str, array: &Array, expected: usize) -> Result<(), Fault> {
    let (found, expected) = ((array.values.len() / array.width) as u64, expected as u64);
    if found == expected { Ok(()) } else { Err(Reason::Count { found, expected }.at(place(prim, name))) }
}

/// The colours of a prim's Gaussians.
struct Colors<'a> {
    degree: u32,
    /// Coefficients of each Gaussian, one Gaussian after the other; or one colour of each, or of all.
    source: Option<&'a Array>,
    kind: Kind,
    /// A note on a choice that the file leaves open.
    note: Option<String>,
}

/// The meaning of the source of colours.
enum Kind {
    Coefficients,
    EachColor,
    OneColor,
    Grey,
}

impl<'a> Colors<'a> {
    fn of(prim: &'a Prim, count: usize) -> Result<Self, Fault> {
        if let Some(coefficients) = array(prim, COEFFICIENTS, 3)? {
            let degree = prim.value(DEGREE).map_or(Some(DEFAULT_DEGREE), Value::number);
            let degree = degree.filter(|degree| *degree >= 0.0 && libm::trunc(*degree) == *degree);
            let degree = degree.ok_or_else(|| {
                Reason::Unsupported("it is no whole number from 0 on".to_owned()).at(place(prim, DEGREE))
            })?;
            if degree > f64::from(MAX_SH_DEGREE) {
                return Err(Reason::ShDegree(degree as u32).at(place(prim, DEGREE)));
            }
            let degree = degree as u32;
            expect_count(prim, COEFFICIENTS, coefficients, count.saturating_mul(sh_coefficients(degree)))?;
            return Ok(Self { degree, source: Some(coefficients), kind: Kind::Coefficients, note: None });
        }
        let name = "primvars:displayColor";
        let Some(colors) = array(prim, name, 3)? else {
            let note = Some("there are neither harmonics nor colours, and Gaussians are grey".to_owned());
            return Ok(Self { degree: 0, source: None, kind: Kind::Grey, note });
        };
        let is_one = colors.values.len() == 3;
        if !is_one {
            expect_count(prim, name, colors, count)?;
        }
        let kind = if is_one { Kind::OneColor } else { Kind::EachColor };
        let note = Some(format!("there are no harmonics, and colours are those of {name}"));
        Ok(Self { degree: 0, source: Some(colors), kind, note })
    }

    /// Fills the coefficients of Gaussian `i`.
    fn fill(&self, i: usize, sh: &mut [[f32; 3]]) {
        let Some(source) = self.source else { return };
        let (rgb, _) = source.values.as_chunks::<3>();
        let of_color = |color: [f32; 3]| color.map(|channel| ((f64::from(channel) - 0.5) / SH_C0) as f32);
        match self.kind {
            Kind::Coefficients => sh.copy_from_slice(&rgb[i * sh.len()..(i + 1) * sh.len()]),
            Kind::EachColor => sh[0] = of_color(rgb[i]),
            Kind::OneColor => sh[0] = of_color(rgb[0]),
            Kind::Grey => {}
        }
    }
}
