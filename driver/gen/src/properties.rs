//! Writes `registry/properties.rs`.

use crate::ash::{self, Declarations};
use crate::chains::Chained;
use crate::error::Error;
use crate::registry::{self, Registry};
use crate::rust;
use crate::support::Support;
use crate::tables::{Row, Table, path};
use std::collections::BTreeMap;

/// The structures that are in no chain, with their words in the table: the core structure, and its parts.
const CORE: [(&str, &str); 3] = [
    ("core", "VkPhysicalDeviceProperties"),
    ("limits", "VkPhysicalDeviceLimits"),
    ("sparse", "VkPhysicalDeviceSparseProperties"),
];

/// The members of the core structure that are themselves structures of properties.
const PARTS: [&str; 2] = ["limits", "sparse_properties"];

/// Members that have another name in the structure that holds all properties of a version.
const RENAMED: [(&str, &str, &str); 3] = [
    ("VkPhysicalDeviceSubgroupProperties", "supported_stages", "subgroup_supported_stages"),
    ("VkPhysicalDeviceSubgroupProperties", "supported_operations", "subgroup_supported_operations"),
    ("VkPhysicalDeviceSubgroupProperties", "quad_operations_in_all_stages", "subgroup_quad_operations_in_all_stages"),
];

/// The structures of a chain that hold properties.
pub(crate) fn structures<'a>(
    registry: &'a Registry,
    declarations: &'a Declarations,
    support: &'a Support,
) -> Result<Vec<Chained<'a>>, Error> {
    Chained::all(registry, declarations, support, "VkPhysicalDeviceProperties2")
}

/// The member with the number of elements, of a list that the application lends. The driver itself writes such lists.
fn list<'a>(member: &'a registry::Member, declared: &ash::Member) -> Option<&'a str> {
    declared.ty.starts_with('*').then_some(member.len.as_deref()).flatten()
}

/// The name of a structure's member among all properties.
pub(crate) fn field<'a>(structure: &str, member: &'a str) -> &'a str {
    RENAMED.iter().find(|(of, from, _)| *of == structure && *from == member).map_or(member, |(_, _, to)| to)
}

pub(crate) fn write(registry: &Registry, declarations: &Declarations, support: &Support) -> Result<String, Error> {
    let mut holders = Vec::new();
    for (heading, name) in CORE {
        holders.push((heading, Chained::new(registry, declarations, name, Vec::new())?));
    }
    let chained = structures(registry, declarations, support)?;
    holders.extend(chained.into_iter().map(|chained| ("structure", chained)));

    let mut types = BTreeMap::new();
    let mut table = Table::default();
    for (heading, chained) in &holders {
        let mut rows = Vec::new();
        let lists: Vec<&str> = chained.members().filter_map(|(member, declared)| list(member, declared)).collect();
        for (member, declared) in chained.members() {
            let field = field(chained.name, &declared.name);
            let is_list = list(member, declared).is_some() || lists.contains(&member.name.as_str());
            if PARTS.contains(&field) || is_list {
                continue;
            }
            let ty = declared.ty.as_str();
            let first = *types.entry(field).or_insert(ty);
            if first != ty {
                return Err(Error::Support(format!("{field} is of two types: {first} and {ty}")));
            }
            rows.push(Row { name: &member.name, member: &declared.name, field, value: shown(ty) });
        }
        let ty = path(&chained.declared.ty);
        table.add(ty, &format!("{heading} {ty}"), rows.into_iter());
    }
    rust::file(
        "//! Properties and limits, and the structures in which Vulkan asks for them.",
        &format!(
            "use super::tables::properties;
            use crate::abi::valid::ChainedOutput;
            use ash::vk;

{}",
            table.text("properties")
        ),
    )
}

/// The type of a property, as a row shows it.
fn shown(ty: &str) -> String {
    match ty {
        "vk :: Bool32" => "bool".to_owned(),
        _ => ty.replace(" :: ", "::").replace(" ;", ";"),
    }
}
