//! A primitive with `KHR_gaussian_splatting`: the extension's object, and its attributes.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::accessor::{BYTE, Component, Demand, FLOAT, SHORT, UNSIGNED_BYTE, UNSIGNED_SHORT, values};
use super::buffers::Buffers;
use super::document::{DRAFTS, EXTENSION, Primitive};
use crate::axes::Axes;
use crate::error::{Fault, Place, Reason};
use crate::formats::input::Input;
use crate::formats::spz;
use crate::harmonics::sh_coefficients;
use crate::metadata::{ColorSpace, Metadata, SortOrder};
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// The highest spherical harmonics degree of the extension.
const MAX_DEGREE: u32 = 3;

/// Attributes of Gaussians that are read, or that repeat others.
const KNOWN: [&str; 3] = ["POSITION", "COLOR_0", "NORMAL"];

/// The mode of primitives that are points. All primitives with Gaussians have it.
const POINTS: u32 = 0;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Splatting {
    kernel: Option<String>,
    color_space: Option<String>,
    projection: Option<String>,
    sorting_method: Option<String>,
    #[serde(default)]
    extensions: BTreeMap<String, serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer_view: usize,
}

/// Positions, of Gaussians and of triangles.
pub(super) const POSITION: Demand = Demand {
    width: 3,
    components: &[
        Component::plain(FLOAT),
        // `KHR_mesh_quantization`
        Component::plain(BYTE),
        Component::normalized(BYTE),
        Component::plain(UNSIGNED_BYTE),
        Component::normalized(UNSIGNED_BYTE),
        Component::plain(SHORT),
        Component::normalized(SHORT),
        Component::plain(UNSIGNED_SHORT),
        Component::normalized(UNSIGNED_SHORT),
    ],
    expected: "float, or a quantized one",
};

const ROTATION: Demand = Demand {
    width: 4,
    components: &[Component::plain(FLOAT), Component::normalized(BYTE), Component::normalized(SHORT)],
    expected: "float, signed byte normalized or signed short normalized",
};

const SCALE: Demand = Demand {
    width: 3,
    components: &[
        Component::plain(FLOAT),
        Component::plain(UNSIGNED_BYTE),
        Component::normalized(UNSIGNED_BYTE),
        Component::plain(UNSIGNED_SHORT),
        Component::normalized(UNSIGNED_SHORT),
    ],
    expected: "float or an unsigned one",
};

const OPACITY: Demand = Demand {
    width: 1,
    components: &[Component::plain(FLOAT), Component::normalized(UNSIGNED_BYTE), Component::normalized(UNSIGNED_SHORT)],
    expected: "float, unsigned byte normalized or unsigned short normalized",
};

const COEFFICIENT: Demand = Demand { width: 3, components: &[Component::plain(FLOAT)], expected: "float" };

/// The Gaussians of `primitive`, in the frame of its mesh. None if it has none. Messages name it `place`.
pub(super) fn gaussians(buffers: &mut Buffers<'_>, primitive: &Primitive, place: &str) -> Result<Option<Scene>, Fault> {
    let at = |reason: Reason, field: &str| reason.at(Place::Part(format!("{place}, {field}")));
    let malformed = |error: serde_json::Error| at(Reason::Json(spz::one_line(&error)), EXTENSION);
    let (splatting, metadata) = match primitive.extensions.get(EXTENSION) {
        Some(value) => {
            let splatting = Splatting::deserialize(value).map_err(malformed)?;
            let metadata = splatting.metadata(place)?;
            (Some(splatting), metadata)
        }
        None => (None, Metadata::default()),
    };
    let within = splatting.iter().flat_map(|splatting| &splatting.extensions);
    let draft = within.chain(&primitive.extensions).find(|(name, _)| DRAFTS.contains(&name.as_str()));
    let mut scene = if let Some((name, value)) = draft {
        let compressed = Compressed::deserialize(value).map_err(malformed)?;
        let mut scene = from_spz(buffers, compressed.buffer_view, place)?;
        scene.metadata_mut().note(format!("the extension {name} is a draft of glTF's"));
        scene
    } else if splatting.is_some() {
        if primitive.mode != Some(POINTS) {
            let text = "Gaussians are points (mode 0)";
            return Err(at(Reason::Unsupported(text.to_owned()), "mode"));
        }
        attributes(buffers, primitive, place)?
    } else {
        return Ok(None);
    };
    let mut of_data = std::mem::replace(scene.metadata_mut(), metadata);
    scene.metadata_mut().antialiasing = of_data.antialiasing;
    scene.metadata_mut().take_messages(&mut of_data);
    Ok(Some(scene))
}

/// The Gaussians of the SPZ file in buffer view `view`.
fn from_spz(buffers: &mut Buffers<'_>, view: usize, place: &str) -> Result<Scene, Fault> {
    let origin = buffers.origin;
    let (mut bytes, _) = buffers.view(view, place)?;
    let len = bytes.len() as u64;
    let mut input = Input::new(&mut bytes, len, origin);
    let read = spz::load_into(&mut input, None, Axes::LEFT_UP_FRONT).and_then(|scene| scene.decoded(scene.sh_degree));
    read.map_err(|fault| {
        let place = format!("{place}, the SPZ file in it, {}", fault.place);
        fault.reason.at(Place::Part(place))
    })
}

