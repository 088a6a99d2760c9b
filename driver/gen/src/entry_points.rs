//! The driver's functions for Vulkan commands: those in `driver/src` with a `#[doc(alias = "vkCommand")]`.

use crate::ash::{Member, type_text};
use crate::error::Error;
use crate::rust;
use std::collections::BTreeMap;
use std::path::Path;

/// The folder of the driver's modules.
const FOLDER: &str = "driver/src";

/// A function of a command.
#[derive(Debug)]
pub(crate) struct EntryPoint {
    /// Its path from the driver's root.
    pub(crate) path: String,
    /// True if it is unsafe to call.
    pub(crate) is_unsafe: bool,
    /// Its parameters.
    pub(crate) parameters: Vec<Member>,
    /// The type that it returns, without the error.
    pub(crate) output: String,
}

/// Finds all functions, by the names of their commands.
///
/// # Errors
/// [`Error::EntryPoint`] if two functions have the same command.
pub(crate) fn find(root: &Path) -> Result<BTreeMap<String, EntryPoint>, Error> {
    let folder = root.join(FOLDER);
    let mut found = BTreeMap::new();
    for path in rust::source_files(&folder)? {
        let file = rust::parse(&path)?;
        let module = module(path.strip_prefix(&folder).unwrap_or(&path));
        for item in file.items {
            let syn::Item::Fn(function) = item else {
                continue;
            };
            for command in commands(&function) {
                let entry_point = entry_point(&module, &function);
                if let Some(other) = found.insert(command.clone(), entry_point) {
                    return Err(Error::EntryPoint(format!("{command} has two functions, one of them {}", other.path)));
                }
            }
        }
    }
    Ok(found)
}

/// The path of a file's module.
fn module(path: &Path) -> String {
    let path = path.with_extension("");
    let names = path.iter().map(|name| name.to_string_lossy());
    let names: Vec<_> = names.filter(|name| name != "mod").collect();
    names.join("::")
}

/// The commands in a function's `doc(alias)` attributes.
fn commands(function: &syn::ItemFn) -> Vec<String> {
    let mut commands = Vec::new();
    for attribute in &function.attrs {
        if !attribute.path().is_ident("doc") {
            continue;
        }
        // Other documentation isn't a list and is ignored.
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

fn entry_point(module: &str, function: &syn::ItemFn) -> EntryPoint {
    let parameters = function
        .sig
        .inputs
        .iter()
        .filter_map(|input| match input {
            syn::FnArg::Typed(argument) => match &*argument.pat {
                syn::Pat::Ident(name) => Some(Member { name: name.ident.to_string(), ty: type_text(&argument.ty) }),
                _ => None,
            },
            syn::FnArg::Receiver(_) => None,
        })
        .collect();
    EntryPoint {
        path: match module.strip_prefix("dispatch::") {
            Some(sibling) => format!("super::{sibling}::{}", function.sig.ident),
            None => format!("{module}::{}", function.sig.ident),
        },
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
