//! Writes `registry/features.rs`.

use crate::ash::Declarations;
use crate::chains::Chained;
use crate::error::Error;
use crate::registry::{Registry, Version};
use crate::rust::{self, MAX_WIDTH};
use crate::support::{Features, Support};
use crate::tables::{Row, Table, path};
use std::collections::{BTreeMap, BTreeSet};

/// The structure of core 1.0's features.
const CORE: &str = "VkPhysicalDeviceFeatures";

/// The structures that hold features, the core one first.
pub(crate) fn structures<'a>(
    registry: &'a Registry,
    declarations: &'a Declarations,
    support: &'a Support,
) -> Result<Vec<Chained<'a>>, Error> {
    let mut structures = vec![Chained::new(registry, declarations, CORE, Vec::new())?];
    structures.extend(Chained::all(registry, declarations, support, "VkPhysicalDeviceFeatures2")?);
    Ok(structures)
}

/// The features that work, by their names in the registry.
fn supported<'a>(support: &'a Support, structures: &[Chained<'a>]) -> Result<BTreeSet<&'a str>, Error> {
    let mut supported = BTreeSet::new();
    let mut add = |owner: Option<&'a str>, names: Vec<&'a str>| {
        let is_owned = |chained: &&Chained<'a>| match owner {
            Some(owner) => chained.extensions.contains(&owner),
            None => chained.extensions.is_empty(),
        };
        let known: Vec<&str> = structures
            .iter()
            .filter(is_owned)
            .flat_map(|chained| &chained.structure.members)
            .map(|member| member.name.as_str())
            .collect();
        let names = if names == ["all"] { known.clone() } else { names };
        for name in names {
            if !known.contains(&name) {
                let owner = owner.unwrap_or("core");
                return Err(Error::Support(format!("{owner} has no feature {name}")));
            }
            // The extensions of one structure have the same features.
            if !supported.insert(name) && owner.is_none() {
                return Err(Error::Support(format!("{name} is there twice")));
            }
        }
        Ok(())
    };
    add(None, support.core.features.iter().map(String::as_str).collect())?;
    for (name, listed) in &support.extension {
        let names = match &listed.features {
            Features::Some(names) => names.iter().map(String::as_str).collect(),
            Features::All(all) => vec![all.as_str()],
        };
        add(Some(name), names)?;
    }
    Ok(supported)
}

pub(crate) fn write(registry: &Registry, declarations: &Declarations, support: &Support) -> Result<String, Error> {
    let structures = structures(registry, declarations, support)?;
    let supported = supported(support, &structures)?;
    let mandatory = mandatory(registry, support)?;
    let mut table = Table::default();
    for chained in &structures {
        let ty = path(&chained.declared.ty);
        let heading = match &chained.extensions[..] {
            [] if chained.name == CORE => format!("core {ty}"),
            [] => format!("structure {ty}"),
            extensions => extension_heading(ty, extensions),
        };
        let rows = chained.members().map(|(member, declared)| {
            let name = member.name.as_str();
            let mandatory =
                mandatory.get(name).map_or_else(String::new, |(major, minor)| format!(", mandatory {major}.{minor}"));
            let value = format!("{}{mandatory}", supported.contains(name));
            Row { name, member: &declared.name, field: &declared.name, value }
        });
        table.add(ty, &heading, rows);
    }
    rust::file(
        "//! Features: those that this driver supports, and the structures in which Vulkan asks for them.",
        &format!(
            "use super::tables::features;
            use crate::abi::valid::{{self, ChainedOutput}};
            use ash::vk::{{self, TaggedStructure}};
            use std::ffi::CStr;

{}",
            table.text("features")
        ),
    )
}

/// The heading of a structure that each of some extensions adds, on one line or on two.
fn extension_heading(ty: &str, extensions: &[&str]) -> String {
    let names: Vec<String> = extensions.iter().map(|name| format!("c\"{name}\"")).collect();
    let heading = format!("structure {ty}: {}", names.join(" | "));
    if "     {".len() + heading.len() <= MAX_WIDTH { heading } else { heading.replace(": ", ":\n        ") }
}

/// The features that core versions make mandatory, by their names.
fn mandatory<'a>(registry: &'a Registry, support: &Support) -> Result<BTreeMap<&'a str, Version>, Error> {
    let newest = support.version()?;
    let requirements = registry.versions.iter();
    let features = requirements
        .filter(|requirement| requirement.by <= newest && support.meets(requirement.depends.as_deref()))
        .flat_map(|requirement| requirement.features.iter().map(|(_, name)| (name.as_str(), requirement.by)));
    let mut mandatory = BTreeMap::new();
    for (name, version) in features {
        let first = mandatory.entry(name).or_insert(version);
        *first = version.min(*first);
    }
    Ok(mandatory)
}
