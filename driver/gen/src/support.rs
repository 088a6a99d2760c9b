//! The features and extensions that the driver supports, read from `driver/support.toml`.

use crate::error::Error;
use crate::registry::{self, Registry, Version};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The file's contents.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// The features of the core version.
    pub core: Core,
    /// The listed extensions.
    pub extension: BTreeMap<String, Listed>,
    /// SPIR-V's capabilities.
    pub spirv: Spirv,
    /// Commands for which the driver has no function.
    pub commands: Commands,
    /// Promoted extensions that are not supported, with the reasons.
    pub absent: BTreeMap<String, String>,
}

/// The features of the core version.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Core {
    /// The version.
    pub version: String,
    /// The features that work, by their names in the registry.
    pub features: Vec<String>,
    /// Features that the version makes mandatory and that don't work, with the reasons.
    #[serde(default)]
    pub missing: BTreeMap<String, String>,
}

/// SPIR-V's capabilities.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spirv {
    /// Capabilities that work although their extension isn't listed.
    pub accepted: Vec<String>,
}

/// Commands for which the driver has no function.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Commands {
    /// Commands that fail, with the reasons.
    pub refused: BTreeMap<String, String>,
    /// Commands that rightly do nothing, with the reasons.
    pub no_op: BTreeMap<String, String>,
}

/// An extension in the list.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Listed {
    /// The extension's features that work.
    #[serde(default)]
    pub features: Features,
}

/// Features of an extension.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub enum Features {
    /// The features with these names.
    Some(Vec<String>),
    /// All features: the text `"all"`.
    All(String),
}

impl Default for Features {
    fn default() -> Self {
        Self::Some(Vec::new())
    }
}

impl Support {
    /// Reads the file.
    ///
    /// # Errors
    /// [`Error::File`] and [`Error::SupportSyntax`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        Ok(toml::from_str(&registry::read(path)?)?)
    }

    /// The core version.
    ///
    /// # Errors
    /// [`Error::Support`] if the text is not a version.
    pub fn version(&self) -> Result<Version, Error> {
        registry::version(&self.core.version)
            .ok_or_else(|| Error::Support(format!("{} is no version", self.core.version)))
    }

    /// Reports whether a name in one of the registry's conditions is supported: a core version, an extension, or a
    /// feature as `Structure::member`.
    pub fn has(&self, name: &str) -> bool {
        if let Some((_, feature)) = name.split_once("::") {
            return self.core.features.iter().any(|f| f == feature);
        }
        match (registry::version(name), self.version()) {
            (Some(version), Ok(newest)) => version <= newest,
            _ => self.extension.contains_key(name),
        }
    }

    /// Reports whether a condition of the registry holds. No condition always holds.
    pub fn meets(&self, condition: Option<&str>) -> bool {
        condition.is_none_or(|condition| registry::holds(condition, &|name| self.has(name)))
    }

    /// Checks that the file agrees with the registry.
    ///
    /// # Errors
    /// [`Error::Support`] names the first extension that is unknown, lacks a dependency, or was promoted to core and is
    /// neither listed nor absent with a reason; or the first mandatory feature that is neither supported nor missing
    /// with a reason.
    pub fn check(&self, registry: &Registry) -> Result<(), Error> {
        let wrong = |text: String| Err(Error::Support(text));
        for name in self.extension.keys().chain(self.absent.keys()) {
            let Some(extension) = registry.extension(name) else {
                return wrong(format!("the registry has no {name}"));
            };
            if self.extension.contains_key(name) && !self.meets(extension.depends.as_deref()) {
                let depends = extension.depends.as_deref().unwrap_or_default();
                return wrong(format!("{name} depends on {depends}"));
            }
        }
        for extension in &registry.extensions {
            let name = &extension.name;
            let is_promoted = extension.promoted_to.as_deref().is_some_and(|to| registry::version(to).is_some());
            match (self.extension.contains_key(name), self.absent.contains_key(name)) {
                (false, false) if is_promoted => {
                    return wrong(format!(
                        "{name} was promoted to core, and is neither listed nor absent with a reason"
                    ));
                }
                (true, true) => return wrong(format!("{name} is both listed and absent")),
                _ => {}
            }
        }
        let newest = self.version()?;
        for requirement in &registry.versions {
            if requirement.by > newest || !self.meets(requirement.depends.as_deref()) {
                continue;
            }
            for (_, feature) in &requirement.features {
                let works = self.core.features.contains(feature);
                if works == self.core.missing.contains_key(feature) {
                    return wrong(format!(
                        "{feature} is mandatory: it is either one of the features or missing with a reason"
                    ));
                }
            }
        }
        Ok(())
    }
}
