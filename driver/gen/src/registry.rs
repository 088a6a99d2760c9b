//! The registry: the parts of `vk.xml` and of the extension's own fragment that the driver needs.

use crate::error::Error;
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::path::Path;
use vk_parse::{
    CommandDefinition, ExtensionChild, InterfaceItem, RegistryChild, TypeMember, TypeMemberMarkup, TypeSpec, TypesChild,
};

/// The version of the registry that is read.
pub const VERSION: &str = "1.4.366";

/// The SHA-256 of that version's `vk.xml`.
const SHA256: &str = "b6444639bee1102c9af8356299cefd09985b5bf8505f1d5dbe93d5c656fd8be1";

/// The registry's contents.
#[derive(Debug, Default)]
pub struct Registry {
    /// Structures by name.
    pub structures: HashMap<String, Structure>,
    /// Names of types by their aliases.
    type_aliases: HashMap<String, String>,
    /// Commands by name.
    pub commands: HashMap<String, Command>,
    /// Names of commands by their aliases.
    command_aliases: HashMap<String, String>,
    /// The requirements of core versions, in the registry's order.
    pub versions: Vec<Requirement<Version>>,
    /// The requirements of extensions, in the registry's order.
    pub extensions: Vec<Extension>,
    /// SPIR-V's capabilities, and the conditions that enable each.
    pub capabilities: Vec<(String, Vec<vk_parse::Enable>)>,
}

/// A structure.
#[derive(Clone, Debug)]
pub struct Structure {
    /// The structures whose `pNext` chains may contain it.
    pub extends: Vec<String>,
    /// Its members, without `sType` and `pNext`.
    pub members: Vec<Member>,
}

/// A member of a structure.
#[derive(Clone, Debug)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// The member with the number of elements, or an expression; `None` if it is not an array.
    pub len: Option<String>,
}

/// A command.
#[derive(Debug)]
pub struct Command {
    /// Its parameters.
    pub parameters: Vec<Parameter>,
}

/// A parameter of a command.
#[derive(Debug)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// The type that its declaration names.
    pub ty: String,
    /// The parameter with the number of elements, or an expression; `None` if it is not an array.
    pub len: Option<String>,
}

/// A core version, as its major and minor number.
pub type Version = (u32, u32);

/// A requirement of a core version or an extension, under a condition.
#[derive(Debug)]
pub struct Requirement<T> {
    /// The core version or extension.
    pub by: T,
    /// The condition, as an expression over versions, extensions and features.
    pub depends: Option<String>,
    /// Types.
    pub types: Vec<String>,
    /// Commands.
    pub commands: Vec<String>,
    /// Features: the structure's name and the member's.
    pub features: Vec<(String, String)>,
}

/// An extension.
#[derive(Debug)]
pub struct Extension {
    /// Its name.
    pub name: String,
    /// True if it is enabled for an instance, not for a device.
    pub is_of_instance: bool,
    /// The version of its specification.
    pub spec_version: u32,
    /// The core version or the extension that it was promoted to.
    pub promoted_to: Option<String>,
    /// The condition under which it may be supported.
    pub depends: Option<String>,
    /// The types, commands and features that it requires.
    pub requirements: Vec<Requirement<()>>,
}

impl Registry {
    /// Reads `vk.xml`, which must be of [`VERSION`], and the extension's fragment.
    ///
    /// # Errors
    /// [`Error::OtherRegistry`], and the errors of reading and parsing.
    pub fn read(vk_xml: &Path, fragment: &Path) -> Result<Self, Error> {
        read_version(vk_xml, VERSION, SHA256)?;
        let mut registry = Self::default();
        registry.add(vk_xml)?;
        registry.add(fragment)?;
        Ok(registry)
    }

