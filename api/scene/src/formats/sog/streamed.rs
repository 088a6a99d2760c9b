//! Streamed SOG: a tree of regions, each with parts of SOG scenes at several levels of detail.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::attributes;
use super::document::{META, parse};
use super::files::{Files, join};
use crate::error::{Fault, Place, Reason};
use crate::formats::input::Origin;
use crate::scene::Scene;

#[derive(Deserialize)]
struct Meta {
    version: Option<u32>,
    #[serde(rename = "lodLevels")]
    levels: u32,
    environment: Option<String>,
    filenames: Vec<String>,
    tree: Node,
}

/// A region. serde_json refuses trees of more than 128 levels.
#[derive(Deserialize)]
struct Node {
    #[serde(default)]
    children: Vec<Node>,
    #[serde(default)]
    lods: BTreeMap<String, Part>,
}

/// A range of a scene's Gaussians.
#[derive(Clone, Copy, Deserialize)]
struct Part {
    file: usize,
    offset: usize,
    count: usize,
}

/// Reads the level that the caller asks for of the document `meta`, and the scene's environment.
pub(super) fn load(meta: &[u8], origin: Origin<'_>) -> Result<Scene, Fault> {
    let meta: Meta = parse(meta, Place::File)?;
    let part = |field: &str| Place::Part(field.to_owned());
    if let Some(found) = meta.version.filter(|version| *version != 1) {
        let read = "1";
        return Err(Reason::Version { found, read }.at(part("version")));
    }
    let level = origin.options.level;
    if level >= meta.levels {
        let text = format!("level {level} is not one of the scene's {} levels", meta.levels);
        return Err(Reason::Unsupported(text).at(part("lodLevels")));
    }
    let mut parts: BTreeMap<usize, Vec<Part>> = BTreeMap::new();
    collect(&meta.tree, &level.to_string(), &mut parts);
    let mut scene = Scene::default();
    for (file, mut parts) in parts {
        let name = meta.filenames.get(file).ok_or_else(|| {
            let (found, expected) = (meta.filenames.len() as u64, file as u64 + 1);
            Reason::Count { found, expected }.at(part("filenames"))
        })?;
        let unit = unit(name, origin)?;
        parts.sort_by_key(|part| part.offset);
        let mut end = 0;
        for part in &parts {
            let last = part.offset.checked_add(part.count);
            let Some(last) = last.filter(|last| part.offset >= end && *last <= unit.len()) else {
                let text = "regions overlap, or reach past the scene's end";
                return Err(Reason::Unsupported(text.to_owned()).at(Place::Entry(name.clone())));
            };
            end = last;
        }
        let whole = parts.iter().map(|part| part.count).sum::<usize>() == unit.len();
        if whole {
            scene.try_join(unit)?;
        } else {
            for part in parts.iter().filter(|part| part.count > 0) {
                scene.try_join(unit.range(part.offset..part.offset + part.count))?;
            }
        }
    }
    if let Some(name) = &meta.environment {
        scene.try_join(unit(name, origin)?)?;
    }
    if scene.is_empty() {
        return Err(Reason::Empty.at(Place::File));
    }
    Ok(scene)
}

/// Collects the parts of `node` and its descendants at `level`, by file.
fn collect(node: &Node, level: &str, parts: &mut BTreeMap<usize, Vec<Part>>) {
    if let Some(part) = node.lods.get(level) {
        parts.entry(part.file).or_default().push(*part);
    }
    for child in &node.children {
        collect(child, level, parts);
    }
}

/// Reads the scene `name`, a document or an archive.
fn unit(name: &str, origin: Origin<'_>) -> Result<Scene, Fault> {
    let bytes = origin.companion(name)?;
    let read = || {
        if bytes.starts_with(b"PK\x03\x04") {
            let files = Files::archive(&bytes)?;
            return attributes::load(&files.read(META)?, &files);
        }
        let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
        attributes::load(&bytes, &Files::folder(origin, folder))
    };
    // The place of the fault is in the named file.
    read().and_then(|scene| scene.decoded(scene.sh_degree)).map_err(|fault| match fault.place {
        Place::Part(place) => fault.reason.at(Place::Part(format!("{name:?}, {place}"))),
        Place::Entry(entry) if !entry.contains('/') => fault.reason.at(Place::Entry(join(name, &entry))),
        _ => fault.reason.at(Place::Entry(name.to_owned())),
    })
}
