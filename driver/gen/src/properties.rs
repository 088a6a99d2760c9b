//! Writes `registry/properties.rs`.

use crate::ash::Declarations;
use crate::chains::Chained;
use crate::error::Error;
use crate::registry::Registry;
use crate::rust;
use crate::support::Support;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The core structure, whose members are properties.
const CORE: &str = "VkPhysicalDeviceProperties";

/// The members of the core structure that are themselves structures of properties.
const NESTED: [(&str, &str); 2] =
    [("limits", "VkPhysicalDeviceLimits"), ("sparse_properties", "VkPhysicalDeviceSparseProperties")];

/// Members that have another name in the structure that holds all properties of a version.
const RENAMED: [(&str, &str, &str); 3] = [
    ("VkPhysicalDeviceSubgroupProperties", "supported_stages", "subgroup_supported_stages"),
    ("VkPhysicalDeviceSubgroupProperties", "supported_operations", "subgroup_supported_operations"),
    ("VkPhysicalDeviceSubgroupProperties", "quad_operations_in_all_stages", "subgroup_quad_operations_in_all_stages"),
];

/// A property: its name in the registry, its name in Rust and its type.
#[derive(Debug)]
pub(crate) struct Property<'a> {
    name: &'a str,
    field: &'a str,
    ty: &'a str,
}

/// The structures of a chain that hold properties.
pub(crate) fn structures<'a>(
    registry: &'a Registry,
    declarations: &'a Declarations,
    support: &'a Support,
) -> Result<Vec<Chained<'a>>, Error> {
    Chained::all(registry, declarations, support, "VkPhysicalDeviceProperties2")
}

/// The name of a structure's member among all properties.
pub(crate) fn field<'a>(structure: &str, member: &'a str) -> &'a str {
    RENAMED.iter().find(|(of, from, _)| *of == structure && *from == member).map_or(member, |(_, _, to)| to)
}

/// Adds a structure's properties, each name once.
fn add<'a>(all: &mut Vec<Property<'a>>, chained: &Chained<'a>) -> Result<(), Error> {
    for (member, declared) in chained.members() {
        let field = field(chained.name, &declared.name);
        if NESTED.iter().any(|(nested, _)| *nested == field) {
            continue;
        }
        match all.iter().find(|property| property.field == field) {
            Some(known) if known.ty != declared.ty => {
                return Err(Error::Support(format!("{field} is of two types: {} and {}", known.ty, declared.ty)));
            }
            Some(_) => {}
            None => all.push(Property { name: &member.name, field, ty: &declared.ty }),
        }
    }
    Ok(())
}

/// An expression for a property as a member of a structure.
fn value(field: &str, ty: &str) -> String {
    if ty == "vk :: Bool32" { format!("self.{field}.into()") } else { format!("self.{field}") }
}

pub(crate) fn write(registry: &Registry, declarations: &Declarations, support: &Support) -> Result<String, Error> {
    let chained = structures(registry, declarations, support)?;
    let core = Chained::new(registry, declarations, CORE, None)?;
    let nested: BTreeMap<&str, Chained<'_>> = NESTED
        .into_iter()
        .map(|(member, name)| Ok((member, Chained::new(registry, declarations, name, None)?)))
        .collect::<Result<_, Error>>()?;
    let mut all = Vec::new();
    add(&mut all, &core)?;
    for (member, _) in NESTED {
        add(&mut all, &nested[member])?;
    }
    for structure in &chained {
        add(&mut all, structure)?;
    }

    let mut fields = String::new();
    for Property { name, field, ty } in &all {
        let ty = if *ty == "vk :: Bool32" { "bool" } else { *ty };
        let _ = writeln!(fields, "/// `{name}`.\npub(crate) {field}: {ty},");
    }
    let literal = |structure: &Chained<'_>| -> String {
        let mut members = String::new();
        for (_, declared) in structure.members() {
            let value = match nested.get(declared.name.as_str()) {
                Some(nested) => {
                    let name = nested.name.trim_start_matches("VkPhysicalDevice");
                    format!("self.{}()", name.to_lowercase().replace("sparsep", "sparse_p"))
                }
                None => value(field(structure.name, &declared.name), &declared.ty),
            };
            let _ = writeln!(members, "{}: {value},", declared.name);
        }
        members
    };
    let mut writes = String::new();
    for structure in &chained {
        let mut members = String::new();
        for (_, declared) in structure.members() {
            let value = value(field(structure.name, &declared.name), &declared.ty);
            let _ = writeln!(members, "out.{} = {value};", declared.name);
        }
        let ty = &structure.declared.ty;
        let _ = writeln!(writes, "if let Some(out) = structure.cast::<{ty}>() {{ {members} }}");
    }
    rust::file(
        "//! Properties and limits, and the structures in which Vulkan asks for them.",
        &format!(
            "use crate::abi::valid;
            use ash::vk;

            /// Properties, each once, whatever structures hold it.
            #[derive(Clone, Debug)]
            pub(crate) struct Properties {{ {fields} }}

            impl Properties {{
                /// The properties of the core structure.
                pub(crate) fn core(&self) -> vk::PhysicalDeviceProperties {{
                    vk::PhysicalDeviceProperties {{ {core} }}
                }}

                fn limits(&self) -> vk::PhysicalDeviceLimits {{
                    vk::PhysicalDeviceLimits {{ {limits} }}
                }}

                fn sparse_properties(&self) -> vk::PhysicalDeviceSparseProperties {{
                    vk::PhysicalDeviceSparseProperties {{ {sparse} }}
                }}

                /// Writes the properties to a structure of a chain, if it holds any that are known here.
                pub(crate) fn write(&self, mut structure: valid::ChainedOutput<'_>) {{ {writes} }}
            }}
            ",
            core = literal(&core),
            limits = literal(&nested["limits"]),
            sparse = literal(&nested["sparse_properties"]),
        ),
    )
}
