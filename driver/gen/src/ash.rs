//! Declarations of ash, of gaurast, and of the driver for what is newer than ash: the Rust names and types of the
//! registry's structures and commands.

use crate::error::Error;
use crate::file::File;
use crate::registry::{Registry, Version};
use crate::rust;
use proc_macro2::{Group, TokenStream, TokenTree};
use quote::ToTokens;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The newest core version that ash declares.
pub(crate) const VERSION: Version = (1, 3);

/// The driver's declarations of structures that are newer than ash.
const NEWER: &str = "driver/src/registry/newer.rs";

/// All declarations.
#[derive(Debug, Default)]
pub struct Declarations {
    structures: HashMap<String, Structure>,
    functions: HashMap<String, Function>,
}

/// A structure as it is declared.
#[derive(Debug)]
pub struct Structure {
    /// Its type, with its path, and with an elided lifetime if it has one.
    pub ty: String,
    /// Its members, without `s_type`, `p_next` and the marker of a lifetime.
    pub members: Vec<Member>,
}

/// A member of a structure, or a parameter of a function.
#[derive(Clone, Debug)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// Its type, with paths.
    pub ty: String,
}

/// The type of a command's function.
#[derive(Debug)]
pub struct Function {
    /// The type's name, with its path.
    pub ty: String,
    /// Its parameters.
    pub parameters: Vec<Member>,
    /// The type that it returns.
    pub output: Option<String>,
}

impl Declarations {
    /// Reads the sources of ash, which `cargo metadata` finds, and the definitions of gaurast, which are given.
    ///
    /// # Errors
    /// [`Error::Program`] if cargo doesn't know ash; [`Error::File`] and [`Error::Rust`] if its source has an
    /// unexpected form.
    pub fn read(root: &Path, gaurast: &File) -> Result<Self, Error> {
        let ash = ash_folder(root)?.join("src/vk");
        let mut declarations = Self::default();
        for name in ["definitions.rs", "features.rs", "extensions.rs"] {
            declarations.add(rust::parse(&ash.join(name))?);
        }
        declarations.add_newer(rust::parse(&root.join(NEWER))?);
        declarations
            .add(syn::parse_file(&gaurast.text).map_err(|source| Error::Rust { path: gaurast.path.into(), source })?);
        Ok(declarations)
    }

    fn add(&mut self, file: syn::File) {
        file.items.into_iter().for_each(|item| self.add_item(item));
    }

    /// Adds declarations of the driver.
    fn add_newer(&mut self, file: syn::File) {
        let path = |name: &str| format!("crate::registry::newer::{name}");
        for item in file.items {
            match item {
                syn::Item::Struct(item) => {
                    let name = item.ident.to_string();
                    let members = item.fields.into_iter().filter_map(member).collect();
                    self.structures.insert(name.clone(), Structure { ty: path(&name), members });
                }
                syn::Item::Type(item) => {
                    let name = item.ident.to_string();
                    if let (Some(command), syn::Type::BareFn(function)) = (name.strip_prefix("PFN_"), *item.ty) {
                        self.functions.insert(command.to_owned(), signature(path(&name), function));
                    }
                }
                _ => {}
            }
        }
    }

    fn add_item(&mut self, item: syn::Item) {
        match item {
            syn::Item::Struct(item) => {
                let name = item.ident.to_string();
                let lifetime = if item.generics.params.is_empty() { "" } else { "<'_>" };
                let structure = Structure {
                    ty: format!("{}{lifetime}", with_path(&name)),
                    members: item.fields.into_iter().filter_map(member).collect(),
                };
                self.structures.insert(name, structure);
            }
            syn::Item::Type(item) => {
                let name = item.ident.to_string();
                if let (Some(command), syn::Type::BareFn(function)) = (name.strip_prefix("PFN_"), *item.ty) {
                    let path = if name.ends_with("GAURAST") { "gaurast::vk" } else { "vk" };
                    let function = signature(format!("{path}::{name}"), function);
                    self.functions.insert(command.to_owned(), function);
                }
            }
            _ => {}
        }
    }

