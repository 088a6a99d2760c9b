//! Writes `registry/extensions.rs`.

use crate::error::Error;
use crate::registry::Registry;
use crate::rust;
use crate::support::Support;

pub(crate) fn write(registry: &Registry, support: &Support) -> Result<String, Error> {
    let rows = |is_of_instance: bool| -> String {
        let mut extensions: Vec<_> = support
            .extension
            .keys()
            .filter_map(|name| registry.extension(name))
            .filter(|extension| extension.is_of_instance == is_of_instance)
            .collect();
        // The driver's own extensions come first.
        extensions.sort_by_key(|extension| !extension.name.starts_with("VK_GAURAST"));
        extensions
            .into_iter()
            .map(|extension| format!("(c\"{}\", {}),\n", extension.name, extension.spec_version))
            .collect()
    };
    rust::file(
        "//! The extensions.",
        &format!(
            "use std::ffi::CStr;

            /// An extension's name and the version of its specification.
            pub(crate) type Extension = (&'static CStr, u32);

            /// The instance extensions.
            pub(crate) const INSTANCE: &[Extension] = &[{}];

            /// The device extensions.
            pub(crate) const DEVICE: &[Extension] = &[{}];
            ",
            rows(true),
            rows(false),
        ),
    )
}
