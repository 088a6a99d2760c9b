//! Writes `registry/spirv.rs`.

use crate::ash::Declarations;
use crate::chains::Chained;
use crate::error::Error;
use crate::registry::Registry;
use crate::support::Support;
use crate::{features, properties, rust};
use spirv::Capability;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::str::FromStr;
use vk_parse::Enable;

/// The part of the driver's support that may enable a capability.
struct Known<'a> {
    registry: &'a Registry,
    support: &'a Support,
    features: Vec<Chained<'a>>,
    properties: Vec<Chained<'a>>,
}

pub(crate) fn write(registry: &Registry, declarations: &Declarations, support: &Support) -> Result<String, Error> {
    let known = Known {
        registry,
        support,
        features: features::structures(registry, declarations, support)?,
        properties: properties::structures(registry, declarations, support)?,
    };
    let mut arms = String::new();
    // A capability may have several names.
    let mut seen = BTreeSet::new();
    for (name, enables) in &registry.capabilities {
        let Ok(capability) = Capability::from_str(name) else {
            continue;
        };
        if !seen.insert(capability as u32) {
            continue;
        }
        let mut rows = Vec::new();
        for enable in enables {
            match known.enable(enable)? {
                Some(row) => rows.push(row),
                // The core version enables it.
                None => {
                    rows.clear();
                    break;
                }
            }
        }
        let mut distinct = BTreeSet::new();
        rows.retain(|row| distinct.insert(row.clone()));
        if !rows.is_empty() && !support.spirv.accepted.contains(name) {
            let _ = writeln!(arms, "Capability::{capability:?} => &[{}],", rows.join(", "));
        }
    }
    rust::file(
        "//! SPIR-V's capabilities, and what enables each.",
        &format!(
            "use self::Enable::{{Absent, Extension, Feature, Property}};
            use crate::registry::properties::Properties;
            use ash::vk;
            use spirv::Capability;
            use std::ffi::CStr;

            /// A thing that enables a capability.
            #[derive(Clone, Copy, Debug)]
            pub(crate) enum Enable {{
                /// A feature, by its name.
                Feature(&'static str),
                /// A value of a property, and the property's name.
                Property(&'static str, fn(&Properties) -> bool),
                /// An extension of devices.
                Extension(&'static CStr),
                /// A feature, property, extension or version that this driver doesn't have.
                Absent(&'static str),
            }}

            /// The things of which one enables a capability. There are none where the core version is enough, nor for
            /// capabilities that Vulkan doesn't know.
            pub(crate) fn enables(capability: Capability) -> &'static [Enable] {{
                match capability {{ {arms} _ => &[] }}
            }}
            "
        ),
    )
}

impl Known<'_> {
    /// The expression for a condition that enables a capability; `None` if it always holds.
    fn enable(&self, enable: &Enable) -> Result<Option<String>, Error> {
        Ok(match enable {
            Enable::Version(name) if self.support.has(name) => None,
            Enable::Extension(name) if self.support.has(name) => Some(format!("Extension(c\"{name}\")")),
            Enable::Version(name) | Enable::Extension(name) => Some(absent(name)),
            Enable::Feature(feature) => Some(self.feature(feature)),
            Enable::Property(property) => Some(self.property(property)?),
            _ => Some(absent("something else")),
        })
    }

    fn feature(&self, enable: &vk_parse::FeatureEnable) -> String {
        let structure = self.registry.type_name(&enable.struct_);
        let name = &enable.feature;
        let mut holders = self.features.iter().filter(|chained| chained.name == structure);
        let is_known = holders.any(|chained| member(chained, name).is_some());
        if is_known { format!("Feature(\"{name}\")") } else { absent(name) }
    }

    fn property(&self, enable: &vk_parse::PropertyEnable) -> Result<String, Error> {
        let structure = self.registry.type_name(&enable.property);
        let Some(chained) = self.properties.iter().find(|c| c.name == structure) else {
            return Ok(absent(&enable.member));
        };
        let Some(field) = member(chained, &enable.member) else {
            return Err(Error::Support(format!("{structure} has no member {}", enable.member)));
        };
        let field = properties::field(structure, field);
        let condition = match enable.value.as_str() {
            "VK_TRUE" => format!("p.{field}"),
            value => {
                let bit = value
                    .strip_prefix("VK_SUBGROUP_FEATURE_")
                    .and_then(|value| value.split("_BIT").next())
                    .ok_or_else(|| Error::Support(format!("{value} is no bit known here")))?;
                if value.ends_with("_BIT") {
                    format!("p.{field}.contains(vk::SubgroupFeatureFlags::{bit})")
                } else {
                    return Ok(absent(&enable.member));
                }
            }
        };
        let name = &enable.member;
        Ok(format!("Property(\"{name}\", |p| {condition})"))
    }
}

fn absent(name: &str) -> String {
    format!("Absent(\"{name}\")")
}

/// The Rust name of a structure's member.
fn member<'a>(chained: &Chained<'a>, name: &str) -> Option<&'a str> {
    chained.members().find(|(member, _)| member.name == name).map(|(_, declared)| declared.name.as_str())
}
