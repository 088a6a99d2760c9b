//! The driver's extensions, as their fragment of the registry describes them.

use crate::error::Error;
use crate::registry;
use crate::rust::{file_of, snake_case};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use vk_parse::{
    EnumSpec, EnumsChild, ExtensionChild, InterfaceItem, RegistryChild, TypeMember, TypeMemberMarkup, TypeSpec,
    TypesChild,
};

/// The tag that ends the names of the extension's own things.
pub(super) const TAG: &str = "GAURAST";

/// An extension.
#[derive(Debug, Default)]
pub(super) struct Extension {
    pub(super) name: String,
    pub(super) number: u32,
    pub(super) revision: String,
    /// Constants that belong to no type, with their types and values in C.
    pub(super) constants: Vec<Constant>,
    /// The values that it adds to enums of Vulkan.
    pub(super) added: Vec<Added>,
    /// Its enums and flags.
    pub(super) enums: Vec<Enum>,
    pub(super) callbacks: Vec<Callback>,
    pub(super) structures: Vec<Structure>,
    pub(super) commands: Vec<Command>,
}

impl Extension {
    /// The structures that the `pNext` chain of the one of a name may contain.
    pub(super) fn extending(&self, name: &str) -> impl Iterator<Item = &Structure> {
        self.structures.iter().filter(move |other| other.extends.iter().any(|extended| extended == name))
    }
}

/// A constant.
#[derive(Debug)]
pub(super) struct Constant {
    pub(super) name: String,
    pub(super) value: String,
    pub(super) comment: String,
}

/// A value that the extension adds to an enum of Vulkan.
#[derive(Debug)]
pub(super) struct Added {
    pub(super) name: String,
    /// The enum to which it is added.
    pub(super) of: String,
    pub(super) value: i64,
    pub(super) comment: String,
}

/// An enum, or flags.
#[derive(Debug)]
pub(super) struct Enum {
    /// Its name; for flags, the name of the bits.
    pub(super) name: String,
    pub(super) is_flags: bool,
    pub(super) values: Vec<Value>,
    pub(super) comment: String,
}

/// A value of an enum.
#[derive(Debug)]
pub(super) struct Value {
    pub(super) name: String,
    pub(super) value: i64,
    pub(super) comment: String,
}

/// The type of a function of the application's that the driver calls.
#[derive(Debug)]
pub(super) struct Callback {
    pub(super) name: String,
    pub(super) parameters: Vec<Member>,
    pub(super) comment: String,
}

/// A structure.
#[derive(Debug)]
pub(super) struct Structure {
    pub(super) name: String,
    /// The name of its `sType`'s value, if it has one.
    pub(super) structure_type: Option<String>,
    /// The structures whose `pNext` chains may contain it.
    pub(super) extends: Vec<String>,
    /// True if only the implementation writes it.
    pub(super) is_returned: bool,
    pub(super) members: Vec<Member>,
    pub(super) comment: String,
}

/// A member of a structure, or a parameter of a command.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) name: String,
    /// Its type, without `const`, pointers and lengths.
    pub(super) ty: String,
    pub(super) is_const: bool,
    pub(super) is_pointer: bool,
    /// The lengths of an array, the outermost first.
    pub(super) lengths: Vec<u32>,
    /// The parameter with the number of elements, if the parameter is an array.
    pub(super) counted_by: Option<String>,
    pub(super) comment: String,
}

/// A command.
#[derive(Debug)]
pub(super) struct Command {
    pub(super) name: String,
    pub(super) parameters: Vec<Member>,
    /// The kinds of queues whose command buffers may have it, with commas between.
    pub(super) queues: String,
    /// `inside`, `outside` or `both`.
    pub(super) render_pass: String,
    pub(super) comment: String,
}

impl Enum {
    /// The name of the type: for bits, that of the flags.
    pub(super) fn type_name(&self) -> String {
        self.name.replace("FlagBits", "Flags")
    }

    /// The prefix of its values' names.
    pub(super) fn prefix(&self) -> String {
        let name = self.name.trim_end_matches(TAG).replace("FlagBits", "");
        snake_case(&name).to_uppercase()
    }

    /// The name of a value in Rust.
    pub(super) fn short_name<'a>(&self, value: &'a Value) -> &'a str {
        let name = value.name.trim_end_matches(TAG).trim_end_matches('_');
        let name = name.trim_end_matches(if self.is_flags { "_BIT" } else { "" });
        let prefix = format!("{}_", self.prefix());
        name.strip_prefix(&prefix).unwrap_or(name)
    }
}

/// The name of a type in Rust.
pub(super) fn rust_name(name: &str) -> &str {
    name.strip_prefix("Vk").unwrap_or(name)
}

/// The Rust name of a constant, or of a value outside a type.
pub(super) fn rust_constant(name: &str) -> &str {
    name.strip_prefix("VK_").unwrap_or(name)
}

/// A Rust file that is generated from the fragment alone.
pub(super) fn rust_file(documentation: &str, code: &str) -> Result<String, Error> {
    file_of("api/spec/vk_gaurast.xml", documentation, code)
}

