//! Writes the driver's own extensions as `api/` has them, from their fragment of the registry: the Rust of `gaurast`, the
//! C header, the names in C with their values in Rust, by which a test holds one against the other, and the valid usage
//! that the registry implies.
//!
//! A structure has the `Default` that is written by hand among the sources of `gaurast`, or else that of each member.

mod comment;
mod extension;
mod header;
mod implicit;
mod names;
mod rust;

use crate::error::Error;
use crate::file::File;
use crate::rust::{parse, source_files};
use extension::Extension;
use std::collections::BTreeSet;
use std::path::Path;

/// The folder of `gaurast`'s modules.
const SOURCES: &str = "api/gaurast/src";

/// The definitions, whose types the driver's generated files name.
pub(crate) const DEFINITIONS: &str = "api/gaurast/src/vk/definitions.rs";

/// Generates the files of the extensions, whose fragment of the registry is `fragment`.
///
/// # Errors
/// [`Error::File`] and [`Error::Registry`] for a fragment that isn't as expected, [`Error::Rust`] for sources of
/// `gaurast` that aren't.
pub(crate) fn generate(root: &Path, fragment: &Path) -> Result<Vec<File>, Error> {
    let extensions = Extension::read_all(fragment)?;
    let [gaussians, options] = &extensions[..] else {
        let reason = format!("it has {} extensions, not 2", extensions.len());
        return Err(Error::Registry { path: fragment.to_owned(), reason });
    };
    let defaults = defaults(&root.join(SOURCES))?;
    Ok(vec![
        File { path: DEFINITIONS, text: rust::definitions(&extensions, &defaults)? },
        File { path: "api/gaurast/src/gaussian_primitive_topology.rs", text: rust::functions(gaussians)? },
        File { path: "api/gaurast/src/driver_options.rs", text: rust::names(options)? },
        File { path: "api/gaurast/tests/extension/names.rs", text: names::write(&extensions)? },
        File { path: "api/include/vulkan_gaurast.h", text: header::write(&extensions) },
        File { path: "api/spec/implicit_valid_usage.adoc", text: implicit::write(gaussians) },
        File { path: "api/spec/implicit_valid_usage_driver_options.adoc", text: implicit::write(options) },
    ])
}

/// The types whose `Default` is written by hand.
fn defaults(sources: &Path) -> Result<BTreeSet<String>, Error> {
    let mut found = BTreeSet::new();
    for path in source_files(sources)? {
        if path.ends_with("vk/definitions.rs") {
            continue;
        }
        for item in parse(&path)?.items {
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
