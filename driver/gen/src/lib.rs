//! Writes the driver's Rust from the Vulkan registry and from SPIR-V's grammar.
//!
//! It reads `vk.xml`, the fragment of the driver's own extension, and `driver/support.toml`, which lists what the
//! driver supports, and writes the files of `driver/src/registry` and the dispatch table. From the fragment alone it
//! writes the extension's files in `api/`, in Rust and in C. From the machine-readable grammar of SPIR-V it writes the
//! table with which modules are decoded. All generated files are checked in, so that building the driver needs neither
//! this crate nor the files that `driver/gen/fetch.sh` downloads. The sources of ash give the Rust names of Vulkan's
//! things.

mod api;
mod ash;
mod chains;
mod commands;
mod dynamic_states;
mod entry_points;
mod error;
mod extensions;
mod features;
mod file;
mod grammar;
mod properties;
mod registry;
mod repository;
mod rust;
mod spirv;
mod support;
mod tables;

pub use error::Error;
pub use file::File;
pub use grammar::generate as generate_grammar;
pub use repository::repository;

use crate::ash::Declarations;
use crate::registry::Registry;
use crate::support::Support;
use std::path::Path;

/// Generates all files from a registry, for the repository that has its root at `root`.
///
/// # Errors
/// Each [`Error`] names what has to be changed, the registry's file, `driver/support.toml`, or the driver.
pub fn generate(root: &Path, vk_xml: &Path) -> Result<Vec<File>, Error> {
    let fragment = root.join("api/spec/vk_gaurast.xml");
    let mut files = api::generate(root, &fragment)?;
    let registry = Registry::read(vk_xml, &fragment)?;
    let support = Support::read(&root.join("driver/support.toml"))?;
    support.check(&registry)?;
    let declarations = Declarations::read(root, &files[0])?;
    files.extend([
        File { path: "driver/src/registry/extensions.rs", text: extensions::write(&registry, &support)? },
        File { path: "driver/src/registry/features.rs", text: features::write(&registry, &declarations, &support)? },
        File {
            path: "driver/src/registry/properties.rs",
            text: properties::write(&registry, &declarations, &support)?,
        },
        File {
            path: "driver/src/dispatch/commands.rs",
            text: commands::write(
                &registry,
                &declarations,
                &support,
                &entry_points::find(root)?,
                &dynamic_states::find(root)?,
            )?,
        },
        File { path: "driver/src/registry/spirv.rs", text: spirv::write(&registry, &declarations, &support)? },
    ]);
    Ok(files)
}
