//! Writes the facts that the C header must share with the Rust, as C expressions with their values.

use super::extension::{Extension, Structure, rust_constant, rust_file, rust_name};
use crate::error::Error;
use std::fmt::Write;

pub(super) fn write(extensions: &[Extension]) -> Result<String, Error> {
    let (mut layout, mut values) = (String::new(), String::new());
    for extension in extensions {
        extension.structures.iter().for_each(|structure| add_structure(&mut layout, structure));
        add_values(&mut values, extension);
    }
    rust_file(
        "//! The extensions' names in C, with what they are in Rust.",
        &format!(
            "use core::mem::offset_of;
            use gaurast::vk::*;

            /// Sizes of structures and offsets of members.
            pub const LAYOUT: &[(&str, usize)] = &[{layout}];

            /// Values of enums, flags and constants.
            pub const VALUES: &[(&str, i64)] = &[{values}];
            "
        ),
    )
}

fn add_values(values: &mut String, extension: &Extension) {
    let mut add = |name: &str, value: &str| {
        let _ = writeln!(values, "(\"{name}\", {value} as i64),");
    };
    for constant in &extension.constants {
        add(&constant.name, rust_constant(&constant.name));
    }
    for added in &extension.added {
        let value = format!("{}.as_raw()", rust_constant(&added.name));
        add(&added.name, &value);
    }
    for of in &extension.enums {
        let ty = of.type_name();
        for value in &of.values {
            let path = format!("{}::{}.as_raw()", rust_name(&ty), of.short_name(value));
            add(&value.name, &path);
        }
    }
}

fn add_structure(layout: &mut String, structure: &Structure) {
    let c = &structure.name;
    let lifetime = if structure.structure_type.is_some() { "<'_>" } else { "" };
    let rust = format!("{}{lifetime}", rust_name(c));
    let _ = writeln!(layout, "(\"sizeof({c})\", size_of::<{rust}>()),");
    for member in &structure.members {
        let _ = writeln!(layout, "(\"offsetof({c}, {})\", offset_of!({rust}, {})),", member.name, member.rust_name());
    }
}
