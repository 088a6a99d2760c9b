//! Writes `registry/features.rs`.

use crate::ash::Declarations;
use crate::chains::Chained;
use crate::error::Error;
use crate::registry::{Registry, by_version};
use crate::rust;
use crate::support::{Features, Support};
use std::collections::BTreeSet;
use std::fmt::Write;

/// A feature: its name in the registry and its name in Rust.
pub(crate) type Feature<'a> = (&'a str, &'a str);

/// The structures that hold features, the core one first.
pub(crate) fn structures<'a>(
    registry: &'a Registry,
    declarations: &'a Declarations,
    support: &'a Support,
) -> Result<Vec<Chained<'a>>, Error> {
    let mut structures = vec![Chained::new(registry, declarations, "VkPhysicalDeviceFeatures", None)?];
    structures.extend(Chained::all(registry, declarations, support, "VkPhysicalDeviceFeatures2")?);
    Ok(structures)
}

/// All features, each once, in the order of the structures.
pub(crate) fn all<'a>(structures: &[Chained<'a>]) -> Vec<Feature<'a>> {
    let mut seen = BTreeSet::new();
    structures
        .iter()
        .flat_map(Chained::members)
        .map(|(member, declared)| (member.name.as_str(), declared.name.as_str()))
        .filter(|(name, _)| seen.insert(*name))
        .collect()
}

/// The features that work, by their names in the registry.
fn supported<'a>(support: &'a Support, structures: &[Chained<'a>]) -> Result<BTreeSet<&'a str>, Error> {
    let mut supported = BTreeSet::new();
    let mut add = |owner: Option<&'a str>, names: Vec<&'a str>| {
        let known: Vec<&str> = structures
            .iter()
            .filter(|chained| chained.extension == owner)
            .flat_map(|chained| &chained.structure.members)
            .map(|member| member.name.as_str())
            .collect();
        let names = if names == ["all"] { known.clone() } else { names };
        for name in names {
            if !known.contains(&name) {
                let owner = owner.unwrap_or("core");
                return Err(Error::Support(format!("{owner} has no feature {name}")));
            }
            if !supported.insert(name) {
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
    let features = all(&structures);
    let supported = supported(support, &structures)?;
    let mut fields = String::new();
    let mut none = String::new();
    let mut works = String::new();
    let mut list = String::new();
    for (name, field) in &features {
        let _ = writeln!(fields, "/// `{name}`.\npub(crate) {field}: bool,");
        let _ = writeln!(none, "{field}: false,");
        let _ = writeln!(list, "(\"{name}\", self.{field}),");
        if supported.contains(name) {
            let _ = writeln!(works, "{field}: true,");
        }
    }
    let mut writes = String::new();
    let mut reads = String::new();
    let mut extensions = String::new();
    for chained in &structures {
        let ty = &chained.declared.ty;
        let mut write = String::new();
        let mut read = String::new();
        for (_, member) in chained.members() {
            let field = &member.name;
            let _ = writeln!(write, "out.{field} = self.{field}.into();");
            let _ = writeln!(read, "self.{field} |= requested.{field} != vk::FALSE;");
        }
        if chained.name == "VkPhysicalDeviceFeatures" {
            continue;
        }
        let _ = writeln!(writes, "if let Some(out) = structure.cast::<{ty}>() {{ {write} }}");
        let _ = writeln!(reads, "if let Some(requested) = valid::cast::<{ty}>(structure) {{ {read} }}");
        if let Some(extension) = chained.extension {
            let ty = ty.trim_end_matches("<'_>");
            let _ = writeln!(extensions, "{ty}::STRUCTURE_TYPE => Some(c\"{extension}\"),");
        }
    }
    let core = &structures[0];
    let (mut core_out, mut core_in) = (String::new(), String::new());
    for (_, member) in core.members() {
        let field = &member.name;
        let _ = writeln!(core_out, "{field}: self.{field}.into(),");
        let _ = writeln!(core_in, "self.{field} |= requested.{field} != vk::FALSE;");
    }
    let count = features.len();
    rust::file(
        "//! Features: those that this driver supports, and the structures in which Vulkan asks for them.",
        &format!(
            "use crate::abi::valid;
            use ash::vk::{{self, TaggedStructure}};
            use std::ffi::CStr;

            /// Features, each once, whatever structures hold it.
            #[derive(Clone, Debug, PartialEq, Eq)]
            pub(crate) struct Features {{ {fields} }}

            /// The features that this driver supports.
            pub(crate) const SUPPORTED: Features = Features {{ {works} ..Features::NONE }};

            impl Features {{
                /// No feature.
                pub(crate) const NONE: Self = Self {{ {none} }};

                /// The features by their names.
                pub(crate) fn list(&self) -> [(&'static str, bool); {count}] {{ [{list}] }}

                /// The features of the core structure.
                pub(crate) fn core(&self) -> vk::PhysicalDeviceFeatures {{
                    vk::PhysicalDeviceFeatures {{ {core_out} }}
                }}

                /// Adds the features that the core structure requests.
                pub(crate) fn add_core(&mut self, requested: &vk::PhysicalDeviceFeatures) {{ {core_in} }}

                /// Writes the features to a structure of a chain, if it holds any that are known here.
                pub(crate) fn write(&self, mut structure: valid::ChainedOutput<'_>) {{ {writes} }}

                /// Adds the features that a structure of a chain requests, if it holds any that are known here.
                pub(crate) fn add(&mut self, structure: &vk::BaseInStructure<'_>) {{ {reads} }}
            }}

            /// The extension without which the features of a structure can't be enabled; features of core need none.
            pub(crate) fn extension_of(structure: vk::StructureType) -> Option<&'static CStr> {{
                match structure {{ {extensions} _ => None }}
            }}

            /// The features that Vulkan makes mandatory, by the core version that does, and their names.
            #[cfg(test)]
            pub(crate) const MANDATORY: &[(u32, &[&str])] = &[{mandatory}];
            ",
            mandatory = mandatory(registry, support, &features)?,
        ),
    )
}

/// The features that core versions make mandatory.
fn mandatory(registry: &Registry, support: &Support, features: &[Feature<'_>]) -> Result<String, Error> {
    let known: BTreeSet<&str> = features.iter().map(|(name, _)| *name).collect();
    let mut text = String::new();
    let newest = support.version()?;
    let conditional = |requirement: &crate::registry::Requirement<_>| !support.meets(requirement.depends.as_deref());
    for ((major, minor), required) in
        by_version(
            &registry.versions,
            newest,
            |requirement| {
                if conditional(requirement) { &[] } else { &requirement.features }
            },
        )
    {
        let names: BTreeSet<&str> =
            required.into_iter().filter_map(|(_, name)| known.get(name.as_str()).copied()).collect();
        let names: String = names.iter().map(|name| format!("\"{name}\",")).collect();
        let _ = writeln!(text, "(vk::API_VERSION_{major}_{minor}, &[{names}]),");
    }
    Ok(text)
}
