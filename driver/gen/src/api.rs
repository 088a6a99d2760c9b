//! Writes the driver's own extension as `api/` has it, from the extension's fragment of the registry: the Rust of
//! `gaurast`, the C header, and the names in C with their values in Rust, by which a test holds one against the other.
//!
//! A structure has the `Default` that is written by hand among the sources of `gaurast`, or else each member's own.

mod comment;
mod header;
mod names;
mod rust;

use crate::File;
use crate::error::Error;
use crate::registry;
use crate::rust::{self as rust_source, file_of, snake_case};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use vk_parse::{
    EnumSpec, EnumsChild, ExtensionChild, InterfaceItem, RegistryChild, TypeMember,
    TypeMemberMarkup, TypeSpec, TypesChild,
};

/// The folder of `gaurast`'s modules.
const SOURCES: &str = "api/gaurast/src";

/// The definitions, whose types the driver's generated files name.
pub(crate) const DEFINITIONS: &str = "api/gaurast/src/vk/definitions.rs";

/// The tag that ends the names of the extension's own things.
const TAG: &str = "GAURAST";

/// The extension.
#[derive(Debug)]
struct Extension {
    name: String,
    number: u32,
    revision: String,
    /// Constants that belong to no type, with their types and values in C.
    constants: Vec<Constant>,
    /// The values that it adds to enums of Vulkan's.
    added: Vec<Added>,
    /// Its enums and flags.
    enums: Vec<Enum>,
    structures: Vec<Structure>,
    commands: Vec<Command>,
}

/// A constant.
#[derive(Debug)]
struct Constant {
    name: String,
    value: String,
    comment: String,
}

/// A value of an enum of Vulkan's.
#[derive(Debug)]
struct Added {
    name: String,
    /// The enum that it is of.
    of: String,
    value: i64,
    comment: String,
}

/// An enum, or flags.
#[derive(Debug)]
struct Enum {
    /// Its name; that of the bits, if it is one of flags.
    name: String,
    is_flags: bool,
    values: Vec<Value>,
    comment: String,
}

/// A value of an enum.
#[derive(Debug)]
struct Value {
    name: String,
    value: i64,
    comment: String,
}

/// A structure.
#[derive(Debug)]
struct Structure {
    name: String,
    /// The name of its `sType`'s value, if it has one.
    structure_type: Option<String>,
    /// The structures whose chains it may stand in.
    extends: Vec<String>,
    members: Vec<Member>,
    comment: String,
}

/// A member of a structure, or a parameter of a command.
#[derive(Debug)]
struct Member {
    name: String,
    /// Its type, without `const`, pointers and lengths.
    ty: String,
    is_const: bool,
    is_pointer: bool,
    /// The lengths of an array, the outermost first.
    lengths: Vec<u32>,
    comment: String,
}

/// A command.
#[derive(Debug)]
struct Command {
    name: String,
    parameters: Vec<Member>,
    comment: String,
}

impl Enum {
    /// The name of its type: that of the flags for bits.
    fn type_name(&self) -> String {
        self.name.replace("FlagBits", "Flags")
    }

    /// The words that its values' names begin with.
    fn prefix(&self) -> String {
        let name = self.name.trim_end_matches(TAG).replace("FlagBits", "");
        snake_case(&name).to_uppercase()
    }

    /// The name of a value in Rust.
    fn short_name<'a>(&self, value: &'a Value) -> &'a str {
        let name = value.name.trim_end_matches(TAG).trim_end_matches('_');
        let name = name.trim_end_matches(if self.is_flags { "_BIT" } else { "" });
        let prefix = format!("{}_", self.prefix());
        name.strip_prefix(&prefix).unwrap_or(name)
    }
}

/// The name of a type in Rust.
fn rust_name(name: &str) -> &str {
    name.strip_prefix("Vk").unwrap_or(name)
}