impl Extension {
    /// Reads the extensions of a fragment, each with the definitions that it requires.
    pub(super) fn read_all(path: &Path) -> Result<Vec<Self>, Error> {
        // The definitions of all extensions, as if they were one's.
        let mut defined = Self::default();
        let mut extensions = Vec::new();
        for child in registry::parse(path)? {
            match child {
                RegistryChild::Types(types) => {
                    for child in types.children {
                        let TypesChild::Type(ty) = child else {
                            continue;
                        };
                        match ty.spec {
                            TypeSpec::Members(_) => defined.structures.extend(structure(ty)),
                            TypeSpec::Funcpointer(code) => {
                                defined.callbacks.push(callback(&code, ty.comment.unwrap_or_default()));
                            }
                            _ => {}
                        }
                    }
                }
                RegistryChild::Enums(enums) => defined.add_enums(enums),
                RegistryChild::Commands(commands) => {
                    let commands = commands.children.into_iter();
                    defined.commands.extend(commands.filter_map(command));
                }
                RegistryChild::Extensions(found) => extensions.extend(found.children),
                _ => {}
            }
        }
        let take = |extension: vk_parse::Extension| {
            let name = extension.name.clone();
            Self::take(extension, &mut defined).ok_or_else(|| Error::Registry {
                path: PathBuf::from(path),
                reason: format!("{name} has no number or no revision"),
            })
        };
        extensions.into_iter().map(take).collect()
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
                        EnumSpec::Bitpos { bitpos, .. } => {
                            made.values.push(Value { name: value.name, value: 1 << bitpos, comment });
                        }
                        EnumSpec::Value { value: number, .. } => {
                            self.constants.push(Constant { name: value.name, value: number, comment });
                        }
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

    /// An extension with what it requires, which is taken from the definitions; `None` if it has no number or revision.
    fn take(extension: vk_parse::Extension, defined: &mut Self) -> Option<Self> {
        let mut taken =
            Self { name: extension.name, number: u32::try_from(extension.number?).ok()?, ..Self::default() };
        let mut required = BTreeSet::new();
        for child in extension.children {
            let ExtensionChild::Require { items, .. } = child else {
                continue;
            };
            for item in items {
                match item {
                    InterfaceItem::Enum(value) => {
                        required.insert(value.name.clone());
                        taken.add_value(value);
                    }
                    InterfaceItem::Type { name, .. } | InterfaceItem::Command { name, .. } => {
                        required.insert(name);
                    }
                    _ => {}
                }
            }
        }
        taken.constants = extract(&mut defined.constants, |constant| required.contains(&constant.name));
        taken.enums = extract(&mut defined.enums, |of| required.contains(&of.name));
        taken.callbacks = extract(&mut defined.callbacks, |callback| required.contains(&callback.name));
        taken.structures = extract(&mut defined.structures, |structure| required.contains(&structure.name));
        taken.commands = extract(&mut defined.commands, |command| required.contains(&command.name));
        (!taken.revision.is_empty()).then_some(taken)
    }

    /// Adds a value of the extension's own list: its revision, or one that it adds to an enum of Vulkan.
    fn add_value(&mut self, value: vk_parse::Enum) {
        match value.spec {
            EnumSpec::Offset { offset, extends, .. } => self.added.push(Added {
                name: value.name,
                of: extends,
                value: self.first_value() + offset,
                comment: value.comment.unwrap_or_default(),
            }),
            EnumSpec::Value { value: text, .. } if value.name.ends_with("_SPEC_VERSION") => self.revision = text,
            _ => {}
        }
    }

    /// The first of the values that it may add to enums of Vulkan.
    pub(super) fn first_value(&self) -> i64 {
        1_000_000_000 + (i64::from(self.number) - 1) * 1000
    }

    /// The prefix of the names of its C macros.
    pub(super) fn macro_name(&self) -> String {
        self.name.to_uppercase()
    }
}

/// Removes the elements that are wanted, and returns them in order.
fn extract<T>(from: &mut Vec<T>, is_wanted: impl Fn(&T) -> bool) -> Vec<T> {
    from.extract_if(.., |element| is_wanted(element)).collect()
}

fn callback(code: &vk_parse::FuncpointerCode, comment: String) -> Callback {
    Callback {
        name: code.proto.name.clone(),
        parameters: code.params.iter().map(|parameter| Member::declared(&parameter.code)).collect(),
        comment,
    }
}

fn structure(ty: vk_parse::Type) -> Option<Structure> {
    let TypeSpec::Members(children) = ty.spec else {
        return None;
    };
    let mut structure = Structure {
        name: ty.name?,
        structure_type: None,
        is_returned: ty.returnedonly.as_deref() == Some("true"),
        extends: ty.structextends.iter().flat_map(|names| names.split(',')).map(str::to_owned).collect(),
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
            .map(|parameter| Member {
                counted_by: parameter.len.clone(),
                ..Member::declared(&parameter.definition.code)
            })
            .collect(),
        queues: definition.queues.unwrap_or_default(),
        render_pass: definition.renderpass.unwrap_or_default(),
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
            lengths: lengths.split(['[', ']']).filter_map(|length| length.parse().ok()).collect(),
            counted_by: None,
            comment: String::new(),
        }
    }

    /// Its type in C, without the lengths of an array.
    pub(super) fn c_type(&self) -> String {
        let constant = if self.is_const { "const " } else { "" };
        let pointer = if self.is_pointer { "*" } else { "" };
        format!("{constant}{}{pointer}", self.ty)
    }

    /// Its name in Rust.
    pub(super) fn rust_name(&self) -> String {
        snake_case(&self.name)
    }
}
