//! The scene of a layer: the Gaussians of its prims, with their transforms, visibility and purpose.

use std::collections::BTreeMap;

use glam::DAffine3;

use super::composition::Stage;
use super::gaussians;
use super::layer::{Layer, Prim, Specifier, Value};
use super::xform::Local;
use crate::axes::{Axes, AxesReason, FileAxes};
use crate::error::{Fault, Place, Reason};
use crate::formats::input::Origin;
use crate::scene::Scene;
use crate::transform::Motion;

/// A writer that keeps the axes of PLY files and writes that y is upwards. It names itself in the documentation.
const KEEPS_PLY: &str = "usd-convert-gsplat";

/// The state that a prim takes from those above it.
#[derive(Clone, Copy)]
struct Inherited {
    /// The transform to the stage.
    map: DAffine3,
    is_drawn: bool,
}

/// The scene of a composed stage.
pub(super) fn scene(stage: &Stage, origin: Origin<'_>) -> Result<Scene, Fault> {
    let Stage { layer, problems } = stage;
    let stated = axes(layer)?;
    let given = origin.options.axes.map(|axes| FileAxes { axes, reason: AxesReason::Given, of_cameras: false });
    let taken = given.unwrap_or(stated);
    let to_scene = DAffine3::from_mat3(taken.axes.matrix());
    let mut scene = Scene::default();
    let mut inherited: Vec<Inherited> = Vec::with_capacity(layer.prims.len());
    let mut ignored: BTreeMap<&str, usize> = BTreeMap::new();
    let mut hidden = 0;
    for prim in &layer.prims {
        let above = prim.parent.map_or(Inherited { map: DAffine3::IDENTITY, is_drawn: true }, |i| inherited[i]);
        let is_drawn = above.is_drawn && is_drawn(prim);
        let local = Local::of(prim)?;
        let map = if local.is_reset { local.map } else { above.map * local.map };
        inherited.push(Inherited { map, is_drawn });
        let Some(geometry) = gaussians::geometry(prim) else {
            if !prim.kind.is_empty() && !matches!(prim.kind.as_str(), "Xform" | "Scope") {
                *ignored.entry(&prim.kind).or_default() += 1;
            }
            continue;
        };
        if !is_drawn {
            hidden += 1;
            continue;
        }
        let map = to_scene * map;
        if !map.is_finite() || map.matrix3.determinant() == 0.0 {
            let text = "its transform cannot be inverted";
            return Err(Reason::Unsupported(text.to_owned()).at(Place::Part(format!("prim {}", prim.path))));
        }
        let mut part = gaussians::scene(prim, geometry)?;
        part.apply(&Motion::new(map.matrix3, map.translation, part.sh_degree()));
        scene.try_join(part)?;
    }
    if scene.is_empty() {
        let text = format!("no prim that is drawn is a {} with Gaussians", gaussians::TYPE);
        return Err(Reason::Unsupported(text).at(Place::File));
    }
    let metadata = scene.metadata_mut();
    metadata.axes = Some(taken);
    problems.iter().for_each(|problem| metadata.warn(problem.as_str()));
    if hidden > 0 {
        metadata.note(format!("prims that are inactive, invisible, or for proxies or guides are ignored: {hidden}"));
    }
    if !ignored.is_empty() {
        let kinds: Vec<String> = ignored.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        metadata.note(format!("prims of other types are ignored: {}", kinds.join(", ")));
    }
    if let Some(meters) = layer.fields.get("metersPerUnit").and_then(Value::number).filter(|meters| *meters != 1.0) {
        metadata.note(format!("a unit is {meters} m, and lengths are left in the file's units"));
    }
    Ok(scene)
}

/// The axes of `layer`: y upwards unless it says that z is.
fn axes(layer: &Layer) -> Result<FileAxes, Fault> {
    let file = |axes| FileAxes { axes, reason: AxesReason::File, of_cameras: false };
    let documentation = ["documentation", "comment"].map(|field| layer.fields.get(field).and_then(Value::text));
    if documentation.into_iter().flatten().any(|text| text.contains(KEEPS_PLY)) {
        return Ok(file(Axes::RIGHT_DOWN_FRONT));
    }
    match layer.fields.get("upAxis").map(Value::text) {
        None => Ok(FileAxes { axes: Axes::RIGHT_UP_BACK, reason: AxesReason::Format, of_cameras: false }),
        Some(Some("Y")) => Ok(file(Axes::RIGHT_UP_BACK)),
        Some(Some("Z")) => Ok(file(Axes::RIGHT_FRONT_UP)),
        Some(_) => Err(Reason::Unsupported("it is neither Y nor Z".to_owned()).at(Place::Header("upAxis"))),
    }
}

/// True if `prim` is drawn, as far as it says itself.
fn is_drawn(prim: &Prim) -> bool {
    let token = |name: &str| prim.value(name).and_then(Value::text);
    prim.is_active != Some(false)
        && prim.specifier == Specifier::Def
        && token("visibility") != Some("invisible")
        && !matches!(token("purpose"), Some("proxy" | "guide"))
}