/// The name of a constant or a value in Rust, where it stands in no type.
fn rust_constant(name: &str) -> &str {
    name.strip_prefix("VK_").unwrap_or(name)
}

/// Generates the files of the extension, whose fragment of the registry is `fragment`.
///
/// # Errors
/// [`Error::File`] and [`Error::Registry`] for a fragment that isn't as expected, [`Error::Rust`] for sources of
/// `gaurast` that aren't.
pub(crate) fn generate(root: &Path, fragment: &Path) -> Result<Vec<File>, Error> {
    let extension = Extension::read(fragment)?;
    let defaults = defaults(&root.join(SOURCES))?;
    Ok(vec![
        File {
            path: DEFINITIONS,
            text: rust::definitions(&extension, &defaults)?,
        },
        File {
            path: "api/gaurast/src/gaussian_primitive_topology.rs",
            text: rust::functions(&extension)?,
        },
        File {
            path: "api/gaurast/tests/extension/names.rs",
            text: names::write(&extension)?,
        },
        File {
            path: "api/include/vulkan_gaurast.h",
            text: header::write(&extension),
        },
    ])
}

/// A file of Rust that is made of the fragment alone.
fn rust_file(documentation: &str, code: &str) -> Result<String, Error> {
    file_of("api/spec/vk_gaurast.xml", documentation, code)
}

/// The types that have a `Default` by hand.
fn defaults(sources: &Path) -> Result<BTreeSet<String>, Error> {
    let mut found = BTreeSet::new();
    for path in rust_source::source_files(sources)? {
        if path.ends_with("vk/definitions.rs") {
            continue;
        }
        for item in rust_source::parse(&path)?.items {
            if let syn::Item::Impl(item) = item
                && let Some((_, name, _)) = &item.trait_
                && name.is_ident("Default")
                && let syn::Type::Path(of) = &*item.self_ty
                && let Some(last) = of.path.segments.last()
            {
                found.insert(last.ident.to_string());
            }
        }
    }
    Ok(found)
}

impl Extension {
    fn read(path: &Path) -> Result<Self, Error> {
        let mut read = Self {
            name: String::new(),
            number: 0,
            revision: String::new(),
            constants: Vec::new(),
            added: Vec::new(),
            enums: Vec::new(),
            structures: Vec::new(),
            commands: Vec::new(),
        };
        let mut extension = None;
        for child in registry::parse(path)? {
            match child {
                RegistryChild::Types(types) => {
                    let types = types.children.into_iter();
                    read.structures.extend(types.filter_map(structure));
                }
                RegistryChild::Enums(enums) => read.add_enums(enums),
                RegistryChild::Commands(commands) => {
                    let commands = commands.children.into_iter();
                    read.commands.extend(commands.filter_map(command));
                }
                RegistryChild::Extensions(extensions) => {
                    extension = extensions.children.into_iter().next();
                }
                _ => {}
            }
        }
        read.add_extension(extension)
            .ok_or_else(|| Error::Registry {
                path: PathBuf::from(path),
                reason: "it has no extension with a number and a revision".to_owned(),
            })?;
        Ok(read)
    }

    fn add_enums(&mut self, enums: vk_parse::Enums) {
        let name = enums.name.unwrap_or_default();
        let is_of_type = name.starts_with("Vk");
        let mut made = Enum {
            is_flags: enums.kind.as_deref() == Some("bitmask"),
            name,
            values: Vec::new(),
            comment: String::new(),
        };
        for child in enums.children {
            match child {
                EnumsChild::Comment(text) => made.comment = text,
                EnumsChild::Enum(value) => {
                    let comment = value.comment.unwrap_or_default();
                    match value.spec {
                        EnumSpec::Value { value: number, .. } if is_of_type => {
                            made.values.push(Value {
                                name: value.name,
                                value: number.parse().unwrap_or_default(),
                                comment,
                            });
                        }
                        EnumSpec::Bitpos { bitpos, .. } => made.values.push(Value {
                            name: value.name,
                            value: 1 << bitpos,
                            comment,
                        }),
                        EnumSpec::Value { value: number, .. } => self.constants.push(Constant {
                            name: value.name,
                            value: number,
                            comment,
                        }),
                        _ => {}
                    }
                }
                EnumsChild::Unused(_) | _ => {}
            }
        }
        if is_of_type {
            self.enums.push(made);
        }
    }

