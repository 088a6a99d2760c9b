//! The structures of the `pNext` chains with which applications query features and properties.

use crate::ash::{self, Declarations};
use crate::error::Error;
use crate::registry::{self, Registry};
use crate::support::Support;

/// A structure of a chain.
#[derive(Debug)]
pub(crate) struct Chained<'a> {
    /// Its name in the registry.
    pub(crate) name: &'a str,
    /// Its definition in the registry.
    pub(crate) structure: &'a registry::Structure,
    /// Its declaration, whose members are in the same order.
    pub(crate) declared: &'a ash::Structure,
    /// The extensions of which each adds it; none if the core version does.
    pub(crate) extensions: Vec<&'a str>,
}

impl<'a> Chained<'a> {
    /// A structure of the registry with its declaration.
    pub(crate) fn new(
        registry: &'a Registry,
        declarations: &'a Declarations,
        name: &'a str,
        extensions: Vec<&'a str>,
    ) -> Result<Self, Error> {
        let name = registry.type_name(name);
        let structure = registry
            .structures
            .get(name)
            .ok_or_else(|| Error::Support(format!("the registry has no structure {name}")))?;
        let declared = declarations.structure(registry, name)?;
        if structure.members.len() != declared.members.len() {
            return Err(Error::Undeclared(format!("{name} with all its members")));
        }
        Ok(Self { name, structure, declared, extensions })
    }

    /// The structures that extend `base`: those of the core version, beginning with those that hold all of a version's,
    /// then those of listed extensions.
    pub(crate) fn all(
        registry: &'a Registry,
        declarations: &'a Declarations,
        support: &'a Support,
        base: &str,
    ) -> Result<Vec<Self>, Error> {
        let newest = support.version()?;
        let core = registry
            .versions
            .iter()
            .filter(|requirement| requirement.by <= newest)
            .flat_map(|requirement| requirement.types.iter().map(|name| (name, None)));
        let listed = support.extension.keys().flat_map(|extension| {
            registry
                .extension(extension)
                .into_iter()
                .flat_map(|found| &found.requirements)
                .filter(|requirement| support.meets(requirement.depends.as_deref()))
                .flat_map(|requirement| &requirement.types)
                .map(|name| (name, Some(extension.as_str())))
        });
        let mut chained: Vec<Self> = Vec::new();
        for (name, extension) in core.chain(listed) {
            let last = registry.type_name(name);
            let extends = registry
                .structures
                .get(last)
                .is_some_and(|structure| structure.extends.iter().any(|name| name == base));
            if !extends {
                continue;
            }
            match chained.iter_mut().find(|known| known.name == last) {
                // A structure of the core version needs no extension.
                Some(known) if known.extensions.is_empty() => {}
                Some(known) => known.extensions.extend(extension.filter(|name| !known.extensions.contains(name))),
                None => chained.push(Self::new(registry, declarations, name, extension.into_iter().collect())?),
            }
        }
        chained.sort_by_key(|chained| {
            (!chained.extensions.is_empty(), !chained.name.starts_with("VkPhysicalDeviceVulkan1"))
        });
        Ok(chained)
    }

    /// Pairs of a member's name and type in the registry and its declaration.
    pub(crate) fn members(&self) -> impl Iterator<Item = (&'a registry::Member, &'a ash::Member)> {
        self.structure.members.iter().zip(&self.declared.members)
    }
}