    /// A structure of the registry, under any of its names.
    ///
    /// # Errors
    /// [`Error::Undeclared`].
    pub fn structure(&self, registry: &Registry, name: &str) -> Result<&Structure, Error> {
        registry
            .type_names(name)
            .into_iter()
            .find_map(|name| self.structures.get(name.strip_prefix("Vk")?))
            .ok_or_else(|| Error::Undeclared(name.to_owned()))
    }

    /// The function of a command of the registry, under any of its names.
    ///
    /// # Errors
    /// [`Error::Undeclared`].
    pub fn function(&self, registry: &Registry, name: &str) -> Result<&Function, Error> {
        registry
            .command_names(name)
            .into_iter()
            .find_map(|name| self.functions.get(name))
            .ok_or_else(|| Error::Undeclared(name.to_owned()))
    }
}

/// The folder of ash's sources.
fn ash_folder(root: &Path) -> Result<PathBuf, Error> {
    let failed = |reason: String| Error::Program { program: "cargo metadata", reason };
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = std::process::Command::new(cargo)
        .args(["metadata", "--format-version", "1"])
        .current_dir(root)
        .output()
        .map_err(|error| failed(error.to_string()))?;
    let metadata: serde_json::Value =
        serde_json::from_slice(&output.stdout).map_err(|error| failed(error.to_string()))?;
    metadata["packages"]
        .as_array()
        .into_iter()
        .flatten()
        .find(|package| package["name"] == "ash")
        .and_then(|package| Path::new(package["manifest_path"].as_str()?).parent())
        .map(Path::to_owned)
        .ok_or_else(|| failed("it knows no ash".to_owned()))
}

fn member(field: syn::Field) -> Option<Member> {
    let name = field.ident?.to_string();
    (!matches!(name.as_str(), "s_type" | "p_next" | "_marker")).then(|| Member { name, ty: type_text(&field.ty) })
}

fn signature(ty: String, function: syn::TypeBareFn) -> Function {
    Function {
        ty,
        parameters: function
            .inputs
            .into_iter()
            .map(|argument| Member {
                name: argument.name.map(|(name, _)| name.to_string()).unwrap_or_default(),
                ty: type_text(&argument.ty),
            })
            .collect(),
        output: match function.output {
            syn::ReturnType::Default => None,
            syn::ReturnType::Type(_, ty) => Some(type_text(&ty)),
        },
    }
}

/// A type's text, with paths and without the names of lifetimes.
pub(crate) fn type_text(ty: &syn::Type) -> String {
    with_paths(ty.to_token_stream()).to_string().replace("'a", "'_")
}

fn with_paths(tokens: TokenStream) -> TokenStream {
    let mut tokens = tokens.into_iter().peekable();
    let mut text = TokenStream::new();
    while let Some(token) = tokens.next() {
        let TokenTree::Ident(name) = &token else {
            match token {
                TokenTree::Group(group) => {
                    let inner = with_paths(group.stream());
                    text.extend([TokenTree::from(Group::new(group.delimiter(), inner))]);
                }
                other => text.extend([other]),
            }
            continue;
        };
        let is_colon = |token: &TokenTree| matches!(token, TokenTree::Punct(p) if p.as_char() == ':');
        if tokens.next_if(is_colon).is_some() {
            // The name of a module is skipped: a new path replaces it.
            tokens.next_if(is_colon);
        } else {
            text.extend(with_path(&name.to_string()).parse::<TokenStream>());
        }
    }
    text
}

/// The path of a name that one of the crates declares.
fn with_path(name: &str) -> String {
    if name.starts_with("c_") {
        format!("std::ffi::{name}")
    } else if name.starts_with("xcb_") || name.starts_with("wl_") {
        format!("vk::{name}")
    } else if !name.starts_with(|c: char| c.is_ascii_uppercase()) || name == "Option" {
        name.to_owned()
    } else if name.ends_with("GAURAST") {
        format!("gaurast::vk::{name}")
    } else {
        format!("vk::{name}")
    }
}