    fn add(&mut self, path: &Path) -> Result<(), Error> {
        for child in parse(path)? {
            match child {
                RegistryChild::Types(types) => self.add_types(types.children),
                RegistryChild::Commands(commands) => self.add_commands(commands.children),
                RegistryChild::Feature(feature) if is_of_vulkan(Some(&feature.api)) => {
                    let number = feature.number.as_deref().and_then(version);
                    let by = number.ok_or_else(|| Error::Registry {
                        path: path.to_owned(),
                        reason: format!("{} is no version of Vulkan's", feature.name),
                    })?;
                    self.versions.extend(feature.children.into_iter().filter_map(|c| requirement(by, c)));
                }
                RegistryChild::Extensions(extensions) => {
                    self.extensions.extend(extensions.children.into_iter().filter_map(extension));
                }
                RegistryChild::SpirvCapabilities(capabilities) => {
                    self.capabilities.extend(capabilities.children.into_iter().map(|c| (c.name, c.enables)));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn add_types(&mut self, types: Vec<TypesChild>) {
        for ty in types {
            let TypesChild::Type(ty) = ty else { continue };
            let (Some(name), true) = (ty.name, is_of_vulkan(ty.api.as_deref())) else {
                continue;
            };
            if let Some(alias) = ty.alias {
                self.type_aliases.insert(name, alias);
            } else if let TypeSpec::Members(members) = ty.spec {
                let structure = Structure {
                    extends: list(ty.structextends.as_deref()),
                    members: members.into_iter().filter_map(member).collect(),
                };
                self.structures.insert(name, structure);
            }
        }
    }

    fn add_commands(&mut self, commands: Vec<vk_parse::Command>) {
        for command in commands {
            match command {
                vk_parse::Command::Alias { name, alias } => {
                    self.command_aliases.insert(name, alias);
                }
                vk_parse::Command::Definition(definition) if is_of_vulkan(definition.api.as_deref()) => {
                    let (name, command) = command_definition(definition);
                    self.commands.insert(name, command);
                }
                _ => {}
            }
        }
    }

    /// The newest name of a type, under which it is defined.
    pub fn type_name<'a>(&'a self, name: &'a str) -> &'a str {
        self.type_aliases.get(name).map_or(name, |alias| self.type_name(alias))
    }

    /// The newest name of a command, under which it is defined.
    pub fn command_name<'a>(&'a self, name: &'a str) -> &'a str {
        self.command_aliases.get(name).map_or(name, |alias| self.command_name(alias))
    }

    /// All names of a type, given one of them.
    pub fn type_names<'a>(&'a self, name: &'a str) -> Vec<&'a str> {
        let last = self.type_name(name);
        let mut names: Vec<&str> =
            self.type_aliases.keys().map(String::as_str).filter(|alias| self.type_name(alias) == last).collect();
        names.sort_unstable();
        names.insert(0, last);
        names
    }

    /// All names of a command, given one of them.
    pub fn command_names<'a>(&'a self, name: &'a str) -> Vec<&'a str> {
        let last = self.command_name(name);
        let mut names: Vec<&str> =
            self.command_aliases.keys().map(String::as_str).filter(|alias| self.command_name(alias) == last).collect();
        names.sort_unstable();
        names.insert(0, last);
        names
    }

    /// The extension with a name.
    pub fn extension(&self, name: &str) -> Option<&Extension> {
        self.extensions.iter().find(|e| e.name == name)
    }
}

/// Parses a file of the registry's.
///
/// # Errors
/// [`Error::Registry`].
pub(crate) fn parse(path: &Path) -> Result<Vec<RegistryChild>, Error> {
    let invalid = |reason: String| Error::Registry { path: path.to_owned(), reason };
    let (registry, errors) = vk_parse::parse_file(path).map_err(|error| invalid(format!("{error:?}")))?;
    match errors.first() {
        Some(error) => Err(invalid(format!("{error:?}"))),
        None => Ok(registry.0),
    }
}

/// Reads a file of a pinned version.
pub(crate) fn read_version(path: &Path, version: &str, sha256: &str) -> Result<String, Error> {
    let text = read(path)?;
    let found = format!("{:x}", Sha256::digest(&text));
    if found == sha256 {
        return Ok(text);
    }
    Err(Error::OtherRegistry { path: path.to_owned(), found, expected: format!("{version} with {sha256}") })
}

/// Reads a file.
///
/// # Errors
/// [`Error::File`].
pub(crate) fn read(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(|source| Error::File { path: path.to_owned(), source })
}

/// Reports whether a list of APIs contains Vulkan. Without a list, an element belongs to all APIs.
fn is_of_vulkan(apis: Option<&str>) -> bool {
    apis.is_none_or(|apis| apis.split(',').any(|api| api == "vulkan"))
}

fn list(text: Option<&str>) -> Vec<String> {
    text.into_iter().flat_map(|text| text.split(',')).map(str::to_owned).collect()
}

/// A version from its number (`1.3`) or its name (`VK_VERSION_1_3`).
pub fn version(text: &str) -> Option<Version> {
    let (major, minor) = text.strip_prefix("VK_VERSION_").unwrap_or(text).split_once(['.', '_'])?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

fn member(member: TypeMember) -> Option<Member> {
    let TypeMember::Definition(definition) = member else {
        return None;
    };
    if !is_of_vulkan(definition.api.as_deref()) {
        return None;
    }
    let len = definition.len;
    let name = definition.markup.into_iter().find_map(|markup| match markup {
        TypeMemberMarkup::Name(text) => Some(text),
        _ => None,
    })?;
    (name != "sType" && name != "pNext").then_some(Member { name, len })
}

fn command_definition(definition: CommandDefinition) -> (String, Command) {
    let parameters = definition
        .params
        .into_iter()
        .filter(|parameter| is_of_vulkan(parameter.api.as_deref()))
        .map(|parameter| Parameter {
            name: parameter.definition.name,
            ty: parameter.definition.type_name.unwrap_or_default(),
            len: parameter.len,
        })
        .collect();
    (definition.proto.name, Command { parameters })
}

fn requirement<T>(by: T, child: ExtensionChild) -> Option<Requirement<T>> {
    let ExtensionChild::Require { api, depends, items, .. } = child else {
        return None;
    };
    if !is_of_vulkan(api.as_deref()) {
        return None;
    }
    let mut requirement = Requirement { by, depends, types: Vec::new(), commands: Vec::new(), features: Vec::new() };
    for item in items {
        match item {
            InterfaceItem::Type { name, .. } => requirement.types.push(name),
            InterfaceItem::Command { name, .. } => requirement.commands.push(name),
            InterfaceItem::Feature { name, struct_, .. } => {
                // One row may name several members.
                for name in name.split(',') {
                    requirement.features.push((struct_.clone(), name.to_owned()));
                }
            }
            _ => {}
        }
    }
    Some(requirement)
}

fn extension(extension: vk_parse::Extension) -> Option<Extension> {
    if !is_of_vulkan(extension.supported.as_deref()) {
        return None;
    }
    Some(Extension {
        spec_version: spec_version(&extension).unwrap_or(0),
        is_of_instance: extension.ext_type.as_deref() == Some("instance"),
        promoted_to: extension.promotedto,
        depends: extension.depends,
        requirements: extension.children.into_iter().filter_map(|child| requirement((), child)).collect(),
        name: extension.name,
    })
}

fn spec_version(extension: &vk_parse::Extension) -> Option<u32> {
    extension.children.iter().find_map(|child| {
        let ExtensionChild::Require { items, .. } = child else {
            return None;
        };
        items.iter().find_map(|item| match item {
            InterfaceItem::Enum(constant) if constant.name.ends_with("_SPEC_VERSION") => match &constant.spec {
                vk_parse::EnumSpec::Value { value, .. } => value.parse().ok(),
                _ => None,
            },
            _ => None,
        })
    })
}

/// Evaluates a condition, where `,` is "or", `+` is "and", and both bind from left to right, as in the registry.
pub fn holds(condition: &str, is_there: &dyn Fn(&str) -> bool) -> bool {
    let mut rest = condition;
    evaluate(&mut rest, is_there)
}

fn evaluate(rest: &mut &str, is_there: &dyn Fn(&str) -> bool) -> bool {
    let mut value = operand(rest, is_there);
    while let Some(operator) = rest.chars().next().filter(|c| matches!(c, ',' | '+')) {
        *rest = &rest[1..];
        let next = operand(rest, is_there);
        value = if operator == ',' { value || next } else { value && next };
    }
    value
}

fn operand(rest: &mut &str, is_there: &dyn Fn(&str) -> bool) -> bool {
    if let Some(inner) = rest.strip_prefix('(') {
        *rest = inner;
        let value = evaluate(rest, is_there);
        *rest = rest.strip_prefix(')').unwrap_or(rest);
        return value;
    }
    let end = rest.find([',', '+', '(', ')']).unwrap_or(rest.len());
    let (name, after) = rest.split_at(end);
    *rest = after;
    is_there(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_evaluated() {
        let is_there = |name: &str| matches!(name, "a" | "b" | "S::c");
        for (condition, expected) in [
            ("a", true),
            ("x", false),
            ("x,a", true),
            ("a+x", false),
            ("a+S::c", true),
            ("(x+a),b", true),
            ("(x,a)+(b,y)", true),
            ("((x,a)+y),x", false),
        ] {
            assert_eq!(holds(condition, &is_there), expected, "{condition}");
        }
    }

    #[test]
    fn versions_are_read() {
        assert_eq!(version("1.3"), Some((1, 3)));
        assert_eq!(version("VK_VERSION_1_2"), Some((1, 2)));
        assert_eq!(version("VK_KHR_maintenance1"), None);
    }
}
