//! The driver's table of dynamic states. The generator writes the commands that only set one of them.

use crate::ash::type_text;
use crate::error::Error;
use crate::rust;
use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::BTreeMap;
use std::path::Path;

/// The file of the table.
const FILE: &str = "driver/src/pipeline/dynamic_state.rs";

/// The macro whose arguments are the rows.
const TABLE: &str = "dynamic_states";

/// A row of the table.
#[derive(Debug)]
pub(crate) struct Row {
    /// The variant of `DynamicState`.
    pub(crate) variant: String,
    /// True if each face has a state of its own.
    pub(crate) is_of_face: bool,
    /// The name of the value.
    pub(crate) value: String,
    /// The type of the value.
    pub(crate) ty: String,
}

/// Finds all rows by the names of the commands that set them, without an extension's tag.
///
/// # Errors
/// [`Error::File`] and [`Error::Rust`] for a file that can't be read.
pub(crate) fn find(root: &Path) -> Result<BTreeMap<String, Row>, Error> {
    let mut rows = BTreeMap::new();
    for item in rust::parse(&root.join(FILE))?.items {
        let syn::Item::Macro(item) = item else {
            continue;
        };
        if item.mac.path.is_ident(TABLE) {
            let tokens: Vec<TokenTree> = item.mac.tokens.into_iter().collect();
            let ends = |token: &TokenTree| matches!(token, TokenTree::Punct(p) if p.as_char() == ';');
            let parsed = tokens.split(ends).filter_map(row);
            rows.extend(parsed.map(|row| (format!("vkCmdSet{}", row.variant), row)));
        }
    }
    Ok(rows)
}

/// A row that begins with `STATE => Variant(value: Type)` or `STATE => Variant[face](value: Type)`.
fn row(tokens: &[TokenTree]) -> Option<Row> {
    let [_, _, _, TokenTree::Ident(variant), rest @ ..] = tokens else {
        return None;
    };
    let group = |index: usize, delimiter| match rest.get(index) {
        Some(TokenTree::Group(group)) if group.delimiter() == delimiter => Some(group),
        _ => None,
    };
    let is_of_face = group(0, Delimiter::Bracket).is_some();
    let value = group(usize::from(is_of_face), Delimiter::Parenthesis)?;
    let mut tokens = value.stream().into_iter();
    let name = tokens.next()?;
    tokens.next()?;
    let ty: syn::Type = syn::parse2(tokens.collect::<TokenStream>()).ok()?;
    Some(Row { variant: variant.to_string(), is_of_face, value: name.to_string(), ty: type_text(&ty) })
}