/// The Gaussians of the attributes of `primitive`.
fn attributes(buffers: &mut Buffers<'_>, primitive: &Primitive, place: &str) -> Result<Scene, Fault> {
    let accessor = |name: &str| primitive.attributes.get(name).copied();
    let name = |l: u32, n: u32| format!("{EXTENSION}:SH_DEGREE_{l}_COEF_{n}");
    let degree = (1..=MAX_DEGREE).rev().find(|l| (0..=2 * l).any(|n| accessor(&name(*l, n)).is_some())).unwrap_or(0);
    let mut read = |name: &str, demand: &Demand, count: Option<usize>| {
        let place = format!("{place}, {name}");
        let index = accessor(name).ok_or_else(|| Reason::Missing.at(Place::Part(place.clone())))?;
        let values = values(buffers, index, demand, &place)?;
        let (found, expected) = (values.len() / demand.width, count);
        match expected.filter(|expected| found != *expected) {
            Some(expected) => {
                let (found, expected) = (found as u64, expected as u64);
                Err(Reason::Count { found, expected }.at(Place::Part(place)))
            }
            None => Ok(values),
        }
    };
    let positions = read("POSITION", &POSITION, None)?;
    let count = positions.len() / 3;
    let same = Some(count);
    let rotations = read(&format!("{EXTENSION}:ROTATION"), &ROTATION, same)?;
    let scales = read(&format!("{EXTENSION}:SCALE"), &SCALE, same)?;
    let opacities = read(&format!("{EXTENSION}:OPACITY"), &OPACITY, same)?;
    let mut coefficients = Vec::with_capacity(sh_coefficients(degree));
    for l in 0..=degree {
        for n in 0..=2 * l {
            coefficients.push(read(&name(l, n), &COEFFICIENT, same)?);
        }
    }
    let are_logarithms = are_logarithms(&scales);
    let scale = |value: f32| if are_logarithms { libm::expf(value) } else { value.abs() };
    let vector = |values: &[f32], i: usize| std::array::from_fn(|axis| values[3 * i + axis]);
    let mut scene = Scene::try_generate(degree, count, |i, sh| {
        let [x, y, z, w] = std::array::from_fn(|c| rotations[4 * i + c]);
        let shape = GaussianShape {
            scale: vector(&scales, i).map(scale),
            rotation: [w, x, y, z],
            opacity: opacities[i].clamp(0.0, 1.0),
        };
        for (rgb, values) in sh.iter_mut().zip(&coefficients) {
            *rgb = vector(values, i);
        }
        (vector(&positions, i), shape)
    })?;
    if are_logarithms {
        scene.metadata_mut().note("scales are logarithms, as in a draft of the extension, and are converted");
    } else if scales.iter().any(|scale| *scale < 0.0) {
        scene.metadata_mut().note("scales are negative, and their magnitudes are taken");
    }
    if opacities.iter().any(|opacity| !(0.0..=1.0).contains(opacity)) {
        scene.metadata_mut().note("opacities lie outside 0 to 1, and are clamped");
    }
    let mut unknown: Vec<&str> = (primitive.attributes.keys().map(String::as_str))
        .filter(|name| !KNOWN.contains(name) && !name.starts_with(&format!("{EXTENSION}:")))
        .collect();
    if !unknown.is_empty() {
        unknown.sort_unstable();
        scene.metadata_mut().warn(format!("unknown attributes are ignored: {}", unknown.join(", ")));
    }
    Ok(scene)
}

/// Returns true if `scales` are logarithms, as in a draft of the extension: at least a tenth of them is negative. Scales
/// themselves are not, and the logarithms of a scene's are unless its Gaussians are large.
fn are_logarithms(scales: &[f32]) -> bool {
    let negative = scales.iter().filter(|scale| **scale < 0.0).count();
    negative > 0 && 10 * negative >= scales.len()
}

impl Splatting {
    /// The metadata of the extension's object, as far as they are known.
    fn metadata(&self, place: &str) -> Result<Metadata, Fault> {
        let unknown = |what: &str, value: &str, known: &str| {
            let text = format!("the {what} {value:?} is not one that is drawn ({known})");
            Err(Reason::Unsupported(text).at(Place::Part(format!("{place}, {EXTENSION}"))))
        };
        let mut metadata = Metadata::default();
        match self.kernel.as_deref() {
            Some("ellipse") => {}
            Some(kernel) => return unknown("kernel", kernel, "ellipse"),
            // Drafts had no kernels.
            None => metadata.note("no kernel is named, and ellipses are assumed"),
        }
        metadata.color_space = match self.color_space.as_deref() {
            Some("srgb_rec709_display") => Some(ColorSpace::SrgbRec709Display),
            Some("lin_rec709_display") => Some(ColorSpace::LinearRec709Display),
            Some(space) => {
                let known = "srgb_rec709_display, lin_rec709_display";
                return unknown("colour space", space, known);
            }
            None => None,
        };
        match self.projection.as_deref() {
            None | Some("perspective") => {}
            Some(projection) => return unknown("projection", projection, "perspective"),
        }
        metadata.order = match self.sorting_method.as_deref() {
            None | Some("cameraDistance") => Some(SortOrder::Distance),
            Some(method) => {
                metadata.note(format!("the sorting method {method:?} is unknown and ignored"));
                None
            }
        };
        Ok(metadata)
    }
}
