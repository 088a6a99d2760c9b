//! The driver's functions of Vulkan commands: those in `driver/src/entrypoints` with a `#[doc(alias = "vkCommand")]`.

use crate::ash::{Member, type_text};
use crate::error::Error;
use crate::registry;
use std::collections::BTreeMap;
use std::path::Path;
use syn::parse::{Parse, ParseStream};

/// The folder of the functions, and the module that it is.
const FOLDER: &str = "driver/src/entrypoints";

/// A function of a command.
#[derive(Debug)]
pub(crate) struct EntryPoint {
    /// Its path within the module of entry points.
    pub(crate) path: String,
    /// It has the command's own parameters, guards itself, and is called by Vulkan.
    pub(crate) is_complete: bool,
    /// It is unsafe to call.
    pub(crate) is_unsafe: bool,
    /// Its parameters.
    pub(crate) parameters: Vec<Member>,
    /// The type that it returns, without the error.
    pub(crate) output: String,
}

/// Functions in an invocation of `entry_points!`.
struct Functions(Vec<syn::ItemFn>);

impl Parse for Functions {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let mut functions = Vec::new();
        while !input.is_empty() {
            functions.push(input.parse()?);
        }
        Ok(Self(functions))
    }
}

/// Finds all functions by the names of their commands.
///
/// # Errors
/// [`Error::EntryPoint`] where two have one command.
pub(crate) fn find(root: &Path) -> Result<BTreeMap<String, EntryPoint>, Error> {
    let folder = root.join(FOLDER);
    let failed = |source| Error::File {
        path: folder.clone(),
        source,
    };
    let mut files = std::fs::read_dir(&folder)
        .map_err(failed)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<Vec<_>, _>>()
        .map_err(failed)?;
    files.retain(|path| path.extension().is_some_and(|extension| extension == "rs"));
    files.sort();
    let mut found = BTreeMap::new();
    for path in files {
        let text = registry::read(&path)?;
        let file = syn::parse_file(&text).map_err(|source| Error::Rust {
            path: path.clone(),
            source,
        })?;
        let module = path.file_stem().unwrap_or_default().to_string_lossy();
        for item in file.items {
            let (functions, is_complete) = match item {
                syn::Item::Fn(function) => (vec![function], false),
                syn::Item::Macro(item) if is_entry_points(&item.mac.path) => {
                    let functions =
                        item.mac
                            .parse_body::<Functions>()
                            .map_err(|source| Error::Rust {
                                path: path.clone(),
                                source,
                            })?;
                    (functions.0, true)
                }
                _ => continue,
            };
            for function in functions {
                for command in commands(&function) {
                    let entry_point = entry_point(&module, is_complete, &function);
                    if let Some(other) = found.insert(command.clone(), entry_point) {
                        return Err(Error::EntryPoint(format!(
                            "{command} has two functions, one of them {}",
                            other.path
                        )));
                    }
                }
            }
        }
    }
    Ok(found)
}

fn is_entry_points(path: &syn::Path) -> bool {
    path.segments
        .last()
        .is_some_and(|segment| segment.ident == "entry_points")
}

/// The commands that a function says it is.
fn commands(function: &syn::ItemFn) -> Vec<String> {
    let mut commands = Vec::new();
    for attribute in &function.attrs {
        if !attribute.path().is_ident("doc") {
            continue;
        }
        // Other documentation isn't a list, and is of no concern here.
        let _ = attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("alias") {
                commands.push(meta.value()?.parse::<syn::LitStr>()?.value());
            }
            Ok(())
        });
    }
    commands.retain(|command| command.starts_with("vk"));
    commands
}

fn entry_point(module: &str, is_complete: bool, function: &syn::ItemFn) -> EntryPoint {
    let parameters = function
        .sig
        .inputs
        .iter()
        .filter_map(|input| match input {
            syn::FnArg::Typed(argument) => match &*argument.pat {
                syn::Pat::Ident(name) => Some(Member {
                    name: name.ident.to_string(),
                    ty: type_text(&argument.ty),
                }),
                _ => None,
            },
            syn::FnArg::Receiver(_) => None,
        })
        .collect();
    EntryPoint {
        path: format!("{module}::{}", function.sig.ident),
        is_complete,
        is_unsafe: function.sig.unsafety.is_some(),
        parameters,
        output: match &function.sig.output {
            syn::ReturnType::Default => "()".to_owned(),
            syn::ReturnType::Type(_, ty) => result(ty),
        },
    }
}

/// The type that a `Result<T, Error>` holds.
fn result(ty: &syn::Type) -> String {
    if let syn::Type::Path(path) = ty
        && let Some(last) = path.path.segments.last()
        && let syn::PathArguments::AngleBracketed(arguments) = &last.arguments
        && let Some(syn::GenericArgument::Type(ty)) = arguments.args.first()
    {
        return type_text(ty);
    }
    type_text(ty)
}