    fn add_extension(&mut self, extension: Option<vk_parse::Extension>) -> Option<()> {
        let extension = extension?;
        self.number = u32::try_from(extension.number?).ok()?;
        let first = 1_000_000_000 + (i64::from(self.number) - 1) * 1000;
        for child in extension.children {
            let ExtensionChild::Require { items, .. } = child else {
                continue;
            };
            for item in items {
                let InterfaceItem::Enum(value) = item else {
                    continue;
                };
                match value.spec {
                    EnumSpec::Offset {
                        offset, extends, ..
                    } => self.added.push(Added {
                        name: value.name,
                        of: extends,
                        value: first + offset,
                        comment: value.comment.unwrap_or_default(),
                    }),
                    EnumSpec::Value { value: text, .. }
                        if value.name.ends_with("_SPEC_VERSION") =>
                    {
                        self.revision = text;
                    }
                    _ => {}
                }
            }
        }
        self.name = extension.name;
        (!self.revision.is_empty()).then_some(())
    }

    /// The name in C that the names of its macros begin with.
    fn macro_name(&self) -> String {
        self.name.to_uppercase()
    }
}

fn structure(ty: TypesChild) -> Option<Structure> {
    let TypesChild::Type(ty) = ty else {
        return None;
    };
    let TypeSpec::Members(children) = ty.spec else {
        return None;
    };
    let mut structure = Structure {
        name: ty.name?,
        structure_type: None,
        extends: ty
            .structextends
            .iter()
            .flat_map(|names| names.split(','))
            .map(str::to_owned)
            .collect(),
        members: Vec::new(),
        comment: String::new(),
    };
    for child in children {
        match child {
            TypeMember::Comment(text) => structure.comment = text,
            TypeMember::Definition(definition) => {
                structure.structure_type = structure.structure_type.or(definition.values);
                let mut member = Member::declared(&definition.code);
                for markup in definition.markup {
                    if let TypeMemberMarkup::Comment(text) = markup {
                        member.comment = text;
                    }
                }
                structure.members.push(member);
            }
            _ => {}
        }
    }
    Some(structure)
}

fn command(command: vk_parse::Command) -> Option<Command> {
    let vk_parse::Command::Definition(definition) = command else {
        return None;
    };
    Some(Command {
        name: definition.proto.name,
        parameters: definition
            .params
            .iter()
            .map(|parameter| Member::declared(&parameter.definition.code))
            .collect(),
        comment: definition.comment.unwrap_or_default(),
    })
}

impl Member {
    /// A member from its declaration in C.
    fn declared(code: &str) -> Self {
        let code = code.trim();
        let (declaration, lengths) = code.split_once('[').unwrap_or((code, ""));
        let words = declaration.replace('*', " ");
        let mut words: Vec<&str> = words.split_whitespace().collect();
        let name = words.pop().unwrap_or_default().to_owned();
        Self {
            name,
            ty: words.pop().unwrap_or_default().to_owned(),
            is_const: words.contains(&"const"),
            is_pointer: declaration.contains('*'),
            lengths: lengths
                .split(['[', ']'])
                .filter_map(|length| length.parse().ok())
                .collect(),
            comment: String::new(),
        }
    }

    /// Its type in C, without the lengths of an array.
    fn c_type(&self) -> String {
        let constant = if self.is_const { "const " } else { "" };
        let pointer = if self.is_pointer { "*" } else { "" };
        format!("{constant}{}{pointer}", self.ty)
    }

    /// Its name in Rust.
    fn rust_name(&self) -> String {
        snake_case(&self.name)
    }
}
